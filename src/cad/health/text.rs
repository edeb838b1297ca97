//! The faults of a model, for people.

use super::{COMPARISONS, Health};
use crate::cad::Model;

/// Entries of a list that are told one by one.
const TOLD: usize = 10;

impl Health {
    /// The same for people, with the faces' names in the file.
    #[must_use]
    pub fn told_of(&self, model: &Model) -> String {
        let name = |f: usize| model.faces.get(f).map_or("?", |face| face.source.as_str());
        let names = |faces: &[usize]| {
            let mut all: Vec<String> = faces.iter().take(TOLD).map(|&f| name(f).into()).collect();
            if faces.len() > TOLD {
                all.push(format!("and {} more", faces.len() - TOLD));
            }
            all.join(", ")
        };
        let mut lines = vec![
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
        ];
        for lost in self.lost_faces.iter().take(TOLD) {
            lines.push(format!("  lost        {}: {}", lost.source, lost.reason));
        }
        if self.lost_faces.len() > TOLD {
            lines.push(format!("  lost        and {} more", self.lost_faces.len() - TOLD));
        }
        for e in self.free_edges.iter().take(TOLD) {
            let none = if e.gap_measured { "no edge near it" } else { "gap not measured" };
            let gap = e.gap_mm.map_or(none.into(), |g| format!("gap {g:.2e} mm"));
            lines.push(format!("    {:.4} mm of {}: {gap}", e.length_mm, name(e.face)));
        }
        let unmeasured = self.free_edges.iter().filter(|e| !e.gap_measured).count();
        if unmeasured > 0 {
            lines.push(format!(
                "  not done    gaps of {unmeasured} free edges: too many other edges lie near them"
            ));
        }
        for part in self.parts.iter().filter(|p| p.inverted) {
            lines.push(format!("  inside out  {}", names(&part.faces)));
        }
        let lists = [("disagreeing", &self.disagreeing_faces), ("tiny", &self.tiny_faces)];
        for (what, faces) in lists.iter().filter(|l| !l.1.is_empty()) {
            lines.push(format!("  {what:<11} {}", names(faces)));
        }
        if !self.impossible_faces.is_empty() {
            lines.push(format!(
                "  area        0 or negative, or more than a surface of their size may have: {}; their borders were not understood",
                names(&self.impossible_faces)
            ));
        }
        if !self.unmeasured_faces.is_empty() {
            lines.push(format!(
                "  not done    area of {}: it does not settle in {} evaluations a control point",
                names(&self.unmeasured_faces),
                crate::cad::area::EVALUATIONS_A_POINT
            ));
        }
        if !self.duplicates_searched {
            lines.push(format!(
                "  not done    search for faces that lie on each other: more than {COMPARISONS} have about the same area"
            ));
        }
        for [a, b] in self.duplicate_faces.iter().take(TOLD) {
            lines.push(format!("  twice there {} and {}", name(*a), name(*b)));
        }
        lines.join("\n")
    }
}
