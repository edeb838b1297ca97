//! How far the sheet springs back when its tools are let go.

use serde::{Deserialize, Serialize};

use crate::report::record::SpringbackRecord;
use crate::solver::{IncrementReport, Stage};

/// The sheet as its tools last held it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Springback {
    /// Stages that let go of all tools.
    stages: Vec<usize>,
    /// Displacements when the last of them began, three a node [mm].
    held: Vec<f64>,
    /// Forces of all tools then, without regard to sign, of the whole process [N].
    force_n: f64,
    /// Elastic energy then, of the whole process [N mm].
    elastic_nmm: f64,
}

impl Springback {
    /// Of a process with these stages.
    #[must_use]
    pub fn of(stages: &[Stage]) -> Self {
        let stages = (1..stages.len()).filter(|&stage| stages[stage].lets_go()).collect();
        Self { stages, ..Self::default() }
    }

    /// Takes an increment; in a stage that lets go of the tools, what has sprung back since it began.
    pub fn take(&mut self, report: &IncrementReport<'_>) -> Option<SpringbackRecord> {
        if self.stages.contains(&(report.stage + 1)) && report.share >= 1.0 - 1e-12 {
            self.held = report.displacements.to_vec();
            self.force_n = report.tools.iter().map(|t| t.force.abs()).sum();
            self.elastic_nmm = report.energies.elastic;
        }
        if !self.stages.contains(&report.stage) {
            return None;
        }
        let moved = report.displacements.chunks_exact(3).zip(self.held.chunks_exact(3));
        let squares = moved.map(|(u, held)| u.iter().zip(held).map(|(a, b)| (a - b).powi(2)).sum());
        let (largest, sum, count) = squares
            .fold((0.0_f64, 0.0, 0.0), |(most, sum, count), s: f64| {
                (most.max(s), sum + s, count + 1.0)
            });
        (count > 0.0).then(|| SpringbackRecord {
            largest_mm: largest.sqrt(),
            rms_mm: (sum / count).sqrt(),
            force_n: self.force_n,
            energy_nmm: self.elastic_nmm - report.energies.elastic,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::stages::{Energies, Timings, ToolReport};
    use crate::solver::{Curve, Motion};

    fn stage(motions: Vec<Motion>) -> Stage {
        Stage {
            name: String::new(),
            duration: 1.0,
            motions,
            load: Curve::constant(1.0),
            first_step: 1.0,
            largest_step: 1.0,
            ends: Vec::new(),
        }
    }

    fn report<'a>(stage: usize, share: f64, u: &'a [f64], elastic: f64) -> IncrementReport<'a> {
        let tool = |force: f64| ToolReport {
            name: String::new(),
            travel: 0.0,
            force,
            force_vector: [0.0; 3],
            shift: [0.0; 3],
            contacts: 0,
        };
        IncrementReport {
            increment: 1,
            stage,
            stage_name: "",
            time: 0.0,
            share,
            tools: vec![tool(30.0), tool(-10.0)],
            iterations: 0,
            iterations_total: 0,
            cuts: 0,
            snaps: 0,
            steadied: 0,
            history: &[],
            energies: Energies { elastic, ..Energies::default() },
            volume_balance: None,
            contacts: 0,
            slipping: 0,
            timings: Timings::default(),
            displacements: u,
            contact_forces: &[],
        }
    }

    #[test]
    fn what_moves_back_is_measured_from_where_the_tools_held_the_sheet() {
        let gone = || stage(vec![Motion::Release, Motion::Absent]);
        let held = || stage(vec![Motion::Hold, Motion::Hold]);
        let mut springback = Springback::of(&[held(), gone()]);
        assert_eq!(springback.take(&report(0, 0.5, &[9.0; 6], 9.0)), None);
        assert_eq!(springback.take(&report(0, 1.0, &[1.0; 6], 5.0)), None);
        let there = [1.0, 4.0, 5.0, 1.0, 1.0, 1.0];
        let found = springback.take(&report(1, 1.0, &there, 2.0)).unwrap();
        assert_eq!([found.largest_mm, found.force_n, found.energy_nmm], [5.0, 40.0, 3.0]);
        assert!((found.rms_mm - 12.5_f64.sqrt()).abs() < 1e-15);
        // Formed on and let go again: from where the tools held it last.
        let mut twice = Springback::of(&[held(), gone(), held(), gone()]);
        for (stage, u) in [(0, 1.0), (1, 2.0), (2, 7.0)] {
            let found = twice.take(&report(stage, 1.0, &[u; 6], 1.0));
            assert_eq!(found.is_some(), stage == 1);
        }
        let found = twice.take(&report(3, 0.5, &[9.0, 7.0, 7.0, 7.0, 7.0, 7.0], 1.0)).unwrap();
        assert_eq!(found.largest_mm, 2.0);
        // Nothing is let go, or nothing was held before.
        for stages in [vec![held(), held()], vec![gone()]] {
            let mut springback = Springback::of(&stages);
            assert_eq!(springback.take(&report(0, 1.0, &[0.0; 6], 0.0)), None);
            assert_eq!(springback.take(&report(1, 1.0, &[1.0; 6], 0.0)), None);
        }
    }
}
