//! Error of the forces from the length of the increments.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Error of the forces from the length of the increments, estimated where plastic flow and friction turn.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct IncrementErrorRecord {
    /// Error that the scene allows (`solver.increment_error`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub allowed: Option<f64>,
    /// Work that the forces lack, over all work of deformation and friction.
    pub of_work: f64,
    /// Largest relative error of the forces in an increment with tools.
    pub largest: f64,
    /// The increment with the largest error.
    pub increment: usize,
    /// Work that the forces lack so far [N mm].
    pub lacking_nmm: f64,
    /// Work so far of deformation and friction: dissipated work and changes of the elastic energy [N mm].
    pub work_nmm: f64,
}

impl IncrementErrorRecord {
    /// Work that forces lack because of the length of the increments over all work, above which a doubt is raised.
    pub const ALLOWED_REL: f64 = 0.05;

    /// Adds an `increment` with these sums since the start of the run. Its own error counts with tools only, and if its
    /// work is above `rounding_nmm`, > 0.
    pub fn update(&mut self, increment: usize, sums: [f64; 2], has_tools: bool, rounding_nmm: f64) {
        let [lacking_nmm, work_nmm] = sums;
        let (lacking, work) = (lacking_nmm - self.lacking_nmm, work_nmm - self.work_nmm);
        if has_tools && work > rounding_nmm && lacking > self.largest * work {
            (self.largest, self.increment) = (lacking / work, increment);
        }
        let of_work = lacking_nmm / work_nmm.max(rounding_nmm);
        *self = Self { of_work, lacking_nmm, work_nmm, ..*self };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doubt::DoubtCode;
    use crate::record::RunRecord;

    #[test]
    fn the_largest_error_of_an_increment_is_one_with_tools() {
        let mut error = IncrementErrorRecord::default();
        error.update(1, [1e-9, 1e-9], true, 1e-6);
        assert_eq!((error.largest, error.of_work), (0.0, 1e-3));
        error.update(2, [1.0, 20.0], true, 1e-6);
        error.update(3, [1.2, 30.0], true, 1e-6);
        error.update(4, [1.4, 31.0], false, 1e-6);
        assert_eq!(error.increment, 2);
        assert!((error.largest - 0.05).abs() < 1e-9);
        assert_eq!(error.of_work, 1.4 / 31.0);
    }

    #[test]
    fn forces_that_lack_work_are_a_doubt() {
        let codes = |of_work, allowed| {
            let error = IncrementErrorRecord { of_work, allowed, ..Default::default() };
            let increment_error = Some(error);
            let record = RunRecord { increment_error, ..RunRecord::default() };
            let doubts = record.all_doubts(&[]);
            doubts.iter().any(|doubt| doubt.code == DoubtCode::IncrementsTooLong)
        };
        assert!(codes(0.051, None) && !codes(0.049, None) && codes(0.051, Some(0.1)));
        assert!(codes(0.0011, Some(0.001)) && !codes(0.0009, Some(0.001)));
    }
}
