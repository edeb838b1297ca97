//! Which increments, points and layers a sequence needs.

use super::distance::Quantity;
use super::error::AccuracyError;
use super::model::Model;
use super::options::{Choice, Parts};
use super::quantities::Results;
use super::records;
use super::sequence::Runner;
use crate::report::record::SequenceEnd;

/// Part of the allowed error up to which increments, points and layers each stay as they are. With half of it more runs
/// get two layers that do not need them; with twice of it two choices can use up what is allowed.
const CHOICE_SHARE: f64 = 0.2;

impl Runner<'_> {
    /// Chooses increments, points and layers on the last mesh but one, and refines the mesh with them. `ended`: why the
    /// meshes with the first choices end.
    pub(super) fn choose_and_refine(
        &mut self,
        ended: SequenceEnd,
    ) -> Result<SequenceEnd, AccuracyError> {
        let [.., at, finest] = self.meshes[..] else {
            self.unmeasured.push("mesh".into());
            return Ok(ended);
        };
        let (chosen, first_parts) = self.choose(at)?;
        if self.runs[chosen].model == self.runs[at].model {
            return if ended == SequenceEnd::Reached { self.refine(1.0, 2) } else { Ok(ended) };
        }
        self.coarse = self.mesh_errors();
        self.finest = Some(self.runs[finest].model.mesh);
        let first = std::mem::replace(&mut self.meshes, vec![chosen]);
        let end = self.refine(1.0, 2)?;
        if self.meshes.len() < 2 {
            // Nothing is known of the error of this mesh: the first choices are better judged.
            (self.meshes, self.parts) = (first, first_parts);
        }
        Ok(end)
    }

    /// Refines increments, points and layers on the mesh of a run. Returns the index of the run with all that are
    /// needed, and the errors of the first choices.
    fn choose(&mut self, base: usize) -> Result<(usize, Parts), AccuracyError> {
        let first = self.runs[base].largest_increments.clone();
        let mut first_parts = Parts::default();
        let finer = self.refine_choice(Choice::Increments, base, &first, &mut first_parts)?;
        let increments = self.runs[finer].model.increments.clone();
        // Two layers have twice the points: layers are judged with the points that are needed.
        let points = self.refine_choice(Choice::Points, base, &first, &mut first_parts)?;
        let layers = self.refine_choice(Choice::Layers, points, &first, &mut first_parts)?;
        let chosen = Model { increments, ..self.runs[layers].model.clone() };
        if let Some(known) = self.runs.iter().position(|run| run.model == chosen) {
            return Ok((known, first_parts));
        }
        let index = self.run(chosen, "options", Some(base))?;
        match self.runs[index].results {
            Some(_) => Ok((index, first_parts)),
            None => Err(records::not_converged(self.runs.last())),
        }
    }

    /// Refines one choice of a run until its error is small, sets its part, and returns the index of the run with what is
    /// needed of it.
    fn refine_choice(
        &mut self,
        choice: Choice,
        base: usize,
        first: &[f64],
        first_parts: &mut Parts,
    ) -> Result<usize, AccuracyError> {
        let mut coarse = base;
        loop {
            let model = self.runs[coarse].model.clone();
            let Some(finer) = choice.refined(&model, first) else { break };
            let fine = match self.exceeded(coarse, &finer)? {
                None => Some(self.run(finer.clone(), choice.name(), Some(coarse))?),
                Some(_) => None,
            };
            let Some(fine) = fine.filter(|&fine| self.runs[fine].results.is_some()) else {
                if coarse == base {
                    self.unmeasured.push(choice.name().into());
                }
                break;
            };
            let [before, after] = choice.errors_over_change(&model, &finer, first);
            let runs = (self.runs[coarse].results().clone(), self.runs[fine].results().clone());
            self.parts.set(choice, before, (&runs.0, &runs.1));
            if coarse == base {
                first_parts.set(choice, before, (&runs.0, &runs.1));
            }
            if self.is_small(choice, &runs.0) {
                break;
            }
            self.parts.set(choice, after, (&runs.0, &runs.1));
            coarse = fine;
            if self.is_small(choice, &runs.1) {
                break;
            }
        }
        Ok(coarse)
    }

    /// Whether the part of a choice is a small share of all errors that are allowed.
    fn is_small(&self, choice: Choice, results: &Results) -> bool {
        Quantity::of(results).iter().all(|quantity| {
            let part = self.parts.of(quantity).get(choice.name()).copied().unwrap_or(0.0);
            let allowed = quantity.allowed(&self.asked, results);
            allowed.is_none_or(|allowed| part <= CHOICE_SHARE * allowed)
        })
    }
}
