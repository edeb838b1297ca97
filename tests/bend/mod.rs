//! A strip held at one end is bent over a cylinder of two Nagata patches by a plane: a run of a second.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};

/// Writes `post.tool.json` and `plane.tool.json` into `folder`.
pub fn write_tools(folder: &Path) {
    let tool = |name: &str, points: [[f64; 4]; 3]| {
        // A profile (x, z, nx, nz) along y.
        let at = |y: f64| points.map(|p| json!([p[0], y, p[1]]));
        let vertices: Vec<_> = at(-1.0).into_iter().chain(at(3.0)).collect();
        let normals = points.map(|p| [p[2], 0.0, p[3]]).repeat(2);
        let up = points[0][3] + points[2][3] > 0.0;
        let quad = |k: usize| if up { [k, k + 1, k + 4, k + 3] } else { [k, k + 3, k + 4, k + 1] };
        let patches: Vec<_> = [quad(0), quad(1)]
            .iter()
            .map(|q| json!({"vertices": q, "normals": q, "face": 0}))
            .collect();
        let file = json!({
            "format": "kanagata-tool", "version": 1, "name": name, "kind": "nagata",
            "edges": "guarded", "provenance": {}, "vertices": vertices, "normals": normals,
            "patches": patches,
        });
        fs::write(folder.join(format!("{name}.tool.json")), file.to_string()).unwrap();
    };
    let (s, c) = std::f64::consts::FRAC_PI_4.sin_cos();
    let arc = [
        [10.0 - 5.0 * s, 5.0 * c - 5.0, -s, c],
        [10.0, 0.0, 0.0, 1.0],
        [10.0 + 5.0 * s, 5.0 * c - 5.0, s, c],
    ];
    tool("post", arc);
    tool("plane", [[14.0, 1.0, 0.0, -1.0], [20.0, 1.0, 0.0, -1.0], [40.0, 1.0, 0.0, -1.0]]);
}

/// The scene, its tools in the folder `tools` (that of the scene when empty), with a checkpoint after every increment.
pub fn scene(tools: &str) -> Value {
    let tool = |name: &str, up: i32| {
        let file = Path::new(tools).join(format!("{name}.tool.json")).display().to_string();
        json!({"name": name, "file": file, "direction": [0, 0, up], "friction": 0.1})
    };
    json!({
        "format": "kanagata-scene", "version": 1, "name": "bend",
        "blank": {
            "shape": {"rectangle": {"size_mm": [20.0, 2.0], "elements": [16, 1]}},
            "thickness_mm": 1.0, "layers": 2
        },
        "material": "mild-steel-neto2012",
        "holds": [{"where": {"plane": {"normal": "x"}}, "axes": ["x", "y", "z"]}],
        "tools": [tool("post", 1), tool("plane", -1)],
        "stages": [
            {"name": "bend", "drive": {"plane": {"travel_mm": 3.0}}, "largest_increment": 0.05},
            {"name": "release", "drive": {"plane": {"release": true}, "post": {"release": true}}}
        ],
        "output": {"vtu_every": 2, "checkpoint_every": 1}
    })
}
