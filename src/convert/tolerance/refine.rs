//! A model, or one face of it, refined: divisions searched with faces held to shares of the tolerance, the whole made,
//! balanced and audited, and faces that still exceed it held to less.

use super::balance::balanced;
use super::error::ToleranceError;
use super::face_error::Judge;
use super::faults::{Faults, exceeding, folded, worst_place};
use super::goal::{Borders, Goal, Refined};
use super::scope::{Work, renumber};
use super::search::Search;
use super::state::State;
use crate::audit::{Audit, AuditOptions, AuditReport, audit};
use crate::convert::{ConvertOptions, ConvertReport, convert};
use crate::geometry::Vec3;
use crate::mesh::SurfaceMesh;
use crate::mesh::mapped::plan::Divisions;
use crate::tool::ToolModel;

/// Share of the tolerance beyond which it is only tried where the search was easy.
const LOOSE: f64 = 2.0;
/// Share of a face's error in the whole model from which on it is its own.
const OWN: f64 = 0.3;
/// Times the tolerance that balancing takes off at most.
const BALANCED: f64 = 5.0;
/// Times the faces that still exceed the tolerance in the whole model are held to less.
const ROUNDS: usize = 12;

/// Divisions of edges and insides of faces whose whole model was not what was asked for, and why.
struct Failed {
    divisions: (Divisions, Vec<usize>),
    faults: Faults,
}

impl Work<'_> {
    /// The fewest patches over the loosenings.
    pub(super) fn refine(&self, judge: &Judge<'_>, goal: &Goal) -> Result<Refined, ToleranceError> {
        self.refine_within(judge, goal, &self.borders(goal)).map(|found| found.0)
    }

    /// The same with sides no farther from the edges than `borders` [mm], and the state it is made from.
    pub(super) fn refine_within(
        &self,
        judge: &Judge<'_>,
        goal: &Goal,
        borders: &[f64],
    ) -> Result<(Refined, State), ToleranceError> {
        let loosenings: &[f64] = if goal.two_sided { judge.loosenings() } else { &[1.0] };
        let mut best: Option<(Refined, State)> = None;
        let mut last = None;
        let mut failed = Vec::new();
        for &share in loosenings.iter().rev() {
            let tries = if share > LOOSE { self.budget.is_easy() } else { self.budget.saves() };
            if best.is_some() && !tries {
                break;
            }
            let limit = best.as_ref().map_or(usize::MAX, |b| b.0.tool.patches.len());
            match self.held_to(judge, goal, (share, borders), (limit, &mut failed)) {
                Ok(Some(found)) => best = Some(found),
                Ok(None) => {}
                Err(ToleranceError::NotReached { .. }) if best.is_some() => {}
                Err(error) => {
                    let hopeless = match &error {
                        ToleranceError::NotReached { found, allowed, .. } => {
                            *found > BALANCED * allowed
                        }
                        _ => true,
                    };
                    last = Some(error);
                    if hopeless {
                        break;
                    }
                }
            }
        }
        match (best, last) {
            (Some(best), _) => Ok(best),
            (None, Some(error)) => Err(error),
            (None, None) => unreachable!("every loosening gives a model or an error"),
        }
    }

    /// Refines with faces held to `share` of the tolerance, and those that exceed it in the whole model to less;
    /// `None` when it takes as many patches as `limit`. States that `failed` are not made again.
    fn held_to(
        &self,
        judge: &Judge<'_>,
        goal: &Goal,
        (share, borders): (f64, &[f64]),
        (limit, failed): (usize, &mut Vec<Failed>),
    ) -> Result<Option<(Refined, State)>, ToleranceError> {
        let mut shares = vec![share; self.plan.model().faces.len()];
        let mut state: Option<State> = None;
        let mut last = None;
        for _ in 0..ROUNDS {
            let search = Search { plan: &self.plan, judge, goal, shares: &shares, borders };
            let next = state.take().map_or_else(|| search.fewest(), |state| search.grow(state));
            if next.patches() >= limit {
                return Ok(None);
            }
            if !search.keeps(&next) {
                return Err(last.unwrap_or_else(|| self.subject().given_up(goal, &next)));
            }
            let known = match failed.iter().position(|f| next.is_of(&f.divisions)) {
                Some(known) => known,
                None => {
                    let (refined, faults) = self.finish(&next, goal)?;
                    if faults.none() {
                        return Ok(Some((refined, next)));
                    }
                    last = Some(self.subject().not_reached(goal, &refined));
                    failed.push(Failed { divisions: next.key(), faults });
                    failed.len() - 1
                }
            };
            let (after, less) = self.tightened(&search, next, &failed[known].faults);
            if self.budget.is_spent() {
                break;
            }
            state = Some(after);
            less.into_iter().for_each(|(face, share)| shares[face] = share);
        }
        last.map_or(Ok(None), Err)
    }

    /// Where to go on from a state whose whole model has faults, and the faces to hold to less, with their shares.
    fn tightened(
        &self,
        search: &Search<'_>,
        state: State,
        faults: &Faults,
    ) -> (State, Vec<(usize, f64)>) {
        // Their sides on a crease keep to the normals of the face beyond as well, which they do not know alone.
        let beyond =
            |f: usize| faults.on_cad.iter().find(|o| o.0 == f && state.badness(f) < OWN * o.1);
        let at_border = faults.over.iter().filter_map(|over| beyond(over.0));
        let places: Vec<(usize, Vec3)> = at_border.filter_map(|o| Some((o.0, o.2?))).collect();
        let own = faults.over.iter().filter(|over| beyond(over.0).is_none());
        let less = own.map(|&over| self.less(&state, search.shares, over)).collect();
        let fine = faults.folded.is_empty() && places.is_empty();
        let state = if fine { state } else { search.finer(&state, &faults.folded, &places) };
        (state, less)
    }

    /// The face to hold to less as face `f` is `ratio` times the tolerance off, and to what share of the tolerance.
    fn less(&self, state: &State, shares: &[f64], (f, ratio): (usize, f64)) -> (usize, f64) {
        let face = self.cause(state, f, ratio);
        let held: f64 = shares[face] / ratio.clamp(1.02, 1.5);
        (face, held.min(state.badness(face) * 0.99))
    }

    /// The face to hold to less where face `f` is `ratio` times the tolerance off: itself, or when its own patches are much
    /// nearer, the worst of the faces beside it, for which its vertices were moved.
    fn cause(&self, state: &State, f: usize, ratio: f64) -> usize {
        if state.badness(f) >= OWN * ratio {
            return f;
        }
        let model = self.plan.model();
        let edges = model.faces[f].loops.iter().flat_map(|l| &l.uses).filter_map(|u| u.edge);
        let beside = edges.flat_map(|e| &model.edges[e].uses).map(|u| u[0]);
        let worse = |a: &usize, b: &usize| state.badness(*a).total_cmp(&state.badness(*b));
        beside.chain([f]).max_by(worse).unwrap_or(f)
    }

    /// The whole model of a state, balanced and audited, and what keeps it from the goal.
    fn finish(&self, state: &State, goal: &Goal) -> Result<(Refined, Faults), ToleranceError> {
        let mesh = self.plan.mesh(&state.minima, &state.density)?;
        self.budget.add_finished(mesh.elements.len() as u64);
        let (plain, found) = self.plain(&mesh, self.options, goal)?;
        let own = |face: usize| face - self.first as usize;
        let over = |report: &AuditReport| exceeding(report, goal).into_iter();
        let place = |f: usize| worst_place(&plain.audit, f).map(Vec3::from);
        let on_cad = over(&plain.audit).map(|(f, ratio)| (own(f), ratio, place(f))).collect();
        let refined =
            if goal.two_sided { self.two_sided(plain, found, self.options)? } else { plain };
        let over = over(&refined.audit).map(|(f, ratio)| (own(f), ratio)).collect();
        let folded = folded(&refined).into_iter().map(own).collect();
        Ok((refined, Faults { over, on_cad, folded }))
    }

    /// The model of a mesh, its vertices on the CAD, and its audit.
    pub(super) fn plain(
        &self,
        mesh: &SurfaceMesh,
        options: &ConvertOptions,
        goal: &Goal,
    ) -> Result<(Refined, Audit), ToleranceError> {
        self.audited(convert(self.plan.model(), mesh, options)?, goal)
    }

    /// A model of the plan's faces and its audit.
    pub(super) fn audited(
        &self,
        (mut tool, report): (ToolModel, ConvertReport),
        goal: &Goal,
    ) -> Result<(Refined, Audit), ToleranceError> {
        renumber(&mut tool, self.first);
        let asked = AuditOptions {
            tolerance_mm: goal.tol_mm.is_finite().then_some(goal.tol_mm),
            normal_tolerance_deg: goal.normal_deg.is_finite().then_some(goal.normal_deg),
            borders: self.is_whole(),
            ..AuditOptions::default()
        };
        let found = audit(&tool, self.reference, &asked)?;
        let (audit, borders) = (found.report.clone(), Borders::Conforming);
        let (moved_mm, slid_mm) = (0.0, 0.0);
        let saved_all = true;
        Ok((Refined { tool, report, audit, moved_mm, slid_mm, borders, saved_all }, found))
    }

    /// That model with its vertices balanced.
    pub(super) fn two_sided(
        &self,
        plain: Refined,
        found: Audit,
        options: &ConvertOptions,
    ) -> Result<Refined, ToleranceError> {
        let asked = AuditOptions {
            tolerance_mm: plain.audit.tolerance_mm,
            normal_tolerance_deg: plain.audit.normal_tolerance_deg,
            borders: self.is_whole(),
            ..AuditOptions::default()
        };
        balanced(plain, found, self, options, &asked)
    }
}
