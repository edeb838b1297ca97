//! An S-rail from STEP solids to the released sheet: a whole blank, held by nothing but its tools. The plan is symmetric
//! about its middle, so that the sheet must be too. `fixtures/s-rail` is what `tools/peers/s_rail.py` writes.

use std::collections::HashMap;
use std::path::Path;
use std::process::Command;

use kanagata::geometry::Vec3;
use kanagata::report::record::History;
use serde_json::{Value, json};

fn succeed(command: &mut Command) {
    let done = command.output().unwrap();
    assert!(done.status.success(), "{command:?}: {}", String::from_utf8_lossy(&done.stderr));
}

/// Tools to a tolerance, and the scene with a coarser sheet and a third of the depth.
fn prepare(folder: &Path) {
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/s-rail");
    for name in ["die", "holder", "punch"] {
        let mut convert = Command::new(env!("CARGO_BIN_EXE_kanagata"));
        convert.arg("convert").arg(fixture.join(format!("{name}.step")));
        convert.arg("-o").arg(folder.join(format!("{name}.tool.json"))).args(["--tol", "0.03mm"]);
        succeed(&mut convert);
    }
    let text = std::fs::read_to_string(fixture.join("s-rail.scene.json")).unwrap();
    let mut scene: Value = serde_json::from_str(&text).unwrap();
    scene["blank"]["shape"]["rectangle"]["elements"] = json!([40, 28]);
    scene["stages"][1]["drive"]["punch"]["travel_mm"] = json!(10.0);
    std::fs::write(folder.join("s-rail.scene.json"), scene.to_string()).unwrap();
}

/// Largest displacement, and largest difference between nodes that a half turn takes to each other [mm].
fn asymmetry(run: &Path) -> [f64; 2] {
    let grid = kanagata::report::vtu_read::read(&run.join("steps/last.vtu")).unwrap();
    let moved = grid.point_data.iter().find(|a| a.name == "displacement_mm").unwrap();
    let moved: Vec<Vec3> = moved.values.chunks_exact(3).map(Vec3::from_column_slice).collect();
    let place = |x: &Vec3| [x.x, x.y, x.z].map(|v| (v * 1e3).round() as i64);
    let flat: Vec<Vec3> = grid.points.iter().zip(&moved).map(|(x, u)| x - u).collect();
    let nodes: HashMap<_, usize> = flat.iter().enumerate().map(|(n, x)| (place(x), n)).collect();
    let half_turn = |x: &Vec3| Vec3::new(-x.x, -x.y, x.z);
    let apart =
        |n: usize| (moved[n] - half_turn(&moved[nodes[&place(&half_turn(&flat[n]))]])).norm();
    let most = |size: &dyn Fn(usize) -> f64| (0..moved.len()).map(size).fold(0.0, f64::max);
    [most(&|n| moved[n].norm()), most(&apart)]
}

#[test]
fn an_s_rail_is_clamped_drawn_and_released_without_help() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    prepare(folder);
    let run = folder.join("run");
    let mut solve = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"));
    solve
        .args(["run", "-q", "--accept-doubts", "-o"])
        .arg(&run)
        .arg(folder.join("s-rail.scene.json"));
    succeed(&mut solve);

    let history = std::fs::read_to_string(run.join("history.csv")).unwrap();
    let history = History::parse(&history).unwrap();
    let clamping = history.rows.iter().filter(|row| row.stage == "clamp");
    let clamping: Vec<usize> = clamping.map(|row| row.iterations).collect();
    assert!(clamping.len() <= 12 && clamping.iter().all(|&n| n <= 5), "{clamping:?}");

    let text = std::fs::read_to_string(run.join("run.json")).unwrap();
    let record: Value = serde_json::from_str(&text).unwrap();
    let number = |name: &str| record[name].as_f64().unwrap();
    // Its elements are coarse for the radii, which is a doubt.
    assert_eq!(record["verdict"], "doubtful");
    assert!(number("penetration_mm") < 1e-9 && number("force_error") < 1e-9);
    assert!(number("energy_error") < 5e-3, "{}", number("energy_error"));

    let [largest, off] = asymmetry(&run);
    assert!(largest > 8.0 && off < 0.02, "{off} of {largest} mm");
}
