//! The head of `report.html`: the outcome in a sentence, and what an engineer asks first about the part.

use crate::report::page::{Outcome, Page};
use crate::report::record::{History, RunRecord, Verdict};
use crate::run::draw_in::Border;

/// Newtons of a metric ton-force.
const TON_FORCE_N: f64 = 9806.65;

/// Writes the outcome.
pub(super) fn sentence(page: &mut Page, record: &RunRecord) {
    let doubts = record.doubts.len();
    let (outcome, text) = match record.verdict {
        Verdict::Completed => {
            (Outcome::Good, "Completed: all stages are done, and there is no doubt.".into())
        }
        Verdict::Doubtful => {
            let doubts = if doubts == 1 { "1 doubt".into() } else { format!("{doubts} doubts") };
            (Outcome::Doubtful, format!("Doubtful: all stages are done, with {doubts}."))
        }
        Verdict::NotConverged => (
            Outcome::Failed,
            format!(
                "Not converged after {} increments: the state below is the last converged one.",
                record.increments
            ),
        ),
        Verdict::Stopped => (
            Outcome::Doubtful,
            format!("Stopped after {} increments: the run can be continued.", record.increments),
        ),
        Verdict::Running => (
            Outcome::Doubtful,
            format!("Ended without a verdict after {} increments.", record.increments),
        ),
    };
    page.outcome(outcome, &text);
    if let Some(message) = &record.message {
        page.text(message);
    }
}

/// Writes the table of answers: thickness, formability, forces, draw-in, springback, stability.
pub(super) fn answers(page: &mut Page, record: &RunRecord, history: &History, borders: &[Border]) {
    let mut rows: Vec<[String; 2]> = Vec::new();
    let mut add = |name: &str, value: String| rows.push([name.to_owned(), value]);
    if let Some(thickness) = record.thickness {
        add("minimum thickness", thickness.to_string());
    }
    if let Some(formed) = &record.formability {
        add("largest thinning of an element", formed.thinning.to_string());
        if formed.thickening.percent < 0.0 {
            let place = formed.thickening.to_string();
            add("largest thickening of an element", place.trim_start_matches('-').to_owned());
        }
        match formed.margin {
            Some(margin) => add("smallest margin to the forming limit", margin.to_string()),
            None => add(
                "margin to the forming limit",
                "not judged: the material card has no forming limit".into(),
            ),
        }
        add("area by zone", formed.zones.to_string());
        if formed.turned_paths.elements > 0 {
            let turned = formed.turned_paths;
            add(
                "strain paths that turn",
                format!(
                    "by more than {:.0} degrees in {:.1} % of the area: a limit curve holds for straight paths, and the verdict is weaker there",
                    turned.angle_deg,
                    100.0 * turned.share
                ),
            );
        }
    }
    if let Some(strain) = record.strain {
        add("largest strains", strain.to_string());
    }
    for (k, tool) in history.tools.iter().enumerate() {
        if let Some(force) = largest_force(history, k) {
            add(&format!("largest force of {tool}"), force);
        }
    }
    if let Some(text) = borders.first().and_then(|border| draw_in(border)) {
        add("draw-in of the outer border", text);
    }
    if let Some(springback) = record.springback {
        add(
            "springback",
            format!(
                "up to {:.3} mm, RMS {:.3} mm; released elastic energy {:.0} N mm",
                springback.largest_mm, springback.rms_mm, springback.energy_nmm
            ),
        );
    }
    if let Some(first) = record.first_buckle {
        add("buckles or wrinkles", format!("{} times, first in increment {first}", record.buckles));
    }
    let rows: Vec<Vec<String>> = rows.into_iter().map(Vec::from).collect();
    page.table(&["", ""], &rows);
}

/// The largest force of a tool with its increment and travel.
fn largest_force(history: &History, tool: usize) -> Option<String> {
    let force = |row: usize| history.rows[row].force_n[tool].abs();
    let row = (0..history.rows.len()).reduce(|a, b| if force(b) > force(a) { b } else { a })?;
    let (force, at) = (force(row), &history.rows[row]);
    let unit = if force < 1000.0 {
        format!("{force:.1} N")
    } else {
        format!("{:.2} kN ({:.2} t)", force / 1000.0, force / TON_FORCE_N)
    };
    (force > 0.0).then(|| {
        format!(
            "{unit} at a travel of {:.2} mm, increment {}, {}",
            at.travel_mm[tool], at.increment, at.stage
        )
    })
}

/// Largest and smallest draw-in of a border with their places on the blank.
fn draw_in(border: &Border) -> Option<String> {
    let most = border.iter().copied().reduce(|a, b| if b.draw_in > a.draw_in { b } else { a })?;
    let least = border.iter().copied().reduce(|a, b| if b.draw_in < a.draw_in { b } else { a })?;
    let of = |p: crate::run::draw_in::BorderPoint| {
        format!("{:.2} mm at ({:.1}, {:.1}) mm of the blank", p.draw_in, p.initial.x, p.initial.y)
    };
    Some(format!("{} to {}", of(least), of(most)))
}
