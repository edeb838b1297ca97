//! Tests of entire files.

mod boundaries;
mod brep;
mod build;
mod entities;
mod faults;
mod habits;

use std::path::{Path, PathBuf};

use super::uv::point_on;
use super::*;

fn forming() -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("fixtures/forming")
}

fn truth(path: &Path) -> serde_json::Map<String, serde_json::Value> {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

/// Largest distance between both curves of an edge at ends and middle, and between the ends of consecutive edges, over
/// all faces.
fn gaps(model: &RawModel) -> (f64, f64, String) {
    let (mut between, mut along, mut place) = (0.0f64, 0.0f64, String::new());
    for face in &model.faces {
        for boundary in &face.loops {
            let mut ends = Vec::new();
            for edge in &boundary.edges {
                if let (Some(curve), Some(flat)) = (&edge.curve, &edge.pcurve) {
                    for (s, t) in flat.domain().into_iter().zip(curve.domain()) {
                        if let Some(on) = point_on(&face.surface, flat.point(s)) {
                            let gap = (on - curve.point(t)).norm();
                            if gap > between {
                                (between, place) = (gap, face.source.clone());
                            }
                        }
                    }
                }
                if let Some(curve) = &edge.curve {
                    ends.push(curve.domain().map(|t| curve.point(t)));
                } else if let Some(flat) = &edge.pcurve {
                    let on = flat.domain().map(|t| point_on(&face.surface, flat.point(t)));
                    if let [Some(a), Some(b)] = on {
                        ends.push([a, b]);
                    }
                }
            }
            for i in 0..ends.len() {
                let gap = (ends[i][1] - ends[(i + 1) % ends.len()][0]).norm();
                if gap > along {
                    (along, place) = (gap, face.source.clone());
                }
            }
        }
    }
    (between, along, place)
}

#[test]
fn forming_tools_have_the_faces_they_were_made_of_and_their_loops_close() {
    for (name, what) in truth(&forming().join("truth.json")) {
        if !name.ends_with(".igs") {
            continue;
        }
        let Ok(bytes) = std::fs::read(forming().join(&name)) else { continue };
        let model = read_bytes(&bytes, &name).unwrap();
        assert_eq!(
            model.faces.len() as u64,
            what["faces"].as_u64().unwrap(),
            "{name}: {:?}",
            model.diagnostics
        );
        let (between, along, place) = gaps(&model);
        assert!(between < 1e-6 && along < 1e-6, "{name}: {between} {along} at {place}");
        assert_eq!(model.unit_mm, 1.0);
        assert!(model.faces.iter().all(|f| !f.loops.is_empty()));
    }
}

/// The corpus next to the repository, if present.
fn corpus() -> Option<PathBuf> {
    let folder = std::env::var_os("KANAGATA_CORPUS").map_or_else(
        || Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("../shared/cad"),
        PathBuf::from,
    );
    folder.is_dir().then_some(folder)
}

#[test]
fn corpus_files_give_the_faces_another_kernel_finds() {
    let Some(folder) = corpus() else {
        eprintln!("skipped: no corpus (KANAGATA_CORPUS)");
        return;
    };
    let mut wrong = Vec::new();
    for (name, entry) in truth(&folder.join("truth.json")) {
        if !name.ends_with(".igs") {
            continue;
        }
        let bytes = std::fs::read(folder.join(&name)).unwrap();
        let start = std::time::Instant::now();
        let model = match read_bytes(&bytes, &name) {
            Ok(model) => model,
            Err(error) => {
                eprintln!("{name}: {error}");
                wrong.push(name);
                continue;
            }
        };
        let took = start.elapsed();
        let truth = &entry["truth"];
        let wanted = truth["faces"].as_u64().unwrap();
        let (between, along, place) = gaps(&model);
        eprintln!(
            "{name}: {} faces ({wanted}), {} loose, gaps {between:.2e} {along:.2e} {place}, {} kB {took:?}",
            model.faces.len(),
            model.loose_curves,
            bytes.len() / 1000
        );
        for d in &model.diagnostics {
            eprintln!("    {:?} {} {}: {}", d.severity, d.code, d.place, d.text);
        }
        if model.faces.len() as u64 != wanted && truth["trust"] == "checked" {
            wrong.push(name);
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}
