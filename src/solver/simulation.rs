//! Driver: computes a sequence of converged increments from a checked model.

use crate::assembly::Body;
use crate::element::Want;
use crate::error::SimulationError;
use crate::increment::increment::advance;
use crate::limits::Limits;
use crate::newton::record::IterationRecord;
use crate::observe::contact_forces;
use crate::report::{Control, Energies, IncrementReport, RunSummary};
use crate::sheet::supports::Constraints;
use crate::stage::description::Stage;
use crate::stage::state::{Committed, Simulation};
use crate::system::system::System;
use crate::tools::tool::{Placement, SheetSide, Tool, ToolSetup};
use kanagata_cancel::Cancel;
use kanagata_geometry::Vec3;

/// Model of a run.
pub struct SimulationSetup {
    /// The sheet.
    pub body: Body,
    /// Symmetry planes and fixed nodes.
    pub constraints: Constraints,
    /// Nodal forces, three for each node [N], scaled by the `load` of each stage; empty: none.
    pub loads: Vec<f64>,
    /// The tools.
    pub tools: Vec<ToolSetup>,
    /// Stages in order.
    pub stages: Vec<Stage>,
    /// Limits of the solver.
    pub limits: Limits,
    /// Ratio of the complete process to the modelled part: 4 for a quarter model. Given and reported forces are those
    /// of the complete process.
    pub share: f64,
}

impl SimulationSetup {
    /// Moves every tool with [`Placement::Touch`] into contact with the sheet and sets its placement to
    /// [`Placement::AsGiven`].
    ///
    /// # Errors
    /// [`SimulationError::NoTouch`].
    pub fn place(&mut self) -> Result<(), SimulationError> {
        let tools = self.tools.iter().cloned();
        let mut tools: Vec<Tool> = tools.map(|setup| Tool { setup, travel: 0.0 }).collect();
        place(&mut tools, &self.body)?;
        for (own, placed) in self.tools.iter_mut().zip(tools) {
            *own = ToolSetup { placement: Placement::AsGiven, ..placed.setup };
        }
        Ok(())
    }
}

impl Simulation {
    /// Checks the model, analyses the matrix and places the tools. Loads on hanging nodes go to their masters.
    ///
    /// # Errors
    /// [`SimulationError::Setup`], [`SimulationError::NoTouch`], [`SimulationError::Linear`].
    pub fn new(setup: SimulationSetup) -> Result<Self, SimulationError> {
        check(&setup)?;
        let SimulationSetup { body, constraints, mut loads, tools, stages, limits, share } = setup;
        if !loads.is_empty() {
            body.mesh().move_to_masters(&mut loads);
        }
        let mut tools: Vec<Tool> =
            tools.into_iter().map(|setup| Tool { setup, travel: 0.0 }).collect();
        place(&mut tools, &body)?;
        let mut sys = System::new(body, constraints, tools)?;
        sys.lengths.transition = limits.friction_transition * sys.lengths.longest_edge;
        sys.evaluate(Want::ResidualAndTangent)
            .map_err(|e| SimulationError::Setup(format!("the undeformed blank: {e}")))?;
        sys.set_scales(limits.contact.stiffness());
        let committed = Committed::of(&sys);
        Ok(Self {
            sys,
            stages,
            loads,
            limits,
            share,
            dragged: 0.0,
            committed,
            stage: 0,
            under_way: None,
            energies: Energies::default(),
            history: Vec::new(),
            summary: RunSummary::default(),
            time: 0.0,
        })
    }

    /// Runs all stages; `observer` receives the start and every converged increment.
    ///
    /// # Errors
    /// [`SimulationError`]; the last converged state remains accessible.
    pub fn run(
        &mut self,
        observer: &mut dyn FnMut(&IncrementReport<'_>) -> Control,
    ) -> Result<RunSummary, SimulationError> {
        while self.advance(observer)? {}
        Ok(self.summary.clone())
    }

    /// Computes one increment; returns false when all stages are done. `observer` receives the start, and the
    /// increment when it has converged. Between two calls the state may be saved ([`Self::state`]).
    ///
    /// # Errors
    /// [`SimulationError`]; the last converged state remains accessible and the stage active. The state may be saved
    /// and resumed, and a further call repeats the increment.
    pub fn advance(
        &mut self,
        observer: &mut dyn FnMut(&IncrementReport<'_>) -> Control,
    ) -> Result<bool, SimulationError> {
        let (before, spent) = (self.state_without_history(), self.sys.timings);
        let more = advance(self, observer);
        if let Err(SimulationError::Stopped { .. }) = more
            && self.sys.cancel.is_requested()
            && self.summary.increments == before.increments()
        {
            // The history of the material points is that of the last increment.
            self.go_back_within(before).map_err(SimulationError::Setup)?;
            // The increment is repeated: its work counts once, whenever the run is stopped.
            self.sys.timings = self.sys.timings.with_counts_of(&spent);
            let solver = &mut self.sys.solver;
            (solver.factorisations, solver.updates) = (spent.factorisations, spent.updates);
        }
        self.summary.timings = self.sys.timings;
        more
    }

    /// Sets the cancellation of a run: [`Self::advance`] then fails with [`SimulationError::Stopped`] in the state
    /// before the current increment.
    pub fn set_cancel(&mut self, cancel: Cancel) {
        self.sys.solver.set_cancel(&cancel);
        self.sys.cancel = cancel;
    }

    /// The sheet, with its committed history.
    #[must_use]
    pub fn body(&self) -> &Body {
        &self.sys.body
    }

    /// Displacements, three for each node [mm].
    #[must_use]
    pub fn displacements(&self) -> &[f64] {
        &self.sys.u
    }

    /// Contact forces on the nodes, three for each node [N].
    #[must_use]
    pub fn contact_forces(&self) -> Vec<f64> {
        contact_forces(&self.sys)
    }

    /// Iterations of the last attempt, including one that failed.
    #[must_use]
    pub fn last_attempt(&self) -> &[IterationRecord] {
        &self.history
    }

    /// Shift of each tool from the frame of its file to the world [mm].
    #[must_use]
    pub fn tool_shifts(&self) -> Vec<Vec3> {
        self.sys.tools.iter().map(Tool::shift).collect()
    }

    /// Faces of the sheet that each tool may touch.
    #[must_use]
    pub fn tool_sides(&self) -> Vec<SheetSide> {
        self.sys.tools.iter().map(|t| t.setup.side).collect()
    }

    /// Current totals.
    #[must_use]
    pub fn summary(&self) -> &RunSummary {
        &self.summary
    }

    /// Work of a force at the level of rounding over the size of the sheet [N mm].
    pub(super) fn rounding_work(&self) -> f64 {
        self.share * self.sys.scales.least() * self.sys.lengths.size
    }
}

fn place(tools: &mut [Tool], body: &Body) -> Result<(), SimulationError> {
    let mesh = body.mesh();
    for tool in tools.iter_mut().filter(|t| t.setup.placement == Placement::Touch) {
        let ids = tool.setup.side.nodes(mesh);
        let points: Vec<Vec3> = ids.iter().map(|&n| mesh.nodes[n as usize]).collect();
        if tool.place_touching(&points).is_none() {
            let remedy = tool.setup.placement_remedy(&points);
            let looks_back = tool.setup.looks_back();
            let tool = tool.setup.name.clone();
            return Err(SimulationError::NoTouch { tool, looks_back, remedy });
        }
    }
    Ok(())
}

/// Whether the parts of a set-up agree and its figures are in range.
///
/// # Errors
/// [`SimulationError::Setup`] for the first part that does not.
pub(crate) fn check(setup: &SimulationSetup) -> Result<(), SimulationError> {
    let nodes = setup.body.mesh().nodes.len();
    if setup.constraints.len() != nodes {
        return setup_error(format!(
            "constraints are for {} nodes, the blank has {nodes}",
            setup.constraints.len()
        ));
    }
    check_hanging(setup)?;
    let loads = setup.loads.len();
    if loads != 0 && loads != 3 * nodes {
        return setup_error(format!(
            "loads have {loads} components, must have 3 for each of the {nodes} nodes, or none"
        ));
    }
    if !(setup.share > 0.0 && setup.share.is_finite()) {
        return setup_error(format!("share {} must be above zero", setup.share));
    }
    setup.tools.iter().try_for_each(check_tool)?;
    setup.stages.iter().try_for_each(|stage| check_stage(stage, setup.tools.len()))
}

/// Hanging nodes have no supports of their own: those of both masters hold them.
fn check_hanging(setup: &SimulationSetup) -> Result<(), SimulationError> {
    let held = |node: usize, axis: usize| setup.constraints.is_held(node, axis);
    for (node, masters) in setup.body.mesh().hanging_nodes() {
        let alone = |&axis: &usize| held(node, axis) && !masters.iter().all(|&m| held(m, axis));
        if let Some(axis) = (0..3).find(alone) {
            return setup_error(format!(
                "hanging node {node} is held along axis {axis}, its masters {} and {} are not both: hold them instead",
                masters[0], masters[1]
            ));
        }
    }
    Ok(())
}

fn setup_error(text: String) -> Result<(), SimulationError> {
    Err(SimulationError::Setup(text))
}

fn check_tool(tool: &ToolSetup) -> Result<(), SimulationError> {
    let length = tool.direction.norm();
    if length.is_nan() || (length - 1.0).abs() > 1e-9 {
        return setup_error(format!(
            "tool `{}`: direction has length {length}, must be 1",
            tool.name
        ));
    }
    if !(tool.friction >= 0.0 && tool.friction.is_finite()) {
        return setup_error(format!(
            "tool `{}`: friction {} must be >= 0",
            tool.name, tool.friction
        ));
    }
    if tool.surface.model().patches.is_empty() {
        return setup_error(format!("tool `{}` has no patches", tool.name));
    }
    Ok(())
}

/// Checks a stage of a model with this number of `tools`.
fn check_stage(stage: &Stage, tools: usize) -> Result<(), SimulationError> {
    let (name, motions) = (&stage.name, stage.motions.len());
    if motions != tools {
        return setup_error(format!("stage `{name}` moves {motions} tools, there are {tools}"));
    }
    let step = |s: f64| s > 0.0 && s <= 1.0;
    if !(step(stage.first_step) && step(stage.largest_step) && stage.duration > 0.0) {
        return setup_error(format!(
            "stage `{name}`: first_step {}, largest_step {} must lie in (0, 1], duration {} above 0",
            stage.first_step, stage.largest_step, stage.duration
        ));
    }
    let from = |k: usize| if k == 0 { 0.0 } else { stage.ends[k - 1] };
    let bad = stage.ends.iter().enumerate().find(|&(k, &end)| !(end > from(k) && end <= 1.0));
    if let Some((k, end)) = bad {
        return setup_error(format!(
            "stage `{name}`: increment {} ends at a share of {end}, must lie in ({}, 1]",
            k + 1,
            from(k)
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::element::ElementKind;
    use crate::material::elastic::Elastic;
    use crate::sheet::hex_mesh::rectangle;

    /// A block on a plane, with these loads.
    fn block(loads: Vec<f64>) -> SimulationSetup {
        let mesh = rectangle(1.0, 1.0, 1.0, 1, 1, 1);
        let mut constraints = Constraints::none(mesh.nodes.len());
        (0..mesh.nodes.len()).for_each(|n| constraints.hold(n, 2));
        let material = Arc::new(Elastic { young: 210_000.0, poisson: 0.3 });
        SimulationSetup {
            body: Body::new(mesh, ElementKind::Hex8, material).unwrap(),
            constraints,
            loads,
            tools: Vec::new(),
            stages: Vec::new(),
            limits: Limits::default(),
            share: 1.0,
        }
    }

    #[test]
    fn loads_are_for_all_nodes_or_none() {
        for sound in [0, 24] {
            assert!(Simulation::new(block(vec![0.0; sound])).is_ok(), "{sound}");
        }
        for bad in [3, 23, 27] {
            let Err(SimulationError::Setup(text)) = Simulation::new(block(vec![0.0; bad])) else {
                panic!("{bad} components for 8 nodes are refused");
            };
            assert!(text.contains(&format!("loads have {bad} components")), "{text}");
        }
    }
}
