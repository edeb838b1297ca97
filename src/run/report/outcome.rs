//! The head of `report.html`: the outcome in a sentence, and what an engineer asks first about the part.

use super::border::{Drawn, side_name};
use super::clamping::waves;
use super::section;
use crate::draw_in::{Border, SidePoint};
use kanagata_report::page::{Outcome, Page};
use kanagata_report::record::{FormabilityRecord, History, RunRecord, Verdict};

/// A question and its answer.
type Row = (String, String);

/// Draw-in that is printed [mm]: half of the last digit.
const DRAW_IN_MIN: f64 = 0.005;

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
pub(super) fn answers(page: &mut Page, record: &RunRecord, history: &History, drawn: &Drawn) {
    let mut rows: Vec<Row> = Vec::new();
    rows.extend(record.thickness.map(|t| ("minimum thickness".to_owned(), t.to_string())));
    if let Some(formed) = &record.formability {
        rows.extend(formability(formed));
    }
    rows.extend(record.strain.map(|s| ("largest strains".to_owned(), s.to_string())));
    let tools = history.tools.iter().enumerate();
    rows.extend(tools.filter_map(|(k, tool)| {
        Some((format!("largest force of {tool}"), largest_force(history, k)?))
    }));
    let border = border(drawn, record.springback.is_some());
    rows.extend(border.map(|text| ("draw-in of the outer border".to_owned(), text)));
    rows.extend(springback(record));
    rows.extend(section::answers(&record.sections));
    rows.extend(record.holder_pressure.iter().map(|holder| {
        let text = format!(
            "{:.2} MPa in the mean of the {:.0} mm2 in contact in increment {}, the last one pressed; up to {:.2} MPa at a node then, {:.2} MPa in increment {}",
            holder.mean_mpa,
            holder.area_mm2,
            holder.increment,
            holder.max_mpa,
            holder.peak.max_mpa,
            holder.peak.increment
        );
        (format!("pressure under {}", holder.tool), text)
    }));
    rows.extend(record.waves.as_ref().map(|w| ("waves between tools".to_owned(), waves(w))));
    rows.extend(record.first_buckle.map(|first| {
        let text = format!("{} times, first in increment {first}", record.buckles);
        ("buckles or wrinkles".to_owned(), text)
    }));
    let rows: Vec<Vec<String>> = rows.into_iter().map(|(name, value)| vec![name, value]).collect();
    page.table(&["", ""], &rows);
}

/// Springback, if the tools were released.
fn springback(record: &RunRecord) -> Option<Row> {
    let found = record.springback?;
    let mut text = format!("up to {:.3} mm, RMS {:.3} mm", found.largest_mm, found.rms_mm);
    if let Some((least, most)) = found.normal_min.zip(found.normal_max) {
        text += &format!("; along the normal {least} to {most}");
    }
    Some(("springback".to_owned(), text))
}

/// Rows about thinning, margin, zones and strain paths.
fn formability(formed: &FormabilityRecord) -> Vec<Row> {
    let row = |name: &str, value: String| (name.to_owned(), value);
    let mut rows = vec![row("largest thinning of an element", formed.thinning.to_string())];
    if formed.thickening.percent < 0.0 {
        let thicker = formed.thickening.to_string();
        let thicker = thicker.trim_start_matches('-').to_owned();
        rows.push(row("largest thickening of an element", thicker));
    }
    let margin = formed.margin.map_or_else(
        || "not judged: the material card has no forming limit".into(),
        |margin| margin.to_string(),
    );
    rows.push(row("smallest margin to the forming limit", margin));
    rows.push(row("area by zone", formed.zones.to_string()));
    let turned = formed.turned_paths;
    if turned.elements > 0 {
        let text = format!(
            "by more than {:.0} degrees in {:.1} % of the area: a limit curve holds for straight paths, and the verdict is weaker there",
            turned.angle_deg,
            100.0 * turned.share
        );
        rows.push(row("strain paths that turn", text));
    }
    rows
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

/// Draw-in of the outer border with tools, and after their release.
fn border(drawn: &Drawn, released: bool) -> Option<String> {
    let outer = |borders: &[Border]| borders.first().and_then(draw_in);
    let text = outer(&drawn.borders)?;
    Some(match drawn.released.as_deref().and_then(outer) {
        Some(after) => format!("with tools {text}; released {after}"),
        None if released => format!("released {text}; not known with tools"),
        None => text,
    })
}

/// Smallest and largest draw-in of a border along the normals of its sides, with their places on the blank.
fn draw_in(border: &Border) -> Option<String> {
    let [least, most] = border.extremes()?;
    if most.1.draw_in.max(-least.1.draw_in) < DRAW_IN_MIN {
        return Some("none".into());
    }
    let of = |(side, p): (usize, SidePoint)| {
        let (at, side) = (p.point.initial, side_name(0, side));
        format!("{:.2} mm at ({:.1}, {:.1}) mm of the blank ({side})", p.draw_in, at.x, at.y)
    };
    Some(format!("{} to {}", of(least), of(most)))
}
