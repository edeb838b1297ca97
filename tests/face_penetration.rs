//! Tools that pass between the nodes of a sheet: runs end, and say how deep.

use std::fs;
use std::process::Command;

use serde_json::{Value, json};

/// A tool file of the lower face, and the sides, of a block between two corners [mm].
fn block([x0, y0, z0]: [f64; 3], [x1, y1, z1]: [f64; 3]) -> Value {
    let vertices = [
        [x0, y0, z0],
        [x1, y0, z0],
        [x1, y1, z0],
        [x0, y1, z0],
        [x0, y0, z1],
        [x1, y0, z1],
        [x1, y1, z1],
        [x0, y1, z1],
    ];
    let normals = [[0, 0, -1], [0, -1, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0]];
    let rings = [[0, 3, 2, 1], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
    let patches: Vec<Value> = rings
        .iter()
        .enumerate()
        .map(|(k, ring)| json!({ "vertices": ring, "normals": vec![k; 4], "face": k }))
        .collect();
    json!({
        "format": "kanagata-tool", "version": 1, "name": "block", "kind": "nagata", "edges": "guarded",
        "provenance": {}, "vertices": vertices, "normals": normals, "patches": patches
    })
}

/// The record of a block of 1 x 1 mm pressed 0.4 mm into a sheet of 20 x 20 x 1 mm held at its rim, in so many elements a side.
fn pressed(elements: usize) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let tool = block([6.1, 6.2, 1.0], [7.1, 7.2, 9.0]);
    fs::write(folder.join("block.tool.json"), tool.to_string()).unwrap();
    let scene = json!({
        "format": "kanagata-scene", "version": 1, "name": "pressed",
        "blank": {
            "shape": { "rectangle": { "size_mm": [20, 20], "elements": [elements, elements] } },
            "thickness_mm": 1.0, "layers": 1, "element": "solid-shell"
        },
        "material": {
            "name": "steel", "young_mpa": 210000, "poisson": 0.3, "yield": { "criterion": "von-mises" },
            "hardening": { "law": "swift", "k": 500, "eps0": 0.01, "n": 0.2 }
        },
        "holds": [
            { "where": { "plane": { "normal": "x", "at_mm": 0.0 } }, "axes": ["x", "y", "z"] },
            { "where": { "plane": { "normal": "x", "at_mm": 20.0 } }, "axes": ["x", "y", "z"] }
        ],
        "tools": [{
            "name": "block", "file": "block.tool.json", "direction": [0, 0, -1], "friction": 0.0,
            "place": { "shift": [0, 0, 0] }
        }],
        "stages": [{ "name": "press", "drive": { "block": { "travel_mm": 0.4 } } }]
    });
    let file = folder.join("pressed.scene.json");
    fs::write(&file, scene.to_string()).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"));
    command.arg("run").arg(&file).arg("-q").arg("-o").arg(folder.join("run")).output().unwrap();
    serde_json::from_slice(&fs::read(folder.join("run/run.json")).unwrap()).unwrap()
}

fn warns(record: &Value) -> bool {
    let doubts = record["doubts"].as_array().map_or(&[][..], Vec::as_slice);
    let of_block = |doubt: &Value| doubt["where"].as_str().unwrap().starts_with("block");
    doubts.iter().any(|doubt| doubt["code"] == "penetration-on-faces" && of_block(doubt))
}

/// It meets no node of elements of 10 mm; of those of 0.5 mm it meets several.
#[test]
fn a_block_that_meets_no_node_is_reported_with_its_depth() {
    let coarse = pressed(2);
    let found = &coarse["face_penetration"];
    assert!((found["depth_mm"].as_f64().unwrap() - 0.4).abs() < 1e-6, "{found}");
    assert!((found["depth_rel"].as_f64().unwrap() - 0.4).abs() < 1e-6, "{found}");
    assert_eq!(found["tool"], "block");
    assert_eq!(coarse["penetration_mm"], 0.0, "nodes see nothing");
    assert!(warns(&coarse), "{}", coarse["doubts"]);
    let fine = pressed(40);
    let depth = fine["face_penetration"]["depth_mm"].as_f64().unwrap_or(0.0);
    assert!(depth < 0.2, "{depth}");
}
