//! Increments of a stage: predict, solve, accept or cut and restore, choose the next step.

use super::active_set::{keep_pushed_tools, take_in};
use super::constraints::Constraints;
use super::newton::{NewtonError, NewtonStats, Patience, solve};
use super::pace::Pace;
use super::relaxation::relax;
use super::rigid::hold_rigid_modes;
use super::simulation::{Control, Simulation, SimulationError};
use super::stages::{IncrementReport, Stage};
use super::system::{Role, System};
use super::tools::Motion;
use crate::geometry::Vec3;

use serde::{Deserialize, Serialize};

/// The last converged state, and the increment before it for the predictor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Committed {
    pub(super) u: Vec<f64>,
    travels: Vec<f64>,
    internal_force: Vec<f64>,
    applied: Vec<f64>,
    /// Force of each tool along its direction [N].
    pushes: Vec<f64>,
    /// Step (share of the stage), displacements and travels of the last increment of this stage.
    pub(super) last: Option<(f64, Vec<f64>, Vec<f64>)>,
}

impl Committed {
    pub(super) fn of(sys: &System) -> Self {
        Self {
            u: sys.u.clone(),
            travels: sys.tools.iter().map(|t| t.travel).collect(),
            internal_force: sys.eval.internal_force.clone(),
            applied: sys.applied.clone(),
            pushes: (0..sys.tools.len()).map(|t| pushing_force(sys, t)).collect(),
            last: None,
        }
    }
}

impl Committed {
    /// Whether it is of a system with so many tools and unknowns.
    pub(super) fn fits(&self, tools: usize, unknowns: usize) -> bool {
        let of_tools = |v: &Vec<f64>| v.len() == tools;
        let of_nodes = |v: &Vec<f64>| v.len() == unknowns;
        [&self.travels, &self.pushes].into_iter().all(of_tools)
            && [&self.u, &self.internal_force, &self.applied].into_iter().all(of_nodes)
            && self.last.as_ref().is_none_or(|(_, u, t)| of_nodes(u) && of_tools(t))
    }
}

/// Force of a tool on the modelled part along its direction [N].
fn pushing_force(sys: &System, tool: usize) -> f64 {
    sys.tool_force(tool).dot(&sys.tools[tool].setup.direction)
}

/// Steps shorter than this share of a stage's first one are taken for the approach to a limit point, and the next
/// balance is sought this share of the first step beyond it.
const SNAPS: f64 = 0.02;
const BEYOND: f64 = 0.1;

/// What a stage fixes when it begins.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Plan {
    stage: usize,
    start_travels: Vec<f64>,
    /// Contact forces of the tools being taken away (three a node).
    released: Vec<f64>,
}

/// A stage under way.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct UnderWay {
    plan: Plan,
    pace: Pace,
    /// Share of the stage done.
    share: f64,
    start_time: f64,
}

/// Makes one increment, beginning the next stage where one has ended; false when all stages are done.
pub(super) fn advance(
    sim: &mut Simulation,
    observer: &mut dyn FnMut(&IncrementReport<'_>) -> Control,
) -> Result<bool, SimulationError> {
    if sim.stage >= sim.stages.len() {
        return Ok(false);
    }
    let mut now = match sim.under_way.take() {
        Some(now) => now,
        None => begin_stage(sim, observer)?,
    };
    let stage = now.plan.stage;
    let iterations = increment(sim, &mut now)?.iterations;
    sim.time = now.start_time + now.share * sim.stages[stage].duration;
    sim.summary.increments += 1;
    sim.summary.iterations += iterations;
    let share = now.share;
    if share < 1.0 {
        sim.under_way = Some(now);
    } else {
        sim.stage += 1;
    }
    sim.report(stage, share, iterations, observer)?;
    if share >= 1.0 {
        end(sim);
    }
    Ok(true)
}

/// Tries shorter and shorter steps until one ends in balance; past a limit point, the way to the next balance.
fn increment(sim: &mut Simulation, now: &mut UnderWay) -> Result<NewtonStats, SimulationError> {
    let (stage, share) = (now.plan.stage, now.share);
    let Stage { first_step: first, largest_step: largest, .. } = sim.stages[stage];
    let mut snaps = false;
    loop {
        if sim.summary.increments >= sim.limits.increments {
            return Err(SimulationError::TooManyIncrements { limit: sim.limits.increments });
        }
        let target = if share + 1.001 * now.pace.step >= 1.0 { 1.0 } else { share + now.pace.step };
        sim.history.clear();
        let cause = match attempt(sim, &now.plan, [share, target], now.pace.patience()) {
            Ok(stats) => {
                accept(sim, target - share);
                now.share = target;
                now.pace.went_well(stats.iterations);
                return Ok(stats);
            }
            Err(cause) => cause,
        };
        let error = gave_up(sim, stage, share, target - share, cause);
        sim.summary.iterations += sim.history.len().saturating_sub(1);
        sim.summary.cuts += 1;
        restore(sim);
        now.pace.failed(target - share);
        if now.pace.step < SNAPS * first && !snaps {
            snaps = true;
            let target = (share + BEYOND * first).min(1.0);
            sim.history.clear();
            if let Ok(stats) = relax(sim, &now.plan, target) {
                now.share = target;
                now.pace = Pace::new(BEYOND * first, largest, sim.limits.wanted_iterations);
                return Ok(stats);
            }
            sim.summary.iterations += sim.history.len();
        }
        if now.pace.step < sim.limits.smallest_step * first {
            return Err(error);
        }
    }
}

fn begin_stage(
    sim: &mut Simulation,
    observer: &mut dyn FnMut(&IncrementReport<'_>) -> Control,
) -> Result<UnderWay, SimulationError> {
    let stage = sim.stage;
    let plan = begin(sim, stage);
    if stage == 0 {
        sim.report(0, 0.0, 0, observer)?;
    }
    let (first, largest) = (sim.stages[stage].first_step, sim.stages[stage].largest_step);
    let pace = Pace::new(first, largest, sim.limits.wanted_iterations);
    Ok(UnderWay { plan, pace, share: 0.0, start_time: sim.time })
}

fn begin(sim: &mut Simulation, stage: usize) -> Plan {
    let sys = &mut sim.sys;
    let mut released = vec![0.0; sys.u.len()];
    let now = &sim.stages[stage];
    let motions = &now.motions;
    for (_, c) in sys.contact.active() {
        if motions[c.tool] == Motion::Release {
            let force = sys.contact_force(c.node);
            released[3 * c.node..3 * c.node + 3].copy_from_slice(force.as_slice());
        }
    }
    let plan =
        Plan { stage, start_travels: sys.tools.iter().map(|t| t.travel).collect(), released };
    sim.committed.last = None;
    set_targets(sys, now, &plan, 0.0, sim.share);
    add_loads(sys, &sim.loads, now.load.at(0.0));
    sim.committed.applied.copy_from_slice(&sys.applied);
    for k in 0..sys.contact.candidates.len() {
        let tool = sys.contact.candidates[k].tool;
        if sys.roles[tool] == Role::Absent {
            sys.contact.candidates[k].active = false;
        }
    }
    sys.search();
    take_in(sys, 1e-6 * sys.lengths.shortest_edge);
    keep_pushed_tools(sys);
    sys.contact.commit();
    let supported = motions.iter().any(|m| !matches!(m, Motion::Absent | Motion::Release));
    if !supported {
        hold_where_it_is(sys);
    }
    plan
}

/// Holds the rigid modes of the sheet where it is now.
fn hold_where_it_is(sys: &mut System) {
    let now: Vec<Vec3> = (0..sys.node_count()).map(|n| sys.position(n)).collect();
    let mut held: Constraints = sys.constraints.clone();
    hold_rigid_modes(&mut held, &now);
    for node in 0..now.len() {
        for axis in 0..3 {
            if held.is_held(node, axis) && !sys.constraints.is_held(node, axis) {
                sys.held_at[3 * node + axis] = sys.u[3 * node + axis];
            }
        }
    }
    sys.constraints = held;
}

fn end(sim: &mut Simulation) {
    sim.sys.applied.fill(0.0);
    sim.committed.applied.fill(0.0);
}

/// Sets tools and applied forces to their state at `share` of the stage.
fn set_targets(sys: &mut System, stage: &Stage, plan: &Plan, share: f64, whole: f64) {
    for (tool, motion) in stage.motions.iter().enumerate() {
        let start = plan.start_travels[tool];
        let (role, travel) = match motion {
            Motion::Hold => (Role::Travel, Some(start)),
            Motion::Travel(curve) => (Role::Travel, Some(curve.at(share))),
            Motion::Advance(curve) => (Role::Travel, Some(start + curve.at(share))),
            Motion::Force(curve) => (Role::Force(curve.at(share) / whole), None),
            Motion::Spring { force, stiffness } => {
                let force = force.at(share) / whole;
                (Role::Spring { force, stiffness: stiffness / whole }, None)
            }
            Motion::Release | Motion::Absent => (Role::Absent, None),
        };
        sys.roles[tool] = role;
        if let Some(travel) = travel {
            sys.tools[tool].travel = travel;
        }
    }
    let remaining = 1.0 - share;
    for (a, r) in sys.applied.iter_mut().zip(&plan.released) {
        *a = r * remaining;
    }
}

fn add_loads(sys: &mut System, loads: &[f64], share: f64) {
    sys.applied.iter_mut().zip(loads).for_each(|(a, load)| *a += share * load);
}

pub(super) fn attempt(
    sim: &mut Simulation,
    plan: &Plan,
    [share, target]: [f64; 2],
    patience: Patience,
) -> Result<NewtonStats, NewtonError> {
    predict(&mut sim.sys, &sim.committed, target - share);
    let stage = &sim.stages[plan.stage];
    set_targets(&mut sim.sys, stage, plan, target, sim.share);
    add_loads(&mut sim.sys, &sim.loads, stage.load.at(target));
    solve(&mut sim.sys, &sim.limits, patience, &mut sim.history)
}

/// Starts the iteration where the last increment, repeated in proportion, would lead.
fn predict(sys: &mut System, committed: &Committed, step: f64) {
    let Some((last_step, du, dtravel)) = &committed.last else { return };
    let factor = step / last_step;
    sys.u.iter_mut().zip(du).for_each(|(u, d)| *u += factor * d);
    for (tool, d) in sys.tools.iter_mut().zip(dtravel) {
        tool.travel += factor * d;
    }
}

pub(super) fn accept(sim: &mut Simulation, step: f64) {
    add_work(sim);
    let sys = &mut sim.sys;
    sys.body.commit();
    sys.contact.commit();
    let du = sys.u.iter().zip(&sim.committed.u).map(|(a, b)| a - b).collect();
    let travels = sys.tools.iter().zip(&sim.committed.travels).map(|(t, b)| t.travel - b).collect();
    let last = Some((step, du, travels));
    sim.committed = Committed { last, ..Committed::of(sys) };
}

/// Goes back to the last converged state.
pub(super) fn restore(sim: &mut Simulation) {
    let (sys, old) = (&mut sim.sys, &sim.committed);
    sys.body.restore();
    sys.contact.restore();
    sys.u.copy_from_slice(&old.u);
    sys.applied.copy_from_slice(&old.applied);
    sys.eval.internal_force.copy_from_slice(&old.internal_force);
    for (tool, travel) in sys.tools.iter_mut().zip(&old.travels) {
        tool.travel = *travel;
    }
}

/// Work of the increment (trapezoidal rule), before it is committed.
fn add_work(sim: &mut Simulation) {
    let (sys, old) = (&sim.sys, &sim.committed);
    let mean = |i: usize, now: &[f64], before: &[f64]| 0.5 * (now[i] + before[i]);
    let (mut internal, mut applied, mut friction) = (0.0, 0.0, 0.0);
    for i in 0..sys.u.len() {
        let du = sys.u[i] - old.u[i];
        internal += mean(i, &sys.eval.internal_force, &old.internal_force) * du;
        applied += mean(i, &sys.applied, &old.applied) * du;
    }
    for (_, c) in sys.contact.active() {
        let slip = sys.position(c.node) - sys.tools[c.tool].shift() - c.anchor;
        let along = slip - c.foot.normal * c.foot.normal.dot(&slip);
        friction -= sys.contact_force(c.node).dot(&along);
    }
    let pushed: f64 = (0..sys.tools.len())
        .map(|t| {
            let moved = sys.tools[t].travel - old.travels[t];
            0.5 * (pushing_force(sys, t) + old.pushes[t]) * moved
        })
        .sum();
    let e = &mut sim.energies;
    let whole = sim.share;
    e.internal += whole * internal;
    e.friction += whole * friction;
    e.external += whole * (pushed + applied);
    e.elastic = whole * sys.eval.elastic_energy;
    e.plastic = whole * sys.eval.plastic_work;
}

fn gave_up(
    sim: &Simulation,
    stage: usize,
    share: f64,
    step: f64,
    cause: NewtonError,
) -> SimulationError {
    let sys = &sim.sys;
    let node = match &cause {
        NewtonError::NotConverged { node, .. } => *node,
        NewtonError::Element(failure) => sys.body.mesh().elements[failure.element][0] as usize,
        NewtonError::Linear(super::linear::LinearError::Singular { unknown }) => {
            (unknown / 3).min(sys.node_count().saturating_sub(1))
        }
        NewtonError::Linear(_) | NewtonError::StillMoving { .. } => 0,
    };
    let x = sys.position(node);
    let nearest = sys
        .tools
        .iter()
        .zip(&sys.roles)
        .filter(|(_, role)| **role != Role::Absent)
        .map(|(t, _)| (t.closest(&x, None).gap.abs(), t.setup.name.clone()))
        .min_by(|a, b| a.0.total_cmp(&b.0));
    SimulationError::GaveUp {
        stage: sim.stages[stage].name.clone(),
        increment: sim.summary.increments + 1,
        share,
        step,
        node,
        x: x.x,
        y: x.y,
        z: x.z,
        tool: nearest.map_or_else(|| "none".into(), |n| n.1),
        cause: Box::new(cause),
    }
}
