//! Tolerances, and a limit of repetitions, that several rooms of the solver share. Tolerances are ratios, so that no
//! unit enters.

/// Relative difference that counts as rounding: lengths over the shortest edge, stiffnesses over that of the mesh,
/// forces over the largest one. Rounding reaches about 1e-13 of the largest number in a sum over all unknowns; a
/// thousand times this keeps its sign from deciding, and is far below the tolerances of equilibrium.
pub(crate) const ROUNDING_REL: f64 = 1e-10;

/// Relative accuracy of a converged state and of given geometry: by default equilibrium holds to this fraction of the
/// contact forces ([`crate::Limits::force_tolerance`]). Smaller differences between two such states mean
/// nothing, and a point at such a gap over the length of an edge lies on a tool.
pub(crate) const ACCURACY_REL: f64 = 1e-6;

/// Relative difference that is negligible: two values that differ by less count as equal in a choice between them,
/// and what is smaller does not change a result that is used. Nodes at mirrored places differ by less, within an
/// iterate that has not converged.
pub(crate) const NEGLIGIBLE_REL: f64 = 1e-3;

/// Unbalanced or viscous force over its reference below which equilibrium is near: the linearisation is accurate,
/// corrections are applied in full, active sets that return indicate cycling, and viscous forces, or the last force of a
/// tool that is released, may be removed. Above
/// a few hundredths yielding and stick of single points still dominate the residual.
pub(crate) const NEAR_EQUILIBRIUM_REL: f64 = 1e-2;

/// Repetitions without progress after which a state no longer changes freely: changes of the patch of a foot point in
/// an increment, corrections that stagnate. One or two also occur while nodes begin to stick or points to yield; more
/// only repeat a cycle.
pub(crate) const REPETITIONS_MAX: usize = 3;
