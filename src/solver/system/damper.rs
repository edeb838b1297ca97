//! Viscous forces on the nodes for stabilisation.

use crate::assembly::Body;
use crate::assembly::Evaluation;
use crate::element::Want;
use crate::linear::pattern::Pattern;

/// Volume of every node over the mean; hanging nodes have none, since their masters carry it.
pub(crate) fn shares(body: &Body) -> Vec<f64> {
    let mesh = body.mesh();
    let mut volumes = vec![0.0; mesh.nodes.len()];
    for (element, volume) in mesh.elements.iter().zip(body.volumes()) {
        element.iter().for_each(|&node| volumes[node as usize] += volume / 8.0);
    }
    mesh.share_with_masters(&mut volumes);
    let mean = volumes.iter().sum::<f64>() / mesh.free_node_count().max(1) as f64;
    volumes.into_iter().map(|volume| volume / mean).collect()
}

/// Viscous forces that oppose the displacement of every node since the start of a step.
#[derive(Debug, Clone)]
pub(crate) struct Damper {
    from: Vec<f64>,
    /// Damper stiffness of every node [N/mm].
    stiffness: Vec<f64>,
}

impl Damper {
    /// Damper about displacements `u`, proportional to the volume of each node, with the mean `stiffness` [N/mm].
    pub(crate) fn new(body: &Body, u: &[f64], stiffness: f64) -> Self {
        let stiffness = shares(body).into_iter().map(|share| stiffness * share).collect();
        Self { from: u.to_vec(), stiffness }
    }

    /// Adds the forces and, if requested, the tangent.
    pub(crate) fn add(&self, u: &[f64], want: Want, pattern: &Pattern, eval: &mut Evaluation) {
        for (i, force) in self.forces(u).enumerate() {
            eval.internal_force[i] += force;
            if want == Want::ResidualAndTangent
                && let Some(place) = pattern.position(i, i)
            {
                eval.tangent[place] += self.stiffness[i / 3];
            }
        }
    }

    /// Forces, three for each node [N].
    pub(crate) fn forces(&self, u: &[f64]) -> impl Iterator<Item = f64> {
        let moved = u.iter().zip(&self.from).map(|(now, from)| now - from);
        moved.enumerate().map(|(i, moved)| self.stiffness[i / 3] * moved)
    }
}
