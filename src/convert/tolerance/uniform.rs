//! Comparison with uniform structured meshes: a refined model never has more patches than the best of these.

use super::closest::{goal_ratio, is_valid};
use super::goal::{Goal, Refined};
use super::scope::Scope;
use crate::unfolded::mesh_and_convert;
use crate::{ConvertOptions, ConvertReport, convert};
use kanagata_mesh::mapped::{self, MappedOptions, mesh};
use kanagata_mesh::{MeshFeet, SurfaceMesh};
use kanagata_tool::ToolModel;

/// A model and the report of its conversion.
type Converted = (ToolModel, ConvertReport);

/// Function that makes a model.
type Converter<'a> = &'a dyn Fn() -> Option<Converted>;

/// Maximum divisions per quarter turn.
const ARC_DIVISIONS_MAX: usize = 128;
/// Maximum number of patches of a uniform mesh when the search found no model.
pub(super) const UNIFORM_PATCHES_MAX: usize = 4000;
/// The same where the search has no valid patches of a face: its folds are repaired in every mesh, mostly in vain. With eight
/// times as many, two files with surfaces that fold themselves are refused after 65 s instead of 36 and 47 s.
pub(super) const REPAIRED_PATCHES_MAX: usize = 500;
/// Allowance for each face, so that coarse meshes of many faces are tried too.
pub(super) const REPAIRED_PATCHES_PER_FACE: usize = 8;
/// Ratio of error to tolerance up to which the vertex motion is tried.
const BALANCE_RATIO_MAX: f64 = 2.0;
/// Ratio of error to tolerance above which coarser meshes are not tried.
const HOPELESS_RATIO: f64 = 4.0;
/// Number of consecutive meshes above the tolerance after which coarser ones are not tried.
const FAILURES_MAX: usize = 3;

impl Scope<'_> {
    /// Model of a uniform mesh within the goal and without folds, with the fewest patches, below `limit`. Its edges
    /// follow the CAD as requested, or Eq. 8. Meshes are audited from fine to coarse.
    pub(super) fn uniform(&self, goal: &Goal, limit: usize) -> Option<Refined> {
        let (mut best, mut missed) = (None, 0);
        for (arc_divisions, mesh) in self.meshes_below(limit).iter().rev() {
            let patches = mesh.elements.len() as u64;
            if !self.budget.allows_complete(patches) {
                continue;
            }
            self.budget.add_complete(patches);
            let (ratio, found) = self.model_within_goal(*arc_divisions, mesh, goal, limit);
            match found {
                Some(found) => (best, missed) = (Some(found), 0),
                None => missed += 1,
            }
            // An infinite ratio means no valid model; the next coarser mesh may have one.
            if (ratio.is_finite() && ratio > HOPELESS_RATIO) || missed == FAILURES_MAX {
                break;
            }
        }
        best
    }

    /// Uniform meshes with fewer than `limit` elements and their divisions per quarter turn, coarsest first.
    fn meshes_below(&self, limit: usize) -> Vec<(usize, SurfaceMesh)> {
        let mut found: Vec<(usize, SurfaceMesh)> = Vec::new();
        for arc_divisions in 1..=ARC_DIVISIONS_MAX {
            let options = MappedOptions { arc_divisions, ..self.mesh };
            // With finer divisions the border of a face may enclose a region.
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

    /// Minimum ratio of error to tolerance over the models of `mesh`, and the first model within the goal with fewer
    /// than `limit` patches. The models are tried in this order:
    ///
    /// 1. the edges as requested on `mesh`;
    /// 2. the same with equal lengths and with nodes inside flats;
    /// 3. if edges follow the CAD: edges by Eq. 8, with faces refined that have folded patches.
    fn model_within_goal(
        &self,
        arc_divisions: usize,
        mesh: &SurfaceMesh,
        goal: &Goal,
        limit: usize,
    ) -> (f64, Option<Refined>) {
        let eq8 = ConvertOptions { through_cad: false, ..self.options.clone() };
        let as_requested = || convert(self.plan.model(), mesh, self.options).ok();
        let plain = MappedOptions { arc_divisions, by_turn: false, fewest: false, ..self.mesh };
        // Flats with interior nodes fold less at arcs of their borders.
        let equal_lengths = || {
            let other =
                mapped::mesh(self.plan.model(), &plain).ok().filter(|other| other != mesh)?;
            convert(self.plan.model(), &other, self.options).ok()
        };
        let by_eq8 = || {
            let options = MappedOptions { through_cad: false, ..plain };
            mesh_and_convert(self.plan.model(), &options, &eq8).ok()
        };
        let mut rules: Vec<(&ConvertOptions, Converter)> =
            vec![(self.options, &as_requested), (self.options, &equal_lengths)];
        if self.options.through_cad {
            rules.push((&eq8, &by_eq8));
        }
        let mut least = f64::INFINITY;
        for (options, make) in rules {
            let Some(model) = make().filter(|m| m.0.patches.len() < limit) else { continue };
            let (ratio, refined) = self.evaluate_model(model, options, goal);
            least = least.min(ratio);
            if refined.is_some() {
                return (least, refined);
            }
        }
        (least, None)
    }

    /// Ratio of error to tolerance of `model`, whose vertices lie on the CAD; infinite if it is not valid. The second
    /// result is the model within the goal: `model`, or the one with moved vertices.
    fn evaluate_model(
        &self,
        model: Converted,
        options: &ConvertOptions,
        goal: &Goal,
    ) -> (f64, Option<Refined>) {
        let Ok((plain, found)) = self.audited(model, &MeshFeet::default(), goal) else {
            return (f64::INFINITY, None);
        };
        if !is_valid(&plain) {
            return (f64::INFINITY, None);
        }
        let ratio = goal_ratio(&plain, goal);
        self.keep_candidate(&plain, goal);
        let refined = match ratio {
            r if r <= 1.0 => Ok(plain),
            r if r <= BALANCE_RATIO_MAX && goal.two_sided => self.two_sided(plain, found, options),
            _ => return (ratio, None),
        };
        let within = |found: &Refined| is_valid(found) && goal_ratio(found, goal) <= 1.0;
        let checked = refined.ok().filter(within).and_then(|r| self.with_decisive_audit(r).ok());
        (ratio, checked.filter(within))
    }
}
