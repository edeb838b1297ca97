//! Which points, layers and increments a sequence needs.

use super::distance::Quantity;
use super::error::AccuracyError;
use super::model::Model;
use super::options::{Choice, Parts, increment_error_within};
use super::pattern::{LEVEL_MAX, Pattern};
use super::quantities::Results;
use super::runner::Runner;
use super::sequence::RATIO_MIN;
use kanagata_report::record::{FacePenetrationRecord, SequenceEnd};
use kanagata_scene::read::read_with;
use kanagata_solver::sheet::hex_mesh::HexMesh;
use kanagata_solver::sheet::refine::plan_elements;

/// Elements of a refined mesh over those of the uniform one, above which it is not used: what it saves is then small beside
/// the error of its longer elements. At half the value a strip that bends along a third of its length stays uniform.
const WORTH_SHARE: f64 = 0.6;

/// Allowed error of the increments over that of the run before, above which it stays: runs that are compared then have the
/// same. At half the value increments may have twice the part.
const UNCHANGED_REL: f64 = 0.5;

/// Smallest part of the distance of two runs between which the choices have changed that is held to be that of their meshes.
/// Choices that make the whole change leave this part: with half of it the mesh passes for twice as good.
const MESH_SHARE_MIN: f64 = 0.5;

impl Runner<'_> {
    /// Chooses points and layers on the last mesh, and refines the mesh with them. `ended`: why the
    /// meshes with the first choices end.
    pub(super) fn choose_and_refine(
        &mut self,
        ended: SequenceEnd,
    ) -> Result<SequenceEnd, AccuracyError> {
        let [_, .., at] = self.meshes[..] else { return Ok(ended) };
        self.chosen = true;
        let (chosen, first_parts) = self.choose(at)?;
        let same = chosen == self.runs[at].model;
        if same && ended != SequenceEnd::Reached {
            return Ok(ended);
        }
        let ratio = match self.next_ratio(1.0) {
            Err(end) if same => return Ok(end),
            // A finer mesh shows what the choices change.
            Err(_) => RATIO_MIN,
            Ok(ratio) => ratio,
        };
        let model = Model { mesh: chosen.mesh.scaled(ratio), ..chosen };
        let end = self.refine_from(model, at)?;
        if self.meshes.last() == Some(&at) {
            self.parts = first_parts;
            self.set_increments_part(at);
        }
        Ok(end)
    }

    /// Runs the model of the choices on a mesh that is finer than that of run `at`, and refines it.
    fn refine_from(&mut self, model: Model, at: usize) -> Result<SequenceEnd, AccuracyError> {
        let model = self.with_levels(model)?;
        if let Some(end) = self.exceeded(at, &model)? {
            return Ok(end);
        }
        let index = self.run(model, "mesh", Some(at))?;
        if self.runs[index].results.is_none() {
            return Ok(SequenceEnd::NotConverged);
        }
        self.chosen_after = Some(at);
        self.push_mesh(index);
        self.refine(1.0, 2)
    }

    /// The part of the mesh in the distance of two runs between which the choices have changed: what is left of it without
    /// the changes by the choices, as errors of independent signs combine.
    pub(super) fn without_choices(&self, quantity: &Quantity, distance: f64) -> f64 {
        let changes = self.changes.get(&quantity.name()).copied().unwrap_or(0.0);
        (distance * distance - changes).max((MESH_SHARE_MIN * distance).powi(2)).sqrt()
    }

    /// Sets the pattern of refinement by the first run, and runs its model with it: the short elements are as long as those
    /// of the first run. `None` where the mesh stays uniform.
    pub(super) fn refined_run(&mut self, base: usize) -> Result<Option<usize>, AccuracyError> {
        self.keeps_steps = false;
        self.pattern = self.pattern(base)?;
        if self.pattern.is_none() {
            return Ok(None);
        }
        let first = self.runs[base].model.clone();
        let coarse = first.mesh.scaled(0.5_f64.powi(i32::from(LEVEL_MAX)));
        let increment_error = self.allowed_increments(base);
        let model = self.with_levels(Model { mesh: coarse, increment_error, ..first })?;
        let within = self.exceeded(base, &model)?.is_none();
        let index = if within { Some(self.run(model, "pattern", Some(base))?) } else { None };
        let index = index.filter(|&index| self.runs[index].results.is_some());
        if index.is_none() {
            self.pattern = None;
        }
        Ok(index)
    }

    /// The pattern of refinement by a run; `None` where the refined mesh with equally short elements has not far fewer than the
    /// mesh of the run. The single element across a strip is split too, so that strips stay uniform.
    fn pattern(&self, run: usize) -> Result<Option<Pattern>, AccuracyError> {
        let run = &self.runs[run];
        let mesh = self.mesh_of(&run.model)?;
        let allowed = FacePenetrationRecord::ALLOWED_IN_SEQUENCE_REL * mesh.mean_thickness();
        let Some(pattern) = Pattern::of_run(&run.folder, &mesh, allowed) else { return Ok(None) };
        let coarse = run.model.mesh.scaled(0.5_f64.powi(i32::from(LEVEL_MAX)));
        let base = self.mesh_of(&Model { mesh: coarse, levels: None, ..run.model.clone() })?;
        let levels = pattern.levels(&base);
        let elements: f64 = levels.bytes().map(|level| 4_f64.powi(i32::from(level - b'0'))).sum();
        let uniform = plan_elements(&mesh).len() as f64;
        Ok((elements < WORTH_SHARE * uniform).then_some(pattern))
    }

    /// The model with the levels of the pattern on its mesh, if there is one.
    pub(super) fn with_levels(&self, model: Model) -> Result<Model, AccuracyError> {
        let Some(pattern) = &self.pattern else { return Ok(model) };
        let base = self.mesh_of(&Model { levels: None, ..model.clone() })?;
        Ok(Model { levels: Some(pattern.levels(&base)), ..model })
    }

    /// The sheet of a model.
    fn mesh_of(&self, model: &Model) -> Result<HexMesh, AccuracyError> {
        let plan = read_with(self.scene, &self.set_of(model)?)?;
        Ok(plan.simulation_setup(self.scene)?.body.mesh().clone())
    }

    /// Appends a run to the meshes. The part of its increments is the error that the run estimates of its own.
    pub(super) fn push_mesh(&mut self, index: usize) {
        self.meshes.push(index);
        self.set_increments_part(index);
    }

    fn set_increments_part(&mut self, index: usize) {
        let run = &self.runs[index];
        if let Some(found) = &run.record.increment_error {
            self.parts.set_increments(found.of_work, run.results());
        }
    }

    /// The error of the increments that the next run may have: that of run `last`, unless a quantity whose error is asked for
    /// as a length needs a far smaller one.
    pub(super) fn allowed_increments(&self, last: usize) -> f64 {
        let (now, results) = (self.runs[last].model.increment_error, self.runs[last].results());
        let fraction = |quantity: Quantity| {
            let effect = quantity.effect(results)?.max(f64::MIN_POSITIVE);
            Some(quantity.allowed(&self.asked, results)? / effect)
        };
        let smallest = Quantity::of(results).into_iter().filter_map(fraction).reduce(f64::min);
        let needed = smallest.map_or(now, increment_error_within);
        if needed < UNCHANGED_REL * now { needed } else { now }
    }

    /// Refines points and layers on the mesh of a run. Returns the model with all that are needed, and the errors of the first
    /// choices.
    fn choose(&mut self, base: usize) -> Result<(Model, Parts), AccuracyError> {
        let mut first_parts = Parts::default();
        // Two layers have twice the points: layers are judged with the points that are needed.
        let points = self.refine_choice(Choice::Points, base, &mut first_parts)?;
        let layers = self.refine_choice(Choice::Layers, points, &mut first_parts)?;
        let (before, after) = (self.runs[base].results(), self.runs[layers].results());
        let change = |quantity: Quantity| {
            let change = quantity.distance(before, after).unwrap_or(0.0);
            (quantity.name(), change * change)
        };
        self.changes = Quantity::of(before).into_iter().map(change).collect();
        Ok((self.runs[layers].model.clone(), first_parts))
    }

    /// Refines one choice of a run until its error is small, sets its part, and returns the index of the run with what is
    /// needed of it.
    fn refine_choice(
        &mut self,
        choice: Choice,
        base: usize,
        first_parts: &mut Parts,
    ) -> Result<usize, AccuracyError> {
        let mut coarse = base;
        loop {
            let model = self.runs[coarse].model.clone();
            let Some(finer) = choice.refined(&model) else { break };
            let Some(fine) = self.run_within_limits(choice, coarse, &finer)? else {
                if coarse == base {
                    self.unmeasured.push(choice.name().into());
                }
                break;
            };
            let [before, after] = choice.errors_over_change(&model, &finer);
            let runs = (self.runs[coarse].results().clone(), self.runs[fine].results().clone());
            if !self.parts.set(choice, before, (&runs.0, &runs.1)) {
                self.unmeasured.push(choice.name().into());
                break;
            }
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

    /// The run of a model that differs from run `other` by a choice; `None` where it exceeds a limit or does not converge.
    fn run_within_limits(
        &mut self,
        choice: Choice,
        other: usize,
        model: &Model,
    ) -> Result<Option<usize>, AccuracyError> {
        if self.exceeded(other, model)?.is_some() {
            return Ok(None);
        }
        let run = self.run(model.clone(), choice.name(), Some(other))?;
        Ok(Some(run).filter(|&run| self.runs[run].results.is_some()))
    }

    /// Measures the largest part of the quantities that are not accurate enough again, by a coarser choice on the mesh of
    /// run `last`: on a coarse mesh each choice shifts the roughness of forces, and its part is too large. False where there
    /// is nothing to measure.
    pub(super) fn measure_again(&mut self, last: usize) -> Result<bool, AccuracyError> {
        let Some(choice) = self.largest_part(last) else { return Ok(false) };
        self.measured_again.push((choice, last));
        let fine = self.runs[last].model.clone();
        let coarser = choice.coarsened(&fine);
        // Hexahedra need the layers of the scene.
        let fewest = self.chosen_after.map_or(1, |k| self.runs[k].model.layers);
        let Some(coarser) = coarser.filter(|model| model.layers >= fewest) else {
            return Ok(true);
        };
        if let Some(coarse) = self.run_within_limits(choice, last, &coarser)? {
            let [_, after] = choice.errors_over_change(&coarser, &fine);
            let runs = (self.runs[coarse].results().clone(), self.runs[last].results().clone());
            self.parts.set(choice, after, (&runs.0, &runs.1));
        }
        Ok(true)
    }

    /// The choice with the largest part, over what is allowed, that has not been measured on the mesh of run `last`.
    fn largest_part(&self, last: usize) -> Option<Choice> {
        let results = self.runs[last].results();
        let open = [Choice::Points, Choice::Layers]
            .into_iter()
            .filter(|c| !self.measured_again.contains(&(*c, last)));
        let share = |choice: &Choice| {
            let of = |quantity: &Quantity| {
                let allowed = quantity.allowed(&self.asked, results)?;
                let part = self.parts.of(quantity).get(choice.name()).copied()?;
                (self.parts.together(quantity) > allowed).then(|| part / allowed)
            };
            Quantity::of(results).iter().filter_map(of).fold(0.0, f64::max)
        };
        let shares = open.map(|choice| (share(&choice), choice)).filter(|(share, _)| *share > 0.0);
        shares.reduce(|a, b| if b.0 > a.0 { b } else { a }).map(|(_, choice)| choice)
    }

    /// Whether the part of a choice is a small share of all errors that are allowed.
    fn is_small(&self, choice: Choice, results: &Results) -> bool {
        Quantity::of(results).iter().all(|quantity| {
            let part = self.parts.of(quantity).get(choice.name()).copied().unwrap_or(0.0);
            let allowed = quantity.allowed(&self.asked, results);
            allowed.is_none_or(|allowed| part <= choice.share() * allowed)
        })
    }
}
