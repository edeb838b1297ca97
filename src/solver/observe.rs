//! Reports of increments to the observer of a run.

use crate::contact::candidate::ContactSet;
use crate::contact::face_penetration::FaceDepths;
use crate::error::SimulationError;
use crate::report::{Control, IncrementReport, NodeContact, REPORTED_DEPTH_REL, ToolReport};
use crate::stage::state::Simulation;
use crate::system::system::System;
use crate::tools::motion::Motion;
use crate::tools::role::Role;

impl Simulation {
    fn tool_report(&self, tool: usize, share: f64) -> ToolReport {
        let sys = &self.sys;
        let t = &sys.tools[tool];
        let force = sys.tool_force(tool);
        let now = self.under_way.as_ref().map(|now| &now.plan);
        let released = now
            .filter(|plan| self.stages[plan.stage].motions[tool] == Motion::Release)
            .map_or(0.0, |plan| plan.remaining(share) * plan.start_forces[tool]);
        ToolReport {
            name: t.setup.name.clone(),
            travel: t.travel,
            force: self.share * force.dot(&t.setup.direction) + released,
            force_vector: force.into(),
            shift: t.shift().into(),
            contacts: sys.contact.active().filter(|(_, c)| c.tool == tool).count(),
        }
    }

    /// Report of the last increment, which ended at this fraction of a stage; `forces` are the contact forces on the
    /// nodes [N], `node_contacts` the nodes in contact.
    fn increment_report<'a>(
        &'a self,
        (stage, share): (usize, f64),
        iterations: usize,
        depths: &'a FaceDepths,
        (forces, node_contacts): (&'a [f64], &'a [NodeContact]),
    ) -> IncrementReport<'a> {
        let sys = &self.sys;
        IncrementReport {
            increment: self.summary.increments,
            stage,
            stage_name: &self.stages[stage].name,
            time: self.time,
            share,
            free: sys.roles.iter().all(|role| *role == Role::Absent)
                || self.under_way.as_ref().is_some_and(|now| now.plan.lets_all_go()),
            tools: (0..sys.tools.len()).map(|t| self.tool_report(t, share)).collect(),
            iterations,
            iterations_total: self.summary.iterations,
            cuts: self.summary.cuts,
            snap_throughs: self.summary.snap_throughs,
            stabilised: self.summary.stabilised,
            unstable: self.summary.unstable,
            buckles: self.summary.buckles,
            history: &self.history,
            energies: self.energies,
            rounding_work: self.rounding_work(),
            volume_balance: sys.body.volume_balance(&sys.u),
            over_edge: sys.over_edge(REPORTED_DEPTH_REL),
            face_penetration: depths.deepest,
            face_depths: &depths.of_elements,
            contacts: sys.contact.active().count(),
            slipping: sys.conditions.iter().filter(|c| c.slipping).count(),
            timings: sys.timings,
            body: &sys.body,
            displacements: &sys.u,
            contact_forces: forces,
            node_contacts,
        }
    }

    /// Passes the report of the last increment, which ended at `share` of a stage, to the observer.
    ///
    /// # Errors
    /// [`SimulationError::Stopped`] if the observer stops the run.
    pub(crate) fn report(
        &mut self,
        stage: usize,
        share: f64,
        iterations: usize,
        observer: &mut dyn FnMut(&IncrementReport<'_>) -> Control,
    ) -> Result<(), SimulationError> {
        let depths = self.sys.face_penetration();
        let forces = contact_forces(&self.sys);
        let contacts = node_contacts(&self.sys);
        let (at, contact) = ((stage, share), (&forces[..], &contacts[..]));
        let report = self.increment_report(at, iterations, &depths, contact);
        match observer(&report) {
            Control::Continue => Ok(()),
            Control::Stop => Err(SimulationError::Stopped { increment: self.summary.increments }),
        }
    }
}

/// Contact forces on the nodes, three for each node [N].
pub(crate) fn contact_forces(sys: &System) -> Vec<f64> {
    let mut out = vec![0.0; sys.u.len()];
    let set: &ContactSet = &sys.contact;
    for (_, c) in set.active() {
        out[3 * c.node..3 * c.node + 3].copy_from_slice(sys.contact_force(c).as_slice());
    }
    out
}

/// The nodes in contact, in ascending order.
fn node_contacts(sys: &System) -> Vec<NodeContact> {
    let touching = sys.conditions.iter().filter_map(|condition| {
        let c = &sys.contact.candidates[condition.candidate?];
        let normal_force = c.foot.normal.dot(&sys.contact_force(c));
        Some(NodeContact { node: c.node, tool: c.tool, slips: condition.slipping, normal_force })
    });
    touching.collect()
}
