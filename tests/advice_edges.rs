//! What `kanagata-solve check` says of borders and openings of tools, of sheets that nothing holds, and of patches that are none.

mod advising;

use std::fs;
use std::path::Path;
use std::process::Command;

use advising::{copied, told, tool};
use serde_json::{Value, json};

/// A table whose faces end in a free border below a punch that goes past it, and a holder with an opening.
fn bent_over(folder: &Path, change: impl Fn(&mut Value)) -> String {
    // A flat from x = 12 on, with nothing behind its border; a bar that goes down beside it.
    let table = [[12.0, 0.0, 0.0], [40.0, 0.0, 0.0], [40.0, 20.0, 0.0], [12.0, 20.0, 0.0]];
    tool(folder, "die", "+z", &table, &[[1, 2, 3, 4]]);
    let bar = [[0.0, 0.0, 1.0], [8.0, 0.0, 1.0], [8.0, 20.0, 1.0], [0.0, 20.0, 1.0]];
    tool(folder, "bar", "-z", &bar, &[[4, 3, 2, 1]]);
    let tools = [("die", 1), ("bar", -1)].map(
        |(name, z)| json!({"name": name, "file": format!("{name}.tool.json"), "direction": [0, 0, z]}),
    );
    let scene = json!({
        "format": "kanagata-scene", "version": 1, "name": "border",
        "blank": {
            "shape": {"rectangle": {"size_mm": [30, 20], "elements": [30, 4]}}, "thickness_mm": 1
        },
        "material": "mild-steel-neto2012", "tools": tools, "symmetry": [{"normal": "x"}],
        "stages": [{"name": "bend", "drive": {"bar": {"travel_mm": 10}}}]
    });
    fs::write(folder.join("border.scene.json"), scene.to_string()).unwrap();
    told(folder, "border.scene.json", change)
}

#[test]
fn a_sheet_that_may_be_bent_over_a_free_border_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let words = "the faces of die end in a free border at (12.0, 10.0, 0.0) mm";
    let text = bent_over(folder, |_| {});
    assert!(text.contains(words) && text.contains("by up to 90 degrees"), "{text}");
    // Pushed there with nothing before it.
    let text = bent_over(folder, |scene| {
        scene["stages"][0]["drive"]["bar"] = json!({"force_n": 100});
    });
    assert!(text.contains(words), "{text}");
    let still = bent_over(folder, |scene| {
        scene["stages"][0]["drive"]["bar"]["travel_mm"] = json!(0.5);
    });
    // The sheet ends on the table, and before it.
    let inside = bent_over(folder, |scene| {
        scene["blank"]["shape"]["rectangle"]["size_mm"][0] = json!(12);
    });
    for text in [still, inside] {
        assert!(!text.contains("the faces of die end"), "{text}");
    }
    // A load in place of the bar, down and up.
    let loaded = |force: f64| {
        bent_over(folder, |scene| {
            scene["stages"][0]["drive"]["bar"] = json!({"absent": true});
            let end = json!({"plane": {"normal": "x"}});
            scene["loads"] = json!([{"where": end, "force_n": [0, 0, force]}]);
        })
    };
    assert!(loaded(-10.0).contains(words));
    assert!(!loaded(10.0).contains("the faces of die end"));
}

/// A quarter of a ring of a holder over one of a die, radius 10 to 40 mm with walls, a disc of a sheet between them, and a punch.
fn opening(folder: &Path) {
    // In four parts.
    let at = |k: usize, r: f64, z: f64| {
        let (s, c) = (k as f64 * std::f64::consts::FRAC_PI_8).sin_cos();
        [r * c, r * s, z]
    };
    let rows = |[r, z]: [f64; 2]| (0..5).map(move |k| at(k, r, z));
    let ring = |z: f64, wall: f64| -> Vec<[f64; 3]> {
        rows([40.0, z]).chain(rows([10.0, z])).chain(rows([10.0, wall])).collect()
    };
    let quads: Vec<[usize; 4]> = (0..2)
        .flat_map(|row| {
            (1..5).map(move |k| [5 * row + k, 5 * row + k + 1, 5 * row + k + 6, 5 * row + k + 5])
        })
        .collect();
    tool(folder, "holder", "-z", &ring(1.0, 9.0), &quads);
    let turned: Vec<[usize; 4]> = quads.iter().map(|[a, b, c, d]| [*d, *c, *b, *a]).collect();
    tool(folder, "die", "+z", &ring(0.0, -20.0), &turned);
    tool(folder, "punch", "-z", &PUNCH, &[[4, 3, 2, 1]]);
    let tools = [("die", 1), ("holder", -1), ("punch", -1)].map(
        |(name, z)| json!({"name": name, "file": format!("{name}.tool.json"), "direction": [0, 0, z], "friction": 0.1}),
    );
    let scene = json!({
        "format": "kanagata-scene", "version": 1, "name": "opening",
        "blank": {
            "shape": {"quarter_disc": {"radius_mm": 36, "core": 3, "rings": 4}}, "thickness_mm": 1
        },
        "material": "mild-steel-neto2012", "tools": tools,
        "symmetry": [{"normal": "x"}, {"normal": "y"}],
        "stages": [
            {"name": "clamp", "drive": {"holder": {"force_n": 1000}}},
            {"name": "draw", "drive": {"punch": {"travel_mm": 10}}}
        ]
    });
    fs::write(folder.join("opening.scene.json"), scene.to_string()).unwrap();
}

const PUNCH: [[f64; 3]; 4] = [[0.0, 0.0, 1.0], [8.0, 0.0, 1.0], [5.0, 5.0, 1.0], [0.0, 8.0, 1.0]];

/// The wall of a holder's opening is curved in plan; the sheet is drawn the other way.
#[test]
fn radii_behind_a_holder_are_no_radii_that_the_sheet_bends_over() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    opening(folder);
    let text = told(folder, "opening.scene.json", |_| {});
    assert!(text.contains("mm of die at") && !text.contains("mm of holder at"), "{text}");
    // Pushed up through the holder, it bends over it.
    let ram = PUNCH.map(|[x, y, _]| [x, y, 0.0]);
    tool(folder, "ram", "+z", &ram, &[[1, 2, 3, 4]]);
    let up = told(folder, "opening.scene.json", |scene| {
        scene["tools"][2]["file"] = json!("ram.tool.json");
        scene["tools"][2]["direction"] = json!([0, 0, 1]);
    });
    assert!(up.contains("mm of holder at"), "{up}");
}

#[test]
fn the_pressure_of_a_holder_is_said_and_doubted_where_it_holds_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    opening(folder);
    // 1000 N on a ring of 3750 mm2, less what the facets of tools and sheet cut off.
    let text = told(folder, "opening.scene.json", |_| {});
    let line = text.lines().find(|line| line.contains("pressure")).unwrap();
    let pressure: f64 =
        line.split("holder ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!((0.24..0.32).contains(&pressure), "{line}");
    assert!(!text.contains("holder-pressure") && !text.contains("blank-too-small"), "{text}");
    let weak = told(folder, "opening.scene.json", |scene| {
        scene["stages"][0]["drive"]["holder"]["force_n"] = json!(1);
    });
    assert!(weak.contains("doubt      holder-pressure: holder presses with"), "{weak}");
    // Forty times 0.28 MPa, and 29 times.
    for (force, is_noted) in [(40_000, true), (29_000, false)] {
        let strong = told(folder, "opening.scene.json", |scene| {
            scene["stages"][0]["drive"]["holder"]["force_n"] = json!(force);
        });
        assert_eq!(strong.contains("; holders need 0.5 to 5 MPa"), is_noted, "{strong}");
    }
    let small = told(folder, "opening.scene.json", |scene| {
        scene["blank"]["shape"]["quarter_disc"]["radius_mm"] = json!(9);
        scene["tools"].as_array_mut().unwrap().iter_mut().for_each(|tool| {
            tool["place"] = json!({"shift": [0, 0, 0]});
        });
    });
    assert!(small.contains("doubt      blank-too-small: The blank is hardly between"), "{small}");
}

/// A strip on a die from x = 12 on, below a holder eleven times as long across as the die.
fn below_a_long_holder(folder: &Path, length: f64) -> String {
    let flat = |z: f64, [low, high]: [f64; 2]| {
        [[12.0, low, z], [40.0, low, z], [40.0, high, z], [12.0, high, z]]
    };
    tool(folder, "die", "+z", &flat(0.0, [0.0, 20.0]), &[[1, 2, 3, 4]]);
    tool(folder, "holder", "-z", &flat(1.0, [-100.0, 120.0]), &[[4, 3, 2, 1]]);
    let bar = [[0.0, 0.0, 1.0], [8.0, 0.0, 1.0], [8.0, 20.0, 1.0], [0.0, 20.0, 1.0]];
    tool(folder, "bar", "-z", &bar, &[[4, 3, 2, 1]]);
    let place = json!({"shift": [0, 0, 0]});
    let tools = [("die", 1), ("holder", -1), ("bar", -1)].map(|(name, z)| {
        let file = format!("{name}.tool.json");
        json!({"name": name, "file": file, "direction": [0, 0, z], "place": place, "friction": 0.1})
    });
    let clamp = json!({"holder": {"force_n": 500}});
    let draw = json!({"holder": {"force_n": 500}, "bar": {"travel_mm": 5}});
    let scene = json!({
        "format": "kanagata-scene", "version": 1, "name": "long",
        "blank": {
            "shape": {"rectangle": {"size_mm": [length, 20], "elements": [20, 1]}}, "thickness_mm": 1
        },
        "material": "mild-steel-neto2012", "tools": tools, "symmetry": [{"normal": "x"}],
        "stages": [{"name": "clamp", "drive": clamp}, {"name": "draw", "drive": draw}]
    });
    fs::write(folder.join("long.scene.json"), scene.to_string()).unwrap();
    told(folder, "long.scene.json", |_| {})
}

/// What of the holder is beside the blank does not count. A blank within the opening of die and holder is too small for
/// them, which no patch of theirs can touch.
#[test]
fn a_holder_is_known_by_its_front_over_the_blank_and_of_a_blank_that_misses_it() {
    let folder = tempfile::tempdir().unwrap();
    let over = below_a_long_holder(folder.path(), 30.0);
    // 500 N for both halves, on 18 of 30 mm.
    assert!(over.contains("pressure   holder 0.69 MPa (500 N on 720 mm2)"), "{over}");
    let within = below_a_long_holder(folder.path(), 10.0);
    assert!(within.contains("doubt      blank-too-small: The blank is hardly between"), "{within}");
}

#[test]
fn loads_on_a_sheet_that_nothing_holds_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    copied("u-draw", folder);
    let pulled = |change: &dyn Fn(&mut Value)| {
        told(folder, "u-draw.scene.json", |scene| {
            scene["blank"]["shape"] =
                json!({"rectangle": {"size_mm": [40, 10], "elements": [8, 2]}});
            scene["symmetry"] = json!([]);
            scene["holds"] = json!([]);
            let end = json!({"plane": {"normal": "x", "at_mm": 40}});
            scene["loads"] = json!([{"where": end, "force_n": [100, 0, 0]}]);
            for tool in scene["tools"].as_array_mut().unwrap() {
                let away = 300.0 * -tool["direction"][2].as_f64().unwrap();
                tool["place"] = json!({"shift": [0, 0, away]});
            }
            scene["stages"] = json!([{"name": "pull", "drive": {}}]);
            change(scene);
        })
    };
    let words = "At the end of stage `pull` loads push the sheet along x with 100.000 N";
    assert!(pulled(&|_| {}).contains(words));
    let absent =
        json!({"die": {"absent": true}, "punch": {"absent": true}, "holder": {"absent": true}});
    assert!(pulled(&|scene| scene["stages"][0]["drive"] = absent.clone()).contains(words));
    let held = json!([{"where": {"plane": {"normal": "x"}}, "axes": ["x"]}]);
    let balanced = json!({"where": {"plane": {"normal": "x"}}, "force_n": [-100, 0, 0]});
    for text in [
        pulled(&|scene| scene["holds"] = held.clone()),
        pulled(&|scene| scene["loads"].as_array_mut().unwrap().push(balanced.clone())),
        pulled(&|scene| scene["stages"][0]["load_share"] = json!(0)),
        pulled(&|scene| {
            scene["tools"].as_array_mut().unwrap().iter_mut().for_each(|tool| {
                tool.as_object_mut().unwrap().remove("place");
            });
        }),
    ] {
        assert!(!text.contains("loads push the sheet"), "{text}");
    }
}

#[test]
fn patches_without_area_are_told_and_a_tool_of_them_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    copied("u-draw", folder);
    let path = folder.join("punch.tool.json");
    let whole: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    // A patch whose corners lie on a line, with one vertex in the middle of two.
    let mut punch = whole.clone();
    let vertices = punch["vertices"].as_array_mut().unwrap();
    let [a, b] = [0, 1].map(|k| vertices[k].clone());
    let middle: Vec<f64> =
        (0..3).map(|k| 0.5 * (a[k].as_f64().unwrap() + b[k].as_f64().unwrap())).collect();
    vertices.push(json!(middle));
    let last = vertices.len() - 1;
    let mut flat = punch["patches"][0].clone();
    flat["vertices"] = json!([0, 1, last]);
    let normal = flat["normals"][0].clone();
    flat["normals"] = json!([normal, normal, normal]);
    punch["patches"].as_array_mut().unwrap().push(flat.clone());
    fs::write(&path, punch.to_string()).unwrap();
    let text = told(folder, "u-draw.scene.json", |_| {});
    assert!(text.contains("patches of punch have no area, first patch"), "{text}");
    punch["patches"] = json!([flat]);
    fs::write(&path, punch.to_string()).unwrap();
    let out = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"))
        .arg("check")
        .arg(folder.join("u-draw.scene.json"))
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(2), "{said}");
    assert!(said.contains("none of whose patches has an area"), "{said}");
}
