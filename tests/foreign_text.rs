//! Names that others wrote, with markup, quotes, control characters and formulas, in pages, drawings and tables.
#![cfg(unix)]

mod bend;
mod command;

use std::fs;
use std::path::Path;

use command::{fixture, kanagata};
use kanagata::report::csv;
use serde_json::json;

/// A name of scenes, stages and materials.
const NAME: &str =
    "=1+1<script>alert(1)</script><img src=x onerror=alert(2)>\"'&\u{7}\u{1b}[2J\u{202e}%{x}";
/// The same as far as it can be the name of a file.
const FILE: &str = "=1+1<script><img src=x onerror=alert(2)>\"'&\u{7}\u{1b}[2J\u{202e}%{x}";

fn text(path: &Path) -> String {
    fs::read_to_string(path).unwrap()
}

/// Asserts that there are no hidden characters in a text but line breaks and tabs.
fn is_visible(text: &str) {
    let hidden = text.chars().find(|c| {
        (c.is_control() && !matches!(c, '\n' | '\t')) || matches!(c, '\u{202a}'..='\u{202e}')
    });
    assert_eq!(hidden, None);
}

/// Asserts that the scripts of a page are its own and that the names in it are text; gives it without the contents of
/// scripts.
fn page_of(path: &Path) -> String {
    let page = text(path);
    let mut body = String::new();
    let mut rest = page.as_str();
    while let Some((before, script)) = rest.split_once("<script") {
        let (attributes, script) = script.split_once('>').unwrap();
        let (script, after) = script.split_once("</script>").unwrap();
        let is_data = attributes.starts_with(" type=\"application/json\" ");
        assert!(is_data || attributes.is_empty(), "{attributes}");
        // Data have no tag; code is that of the program, whatever the names.
        assert!(!is_data || !script.contains('<'), "{script}");
        assert!(is_data || !script.contains("alert"), "{script}");
        is_visible(script);
        body += before;
        rest = after;
    }
    body += rest;
    is_visible(&body);
    // Pictures are those of views.
    let pictures = body.matches("src=\"data:image/png;base64,").count();
    assert_eq!(body.matches("<img").count(), pictures);
    assert_eq!(body.matches("<script").count(), 0);
    assert!(
        body.contains(
            "&lt;img src=x onerror=alert(2)&gt;&quot;&#39;&amp;\u{2407}\u{241b}[2J\u{fffd}"
        )
    );
    body
}

/// Asserts that a drawing is well-formed XML without foreign elements.
fn drawing(path: &Path) {
    let text = text(path);
    is_visible(&text);
    let mut reader = quick_xml::Reader::from_str(&text);
    loop {
        match reader.read_event().unwrap() {
            quick_xml::events::Event::Eof => break,
            quick_xml::events::Event::Start(tag) | quick_xml::events::Event::Empty(tag) => {
                let name = String::from_utf8_lossy(tag.name().as_ref()).into_owned();
                assert!(!["script", "img"].contains(&name.as_str()), "{name}");
            }
            _ => {}
        }
    }
}

#[test]
fn an_audit_shows_names_of_files_and_tools_as_text() {
    let folder = tempfile::tempdir().unwrap();
    let at = |end: &str| folder.path().join(format!("{FILE}{end}")).to_str().unwrap().to_owned();
    let (cad, tool, html, map) = (at(".igs"), at(".tool.json"), at(".html"), at(".svg"));
    fs::copy(fixture("cross/die.igs"), &cad).unwrap();
    let (code, said, errors) = kanagata(&["convert", &cad, "-o", &tool, "--sheet-side=+z"]);
    assert_eq!(code, 0, "{errors}");
    is_visible(&said);
    let vtu = at(".vtu");
    let audit = ["audit", &tool, "--cad", &cad, "--html", &html, "--map", &map, "--vtu", &vtu];
    let (code, said, errors) = kanagata(&audit);
    assert!(code == 0 || code == 1, "{errors}");
    is_visible(&said);
    is_visible(&errors);
    page_of(Path::new(&html));
    drawing(Path::new(&map));
    let mut tools: serde_json::Value = serde_json::from_str(&text(Path::new(&tool))).unwrap();
    tools["name"] = NAME.into();
    fs::write(&tool, tools.to_string()).unwrap();
    let (_, said, errors) = kanagata(&audit);
    is_visible(&said);
    is_visible(&errors);
    assert!(page_of(Path::new(&html)).contains("Audit of =1+1&lt;script&gt;alert(1)"));
    drawing(Path::new(&map));
}

/// The bend with hostile names; `tools`: where its tools are.
fn hostile_scene(tools: &str) -> serde_json::Value {
    let mut scene = bend::scene(tools);
    scene["name"] = NAME.into();
    scene["stages"] =
        json!([{"name": NAME, "drive": {"plane": {"travel_mm": 0.2}}, "largest_increment": 0.5}]);
    let mut card: serde_json::Value =
        serde_json::from_str(&text(Path::new(&fixture("seeds/voce.card.json")))).unwrap();
    card["name"] = NAME.into();
    scene["material"] = card;
    scene
}

#[test]
fn a_report_and_a_history_show_names_of_the_scene_as_text() {
    let folder = tempfile::tempdir().unwrap();
    bend::write_tools(folder.path());
    let scene = folder.path().join("x.scene.json");
    fs::write(&scene, hostile_scene("").to_string()).unwrap();
    let mut command = assert_cmd::Command::cargo_bin("kanagata-solve").unwrap();
    let run = command.arg("run").arg(&scene).args(["--accept-doubts", "-o"]);
    let done = run.arg(folder.path().join("out")).output().unwrap();
    let errors = String::from_utf8(done.stderr).unwrap();
    assert_eq!(done.status.code(), Some(0), "{errors}");
    is_visible(&errors);
    is_visible(&String::from_utf8(done.stdout).unwrap());
    let out = folder.path().join("out");
    page_of(&out.join("report.html"));
    for name in ["history.csv", "iterations.csv"] {
        let table = text(&out.join(name));
        for row in csv::rows(&table) {
            let formula = |cell: &&str| cell.trim_start_matches('"').starts_with('=');
            assert!(!row.split(',').any(|cell| formula(&cell)), "{name}: {row}");
        }
    }
    let history = text(&out.join("history.csv"));
    assert_eq!(csv::cells(csv::rows(&history)[1])[1], NAME);
}

#[test]
fn a_study_shows_names_and_words_of_its_file_as_text() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("a")).unwrap();
    bend::write_tools(&folder.path().join("a"));
    let check = json!({"says": NAME, "figure": "force_error", "at_most": 0.0, "explained": NAME});
    let study = json!({
        "format": "kanagata-study", "version": 1, "name": NAME, "watch": "plane",
        "scene": hostile_scene("{tools}"), "checks": [check],
        "choices": [{"name": "tools", "options": [{"name": "a"}]}],
    });
    // Braces stand for choices there.
    let study = study.to_string().replace("%{x}", "");
    let (file, out) = (folder.path().join("study.json"), folder.path().join("out"));
    fs::write(&file, study).unwrap();
    let arguments =
        ["study", file.to_str().unwrap(), "-o", out.to_str().unwrap(), "--accept-doubts"];
    let (code, said, errors) = kanagata(&arguments);
    assert!(code == 0 || code == 1, "{errors}");
    is_visible(&said);
    is_visible(&errors);
    page_of(&out.join("study.html"));
    for entry in fs::read_dir(&out).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "svg") {
            drawing(&path);
        }
    }
}

#[test]
fn the_page_of_a_material_shows_its_name_as_text() {
    let folder = tempfile::tempdir().unwrap();
    let card = hostile_scene("")["material"].clone();
    let (file, page) = (folder.path().join("x.json"), folder.path().join("x.html"));
    fs::write(&file, card.to_string()).unwrap();
    let arguments = ["material", "show", file.to_str().unwrap(), "--html", page.to_str().unwrap()];
    let (code, said, errors) = kanagata(&arguments);
    assert_eq!(code, 0, "{errors}");
    is_visible(&said);
    page_of(&page);
}
