//! Built-in mesh and conversion; faces with folded patches are divided more finely.

use super::{ConvertError, ConvertOptions, ConvertReport, convert};
use kanagata_cad::Model;
use kanagata_mesh::mapped::MappedOptions;
use kanagata_mesh::mapped::plan::Plan;
use kanagata_mesh::{MeshError, SurfaceMesh};
use kanagata_tool::ToolModel;

/// Maximum rounds of refinement of faces with folded patches.
const ROUNDS_MAX: usize = 12;
/// Rounds without a reduction of the number of folded patches after which the refinement stops.
const STAGNANT_ROUNDS_MAX: usize = 4;
/// Number of patches, over that of the requested mesh, above which the refinement stops.
const PATCH_RATIO_MAX: usize = 16;

/// Work limit, in patches over all refined meshes: `TOTAL_PATCHES_MAX + TOTAL_PATCHES_RATIO_MAX * patches of the
/// requested mesh`. The largest need of 60 files until no patch folds is 4093, for 207 requested patches. Doubled:
/// faces that fold at any size take twice as long.
const TOTAL_PATCHES_MAX: usize = 10_000;
/// See [`TOTAL_PATCHES_MAX`].
const TOTAL_PATCHES_RATIO_MAX: usize = 4;

/// Reason why no model can be made.
#[derive(Debug, thiserror::Error)]
pub enum UnfoldedError {
    /// Meshing failed.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// Conversion failed.
    #[error(transparent)]
    Convert(#[from] ConvertError),
}

/// Meshes and converts `model` without folded patches where possible.
///
/// A face with folded patches is meshed again with a third more divisions of its edges and its interior. This is
/// repeated until no patch folds or the work limit is reached. [`ConvertReport::finer`] lists these faces. If patches
/// remain folded, their edges become straight. This is needed at borders that meet without an angle, such as the runout
/// of a chamfer.
///
/// # Errors
/// [`UnfoldedError`]: errors of the mesher and of [`convert`].
pub fn mesh_and_convert(
    model: &Model,
    mesh: &MappedOptions,
    options: &ConvertOptions,
) -> Result<(ToolModel, ConvertReport), UnfoldedError> {
    let plan = Plan::new(model, mesh)?.watched(&options.progress);
    let mut requested = RequestedDivisions::initial(&plan, mesh.arc_divisions, model.faces.len());
    let mut best_mesh = plan.mesh(&requested.minima, &requested.density)?;
    let mut best = convert(model, &best_mesh, options)?;
    let most = PATCH_RATIO_MAX * best.0.patches.len();
    let mut left = TOTAL_PATCHES_MAX + TOTAL_PATCHES_RATIO_MAX * best.0.patches.len();
    let mut folded = folded_faces(&best);
    let mut stagnant = 0;
    for _ in 0..ROUNDS_MAX {
        if folded.is_empty() || stagnant == STAGNANT_ROUNDS_MAX {
            break;
        }
        requested.refine(&folded, model, &plan);
        // If the refined mesh fails (too many elements, undefined normal), the best model so far is kept.
        let Ok(mesh) = plan.mesh(&requested.minima, &requested.density) else { break };
        let Some(rest) = left.checked_sub(mesh.elements.len()) else { break };
        left = rest;
        let Ok(next) = convert(model, &mesh, options) else { break };
        if next.0.patches.len() > most {
            break;
        }
        folded = folded_faces(&next);
        stagnant += 1;
        if next.1.folded.len() < best.1.folded.len() {
            (best, best_mesh) = (next, mesh);
            best.1.finer = requested.refined_faces();
            stagnant = 0;
        }
    }
    if !best.1.folded.is_empty() {
        best = convert_straightened(model, &best_mesh, options, best.1.finer)?;
    }
    Ok(best)
}

/// Divisions requested from the mesher.
struct RequestedDivisions {
    /// Minimum divisions of each edge.
    minima: Vec<usize>,
    /// Divisions per quarter turn inside each face.
    density: Vec<usize>,
    /// True for each face that was refined.
    finer: Vec<bool>,
}

impl RequestedDivisions {
    /// The minimum divisions of the plan, and `density` divisions per quarter turn inside all faces.
    fn initial(plan: &Plan, density: usize, faces: usize) -> Self {
        let minima = plan.minima().to_vec();
        Self { minima, density: vec![density; faces], finer: vec![false; faces] }
    }

    /// Refines faces and their edges by a third.
    fn refine(&mut self, faces: &[usize], model: &Model, plan: &Plan) {
        let counts = plan.agree(&self.minima).counts;
        for &f in faces {
            self.finer[f] = true;
            self.density[f] = refined_count(self.density[f]);
            let uses = model.faces[f].loops.iter().flat_map(|l| &l.uses);
            for e in uses.filter_map(|u| u.edge) {
                self.minima[e] = self.minima[e].max(refined_count(counts[e]));
            }
        }
    }

    /// Lists the refined faces.
    fn refined_faces(&self) -> Vec<usize> {
        (0..self.finer.len()).filter(|&f| self.finer[f]).collect()
    }
}

/// Converts a mesh with straight edges of the patches that remain folded; `finer` is entered in the report.
fn convert_straightened(
    model: &Model,
    mesh: &SurfaceMesh,
    options: &ConvertOptions,
    finer: Vec<usize>,
) -> Result<(ToolModel, ConvertReport), ConvertError> {
    let options = ConvertOptions { straighten: true, ..options.clone() };
    let (tool, report) = convert(model, mesh, &options)?;
    Ok((tool, ConvertReport { finer, ..report }))
}

/// Divisions increased by a third.
fn refined_count(n: usize) -> usize {
    n + n.div_ceil(3)
}

/// Lists the faces with a folded patch, without duplicates.
fn folded_faces((tool, report): &(ToolModel, ConvertReport)) -> Vec<usize> {
    let mut faces: Vec<usize> =
        report.folded.iter().map(|&k| tool.faces[k as usize] as usize).collect();
    faces.sort_unstable();
    faces.dedup();
    faces
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::tolerance::{Borders, Goal, to_tolerance};
    use kanagata_cad::build::build;
    use kanagata_cad::raw::{RawEdge, RawFace, RawLoop, RawModel, RawSurface};
    use kanagata_geometry::nurbs::Curve3;
    use kanagata_geometry::{Frame, Vec3};
    use kanagata_tool::edge::EdgeFault;

    fn face(surface: RawSurface, curves: Vec<Curve3>) -> RawFace {
        let edge = |c| RawEdge { curve: Some(c), ..RawEdge::default() };
        let ring =
            RawLoop { outer: None, edges: curves.into_iter().map(edge).collect(), vertex: None };
        RawFace {
            surface,
            loops: vec![ring],
            flipped: false,
            source: "face".into(),
            shell: None,
            attributes: Default::default(),
        }
    }

    /// A corner of a nut of width 32 mm: two flats, their chamfer, and a wedge of the top. The rim of the top is
    /// tangent to the flats except for a file error: the flats cut it by 2e-7 mm.
    fn nut() -> Model {
        const R: f64 = 16.0;
        const WIDE: f64 = R - 2e-7;
        let sixth =
            Frame { x: polar(PI / 3.0, 1.0), y: polar(5.0 * PI / 6.0, 1.0), ..Frame::world() };
        let frames = [Frame::world(), sixth];
        let drop = |y: f64| -((WIDE * WIDE + y * y).sqrt() - R) / 3.0f64.sqrt();
        let end = R * (PI / 6.0).tan();
        // Intersection of the chamfer with the flat of frame `f`, from the rim to the corner of the nut on one side.
        let cut = |f: Frame, sign: f64| {
            let at = move |t: f64| f.x * WIDE + f.y * (sign * end * t) + f.z * drop(end * t);
            Curve3::fitted(at, &[0.0, 1.0], 1e-10)
        };
        let rim = Curve3::ellipse_arc(&Frame::world(), R, R, 0.0, PI / 3.0);
        let [first, second] = [cut(frames[0], 1.0), cut(frames[1], -1.0)];
        let flat = |f: Frame, cut: &Curve3, sign: f64| {
            let at = |y: f64, z: f64| f.x * WIDE + f.y * (sign * y) + f.z * z;
            let low = |a: f64, b: f64| Curve3::line(at(a, -10.0), at(b, -10.0));
            let down = Curve3::line(at(end, drop(end)), at(end, -10.0));
            let up = Curve3::line(at(0.0, -10.0), at(0.0, 0.0));
            let plane = Frame { origin: f.x * WIDE, x: f.y, y: f.z, z: f.x };
            face(RawSurface::Plane(plane), vec![cut.clone(), down, low(end, 0.0), up])
        };
        let down = Frame { x: Vec3::x(), y: -Vec3::y(), z: -Vec3::z(), ..Frame::world() };
        let cone = RawSurface::Cone { frame: down, radius: R, semi_angle: PI / 3.0 };
        let top = vec![
            Curve3::line(Vec3::zeros(), polar(0.0, R)),
            rim.clone(),
            Curve3::line(polar(PI / 3.0, R), Vec3::zeros()),
        ];
        let faces = vec![
            face(cone, vec![rim.reversed(), first.clone(), second.reversed()]),
            flat(frames[0], &first, 1.0),
            flat(frames[1], &second, -1.0),
            face(RawSurface::Plane(Frame::world()), top),
        ];
        build(RawModel { faces, ..RawModel::default() }, "nut").0
    }

    /// Point at `angle` [rad] on a circle about the z axis.
    fn polar(angle: f64, radius: f64) -> Vec3 {
        Vec3::new(angle.cos(), angle.sin(), 0.0) * radius
    }

    #[test]
    fn a_corner_without_an_angle_gets_straight_edges() {
        let model = nut();
        assert_eq!((model.faces.len(), model.vertices.len()), (4, 7), "{:?}", model.vertices);
        let options = ConvertOptions { through_cad: true, ..ConvertOptions::default() };
        let mut chords = 0;
        for arc_divisions in 1..=12 {
            let asked = MappedOptions { arc_divisions, ..MappedOptions::default() };
            let (tool, report) = mesh_and_convert(&model, &asked, &options).unwrap();
            assert_eq!(report.folded, Vec::<u32>::new(), "{arc_divisions}");
            for edge in report.straight.iter().filter(|e| e.fault == EdgeFault::Folds) {
                let mut faces = edge.patches.iter().map(|&k| tool.faces[k as usize]);
                assert!(faces.any(|f| f == 0), "{edge:?}");
                chords += 1;
            }
        }
        assert!(chords > 0);
    }

    /// Coefficients of the edges made straight because patches folded, in order.
    fn chords((tool, report): &(ToolModel, ConvertReport)) -> Vec<[f64; 3]> {
        let folds = report.straight.iter().filter(|e| e.fault == EdgeFault::Folds);
        let curve = |v: [u32; 2]| tool.curves.iter().find(|c| c.vertices == v).map(|c| c.c);
        folds.map(|e| curve(e.vertices).unwrap()).collect()
    }

    #[test]
    fn straight_edges_stay_straight_where_vertices_move() {
        let options = ConvertOptions { through_cad: true, ..ConvertOptions::default() };
        let mut straight = 0;
        for arc_divisions in 1..=12 {
            let asked = MappedOptions { arc_divisions, ..MappedOptions::default() };
            let mut found = mesh_and_convert(&nut(), &asked, &options).unwrap();
            let count = chords(&found).len();
            let up = Vec3::z() * 1e-3;
            let moved: Vec<Vec3> = found.0.vertices.iter().map(|x| x + up * x.x.sin()).collect();
            found.0.curves = crate::edges::curves_after_motion(&found.0, &moved);
            assert_eq!(chords(&found), vec![[0.0; 3]; count], "{arc_divisions}");
            straight += count;
        }
        assert!(straight > 0);
    }

    #[test]
    fn a_corner_without_an_angle_is_straight_to_a_tolerance_too() {
        let options = ConvertOptions { through_cad: true, ..ConvertOptions::default() };
        let mut straight = 0;
        for tol_mm in [0.2, 0.05, 0.01] {
            let borders = Borders::Conforming;
            let goal = Goal { tol_mm, normal_deg: f64::INFINITY, two_sided: true, borders };
            let found = to_tolerance(&nut(), &MappedOptions::default(), &options, &goal).unwrap();
            assert!(found.report.folded.is_empty() && found.audit.folded.is_empty(), "{tol_mm}");
            assert!(found.audit.worst_mm() <= tol_mm, "{tol_mm}");
            straight += chords(&(found.tool, found.report)).len();
        }
        assert!(straight > 0);
    }
}
