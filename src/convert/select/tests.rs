//! Choices from a press of named blocks: fixtures/bodies.

use std::path::Path;

use super::chosen::Chosen;
use super::reference::ChosenReference;
use super::{SelectError, choose};
use crate::shapes::{joined, whole};
use kanagata_audit::ReferenceSurface;
use kanagata_cad::region::{PlanCurve, split};
use kanagata_cad::{Creases, Model};
use kanagata_geometry::Frame;
use kanagata_geometry::nurbs::Surface;
use kanagata_tool::selection::{FaceSelection, Facing, SelectionBox};

fn press(name: &str) -> Model {
    let path =
        Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("fixtures/bodies").join(name);
    kanagata_cad::read_with(&path, Creases::Cut).unwrap().0
}

fn list(items: &[&str]) -> Vec<String> {
    items.iter().map(ToString::to_string).collect()
}

fn kept(model: &Model, selection: &FaceSelection) -> Vec<usize> {
    choose(model, selection).unwrap_or_else(|e| panic!("{selection:?}: {e}")).kept
}

fn bodies(items: &[&str]) -> FaceSelection {
    FaceSelection { bodies: list(items), ..FaceSelection::default() }
}

fn faces(items: &[&str]) -> FaceSelection {
    FaceSelection { faces: list(items), ..FaceSelection::default() }
}

#[test]
fn bodies_are_chosen_by_number_product_occurrence_own_name_and_path() {
    let model = press("press.stp");
    let die: Vec<usize> = (0..6).collect();
    for item in ["1", "die", "die block", "d*", "press/die/die block", "*/die/*"] {
        assert_eq!(kept(&model, &bodies(&[item])), die, "{item}");
    }
    assert_eq!(kept(&model, &bodies(&["binder"])), (6..16).collect::<Vec<_>>());
    assert_eq!(kept(&model, &bodies(&["binder right"])), (11..16).collect::<Vec<_>>());
    assert_eq!(kept(&model, &bodies(&["!binder", "!4"])), die);
    assert_eq!(
        kept(&model, &bodies(&["press", "!binder ?????"])),
        [&die[..], &(6..11).collect::<Vec<_>>(), &(16..22).collect::<Vec<_>>()].concat()
    );
}

#[test]
fn faces_are_chosen_by_number_range_entity_and_name() {
    let model = press("press.stp");
    assert_eq!(kept(&model, &faces(&["3", "5-7", "!6"])), [3, 5, 7]);
    assert_eq!(kept(&model, &faces(&["die face"])), [1]);
    assert_eq!(kept(&model, &faces(&["*face"])), [1, 16]);
    let entity = model.faces[8].source.split(' ').next().unwrap().to_owned();
    // Both occurrences of the binder have the faces of one entity.
    assert_eq!(kept(&model, &faces(&[&entity])), [8, 13]);
    let iges = press("press.igs");
    assert_eq!(kept(&iges, &faces(&["D7", "die face", "BINDER.*"])), [0, 1, 6, 7, 8, 9, 10, 11]);
}

#[test]
fn layers_groups_and_colours_choose_faces() {
    let model = press("press.stp");
    let by = |layers: &[&str], colours: &[&str]| FaceSelection {
        layers: list(layers),
        colours: list(colours),
        ..FaceSelection::default()
    };
    // The layer of a face stands before that of its solid.
    assert_eq!(kept(&model, &by(&["contact"], &[])), [1, 16]);
    assert_eq!(kept(&model, &by(&["lower"], &["red"])), [0, 2, 3, 4, 5]);
    assert_eq!(kept(&model, &by(&[], &["#FF8000"])), [1]);
    assert_eq!(kept(&model, &by(&[], &["none"])).len(), 10);
    assert_eq!(kept(&model, &by(&["!lower"], &["!blue"])), [1]);
    let iges = press("press.igs");
    assert_eq!(kept(&iges, &by(&["holding"], &[])), (6..12).collect::<Vec<_>>());
    assert_eq!(kept(&iges, &by(&["31"], &["#ff8000"])), (12..18).collect::<Vec<_>>());
}

#[test]
fn boxes_and_directions_choose_whole_faces_and_all_lists_apply() {
    let model = press("press.stp");
    let high = SelectionBox { min: [0.0, 0.0, 30.0], max: [100.0, 80.0, 80.0], excluded: false };
    let up = Facing { direction: [0.0, 0.0, 2.0], angle_deg: 89.0 };
    let boxed = FaceSelection { boxes: vec![high], ..FaceSelection::default() };
    assert_eq!(kept(&model, &boxed), (6..22).collect::<Vec<_>>());
    let without =
        FaceSelection { boxes: vec![SelectionBox { excluded: true, ..high }], ..boxed.clone() };
    assert_eq!(kept(&model, &without), (0..6).collect::<Vec<_>>());
    let facing = FaceSelection { facing: Some(up), ..boxed };
    assert_eq!(kept(&model, &facing), [17]);
    let side = Facing { direction: [0.0, 1.0, 1.0], angle_deg: 46.0 };
    let die = FaceSelection { facing: Some(side), ..bodies(&["die"]) };
    assert_eq!(kept(&model, &die), [1, 4]);
}

#[test]
fn what_chooses_nothing_is_an_error_with_the_nearest_names() {
    let model = press("press.stp");
    let text = |selection: &FaceSelection| choose(&model, selection).unwrap_err().to_string();
    let said = text(&bodies(&["bindr"]));
    assert!(
        said.contains("the body 'bindr'")
            && said.contains("'binder'")
            && said.contains("numbers: 1 to 4"),
        "{said}"
    );
    assert!(text(&bodies(&["5"])).contains("numbers: 1 to 4"));
    assert!(text(&faces(&["22"])).contains("numbers: 0 to 21"));
    assert!(text(&faces(&["3-40"])).contains("numbers: 0 to 21"));
    assert!(text(&faces(&["!die fase"])).contains("'die face'"));
    assert!(text(&faces(&["9-3"])).contains("from the smaller"));
    let layers = FaceSelection { layers: list(&["uper"]), ..FaceSelection::default() };
    assert!(text(&layers).contains("there: 'upper', "), "{}", text(&layers));
    let colours = |c: &str| FaceSelection { colours: list(&[c]), ..FaceSelection::default() };
    assert!(
        text(&colours("cyan")).contains("#0000ff")
            && text(&colours("pink")).contains("allowed: #rrggbb")
    );
    let none = FaceSelection { colours: list(&["blue"]), ..bodies(&["die"]) };
    assert!(text(&none).contains("bodies: 6, colours: 6 of 22 faces"), "{}", text(&none));
    let far = SelectionBox { min: [0.0; 3], max: [1.0; 3], excluded: false };
    let boxed = FaceSelection { boxes: vec![far], ..FaceSelection::default() };
    assert!(text(&boxed).contains("the model extends from"));
    let many = FaceSelection { faces: vec!["1".into(); 2000], ..FaceSelection::default() };
    assert!(matches!(choose(&model, &many), Err(SelectError::TooLong { found: 2000, .. })));
    let long = FaceSelection { faces: vec!["x".repeat(1000)], ..FaceSelection::default() };
    assert!(matches!(choose(&model, &long), Err(SelectError::TooLong { .. })));
    for facing in [
        Facing { direction: [0.0; 3], angle_deg: 1.0 },
        Facing { direction: [f64::NAN; 3], angle_deg: 1.0 },
    ] {
        let bad = FaceSelection { facing: Some(facing), ..FaceSelection::default() };
        assert!(matches!(choose(&model, &bad), Err(SelectError::Direction { .. })));
    }
}

/// Rectangles between these places along x, 10 high, joined where they meet.
fn strips(places: &[[f64; 2]]) -> Model {
    let strip =
        |&[low, high]: &[f64; 2]| whole(Surface::plane(&Frame::world(), [low, high], [0.0, 10.0]));
    joined(places.iter().map(strip).collect()).joined_within(1e-6)
}

/// Where a narrow face between two others is left out, its neighbours are not joined in the tool, but in the CAD they are: no
/// open joint. A slit of the same width in the CAD is one, with the numbers of the complete model.
#[test]
fn sides_of_a_face_that_is_left_out_are_no_open_joint() {
    let joints = |model: &Model, own: &[usize]| {
        let chosen = Chosen::new(model, own, own.to_vec());
        let taken = own.iter().map(|&f| f as u32).collect();
        ChosenReference::new(&chosen).open_joints(&taken)
    };
    let groove = strips(&[[0.0, 10.0], [10.0, 10.15], [10.15, 20.15]]);
    assert_eq!(groove.open_joints(|_| true), None);
    assert_eq!(joints(&groove, &[0, 2]), None);
    let slit = strips(&[[-20.0, -10.0], [0.0, 10.0], [10.15, 20.15]]);
    let found = joints(&slit, &[1, 2]).unwrap();
    assert!((found.widest_mm - 0.15).abs() < 1e-9 && found.edges == 2, "{found:?}");
    assert!([1, 2].contains(&found.face) && (found.at.x - 10.0).abs() < 0.2, "{found:?}");
    assert_eq!(joints(&slit, &[0, 1]), None);
    // The same where a region cuts the faces, which joins all edges anew.
    let cut = |model: &Model, own: &[usize]| {
        let chosen = Chosen::new(model, own, own.to_vec());
        let lower = PlanCurve::polygon(&[[-1.0, -1.0], [30.0, -1.0], [30.0, 5.0], [-1.0, 5.0]]);
        let halves = split(&chosen.model, &lower.unwrap(), true).unwrap().model;
        assert_eq!(halves.faces.len(), 4);
        halves.open_joints(|_| true)
    };
    assert_eq!(cut(&groove, &[0, 2]), None);
    assert_eq!(cut(&slit, &[1, 2]).unwrap().edges, 4);
}
