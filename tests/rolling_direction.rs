//! Anisotropic sheets that lie in any way: the rolling direction of a scene as an angle or as a vector.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use kanagata::geometry::Vec3;
use kanagata::scene::read;
use kanagata::solver::sheet::hex_mesh::rectangle;
use kanagata::solver::{Control, Simulation};
use serde_json::{Value, json};

mod bend;

const LENGTH: f64 = 20.0;
const WIDTH: f64 = 4.0;
const THICKNESS: f64 = 0.8;

/// A place of the strip, whose plane is turned by `degrees` about x.
fn turned(x: &Vec3, degrees: f64) -> Vec3 {
    let (s, c) = degrees.to_radians().sin_cos();
    Vec3::new(x.x, c * x.y - s * x.z, s * x.y + c * x.z)
}

/// The scene of a strip of hexahedra in a deck, one across so that equal forces on its nodes pull it evenly along x; its tools
/// are absent.
fn scene(folder: &Path, degrees: f64, change: impl FnOnce(&mut Value)) -> PathBuf {
    bend::write_tools(folder);
    let mesh = rectangle(LENGTH, WIDTH, THICKNESS, 4, 1, 1);
    let mut deck = String::from("*NODE\n");
    for (n, x) in mesh.nodes.iter().enumerate() {
        let x = turned(x, degrees);
        let _ = writeln!(deck, "{}, {:.17}, {:.17}, {:.17}", n + 1, x.x, x.y, x.z);
    }
    deck.push_str("*ELEMENT, TYPE=C3D8\n");
    for (k, element) in mesh.elements.iter().enumerate() {
        let ids = element.map(|n| (n + 1).to_string()).join(", ");
        let _ = writeln!(deck, "{}, {ids}", k + 1);
    }
    fs::write(folder.join("strip.inp"), deck).unwrap();
    let mut scene = bend::scene("");
    scene["blank"] = json!({"shape": {"mesh": {"file": "strip.inp"}}});
    for tool in scene["tools"].as_array_mut().unwrap() {
        tool["place"] = json!({"shift": [0, 0, 0]});
        tool["side"] = json!("both");
    }
    let near = |x: &Vec3| {
        let x = turned(x, degrees);
        json!({"box": {"min_mm": [x.x - 1e-6, x.y - 1e-6, x.z - 1e-6], "max_mm": [x.x + 1e-6, x.y + 1e-6, x.z + 1e-6]}})
    };
    let beside = if degrees == 0.0 { "z" } else { "y" };
    scene["holds"] = json!([
        {"where": {"plane": {"normal": "x"}}, "axes": ["x"]},
        {"where": near(&Vec3::zeros()), "axes": ["y", "z"]},
        {"where": near(&(WIDTH * Vec3::y())), "axes": [beside]},
    ]);
    let end = json!({"plane": {"normal": "x", "at_mm": LENGTH}});
    scene["loads"] = json!([{"where": end, "force_n": [665.0, 0, 0]}]);
    let absent = json!({"post": {"absent": true}, "plane": {"absent": true}});
    scene["stages"] = json!([{"name": "pull", "drive": absent}]);
    scene["solver"] = json!({"force_tolerance": 1e-10});
    change(&mut scene);
    let path = folder.join("strip.scene.json");
    fs::write(&path, scene.to_string()).unwrap();
    path
}

/// Strains of a strip along its length, its width and its thickness.
fn strains(degrees: f64, change: impl FnOnce(&mut Value)) -> [f64; 3] {
    let folder = tempfile::tempdir().unwrap();
    let path = scene(folder.path(), degrees, change);
    let setup = read(&path).unwrap().simulation_setup(&path).unwrap();
    let nodes = setup.body.mesh().nodes.clone();
    let place = |x: [f64; 3]| {
        let x = turned(&Vec3::from(x), degrees);
        nodes.iter().position(|n| (n - x).norm() < 1e-9).unwrap()
    };
    let ends = [[LENGTH, 0.0, 0.0], [0.0, WIDTH, 0.0], [0.0, 0.0, THICKNESS]].map(place);
    let corner = place([0.0; 3]);
    let mut sim = Simulation::new(setup).unwrap();
    sim.run(&mut |_| Control::Continue).unwrap();
    let u = sim.displacements();
    let moved = |n: usize| nodes[n] + Vec3::from_column_slice(&u[3 * n..3 * n + 3]);
    ends.map(|n| ((moved(n) - moved(corner)).norm() / (nodes[n] - nodes[corner]).norm()).ln())
}

#[test]
fn strips_pulled_in_any_plane_have_one_r_value() {
    let flat = strains(0.0, |_| {});
    // Elastic strains are in it: r0 is 2.367.
    let r = flat[1] / flat[2];
    assert!((2.3..2.367).contains(&r) && flat[0] > 0.02, "{r} {flat:?}");
    for degrees in [45.0, 90.0] {
        let found = strains(degrees, |s| s["blank"]["rolling_direction"] = json!([2, 0, 0]));
        for (found, flat) in found.iter().zip(&flat) {
            assert!((found / flat - 1.0).abs() < 1e-9, "{degrees} degrees: {found} {flat}");
        }
    }
    let across = strains(0.0, |s| s["blank"]["rolling_direction_deg"] = json!(90));
    let upright = strains(90.0, |s| s["blank"]["rolling_direction"] = json!([0, 0, 1]));
    assert!((across[0] / flat[0] - 1.0).abs() > 0.05);
    assert!((upright[1] / upright[2] / (across[1] / across[2]) - 1.0).abs() < 1e-9);
}

/// What is said of a scene that is set up; nothing of a sound one, with whether its material has axes by element.
fn said(degrees: f64, change: impl FnOnce(&mut Value)) -> Result<bool, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = scene(folder.path(), degrees, change);
    let setup = read(&path).and_then(|plan| plan.simulation_setup(&path));
    setup.map(|s| s.body.material_axes().is_some()).map_err(|e| e.to_string())
}

#[test]
fn a_rolling_direction_that_says_nothing_is_refused() {
    let message = said(45.0, |_| {}).unwrap_err();
    for part in [
        "strip.scene.json, blank.rolling_direction: found none, where material 'mild-steel-neto2012' is anisotropic and the blank does not lie across z",
        "mm has the normal (0.000, -0.707, 0.707)",
        "allowed: the rolling direction as a vector [x, y, z]",
        "`rolling_direction_deg`",
        "or an isotropic material",
    ] {
        assert!(message.contains(part), "{part}: {message}");
    }
    let vector = |v: Value| said(45.0, |s| s["blank"]["rolling_direction"] = v);
    let message = vector(json!([0.1, -1, 1])).unwrap_err();
    for part in
        ["found [0.1, -1.0, 1.0], 4.0 degrees from the sheet's normal", "at least 10 degrees"]
    {
        assert!(message.contains(part), "{part}: {message}");
    }
    assert_eq!(vector(json!([0.3, -1, 1])), Ok(true));
    let message = vector(json!([0, 0, 0])).unwrap_err();
    assert!(message.contains("a vector [x, y, z] that is not zero"), "{message}");
    let message = said(0.0, |s| {
        s["blank"]["rolling_direction"] = json!([1, 0, 0]);
        s["blank"]["rolling_direction_deg"] = json!(30);
    });
    assert!(message.unwrap_err().contains("beside blank.rolling_direction_deg 30"));
}

#[test]
fn sheets_across_z_and_isotropic_ones_need_no_vector() {
    assert_eq!(said(0.0, |s| s["blank"]["rolling_direction_deg"] = json!(30)), Ok(false));
    assert_eq!(said(1e-4, |_| {}), Ok(false));
    assert_eq!(said(0.0, |s| s["blank"]["rolling_direction"] = json!([1, 1, 0])), Ok(true));
    let von_mises = |s: &mut Value| s["material"] = json!("sheet-ssnv501");
    assert_eq!(said(45.0, von_mises), Ok(false));
    let along_the_normal = |s: &mut Value| {
        von_mises(s);
        s["blank"]["rolling_direction"] = json!([0, -1, 1]);
    };
    assert_eq!(said(45.0, along_the_normal), Ok(false));
}
