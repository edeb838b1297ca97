//! Report of an increment, and totals of a run.

use serde::{Deserialize, Serialize};

use crate::active_set::over_edge::OverEdge;
use crate::assembly::{Body, WorkError};
use crate::contact::face_penetration::FacePenetration;
use crate::newton::record::IterationRecord;
use crate::system::timings::Timings;
use kanagata_geometry::numbers::COUNT_MAX;

/// Depth over the thickness above which overhangs and nodes inside a tool are reported; less changes forces by less than
/// the mesh does.
pub const REPORTED_DEPTH_REL: f64 = 0.1;

/// Work since the start of the run [mJ], of the complete process.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Energies {
    /// Work of the tools on the sheet (normal and tangential contact forces over the displacement of the nodes).
    pub external: f64,
    /// Work of the internal forces.
    pub internal: f64,
    /// Current elastic energy.
    pub elastic: f64,
    /// Plastic work: dissipated, or stored by hardening.
    pub plastic: f64,
    /// Artificial (hourglass) energy of the stabilisation; it has no physical counterpart.
    #[serde(default)]
    pub artificial: f64,
    /// Frictional work between sheet and tools.
    pub friction: f64,
    /// Released elastic energy of snap-throughs; heat when the sheet is at rest.
    #[serde(default)]
    pub released_elastic: f64,
    /// Part of the external work done by the forces of released tools; the sheet does work against them during
    /// springback.
    #[serde(default)]
    pub released_forces: f64,
    /// Maximum of the external or internal work over all increments.
    #[serde(default)]
    pub largest_work: f64,
    /// Sum over the increments of the work that they lack because of their length, and of all work; both estimated.
    #[serde(default)]
    pub increment_errors: WorkError,
}

impl Energies {
    /// Work that is not accounted for.
    #[must_use]
    pub fn imbalance(&self) -> f64 {
        self.external - self.internal - self.friction - self.released_elastic
    }

    /// Work of the internal forces that is stored or dissipated.
    #[must_use]
    pub fn stored(&self) -> f64 {
        self.elastic + self.plastic + self.artificial
    }
}

/// State of a tool at the end of an increment.
#[derive(Debug, Clone, PartialEq)]
pub struct ToolReport {
    /// Name of the tool.
    pub name: String,
    /// Travel along the direction since the start [mm].
    pub travel: f64,
    /// Force of the tool on the sheet along its direction [N], of the complete process; for a released tool the
    /// remaining force.
    pub force: f64,
    /// Force vector, of the modelled part only [N].
    pub force_vector: [f64; 3],
    /// Shift of the frame of the tool file in the world [mm].
    pub shift: [f64; 3],
    /// Number of nodes in contact with the tool.
    pub contacts: usize,
}

/// A node in contact.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NodeContact {
    /// The node.
    pub node: usize,
    /// Index of the tool.
    pub tool: usize,
    /// Whether the node slips: it is counted in [`IncrementReport::slipping`].
    pub slips: bool,
    /// Force of the tool along its normal, positive in compression [N].
    pub normal_force: f64,
}

/// Report to the observer of a run after every converged increment (and once before the first).
#[derive(Debug, Clone)]
pub struct IncrementReport<'a> {
    /// Number of the increment, from 1; 0 is the start.
    pub increment: usize,
    /// Index of the stage.
    pub stage: usize,
    /// Name of the stage.
    pub stage_name: &'a str,
    /// Time since the start [s].
    pub time: f64,
    /// Completed fraction of the stage.
    pub share: f64,
    /// No tool holds the sheet in this stage, or all that do are being released.
    pub free: bool,
    /// All tools, in order.
    pub tools: Vec<ToolReport>,
    /// Newton iterations of this increment (linear solves).
    pub iterations: usize,
    /// Newton iterations since the start, including failed attempts.
    pub iterations_total: usize,
    /// Step cuts since the start.
    pub cuts: usize,
    /// Snap-throughs since the start.
    pub snap_throughs: usize,
    /// Increments that needed viscous stabilisation (active-set cycling) since the start.
    pub stabilised: usize,
    /// Increments that ended in an unstable equilibrium since the start.
    pub unstable: usize,
    /// Perturbations that led from an unstable to a stable equilibrium since the start.
    pub buckles: usize,
    /// Residual history of this increment.
    pub history: &'a [IterationRecord],
    /// Work and energy.
    pub energies: Energies,
    /// Work of a force at the level of rounding over the size of the sheet [N mm].
    pub rounding_work: f64,
    /// Volume error as a fraction of the volume of the sheet ([`crate::assembly::Body::volume_balance`]);
    /// `None` if the material stores no strains.
    pub volume_balance: Option<f64>,
    /// Overhang of the sheet over the free border of a tool.
    pub over_edge: Option<OverEdge>,
    /// Deepest penetration of a tool into a face of the sheet, between its nodes.
    pub face_penetration: Option<FacePenetration>,
    /// Largest depth of tools in the faces of each element, between its nodes [mm].
    pub face_depths: &'a [f64],
    /// Nodes in contact.
    pub contacts: usize,
    /// Nodes in contact that slip.
    pub slipping: usize,
    /// Wall time by phase since the start.
    pub timings: Timings,
    /// The sheet with its committed history.
    pub body: &'a Body,
    /// Displacements, three a node [mm].
    pub displacements: &'a [f64],
    /// Contact forces on the nodes, three a node [N].
    pub contact_forces: &'a [f64],
    /// The nodes in contact, in ascending order.
    pub node_contacts: &'a [NodeContact],
}

impl IncrementReport<'_> {
    /// Whether the increment ends its stage.
    #[must_use]
    pub fn ends_stage(&self) -> bool {
        self.share >= 1.0 - 1e-12
    }
}

/// Totals of a run.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct RunSummary {
    /// Converged increments.
    pub increments: usize,
    /// Newton iterations, including failed attempts.
    pub iterations: usize,
    /// Step cuts.
    pub cuts: usize,
    /// Snap-throughs: the sheet was followed to a distant equilibrium, also on release without a stable one.
    #[serde(default)]
    pub snap_throughs: usize,
    /// Increments that needed viscous stabilisation (active-set cycling), removed before they were accepted.
    #[serde(default)]
    pub stabilised: usize,
    /// Increments that ended in an unstable equilibrium: the sheet buckles under a perturbation.
    #[serde(default)]
    pub unstable: usize,
    /// Perturbations that led from an unstable to a stable equilibrium.
    #[serde(default)]
    pub buckles: usize,
    /// Wall time by phase [s].
    pub timings: Timings,
}

impl RunSummary {
    /// Whether the counts are those of a valid run.
    pub(crate) fn is_sound(&self) -> bool {
        let times = &self.timings;
        [
            [self.increments, self.iterations, self.cuts, self.snap_throughs, self.stabilised],
            [self.unstable, self.buckles, times.factorisations, times.updates, times.cycling],
        ]
        .iter()
        .flatten()
        .all(|&count| count <= COUNT_MAX)
    }
}

/// Request of the observer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Control {
    /// Continue.
    Continue,
    /// Stop after this increment.
    Stop,
}
