//! `check` of a blank whose mesh file is large: judged from its size, examined with `--whole`.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::{Value, json};

/// A sheet of 2 x 2 mm in one quadrilateral, in a file that a section of comments makes as long as asked [B].
fn sheet(padding: usize) -> String {
    format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Comments\n{}$EndComments\n$Nodes\n4\n1 0 0 0\n2 2 0 0\n3 2 2 0\n4 0 2 0\n\
         $EndNodes\n$Elements\n1\n1 3 2 1 1 1 2 3 4\n$EndElements\n",
        format!("{}\n", "-".repeat(79)).repeat(padding / 80)
    )
}

/// A scene that draws nothing: the sheet below a plate that stays 1 mm above it.
fn scene(folder: &Path, padding: usize) {
    fs::write(folder.join("sheet.msh"), sheet(padding)).unwrap();
    let plate = json!({
        "format": "kanagata-tool", "version": 1, "name": "plate", "kind": "nagata", "edges": "guarded",
        "provenance": {}, "vertices": [[-1, -1, 2], [3, -1, 2], [3, 3, 2], [-1, 3, 2]], "normals": [[0, 0, -1]],
        "patches": [{ "vertices": [0, 3, 2, 1], "normals": [0, 0, 0, 0], "face": 0 }]
    });
    fs::write(folder.join("plate.tool.json"), plate.to_string()).unwrap();
    let scene = json!({
        "format": "kanagata-scene", "version": 1, "name": "large",
        "blank": { "shape": { "mesh": { "file": "sheet.msh" } }, "thickness_mm": 1.0, "layers": 2, "element": "hex8" },
        "material": "mild-steel-neto2012",
        "holds": [{ "where": { "all": true }, "axes": ["x", "y", "z"] }],
        "tools": [{
            "name": "plate", "file": "plate.tool.json", "direction": [0, 0, -1], "friction": 0.1,
            "place": { "shift": [0, 0, 0] }
        }],
        "stages": [{ "name": "come", "drive": { "plate": { "travel_mm": 0.5 } } }]
    });
    fs::write(folder.join("large.scene.json"), scene.to_string()).unwrap();
}

fn check(folder: &Path, more: &[&str]) -> (Option<i32>, Value) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"));
    command.arg("check").arg(folder.join("large.scene.json")).arg("--json").args(more);
    let done = command.output().unwrap();
    let judgement = serde_json::from_slice(&done.stdout)
        .unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&done.stderr)));
    (done.status.code(), judgement)
}

#[test]
fn a_large_mesh_file_is_judged_from_its_size_and_examined_on_request() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let codes = |judgement: &Value| -> Vec<String> {
        let findings = judgement["findings"].as_array().unwrap().iter();
        findings.filter_map(|f| f["code"].as_str().map(Into::into)).collect()
    };
    // In two layers, 16 MB of work are 10.67 MB of a file.
    for (padding, examined) in [(10_600_000, true), (10_700_000, false)] {
        scene(folder, padding);
        let (exit, judgement) = check(folder, &[]);
        let doubted = codes(&judgement).contains(&"sheet-not-examined".to_owned());
        assert_eq!(doubted, !examined, "{padding}: {judgement}");
        assert!(examined || exit == Some(1), "{padding}: {exit:?}");
        // 10.7 MB at 60 B an element.
        let elements = judgement["elements"].as_u64().unwrap();
        assert_eq!(elements, if examined { 2 } else { 356_671 }, "{judgement}");
        assert!(examined || judgement["cost"]["memory_mb"].as_f64().unwrap() > 1000.0);
        let (_, whole) = check(folder, &["--whole"]);
        assert_eq!(whole["elements"], 2, "{whole}");
        assert!(!codes(&whole).contains(&"sheet-not-examined".to_owned()), "{whole}");
    }
}
