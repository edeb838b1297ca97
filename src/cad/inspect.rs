//! Summary of a file for `kanagata inspect`.

use std::collections::BTreeMap;
use std::fmt;

use super::model::SurfaceKind;
use super::{Diagnostic, Model, Severity};

/// Summary of a model, as JSON or as a table.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Inspection {
    /// File name.
    pub file: String,
    /// Unit of length the file declares.
    pub unit: String,
    /// Millimetres in one unit of the file.
    pub unit_mm: f64,
    /// Number of faces.
    pub faces: usize,
    /// Faces by surface type.
    pub faces_by_type: BTreeMap<SurfaceKind, usize>,
    /// Area of all faces [mm2].
    pub area_mm2: f64,
    /// Tight bounding box: x, y, z minima, then maxima [mm]; zeros without faces.
    pub bbox_mm: [f64; 6],
    /// Edges used by one face only.
    pub free_edges: usize,
    /// Total length of free edges [mm].
    pub free_edge_length_mm: f64,
    /// Total number of edges after joining.
    pub edges: usize,
    /// Distance within which edges were joined [mm].
    pub join_tolerance_mm: f64,
    /// Entities of the file by kind.
    pub entities: BTreeMap<String, usize>,
    /// Diagnostics of reading and building.
    pub diagnostics: Vec<Diagnostic>,
}

/// Summarises a model.
#[must_use]
pub fn inspect(model: &Model, diagnostics: &[Diagnostic]) -> Inspection {
    let mut faces_by_type = BTreeMap::new();
    for face in &model.faces {
        *faces_by_type.entry(face.kind).or_insert(0) += 1;
    }
    let bounds = model.bbox();
    let bbox_mm = if bounds.is_empty() {
        [0.0; 6]
    } else {
        let (a, b) = (bounds.min, bounds.max);
        [a.x, a.y, a.z, b.x, b.y, b.z]
    };
    let free: Vec<_> = model.edges.iter().filter(|e| e.uses.len() == 1).collect();
    let (area_mm2, unmeasured) = model.measured_area();
    let unmeasured = unmeasured.into_iter().map(|f| Diagnostic {
        severity: Severity::Warning,
        code: "area-unmeasured",
        place: model.faces[f].source.clone(),
        text: "its area did not converge within the evaluation limit; the area of the model is an estimate".into(),
    });
    Inspection {
        file: model.name.clone(),
        unit: model.unit.clone(),
        unit_mm: model.unit_mm,
        faces: model.faces.len(),
        faces_by_type,
        area_mm2,
        bbox_mm,
        free_edges: free.len(),
        free_edge_length_mm: free.iter().map(|e| e.curve.length()).fold(0.0, |sum, l| sum + l),
        edges: model.edges.len(),
        join_tolerance_mm: model.join_tolerance,
        entities: model.entities.clone(),
        diagnostics: diagnostics.iter().cloned().chain(unmeasured).collect(),
    }
}

/// Entities with their counts, in lines of about a hundred columns.
fn entity_lines(entities: &BTreeMap<String, usize>) -> Vec<String> {
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

impl fmt::Display for Inspection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kinds = self.faces_by_type.iter().map(|(k, n)| format!("{n} {k:?}").to_lowercase());
        let kinds = kinds.collect::<Vec<_>>().join(", ");
        let b = &self.bbox_mm;
        writeln!(f, "{}", self.file)?;
        writeln!(f, "  unit        {} ({} mm)", self.unit, self.unit_mm)?;
        writeln!(f, "  faces       {}: {}", self.faces, kinds)?;
        writeln!(f, "  area        {:.6} mm2", self.area_mm2)?;
        writeln!(
            f,
            "  box         {:.4} {:.4} {:.4} to {:.4} {:.4} {:.4} mm",
            b[0], b[1], b[2], b[3], b[4], b[5]
        )?;
        writeln!(
            f,
            "  free edges  {} of {}, {:.4} mm long (joined within {:.1e} mm)",
            self.free_edges, self.edges, self.free_edge_length_mm, self.join_tolerance_mm
        )?;
        write!(f, "  entities    {}", entity_lines(&self.entities).join("\n              "))?;
        for d in &self.diagnostics {
            let mark = if d.severity == Severity::Warning { "warning" } else { "note" };
            write!(f, "\n  {mark}: {} {}: {}", d.code, d.place, d.text)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_entity_is_listed_in_lines_that_a_terminal_holds() {
        let entities: BTreeMap<String, usize> =
            (1..60).map(|k| (format!("ENTITY_NUMBER_{k:02}"), k)).collect();
        let lines = entity_lines(&entities);
        assert!(lines.len() > 10 && lines.iter().all(|l| l.len() <= 101), "{lines:?}");
        let all = lines.join(", ");
        assert_eq!(all.split(", ").count(), 59);
        assert!(all.contains("7 x ENTITY_NUMBER_07") && entity_lines(&BTreeMap::new()) == [""]);
    }
}
