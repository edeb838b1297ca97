//! What `kanagata-solve check` says of the scenes in `fixtures`, and of the same with their meshes and tools spoilt.

mod advising;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use advising::{copied, told, tool};
use serde_json::{Value, json};

fn elements(counts: [usize; 2]) -> impl Fn(&mut Value) {
    move |scene| scene["blank"]["shape"]["rectangle"]["elements"] = json!(counts)
}

#[test]
fn one_element_across_has_no_halves() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    copied("published/draw", folder);
    let text = told(folder, "case.scene.json", |_| {});
    assert!(!text.contains("symmetric about"), "{text}");
    let text = told(folder, "case.scene.json", elements([175, 2]));
    // 176 x 2 columns of two nodes.
    assert!(text.contains("symmetric about y = 0.5") && text.contains("2112 unknowns"), "{text}");
}

#[test]
fn elements_are_coarse_along_the_bend_alone() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    copied("published/bend", folder);
    let with = |counts| told(folder, "case.scene.json", elements(counts));
    // 90 degrees of the shoulder's 4 mm are 6.3 mm along x.
    for counts in [[60, 6], [60, 1]] {
        let text = with(counts);
        assert!(!text.contains("for the radius of"), "{text}");
    }
    let text = with([6, 60]);
    for part in ["elements-too-long: Elements of 10.00 mm", "4.00 mm of die", ": 0.6 over 90"] {
        assert!(text.contains(part), "{part}: {text}");
    }
}

#[test]
fn a_tool_that_begins_in_the_sheet_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    copied("u-draw", folder);
    let at = |down: f64| {
        told(folder, "u-draw.scene.json", |scene| {
            scene["tools"][2]["place"] = json!({"shift": [0.0, 0.0, -down]});
        })
    };
    assert!(!at(0.0).contains("inside punch"));
    let text = at(0.3);
    for part in ["doubt", "inside-tool: ", "of the sheet are inside punch, the deepest by 0.3"] {
        assert!(text.contains(part), "{part}: {text}");
    }
}

#[test]
fn a_tool_far_from_a_loaded_sheet_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    copied("u-draw", folder);
    let above = |up: f64| {
        told(folder, "u-draw.scene.json", |scene| {
            scene["tools"][2]["place"]["shift"] = json!([0.0, 0.0, up]);
        })
    };
    let text = above(0.0);
    assert!(!text.contains("can touch none"), "{text}");
    for up in [100.0, 1000.0] {
        let text = above(up);
        assert!(text.contains("the sheet can touch none of the "), "{text}");
    }
}

/// The rim of the round cup (radius 53.75 mm) is drawn out from under its holder, which has distance blocks.
#[test]
fn a_holder_that_loses_the_sheet_wants_a_stop() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    copied("published/round-cup", folder);
    let text = told(folder, "case.scene.json", |_| {});
    assert!(!text.contains("has no stop"), "{text}");
    let without = |travel: f64| {
        move |scene: &mut Value| {
            scene["tools"].as_array_mut().unwrap().iter_mut().for_each(|tool| {
                tool.as_object_mut().unwrap().remove("stop_mm");
            });
            for stage in scene["stages"].as_array_mut().unwrap() {
                if stage["drive"]["punch"]["travel_mm"].is_number() {
                    stage["drive"]["punch"]["travel_mm"] = json!(travel);
                }
            }
        }
    };
    let text = told(folder, "case.scene.json", without(48.0));
    for part in
        ["holder is driven by a force and has no stop", "and punch travels 48.0 mm", "`stop_mm`"]
    {
        assert!(text.contains(part), "{part}: {text}");
    }
    let text = told(folder, "case.scene.json", without(10.0));
    assert!(!text.contains("has no stop"), "{text}");
}

#[test]
fn a_tool_that_pushes_against_nothing_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    copied("u-draw", folder);
    let with = |last: Value| {
        told(folder, "u-draw.scene.json", |scene| {
            let clamp = json!({"holder": {"force_n": 100.0}});
            scene["stages"] =
                json!([{"name": "clamp", "drive": clamp}, {"name": "off", "drive": last}]);
        })
    };
    let words = "tool-unopposed: At the end of stage `off` holder pushes with 100 N";
    for (last, is_told) in [
        (json!({"punch": {"travel_mm": 1.0}}), false),
        (json!({"die": {"release": true}}), true),
        (json!({"die": {"release": true}, "holder": {"release": true}}), false),
    ] {
        let text = with(last);
        assert_eq!(text.contains(words), is_told, "{text}");
        assert_eq!(text.contains("die is released in this stage"), is_told, "{text}");
        assert!(!text.contains("At the end of stage `clamp`"), "{text}");
    }
    // A spring goes on to where it has no force.
    let text = told(folder, "u-draw.scene.json", |scene| {
        let clamp = json!({"holder": {"spring": {"stiffness_n_per_mm": 20.0, "force_n": 40.0}}});
        scene["stages"] = json!([
            {"name": "clamp", "drive": clamp}, {"name": "off", "drive": {"die": {"absent": true}}}
        ]);
    });
    assert!(!text.contains("pushes with"), "{text}");
    // What is held at its end can carry a holder alone.
    let text = told(folder, "u-draw.scene.json", |scene| {
        let clamp = json!({"holder": {"force_n": 100.0}, "die": {"absent": true}});
        scene["stages"] = json!([{"name": "clamp", "drive": clamp}]);
        let end = json!({"where": {"plane": {"normal": "x"}}, "axes": ["x", "z"]});
        scene["holds"] = json!([end]);
    });
    assert!(!text.contains("pushes with"), "{text}");
}

#[test]
fn a_tool_that_goes_the_wrong_way_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    copied("u-draw", folder);
    let with = |up: f64, travel: f64| {
        told(folder, "u-draw.scene.json", |scene| {
            scene["tools"][2]["place"]["shift"] = json!([0.0, 0.0, up]);
            scene["stages"][0]["drive"]["punch"]["travel_mm"] = json!(travel);
        })
    };
    let text = with(0.0, 15.0);
    assert!(!text.contains("moves away") && !text.contains("stays at least"), "{text}");
    let text = with(0.0, -15.0);
    assert!(text.contains("punch moves away from the sheet"), "{text}");
    assert!(text.contains("is 15.0") && text.contains("reversed"), "{text}");
    let text = with(7.0, 2.0);
    assert!(text.contains("punch travels from 0.00 to 2.00 mm and stays at least"), "{text}");
    // Past the end of the sheet, somewhere on its way.
    let past = told(folder, "u-draw.scene.json", |scene| {
        scene["tools"][2]["direction"] = json!([1.0, 0.0, 0.0]);
        scene["tools"][2]["side"] = json!("top");
        scene["tools"][2]["place"]["shift"] = json!([-1500.0, 0.0, -3.0]);
        scene["stages"][0]["drive"]["punch"]["travel_mm"] = json!(4000.0);
    });
    assert!(past.contains("punch to 4000 mm") && !past.contains("stays at least"), "{past}");
    // A punch that has drawn, and a die that goes with it.
    let after = told(folder, "u-draw.scene.json", |scene| {
        let back = json!({"name": "back", "drive": {"punch": {"travel_mm": -1.0}, "die": {"travel_mm": -9.0}}});
        scene["stages"].as_array_mut().unwrap().push(back);
    });
    assert!(!after.contains("moves away"), "{after}");
}

/// The cross tool of the cross tool with so many patches over 90 degrees.
fn cross_tools(folder: &Path, divisions: &str) {
    for tool in ["die", "punch", "holder"] {
        let cad: PathBuf = ["fixtures", "cross", &format!("{tool}.igs")].iter().collect();
        let out = Command::new(env!("CARGO_BIN_EXE_kanagata"))
            .arg("convert")
            .arg(cad)
            .args(["--threads", "1", "--arc-divisions", divisions, "-o"])
            .arg(folder.join(format!("{tool}.tool.json")))
            .output()
            .unwrap();
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    }
}

/// What `check` says of the cross tool with such tools.
fn cross(divisions: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    cross_tools(folder, divisions);
    copied("cross", folder);
    told(folder, "cross.scene.json", |_| {})
}

#[test]
fn patches_of_the_cross_tool_are_too_coarse_right_or_too_fine() {
    let coarse = cross("1");
    for part in ["too coarse", "of die", "turns by 90 degrees", "convert --tol"] {
        assert!(coarse.contains(part), "{part}: {coarse}");
    }
    assert!(!coarse.contains("shorter than a quarter"), "{coarse}");
    let fine = cross("24");
    for tool in ["die", "punch"] {
        let note = format!("patches of {tool} within reach are shorter than a quarter");
        assert!(fine.contains(&note), "{fine}");
    }
    assert!(!fine.contains("too coarse"), "{fine}");
}

#[test]
fn a_sheet_drawn_over_a_sharp_edge_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // A block whose top and wall meet at x = 12 in a right angle; a bar that goes down beside it.
    let block = [[12.0, 0.0, -30.0], [12.0, 20.0, -30.0], [12.0, 0.0, 0.0], [12.0, 20.0, 0.0]];
    let top = [[40.0, 0.0, 0.0], [40.0, 20.0, 0.0]];
    let block: Vec<[f64; 3]> = block.into_iter().chain(top).collect();
    tool(folder, "die", "+z", &block, &[[2, 1, 3, 4], [4, 3, 5, 6]]);
    let bar = [[0.0, 0.0, 1.0], [8.0, 0.0, 1.0], [8.0, 20.0, 1.0], [0.0, 20.0, 1.0]];
    tool(folder, "bar", "-z", &bar, &[[4, 3, 2, 1]]);
    let tools = [("die", 1), ("bar", -1)].map(
        |(name, z)| json!({"name": name, "file": format!("{name}.tool.json"), "direction": [0, 0, z]}),
    );
    let scene = json!({
        "format": "kanagata-scene", "version": 1, "name": "edge",
        "blank": {
            "shape": {"rectangle": {"size_mm": [30, 20], "elements": [30, 4]}}, "thickness_mm": 1
        },
        "material": "mild-steel-neto2012", "tools": tools, "symmetry": [{"normal": "x"}],
        "stages": [{"name": "bend", "drive": {"bar": {"travel_mm": 10}}}]
    });
    fs::write(folder.join("edge.scene.json"), scene.to_string()).unwrap();
    let text = told(folder, "edge.scene.json", |_| {});
    for part in ["die has a sharp edge at (12.0, 10.0, 0.0) mm, of 90 degrees", "radius of 1.27"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let still = told(folder, "edge.scene.json", |scene| {
        scene["stages"][0]["drive"]["bar"]["travel_mm"] = json!(0.5);
    });
    assert!(!still.contains("sharp edge"), "{still}");
    let beside = told(folder, "edge.scene.json", |scene| {
        scene["blank"]["shape"]["rectangle"]["size_mm"][0] = json!(11);
        scene["tools"][0]["place"] = json!({"shift": [0, 0, 0]});
    });
    assert!(!beside.contains("sharp edge"), "{beside}");
    // Past the die's flat and not past its edge: nothing takes the sheet down there.
    let over = told(folder, "edge.scene.json", |scene| {
        scene["tools"][1]["place"] = json!({"shift": [20, 0, 0]});
    });
    assert!(!over.contains("sharp edge"), "{over}");
}

/// A quarter of a sheet whose rolling direction is its own image, and of one whose is not.
#[test]
fn planes_about_which_the_material_is_not_symmetric_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    copied("published/round-cup", folder);
    let rolled = |degrees: f64| {
        told(folder, "case.scene.json", |s| s["blank"]["rolling_direction_deg"] = json!(degrees))
    };
    let named = |text: &str| text.matches("symmetry-wrong: The rolling direction is askew").count();
    assert_eq!([0.0, 90.0, 30.0].map(|degrees| named(&rolled(degrees))), [0, 0, 2]);
}

#[test]
fn a_quarter_disc_without_its_planes_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::create_dir_all(folder).unwrap();
    copied("published/hemisphere", folder);
    let with = |planes: Value, axes: Value| {
        told(folder, "case.scene.json", |scene| {
            scene["symmetry"] = planes.clone();
            scene["holds"][0]["axes"] = axes.clone();
        })
    };
    let cut = |axis: &str| {
        format!("symmetry-missing: The blank has a straight free side at {axis} = 0.0000 mm")
    };
    let both = json!([{"normal": "x"}, {"normal": "y"}]);
    assert!(!with(both, json!(["z"])).contains("symmetry-missing"));
    let text = with(json!([{"normal": "y"}]), json!(["z"]));
    assert!(text.contains(&cut("x")) && !text.contains(&cut("y")), "{text}");
    let text = with(json!([]), json!(["z"]));
    assert!(text.contains(&cut("x")) && text.contains(&cut("y")), "{text}");
}

/// The quarter of a rectangle in quarters of tools.
#[test]
fn a_quarter_of_a_sheet_without_its_planes_is_a_doubt() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    cross_tools(folder, "2");
    copied("cross", folder);
    assert!(!told(folder, "cross.scene.json", |_| {}).contains("symmetry-missing"));
    let text = told(folder, "cross.scene.json", |scene| scene["symmetry"] = json!([]));
    for axis in ["x", "y"] {
        let cut =
            format!("symmetry-missing: The blank has a straight free side at {axis} = 0.0000");
        assert!(text.contains(&cut), "{text}");
    }
    assert_eq!(text.matches("symmetry-missing").count(), 2, "{text}");
    // A rim that is clamped holds an end of the cut side.
    let text = told(folder, "cross.scene.json", |scene| {
        scene["symmetry"] = json!([]);
        let region = json!({"beyond_radius_mm": 124.0});
        scene["holds"] = json!([{"where": region, "axes": ["x", "y", "z"]}]);
    });
    assert_eq!(text.matches("symmetry-missing").count(), 2, "{text}");
}

/// The die has a radius of 7 mm, the sheet 0.8 and 1.6.
#[test]
fn one_layer_over_a_sharp_radius_is_told_where_it_springs_back() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    copied("u-draw", folder);
    let with = |layers: usize, thickness: f64, lets_go: bool| {
        told(folder, "u-draw.scene.json", |scene| {
            scene["blank"]["layers"] = json!(layers);
            scene["blank"]["thickness_mm"] = json!(thickness);
            if lets_go {
                let all = json!({"die": {"release": true}, "punch": {"release": true}, "holder": {"release": true}});
                scene["stages"].as_array_mut().unwrap().push(json!({"name": "off", "drive": all}));
            }
        })
    };
    let words = "springs back by up to twice";
    assert!(with(1, 1.6, true).contains(words));
    for (layers, thickness, lets_go) in [(1, 0.8, true), (2, 1.6, true), (1, 1.6, false)] {
        let text = with(layers, thickness, lets_go);
        assert!(!text.contains(words), "{text}");
    }
    assert!(with(2, 0.8, true).contains("one bends as well"));
    assert!(!with(2, 1.6, true).contains("one bends as well"));
}

#[test]
fn loads_are_told_with_what_of_them_is_on_the_modelled_part() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    copied("u-draw", folder);
    let text = told(folder, "u-draw.scene.json", |scene| {
        scene["symmetry"] = json!([{"normal": "x"}]);
    });
    assert!(text.contains("(16, 0, 0) N ((8, 0, 0) N on the modelled part)"), "{text}");
}

#[test]
fn layers_and_points_that_are_too_few_for_bending_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    copied("u-draw", folder);
    let with = |layers: usize, element: Value| {
        told(folder, "u-draw.scene.json", |scene| {
            scene["blank"]["layers"] = json!(layers);
            scene["blank"]["element"] = element.clone();
        })
    };
    for name in ["hex8", "hex8-enhanced"] {
        let words =
            format!("too-few-points: One layer of {name} has two points through the thickness");
        assert!(with(1, json!(name)).contains(&words));
        assert!(!with(2, json!(name)).contains(&words));
    }
    // Drawn over 7 mm, less than nine thicknesses.
    let points = |layers, points| with(layers, json!({"solid-shell": {"points": points}}));
    let words = "may have an error of a third";
    assert!(points(1, 5).contains(words), "{}", points(1, 5));
    assert!(!points(1, 9).contains(words) && !points(2, 5).contains(words));
    // Fourteen thicknesses, where six points are enough: seven are too many and less accurate, in one note.
    let thin = |points: usize| {
        told(folder, "u-draw.scene.json", |scene| {
            scene["blank"]["thickness_mm"] = json!(0.5);
            scene["blank"]["layers"] = json!(1);
            scene["blank"]["element"] = json!({"solid-shell": {"points": points}});
            let release = json!({"release": true});
            let drive = json!({"die": release, "holder": release, "punch": release});
            scene["stages"].as_array_mut().unwrap().push(json!({"name": "off", "drive": drive}));
        })
    };
    let notes = |points| thin(points).matches("points through the thickness").count();
    assert_eq!([notes(6), notes(7), notes(8)], [0, 1, 1], "{}", thin(7));
    assert!(thin(7).contains("is 2 to 3 % low") && thin(8).contains("6 are enough here"));
}
