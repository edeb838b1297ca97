//! Maps of where methods fail: the paper's Newton by starting point, forms of evaluation by degree, Eq. 8 by the
//! normals of an edge.

mod edges;
mod evaluation;
mod newton;

use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::StudyError;
use crate::files::write_atomic;
use crate::report::drawing::{Chart, HeatMap, write_chart, write_heat_maps};

/// What is mapped, and how finely.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StabilityStudy {
    /// `kanagata-stability`.
    pub format: FormatTag,
    /// File version: 1.
    pub version: u32,
    /// Name, for reports.
    pub name: String,
    /// Newton's method of Eq. 19-23.
    pub newton: NewtonMap,
    /// Monomials against Bernstein polynomials.
    pub evaluation: EvaluationMap,
    /// Eq. 8 plain and guarded.
    pub edges: EdgeMap,
}

/// The constant that marks a study of stability.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum FormatTag {
    /// `kanagata-stability`
    #[serde(rename = "kanagata-stability")]
    Stability,
}

/// Points over a Nagata patch on a cylinder, and Newton from a grid of starting points.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NewtonMap {
    /// Angles one patch spans [deg], one map each; below 180.
    pub angles_deg: Vec<f64>,
    /// Starting points along each parameter.
    pub starts: usize,
    /// Cells along the angle.
    pub columns: usize,
    /// Cells along the distance.
    pub rows: usize,
}

/// Random polynomials, evaluated in floating point and exactly.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EvaluationMap {
    /// Highest degree, 2 to 12.
    pub highest_degree: usize,
    /// Polynomials of each degree.
    pub polynomials: usize,
}

/// Plane edges over the tilt of their mean normal and the angle between their normals.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EdgeMap {
    /// Cells along each axis.
    pub cells: usize,
}

/// A map with a number for the summary.
struct Panel {
    map: HeatMap,
    /// Share of its cells where the method does what it should.
    sound: f64,
}

/// Computes all maps and writes `newton.svg`, `evaluation.svg`, `edges.svg` and a table of each (CSV) into `folder`;
/// returns a line a panel.
///
/// # Errors
/// [`StudyError::Value`] for sizes that make no sense, [`StudyError::Write`].
pub fn run(study: &StabilityStudy, file: &Path, folder: &Path) -> Result<Vec<String>, StudyError> {
    check(study, file)?;
    let mut said = Vec::new();
    let panels = newton::maps(&study.newton);
    maps(folder, "newton", &panels, 0.0..1.0, "share")?;
    said.extend(panels.iter().map(|p| {
        format!(
            "paper's Newton, {}: every start converges in {:.1} % of the cells",
            p.map.title,
            100.0 * p.sound
        )
    }));
    let panels = edges::maps(&study.edges);
    maps(folder, "edges", &panels, -1.0..3.0, "log10")?;
    said.extend(panels.iter().map(|p| {
        format!(
            "{}: |c| < 2 |d| and no turning back in {:.1} % of the cells",
            p.map.title,
            100.0 * p.sound
        )
    }));
    let chart = evaluation::chart(&study.evaluation);
    write_chart(&folder.join("evaluation.svg"), &chart)?;
    write_lines(&folder.join("evaluation.csv"), &chart)?;
    said.extend(chart.lines.iter().map(|l| {
        let last = l.points.last().map_or((0.0, 0.0), |p| *p);
        format!("{}: error {:.1} units of rounding at degree {}", l.name, last.1, last.0)
    }));
    Ok(said)
}

fn check(study: &StabilityStudy, file: &Path) -> Result<(), StudyError> {
    let fault = |place: &str, found: String, allowed: &str| {
        Err(StudyError::Value {
            path: file.to_path_buf(),
            place: place.into(),
            found,
            allowed: allowed.into(),
        })
    };
    let (n, e) = (&study.newton, &study.evaluation);
    if study.version != 1 {
        return fault("version", study.version.to_string(), "1");
    }
    if let Some(angle) = n.angles_deg.iter().find(|a| !(**a > 0.0 && **a < 180.0)) {
        return fault("newton.angles_deg", angle.to_string(), "above 0 and below 180");
    }
    for (place, count) in [
        ("newton.starts", n.starts),
        ("newton.columns", n.columns),
        ("newton.rows", n.rows),
        ("edges.cells", study.edges.cells),
    ] {
        if !(1..=1000).contains(&count) {
            return fault(place, count.to_string(), "1 to 1000");
        }
    }
    if !(2..=12).contains(&e.highest_degree) {
        return fault("evaluation.highest_degree", e.highest_degree.to_string(), "2 to 12");
    }
    if !(1..=1_000_000).contains(&e.polynomials) {
        return fault("evaluation.polynomials", e.polynomials.to_string(), "1 to 1000000");
    }
    Ok(())
}

fn maps(
    folder: &Path,
    name: &str,
    panels: &[Panel],
    scale: std::ops::Range<f64>,
    meaning: &str,
) -> Result<(), StudyError> {
    let drawn: Vec<HeatMap> = panels.iter().map(|p| p.map.clone()).collect();
    write_heat_maps(&folder.join(format!("{name}.svg")), &drawn, scale, meaning)?;
    write_atomic(&folder.join(format!("{name}.csv")), |w| {
        writeln!(w, "panel,x,y,value")?;
        for map in &drawn {
            for (k, value) in map.values.iter().enumerate() {
                let (x, y) = middle(map, k);
                writeln!(w, "{},{x},{y},{value}", map.title.replace(',', ";"))?;
            }
        }
        Ok(())
    })?;
    Ok(())
}

/// Middle of cell `k`.
fn middle(map: &HeatMap, k: usize) -> (f64, f64) {
    let rows = (map.values.len() / map.columns) as f64;
    let share = |i: usize, n: f64, r: &std::ops::Range<f64>| {
        r.start + (i as f64 + 0.5) / n * (r.end - r.start)
    };
    (share(k % map.columns, map.columns as f64, &map.x.1), share(k / map.columns, rows, &map.y.1))
}

fn write_lines(path: &Path, chart: &Chart) -> Result<(), StudyError> {
    write_atomic(path, |w| {
        writeln!(w, "line,x,y")?;
        for line in &chart.lines {
            for (x, y) in &line.points {
                writeln!(w, "{},{x},{y}", line.name.replace(',', ";"))?;
            }
        }
        Ok(())
    })?;
    Ok(())
}

#[cfg(test)]
mod tests;
