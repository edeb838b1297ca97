//! Increments that end where those of another run ended. Two runs then differ only by what is compared, not by their
//! steps.

use std::path::{Path, PathBuf};

use super::error::SceneError;
use super::types::Scene;
use kanagata_files::sha256_hex;
use kanagata_report::record::History;

/// Smallest difference of successive times, as a fraction of a stage.
const TIME_DIFFERENCE_MIN: f64 = 1e-12;

/// Ends of the increments of another run.
#[derive(Debug, Clone, PartialEq)]
pub struct Followed {
    /// The file as the scene names it.
    pub file: String,
    /// SHA-256 of the file.
    pub sha256: String,
    /// Ends of the increments of each stage: ascending fractions in (0, 1].
    pub ends: Vec<Vec<f64>>,
}

/// Reads the history named by `solver.increments_of` of the scene at `path`; `None` without the key.
///
/// # Errors
/// [`SceneError::Value`]: the file cannot be read, is not a history, or has other stages.
pub(super) fn followed(
    scene: &Scene,
    path: &Path,
    folder: &Path,
) -> Result<Option<Followed>, SceneError> {
    let Some(name) = &scene.solver.increments_of else { return Ok(None) };
    let file: PathBuf = folder.join(name);
    let fault = |found: String| SceneError::Value {
        path: path.to_path_buf(),
        place: "solver.increments_of".into(),
        found: format!("{}: {found}", file.display()),
        allowed: "the history.csv of a run of the same stages".into(),
    };
    let bytes = kanagata_files::read(&file, kanagata_files::Input::Table)
        .map_err(|e| fault(e.to_string()))?;
    let history = History::parse(&String::from_utf8_lossy(&bytes)).map_err(fault)?;
    let stages: Vec<&str> = scene.stages.iter().map(|s| s.name.as_str()).collect();
    let ends = ends(&history, &stages).map_err(fault)?;
    Ok(Some(Followed { file: name.clone(), sha256: sha256_hex(&bytes), ends }))
}

/// Fractions of the stages at which increments ended. Each stage takes one unit of time.
///
/// # Errors
/// An increment that ends before the previous one, after all stages, or in a stage with another name.
pub fn ends(history: &History, stages: &[&str]) -> Result<Vec<Vec<f64>>, String> {
    let mut ends = vec![Vec::new(); stages.len()];
    let mut last = 0.0;
    for row in &history.rows {
        let at = format!("increment {} of stage '{}', time {}", row.increment, row.stage, row.time);
        let within = row.time > last + TIME_DIFFERENCE_MIN && row.time <= stages.len() as f64;
        if !within {
            return Err(format!("{at}, after time {last}, of {} stages", stages.len()));
        }
        let stage = row.time.ceil() as usize - 1;
        if stages[stage] != row.stage {
            return Err(format!("{at}, where the scene has '{}'", stages[stage]));
        }
        ends[stage].push(row.time - stage as f64);
        last = row.time;
    }
    Ok(ends)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn history(rows: &[(&str, f64)]) -> History {
        let mut text = String::from(
            "increment,stage,time,die_travel_mm,die_force_n,iterations,contact_nodes,slipping_nodes,external_work_nmm,internal_work_nmm,friction_work_nmm\n",
        );
        for (k, (stage, time)) in rows.iter().enumerate() {
            text += &format!("{},{stage},{time},0,0,3,0,0,0,0,0\n", k + 1);
        }
        History::parse(&text).unwrap()
    }

    #[test]
    fn times_become_shares_of_their_stages() {
        let rows = [("clamp", 0.25), ("clamp", 1.0), ("draw", 1.125), ("draw", 1.5)];
        let found = ends(&history(&rows), &["clamp", "draw", "release"]).unwrap();
        assert_eq!(found, [vec![0.25, 1.0], vec![0.125, 0.5], vec![]]);
    }

    #[test]
    fn a_history_of_another_process_is_refused_with_its_place() {
        let found = |rows: &[(&str, f64)]| ends(&history(rows), &["clamp", "draw"]).unwrap_err();
        let message = found(&[("clamp", 0.5), ("pull", 1.5)]);
        assert!(message.contains("'pull'") && message.contains("has 'draw'"), "{message}");
        for time in [0.5, 0.25, 3.0, f64::NAN, f64::INFINITY, -1.0] {
            let message = found(&[("clamp", 0.5), ("clamp", time)]);
            assert!(message.contains("increment 2"), "{message}");
        }
    }
}
