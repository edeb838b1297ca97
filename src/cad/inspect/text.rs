//! Texts of a summary and of a tree.

use std::collections::BTreeMap;

use super::{BodyRow, FaceRow, GroupRow, Inspection, Tree};
use crate::attributes::{BASIC_COLOURS, BodyKind, colour_text};
use crate::{Diagnostic, Severity};

/// Lines of a summary in all.
const SUMMARY_LINES_MAX: usize = 20;
/// Names and lost faces listed in a summary.
const SUMMARY_ITEMS_MAX: usize = 4;
/// Bodies, layers, colours and faces listed in a tree, each.
const ROWS_MAX: usize = 500;
/// Characters of an example, of a name, and of a list of face numbers.
const EXAMPLE_LENGTH_MAX: usize = 160;
const NAME_LENGTH_MAX: usize = 48;
const NUMBERS_LENGTH_MAX: usize = 60;

impl Inspection {
    /// What a reader asks first, in at most 20 lines; `verdict` is that of the examination of the model.
    #[must_use]
    pub fn to_text(&self, verdict: &str) -> String {
        let b = &self.bbox_mm;
        let kinds = self.faces_by_type.iter().map(|(k, n)| format!("{n} {k:?}").to_lowercase());
        let kinds = kinds.collect::<Vec<_>>().join(", ");
        let kinds = if kinds.is_empty() { kinds } else { format!(": {kinds}") };
        let [x, y, z] = self.size_mm;
        let mut lines = vec![
            self.file.clone(),
            format!("  unit        {} ({} mm)", self.unit, self.unit_mm),
            format!("  bodies      {}{}", self.bodies, self.bodies_text()),
            format!("  faces       {}{kinds}", self.faces),
        ];
        if self.layers + self.colours > 0 {
            lines.push(format!("  marks       {} layers, {} colours", self.layers, self.colours));
        }
        lines.push(format!("  size        {x:.4} x {y:.4} x {z:.4} mm"));
        lines.push(format!(
            "  box         {:.4} {:.4} {:.4} to {:.4} {:.4} {:.4} mm",
            b[0], b[1], b[2], b[3], b[4], b[5]
        ));
        lines.push(format!("  area        {:.6} mm2", self.area_mm2));
        lines.push(format!(
            "  edges       {}, {} of them free, {:.4} mm long (joined within {:.1e} mm)",
            self.edges, self.free_edges, self.free_edge_length_mm, self.join_tolerance_mm
        ));
        let verdict = if self.faces == 0 { "no faces to examine" } else { verdict };
        lines.push(format!("  health      {verdict}"));
        lines.extend(self.skipped_line());
        let room = SUMMARY_LINES_MAX - lines.len();
        lines.extend(self.notes(room));
        lines.join("\n")
    }

    fn bodies_text(&self) -> String {
        let plural = |n: usize, word: &str| if n == 1 { word.into() } else { format!("{word}s") };
        let kind = |(kind, n): (&BodyKind, &usize)| match kind {
            BodyKind::Solid => format!("{n} {}", plural(*n, "solid")),
            BodyKind::Shell => format!("{n} {}", plural(*n, "shell")),
            BodyKind::Faces => format!("{n} of loose faces"),
        };
        let kinds: Vec<String> = self.bodies_by_kind.iter().map(kind).collect();
        let shown = |name: &String| shortened(name, NAME_LENGTH_MAX);
        let mut names: Vec<String> =
            self.body_names.iter().take(SUMMARY_ITEMS_MAX).map(shown).collect();
        if self.body_names.len() > SUMMARY_ITEMS_MAX {
            names.push("...".into());
        }
        let names =
            if names.is_empty() { String::new() } else { format!(" ({})", names.join(", ")) };
        if kinds.is_empty() { String::new() } else { format!(": {}{names}", kinds.join(", ")) }
    }

    /// The faces that the model lacks, and why.
    fn skipped_line(&self) -> Option<String> {
        let first = self.lost_faces.first()?;
        let example = shortened(&format!("{}: {}", first.source, first.reason), EXAMPLE_LENGTH_MAX);
        Some(format!("  skipped     {} faces, the first {example}", self.lost_faces.len()))
    }

    /// Diagnostics by code, warnings first, each with its number and an example, in at most `room` lines.
    fn notes(&self, room: usize) -> Vec<String> {
        let mut by_code: BTreeMap<(std::cmp::Reverse<Severity>, &str), Vec<&Diagnostic>> =
            BTreeMap::new();
        let is_lost = |d: &&Diagnostic| self.lost_faces.iter().any(|f| f.source == d.place);
        for d in self.diagnostics.iter().filter(|d| !is_lost(d)) {
            by_code.entry((std::cmp::Reverse(d.severity), d.code)).or_default().push(d);
        }
        let line =
            |((severity, code), all): (&(std::cmp::Reverse<Severity>, &str), &Vec<&Diagnostic>)| {
                let mark = if severity.0 == Severity::Warning { "warning" } else { "note" };
                let times =
                    if all.len() > 1 { format!(" ({} times)", all.len()) } else { String::new() };
                let place = if all[0].place.is_empty() {
                    String::new()
                } else {
                    format!(" {}", all[0].place)
                };
                let example = shortened(&format!("{place}: {}", all[0].text), EXAMPLE_LENGTH_MAX);
                format!("  {mark:<11} {code}{times}{example}")
            };
        let mut lines: Vec<String> = by_code.iter().map(line).collect();
        if lines.len() > room {
            let more = lines.len() + 1 - room;
            lines.truncate(room.saturating_sub(1));
            lines.push(format!("  and {more} more kinds of warnings and notes"));
        }
        lines
    }

    /// Entities with their counts, in lines of about a hundred columns.
    #[must_use]
    pub fn entities_text(&self) -> String {
        format!("  entities    {}", entity_lines(&self.entities).join("\n              "))
    }
}

/// Entities with their counts, in lines of about a hundred columns.
pub(super) fn entity_lines(entities: &BTreeMap<String, usize>) -> Vec<String> {
    const COLUMNS: usize = 100;
    let mut lines = vec![String::new()];
    for (kind, count) in entities {
        let item = format!("{count} x {kind}");
        match lines.last_mut() {
            Some(line) if line.is_empty() => *line = item,
            Some(line) if line.len() + item.len() < COLUMNS => *line += &format!(", {item}"),
            _ => lines.push(item),
        }
    }
    lines
}

/// The first characters of a text, without line breaks.
fn shortened(text: &str, length: usize) -> String {
    let flat: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    if flat.chars().count() <= length {
        return flat;
    }
    flat.chars().take(length.saturating_sub(3)).collect::<String>() + "..."
}

impl Tree {
    /// Bodies, layers and colours, a line each.
    #[must_use]
    pub fn to_text(&self) -> String {
        let mut lines = Vec::new();
        listed("bodies", &self.bodies, body_line, &mut lines);
        listed("layers", &self.layers, group_line, &mut lines);
        listed("colours", &self.colours, colour_line, &mut lines);
        lines.join("\n")
    }

    /// Faces, a line each.
    #[must_use]
    pub fn faces_text(&self) -> String {
        let mut lines = Vec::new();
        listed("faces", &self.faces, face_line, &mut lines);
        lines.join("\n")
    }
}

fn listed<T>(what: &str, rows: &[T], line: impl Fn(&T) -> String, lines: &mut Vec<String>) {
    if rows.is_empty() {
        return;
    }
    lines.push(format!("  {what}"));
    lines.extend(rows.iter().take(ROWS_MAX).map(|row| format!("    {}", line(row))));
    if rows.len() > ROWS_MAX {
        lines.push(format!("    and {} more", rows.len() - ROWS_MAX));
    }
}

fn body_line(row: &BodyRow) -> String {
    let path = if row.path.is_empty() { "-".into() } else { row.path.join("/") };
    let [a, b, c, d, e, f] = row.bbox_mm;
    let colour = row.colour.as_ref().map_or_else(String::new, |c| format!(", {c}"));
    format!(
        "{:>3}  {}: {} {}, {} faces {}, {:.3} mm2, box {a:.3} {b:.3} {c:.3} to {d:.3} {e:.3} {f:.3} mm{colour}",
        row.number,
        shortened(&path, 2 * NAME_LENGTH_MAX),
        if row.closed { "closed" } else { "open" },
        format!("{:?}", row.kind).to_lowercase(),
        row.faces,
        shortened(&row.face_numbers, NUMBERS_LENGTH_MAX),
        row.area_mm2
    )
}

fn group_line(row: &GroupRow) -> String {
    let numbers = shortened(&row.face_numbers, NUMBERS_LENGTH_MAX);
    format!("{}: {} faces {numbers}", shortened(&row.name, NAME_LENGTH_MAX), row.faces)
}

fn colour_line(row: &GroupRow) -> String {
    let basic = BASIC_COLOURS.iter().find(|c| colour_text(c.1) == row.name);
    let name = basic.map_or_else(|| row.name.clone(), |c| format!("{} {}", row.name, c.0));
    group_line(&GroupRow { name, ..row.clone() })
}

fn face_line(row: &FaceRow) -> String {
    let name = row
        .name
        .as_ref()
        .map_or_else(String::new, |n| format!(" '{}'", shortened(n, NAME_LENGTH_MAX)));
    let layers = if row.layers.is_empty() {
        String::new()
    } else {
        format!(", layer {}", shortened(&row.layers.join(", "), NAME_LENGTH_MAX))
    };
    let colour = row.colour.as_ref().map_or_else(String::new, |c| format!(", {c}"));
    let kind = format!("{:?}", row.kind).to_lowercase();
    format!(
        "{:>4}  {}{name}: {kind}, body {}, {:.3} mm2{layers}{colour}",
        row.number, row.entity, row.body, row.area_mm2
    )
}
