//! States of the sheet at earlier increments, from `steps/NNNNNN.vtu`, for the 3-D view.

use std::path::Path;

use super::grid;
use crate::fields;
use crate::springback::SPRINGBACK_NORMAL;
use crate::waves::WAVE_OFFSET;
use kanagata_geometry::Vec3;
use kanagata_report::digits::four_digits;
use kanagata_report::record::{History, HistoryRow};
use kanagata_report::vtu_read;
use kanagata_solver::sheet::hex_mesh::HexMesh;

/// An earlier state of sheet and tools.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Step {
    /// Increment and travels of the tools in words.
    pub(super) name: String,
    /// Positions of the nodes [mm].
    pub(super) positions: Vec<Vec3>,
    /// Mean equivalent plastic strain of every element; empty if unknown.
    pub(super) plastic_strain: Vec<f64>,
    /// Margin of every element to the forming limit; empty if unknown.
    pub(super) margin: Vec<f64>,
    /// Displacement of every node along the normal since the last equilibrium with tools [mm]; empty with tools.
    pub(super) springback: Vec<f64>,
    /// Offset of waves at every node [mm]; empty if unknown.
    pub(super) waves: Vec<f64>,
    /// Travel of each tool [mm].
    pub(super) travel_mm: Vec<f64>,
}

/// Steps shown besides the last. Twice as many would make a page up to a half larger.
const STEPS_MAX: usize = 12;
/// Columns of nodes in all steps together that a page may hold; at about eight bytes each, compressed, they make 1 MB.
/// Doubled, the page of a large sheet grows by as much.
const COLUMNS_MAX: usize = 120_000;

/// Steps of a run, without the last state. Steps whose file is missing or of another mesh are left out.
pub(super) fn read(folder: &Path, history: &History, mesh: &HexMesh) -> Vec<Step> {
    let path = |increment: usize| folder.join(format!("steps/{increment:06}.vtu"));
    let last = history.rows.len().saturating_sub(1);
    let earlier = history.rows[..last].iter();
    let mut found: Vec<Option<&HistoryRow>> =
        earlier.map(Some).filter(|row| path(increment(*row)).is_file()).collect();
    if !history.rows.is_empty() && path(0).is_file() {
        found.insert(0, None);
    }
    let ends_stage: Vec<bool> = found.iter().map(|row| ends_stage(history, *row)).collect();
    let count = STEPS_MAX.min(COLUMNS_MAX / mesh.column_count().max(1));
    let rows = spread(&ends_stage, count).into_iter().map(|k| found[k]);
    rows.filter_map(|row| read_step(&path(increment(row)), history, row, mesh)).collect()
}

/// Increment of a row; 0 before the first.
fn increment(row: Option<&HistoryRow>) -> usize {
    row.map_or(0, |row| row.increment)
}

/// Whether the row after this one belongs to another stage; so it is at the start.
fn ends_stage(history: &History, row: Option<&HistoryRow>) -> bool {
    let Some(row) = row else { return true };
    let at = history.rows.partition_point(|one| one.increment <= row.increment);
    history.rows.get(at).is_none_or(|next| next.stage != row.stage)
}

/// Ascending indices of at most `count` items: first those that are `needed`, in order, then, again and again, the item that
/// is farthest from the chosen ones, the first of equal ones.
fn spread(needed: &[bool], count: usize) -> Vec<usize> {
    let mut chosen: Vec<usize> = (0..needed.len()).filter(|&k| needed[k]).take(count).collect();
    let distance = |chosen: &[usize], k: usize| {
        chosen.iter().map(|&c| c.abs_diff(k)).min().unwrap_or(usize::MAX)
    };
    while chosen.len() < count.min(needed.len()) {
        let farther = |a: usize, b: usize| {
            if distance(&chosen, b) > distance(&chosen, a) { b } else { a }
        };
        let Some(next) = (0..needed.len()).reduce(farther) else { break };
        chosen.push(next);
    }
    chosen.sort_unstable();
    chosen
}

fn read_step(
    path: &Path,
    history: &History,
    row: Option<&HistoryRow>,
    mesh: &HexMesh,
) -> Option<Step> {
    let read = vtu_read::read(path).ok()?;
    let same = read.points.len() == mesh.nodes.len() && read.cells.len() == mesh.elements.len();
    let at_nodes = |name: &str| grid::point_values(&read, name).unwrap_or_default().to_vec();
    let (springback, waves) = (at_nodes(SPRINGBACK_NORMAL), at_nodes(WAVE_OFFSET));
    same.then(|| Step {
        name: name(history, row),
        springback,
        waves,
        plastic_strain: grid::cell_values(&read, "plastic_strain").unwrap_or_default().to_vec(),
        margin: grid::cell_values(&read, "forming_limit_margin").unwrap_or_default().to_vec(),
        travel_mm: row.map_or_else(|| vec![0.0; history.tools.len()], |row| row.travel_mm.clone()),
        positions: read.points,
    })
}

/// Increment, stage and travels in words.
pub(super) fn name(history: &History, row: Option<&HistoryRow>) -> String {
    let Some(row) = row else { return "start".into() };
    let mut out = format!("increment {}, {}", row.increment, row.stage);
    let moved = history.tools.iter().zip(&row.travel_mm).filter(|(_, travel)| **travel != 0.0);
    let moved: Vec<String> =
        moved.map(|(tool, travel)| format!("{tool} {} mm", four_digits(*travel))).collect();
    if !moved.is_empty() {
        out += &format!(": {}", moved.join(", "));
    }
    out
}

impl Step {
    /// Thickness of every column [mm].
    pub(super) fn thickness(&self, mesh: &HexMesh) -> Vec<f64> {
        fields::column_thickness(mesh, &self.positions)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_spread_and_hold_the_ends_of_stages() {
        let ends =
            |count: usize, at: &[usize]| (0..count).map(|k| at.contains(&k)).collect::<Vec<_>>();
        assert_eq!(spread(&ends(9, &[0, 8]), 5), [0, 2, 4, 6, 8]);
        assert_eq!(spread(&ends(9, &[0, 3, 8]), 4), [0, 3, 5, 8]);
        assert_eq!(spread(&ends(3, &[0]), 12), [0, 1, 2]);
        assert_eq!(spread(&ends(4, &[0, 1, 2, 3]), 2), [0, 1]);
        assert!(spread(&[], 3).is_empty() && spread(&[true], 0).is_empty());
    }

    #[test]
    fn a_step_is_named_by_increment_stage_and_travels() {
        let row = |increment: usize, stage: &str| HistoryRow {
            increment,
            stage: stage.into(),
            time: 0.0,
            travel_mm: vec![0.0, 10.25],
            force_n: vec![0.0; 2],
            pressure_mpa: Vec::new(),
            iterations: 1,
            contacts: [0; 2],
            energy: Default::default(),
        };
        let rows = vec![row(1, "hold"), row(2, "draw"), row(4, "draw")];
        let history = History { tools: vec!["die".into(), "punch".into()], rows };
        let rows = &history.rows;
        assert_eq!(name(&history, Some(&rows[2])), "increment 4, draw: punch 10.25 mm");
        assert_eq!(name(&history, None), "start");
        let ends = rows.iter().map(|row| ends_stage(&history, Some(row)));
        assert_eq!(ends.collect::<Vec<_>>(), [true, false, true]);
    }
}
