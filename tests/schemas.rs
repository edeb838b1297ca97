//! The files in `schemas/` are what the types say. `KANAGATA_BLESS=1` rewrites them.

use std::path::Path;

use schemars::transform::{RecursiveTransform, Transform};
use schemars::{JsonSchema, Schema, schema_for};

/// Schemas of files that people write.
const COMMENTED: [&str; 4] =
    ["scene.schema.json", "study.schema.json", "stability.schema.json", "patches.schema.json"];

/// Lets editors pass what readers pass over: `$schema`, and keys that begin with `_comment`.
fn allow_comments(schema: &mut Schema) {
    if let Some(object) = schema.as_object_mut()
        && object.get("additionalProperties") == Some(&false.into())
    {
        object.insert("patternProperties".into(), serde_json::json!({ COMMENTS: true }));
    }
}

const COMMENTS: &str = r"^(\$schema$|_comment)";

fn check<T: JsonSchema>(name: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("schemas").join(name);
    let mut schema = schema_for!(T);
    if COMMENTED.contains(&name) {
        RecursiveTransform(allow_comments).transform(&mut schema);
    }
    let now = serde_json::to_string_pretty(&schema).unwrap() + "\n";
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
    check::<kanagata::study::case_file::CaseFile>("case.schema.json");
    check::<kanagata::study::stability::StabilityStudy>("stability.schema.json");
    check::<kanagata::study::patches::PatchStudy>("patches.schema.json");
}

#[test]
fn the_reference_of_doubts_is_what_the_codes_say() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/reference/doubts.md");
    let now = kanagata::cli::doubts::reference();
    if std::env::var_os("KANAGATA_BLESS").is_some() {
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, &now).unwrap();
    }
    let kept = std::fs::read_to_string(&path).unwrap_or_default();
    assert_eq!(kept, now, "docs/reference/doubts.md: run with KANAGATA_BLESS=1");
}

#[test]
fn the_cross_scene_fits_its_schema_and_a_wrong_one_does_not() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let read = |path: &str| -> serde_json::Value {
        serde_json::from_slice(&std::fs::read(root.join(path)).unwrap()).unwrap()
    };
    let validator = jsonschema::validator_for(&read("schemas/scene.schema.json")).unwrap();
    let mut scene = read("fixtures/cross/cross.scene.json");
    assert!(validator.is_valid(&scene));
    scene["$schema"] = "../../schemas/scene.schema.json".into();
    scene["blank"]["_comment"] = "quarter".into();
    assert!(validator.is_valid(&scene));
    scene["blank"]["colour"] = "red".into();
    assert!(!validator.is_valid(&scene));
}
