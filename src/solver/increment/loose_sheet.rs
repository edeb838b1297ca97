//! A sheet that nothing holds and nothing pushes, carried along by tools that it does not resist: tipped over an edge, lifted,
//! pushed aside. No force says how it moves, and friction has none to go by. Of all motions that bring it out of its tools'
//! way it makes the least: the one that light dampers about the last balance lead to, without friction. Between two tools that
//! may be far, where they shut in what friction would hold: then friction goes by the dampers' forces (its law has no scale).
//! They bend it a little, so they are set anew where it is until they carry nothing: what is accepted is a balance without them.
//! A sheet that is pressed, which pushes back by far more than the dampers, goes its way from the last balance as any other.

use crate::geometry::Vec3;
use crate::solver::contact::candidate::{Candidate, Force};
use crate::solver::element::Want;
use crate::solver::newton::outcome::{NewtonError, NewtonStats, Patience};
use crate::solver::newton::solve::solve;
use crate::solver::sheet::rigid_motions::{nearest_free, unsupported};
use crate::solver::stage::state::Simulation;
use crate::solver::system::damper::Damper;
use crate::solver::system::regime::Stabilisation;
use crate::solver::system::system::System;
use crate::solver::tools::role::Role;

/// Stiffness of a node's damper over the mesh's: enough to tell its forces from rounding, and too little to bend the sheet.
const LIGHT_STIFFNESS: f64 = 1e-9;

/// Balances with dampers before the sheet is taken to be pressed.
const MAX_PASSES: usize = 8;

/// Force of the tools over that of the dampers at which they press the sheet: levers are shorter.
const PRESSED_FORCE_RATIO: f64 = 30.0;

/// Gap of a touching node that its tool has not left, and depth of one that no tool has come to, over the shortest edge.
const TOUCHING_GAP_REL: f64 = 1e-9;

/// Way of a node over that of the tools that is far.
const FAR_TRAVEL_RATIO: f64 = 5.0;

/// What has become of a sheet that nothing held or pushed.
pub(in crate::solver) enum Way {
    /// It is in balance where its tools have taken it.
    Carried(NewtonStats),
    /// Its tools press it.
    Pressed,
    /// They leave it alone.
    Unmoved,
    /// It glides off far from its last place, and no balance with friction has been found.
    Astray(NewtonError),
}

impl System {
    /// Whether nothing holds the sheet or pushes it now but tools by their travel.
    pub(in crate::solver) fn is_loose(&self) -> bool {
        let pushes = |role: &Role| !matches!(role, Role::Absent | Role::Travel);
        if self.regime.is_stabilised() || !self.is_without_loads() || self.roles.iter().any(pushes)
        {
            return false;
        }
        !unsupported(&self.constraints, &self.positions(), std::iter::empty()).is_empty()
    }

    /// Whether no tool pushed the sheet at the last balance.
    pub(in crate::solver) fn was_idle(&self) -> bool {
        let rests = |force: Force| self.scales.of_note(force.normal().norm()) == 0.0;
        self.contact.before().all(|(_, force)| rests(force))
    }

    /// What rounding of the nodes' places makes of their forces [N].
    pub(in crate::solver) fn rounding_of_forces(&self) -> f64 {
        8.0 * f64::EPSILON * self.lengths.farthest * self.scales.normal
    }

    /// Whether no tool pushes the sheet by more than rounding.
    pub(in crate::solver) fn is_idle(&self) -> bool {
        self.contact.active().all(|(k, _)| self.scales.of_note(self.lambda(k)) <= 0.0)
    }

    /// Whether more than one tool touches the sheet or has moved into it. To be called after the search.
    fn is_between_tools(&self) -> bool {
        let touches = |tool: usize| {
            let inside = |k: usize, c: &Candidate| c.foot.gap < 0.0 && self.can_touch(k);
            let mut all = self.contact.candidates.iter().enumerate();
            all.any(|(k, c)| c.tool == tool && (c.active || inside(k, c)))
        };
        (0..self.tools.len()).filter(|&tool| touches(tool)).count() > 1
    }

    /// Whether a tool has moved into the sheet, or away from nodes that touch it. To be called after the search.
    fn is_met(&self) -> bool {
        let near = TOUCHING_GAP_REL * self.lengths.shortest_edge;
        self.contact.candidates.iter().enumerate().any(|(k, c)| {
            let off = if c.active { c.foot.gap.abs() } else { -c.foot.gap };
            off > near && (c.active || self.can_touch(k))
        })
    }
}

/// Goes from the last balance of a loose sheet, whose tools are set, to where they take it: without friction, or with it if that
/// is far and between two tools and finds a balance. `again` goes back to where it began. What is left behind is a balance
/// where it is [`Way::Carried`], and to be restored otherwise.
pub(in crate::solver) fn carry(
    sim: &mut Simulation,
    patience: Patience,
    again: &mut dyn FnMut(&mut Simulation),
) -> Result<Way, NewtonError> {
    sim.sys.search();
    if !sim.sys.is_met() {
        return Ok(Way::Unmoved);
    }
    if !sim.sys.is_between_tools() {
        return along(sim, false);
    }
    let gliding = along(sim, false);
    if !matches!(gliding, Ok(Way::Carried(_))) || !glides_off(sim) {
        return gliding;
    }
    again(sim);
    match along(sim, true) {
        Ok(way) => Ok(way),
        // A shorter step may do with friction.
        Err(error) if patience == Patience::Hopeful => Ok(Way::Astray(error)),
        Err(_) => {
            again(sim);
            along(sim, false)
        }
    }
}

/// Where a balance leaves a loose sheet that its tools held until then without a force, wherever the iteration has thrown it:
/// lays it where it comes nearest to where it was, out of its tools' way. `None` if that leads to no balance; the sheet is
/// where it was found then.
pub(in crate::solver) fn lay(sim: &mut Simulation) -> Result<Option<NewtonStats>, NewtonError> {
    let sys = &mut sim.sys;
    let (u, contact) = (sys.u.clone(), sys.contact.clone());
    let now = sys.positions();
    let then: Vec<Vec3> = (0..now.len())
        .map(|n| {
            now[n] - sys.displacement(n)
                + Vec3::from_column_slice(&sim.committed.u[3 * n..3 * n + 3])
        })
        .collect();
    let (turn, shift) = nearest_free(&sys.constraints, &now, &then);
    for (node, x) in now.iter().enumerate() {
        let moved = sys.displacement(node) + (turn * x + shift - x);
        sys.u[3 * node..3 * node + 3].copy_from_slice(moved.as_slice());
    }
    if let Ok(Way::Carried(stats)) = along(sim, false) {
        return Ok(Some(stats));
    }
    let sys = &mut sim.sys;
    (sys.u, sys.contact) = (u, contact);
    sys.evaluate(Want::ResidualAndTangent)?;
    sys.search();
    sys.assemble();
    Ok(None)
}

/// Whether a node has moved by far more than any tool since the last balance.
fn glides_off(sim: &Simulation) -> bool {
    let (sys, old) = (&sim.sys, &sim.committed);
    let largest = |now: &mut dyn Iterator<Item = f64>, before: &[f64]| {
        now.zip(before).fold(0.0, |most: f64, (now, before)| most.max((now - before).abs()))
    };
    let tools = largest(&mut sys.tools.iter().map(|tool| tool.travel), &old.travels);
    largest(&mut sys.u.iter().copied(), &old.u) > FAR_TRAVEL_RATIO * tools
}

fn along(sim: &mut Simulation, friction: bool) -> Result<Way, NewtonError> {
    let found = let_lie(sim, friction);
    sim.sys.regime.release();
    found
}

/// Finds the balance with dampers, and from there those with dampers about the last, until they carry nothing.
fn let_lie(sim: &mut Simulation, friction: bool) -> Result<Way, NewtonError> {
    let mut stats = NewtonStats::default();
    for _ in 0..MAX_PASSES {
        let (now, carries) = damped(sim, friction)?;
        stats = stats.and(now);
        let sys = &sim.sys;
        if sys.is_idle() {
            return Ok(Way::Carried(stats));
        }
        let pushes: f64 = sys.contact.active().map(|(_, c)| sys.contact_force(c).norm()).sum();
        if pushes > PRESSED_FORCE_RATIO * carries {
            break;
        }
    }
    Ok(Way::Pressed)
}

/// Goes to the balance with dampers about the present place, and takes their forces away; the sum of these [N].
fn damped(sim: &mut Simulation, friction: bool) -> Result<(NewtonStats, f64), NewtonError> {
    let sys = &mut sim.sys;
    let stiffness = LIGHT_STIFFNESS * sys.scales.tangential;
    let damper = Damper::new(&sys.body, &sys.u, stiffness);
    sys.regime.stabilisation = Stabilisation::LooseSheet { damper: damper.clone(), friction };
    let patience = Patience::UpTo(sim.limits.iterations);
    let stats = solve(sys, &sim.limits, patience, None, &mut sim.history)?;
    let forces: Vec<f64> = damper.forces(&sys.u).collect();
    sys.eval.internal_force.iter_mut().zip(&forces).for_each(|(all, own)| *all -= own);
    Ok((stats, forces.iter().map(|f| f.abs()).sum()))
}
