//! The strip of `fixtures/u-draw`, in one layer of 35 elements, with other tools, stages and limits.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

/// Writes its scene and its tools into `folder`: the scene's file. `change` may change the tools there, too.
pub fn scene_in(folder: &Path, change: impl FnOnce(&Path, &mut Value)) -> PathBuf {
    let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/u-draw");
    for entry in fs::read_dir(&from).unwrap() {
        let path = entry.unwrap().path();
        fs::copy(&path, folder.join(path.file_name().unwrap())).unwrap();
    }
    let scene = fs::read_to_string(from.join("u-draw.scene.json")).unwrap();
    let mut scene: Value = serde_json::from_str(&scene).unwrap();
    scene["blank"]["shape"]["rectangle"]["elements"] = json!([35, 1]);
    scene["blank"]["layers"] = json!(1);
    change(folder, &mut scene);
    let file = folder.join("changed.scene.json");
    fs::write(&file, scene.to_string()).unwrap();
    file
}
