//! The built-in mesh, its faces divided more finely where their patches fold.

use super::{ConvertError, ConvertOptions, ConvertReport, convert};
use crate::cad::Model;
use crate::mesh::mapped::MappedOptions;
use crate::mesh::mapped::plan::Plan;
use crate::mesh::{MeshError, SurfaceMesh};
use crate::tool::ToolModel;

/// Times the folded faces are divided more finely.
const ROUNDS: usize = 12;
/// Times without fewer folded patches, after which it ends.
const PATIENCE: usize = 4;
/// Patches over those of the mesh as asked, at which it ends.
const MOST_TIMES: usize = 16;

/// Patches of all finer meshes together, besides [`PATCHES_TIMES`] as many as the mesh as asked has, at which it ends. Of 60
/// files the one that takes most until nothing folds takes 4093 from 207. Doubled, faces that fold whatever is done take
/// twice as long.
const PATCHES: usize = 10_000;
/// See [`PATCHES`].
const PATCHES_TIMES: usize = 4;

/// Why there is no model.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum UnfoldedError {
    /// No mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// No tool model.
    #[error(transparent)]
    Convert(#[from] ConvertError),
}

/// Meshes and converts `model`. A face of which patches fold is meshed again with a third more divisions of its edges
/// and of its inside, until none folds or the patches made meanwhile are too many ([`PATCHES`]); [`ConvertReport::finer`] lists those faces. Where that does not help (borders that meet without an
/// angle, as where the chamfer of a nut ends), edges of what still folds become straight.
///
/// # Errors
/// [`UnfoldedError`]: as the mesher and [`convert`] say.
pub fn mesh_and_convert(
    model: &Model,
    mesh: &MappedOptions,
    options: &ConvertOptions,
) -> Result<(ToolModel, ConvertReport), UnfoldedError> {
    let plan = Plan::new(model, mesh)?;
    let mut asked = Asked::at_first(&plan, mesh.arc_divisions, model.faces.len());
    let mut best_mesh = plan.mesh(&asked.minima, &asked.density)?;
    let mut best = convert(model, &best_mesh, options)?;
    let most = MOST_TIMES * best.0.patches.len();
    let mut left = PATCHES + PATCHES_TIMES * best.0.patches.len();
    let mut folded = faces_of(&best);
    let mut in_vain = 0;
    for _ in 0..ROUNDS {
        if folded.is_empty() || in_vain == PATIENCE {
            break;
        }
        asked.divide(&folded, model, &plan);
        // Too fine to be meshed, or a vertex without a normal: what there is.
        let Ok(mesh) = plan.mesh(&asked.minima, &asked.density) else { break };
        let Some(rest) = left.checked_sub(mesh.elements.len()) else { break };
        left = rest;
        let Ok(next) = convert(model, &mesh, options) else { break };
        if next.0.patches.len() > most {
            break;
        }
        folded = faces_of(&next);
        in_vain += 1;
        if next.1.folded.len() < best.1.folded.len() {
            (best, best_mesh) = (next, mesh);
            best.1.finer = asked.finer_faces();
            in_vain = 0;
        }
    }
    if !best.1.folded.is_empty() {
        best = straightened(model, &best_mesh, options, best.1.finer)?;
    }
    Ok(best)
}

/// Divisions asked of the mesher.
struct Asked {
    /// Least divisions, by edge.
    minima: Vec<usize>,
    /// Divisions of a quarter turn inside faces, by face.
    density: Vec<usize>,
    /// Faces divided more finely than at first.
    finer: Vec<bool>,
}

impl Asked {
    /// Asks for what the plan asks for, and `density` divisions of a quarter turn inside all faces.
    fn at_first(plan: &Plan, density: usize, faces: usize) -> Self {
        let minima = plan.minima().to_vec();
        Self { minima, density: vec![density; faces], finer: vec![false; faces] }
    }

    /// Divides some faces and their edges a third more finely.
    fn divide(&mut self, faces: &[usize], model: &Model, plan: &Plan) {
        let counts = plan.agree(&self.minima).counts;
        for &f in faces {
            self.finer[f] = true;
            self.density[f] = more(self.density[f]);
            let uses = model.faces[f].loops.iter().flat_map(|l| &l.uses);
            for e in uses.filter_map(|u| u.edge) {
                self.minima[e] = self.minima[e].max(more(counts[e]));
            }
        }
    }

    /// Lists the faces divided more finely than at first.
    fn finer_faces(&self) -> Vec<usize> {
        (0..self.finer.len()).filter(|&f| self.finer[f]).collect()
    }
}

/// The model of a mesh, edges of what folds whatever is done straight.
fn straightened(
    model: &Model,
    mesh: &SurfaceMesh,
    options: &ConvertOptions,
    finer: Vec<usize>,
) -> Result<(ToolModel, ConvertReport), ConvertError> {
    let options = ConvertOptions { straighten: true, ..options.clone() };
    let (tool, report) = convert(model, mesh, &options)?;
    Ok((tool, ConvertReport { finer, ..report }))
}

/// A third more divisions.
fn more(n: usize) -> usize {
    n + n.div_ceil(3)
}

/// Faces with a folded patch, each once.
fn faces_of((tool, report): &(ToolModel, ConvertReport)) -> Vec<usize> {
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
    use crate::cad::build::build;
    use crate::cad::raw::{RawEdge, RawFace, RawLoop, RawModel, RawSurface};
    use crate::convert::tolerance::{Borders, Goal, to_tolerance};
    use crate::geometry::nurbs::Curve3;
    use crate::geometry::{Frame, Vec3};
    use crate::tool::edge::EdgeFault;

    fn face(surface: RawSurface, curves: Vec<Curve3>) -> RawFace {
        let edge = |c| RawEdge { curve: Some(c), ..RawEdge::default() };
        let ring =
            RawLoop { outer: None, edges: curves.into_iter().map(edge).collect(), vertex: None };
        RawFace { surface, loops: vec![ring], flipped: false, source: "face".into(), shell: None }
    }

    /// A corner of a nut of width 32: two of its flats, their chamfer, and a wedge of its top, whose rim touches the flats
    /// but for what files are off: they cut it by 2e-7 mm.
    fn nut() -> Model {
        const R: f64 = 16.0;
        const WIDE: f64 = R - 2e-7;
        let sixth = Frame { x: on(PI / 3.0, 1.0), y: on(5.0 * PI / 6.0, 1.0), ..Frame::world() };
        let frames = [Frame::world(), sixth];
        let drop = |y: f64| -((WIDE * WIDE + y * y).sqrt() - R) / 3.0f64.sqrt();
        let end = R * (PI / 6.0).tan();
        // Where the chamfer cuts the flat at angle zero, from the rim to the corner of the nut, either way; the same turned.
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
            Curve3::line(Vec3::zeros(), on(0.0, R)),
            rim.clone(),
            Curve3::line(on(PI / 3.0, R), Vec3::zeros()),
        ];
        let faces = vec![
            face(cone, vec![rim.reversed(), first.clone(), second.reversed()]),
            flat(frames[0], &first, 1.0),
            flat(frames[1], &second, -1.0),
            face(RawSurface::Plane(Frame::world()), top),
        ];
        build(RawModel { faces, ..RawModel::default() }, "nut").0
    }

    /// The point at an angle on a circle about the z axis.
    fn on(angle: f64, radius: f64) -> Vec3 {
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

    /// Curves of the edges made straight because patches folded, in order.
    fn chords((tool, report): &(ToolModel, ConvertReport)) -> Vec<[f64; 3]> {
        let folds = report.straight.iter().filter(|e| e.fault == EdgeFault::Folds);
        let curve = |v: [u32; 2]| tool.curves.iter().find(|c| c.vertices == v).map(|c| c.c);
        folds.map(|e| curve(e.vertices).unwrap()).collect()
    }

    #[test]
    fn straight_edges_stay_straight_where_vertices_move() {
        let options = ConvertOptions { through_cad: true, ..ConvertOptions::default() };
        let asked = MappedOptions { arc_divisions: 4, ..MappedOptions::default() };
        let mut found = mesh_and_convert(&nut(), &asked, &options).unwrap();
        let count = chords(&found).len();
        let up = Vec3::z() * 1e-3;
        let moved: Vec<Vec3> = found.0.vertices.iter().map(|x| x + up * x.x.sin()).collect();
        found.0.curves = crate::convert::edges::moved(&found.0, &moved);
        assert!(count > 0 && chords(&found) == vec![[0.0; 3]; count]);
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
