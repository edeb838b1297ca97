//! Stages of a process and what an increment reports.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::geometry::numbers::COUNT_MAX;
use crate::solver::active_set::over_edge::OverEdge;
use crate::solver::assembly::Body;
use crate::solver::penetration::FacePenetration;
use crate::solver::tools::tool::{Curve, Motion};

/// One stage: clamp, draw, release, ...
#[derive(Debug, Clone, PartialEq)]
pub struct Stage {
    /// Name in the history.
    pub name: String,
    /// Duration [s]; only a label in a quasi-static run, > 0.
    pub duration: f64,
    /// What each tool does, in the order of the tools.
    pub motions: Vec<Motion>,
    /// Share of the set-up's loads over the stage.
    pub load: Curve,
    /// First increment, a share of the stage in (0, 1].
    pub first_step: f64,
    /// Largest increment, a share of the stage in (0, 1].
    pub largest_step: f64,
    /// Ends of increments, ascending shares of the stage in (0, 1]; empty: the run finds its own, as it does behind the
    /// last and where all tools are taken away.
    pub ends: Vec<f64>,
}

impl Stage {
    /// Length of the first step, as a share.
    pub(in crate::solver) fn first(&self) -> f64 {
        self.first_step.min(self.largest_step)
    }

    fn curves(&self) -> impl Iterator<Item = &Curve> {
        self.motions.iter().filter_map(Motion::curve).chain([&self.load])
    }

    /// Share behind `share` at which a curve of a tool or the loads next turns, or the stage ends: increments end there.
    pub(in crate::solver) fn next_corner(&self, share: f64) -> f64 {
        let corners = self.curves().flat_map(Curve::corners);
        corners.filter(|corner| *corner > share).fold(1.0, f64::min)
    }

    /// Whether a tool or the loads turn back at `share`, or go on at less than half or more than twice the speed: then the next
    /// increment is not like the last.
    pub(in crate::solver) fn turns(&self, share: f64) -> bool {
        self.curves().filter(|curve| curve.corners().contains(&share)).any(|curve| {
            let [before, after] = curve.rates(share);
            !(0.5..=2.0).contains(&(after / before))
        })
    }
}

/// Limits of the solver. Forces and lengths are scaled by the problem itself: no unit enters.
#[derive(Debug, Clone, PartialEq)]
pub struct Limits {
    /// Newton iterations an increment may take.
    pub iterations: usize,
    /// Iterations an increment should take: fewer and the next one grows, more and it shrinks.
    pub wanted_iterations: usize,
    /// Residual force over the norm of contact forces and reactions.
    pub force_tolerance: f64,
    /// Largest penetration of a node [mm] over the sheet's thickness.
    pub gap_tolerance: f64,
    /// Smallest increment, a share of the first one (of the largest, where that is smaller).
    pub smallest_step: f64,
    /// Increments of the whole run.
    pub increments: usize,
    /// Slip in an increment over which friction rises to Coulomb's force, over the longest element edge;
    /// 0: exact stick and slip. See [`crate::contact::friction::Coulomb`].
    pub friction_transition: f64,
    /// How a node is kept out of a tool.
    pub contact: ContactMethod,
}

/// How a node is kept out of a tool. Stiffnesses are shares of the undeformed mesh's own, so that no unit enters.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum ContactMethod {
    /// Exactly, the normal force being what equilibrium leaves over.
    #[default]
    Exact,
    /// By a spring: the node lies in the tool by its normal force over the stiffness.
    Penalty {
        /// Of the spring, over the mesh's, > 0.
        stiffness: f64,
    },
    /// By a spring about a known force, which is corrected from outside until the gap is closed.
    Augmented {
        /// Of the spring, over the mesh's, > 0.
        stiffness: f64,
    },
}

impl ContactMethod {
    /// Stiffness of the spring over the mesh's, where there is one.
    #[must_use]
    pub fn stiffness(self) -> Option<f64> {
        match self {
            Self::Exact => None,
            Self::Penalty { stiffness } | Self::Augmented { stiffness } => Some(stiffness),
        }
    }
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            iterations: 25,
            wanted_iterations: 7,
            force_tolerance: 1e-6,
            gap_tolerance: 1e-8,
            smallest_step: 1e-4,
            increments: 100_000,
            friction_transition: 0.0,
            contact: ContactMethod::Exact,
        }
    }
}

/// Wall time by phase [s].
///
/// Searching the tree and projecting on patches alternate within every node's query, some tenths of a microsecond each:
/// clocks between them would cost as much as they measure, so they are one figure.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Timings {
    /// Closest points on the tools: the global search and the projection on patches.
    pub search: f64,
    /// Element loop and assembly of the matrix.
    pub elements: f64,
    /// Contact conditions put into the matrix.
    pub contact: f64,
    /// Factorisation.
    pub factor: f64,
    /// Factors brought up to date where few rows have changed.
    #[serde(default)]
    pub update: f64,
    /// Substitution and refinement.
    pub solve: f64,
    /// Whether balances last: a factorisation for each.
    #[serde(default)]
    pub stability: f64,
    /// Penetration of tools into faces of elements, measured once an increment.
    #[serde(default)]
    pub penetration: f64,
    /// Factorisations counted by `factor`: at least one an iteration, more where the active set is settled.
    pub factorisations: usize,
    /// Times factors were brought up to date for a changed active set instead.
    #[serde(default)]
    pub updates: usize,
    /// Times blocks of contact states went back and forth, so that only a part of them was changed.
    #[serde(default)]
    pub cycling: usize,
}

/// Work since the start of the run [mJ], of the whole process.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Energies {
    /// Work of the tools on the sheet (normal and tangential contact forces over the nodes' motion).
    pub external: f64,
    /// Work of the internal forces.
    pub internal: f64,
    /// Elastic energy stored now.
    pub elastic: f64,
    /// Plastic work: dissipated, or stored by hardening.
    pub plastic: f64,
    /// Against what keeps fibres of the elements from tilting by turns under pressure through the thickness: of no sheet.
    #[serde(default)]
    pub artificial: f64,
    /// Dissipated by friction between sheet and tools.
    pub friction: f64,
    /// Set free where the sheet moved by itself from one balance to another: heat, once it is at rest.
    #[serde(default)]
    pub snaps: f64,
    /// Part of the external work that forces have done which tools that were let go had left behind; a sheet that springs back
    /// does work against them.
    #[serde(default)]
    pub left_behind: f64,
    /// The most that external or internal work has been at any increment.
    #[serde(default)]
    pub most: f64,
}

impl Energies {
    /// Work that is not accounted for.
    #[must_use]
    pub fn open(&self) -> f64 {
        self.external - self.internal - self.friction - self.snaps
    }

    /// What the internal forces have worked on.
    #[must_use]
    pub fn stored(&self) -> f64 {
        self.elastic + self.plastic + self.artificial
    }
}

/// One Newton iteration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IterationRecord {
    /// Residual force over its reference.
    pub residual: f64,
    /// Largest violation of a contact condition on the gap [mm].
    pub gap: f64,
    /// Deepest node in a tool [mm]; with a spring between them that is not the violation.
    pub penetration: f64,
    /// Norm of the displacement correction that led here [mm].
    pub correction: f64,
    /// Nodes in contact.
    pub contacts: usize,
    /// Nodes in contact that slip.
    pub slipping: usize,
    /// Nodes in contact that stick, as friction without a transition has it.
    pub stuck: usize,
    /// Contact states that changed since the iteration before (touch or part).
    pub changes: usize,
}

/// Order of convergence shown by the last iterations of an increment: of the last three residuals in a row that
/// follow no change of contact states (touch or part, stick or slip), lie below a hundredth of the contact forces and
/// above rounding, and fall. `None` when an increment has no such three.
#[must_use]
pub fn convergence_order(history: &[IterationRecord]) -> Option<f64> {
    /// Below it corrections are taken whole.
    const BASIN: f64 = crate::solver::newton::newton::NEAR;
    const ROUNDING: f64 = 1e-9;
    const LEAST: f64 = 2.3;
    let settled = |w: &[IterationRecord]| {
        let states = |r: &IterationRecord| [r.contacts, r.slipping, r.stuck];
        w.iter().all(|r| r.changes == 0 && states(r) == states(&w[0]))
            && w[0].residual < BASIN
            && w[2].residual > ROUNDING
    };
    // The first correction is made with what is foreseen, not with the tangent of where it begins.
    let last = history.get(1..)?.windows(3).rev().find(|w| settled(w))?;
    let fall = |k: usize| (last[k].residual / last[k + 1].residual).ln();
    // A fall by less than ten is no step of an iteration near its end, and says nothing of the next.
    (fall(0) > LEAST && fall(1) > 0.0).then(|| fall(1) / fall(0))
}

/// A tool at the end of an increment.
#[derive(Debug, Clone, PartialEq)]
pub struct ToolReport {
    /// Name.
    pub name: String,
    /// Travel along its direction since the start [mm].
    pub travel: f64,
    /// Force of the tool on the sheet along its direction [N], of the whole process; of one that is let go what it has left
    /// behind of it.
    pub force: f64,
    /// The same as a vector, of the modelled part only [N].
    pub force_vector: [f64; 3],
    /// Shift of the tool file's frame in the world [mm].
    pub shift: [f64; 3],
    /// Nodes in contact with it.
    pub contacts: usize,
}

/// What the observer of a run sees after every converged increment (and once before the first).
#[derive(Debug, Clone)]
pub struct IncrementReport<'a> {
    /// Number, from 1; 0 is the start.
    pub increment: usize,
    /// Index of the stage.
    pub stage: usize,
    /// Its name.
    pub stage_name: &'a str,
    /// Time since the start [s].
    pub time: f64,
    /// Share of the stage done.
    pub share: f64,
    /// No tool holds the sheet in this stage, or all that do are being let go.
    pub free: bool,
    /// Every tool, in order.
    pub tools: Vec<ToolReport>,
    /// Newton iterations of this increment (linear solves).
    pub iterations: usize,
    /// Newton iterations since the start, failed attempts included.
    pub iterations_total: usize,
    /// Increments cut since the start.
    pub cuts: usize,
    /// Times the sheet has moved on by itself since the start.
    pub snaps: usize,
    /// Increments so far in which contact states came round in a circle and dampers led to a balance.
    pub steadied: usize,
    /// Increments so far that ended in a balance that does not last.
    pub unstable: usize,
    /// Times so far that the sheet was pushed out of a balance that does not last, and came to one that does.
    pub buckles: usize,
    /// Residual history of this increment.
    pub history: &'a [IterationRecord],
    /// Work and energy.
    pub energies: Energies,
    /// Work over the size of the sheet of a force that is nothing but rounding [N mm].
    pub rounding_work: f64,
    /// Volume that does not balance, as a share of the sheet's ([`crate::solver::assembly::Body::volume_balance`]); `None` where
    /// the material keeps no strains.
    pub volume_balance: Option<f64>,
    /// Where the sheet bends over the free border of a tool.
    pub over_edge: Option<OverEdge>,
    /// The deepest penetration of a tool into a face of the sheet, between its nodes.
    pub face_penetration: Option<FacePenetration>,
    /// Nodes in contact.
    pub contacts: usize,
    /// Nodes in contact that slip.
    pub slipping: usize,
    /// Wall time by phase since the start.
    pub timings: Timings,
    /// The sheet, its history committed.
    pub body: &'a Body,
    /// Displacements, three a node [mm].
    pub displacements: &'a [f64],
    /// Contact forces on the nodes, three a node [N].
    pub contact_forces: &'a [f64],
}

impl IncrementReport<'_> {
    /// Whether the stage ends with it.
    #[must_use]
    pub fn ends_stage(&self) -> bool {
        self.share >= 1.0 - 1e-12
    }
}

/// Totals of a finished run.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct RunSummary {
    /// Converged increments.
    pub increments: usize,
    /// Newton iterations, failed attempts included.
    pub iterations: usize,
    /// Increments cut.
    pub cuts: usize,
    /// Times the sheet was followed to a balance that is not near the last one: a snap, or its release where no balance lasted.
    #[serde(default)]
    pub snaps: usize,
    /// Increments in which contact states came round in a circle and dampers, taken away again, led to a balance.
    #[serde(default)]
    pub steadied: usize,
    /// Increments that ended in a balance that does not last: the sheet would buckle, given a push.
    #[serde(default)]
    pub unstable: usize,
    /// Times the sheet was pushed out of a balance that does not last, and came to one that does.
    #[serde(default)]
    pub buckles: usize,
    /// Wall time by phase [s].
    pub timings: Timings,
}

impl RunSummary {
    /// Whether its counts can be those of a run.
    pub(in crate::solver) fn is_sound(&self) -> bool {
        let times = &self.timings;
        [
            [self.increments, self.iterations, self.cuts, self.snaps, self.steadied],
            [self.unstable, self.buckles, times.factorisations, times.updates, times.cycling],
        ]
        .iter()
        .flatten()
        .all(|&count| count <= COUNT_MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn history(residuals: &[f64]) -> Vec<IterationRecord> {
        let record = |&residual: &f64| IterationRecord {
            residual,
            gap: 0.0,
            penetration: 0.0,
            correction: 0.0,
            contacts: 10,
            slipping: 2,
            stuck: 0,
            changes: 0,
        };
        residuals.iter().map(record).collect()
    }

    #[test]
    fn the_order_is_of_newton_steps_near_their_end() {
        let order = |residuals: &[f64]| convergence_order(&history(residuals));
        assert!((order(&[0.05, 9e-3, 8.1e-5, 6.561e-9]).unwrap() - 2.0).abs() < 1e-12);
        // An elastic increment: the first correction is made with what is foreseen, and one more ends it.
        assert_eq!(order(&[1.2e-3, 1.3e-4, 4.6e-9]), None);
        // A fall by less than ten on the way.
        assert_eq!(order(&[0.9, 0.09, 0.08, 1e-6]), None);
    }
}
