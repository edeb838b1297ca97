//! Claims of the STEP reader.

use std::path::{Path, PathBuf};

use super::read_bytes;
use crate::cad::raw::RawModel;

fn read(path: &Path) -> RawModel {
    let bytes = std::fs::read(path).unwrap();
    read_bytes(&bytes, &path.file_name().unwrap().to_string_lossy()).unwrap()
}

fn forming() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/forming")
}

fn step_files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut paths: Vec<PathBuf> = entries.map(|e| e.unwrap().path()).collect();
    paths.retain(|p| p.extension().is_some_and(|e| e == "stp"));
    paths.sort();
    paths
}

#[test]
fn forming_tools_have_all_their_faces_in_mm() {
    let truth = std::fs::read(forming().join("truth.json")).unwrap();
    let truth: serde_json::Value = serde_json::from_slice(&truth).unwrap();
    let files = step_files(&forming());
    assert!(files.len() >= 12);
    for path in files {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let model = read(&path);
        assert_eq!(model.faces.len() as u64, truth[&name]["faces"].as_u64().unwrap(), "{name}");
        assert_eq!(model.unit_mm, 1.0, "{name}");
        assert!(model.diagnostics.is_empty(), "{name}: {:?}", model.diagnostics);
        edges_join_end_to_end(&model, &name);
    }
}

/// Every edge begins where the one before it ends, in space and at its vertices.
fn edges_join_end_to_end(model: &RawModel, name: &str) {
    for face in &model.faces {
        for boundary in &face.loops {
            let ends: Vec<_> = boundary
                .edges
                .iter()
                .filter_map(|e| e.curve.as_ref())
                .map(|c| [c.point(c.domain()[0]), c.point(c.domain()[1])])
                .collect();
            for k in 0..ends.len() {
                let gap = (ends[k][1] - ends[(k + 1) % ends.len()][0]).norm();
                assert!(gap < 1e-2 * model.unit_mm.max(1.0), "{name} {}: gap {gap}", face.source);
            }
        }
    }
}

#[test]
fn corpus_has_as_many_faces_as_the_kernel_says() {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/cad");
    let folder = std::env::var_os("KANAGATA_CORPUS").map_or(beside, PathBuf::from);
    let Ok(truth) = std::fs::read(folder.join("truth.json")) else {
        println!("skipped: no corpus at {}", folder.display());
        return;
    };
    let truth: serde_json::Value = serde_json::from_slice(&truth).unwrap();
    let mut wrong = vec![];
    for path in step_files(&folder) {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let start = std::time::Instant::now();
        let model = read(&path);
        println!(
            "{name}: {} faces, {:.1} ms, {} diagnostics",
            model.faces.len(),
            start.elapsed().as_secs_f64() * 1e3,
            model.diagnostics.len()
        );
        for d in model.diagnostics.iter().take(3) {
            println!("    {} {} {}", d.code, d.place, d.text);
        }
        let faces = truth[&name]["truth"]["faces"].as_u64().unwrap();
        if model.faces.len() as u64 != faces {
            wrong.push(format!("{name}: {} for {faces}", model.faces.len()));
        }
        edges_join_end_to_end(&model, &name);
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
