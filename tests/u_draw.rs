//! P3: the draw of a strip over a 7 mm radius of four Nagata patches that other codes do not finish, with no setting by
//! hand. `fixtures/u-draw` is what `tools/peers/forming.py` writes.

use std::path::Path;
use std::process::Command;

#[test]
fn the_u_draw_reaches_its_depth_in_at_most_400_iterations() {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/u-draw/u-draw.scene.json");
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("u-draw");
    // A folder of a run before this one is none of ours.
    let _ = std::fs::remove_dir_all(&out);
    let run = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"))
        .args(["run", "-q", "--accept-doubts", "--threads", "1", "-o"])
        .args([&out, &scene])
        .output()
        .unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let text = std::fs::read_to_string(out.join("run.json")).unwrap();
    let record: serde_json::Value = serde_json::from_str(&text).unwrap();
    let number = |name: &str| record[name].as_f64().unwrap();
    assert_eq!(record["verdict"], "completed");
    assert!(number("iterations") <= 400.0, "{}", number("iterations"));
    assert!(number("penetration_mm") < 1e-9 && number("force_error") < 1e-9);
    assert!(number("convergence_order") > 1.8);
    expects_its_memory(&scene, number("peak_mb"));
    let history = std::fs::read_to_string(out.join("history.csv")).unwrap();
    let last = history.lines().last().unwrap();
    assert!(last.contains(",15,"), "the punch ends at 15 mm: {last}");
}

/// What `check` expects of the memory is what the run took, `peak` [MB] before it wrote its report.
fn expects_its_memory(scene: &Path, peak: f64) {
    const REPORT: f64 = 19.0;
    let check = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"))
        .args(["check", "--threads", "1"])
        .arg(scene)
        .output()
        .unwrap();
    let text = String::from_utf8(check.stdout).unwrap();
    let line = text.lines().find_map(|line| line.trim().strip_prefix("memory     about ")).unwrap();
    let expected: f64 = line.split(' ').next().unwrap().parse().unwrap();
    // 0 where the system does not say.
    let share = expected / (peak + REPORT);
    assert!(peak == 0.0 || (0.8..1.25).contains(&share), "{expected} MB, {peak} MB");
}
