//! Every forming file becomes a joined model.

use std::path::PathBuf;

use kanagata::cad::{Severity, read};

fn forming() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("fixtures/forming")
}

fn truth() -> serde_json::Map<String, serde_json::Value> {
    let text = std::fs::read(forming().join("truth.json")).unwrap();
    serde_json::from_slice(&text).unwrap()
}

#[test]
fn every_file_has_its_faces_and_no_edge_is_used_more_than_twice() {
    for (name, expected) in truth() {
        let (model, diagnostics) = read(&forming().join(&name)).unwrap();
        let warnings: Vec<_> =
            diagnostics.iter().filter(|d| d.severity == Severity::Warning).collect();
        assert_eq!(
            model.faces.len() as u64,
            expected["faces"].as_u64().unwrap(),
            "{name}: {warnings:?}"
        );
        assert!(model.edges.iter().all(|e| e.uses.len() <= 2), "{name}");
    }
}

#[test]
fn free_edges_are_the_border_of_the_tool_and_solids_have_none() {
    let border = [
        ("cross_die_", 15),
        ("cross_punch_", 13),
        ("cross_holder_", 11),
        ("square_die_", 12),
        ("square_punch_", 8),
        ("cone", 0),
        ("cylinder", 0),
        ("frustum", 0),
        ("sphere", 0),
        ("torus", 0),
    ];
    for name in truth().keys().filter(|n| !n.contains("full")) {
        let Some((_, free)) = border.iter().find(|(stem, _)| name.starts_with(stem)) else {
            continue;
        };
        let (model, _) = read(&forming().join(name)).unwrap();
        let found = model.edges.iter().filter(|e| e.uses.len() == 1).count();
        assert_eq!(found, *free, "{name}");
    }
}

#[test]
fn parameter_curves_lie_on_their_edges() {
    for name in truth().keys() {
        let (model, _) = read(&forming().join(name)).unwrap();
        for face in &model.faces {
            for used in face.loops.iter().flat_map(|l| &l.uses) {
                let Some(edge) = used.edge else { continue };
                let [a, b] = used.pcurve.domain();
                for k in 0..=10 {
                    let uv = used.pcurve.point(a + (b - a) * f64::from(k) / 10.0);
                    let (_, d2) = model.edges[edge].curve.closest(&face.surface.point(uv));
                    assert!(d2.sqrt() < 1e-5, "{name} {}: {}", face.source, d2.sqrt());
                }
            }
        }
    }
}
