//! The files in `schemas/` are what the types say. `KANAGATA_BLESS=1` rewrites them.

use std::path::Path;

use schemars::{JsonSchema, schema_for};

fn check<T: JsonSchema>(name: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("schemas").join(name);
    let now = serde_json::to_string_pretty(&schema_for!(T)).unwrap() + "\n";
    if std::env::var_os("KANAGATA_BLESS").is_some() {
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, &now).unwrap();
    }
    let kept = std::fs::read_to_string(&path).unwrap_or_default();
    assert_eq!(kept, now, "{name} is not what the types say; run with KANAGATA_BLESS=1");
}

#[test]
fn schemas_are_what_the_types_say() {
    check::<kanagata::tool::file::ToolFile>("tool.schema.json");
    check::<kanagata::scene::Scene>("scene.schema.json");
    check::<kanagata::report::record::RunRecord>("run.schema.json");
    check::<kanagata::audit::AuditReport>("audit.schema.json");
    check::<kanagata::study::file::Study>("study.schema.json");
    check::<kanagata::study::stability::StabilityStudy>("stability.schema.json");
    check::<kanagata::study::patches::PatchStudy>("patches.schema.json");
}

#[test]
fn the_demo_scene_fits_its_schema_and_a_wrong_one_does_not() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let read = |path: &str| -> serde_json::Value {
        serde_json::from_slice(&std::fs::read(root.join(path)).unwrap()).unwrap()
    };
    let validator = jsonschema::validator_for(&read("schemas/scene.schema.json")).unwrap();
    let mut scene = read("fixtures/cross/demo.scene.json");
    assert!(validator.is_valid(&scene));
    scene["blank"]["colour"] = "red".into();
    assert!(!validator.is_valid(&scene));
}
