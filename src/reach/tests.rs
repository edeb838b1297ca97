//! Reachable faces of the fixtures.

use super::*;
use kanagata_scene::types::Scene;
use std::path::Path;

fn read(file: &str) -> Model {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("fixtures").join(file);
    kanagata_cad::read(&path).unwrap().0
}

fn scene(change: impl Fn(&mut serde_json::Value)) -> Scene {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
        .join("fixtures/cross/cross.scene.json");
    let mut value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
    change(&mut value);
    serde_json::from_value(value).unwrap()
}

fn zone(scene: &Scene, tool: &str) -> Zone {
    Zone::of_scene(scene, Path::new(""), "", tool).unwrap()
}

fn counts(model: &Model, zone: &Zone) -> [usize; 4] {
    let found = within_reach(model, zone, None, false).unwrap();
    let of = |why| found.left_out.iter().filter(|l| l.1 == why).count();
    [found.kept.len(), of(Why::Beside), of(Why::Behind), of(Why::Away)]
}

/// The complete die in a scene of one quarter: of the other quarters only faces near the symmetry planes remain, which
/// the rim of the sheet may touch.
#[test]
fn faces_beside_a_quarter_of_the_sheet_are_left_out() {
    let model = read("forming/cross_die_full_144.igs");
    let found = within_reach(&model, &zone(&scene(|_| {}), "die"), None, false).unwrap();
    println!("{} kept, {:?}", found.kept.len(), found.left_out);
    assert!(found.left_out.iter().any(|l| l.1 == Why::Beside));
    for (f, face) in model.faces.iter().enumerate() {
        let b = face.bbox();
        // Twice the thickness is 1.6 mm, a twentieth of the quarter's diagonal 8.8 mm.
        let meets = b.max.x >= -8.0 && b.max.y >= -8.0;
        let beside = b.max.x < -9.0 || b.max.y < -9.0;
        assert!(!meets || found.kept.contains(&f), "face {f} {b:?}");
        assert!(!beside || found.left_out.contains(&(f, Why::Beside)), "face {f} {b:?}");
    }
    for f in 0..found.model.faces.len() {
        let uses = found.model.edges.iter().flat_map(|e| &e.uses).filter(|u| u[0] == f);
        let own: usize = model.faces[found.kept[f]].loops.iter().map(|l| l.uses.len()).sum();
        assert_eq!(uses.count(), own);
    }
}

#[test]
fn depth_is_the_sum_of_travels_and_infinite_when_that_is_unknown() {
    let model = read("cross/die.igs");
    let depth = |change: &dyn Fn(&mut serde_json::Value)| zone(&scene(change), "die").depth;
    // The punch travels 20 mm. The die is not driven by travel and is assumed to follow by as much.
    assert!((depth(&|_| {}) - 41.6).abs() < 1e-12);
    let unknown = |s: &mut serde_json::Value| {
        s["stages"][1]["drive"] = serde_json::json!({"punch": {"force_n": 10.0}});
    };
    assert_eq!(depth(&unknown), f64::INFINITY);
    // At a drawing depth of 1 mm the sheet does not reach the bottom edge of the die wall.
    let shallow = scene(|s| {
        s["stages"][1]["drive"] = serde_json::json!({"punch": {"travel_mm": 1.0}});
    });
    let [kept, _, behind, _] = counts(&model, &zone(&shallow, "die"));
    let front = model.bbox().max.z;
    let low = model.faces.iter().filter(|f| f.bbox().max.z < front - 3.6 - 1e-3).count();
    println!("{kept} kept, {behind} behind, {low} low");
    assert_eq!(behind, low);
    assert_eq!(counts(&model, &zone(&scene(unknown), "die"))[2], 0);
}

/// A closed block as a punch: only its back points away; the sides remain.
#[test]
fn the_back_of_a_block_is_left_out() {
    let model = read("forming/cylinder_AP214.stp");
    let b = model.bbox();
    let wide = scene(|s| {
        let size = [b.max.x - b.min.x, b.max.y - b.min.y];
        let corner = [b.min.x, b.min.y];
        s["blank"]["shape"] = serde_json::json!({
            "rectangle": {"corner_mm": corner, "size_mm": size, "elements": [2, 2]}
        });
        s["stages"][1]["drive"] = serde_json::json!({"punch": {"force_n": 10.0}});
    });
    let found = within_reach(&model, &zone(&wide, "punch"), None, false).unwrap();
    println!("{:?} of {}", found.left_out, model.faces.len());
    for (f, why) in &found.left_out {
        let face = model.faces[*f].bbox();
        assert_eq!(*why, Why::Away);
        assert!(face.min.z > b.max.z - 1e-6, "the back of a punch that goes down is its top");
    }
    // A tool acting from the side, or a load, may press the sheet against it.
    let left_out = |change: &dyn Fn(&mut serde_json::Value)| {
        let mut of = serde_json::to_value(&wide).unwrap();
        change(&mut of);
        let scene: Scene = serde_json::from_value(of).unwrap();
        within_reach(&model, &zone(&scene, "punch"), None, false).unwrap().left_out
    };
    assert!(!found.left_out.is_empty());
    assert_eq!(left_out(&|_| {}), found.left_out);
    assert_eq!(left_out(&|s| s["tools"][1]["direction"] = serde_json::json!([1, 0, 0])), []);
    let load = serde_json::json!([{"where": {"all": true}, "force_n": [0, 2, 0]}]);
    assert_eq!(left_out(&|s| s["loads"] = load.clone()), []);
}

#[test]
fn a_tool_the_scene_does_not_have_is_refused() {
    let said = Zone::of_scene(&scene(|_| {}), Path::new(""), "dye.tool.json", "dye");
    let said = said.unwrap_err().to_string();
    assert!(said.contains("'dye.tool.json'") && said.contains("die, holder, punch"), "{said}");
    // By the file's name.
    Zone::of_scene(&scene(|_| {}), Path::new(""), "punch.tool.json", "p").unwrap();
    let far = scene(|s| {
        s["blank"]["shape"]["rectangle"]["corner_mm"] = serde_json::json!([5000.0, 0.0]);
    });
    let nothing = within_reach(&read("cross/die.igs"), &zone(&far, "die"), None, false);
    assert!(matches!(nothing, Err(ReachError::Nothing { faces: 15 })));
}
