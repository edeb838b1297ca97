//! The set-up of the run in `report.html`: sheet, material, tools, stages, program and inputs.

use serde_json::Value;

use kanagata_report::page::Page;
use kanagata_report::record::RunRecord;
use kanagata_scene::Plan;

/// Writes the set-up; without the scene only what `run.json` has.
pub(super) fn tables(page: &mut Page, record: &RunRecord, plan: Option<&Plan>) {
    page.heading("Set-up");
    if let Some(plan) = plan {
        sheet(page, plan);
        tools(page, plan);
        stages(page, plan);
    }
    let mut rows = vec![
        row("program", &record.program),
        row("build", &record.build),
        row("processor class, threads", &format!("{}, {}", record.cpu, record.threads)),
    ];
    rows.extend(record.set.iter().map(|set| row("set from outside", set)));
    page.table(&["", ""], &rows);
    let inputs: Vec<Vec<String>> =
        record.inputs.iter().map(|(name, sha256)| vec![name.clone(), sha256.clone()]).collect();
    if !inputs.is_empty() {
        page.folded("Digests of the inputs", |page| page.table(&["file", "SHA-256"], &inputs));
    }
}

fn row(name: &str, value: &str) -> Vec<String> {
    vec![name.to_owned(), value.to_owned()]
}

fn sheet(page: &mut Page, plan: &Plan) {
    let (blank, card) = (&plan.scene.blank, &plan.card);
    let mut rows = vec![
        row("material", &card.name),
        row("source of the card", &card.source),
        row("thickness, layers", &format!("{} mm, {}", blank.thickness_mm, blank.layers)),
        row("shape", &words(&serde_json::to_value(&blank.shape).unwrap_or_default())),
        row("element", &words(&serde_json::to_value(blank.element).unwrap_or_default())),
    ];
    let planes = plan
        .scene
        .symmetry
        .iter()
        .map(|plane| format!("{} = {} mm", ["x", "y", "z"][plane.normal.index()], plane.at_mm));
    let planes: Vec<String> = planes.collect();
    if !planes.is_empty() {
        rows.push(row("symmetry planes", &planes.join(", ")));
    }
    page.table(&["sheet", ""], &rows);
}

fn tools(page: &mut Page, plan: &Plan) {
    let all = plan.scene.tools.iter().zip(&plan.tools);
    let rows: Vec<Vec<String>> = all
        .map(|(tool, planned)| {
            let error = planned.shape_error_mm.map_or("-".into(), |e| format!("{e:.4}"));
            let patches = planned.surface.model().patches.len();
            vec![
                tool.name.clone(),
                tool.file.clone(),
                patches.to_string(),
                error,
                tool.friction.unwrap_or(0.0).to_string(),
                tool.direction.map(|x| x.to_string()).join(", "),
            ]
        })
        .collect();
    let head = ["tool", "file", "patches", "shape error [mm]", "friction", "direction"];
    page.table(&head, &rows);
}

fn stages(page: &mut Page, plan: &Plan) {
    let rows: Vec<Vec<String>> = plan
        .scene
        .stages
        .iter()
        .map(|stage| {
            let drive = stage.drive.iter().map(|(tool, drive)| {
                format!("{tool}: {}", words(&serde_json::to_value(drive).unwrap_or_default()))
            });
            vec![stage.name.clone(), drive.collect::<Vec<_>>().join("; ")]
        })
        .collect();
    page.table(&["stage", "drives"], &rows);
}

/// A value in words: keys and values without brackets and quotes.
fn words(value: &Value) -> String {
    match value {
        Value::Object(all) => {
            let one = |(key, value): (&String, &Value)| match value {
                Value::Bool(true) => key.clone(),
                other => format!("{key} {}", words(other)),
            };
            all.iter().filter(|(_, v)| !v.is_null()).map(one).collect::<Vec<_>>().join(", ")
        }
        Value::Array(all) => all.iter().map(words).collect::<Vec<_>>().join(" "),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn values_are_read_without_brackets() {
        let drive = json!({"travel_mm": {"curve": [[0, 0], [1, 5.5]]}, "release": true, "a": null});
        assert_eq!(words(&drive), "release, travel_mm curve 0 0 1 5.5");
        assert_eq!(words(&json!("hex8")), "hex8");
    }
}
