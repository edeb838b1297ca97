//! How damping is made less from step to step.

/// Damping tried first: stiffness of a node's damper over the mesh's.
const FIRST: f64 = 1e-3;
/// Factor by which damping falls after steps that went well, and rises after those that failed.
const FACTOR: f64 = 4.0;
/// Iterations of a step that went very well (damping falls by the factor squared), and of one that went well.
const EASY: usize = 3;
pub(in crate::solver) const WELL: usize = 5;
/// How fast it is forgotten that less damping failed, a step.
const FORGET: f64 = 0.5;

/// Damping of the next step.
pub(in crate::solver) struct Damping {
    pub(in crate::solver) now: f64,
    /// What failed not long ago, less what has been forgotten of it: there is no less before.
    floor: f64,
    /// The least there is: of a sheet that is pushed.
    least: f64,
}

impl Damping {
    pub(in crate::solver) fn of(push: Option<f64>) -> Self {
        let least = push.unwrap_or(0.0);
        Self { now: push.unwrap_or(FIRST), floor: 0.0, least }
    }

    pub(in crate::solver) fn failed(&mut self) {
        self.now *= FACTOR;
        self.floor = self.now;
    }

    pub(in crate::solver) fn went(&mut self, iterations: usize) {
        self.floor *= FORGET;
        let less = match iterations {
            n if n <= EASY => FACTOR * FACTOR,
            n if n <= WELL => FACTOR,
            _ => 1.0,
        };
        self.now = (self.now / less).max(self.floor).max(self.least);
    }
}
