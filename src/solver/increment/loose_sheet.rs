//! Motion of an unconstrained sheet.
//!
//! A sheet without constraints and loads is carried by tools against which it has no resistance: tipped over an edge,
//! lifted, pushed aside. Equilibrium does not determine its position, and friction has no normal force. The sheet
//! moves by the smallest motion that removes penetration: the equilibrium with light dampers about the last one,
//! without friction.
//!
//! Between two tools this motion may be large where friction would hold the sheet. Friction then acts with the
//! damping forces (its law has no scale). The dampers bend the sheet slightly and are therefore reset at its new
//! position until they carry nothing: the accepted equilibrium contains none. A sheet that is pressed, with forces
//! far above those of the dampers, is treated as any other from the last equilibrium.

use crate::contact::candidate::{Candidate, Force};
use crate::element::Want;
use crate::newton::outcome::{NewtonError, NewtonStats, Patience};
use crate::newton::solve::solve;
use crate::numbers::tolerances::ROUNDING_REL;
use crate::sheet::rigid_motions::unsupported;
use crate::stage::state::Simulation;
use crate::system::damper::Damper;
use crate::system::regime::Stabilisation;
use crate::system::system::System;
use crate::tools::role::Role;

/// Damper stiffness of a node over the stiffness of the mesh: forces are above rounding, and the bending of the sheet
/// is negligible.
const LIGHT_STIFFNESS: f64 = 1e-9;

/// Maximum number of damped equilibria, after which the sheet is taken to be pressed.
const MAX_PASSES: usize = 8;

/// Force of the tools over that of the dampers above which the tools press the sheet; the ratio exceeds that of any
/// lever.
const PRESSED_FORCE_RATIO: f64 = 30.0;

/// Displacement of a node over that of the tools above which the motion is large.
const FAR_TRAVEL_RATIO: f64 = 5.0;

/// Result of the motion of an unconstrained sheet.
pub(crate) enum Way {
    /// Equilibrium at the position to which the tools have moved the sheet.
    Carried(NewtonStats),
    /// The tools press the sheet.
    Pressed,
    /// No tool moves the sheet.
    Unmoved,
    /// The sheet slides far from its last position, and no equilibrium with friction was found.
    Astray(NewtonError),
}

impl System {
    /// Whether the sheet is unconstrained and loaded only by tools with prescribed travel.
    pub(crate) fn is_loose(&self) -> bool {
        let pushes = |role: &Role| !matches!(role, Role::Absent | Role::Travel);
        let by_tools = self.has_tools() && !self.roles.iter().any(pushes);
        if self.regime.is_stabilised() || !self.is_without_loads() || !by_tools {
            return false;
        }
        !unsupported(&self.constraints, &self.positions(), std::iter::empty()).is_empty()
    }

    /// Whether no tool pushed the sheet at the last equilibrium.
    pub(crate) fn was_idle(&self) -> bool {
        let rests = |force: Force| self.scales.of_note(force.normal().norm()) == 0.0;
        self.contact.before().all(|(_, force)| rests(force))
    }

    /// Forces due to rounding of nodal positions [N].
    pub(crate) fn rounding_of_forces(&self) -> f64 {
        8.0 * f64::EPSILON * self.lengths.farthest * self.scales.normal
    }

    /// Whether no tool pushes the sheet by more than rounding.
    pub(crate) fn is_idle(&self) -> bool {
        self.contact.active().all(|(k, _)| self.scales.of_note(self.lambda(k)) <= 0.0)
    }

    /// Whether more than one tool is in contact with the sheet or penetrates it. Requires an up-to-date contact
    /// search.
    fn is_between_tools(&self) -> bool {
        let touches = |tool: usize| {
            let inside = |k: usize, c: &Candidate| c.foot.gap < 0.0 && self.can_touch(k);
            let mut all = self.contact.candidates.iter().enumerate();
            all.any(|(k, c)| c.tool == tool && (c.active || inside(k, c)))
        };
        (0..self.tools.len()).filter(|&tool| touches(tool)).count() > 1
    }

    /// Whether a tool penetrates the sheet or has separated from nodes in contact. Requires an up-to-date contact
    /// search.
    fn is_met(&self) -> bool {
        let near = ROUNDING_REL * self.lengths.shortest_edge;
        self.contact.candidates.iter().enumerate().any(|(k, c)| {
            let off = if c.active { c.foot.gap.abs() } else { -c.foot.gap };
            off > near && (c.active || self.can_touch(k))
        })
    }
}

/// Moves an unconstrained sheet from the last equilibrium to the position given by its tools, which are already set.
/// Friction acts only if the motion is large, between two tools, and if an equilibrium with friction is found.
/// `again` restores the state on entry. The final state is an equilibrium for [`Way::Carried`] and must be restored
/// otherwise.
pub(crate) fn carry(
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
        // A shorter step may converge with friction.
        Err(error) if patience == Patience::Hopeful => Ok(Way::Astray(error)),
        Err(_) => {
            again(sim);
            along(sim, false)
        }
    }
}

/// Repositions an unconstrained sheet that loses its last contact force in an increment, independent of the iterates.
/// It is moved to the position closest to the last one, then out of the path of its tools. `None` if
/// no equilibrium is found; the state on entry is then restored.
pub(crate) fn reposition(sim: &mut Simulation) -> Result<Option<NewtonStats>, NewtonError> {
    let sys = &mut sim.sys;
    let (u, contact) = (sys.u.clone(), sys.contact.clone());
    sys.move_closest_to(&sim.committed.u);
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

/// Whether a node has moved by far more than any tool since the last equilibrium.
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

/// Repeats the damped equilibrium, with dampers about the last one, until they carry nothing.
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

/// Computes the equilibrium with dampers about the current position and removes their forces; returns the sum of
/// their absolute values [N].
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
