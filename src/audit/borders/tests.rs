use std::f64::consts::TAU;

#[cfg(feature = "pages")]
use crate::doubts;
#[cfg(feature = "pages")]
use crate::page::page;
use crate::shapes::{holed_square, joined, sphere, whole};
use crate::{Audit, AuditOptions, CadReference, ReferenceSurface, audit};
use kanagata_cad::Model;
#[cfg(feature = "pages")]
use kanagata_cad::raw::LostFace;
use kanagata_geometry::nurbs::Surface;
use kanagata_geometry::{Frame, Vec3};
use kanagata_report::doubt::DoubtCode;
use kanagata_tool::{Patch, ToolKind, ToolModel};

/// Radius of the hole [mm].
const HOLE: f64 = 20.0;
/// Number of chords of the hole.
const CHORDS: usize = 60;

fn tool(patches: Vec<Patch>, faces: Vec<u32>) -> ToolModel {
    ToolModel::of_patches("plate", ToolKind::Bezier, patches, faces)
}

fn flat(corners: [Vec3; 4]) -> Patch {
    let [a, b, c, d] = corners;
    Patch::Bezier { degrees: [1, 1], points: vec![a, d, b, c] }
}

/// The plate of [`holed_square`] as flat patches with the given hole radius and distance of the sides from the origin.
fn plate(hole: f64, side: f64) -> ToolModel {
    let centre = Vec3::new(10.0, 5.0, 0.0);
    let corners = [(side, side), (-side, side), (-side, -side), (side, -side)];
    let turn = |p: Vec3| p.y.atan2(p.x).rem_euclid(TAU);
    let mut turns: Vec<f64> = (0..CHORDS).map(|k| TAU * k as f64 / CHORDS as f64).collect();
    turns.extend(corners.map(|(x, y)| turn(Vec3::new(x, y, 0.0) - centre)));
    turns.sort_by(f64::total_cmp);
    let way = |k: usize| {
        let (sin, cos) = turns[k % turns.len()].sin_cos();
        Vec3::new(cos, sin, 0.0)
    };
    let outer = |k: usize| {
        let to = |x: f64, from: f64| {
            if x == 0.0 { f64::INFINITY } else { (side * x.signum() - from) / x }
        };
        let way = way(k);
        centre + way * to(way.x, centre.x).min(to(way.y, centre.y))
    };
    let inner = |k: usize| centre + way(k) * hole;
    let n = turns.len();
    let patches: Vec<Patch> =
        (0..n).map(|k| flat([inner(k), outer(k), outer(k + 1), inner(k + 1)])).collect();
    tool(patches, vec![0; n])
}

fn run(tool: &ToolModel, model: &Model) -> Audit {
    let options = AuditOptions { tolerance_mm: Some(0.5), ..AuditOptions::default() };
    audit(tool, &CadReference::new(model), &options).unwrap()
}

#[test]
fn a_border_that_is_met_deviates_by_its_chords_only() {
    let report = run(&plate(HOLE, 50.0), &holed_square(HOLE)).report;
    let sagitta = HOLE * (1.0 - (TAU / 2.0 / CHORDS as f64).cos());
    assert!((report.borders.tool_to_cad_mm - sagitta).abs() < 1e-9, "{:?}", report.borders);
    assert!((report.borders.cad_to_tool_mm - sagitta).abs() < 1e-3, "{:?}", report.borders);
    assert_eq!((report.borders.cad_edges, report.within_tolerance), (5, Some(true)));
    assert_eq!(report.faces[0].border_mm, report.borders.deviation_mm());
}

#[test]
fn a_tool_that_ends_too_late_or_too_early_is_as_far_off_as_that() {
    let sagitta = HOLE * (1.0 - (TAU / 2.0 / CHORDS as f64).cos());
    for (hole, side, exact) in
        [(18.0, 50.0, 2.0), (23.0, 50.0, 3.0), (20.0, 46.0, 4.0 * 2f64.sqrt())]
    {
        let report = run(&plate(hole, side), &holed_square(HOLE)).report;
        let found = report.borders.deviation_mm();
        assert!(found >= exact - 1e-9 && found <= exact + 2.0 * sagitta, "{hole} {side}: {found}");
        assert_eq!(report.within_tolerance, Some(false), "{hole} {side}");
        // Beyond a border the error is the distance; before it there is no shape error.
        let beyond = if hole < HOLE { 2.0 + sagitta } else { 0.0 };
        let worst = report.worst_mm();
        assert!((worst - beyond).abs() <= sagitta + 1e-9, "{worst}");
        assert!(report.borders.at.is_some());
    }
}

#[test]
fn a_hole_that_is_closed_is_found_from_the_cad() {
    let report = run(&plate(0.0, 50.0), &holed_square(HOLE)).report;
    assert!(report.borders.tool_to_cad_mm < 1e-6, "{:?}", report.borders);
    // The farthest point from all sides is the point of the hole equidistant from x = -50 and y = -50: sin - cos of its
    // angle is 1/4.
    let angle = TAU / 2.0 + TAU / 8.0 - (0.25 / 2f64.sqrt()).asin();
    let exact = 60.0 + HOLE * angle.cos();
    let found = report.borders.cad_to_tool_mm;
    assert!(found <= exact + 1e-6 && found > exact - report.borders.step_mm, "{found} {exact}");
    assert!((report.worst_mm() - HOLE).abs() < 1e-6, "{}", report.worst_mm());
    assert_eq!(report.within_tolerance, Some(false));
}

/// Two squares of side 10 beside each other whose faces have no common edge.
fn unjoined(gap: f64) -> Model {
    let square = |x: f64| {
        whole(Surface::plane(
            &Frame { origin: Vec3::x() * x, ..Frame::world() },
            [0.0, 10.0],
            [0.0, 10.0],
        ))
    };
    joined(vec![square(0.0), square(10.0 + gap)])
}

fn square(x: f64) -> Patch {
    let at = |x: f64, y: f64| Vec3::new(x, y, 0.0);
    flat([at(x, 0.0), at(x + 10.0, 0.0), at(x + 10.0, 10.0), at(x, 10.0)])
}

#[test]
fn faces_that_meet_without_a_common_edge_have_no_border_there_and_left_out_faces_leave_one() {
    let model = unjoined(0.0);
    let both = run(&tool(vec![square(0.0), square(10.0)], vec![0, 1]), &model).report;
    assert!(both.borders.deviation_mm() < 1e-6, "{:?}", both.borders);
    assert_eq!((both.borders.tool_sides, both.within_tolerance), (6, Some(true)));
    let one = run(&tool(vec![square(0.0)], vec![0]), &model).report;
    assert!(one.borders.deviation_mm() < 1e-6, "{:?}", one.borders);
    assert_eq!(
        (one.borders.tool_sides, one.borders.cad_edges, one.within_tolerance),
        (4, 4, Some(true))
    );
    // The second face is only partly covered by a patch.
    let at = |x: f64, y: f64| Vec3::new(x, y, 0.0);
    let half = flat([at(10.0, 0.0), at(15.0, 0.0), at(15.0, 10.0), at(10.0, 10.0)]);
    let half = run(&tool(vec![square(0.0), half], vec![0, 1]), &model).report;
    assert!((half.borders.cad_to_tool_mm - 5.0).abs() < 1e-6, "{:?}", half.borders);
    assert_eq!((half.borders.face, half.within_tolerance), (Some(1), Some(false)));
}

/// A slit of 0.15 mm between faces, which the shape error does not show, is a doubt where 0.1 mm are allowed and where no
/// patch is as far off; not where 0.5 mm are, nor for a tool of one of the faces.
#[test]
fn faces_that_are_not_joined_are_a_doubt_above_the_tolerance() {
    let model = unjoined(0.15);
    let codes = |faces: &[f64], tolerance_mm: Option<f64>| {
        let patches = faces.iter().map(|&x| square(x)).collect();
        let tool = tool(patches, (0..).take(faces.len()).collect());
        let options = AuditOptions { tolerance_mm, ..AuditOptions::default() };
        let report = audit(&tool, &CadReference::new(&model), &options).unwrap().report;
        let codes: Vec<DoubtCode> = report.doubts.iter().map(|doubt| doubt.code).collect();
        (report.open_joints.edges, report.open_joints.widest_mm, codes)
    };
    let both = [0.0, 10.15];
    for tolerance in [Some(0.1), None] {
        let (edges, widest, codes) = codes(&both, tolerance);
        assert_eq!((edges, codes), (2, vec![DoubtCode::OpenJoints]));
        assert!((widest - 0.15).abs() < 1e-9, "{widest}");
    }
    assert_eq!(codes(&both, Some(0.5)).2, []);
    assert_eq!(codes(&both[..1], Some(0.1)), (0, 0.0, vec![]));
}

#[test]
fn a_closed_surface_has_no_border() {
    let model = sphere(10.0);
    let faces: std::collections::BTreeSet<u32> = std::iter::once(0).collect();
    let reference = CadReference::new(&model);
    let edges = reference.border_edges(&faces).unwrap();
    assert!(edges.is_empty(), "{edges:?}");
}

#[cfg(feature = "pages")]
#[test]
fn a_border_that_is_missed_is_a_doubt_and_stands_first_in_the_page() {
    use DoubtCode::{BordersExceeded, FacesLost, FoldedPatches, ToleranceExceeded};
    let codes = |found: &Audit| found.report.doubts.iter().map(|d| d.code).collect::<Vec<_>>();
    // The tool ends too early: only its border is wrong.
    let early = plate(23.0, 50.0);
    let found = run(&early, &holed_square(HOLE));
    assert_eq!(codes(&found), [BordersExceeded]);
    let doubt = &found.report.doubts[0];
    assert_eq!((doubt.value, doubt.limit), (Some(found.report.borders.deviation_mm()), Some(0.5)));
    let text = page(&early, &found).html();
    assert!(text.find("class=\"doubts\"") < text.find("tool file"), "{text}");
    assert!(text.contains("borders-exceeded"));
    let closed = run(&plate(0.0, 50.0), &holed_square(HOLE));
    assert_eq!(codes(&closed), [ToleranceExceeded, BordersExceeded]);
    assert!(codes(&run(&plate(HOLE, 50.0), &holed_square(HOLE))).is_empty());
    // Faces of the file that the model lacks are always reported.
    let lost = LostFace { source: "D7 (144)".into(), reason: "no curve".into() };
    let model = Model { lost: vec![lost.clone()], ..holed_square(HOLE) };
    let found = run(&plate(HOLE, 50.0), &model);
    assert_eq!((codes(&found), &found.report.faces_lost), (vec![FacesLost], &vec![lost]));
    let mut report = found.report;
    report.folded = vec![3];
    assert!(
        doubts(&report)
            .iter()
            .any(|d| d.code == FoldedPatches && d.text.contains("patches fold: 3"))
    );
}
