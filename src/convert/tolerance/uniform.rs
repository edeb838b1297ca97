//! The uniform structured mesh as a rival: what a tolerance takes is never more than it needs.

use super::faults::{exceeding, folded};
use super::goal::{Goal, Refined};
use super::scope::Work;
use crate::convert::unfolded::mesh_and_convert;
use crate::convert::{ConvertOptions, ConvertReport, convert};
use crate::mesh::SurfaceMesh;
use crate::mesh::mapped::{self, MappedOptions, mesh};
use crate::tool::ToolModel;

/// A model with the record of its making.
type Made = (ToolModel, ConvertReport);

/// A way to make a model.
type Make<'a> = &'a dyn Fn() -> Option<Made>;

/// Most divisions of a quarter turn that are tried.
const FINEST: usize = 128;
/// Patches of a uniform mesh where no other was found, at most.
pub(super) const MOST: usize = 4000;
/// Times the tolerance that balancing may take off.
const BALANCED: f64 = 2.0;
/// Times the tolerance beyond which coarser meshes are not tried.
const HOPELESS: f64 = 4.0;
/// Meshes one after the other that miss the tolerance, after which coarser ones are not tried.
const PATIENCE: usize = 3;

impl Work<'_> {
    /// The uniform mesh with the fewest patches, less than `limit`, that keeps the goal without a fold; its edges as
    /// asked, or of Eq. 8. Patches are counted before anything is audited, and the audits go from fine to coarse.
    pub(super) fn uniform(&self, goal: &Goal, limit: usize) -> Option<Refined> {
        let (mut best, mut missed) = (None, 0);
        for (arc_divisions, mesh) in self.below(limit).iter().rev() {
            let patches = mesh.elements.len() as u64;
            if !self.budget.allows_finished(patches) {
                continue;
            }
            self.budget.add_finished(patches);
            let (ratio, found) = self.keeping(*arc_divisions, mesh, goal, limit);
            match found {
                Some(found) => (best, missed) = (Some(found), 0),
                None => missed += 1,
            }
            // Without a sound model the next coarser one may have one.
            if (ratio.is_finite() && ratio > HOPELESS) || missed == PATIENCE {
                break;
            }
        }
        best
    }

    /// Uniform meshes with fewer patches than `limit` and their divisions of a quarter turn, coarsest first.
    fn below(&self, limit: usize) -> Vec<(usize, SurfaceMesh)> {
        let mut found: Vec<(usize, SurfaceMesh)> = Vec::new();
        for arc_divisions in 1..=FINEST {
            let options = MappedOptions { arc_divisions, ..self.mesh };
            // Finer borders may bound a face that coarse chords do not.
            let Ok(next) = mesh(self.plan.model(), &options) else { continue };
            if next.elements.len() >= limit {
                break;
            }
            if found.last().is_none_or(|last| last.1.elements.len() < next.elements.len()) {
                found.push((arc_divisions, next));
            }
        }
        found
    }

    /// Least error over the tolerance of the models of a mesh, and the first one that keeps the goal with fewer patches
    /// than `limit`. Where edges follow the CAD, those of Eq. 8 are tried as well, on the mesh that suits them, with faces
    /// that fold divided more finely.
    fn keeping(
        &self,
        arc_divisions: usize,
        mesh: &SurfaceMesh,
        goal: &Goal,
        limit: usize,
    ) -> (f64, Option<Refined>) {
        let eq8 = ConvertOptions { through_cad: false, ..self.options.clone() };
        let asked = || convert(self.plan.model(), mesh, self.options).ok();
        let plain = MappedOptions { arc_divisions, by_turn: false, fewest: false, ..self.mesh };
        // Flats with nodes inside fold less beside arcs of their borders.
        let evenly = || {
            let mesh = mapped::mesh(self.plan.model(), &plain).ok()?;
            convert(self.plan.model(), &mesh, self.options).ok()
        };
        let other = || {
            let options = MappedOptions { through_cad: false, ..plain };
            mesh_and_convert(self.plan.model(), &options, &eq8).ok()
        };
        let mut rules: Vec<(&ConvertOptions, Make)> =
            vec![(self.options, &asked), (self.options, &evenly)];
        if self.options.through_cad {
            rules.push((&eq8, &other));
        }
        let mut least = f64::INFINITY;
        for (options, make) in rules {
            let Some(made) = make().filter(|made| made.0.patches.len() < limit) else { continue };
            let (ratio, refined) = self.judged(made, options, goal);
            least = least.min(ratio);
            if refined.is_some() {
                return (least, refined);
            }
        }
        (least, None)
    }

    /// How far a model is from the goal, as a ratio (infinite where it is not sound), and what keeps it: the model itself,
    /// or with its vertices moved about the CAD.
    fn judged(&self, made: Made, options: &ConvertOptions, goal: &Goal) -> (f64, Option<Refined>) {
        let Ok((plain, found)) = self.audited(made, goal) else { return (f64::INFINITY, None) };
        if !is_sound(&plain) {
            return (f64::INFINITY, None);
        }
        let ratio = over(&plain, goal);
        let refined = match ratio {
            r if r <= 1.0 => Ok(plain),
            r if r <= BALANCED && goal.two_sided => self.two_sided(plain, found, options),
            _ => return (ratio, None),
        };
        (ratio, refined.ok().filter(|r| is_sound(r) && over(r, goal) <= 1.0))
    }
}

fn is_sound(found: &Refined) -> bool {
    folded(found).is_empty() && found.audit.points_lost == 0
}

/// Error over the tolerance; at most one when the goal is kept.
fn over(found: &Refined, goal: &Goal) -> f64 {
    exceeding(&found.audit, goal).iter().fold(0.0, |most, face| most.max(face.1))
}
