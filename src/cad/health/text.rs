//! The faults of a model, for people.

use super::{COMPARISONS, Health};
use crate::cad::Model;

/// Entries of a list that are told one by one.
const TOLD: usize = 10;

impl Health {
    /// The same for people, with the faces' names in the file.
    #[must_use]
    pub fn told_of(&self, model: &Model) -> String {
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
                "  joined      within {:.1e} mm; sides up to {:.2e} mm off their edge",
                self.join_tolerance_mm, self.largest_gap_mm
            ),
            format!(
                "  parts       {}, {} of them closed",
                self.parts.len(),
                self.parts.iter().filter(|p| p.closed).count()
            ),
            format!(
                "  free edges  {}, {:.4} mm long; {} more than twice used",
                self.free_edges.len(),
                self.free_edge_length_mm,
                self.crowded_edges.len()
            ),
        ]
    }

    /// Lists the faces that could not be built, with the reasons.
    fn lost_face_lines(&self) -> Vec<String> {
        let told = self.lost_faces.iter().take(TOLD);
        let mut lines: Vec<String> =
            told.map(|lost| format!("  lost        {}: {}", lost.source, lost.reason)).collect();
        if self.lost_faces.len() > TOLD {
            lines.push(format!("  lost        and {} more", self.lost_faces.len() - TOLD));
        }
        lines
    }

    /// Lists the free edges with their lengths and gaps [mm].
    fn free_edge_lines(&self, model: &Model) -> Vec<String> {
        let mut lines = Vec::new();
        for e in self.free_edges.iter().take(TOLD) {
            let none = if e.gap_measured { "no edge near it" } else { "gap not measured" };
            let gap = e.gap_mm.map_or(none.into(), |g| format!("gap {g:.2e} mm"));
            lines.push(format!("    {:.4} mm of {}: {gap}", e.length_mm, name(model, e.face)));
        }
        let unmeasured = self.free_edges.iter().filter(|e| !e.gap_measured).count();
        if unmeasured > 0 {
            lines.push(format!(
                "  not done    gaps of {unmeasured} free edges: too many other edges lie near them"
            ));
        }
        lines
    }

    /// Lists inverted parts, and faces that disagree with their neighbours or are tiny.
    fn orientation_lines(&self, model: &Model) -> Vec<String> {
        let mut lines = Vec::new();
        for part in self.parts.iter().filter(|p| p.inverted) {
            lines.push(format!("  inside out  {}", names(model, &part.faces)));
        }
        let lists = [("disagreeing", &self.disagreeing_faces), ("tiny", &self.tiny_faces)];
        for (what, faces) in lists.iter().filter(|l| !l.1.is_empty()) {
            lines.push(format!("  {what:<11} {}", names(model, faces)));
        }
        lines
    }

    /// Lists faces whose area is impossible or could not be computed.
    fn area_lines(&self, model: &Model) -> Vec<String> {
        let mut lines = Vec::new();
        if !self.impossible_faces.is_empty() {
            lines.push(format!(
                "  area        0 or negative, or more than a surface of their size may have: {}; their borders were not understood",
                names(model, &self.impossible_faces)
            ));
        }
        if !self.unmeasured_faces.is_empty() {
            lines.push(format!(
                "  not done    area of {}: it does not settle in {} evaluations a control point",
                names(model, &self.unmeasured_faces),
                crate::cad::area::EVALUATIONS_A_POINT
            ));
        }
        lines
    }

    /// Lists pairs of faces that lie on each other, or that these were not searched.
    fn duplicate_lines(&self, model: &Model) -> Vec<String> {
        let mut lines = Vec::new();
        if !self.duplicates_searched {
            lines.push(format!(
                "  not done    search for faces that lie on each other: more than {COMPARISONS} have about the same area"
            ));
        }
        for [a, b] in self.duplicate_faces.iter().take(TOLD) {
            lines.push(format!("  twice there {} and {}", name(model, *a), name(model, *b)));
        }
        lines
    }
}

/// Looks up the name of a face in the file.
fn name(model: &Model, f: usize) -> &str {
    model.faces.get(f).map_or("?", |face| face.source.as_str())
}

/// Lists the names of faces, at most [`TOLD`] of them.
fn names(model: &Model, faces: &[usize]) -> String {
    let mut all: Vec<String> = faces.iter().take(TOLD).map(|&f| name(model, f).into()).collect();
    if faces.len() > TOLD {
        all.push(format!("and {} more", faces.len() - TOLD));
    }
    all.join(", ")
}
