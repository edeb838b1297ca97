//! A scene says what it means: a key that is not known is refused wherever it stands, and elements go by their names.

use kanagata::scene::Scene;
use kanagata::solver::element::ElementKind;
use serde_json::{Value, json};

/// A scene with every kind of object that one may hold.
fn full() -> Value {
    json!({
        "format": "kanagata-scene", "version": 1, "name": "all keys",
        "blank": {
            "shape": {"rectangle": {"size_mm": [10, 10], "elements": [2, 2]}},
            "thickness_mm": 1, "element": {"solid-shell": {"points": 7, "membrane": false}},
            "refine": [
                {"level": 1, "where": {"box": {"min_mm": [0, 0], "max_mm": [5, 5]}}},
                {"level": 2, "where": {"ring": {"radii_mm": [0, 3]}}}
            ]
        },
        "material": {
            "name": "mine", "young_mpa": 2e5, "poisson": 0.3,
            "hardening": {"law": "swift", "k": 500, "eps0": 0.01, "n": 0.2},
            "yield": {"criterion": "hill48-r", "r0": 1.7, "r45": 1.5, "r90": 2.1},
            "backstresses": [{"c_mpa": 1000, "gamma": 10}]
        },
        "symmetry": [{"normal": "x"}],
        "holds": [{"where": {"plane": {"normal": "y"}}, "axes": ["y"]}],
        "loads": [{"where": {"box": {"min_mm": [0, 0, 0], "max_mm": [1, 1, 1]}}, "force_n": [1, 0, 0]}],
        "tools": [{"name": "die", "file": "die.tool.json", "direction": [0, 0, 1], "place": {"shift": [0, 0, 0]}}],
        "stages": [
            {"name": "a", "drive": {"die": {"spring": {"stiffness_n_per_mm": 5}}}},
            {"name": "b", "drive": {"die": {"force_n": [[0.5, 10], [1, 20]]}}}
        ],
        "solver": {"contact": {"penalty": {"stiffness": 10}}},
        "output": {"vtu_every": 1}
    })
}

#[test]
fn a_fault_of_a_card_in_a_scene_is_told_as_the_cards() {
    let mut scene = full();
    scene["material"]["hardening"]["eps"] = 1.into();
    let message = serde_json::from_value::<Scene>(scene.clone()).unwrap_err().to_string();
    assert!(message.contains("`eps`"), "{message}");
    scene["material"] = 7.into();
    let message = serde_json::from_value::<Scene>(scene).unwrap_err().to_string();
    assert!(message.contains("a card file or a card"), "{message}");
}

/// Pointers to all objects in a value.
fn objects(value: &Value, pointer: String, out: &mut Vec<String>) {
    match value {
        Value::Object(map) => {
            for (key, inner) in map {
                objects(inner, format!("{pointer}/{key}"), out);
            }
            out.push(pointer);
        }
        Value::Array(list) => {
            for (k, inner) in list.iter().enumerate() {
                objects(inner, format!("{pointer}/{k}"), out);
            }
        }
        _ => {}
    }
}

#[test]
fn a_key_that_is_not_known_is_refused_wherever_it_stands() {
    let scene = full();
    serde_json::from_value::<Scene>(scene.clone()).unwrap();
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("schemas/scene.schema.json");
    let schema = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
    let validator = jsonschema::validator_for(&schema).unwrap();
    assert!(validator.is_valid(&scene));
    let mut all = Vec::new();
    objects(&scene, String::new(), &mut all);
    assert!(all.len() > 20);
    for pointer in all {
        let mut wrong = scene.clone();
        wrong.pointer_mut(&pointer).unwrap()["surprise"] = 1.into();
        assert!(
            serde_json::from_value::<Scene>(wrong.clone()).is_err(),
            "read: surprise in {pointer}"
        );
        assert!(!validator.is_valid(&wrong), "fits the schema: surprise in {pointer}");
    }
}

#[test]
fn an_element_goes_by_its_name() {
    let element = |value: Value| {
        let mut scene = full();
        scene["blank"]["element"] = value;
        serde_json::from_value::<Scene>(scene).map(|s| s.blank.element).map_err(|e| e.to_string())
    };
    let shell = ElementKind::SolidShell { points: 6, membrane: true };
    assert_eq!(ElementKind::default(), shell);
    assert_eq!(element("hex8".into()), Ok(ElementKind::Hex8));
    assert_eq!(element("hex8-enhanced".into()), Ok(ElementKind::Hex8Enhanced));
    assert_eq!(element("solid-shell".into()), Ok(shell));
    assert_eq!(element(json!({"solid-shell": {}})), Ok(shell));
    let written =
        serde_json::to_value(ElementKind::SolidShell { points: 7, membrane: false }).unwrap();
    assert_eq!(element(written), Ok(ElementKind::SolidShell { points: 7, membrane: false }));
    let refused = |value: Value| element(value).unwrap_err();
    assert!(refused("shell".into()).contains("one of `hex8`, `hex8-enhanced`, `solid-shell`"));
    assert!(refused(json!({"solid-shell": {"point": 5}})).contains("`point`"));
    assert!(refused(json!({"hex8": {"layers": 2}})).contains("write \"hex8\" alone"));
    assert!(refused(json!({"solid-shell": {}, "tetra": {}})).contains("not several"));
    assert!(refused(json!({})).contains("one element"));
    assert!(refused(8.into()).contains("an element: one of"));
}
