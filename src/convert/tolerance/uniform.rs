//! The uniform structured mesh as a rival: what a tolerance takes is never more than it needs.

use super::work::{Work, exceeding, folded};
use super::{Goal, Refined};
use crate::convert::ConvertOptions;
use crate::mesh::SurfaceMesh;
use crate::mesh::mapped::{MappedOptions, mesh};

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
        for mesh in self.below(limit).iter().rev() {
            let (ratio, found) = self.keeping(mesh, goal);
            match found {
                Some(found) => (best, missed) = (Some(found), 0),
                None => missed += 1,
            }
            if ratio > HOPELESS || missed == PATIENCE {
                break;
            }
        }
        best
    }

    /// Uniform meshes with fewer patches than `limit`, coarsest first.
    fn below(&self, limit: usize) -> Vec<SurfaceMesh> {
        let mut found: Vec<SurfaceMesh> = Vec::new();
        for arc_divisions in 1..=FINEST {
            let options = MappedOptions { arc_divisions, ..self.mesh };
            // Finer borders may bound a face that coarse chords do not.
            let Ok(next) = mesh(self.plan.model(), &options) else { continue };
            if next.elements.len() >= limit {
                break;
            }
            if found.last().is_none_or(|last| last.elements.len() < next.elements.len()) {
                found.push(next);
            }
        }
        found
    }

    /// Least error over the tolerance of the models of a mesh, and the first one that keeps the goal.
    fn keeping(&self, mesh: &SurfaceMesh, goal: &Goal) -> (f64, Option<Refined>) {
        let eq8 = ConvertOptions { through_cad: false, ..self.options.clone() };
        let rules =
            if self.options.through_cad { vec![self.options, &eq8] } else { vec![self.options] };
        let mut least = f64::INFINITY;
        for options in rules {
            let Ok((plain, found)) = self.plain(mesh, options, goal) else { continue };
            if !is_sound(&plain) {
                continue;
            }
            let ratio = over(&plain, goal);
            least = least.min(ratio);
            let refined = match ratio {
                r if r <= 1.0 => Ok(plain),
                r if r <= BALANCED && goal.two_sided => self.two_sided(plain, found, options),
                _ => continue,
            };
            if let Ok(refined) = refined
                && is_sound(&refined)
                && over(&refined, goal) <= 1.0
            {
                return (least, Some(refined));
            }
        }
        (least, None)
    }
}

fn is_sound(found: &Refined) -> bool {
    folded(found).is_empty() && found.audit.points_lost == 0
}

/// Error over the tolerance; at most one when the goal is kept.
fn over(found: &Refined, goal: &Goal) -> f64 {
    exceeding(&found.audit, goal).iter().fold(0.0, |most, face| most.max(face.1))
}
