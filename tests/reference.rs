//! Reference pages in `docs/reference`, generated from the schemas and from `--help`: `KANAGATA_BLESS=1 cargo test --test
//! reference` writes them, without it they are compared.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// Schema, title and an example of every page.
const PAGES: [(&str, &str, &str); 8] = [
    ("scene", "Scene files", "fixtures/dome/dome.scene.json"),
    ("tool", "Tool files", ""),
    ("run", "run.json", ""),
    ("audit", "Audit reports", ""),
    ("study", "Studies", "fixtures/studies/cross-tool.json"),
    ("case", "case.json", ""),
    ("stability", "Studies of stability", "fixtures/studies/stability.json"),
    ("patches", "Studies of patches", "fixtures/studies/patches.json"),
];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn compare(name: &str, now: &str) {
    let path = root().join("docs/reference").join(name);
    if std::env::var_os("KANAGATA_BLESS").is_some() {
        fs::write(&path, now).unwrap();
    }
    let kept = fs::read_to_string(&path).unwrap_or_default();
    assert!(
        kept == now,
        "docs/reference/{name} is not what the program says; run with KANAGATA_BLESS=1"
    );
}

/// Text for a cell of a table.
fn cell(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ").replace('|', "\\|")
}

/// The kind of a value, in words.
fn kind(schema: &Value) -> String {
    if let Some(name) = schema["$ref"].as_str() {
        let name = name.trim_start_matches("#/$defs/");
        return format!("[{name}](#{})", name.to_lowercase());
    }
    if let Some(value) = schema.get("const") {
        return format!("`{value}`");
    }
    for choice in ["anyOf", "oneOf", "allOf"] {
        if let Some(all) = schema[choice].as_array() {
            let all: Vec<String> = all.iter().map(kind).filter(|kind| kind != "null").collect();
            return all.join(" or ");
        }
    }
    if let Some(all) = schema["enum"].as_array() {
        return all.iter().map(|v| format!("`{v}`")).collect::<Vec<_>>().join(", ");
    }
    let types: Vec<&str> = match &schema["type"] {
        Value::String(one) => vec![one],
        Value::Array(all) => {
            all.iter().filter_map(Value::as_str).filter(|t| *t != "null").collect()
        }
        _ => Vec::new(),
    };
    let of = |name: &&str| match *name {
        "array" => {
            let count = match (schema["minItems"].as_u64(), schema["maxItems"].as_u64()) {
                (Some(a), Some(b)) if a == b => format!("{a} x "),
                _ => "list of ".into(),
            };
            format!("{count}{}", kind(&schema["items"]))
        }
        "object" => schema["additionalProperties"].as_object().map_or("object".into(), |values| {
            format!("object of {}", kind(&values.clone().into()))
        }),
        other => other.to_owned(),
    };
    types.iter().map(of).collect::<Vec<_>>().join(" or ")
}

fn range(schema: &Value) -> String {
    let bound = |key: &str| schema[key].as_f64();
    match (bound("minimum"), bound("maximum")) {
        (Some(low), Some(high)) => format!("{low} to {high}"),
        (Some(low), None) => format!("from {low}"),
        (None, Some(high)) => format!("up to {high}"),
        (None, None) => String::new(),
    }
}

/// Keys of an object, a row each.
fn keys(schema: &Value, out: &mut String) {
    let Some(properties) = schema["properties"].as_object().filter(|all| !all.is_empty()) else {
        return;
    };
    let required: Vec<&str> =
        schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    *out += "\n| key | kind | default | range | meaning |\n|---|---|---|---|---|\n";
    for (key, value) in properties {
        let default = match value.get("default") {
            _ if required.contains(&key.as_str()) => "required".into(),
            Some(Value::Null) | None => "-".into(),
            Some(default) => format!("`{default}`"),
        };
        let meaning = cell(value["description"].as_str().unwrap_or_default());
        let (kind, range) = (cell(&kind(value)), range(value));
        let _ = writeln!(out, "| `{key}` | {kind} | {} | {range} | {meaning} |", cell(&default));
    }
}

/// A type: what it is, its keys, or its choices with theirs.
fn section(schema: &Value, out: &mut String) {
    if let Some(text) = schema["description"].as_str() {
        let _ = writeln!(out, "\n{}", text.split_whitespace().collect::<Vec<_>>().join(" "));
    }
    keys(schema, out);
    let choices = ["oneOf", "anyOf"].iter().find_map(|key| schema[*key].as_array());
    for choice in choices.into_iter().flatten() {
        let name = match choice["properties"].as_object().and_then(|all| all.iter().next()) {
            Some((key, value)) if choice["required"].as_array().is_some_and(|r| r.len() == 1) => {
                let inner = value["properties"].is_object();
                let of = if inner { String::new() } else { format!(": {}", kind(value)) };
                format!("`{key}`{of}")
            }
            _ => kind(choice),
        };
        let text = cell(choice["description"].as_str().unwrap_or_default());
        let _ = writeln!(out, "\n- {name}. {text}");
        let value = choice["properties"].as_object().and_then(|all| all.values().next());
        if let Some(value) = value.filter(|value| value["properties"].is_object()) {
            keys(value, out);
        }
    }
}

#[test]
fn pages_of_files_are_what_the_schemas_say() {
    for (name, title, example) in PAGES {
        let path = root().join("schemas").join(format!("{name}.schema.json"));
        let schema: Value = serde_json::from_slice(&fs::read(path).unwrap()).unwrap();
        let mut page = format!("# {title}\n\nGenerated from `schemas/{name}.schema.json`.\n");
        section(&schema, &mut page);
        for (of, definition) in schema["$defs"].as_object().into_iter().flatten() {
            let _ = write!(page, "\n## {of}\n");
            section(definition, &mut page);
        }
        if !example.is_empty() {
            let text = fs::read_to_string(root().join(example)).unwrap();
            let _ =
                write!(page, "\n## Example\n\n`{example}`:\n\n```json\n{}\n```\n", text.trim_end());
        }
        compare(&format!("{name}.md"), &page);
    }
}

/// A program's help, as it is 100 columns wide.
fn help(program: &str, command: &str) -> String {
    let mut call = Command::new(program);
    call.args((!command.is_empty()).then_some(command)).arg("--help").env("COLUMNS", "100");
    let text = String::from_utf8(call.output().unwrap().stdout).unwrap();
    text.lines().map(|line| format!("{}\n", line.trim_end())).collect()
}

#[test]
fn the_page_of_commands_is_what_help_says() {
    let mut page = "# Commands\n\nGenerated from `--help`.\n".to_owned();
    for (name, program) in [
        ("kanagata", env!("CARGO_BIN_EXE_kanagata")),
        ("kanagata-solve", env!("CARGO_BIN_EXE_kanagata-solve")),
    ] {
        let all = help(program, "");
        let commands = all.lines().skip_while(|line| !line.starts_with("Commands:")).skip(1);
        let commands = commands.take_while(|line| line.starts_with("  "));
        let names = commands.filter_map(|line| line.split_whitespace().next());
        for command in names.filter(|command| *command != "help") {
            let text = help(program, command);
            let _ = write!(page, "\n## {name} {command}\n\n```\n{}\n```\n", text.trim_end());
        }
    }
    compare("commands.md", &page);
}
