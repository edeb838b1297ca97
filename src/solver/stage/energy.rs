//! Work of an increment by the trapezoidal rule, and the part that the sheet does not store.

use super::increment_error::increment_error;
use super::plan::Plan;
use super::state::{Committed, Simulation};
use crate::contact::candidate::Force;
use crate::system::system::System;
use kanagata_contact::friction::COULOMB_SLIP_RATIO;
use kanagata_geometry::Vec3;

/// Internal work that the sheet has not stored, over the largest work so far, above which an increment contains a jump
/// to another equilibrium. A smaller ratio would take the error of the trapezoidal rule for jumps, a larger one would
/// miss those of a small part of the sheet.
const JUMP_WORK_REL: f64 = 0.01;

/// Slip over the friction transition above which a node slides throughout an increment: ten times the slip at which
/// friction reaches Coulomb's force. Up to there friction rises over a tenth of the increment; for less slip the
/// trapezoidal rule is closer.
const SLIDING_SLIP_RATIO: f64 = 10.0 * COULOMB_SLIP_RATIO;

/// Work of contact in an increment.
#[derive(Default)]
struct ContactWork {
    /// Work of friction on the sheet.
    friction: f64,
    /// Work of normal forces over the gap of nodes that come into contact or separate. No force acts over the gap,
    /// but the trapezoidal rule includes this work.
    over_gaps: f64,
    /// Correction of the frictional work of sliding nodes. Friction opposes the slip throughout the increment, by
    /// Coulomb's law with the mean normal force, whatever its direction at the start.
    turned: f64,
}

impl ContactWork {
    fn of(sys: &System, old: &Committed, forces: &[Force]) -> Self {
        let mut sum = Self::default();
        let ends = sys.contact.before().zip(forces);
        for (c, ((touched, before), now)) in sys.contact.candidates.iter().zip(ends) {
            if !touched && !c.active {
                continue;
            }
            // If a tool is removed at once, its force at the start is that of the end.
            let before = if touched && old.dropped { *now } else { before };
            let tool = &sys.tools[c.tool];
            let place = sys.position(c.node) - tool.shift();
            let u = Vec3::from_column_slice(&old.u[3 * c.node..3 * c.node + 3]);
            let moved = tool.setup.direction * (tool.travel - old.travels[c.tool]);
            let way = sys.displacement(c.node) - u - moved;
            let slip = if touched { place - c.start } else { way };
            let friction = 0.5 * (before.tangential() + now.tangential()).dot(&slip);
            sum.friction += friction;
            let along = tangential(&before, now, &slip);
            if along > SLIDING_SLIP_RATIO * sys.lengths.transition {
                let mean = 0.5 * (before.normal().norm() + now.normal().norm());
                sum.turned -= along * sys.law(c.tool).mu * mean + friction;
            }
            // A returning tool may find a node inside it: this is a gap too.
            let closer = if touched == c.active { c.start - (place - way) } else { way };
            sum.over_gaps += 0.5 * (before.normal() + now.normal()).dot(&closer);
        }
        sum.friction += sum.turned;
        sum
    }
}

/// Tangential part of a slip; the normal is that of the forces at both ends, or at one.
fn tangential(before: &Force, now: &Force, slip: &Vec3) -> f64 {
    let normal = (before.normal() + now.normal()).try_normalize(0.0).unwrap_or_default();
    (slip - normal * normal.dot(slip)).norm()
}

/// Work of an increment, of the complete process [N mm].
struct Work {
    external: f64,
    friction: f64,
    /// Work of the element forces by the trapezoidal rule, and with the constant forces of either end.
    internal: f64,
    by_ends: [f64; 2],
    /// Work stored or dissipated by plastic flow in the elements.
    stored: f64,
}

impl Work {
    /// Work of the increment (trapezoidal rule) before it is committed; `forces` are the current forces of the tools
    /// on the nodes.
    fn of(sim: &Simulation, forces: &[Force]) -> Self {
        let (sys, old) = (&sim.sys, &sim.committed);
        let (mut begin, mut end, mut applied) = (0.0, 0.0, 0.0);
        for i in 0..sys.u.len() {
            let du = sys.u[i] - old.u[i];
            begin += old.internal_force[i] * du;
            end += sys.eval.internal_force[i] * du;
            applied += 0.5 * (sys.applied[i] + old.applied[i]) * du;
        }
        let ContactWork { friction, over_gaps, turned } = ContactWork::of(sys, old, forces);
        let pushed: f64 = (0..sys.tools.len())
            .map(|t| {
                let (moved, now) = (sys.tools[t].travel - old.travels[t], sys.push_of(t));
                0.5 * (now + if old.dropped { now } else { old.pushes[t] }) * moved
            })
            .sum();
        let whole = sim.share;
        let eval = &sys.eval;
        let stored = whole * (eval.elastic_energy + eval.plastic_work + eval.artificial_work);
        Self {
            external: whole * (pushed + applied + over_gaps - turned),
            friction: -whole * friction,
            internal: whole * 0.5 * (begin + end),
            by_ends: [begin, end].map(|work| whole * work),
            stored: stored - sim.energies.stored(),
        }
    }

    /// Energy released if the increment does not start in equilibrium because a tool that pushed the sheet was
    /// removed. The trapezoidal rule would let its force decrease over the whole springback.
    fn set_free(&self) -> f64 {
        self.external - self.friction - self.stored
    }

    /// Internal work that the sheet has not stored, if it indicates a jump to another equilibrium. It must exceed a
    /// fraction of the largest work `done`, and the error due to forces that vary monotonically between both ends.
    fn jump(&self, done: f64) -> Option<f64> {
        let lost = self.internal - self.stored;
        let [begin, end] = self.by_ends;
        let least = JUMP_WORK_REL * done.max(self.external.abs()).max(self.internal.abs());
        (lost > least + 0.5 * (end - begin).abs()).then_some(lost)
    }
}

/// Work in an increment of the forces left by released tools, of the complete process [N mm].
pub(crate) fn released_forces_work(
    sim: &Simulation,
    plan: &Plan,
    [share, target]: [f64; 2],
) -> f64 {
    let moved = sim.sys.u.iter().zip(&sim.committed.u).map(|(now, before)| now - before);
    let work: f64 = plan.released.iter().zip(moved).map(|(force, moved)| force * moved).sum();
    sim.share * work * 0.5 * (plan.remaining(share) + plan.remaining(target))
}

/// Whether the sheet has jumped to another equilibrium in the increment, which is not yet accepted.
pub(crate) fn jumps(sim: &Simulation) -> bool {
    let work = Work::of(sim, &sim.sys.candidate_forces());
    work.internal > sim.rounding_work() && work.jump(sim.energies.largest_work).is_some()
}

/// Adds the work of the increment before it is committed; returns whether a snap-through occurred.
pub(crate) fn add_work(sim: &mut Simulation, forces: &[Force]) -> bool {
    let (work, error) = (Work::of(sim, forces), increment_error(sim, forces));
    let dropped = sim.committed.dropped;
    let jump = if dropped { Some(work.set_free()) } else { work.jump(sim.energies.largest_work) };
    let jump = jump.filter(|lost| *lost > sim.rounding_work());
    let (e, whole) = (&mut sim.energies, sim.share);
    e.internal += if dropped { work.stored } else { work.internal - jump.unwrap_or(0.0) };
    e.released_elastic += jump.unwrap_or(0.0);
    e.friction += work.friction;
    e.increment_errors = e.increment_errors.plus(error);
    e.external += work.external;
    e.elastic = whole * sim.sys.eval.elastic_energy;
    e.plastic = whole * sim.sys.eval.plastic_work;
    e.artificial = whole * sim.sys.eval.artificial_work;
    e.largest_work = e.largest_work.max(e.external.abs()).max(e.internal.abs());
    jump.is_some()
}
