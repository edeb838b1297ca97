//! The paper's tool models of the cross tool (`fixtures/cross/models/models.json`): counts of patches, where their errors
//! are, and what the clearance of punch and die says before anything is formed.

mod command;

use std::path::{Path, PathBuf};

use command::fixture;
use kanagata::cad;
use kanagata::geometry::Vec3;
use serde_json::Value;

fn cross() -> PathBuf {
    fixture("cross").into()
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// Exit code of the program.
fn kanagata(arguments: &[&str]) -> i32 {
    let (code, _, errors) = command::kanagata(arguments);
    assert!(code <= 1, "{arguments:?}: {errors}");
    code
}

/// A model as its recipe says, in a folder of its own.
struct Made {
    folder: tempfile::TempDir,
    recipes: Value,
    model: Value,
}

impl Made {
    fn new(name: &str) -> Self {
        let recipes = json(&cross().join("models/models.json"));
        let models = recipes["models"].as_array().unwrap();
        let model = models.iter().find(|m| m["name"] == name).unwrap().clone();
        Self { folder: tempfile::tempdir().unwrap(), recipes, model }
    }

    fn path(&self, name: &str) -> String {
        self.folder.path().join(name).to_str().unwrap().to_owned()
    }

    fn cad(&self, tool: &str) -> PathBuf {
        cross().join(self.recipes["tools"][tool]["cad"].as_str().unwrap())
    }

    /// Makes a tool; returns its patches and those of the paper's.
    fn make(&self, tool: &str) -> (usize, f64) {
        let (cad, out) = (self.cad(tool), self.path(&format!("{tool}.tool.json")));
        let side =
            format!("--sheet-side={}", self.recipes["tools"][tool]["sheet_side"].as_str().unwrap());
        let mut arguments = vec!["convert", cad.to_str().unwrap(), "-o", &out, &side];
        let options = self.model[tool]["options"].as_array().unwrap();
        arguments.extend(options.iter().map(|o| o.as_str().unwrap()));
        assert_eq!(kanagata(&arguments), 0);
        let made = json(Path::new(&out));
        (made["patches"].as_array().unwrap().len(), self.model[tool]["paper"].as_f64().unwrap())
    }

    /// The audit of a tool that was made.
    fn audit(&self, tool: &str) -> Value {
        let (out, report) = (self.path(&format!("{tool}.tool.json")), self.path("audit.json"));
        let cad = self.cad(tool);
        kanagata(&["audit", &out, "--cad", cad.to_str().unwrap(), "--json", &report]);
        json(Path::new(&report))
    }

    /// Exit code and least clearance [mm] of punch and die after 60 mm, with a sheet of 0.8 mm.
    fn clearance(&self) -> (i32, f64) {
        let [punch, die, report] =
            ["punch.tool.json", "die.tool.json", "clearance.json"].map(|n| self.path(n));
        let code = kanagata(&[
            "audit",
            &punch,
            "--against",
            &die,
            "--travel",
            "0,0,-60",
            "--thickness",
            "0.8",
            "--json",
            &report,
        ]);
        (code, json(Path::new(&report))["min_mm"].as_f64().unwrap())
    }
}

/// Largest |error| [mm].
fn worst(audit: &Value) -> f64 {
    audit["max_mm"].as_f64().unwrap().max(-audit["min_mm"].as_f64().unwrap())
}

/// Principal curvatures of the CAD where an audit's largest error is [1/mm].
fn curvatures(made: &Made, tool: &str, audit: &Value) -> [f64; 2] {
    let model = cad::read(&made.cad(tool)).unwrap().0;
    let at = &audit["worst"][0];
    let number = |k: usize| at["point"][k].as_f64().unwrap();
    let face = &model.faces[at["face"].as_u64().unwrap() as usize];
    let (uv, _) = face.surface.closest(&Vec3::new(number(0), number(1), number(2)));
    let d = face.surface.derivs(uv);
    let n = d.su.cross(&d.sv).normalize();
    let (e, f, g) = (d.su.dot(&d.su), d.su.dot(&d.sv), d.sv.dot(&d.sv));
    let (l, m, k) = (d.suu.dot(&n), d.suv.dot(&n), d.svv.dot(&n));
    let gauss = (l * k - m * m) / (e * g - f * f);
    let mean = (l * g - 2.0 * m * f + k * e) / (2.0 * (e * g - f * f));
    let root = (mean * mean - gauss).max(0.0).sqrt();
    [mean - root, mean + root]
}

#[test]
fn from_85_to_210_patches_the_largest_error_falls_tenfold_in_the_hyperbolic_fillet() {
    let models = ["St-QN-85", "St-QN-210"].map(Made::new);
    let mut errors = [[0.0; 2]; 2];
    for (made, errors) in models.iter().zip(&mut errors) {
        for tool in ["die", "punch", "holder"] {
            let (patches, paper) = made.make(tool);
            assert!((patches as f64 / paper - 1.0).abs() <= 0.1, "{tool}: {patches} of {paper}");
        }
        for (tool, error) in ["die", "punch"].into_iter().zip(errors) {
            let audit = made.audit(tool);
            *error = worst(&audit);
            let [low, high] = curvatures(made, tool, &audit);
            println!(
                "{} {tool}: {error} mm where curvatures are {low} and {high}",
                made.model["name"]
            );
            if tool == "die" {
                assert!(low * high < 0.0, "hyperbolic: {low}, {high}");
                assert!((low.abs().max(high.abs()) - 1.0 / 7.0).abs() < 1e-9, "the 7 mm fillet");
            }
        }
    }
    let [coarse, fine] = errors;
    assert!((8.0..15.0).contains(&(coarse[0] / fine[0])), "die: {coarse:?} to {fine:?}");
    assert!(coarse[1] / fine[1] > 8.0, "punch: {coarse:?} to {fine:?}");
    let (code, least) = models[1].clearance();
    println!("St-QN-210: clearance {least} mm");
    assert!(code == 0 && least > 0.99 * 0.8, "{least}");
}

#[test]
fn the_clearance_of_unst_qn_1103_is_found_too_small_before_any_run() {
    let made = Made::new("Unst-QN-1103");
    for tool in ["die", "punch"] {
        let (patches, paper) = made.make(tool);
        assert!((patches as f64 / paper - 1.0).abs() <= 0.1, "{tool}: {patches} of {paper}");
    }
    // Five times the patches of St-QN-210 and seven times its largest error (0.0108 mm, test above).
    let error = worst(&made.audit("die"));
    assert!(error > 0.07, "{error}");
    let (code, least) = made.clearance();
    println!("Unst-QN-1103: die {error} mm off, clearance {least} mm");
    assert!(code == 1 && least < 0.77, "{least}");
}
