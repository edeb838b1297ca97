//! Text report of model defects.

use super::{COMPARISONS_MAX, Health};
use crate::Model;

/// Maximum number of entries listed individually.
const LISTED_MAX: usize = 10;

impl Health {
    /// The verdict in one line, with the number of defects of each kind.
    #[must_use]
    pub fn verdict(&self) -> String {
        let open: Vec<f64> = self.free_edges.iter().filter_map(|e| e.open_joint_mm).collect();
        let widest = open.iter().copied().fold(0.0, f64::max);
        let joints = match open.len() {
            0 => String::new(),
            count => format!("; {count} beside other faces, up to {widest:.2e} mm away"),
        };
        let free = format!("free edges ({:.4} mm{joints})", self.free_edge_length_mm);
        let inverted = self.parts.iter().filter(|p| p.inverted).count();
        let defects = [
            (self.lost_faces.len(), "lost faces"),
            (self.free_edges.len(), free.as_str()),
            (self.crowded_edges.len(), "edges used more than twice"),
            (self.disagreeing_faces.len(), "faces that disagree with a neighbour"),
            (self.tiny_faces.len(), "tiny faces"),
            (self.duplicate_faces.len(), "duplicate faces"),
            (self.impossible_faces.len(), "faces of impossible area"),
            (self.unmeasured_faces.len(), "faces of unknown area"),
            (inverted, "inverted parts"),
        ];
        let found = defects.iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!("{n} {what}"));
        let mut found: Vec<String> = found.collect();
        if !self.duplicates_searched {
            found.push("too many faces of one area to find duplicates".into());
        }
        if self.is_sound() { "sound".into() } else { format!("not sound: {}", found.join(", ")) }
    }

    /// Text report with the names of the faces in the file.
    #[must_use]
    pub fn to_text(&self, model: &Model) -> String {
        let mut lines = self.summary_lines();
        lines.extend(self.lost_face_lines());
        lines.extend(self.free_edge_lines(model));
        lines.extend(self.orientation_lines(model));
        lines.extend(self.area_lines(model));
        lines.extend(self.duplicate_lines(model));
        lines.join("\n")
    }

    /// Lists the verdict, the joining gaps [mm] and the numbers of parts and free edges.
    fn summary_lines(&self) -> Vec<String> {
        vec![
            format!("health: {}", if self.is_sound() { "sound" } else { "not sound" }),
            format!(
                "  joined      within {:.1e} mm; sides up to {:.2e} mm from their edge",
                self.join_tolerance_mm, self.largest_gap_mm
            ),
            format!(
                "  parts       {}, {} of them closed",
                self.parts.len(),
                self.parts.iter().filter(|p| p.closed).count()
            ),
            format!(
                "  free edges  {}, {:.4} mm long; {} used more than twice",
                self.free_edges.len(),
                self.free_edge_length_mm,
                self.crowded_edges.len()
            ),
        ]
    }

    /// Lists the faces that could not be built, with the reasons.
    fn lost_face_lines(&self) -> Vec<String> {
        let listed = self.lost_faces.iter().take(LISTED_MAX);
        let mut lines: Vec<String> =
            listed.map(|lost| format!("  lost        {}: {}", lost.source, lost.reason)).collect();
        if self.lost_faces.len() > LISTED_MAX {
            lines.push(format!("  lost        and {} more", self.lost_faces.len() - LISTED_MAX));
        }
        lines
    }

    /// Lists the free edges with their lengths and gaps [mm].
    fn free_edge_lines(&self, model: &Model) -> Vec<String> {
        let mut lines = Vec::new();
        for e in self.free_edges.iter().take(LISTED_MAX) {
            let none = if e.gap_measured { "no edge near it" } else { "gap not measured" };
            let gap = e.gap_mm.map_or(none.into(), |g| format!("gap {g:.2e} mm"));
            lines.push(format!("    {:.4} mm of {}: {gap}", e.length_mm, name(model, e.face)));
        }
        let unmeasured = self.free_edges.iter().filter(|e| !e.gap_measured).count();
        if unmeasured > 0 {
            lines.push(format!(
                "  not done    gaps of {unmeasured} free edges: too many other free edges nearby"
            ));
        }
        lines
    }

    /// Lists inverted parts, faces with inconsistent orientation and tiny faces.
    fn orientation_lines(&self, model: &Model) -> Vec<String> {
        let mut lines = Vec::new();
        for part in self.parts.iter().filter(|p| p.inverted) {
            lines.push(format!("  inverted    {}", names(model, &part.faces)));
        }
        let lists = [("disagreeing", &self.disagreeing_faces), ("tiny", &self.tiny_faces)];
        for (what, faces) in lists.iter().filter(|l| !l.1.is_empty()) {
            lines.push(format!("  {what:<11} {}", names(model, faces)));
        }
        lines
    }

    /// Lists faces with an impossible or unconverged area.
    fn area_lines(&self, model: &Model) -> Vec<String> {
        let mut lines = Vec::new();
        if !self.impossible_faces.is_empty() {
            lines.push(format!(
                "  area        0 or negative, or larger than possible for their size: {}; check their boundary loops",
                names(model, &self.impossible_faces)
            ));
        }
        if !self.unmeasured_faces.is_empty() {
            lines.push(format!(
                "  not done    area of {}: not converged in {} evaluations per control point",
                names(model, &self.unmeasured_faces),
                crate::area::EVALUATIONS_PER_POINT
            ));
        }
        lines
    }

    /// Lists pairs of coincident faces, or that the search was incomplete.
    fn duplicate_lines(&self, model: &Model) -> Vec<String> {
        let mut lines = Vec::new();
        if !self.duplicates_searched {
            lines.push(format!(
                "  not done    search for coincident faces: more than {COMPARISONS_MAX} have about the same area"
            ));
        }
        for [a, b] in self.duplicate_faces.iter().take(LISTED_MAX) {
            lines.push(format!("  duplicate   {} and {}", name(model, *a), name(model, *b)));
        }
        lines
    }
}

/// Name of a face in the file.
fn name(model: &Model, f: usize) -> &str {
    model.faces.get(f).map_or("?", |face| face.source.as_str())
}

/// Names of faces, at most [`LISTED_MAX`] of them.
fn names(model: &Model, faces: &[usize]) -> String {
    let mut all: Vec<String> =
        faces.iter().take(LISTED_MAX).map(|&f| name(model, f).into()).collect();
    if faces.len() > LISTED_MAX {
        all.push(format!("and {} more", faces.len() - LISTED_MAX));
    }
    all.join(", ")
}
