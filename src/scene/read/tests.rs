use std::fs;

use super::*;

fn scene() -> serde_json::Value {
    serde_json::json!({
        "format": "kanagata-scene", "version": 1, "name": "t",
        "blank": {
            "shape": {"rectangle": {"size_mm": [10.0, 10.0], "elements": [2, 2]}},
            "thickness_mm": 1.0
        },
        "material": "mild-steel-neto2012",
        "tools": [{"name": "die", "file": "die.tool.json", "direction": [0, 0, 1]}],
        "stages": [{"name": "draw", "drive": {"die": {"travel_mm": 1.0}}}],
    })
}

fn fails(change: impl Fn(&mut serde_json::Value)) -> String {
    let mut value = scene();
    change(&mut value);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.scene.json");
    std::fs::write(&path, value.to_string()).unwrap();
    match read(&path) {
        Ok(_) => String::new(),
        Err(error) => error.to_string(),
    }
}

#[test]
fn a_missing_tool_file_is_named_with_its_key_and_remedy() {
    let message = fails(|_| {});
    assert!(message.contains("tools[0].file") && message.contains("die.tool.json"), "{message}");
    assert!(message.contains("convert the CAD"), "{message}");
}

#[test]
fn values_of_another_kind_are_named_by_their_keys() {
    let message =
        fails(|s| s["blank"]["shape"]["rectangle"]["elements"] = serde_json::json!([2, 2, 2]));
    let place = "blank.shape.rectangle.elements: more values than there are to be";
    assert!(message.contains(place) && message.contains("line 1, column"), "{message}");
    let message = fails(|s| {
        let at = serde_json::json!({"all": true, "beyond_radius_mm": 3});
        s["holds"] = serde_json::json!([{"where": at, "axes": ["x"]}]);
    });
    assert!(message.contains("holds[0].where: more than the one key"), "{message}");
    let message = fails(|s| s["stages"][0]["first_increment"] = "small".into());
    assert!(message.contains("stages[0].first_increment: invalid type: string"), "{message}");
    let message = fails(|s| {
        let region = serde_json::json!({"plane": {"normal": "x"}});
        s["holds"] = serde_json::json!([{"where": region, "axes": []}]);
    });
    assert!(message.contains("holds[0].axes: found none"), "{message}");
}

#[test]
fn unknown_keys_and_values_out_of_range_are_named() {
    let message = fails(|s| s["blank"]["colour"] = 1.into());
    assert!(message.contains("colour"), "{message}");
    let message = fails(|s| s["blank"]["thickness_mm"] = (-0.8).into());
    assert!(message.contains("blank.thickness_mm") && message.contains("-0.8"), "{message}");
    let message = fails(|s| s["blank"]["layers"] = 2002.into());
    assert!(message.contains("blank.layers") && message.contains("1 to 100"), "{message}");
    let message = fails(|s| {
        s["blank"]["shape"]["rectangle"]["elements"] =
            serde_json::json!([4_000_000_000u32, 4_000_000_000u32])
    });
    assert!(message.contains("blank: found elements"), "{message}");
    let message = fails(|s| s["stages"][0]["drive"] = serde_json::json!({"dye": {"travel_mm": 1}}));
    assert!(message.contains("'dye'") && message.contains("allowed: die"), "{message}");
    let message = fails(|s| s["tools"][0]["direction"] = serde_json::json!([0, 0, 0]));
    assert!(message.contains("tools[0].direction"), "{message}");
    let message = fails(|s| {
        s["stages"][0]["drive"] = serde_json::json!({"die": {"spring": {"stiffness_n_per_mm": 0}}})
    });
    assert!(message.contains("drive.die.spring.stiffness_n_per_mm: found 0"), "{message}");
    let spring = |stiffness: f64| serde_json::json!({"penalty": {"stiffness": stiffness}});
    let message = fails(|s| s["solver"] = serde_json::json!({"contact": spring(-1.0)}));
    assert!(message.contains("solver.contact.stiffness: found -1"), "{message}");
    let message = fails(|s| s["tools"][0]["stop_mm"] = (-0.1).into());
    assert!(message.contains("tools[0].stop_mm: found -0.1"), "{message}");
    let message = fails(|s| s["solver"] = serde_json::json!({"force_tolerance": 0}));
    assert!(message.contains("solver.force_tolerance: found 0"), "{message}");
    let message = fails(|s| s["version"] = 3.into());
    assert!(message.contains("version: found 3"), "{message}");
}

#[test]
fn drives_and_stages_that_are_not_allowed_are_named() {
    let drive = |drive: serde_json::Value| {
        fails(|s| s["stages"][0]["drive"] = serde_json::json!({"die": drive}))
    };
    let message = drive(serde_json::json!({"travel_mm": [[0, 0], [0.5, 5], [0.4, 3]]}));
    assert!(message.contains("stages[0].drive.die.travel_mm[2]: found fraction 0.4"), "{message}");
    let message = drive(serde_json::json!({"force_n": [[0, 0], [0.5, 5]]}));
    assert!(message.contains("drive.die.force_n[1]"), "{message}");
    let message = drive(serde_json::json!({"force_n": [[0.5, 10], [1, -5]]}));
    assert!(message.contains("found -5; allowed: 0 or more: a tool pushes"), "{message}");
    let message = drive(serde_json::json!({"travel_mm": [[0, 4], [1, 5]]}));
    assert!(message.contains("travel_mm[0]: found 4 mm at fraction 0"), "{message}");
    assert!(message.contains("allowed: 0 mm, where it is"), "{message}");
    let message = drive(serde_json::json!({"travel_mm": "far"}));
    assert!(message.contains("expected a number, or a list of pairs"), "{message}");
    let message = drive(serde_json::json!({"travel_mm": [[0, 0], [0.5, 5], [1, 3]]}));
    assert!(message.contains("tools[0].file"), "only the tool is missing: {message}");
    let message = fails(|s| {
        s["stages"][0]["first_increment"] = 0.2.into();
        s["stages"][0]["largest_increment"] = 0.1.into();
    });
    assert!(message.contains("first_increment: found 0.2; allowed: at most"), "{message}");
    let message = fails(|s| {
        let stage = s["stages"][0].clone();
        s["stages"].as_array_mut().expect("stages are a list").push(stage);
    });
    assert!(
        message.contains("stages[1].name") && message.contains("a name of its own"),
        "{message}"
    );
}

#[test]
fn a_material_with_a_path_is_a_card_file() {
    assert!(is_path("steel.json") && is_path("./steel") && is_path("cards\\steel"));
    assert!(!is_path("mild-steel-neto2012"));
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("x.scene.json");
    let write = |text: &str| std::fs::write(folder.path().join("card.json"), text).unwrap();
    let read = || card_of_file("./card.json", &scene, folder.path());
    let message = read().unwrap_err().to_string();
    assert!(message.contains("x.scene.json, material: ") && message.contains("card.json"));
    write("{\"name\": \"mine\",\n \"young\": 1}");
    let message = read().unwrap_err().to_string();
    assert!(message.contains("`young`") && message.contains("line 2"), "{message}");
    assert!(message.contains("allowed: a material card: `name`"), "{message}");
    let mut value = super::tests::scene();
    value["material"] = "./card.json".into();
    let die =
        concat!(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."), "/fixtures/u-draw/die.tool.json");
    value["tools"][0]["file"] = die.into();
    std::fs::write(&scene, value.to_string()).unwrap();
    write(r#"{"name": "mine", "young_mpa": 70000, "poisson": 0.7}"#);
    let message = super::read(&scene).map(|_| ()).unwrap_err().to_string();
    assert!(message.contains("card.json: material 'mine', poisson: found 0.7"), "{message}");
    write(r#"{"name": "mine", "young_mpa": 70000, "poisson": 0.3}"#);
    let (card, file) = read().unwrap();
    assert_eq!((card.young_mpa, file.file.as_str()), (70000.0, "./card.json"));
    assert_eq!(file.sha256.len(), 64);
}

#[test]
fn a_scene_that_is_no_scene_has_a_line_and_column() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.scene.json");
    let found = |format: &str| {
        std::fs::write(&path, format!("{{\n \"format\": \"{format}\"}}")).unwrap();
        read(&path).map(|_| ()).unwrap_err().to_string()
    };
    let message = found("a-scene");
    assert!(message.contains("line 2, column"), "{message}");
    let message = found("kanagata-tool");
    assert!(message.contains("found a tool file; allowed: a scene"), "{message}");
}

/// The scene of the example in TOML.
fn strip_in_toml() -> String {
    let json =
        fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/strip/strip.scene.json"))
            .unwrap();
    let value: serde_json::Value = serde_json::from_slice(&json).unwrap();
    // TOML wants values before tables; one table for each key of the top level in inline form serves.
    let inline = |v: &serde_json::Value| inline(v);
    let lines = value.as_object().unwrap().iter().map(|(k, v)| format!("{k} = {}\n", inline(v)));
    lines.collect()
}

/// A JSON value as a TOML value in one line.
fn inline(value: &serde_json::Value) -> String {
    match value {
        serde_json::Value::Object(members) => {
            let members = members.iter().map(|(k, v)| format!("{k} = {}", inline(v)));
            format!("{{ {} }}", members.collect::<Vec<_>>().join(", "))
        }
        serde_json::Value::Array(items) => {
            format!("[{}]", items.iter().map(inline).collect::<Vec<_>>().join(", "))
        }
        other => other.to_string(),
    }
}

#[test]
fn a_scene_in_toml_is_the_same_scene() {
    let json =
        fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/strip/strip.scene.json"))
            .unwrap();
    let text = format!("# a comment\n{}", strip_in_toml());
    let path = Path::new("strip.toml");
    assert_eq!(parse(text.as_bytes(), path).unwrap(), parse(&json, Path::new("s.json")).unwrap());
}

#[test]
fn faults_of_a_scene_in_toml_are_named_by_line_or_key() {
    let text = strip_in_toml();
    let message = |text: &str| parse(text.as_bytes(), Path::new("s.toml")).unwrap_err().to_string();
    let open = message(&format!("{text}\nquality = {{\n"));
    let lines = text.lines().count();
    assert!(
        open.contains(&format!("line {}", lines + 2))
            || open.contains(&format!("line {}", lines + 3)),
        "{open}"
    );
    let unknown = message(&text.replace("thickness_mm", "thickness"));
    assert!(unknown.contains("blank") && unknown.contains("thickness"), "{unknown}");
    let range = message(&text.replace("thickness_mm = 1.0", "thickness_mm = -1.0"));
    assert!(range.contains("blank.thickness_mm"), "{range}");
    let twice = message(&format!("{text}\nname = \"again\"\n"));
    assert!(twice.contains("name") || twice.contains("duplicate"), "{twice}");
    let deep = message(&"a.".repeat(100_000));
    assert!(deep.contains("line 1"), "{}", &deep[..100]);
    message(&format!("a = {}", "[".repeat(1_000_000)));
    message("a = 2026-11-29");
    assert!(parse(&[0xff, 0xfe], Path::new("s.toml")).unwrap_err().to_string().contains("UTF-8"));
}
