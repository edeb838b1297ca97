//! Scenes, tools and what `kanagata-solve check` says of them.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// A copy of a fixture's folder.
pub fn copied(fixture: &str, into: &Path) {
    for entry in fs::read_dir(Path::new("fixtures").join(fixture)).unwrap() {
        let entry = entry.unwrap();
        if entry.file_name().to_string_lossy().ends_with(".json") {
            fs::copy(entry.path(), into.join(entry.file_name())).unwrap();
        }
    }
}

/// What `check` prints of the scene in `folder` after `change`.
pub fn told(folder: &Path, scene: &str, change: impl Fn(&mut Value)) -> String {
    let mut value: Value = serde_json::from_slice(&fs::read(folder.join(scene)).unwrap()).unwrap();
    change(&mut value);
    let path = folder.join("changed.scene.json");
    fs::write(&path, value.to_string()).unwrap();
    let out = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"))
        .args(["check", "--threads", "1", "--accept-doubts"])
        .arg(&path)
        .output()
        .unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    String::from_utf8(out.stdout).unwrap()
}

/// Converts a surface of quadrilaterals.
pub fn tool(folder: &Path, name: &str, side: &str, points: &[[f64; 3]], quads: &[[usize; 4]]) {
    let mut text = String::new();
    points.iter().for_each(|[x, y, z]| text += &format!("v {x} {y} {z}\n"));
    quads.iter().for_each(|[a, b, c, d]| text += &format!("f {a} {b} {c} {d}\n"));
    let (mesh, file) = (folder.join(format!("{name}.obj")), format!("{name}.tool.json"));
    fs::write(&mesh, text).unwrap();
    let made = Command::new(env!("CARGO_BIN_EXE_kanagata"))
        .args(["convert", "--sheet-side", side, "-o"])
        .args([&folder.join(file), &mesh])
        .output()
        .unwrap();
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
}
