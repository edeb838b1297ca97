//! What an increment reports, and what a run adds up to.

use serde::{Deserialize, Serialize};

use crate::geometry::numbers::COUNT_MAX;
use crate::solver::active_set::over_edge::OverEdge;
use crate::solver::assembly::Body;
use crate::solver::contact::face_penetration::FacePenetration;
use crate::solver::newton::record::IterationRecord;
use crate::solver::system::timings::Timings;

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
    pub stabilised: usize,
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
    pub stabilised: usize,
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
            [self.increments, self.iterations, self.cuts, self.snaps, self.stabilised],
            [self.unstable, self.buckles, times.factorisations, times.updates, times.cycling],
        ]
        .iter()
        .flatten()
        .all(|&count| count <= COUNT_MAX)
    }
}

/// What the observer wants.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Control {
    /// Go on.
    Continue,
    /// Stop after this increment.
    Stop,
}
