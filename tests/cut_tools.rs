//! Tools cut off at the symmetry planes of the scene, as a quarter of a solid is.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::{Value, json};

/// A tool file of a block between two corners [mm]: eight vertices, a flat patch on each of its six faces.
fn block(low: [f64; 3], high: [f64; 3]) -> Value {
    let vertex = |k: usize| [0, 1, 2].map(|axis| if k >> axis & 1 == 0 { low } else { high }[axis]);
    let mut normals: Vec<[f64; 3]> = Vec::new();
    let mut patches = Vec::new();
    for axis in 0..3 {
        let (a, b) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
        for (side, sign) in [(0, -1.0), (1 << axis, 1.0)] {
            let mut corners = [side, side + a, side + a + b, side + b];
            if sign < 0.0 {
                corners.reverse();
            }
            let mut normal = [0.0; 3];
            normal[axis] = sign;
            normals.push(normal);
            let n = normals.len() - 1;
            patches.push(json!({ "vertices": corners, "normals": vec![n; 4], "face": n }));
        }
    }
    let vertices: Vec<[f64; 3]> = (0..8).map(vertex).collect();
    json!({
        "format": "kanagata-tool", "version": 1, "name": "block", "kind": "nagata", "edges": "guarded",
        "provenance": {}, "vertices": vertices, "normals": normals, "patches": patches
    })
}

/// The largest force of a plate that presses a quarter of a sheet of 40 x 40 x 2 mm by a fifth without friction, blocks of tools
/// beginning at `from` [mm] along x and y.
fn pressed(from: f64) -> f64 {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let write =
        |name: &str, value: &Value| fs::write(folder.join(name), value.to_string()).unwrap();
    write("low.tool.json", &block([from, from, -5.0], [50.0, 50.0, 0.0]));
    write("up.tool.json", &block([from, from, 2.0], [50.0, 50.0, 7.0]));
    let tool = |name: &str, way: f64| {
        let place = json!({ "shift": [0, 0, 0] });
        json!({ "name": name, "file": format!("{name}.tool.json"), "direction": [0, 0, way], "place": place })
    };
    let scene = json!({
        "format": "kanagata-scene", "version": 1, "name": "pressed",
        "blank": {
            "shape": { "rectangle": { "size_mm": [20, 20], "elements": [3, 3] } },
            "thickness_mm": 2.0, "layers": 2, "element": "hex8"
        },
        "material": {
            "name": "steel", "young_mpa": 210000, "poisson": 0.3, "yield": { "criterion": "von-mises" },
            "hardening": { "law": "swift", "k": 500, "eps0": 0.01, "n": 0.2 }
        },
        "symmetry": [{ "normal": "x" }, { "normal": "y" }],
        "tools": [tool("low", 1.0), tool("up", -1.0)],
        "stages": [{ "name": "press", "drive": { "up": { "travel_mm": 0.4 } } }]
    });
    write("pressed.scene.json", &scene);
    force_at_end(folder)
}

fn force_at_end(folder: &Path) -> f64 {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"));
    command.arg("run").arg(folder.join("pressed.scene.json")).args(["-q", "--accept-doubts", "-o"]);
    let done = command.arg(folder.join("run")).output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let history = fs::read_to_string(folder.join("run/history.csv")).unwrap();
    let mut lines = history.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let column = lines.next().unwrap().iter().position(|name| *name == "up_force_n").unwrap();
    lines.next_back().unwrap()[column].parse().unwrap()
}

/// Faces in the planes are the nearest to nodes on them that have come into the tool: with these faces 24 % of the force were
/// missing.
#[test]
fn a_tool_that_is_cut_off_at_the_symmetry_planes_presses_as_a_whole_one() {
    let whole = pressed(-50.0);
    // A prism of the sheet's volume under its uniaxial flow stress, four quarters.
    let (strain, volume) = (1.25_f64.ln(), 4.0 * 20.0 * 20.0 * 2.0);
    let mut stress = 500.0 * 0.2_f64.powf(0.2);
    for _ in 0..50 {
        stress = 500.0 * (0.01 + strain - stress / 210_000.0).powf(0.2);
    }
    let by_hand = stress * volume / 1.6;
    assert!((whole / by_hand - 1.0).abs() < 1e-3, "{whole} N, by hand {by_hand}");
    for from in [0.0, -0.01] {
        let cut = pressed(from);
        assert!((cut / whole - 1.0).abs() < 1e-9, "cut at {from}: {cut} N, whole {whole}");
    }
}

/// A tool file of the part x, y >= 0 of a sphere of radius 50 mm about (0, 0, 60): patches of 0.05 to 7 mm between these lines.
fn sphere() -> Value {
    let lines = [0.0, 0.05, 0.09, 0.5, 2.0, 5.0, 12.0_f64];
    let n = lines.len();
    let (mut vertices, mut normals) = (Vec::new(), Vec::new());
    for x in lines {
        for y in lines {
            let down = (2500.0 - x * x - y * y).sqrt();
            vertices.push([x, y, 60.0 - down]);
            normals.push([x / 50.0, y / 50.0, -down / 50.0]);
        }
    }
    let cells = (0..n - 1).flat_map(|i| (0..n - 1).map(move |j| i * n + j));
    let patches: Vec<Value> = cells
        .map(|k| [k, k + 1, k + n + 1, k + n])
        .map(|ids| json!({ "vertices": ids, "normals": ids, "face": 0 }))
        .collect();
    json!({
        "format": "kanagata-tool", "version": 1, "name": "sphere", "kind": "nagata", "edges": "guarded",
        "provenance": {}, "vertices": vertices, "normals": normals, "patches": patches
    })
}

/// The force of the sphere pressed 0.05 mm into an elastic block of 10 x 10 x 10 mm, a quarter of it, whose planes are planes of
/// symmetry or held.
fn indented(place: &Value, symmetry: bool) -> f64 {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("up.tool.json"), sphere().to_string()).unwrap();
    let plane = |normal: &str| json!({ "normal": normal });
    let hold = |normal: &str, axes: &[&str]| {
        let plane = json!({ "normal": normal, "at_mm": 0.0 });
        json!({ "where": { "plane": plane }, "axes": axes })
    };
    let mut holds = vec![hold("z", &["x", "y", "z"])];
    if !symmetry {
        holds.extend([hold("x", &["x"]), hold("y", &["y"])]);
    }
    let planes = if symmetry { vec![plane("x"), plane("y")] } else { Vec::new() };
    let scene = json!({
        "format": "kanagata-scene", "version": 1, "name": "indented",
        "blank": {
            "shape": { "rectangle": { "size_mm": [10, 10], "elements": [5, 5] } },
            "thickness_mm": 10.0, "layers": 3, "element": "hex8"
        },
        "material": {
            "name": "elastic", "young_mpa": 210000, "poisson": 0.3, "yield": { "criterion": "von-mises" },
            "hardening": { "law": "table", "strain": [0.0, 1.0], "stress": [1e9, 1e9] }
        },
        "symmetry": planes, "holds": holds,
        "tools": [{ "name": "up", "file": "up.tool.json", "direction": [0, 0, -1], "friction": 0.0, "place": place }],
        "stages": [{ "name": "press", "drive": { "up": { "travel_mm": 0.05 } } }]
    });
    fs::write(folder.join("pressed.scene.json"), scene.to_string()).unwrap();
    // Of the whole process with planes of symmetry, of the quarter without.
    force_at_end(folder) * if symmetry { 1.0 } else { 4.0 }
}

/// Patches of a working face beside a symmetry plane are no symmetry faces, however small they are for the sheet.
#[test]
fn fine_patches_at_the_symmetry_planes_press_as_with_supports() {
    let (shift, touch) = (json!({ "shift": [0, 0, 0] }), json!("touch"));
    let held = indented(&shift, false);
    assert!(held > 0.0);
    for place in [&shift, &touch] {
        let found = indented(place, true);
        assert!((found / held - 1.0).abs() < 1e-6, "{place}: {found} N, held {held} N");
    }
}
