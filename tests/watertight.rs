//! Conforming models have no gaps: neighbours share vertices and the curve between them; the audit measures what is left.

use std::collections::BTreeMap;
use std::path::Path;

use kanagata::audit::{AuditOptions, AuditReport, CadReference, audit};
use kanagata::cad::{self, Model};
use kanagata::convert::bezier::{BezierOptions, bezier_from_cad};
use kanagata::convert::tolerance::{Borders, Goal, to_tolerance};
use kanagata::convert::{ConvertOptions, convert};
use kanagata::geometry::Vec3;
use kanagata::mesh::mapped::{MappedOptions, MeshStyle, mesh};
use kanagata::tool::build::build;
use kanagata::tool::edge::EdgeRule;
use kanagata::tool::{Patch, ToolKind, ToolModel};

fn read(file: &str) -> Model {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(file);
    cad::read(&path).unwrap().0
}

fn audited(tool: &ToolModel, model: &Model) -> AuditReport {
    audit(tool, &CadReference::new(model), &AuditOptions::default()).unwrap().report
}

const FILES: [&str; 7] = [
    "cross/die.igs",
    "cross/punch.igs",
    "forming/cross_die_full_AP214.stp",
    "forming/hemi_punch_nurbs144.igs",
    "forming/square_die_186.igs",
    "forming/frustum_AP214.stp",
    "forming/cone_144.igs",
];

/// Corners of the parameter domain in turning order.
fn corners(patch: &Patch) -> &'static [(f64, f64)] {
    if patch.sides() == 3 {
        &[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)]
    } else {
        &[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
    }
}

/// Second difference of side `k`: the coefficient c of its curve (Eq. 7), as the patch has it.
fn coefficient(patch: &Patch, k: usize) -> Vec3 {
    let ring = corners(patch);
    let (a, b) = (ring[k], ring[(k + 1) % ring.len()]);
    let at = |t: f64| patch.derivs(a.0 + (b.0 - a.0) * t, a.1 + (b.1 - a.1) * t).s;
    (at(0.0) - at(0.5) * 2.0 + at(1.0)) * 2.0
}

/// Every side of a patch on an edge of the CAD between two faces is shared by two patches, from the same two vertices
/// and with the same curve: nothing but the rounding of evaluation is between them, at creases too.
#[test]
fn neighbours_share_vertices_and_curves() {
    for file in FILES {
        let model = read(file);
        for (style, through_cad) in [(MeshStyle::Structured, false), (MeshStyle::Mixed, true)] {
            let options = MappedOptions { arc_divisions: 3, style, ..MappedOptions::default() };
            let convert_options = ConvertOptions { through_cad, ..ConvertOptions::default() };
            let made = mesh(&model, &options).unwrap();
            let (tool, report) = convert(&model, &made, &convert_options).unwrap();
            let size = model.bbox().diagonal();
            let mut sides: BTreeMap<[u32; 2], Vec<Vec3>> = BTreeMap::new();
            for (patch, c) in tool.patches.iter().zip(&tool.corners) {
                for k in 0..c.vertices.len() {
                    let (a, b) = (c.vertices[k], c.vertices[(k + 1) % c.vertices.len()]);
                    sides.entry([a.min(b), a.max(b)]).or_default().push(coefficient(patch, k));
                }
            }
            let rounding = 32.0 * f64::EPSILON * size;
            for (ends, found) in &sides {
                assert!(found.len() <= 2, "{file}: edge {ends:?} has {} patches", found.len());
                let off = (found[0] - found[found.len() - 1]).norm();
                assert!(off <= rounding, "{file}: edge {ends:?}, curves {off:e} mm apart");
            }
            let jumps = audited(&tool, &model).jumps;
            println!("{file} {style:?}: {} creases, {jumps:?}", report.creases);
            assert_eq!((jumps.open_sides, jumps.border_gap_mm), (0, 0.0), "{file} {style:?}");
            assert!(jumps.position_mm <= rounding, "{file}: {:e} mm", jumps.position_mm);
            assert!(jumps.shared_edges > 0);
        }
    }
}

/// The file says each curve once: read back, the same model has the same patches to the bit.
#[test]
fn a_shared_curve_is_computed_once_whatever_the_order_of_the_patches() {
    let model = read("cross/die.igs");
    let (tool, _) = convert(
        &model,
        &mesh(&model, &MappedOptions::default()).unwrap(),
        &ConvertOptions::default(),
    )
    .unwrap();
    let mut corners = tool.corners.clone();
    corners.reverse();
    let (vertices, normals) = (tool.vertices.clone(), tool.normals.clone());
    let (other, _) =
        build("t".into(), ToolKind::Nagata, vertices, normals, corners, EdgeRule::Guarded).unwrap();
    for (a, b) in tool.patches.iter().zip(other.patches.iter().rev()) {
        assert_eq!(a, b);
    }
}

/// Bezier patches straight from the CAD share the control points of their borders to the bit.
#[test]
fn bezier_neighbours_share_control_points_to_the_bit() {
    for file in ["cross/die.igs", "forming/hemi_punch_AP214.stp", "forming/square_punch_144.igs"] {
        let model = read(file);
        let size = MappedOptions { arc_divisions: 2, ..MappedOptions::default() };
        let options = BezierOptions {
            name: "t".into(),
            tolerance_mm: 1e-3,
            sheet_side: None,
            flip: false,
            progress: Default::default(),
        };
        let (tool, _) = bezier_from_cad(&model, &mesh(&model, &size).unwrap(), &options).unwrap();
        let bits = |p: &Vec3| [p.x, p.y, p.z].map(|x| (x + 0.0).to_bits());
        let mut known: BTreeMap<Vec<[u64; 3]>, usize> = BTreeMap::new();
        for patch in &tool.patches {
            for mut side in borders(patch) {
                if side[0] == side[side.len() - 1] {
                    continue;
                }
                if bits(&side[0]) > bits(&side[side.len() - 1]) {
                    side.reverse();
                }
                *known.entry(side.iter().map(bits).collect()).or_default() += 1;
            }
        }
        let jumps = audited(&tool, &model).jumps;
        let shared = known.values().filter(|n| **n == 2).count();
        println!("{file}: {shared} borders shared to the bit, {jumps:?}");
        assert_eq!(shared, jumps.shared_edges, "{file}");
        assert_eq!(jumps.open_sides, 0, "{file}");
    }
}

/// Control points of the four sides.
fn borders(patch: &Patch) -> Vec<Vec<Vec3>> {
    let Patch::Bezier { degrees: [n, m], points } = patch else { return Vec::new() };
    let at = |i: usize, j: usize| points[i * (m + 1) + j];
    vec![
        (0..=*n).map(|i| at(i, 0)).collect(),
        (0..=*m).map(|j| at(*n, j)).collect(),
        (0..=*n).map(|i| at(i, *m)).collect(),
        (0..=*m).map(|j| at(0, j)).collect(),
    ]
}

#[test]
fn models_to_a_tolerance_are_as_tight() {
    let model = read("cross/punch.igs");
    let goal = Goal {
        tol_mm: 0.05,
        normal_deg: f64::INFINITY,
        two_sided: true,
        borders: Borders::Conforming,
    };
    let options = ConvertOptions { through_cad: true, ..ConvertOptions::default() };
    let found = to_tolerance(&model, &MappedOptions::default(), &options, &goal).unwrap();
    assert!(found.moved_mm > 0.0);
    let jumps = found.audit.jumps;
    assert_eq!(jumps.open_sides, 0);
    assert!(jumps.position_mm < 32.0 * f64::EPSILON * model.bbox().diagonal(), "{jumps:?}");
}

/// Two halves of a quarter cylinder divided apart: the gap is what their chords leave, and is reported.
#[test]
fn a_border_divided_twice_has_the_gap_of_its_curves() {
    let model = read("cross/die.igs");
    let made = |n: usize| {
        let options = MappedOptions { arc_divisions: n, ..MappedOptions::default() };
        let flat = ConvertOptions { kind: ToolKind::Facets, ..ConvertOptions::default() };
        convert(&model, &mesh(&model, &options).unwrap(), &flat).unwrap().0
    };
    let (coarse, fine) = (made(2), made(5));
    // Even faces from one, odd ones from the other.
    let (mut vertices, mut normals, mut corners) = (vec![], vec![], vec![]);
    for (part, tool) in [&coarse, &fine].into_iter().enumerate() {
        let (v, n) = (vertices.len() as u32, normals.len() as u32);
        vertices.extend(&tool.vertices);
        normals.extend(&tool.normals);
        for c in tool.corners.iter().filter(|c| c.face as usize % 2 == part) {
            let mut c = c.clone();
            c.vertices.iter_mut().for_each(|k| *k += v);
            c.normals.iter_mut().for_each(|k| *k += n);
            corners.push(c);
        }
    }
    let guarded = EdgeRule::Guarded;
    let (tool, _) =
        build("t".into(), ToolKind::Facets, vertices, normals, corners, guarded).unwrap();
    let jumps = audited(&tool, &model).jumps;
    println!("{jumps:?}");
    assert!(jumps.open_sides > 0);
    // Nodes of the finer one on the arc, chords of the other: their distance, by dense points of all free borders.
    let dense = dense_gap(&tool, &model);
    println!("{} mm, dense {dense} mm", jumps.border_gap_mm);
    assert!((jumps.border_gap_mm / dense - 1.0).abs() < 0.02 && dense > 0.1);
}

/// Largest distance of points on borders between faces to the other faces' patches, by brute force.
fn dense_gap(tool: &ToolModel, model: &Model) -> f64 {
    const N: usize = 200;
    let mut seen: BTreeMap<[u32; 2], usize> = BTreeMap::new();
    let ends = |c: &[u32], k: usize| {
        let (a, b) = (c[k], c[(k + 1) % c.len()]);
        [a.min(b), a.max(b)]
    };
    for c in &tool.corners {
        (0..c.vertices.len()).for_each(|k| *seen.entry(ends(&c.vertices, k)).or_default() += 1);
    }
    // Points of free sides by face, and the edge of the CAD their middle is nearest to.
    let mut lines: Vec<(u32, usize, Vec<Vec3>)> = Vec::new();
    for (patch, c) in tool.patches.iter().zip(&tool.corners) {
        for k in (0..c.vertices.len()).filter(|&k| seen[&ends(&c.vertices, k)] == 1) {
            let ring = corners(patch);
            let (a, b) = (ring[k], ring[(k + 1) % ring.len()]);
            let at = |t: f64| patch.derivs(a.0 + (b.0 - a.0) * t, a.1 + (b.1 - a.1) * t).s;
            let points: Vec<Vec3> = (0..=N).map(|i| at(i as f64 / N as f64)).collect();
            let off = |e: &cad::model::Edge| {
                let ends = [points[0], points[N / 2], points[N]];
                ends.map(|p| (e.curve.point(e.curve.closest(&p).0) - p).norm()).iter().sum::<f64>()
            };
            let of_face = model.edges.iter().enumerate();
            let of_face = of_face.filter(|(_, e)| e.uses.iter().any(|u| u[0] == c.face as usize));
            let edge = of_face.min_by(|x, y| off(x.1).total_cmp(&off(y.1))).unwrap().0;
            lines.push((c.face, edge, points));
        }
    }
    let mut worst = 0.0f64;
    for (face, edge, points) in &lines {
        let others: Vec<&Vec3> =
            lines.iter().filter(|l| l.1 == *edge && l.0 != *face).flat_map(|l| &l.2).collect();
        for p in points.iter().step_by(10).filter(|_| !others.is_empty()) {
            let near = others.iter().map(|q| (*q - p).norm()).fold(f64::INFINITY, f64::min);
            worst = worst.max(near);
        }
    }
    worst
}
