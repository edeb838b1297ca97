//! As few patches as a tolerance allows: divisions of each chain of opposite edges are raised where the audit of a
//! face says so, in the direction that buys most, lowered again where they are not needed, and the vertices are
//! balanced about the CAD so that the error has two sides.
//!
//! - [`search`]: which divisions; every face is judged alone, by the audit of its own patches
//! - [`balance`]: vertices moved along their normals
//! - [`uniform`]: meshes of one division of a quarter turn, taken where they have fewer patches
//!
//! The model is conforming; its largest error is the audit's, of the finished model.

pub mod balance;
mod face;
mod search;
mod uniform;

use crate::audit::{Audit, AuditError, AuditOptions, AuditReport, CadReference, audit};
use crate::cad::Model;
use crate::mesh::mapped::MappedOptions;
use crate::mesh::mapped::plan::Plan;
use crate::mesh::{MeshError, SurfaceMesh};
use crate::tool::ToolModel;

use super::{ConvertError, ConvertOptions, ConvertReport, convert};
use balance::balanced;
use face::Judge;
use search::{Search, State};

/// What a model is refined to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    /// Largest |shape error| (Eq. 24) [mm], > 0; infinite = any.
    pub tol_mm: f64,
    /// Largest normal error [degrees], > 0; infinite = any.
    pub normal_deg: f64,
    /// Vertices may leave the CAD along their normals, so that the error has two sides. Those on planes stay.
    pub two_sided: bool,
}

/// A model refined to a goal.
#[derive(Debug, Clone)]
pub struct Refined {
    /// The model.
    pub tool: ToolModel,
    /// What its conversion found.
    pub report: ConvertReport,
    /// Its audit.
    pub audit: AuditReport,
    /// Largest distance that a vertex was moved off the CAD [mm].
    pub moved_mm: f64,
}

/// Why there is no model within the tolerance.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum ToleranceError {
    /// A tolerance that is no positive number, or none at all.
    #[error("{what} is {found}; allowed: a number above zero")]
    Goal {
        /// Its name.
        what: &'static str,
        /// What was given.
        found: f64,
    },
    /// The tolerance was not reached.
    #[error(
        "{source_entity} (face {face}) still has {found:.3e} {unit} with {patches} patches; asked: {allowed:.3e}; allow more, or repair the face in the CAD"
    )]
    NotReached {
        /// Face with the largest error.
        face: usize,
        /// Its entity in the CAD file.
        source_entity: String,
        /// Error found.
        found: f64,
        /// Error allowed.
        allowed: f64,
        /// mm or degrees.
        unit: &'static str,
        /// Patches of the best model found.
        patches: usize,
    },
    /// A face of which no patches come out sound.
    #[error(
        "{source_entity} (face {face}): its patches fold or cannot be made, even with its border divided ten times as finely; repair the face in the CAD, or convert with --arc-divisions and --allow-folds to see where"
    )]
    NoPatches {
        /// The face.
        face: usize,
        /// Its entity in the CAD file.
        source_entity: String,
    },
    /// So few patches are not possible.
    #[error("the coarsest model has {least} patches; allowed with --patches: at least so many")]
    TooFew {
        /// Patches of the coarsest model.
        least: usize,
    },
    /// No mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// No tool model.
    #[error(transparent)]
    Convert(#[from] ConvertError),
    /// No audit.
    #[error(transparent)]
    Audit(#[from] AuditError),
}

/// Shares of the tolerance that faces judged alone are held to, largest first: balancing takes the rest off.
const LOOSENINGS: [f64; 6] = [2.0, 1.8, 1.6, 1.4, 1.2, 1.0];
/// Times the faces that still exceed the tolerance in the whole model are held to less.
const ROUNDS: usize = 12;

/// Converts `model` with as few patches as keep `goal`.
///
/// # Errors
/// [`ToleranceError::NotReached`] names the face that cannot be brought within it.
pub fn to_tolerance(
    model: &Model,
    mesh: &MappedOptions,
    options: &ConvertOptions,
    goal: &Goal,
) -> Result<Refined, ToleranceError> {
    for (what, found) in [("--tol", goal.tol_mm), ("--normal-tol", goal.normal_deg)] {
        if found.is_nan() || found <= 0.0 {
            return Err(ToleranceError::Goal { what, found });
        }
    }
    let work = Work::new(model, mesh, options)?;
    let judge = Judge::new(&work.plan, &work.reference, options);
    let refined = work.refine(&judge, goal);
    let limit = refined.as_ref().map_or(uniform::MOST, |found| found.tool.patches.len());
    work.uniform(goal, limit).map_or(refined, Ok)
}

/// Converts `model` with at most `patches` patches and as small an error as it can.
///
/// # Errors
/// [`ToleranceError::TooFew`] when even the coarsest model has more.
pub fn to_patches(
    model: &Model,
    mesh: &MappedOptions,
    options: &ConvertOptions,
    patches: usize,
    two_sided: bool,
) -> Result<Refined, ToleranceError> {
    let work = Work::new(model, mesh, options)?;
    let judge = Judge::new(&work.plan, &work.reference, options);
    let goal = |tol_mm: f64| Goal { tol_mm, normal_deg: f64::INFINITY, two_sided };
    let mut high = crate::geometry::Aabb::of_points(&model.vertices).diagonal();
    let mut best = work.refine(&judge, &goal(high))?;
    if best.tool.patches.len() > patches {
        return Err(ToleranceError::TooFew { least: best.tool.patches.len() });
    }
    high = best.audit.worst_mm();
    let mut low = 0.0;
    for _ in 0..20 {
        if high <= 1e-9 {
            break;
        }
        let tol = if low > 0.0 { (low * high).sqrt() } else { high / 8.0 };
        match work.refine(&judge, &goal(tol)) {
            Ok(found) if found.tool.patches.len() <= patches => {
                high = tol;
                if found.audit.worst_mm() < best.audit.worst_mm() {
                    best = found;
                }
            }
            Ok(_) | Err(ToleranceError::NotReached { .. } | ToleranceError::NoPatches { .. }) => {
                low = tol
            }
            Err(other) => return Err(other),
        }
        if low > 0.0 && high < 1.02 * low {
            break;
        }
    }
    Ok(best)
}

struct Work<'a> {
    plan: Plan<'a>,
    reference: CadReference<'a>,
    mesh: MappedOptions,
    options: &'a ConvertOptions,
}

impl<'a> Work<'a> {
    fn new(
        model: &'a Model,
        mesh: &MappedOptions,
        options: &'a ConvertOptions,
    ) -> Result<Self, MeshError> {
        let coarse = MappedOptions { arc_divisions: 1, ..*mesh };
        let plan = Plan::new(model, &coarse)?;
        Ok(Self { plan, reference: CadReference::new(model), mesh: coarse, options })
    }

    /// The fewest patches over the loosenings.
    fn refine(&self, judge: &Judge<'_>, goal: &Goal) -> Result<Refined, ToleranceError> {
        let loosenings: &[f64] = if goal.two_sided { &LOOSENINGS } else { &[1.0] };
        let mut best: Option<Refined> = None;
        let mut last = None;
        for &share in loosenings.iter().rev() {
            if best.is_some() && judge.spent() >= search::ENOUGH {
                break;
            }
            let limit = best.as_ref().map_or(usize::MAX, |b| b.tool.patches.len());
            match self.held_to(judge, goal, share, limit) {
                Ok(Some(found)) => best = Some(found),
                Ok(None) => {}
                Err(ToleranceError::NotReached { .. }) if best.is_some() => {}
                Err(error) => {
                    // Twice the tolerance is not within what balancing takes off.
                    let hopeless = match &error {
                        ToleranceError::NotReached { found, allowed, .. } => {
                            *found > LOOSENINGS[0] * allowed
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
    /// `None` when it takes as many patches as `limit`.
    fn held_to(
        &self,
        judge: &Judge<'_>,
        goal: &Goal,
        share: f64,
        limit: usize,
    ) -> Result<Option<Refined>, ToleranceError> {
        let faces = self.plan.model().faces.len();
        let mut shares = vec![share; faces];
        let mut state: Option<State> = None;
        let mut last = None;
        for _ in 0..ROUNDS {
            let search = Search { plan: &self.plan, judge, goal, shares: &shares };
            let next = match state.take() {
                Some(state) => search.grow(state),
                None => search.fewest(),
            };
            if next.patches() >= limit {
                return Ok(None);
            }
            if !search.keeps(&next) {
                return Err(match last {
                    Some(last) => self.not_reached(goal, &last),
                    None => self.given_up(goal, &next),
                });
            }
            let refined = self.finish(&next, goal)?;
            let (over, folded) = (exceeding(&refined.audit, goal), folded(&refined));
            if over.is_empty() && folded.is_empty() {
                return Ok(Some(refined));
            }
            let less = |&(face, ratio): &(usize, f64)| {
                let held: f64 = shares[face] / ratio.clamp(1.02, 1.5);
                (face, held.min(next.badness(face) * 0.99))
            };
            let less: Vec<(usize, f64)> = over.iter().map(less).collect();
            let unfolded = (!folded.is_empty()).then(|| search.unfolded(&next, &folded));
            state = Some(unfolded.unwrap_or(next));
            less.into_iter().for_each(|(face, share)| shares[face] = share);
            last = Some(refined);
        }
        Err(last.map_or(ToleranceError::TooFew { least: 0 }, |last| self.not_reached(goal, &last)))
    }

    /// The whole model of a state, balanced and audited.
    fn finish(&self, state: &State, goal: &Goal) -> Result<Refined, ToleranceError> {
        let mesh = self.plan.mesh(&state.minima, &state.density)?;
        let (plain, found) = self.plain(&mesh, self.options, goal)?;
        if goal.two_sided { self.two_sided(plain, found, self.options) } else { Ok(plain) }
    }

    /// The model of a mesh, its vertices on the CAD, and its audit.
    fn plain(
        &self,
        mesh: &SurfaceMesh,
        options: &ConvertOptions,
        goal: &Goal,
    ) -> Result<(Refined, Audit), ToleranceError> {
        let (tool, report) = convert(self.plan.model(), mesh, options)?;
        let asked = AuditOptions {
            tolerance_mm: goal.tol_mm.is_finite().then_some(goal.tol_mm),
            normal_tolerance_deg: goal.normal_deg.is_finite().then_some(goal.normal_deg),
            ..AuditOptions::default()
        };
        let found = audit(&tool, &self.reference, &asked)?;
        Ok((Refined { tool, report, audit: found.report.clone(), moved_mm: 0.0 }, found))
    }

    /// That model with its vertices balanced.
    fn two_sided(
        &self,
        plain: Refined,
        found: Audit,
        options: &ConvertOptions,
    ) -> Result<Refined, ToleranceError> {
        let asked = AuditOptions {
            tolerance_mm: plain.audit.tolerance_mm,
            normal_tolerance_deg: plain.audit.normal_tolerance_deg,
            ..AuditOptions::default()
        };
        balanced(plain, found, self.plan.model(), &self.reference, options, &asked)
    }

    /// Why the search ended before every face kept its share: the face that is farthest from the tolerance.
    fn given_up(&self, goal: &Goal, state: &State) -> ToleranceError {
        let worst = (0..self.plan.model().faces.len())
            .max_by(|&a, &b| state.badness(a).total_cmp(&state.badness(b)))
            .unwrap_or(0);
        let (mm, deg) = state.figures(worst);
        let source_entity = self.plan.model().faces[worst].source.clone();
        if !mm.is_finite() {
            return ToleranceError::NoPatches { face: worst, source_entity };
        }
        let by_length = mm / goal.tol_mm >= deg / goal.normal_deg;
        ToleranceError::NotReached {
            face: worst,
            source_entity,
            found: if by_length { mm } else { deg },
            allowed: if by_length { goal.tol_mm } else { goal.normal_deg },
            unit: if by_length { "mm" } else { "degrees" },
            patches: state.patches(),
        }
    }

    /// Why a whole model is not what was asked for: its face farthest above the tolerance, or one that folds.
    fn not_reached(&self, goal: &Goal, refined: &Refined) -> ToleranceError {
        let over = exceeding(&refined.audit, goal);
        let worst = over.iter().max_by(|a, b| a.1.total_cmp(&b.1)).map(|w| w.0);
        let worst = worst.or(folded(refined).first().copied()).unwrap_or(0);
        let audit = refined.audit.faces.iter().find(|f| f.face as usize == worst);
        let (mm, deg) =
            audit.map_or((0.0, 0.0), |f| (f.max_mm.abs().max(f.min_mm.abs()), f.normal_max_deg));
        let source_entity = self.plan.model().faces[worst].source.clone();
        if mm <= goal.tol_mm && deg <= goal.normal_deg {
            return ToleranceError::NoPatches { face: worst, source_entity };
        }
        let by_length = mm / goal.tol_mm >= deg / goal.normal_deg;
        ToleranceError::NotReached {
            face: worst,
            source_entity,
            found: if by_length { mm } else { deg },
            allowed: if by_length { goal.tol_mm } else { goal.normal_deg },
            unit: if by_length { "mm" } else { "degrees" },
            patches: refined.tool.patches.len(),
        }
    }
}

/// Faces above the tolerance, and how many times.
fn exceeding(report: &AuditReport, goal: &Goal) -> Vec<(usize, f64)> {
    let ratio = |f: &crate::audit::report::FaceAudit| {
        let mm = f.max_mm.abs().max(f.min_mm.abs()) / goal.tol_mm;
        mm.max(f.normal_max_deg / goal.normal_deg)
    };
    let all = report.faces.iter().map(|f| (f.face as usize, ratio(f)));
    all.filter(|(_, r)| *r > 1.0).collect()
}

/// Faces with a folded patch, each once.
fn folded(found: &Refined) -> Vec<usize> {
    let patches = found.report.folded.iter().chain(&found.audit.folded);
    let mut faces: Vec<usize> = patches.map(|&k| found.tool.faces[k as usize] as usize).collect();
    faces.sort_unstable();
    faces.dedup();
    faces
}
