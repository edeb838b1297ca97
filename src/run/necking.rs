//! Localised thinning: a band that thins while the rest of the sheet unloads, a dip in the thickness narrower than the
//! thickness, and a thickness below half of the initial one.
//!
//! Thinning is the logarithmic strain `e = -ln(t / t0)` of a column of the mesh. Past the maximum force (Considère)
//! deformation localises (Hill 1952). Columns of the band are those with more than half of the largest increment of e;
//! all others together thin less than the band. The thinning of the band is summed over the increments. The width of the
//! band, the thickness and the force then depend on the mesh.

use serde::{Deserialize, Serialize};

use super::fields::column_thickness;
use super::hourglassing::neighbours;
use kanagata_geometry::Vec3;
use kanagata_report::record::{MaximumForceRecord, NeckingKind, NeckingRecord};
use kanagata_solver::IncrementReport;
use kanagata_solver::sheet::hex_mesh::HexMesh;

/// Ratio of the force to its maximum in the stage, below which the maximum is passed.
const PASSED_FORCE_RATIO: f64 = 0.99;
/// Smallest thinning that is reported: of a band, or of a dip relative to its neighbours. The scatter between columns of
/// sound runs stays below. Half this value would report dips of coarse tools.
const THINNING_MIN: f64 = 0.05;
/// Smallest ratio of the thinning of a dip to the largest thinning of its neighbours.
const DIP_RATIO_MIN: f64 = 2.0;
/// Thickness over the initial thickness below which hardly any sheet remains intact.
const TORN_THICKNESS_REL: f64 = 0.5;
/// Largest fraction of the columns in a band.
const BAND_FRACTION_MAX: f64 = 0.1;

/// State of the check between increments.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Necking {
    /// Thinning of every column in the last increment.
    thinning: Vec<f64>,
    stage: usize,
    /// Travel of every tool in the last increment [mm].
    travels: Vec<f64>,
    /// Largest force of every tool in the stage [N], and its increment.
    forces: Vec<(f64, usize)>,
    /// Total thinning of bands so far, and the increment in which it started.
    #[serde(rename = "alone")]
    band_thinning: f64,
    #[serde(rename = "began")]
    band_start: usize,
}

impl Necking {
    /// Checks an increment, with the nodes at `positions` [mm].
    pub(super) fn update(
        &mut self,
        report: &IncrementReport<'_>,
        positions: &[Vec3],
    ) -> Option<NeckingRecord> {
        let mesh = report.body.mesh();
        if mesh.nodes_per_column < 2 {
            return None;
        }
        let (now, before) =
            (column_thickness(mesh, positions), column_thickness(mesh, &mesh.nodes));
        let thinning: Vec<f64> = now.iter().zip(&before).map(|(t, t0)| -(t / t0).ln()).collect();
        let falling = self.falling_tool(report);
        let last = std::mem::replace(&mut self.thinning, thinning);
        let band = falling.and_then(|_| self.reported_band(mesh, &last, report.increment));
        let (kind, column, first_increment) = if let Some((column, began)) = band {
            (NeckingKind::Band, column, began)
        } else if let Some(column) = self.torn() {
            (NeckingKind::Torn, column, report.increment)
        } else {
            (NeckingKind::Dip, dip(mesh, &before, &self.thinning)?, report.increment)
        };
        Some(NeckingRecord {
            kind,
            first_increment,
            at_mm: positions[mesh.top_nodes()[column] as usize].into(),
            thickness_rel: (-self.thinning[column]).exp(),
            maximum_force: falling.filter(|_| kind == NeckingKind::Band).map(|tool| {
                let (force_n, increment) = self.forces[tool];
                MaximumForceRecord { tool: report.tools[tool].name.clone(), increment, force_n }
            }),
        })
    }

    /// The thinnest column of a band that has thinned enough to be reported, and the increment in which the band
    /// started. `last`: thinning before the increment.
    fn reported_band(
        &mut self,
        mesh: &HexMesh,
        last: &[f64],
        increment: usize,
    ) -> Option<(usize, usize)> {
        if last.len() != self.thinning.len() {
            return None;
        }
        let (column, by) = band(mesh, last, &self.thinning)?;
        if self.band_thinning == 0.0 {
            self.band_start = increment;
        }
        self.band_thinning += by;
        (self.band_thinning > THINNING_MIN).then_some((column, self.band_start))
    }

    /// The thinnest column, if its thickness is below [`TORN_THICKNESS_REL`].
    fn torn(&self) -> Option<usize> {
        let thinnest = (0..self.thinning.len())
            .max_by(|&a, &b| self.thinning[a].total_cmp(&self.thinning[b]))
            .unwrap_or_default();
        (self.thinning[thinnest] > -TORN_THICKNESS_REL.ln()).then_some(thinnest)
    }

    /// The first tool that moves in this increment and has passed its maximum force of the stage.
    fn falling_tool(&mut self, report: &IncrementReport<'_>) -> Option<usize> {
        let tools = report.tools.len();
        if self.stage != report.stage || self.forces.len() != tools {
            self.stage = report.stage;
            (self.forces, self.band_thinning) = (vec![(0.0, report.increment); tools], 0.0);
        }
        let mut falling = None;
        for (k, tool) in report.tools.iter().enumerate() {
            let moved = self.travels.get(k).is_some_and(|last| *last != tool.travel);
            let (force, largest) = (tool.force.abs(), self.forces[k].0);
            if !report.free && moved && force < PASSED_FORCE_RATIO * largest {
                falling = falling.or(Some(k));
            }
            if force > largest {
                self.forces[k] = (force, report.increment);
            }
        }
        self.travels = report.tools.iter().map(|tool| tool.travel).collect();
        falling
    }
}

/// The thinnest column and its thinning in the increment, if it belongs to a band while the rest of the sheet hardly
/// thins.
fn band(mesh: &HexMesh, last: &[f64], now: &[f64]) -> Option<(usize, f64)> {
    let by: Vec<f64> = now.iter().zip(last).map(|(now, last)| now - last).collect();
    let column = (0..now.len()).max_by(|&a, &b| now[a].total_cmp(&now[b]))?;
    let largest = by.iter().copied().fold(0.0, f64::max);
    let inside: Vec<bool> = by.iter().map(|by| *by > 0.5 * largest).collect();
    let count = inside.iter().filter(|inside| **inside).count();
    if largest <= 0.0
        || !inside[column]
        || count as f64 > (BAND_FRACTION_MAX * now.len() as f64).max(2.0)
    {
        return None;
    }
    let around = neighbours(mesh);
    let beside = |k: usize| inside[k] || around[k].iter().any(|&other| inside[other]);
    let sum = |of: &dyn Fn(usize) -> bool| -> f64 {
        (0..by.len()).filter(|&k| of(k)).map(|k| by[k].max(0.0)).sum()
    };
    (sum(&|k| !beside(k)) < sum(&|k| inside[k])).then_some((column, by[column]))
}

/// The thinnest column of a dip. Its thinning exceeds that of all neighbours by a ratio and an amount, and all are
/// closer than the thickness. Neighbours with the same thinning, for example in a row across a strip, belong to the same
/// dip.
fn dip(mesh: &HexMesh, thickness: &[f64], thinning: &[f64]) -> Option<usize> {
    /// Relative difference of thinning below which columns belong to the same dip.
    const SAME_DIP_REL: f64 = 0.1;
    let around = neighbours(mesh);
    let at = |column: usize| mesh.nodes[column * mesh.nodes_per_column];
    let is_dip = |&k: &usize| {
        let alike =
            |other: usize| (thinning[other] - thinning[k]).abs() < SAME_DIP_REL * thinning[k];
        let beside: Vec<usize> = around[k].iter().copied().filter(|&other| !alike(other)).collect();
        let near = beside.iter().all(|&other| (at(k) - at(other)).norm() < thickness[k]);
        let largest_around = beside.iter().map(|&other| thinning[other]).fold(0.0, f64::max);
        let deep = thinning[k] > DIP_RATIO_MIN * largest_around
            && thinning[k] - largest_around > THINNING_MIN;
        near && deep && beside.len() >= 2
    };
    let found = (0..thinning.len()).filter(is_dip);
    found.max_by(|&a, &b| thinning[a].total_cmp(&thinning[b]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_solver::sheet::hex_mesh::rectangle;

    fn thinning(mesh: &HexMesh, of: impl Fn(f64) -> f64) -> Vec<f64> {
        mesh.bottom_nodes().iter().map(|&n| of(mesh.nodes[n as usize].x)).collect()
    }

    #[test]
    fn a_localised_band_is_distinguished_from_uniform_thinning() {
        let mesh = rectangle(60.0, 10.0, 1.0, 60, 4, 1);
        let last = thinning(&mesh, |_| 0.15);
        let neck = |x: f64| 0.15 + 0.01 * (-(x - 30.0).powi(2)).exp() - 1e-5;
        let (column, by) = band(&mesh, &last, &thinning(&mesh, neck)).unwrap();
        assert_eq!(mesh.nodes[2 * column].x, 30.0);
        assert!((by - 0.00999).abs() < 1e-9, "{by}");
        assert_eq!(band(&mesh, &last, &thinning(&mesh, |x| 0.16 + 1e-5 * x)), None);
        assert_eq!(band(&mesh, &last, &thinning(&mesh, |x| neck(x) + 1e-3)), None);
        assert_eq!(band(&mesh, &last, &thinning(&mesh, |_| 0.14)), None);
        // The column that thins is not the thinnest one.
        let elsewhere = thinning(&mesh, |x| if x < 5.0 { 0.3 } else { 0.15 });
        let then: Vec<f64> =
            elsewhere.iter().zip(thinning(&mesh, neck)).map(|(a, b)| a + b - 0.15).collect();
        assert_eq!(band(&mesh, &elsewhere, &then), None);
    }

    #[test]
    fn a_dip_narrower_than_the_thickness_is_found() {
        let fine = rectangle(30.0, 1.0, 1.0, 150, 1, 1);
        let found = |mesh: &HexMesh, of: &dyn Fn(f64) -> f64| {
            let t0 = column_thickness(mesh, &mesh.nodes);
            dip(mesh, &t0, &thinning(mesh, of)).map(|k| mesh.nodes[2 * k].x)
        };
        let spike = |x: f64| if (x - 11.8).abs() < 0.05 { 0.17 } else { 0.03 };
        assert!((found(&fine, &spike).unwrap() - 11.8).abs() < 1e-9);
        // Wider than the thickness, like the thinning over a radius.
        assert_eq!(found(&fine, &|x: f64| 0.3 * (-((x - 12.0) / 2.0).powi(2)).exp()), None);
        // Elements longer than the thickness cannot show a dip.
        let coarse = rectangle(60.0, 4.0, 1.0, 15, 1, 1);
        assert_eq!(found(&coarse, &|x: f64| if x == 28.0 { 0.17 } else { 0.03 }), None);
    }
}
