//! Faces divided independently: each has the divisions that its own error asks for. Its border then is a curve of its
//! own, and where two are farther apart than the tolerance, the one farther from the edge of the CAD gets closer.

use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

use super::budget::Budget;
use super::error::ToleranceError;
use super::face_error::Judge;
use super::faults::{exceeding, folded};
use super::goal::{Borders, Goal, Refined};
use super::scope::Work;
use crate::audit::{AuditOptions, audit, open_sides};
use crate::cad::Model;
use crate::cad::model::Edge;
use crate::convert::ground::{crease_count, looks_away};
use crate::convert::{ConvertOptions, ConvertReport};
use crate::mesh::mapped::plan::Plan;
use crate::mesh::mapped::{MappedOptions, mesh};
use crate::tool::build::{EdgeChoice, StraightEdge, build};
use crate::tool::{GivenCurve, ToolModel};

/// Times borders that do not meet are refined.
const ROUNDS: usize = 60;
/// Largest gap over the model's size where no tolerance for lengths is asked.
const GAP: f64 = 1e-3;
/// Largest gap over the model's size whatever the tolerance: tool files hold no more.
const LARGEST: f64 = 0.99 * crate::tool::file::BORDER_GAP_MAX_REL;
/// A side nearer to its edge than this share of the gap allowed is not what makes the gap.
const NEAR: f64 = 0.1;

/// One face as a model of its own.
struct Part {
    model: Model,
    /// Number of each edge in the whole model.
    edges: Vec<usize>,
    /// Edges that other faces use, and those at free borders.
    measured: Vec<bool>,
    /// Edges at free borders.
    free: Vec<bool>,
}

impl Part {
    fn new(whole: &Model, free: &[bool], f: usize) -> Self {
        let mut face = whole.faces[f].clone();
        let (mut edges, mut vertices) = (BTreeMap::new(), BTreeMap::new());
        let mut model = Model {
            name: whole.name.clone(),
            unit: whole.unit.clone(),
            unit_mm: whole.unit_mm,
            join_tolerance: whole.join_tolerance,
            ..Model::default()
        };
        for (l, trim) in face.loops.iter_mut().enumerate() {
            for (k, side) in trim.uses.iter_mut().enumerate() {
                let Some(e) = side.edge else { continue };
                let number = *edges.entry(e).or_insert_with(|| {
                    let old = &whole.edges[e];
                    let ends = old.vertices.map(|v| {
                        *vertices.entry(v).or_insert_with(|| {
                            model.vertices.push(whole.vertices[v]);
                            model.vertices.len() - 1
                        })
                    });
                    let curve = old.curve.clone();
                    model.edges.push(Edge { curve, vertices: ends, uses: Vec::new() });
                    model.edges.len() - 1
                });
                model.edges[number].uses.push([0, l, k]);
                side.edge = Some(number);
            }
        }
        let mut numbers = vec![0; edges.len()];
        edges.iter().for_each(|(&e, &number)| numbers[number] = e);
        let others = |&e: &usize| whole.edges[e].uses.iter().any(|u| u[0] != f);
        let measured = numbers.iter().map(|e| others(e) || free[*e]).collect();
        let free = numbers.iter().map(|&e| free[e]).collect();
        model.faces = vec![face];
        Self { model, edges: numbers, measured, free }
    }
}

/// What is asked of a face besides the goal.
#[derive(Clone)]
struct Ask {
    /// How far sides may be from each edge [mm].
    borders: Vec<f64>,
    /// Vertices stay on the CAD.
    on_cad: bool,
}

/// A face made.
struct Made {
    refined: Refined,
    /// Measured edges, each with how far sides on the CAD are from it [mm].
    off: Vec<(usize, f64)>,
}

impl Made {
    /// How far sides on the CAD are from an edge [mm].
    fn off(&self, edge: usize) -> f64 {
        self.off.iter().find(|o| o.0 == edge).map_or(0.0, |o| o.1)
    }
}

/// All faces, and what judges them.
pub(super) struct Apart<'a> {
    whole: &'a Work<'a>,
    parts: &'a [Part],
    works: &'a [Work<'a>],
    judges: &'a [Judge<'a>],
    turned: bool,
}

/// What `then` makes of the faces of a work's model taken apart.
///
/// # Errors
/// [`ToleranceError::Mesh`] when the whole model cannot be meshed.
pub(super) fn with<R>(
    whole: &Work<'_>,
    then: impl FnOnce(&Apart<'_>) -> R,
) -> Result<R, ToleranceError> {
    let model = whole.plan.model();
    let coarse = mesh(model, &MappedOptions { arc_divisions: 2, ..whole.mesh })?;
    let turned = looks_away(&coarse, whole.options.sheet_side);
    let flip = turned ^ whole.options.flip;
    let options = ConvertOptions { sheet_side: None, flip, ..whole.options.clone() };
    let parts: Vec<Part> =
        (0..model.faces.len()).map(|f| Part::new(model, &whole.free, f)).collect();
    let works = parts.iter().enumerate().map(|(f, part)| of_part(whole, part, f, &options));
    let works: Vec<Work<'_>> = works.collect::<Result<_, _>>()?;
    let judges: Vec<Judge<'_>> = works
        .iter()
        .zip(&parts)
        .map(|(work, part)| Judge::new(work, &part.measured, None))
        .collect();
    Ok(then(&Apart { whole, parts: &parts, works: &works, judges: &judges, turned }))
}

fn of_part<'a>(
    whole: &'a Work<'_>,
    part: &'a Part,
    face: usize,
    options: &'a ConvertOptions,
) -> Result<Work<'a>, ToleranceError> {
    let plan = Plan::new(&part.model, &whole.mesh)?;
    let faces = whole.plan.model().faces.len();
    Ok(Work {
        plan,
        reference: whole.reference,
        first: face as u32,
        mesh: whole.mesh,
        options,
        free: part.free.clone(),
        normals: whole.normals,
        budget: Arc::new(Budget::of_one(faces)),
    })
}

/// A face made anew for an edge whose gap is too large.
struct Trial {
    face: usize,
    ask: Ask,
    made: Made,
    /// How much nearer its sides are to the edge, for each patch it costs [mm].
    worth: f64,
}

impl Apart<'_> {
    /// The fewest patches over all faces, each divided for itself, whose borders meet.
    ///
    /// # Errors
    /// [`ToleranceError::NotReached`] names a face that cannot be brought within the tolerance,
    /// [`ToleranceError::Apart`] a place where borders cannot.
    pub(super) fn refined(&self, goal: &Goal) -> Result<Refined, ToleranceError> {
        let any = |work: &Work<'_>| Ask { borders: work.borders(goal), on_cad: false };
        let mut asks: Vec<Ask> = self.works.iter().map(any).collect();
        let first = asks.par_iter().enumerate().map(|(f, ask)| self.make(goal, f, ask));
        let mut made: Vec<Made> = first.collect::<Result<_, _>>()?;
        let size = self.whole.plan.model().bbox().diagonal();
        let allowed =
            if goal.tol_mm.is_finite() { goal.tol_mm.min(LARGEST * size) } else { GAP * size };
        let mut widest = None;
        for _ in 0..ROUNDS {
            let tool = joined(&made, self.whole.options)?;
            let open = open_sides(&tool, self.whole.reference, AuditOptions::default().samples);
            let gap = open.iter().max_by(|a, b| a.gap_mm.total_cmp(&b.gap_mm));
            if gap.is_none_or(|g| g.gap_mm <= allowed) {
                return self.finished(goal, tool, &made);
            }
            widest = gap.cloned();
            let mut wide: Vec<usize> =
                open.iter().filter(|o| o.gap_mm > allowed).map(|o| o.edge).collect();
            wide.sort_unstable();
            wide.dedup();
            let trials = self.tightened(goal, (&wide, allowed), &made, &asks);
            if trials.is_empty() {
                break;
            }
            for trial in self.of_faces(goal, trials) {
                (asks[trial.face], made[trial.face]) = (trial.ask, trial.made);
            }
        }
        let (found, at) = widest.map_or((f64::INFINITY, [0.0; 3]), |g| (g.gap_mm, g.at.into()));
        Err(ToleranceError::Apart { found, allowed, at })
    }

    fn make(&self, goal: &Goal, f: usize, ask: &Ask) -> Result<Made, ToleranceError> {
        let goal = Goal { two_sided: goal.two_sided && !ask.on_cad, ..*goal };
        let (refined, state) = self.works[f].refine_within(&self.judges[f], &goal, &ask.borders)?;
        Ok(Made { refined, off: state.off(0).to_vec() })
    }

    /// For each edge whose gap is too large one of its faces made anew: that whose sides come nearer to the edge for
    /// the fewest patches; or, where their distance is not what makes the gap, with its vertices on the CAD.
    fn tightened(
        &self,
        goal: &Goal,
        (wide, allowed): (&[usize], f64),
        made: &[Made],
        asks: &[Ask],
    ) -> Vec<Trial> {
        // By face: a judge's work must not depend on who else asks it.
        let by_face: Vec<Vec<(usize, Trial)>> = (0..self.parts.len())
            .into_par_iter()
            .map(|f| {
                let edges = &self.parts[f].edges;
                let at = |edge: &usize| edges.iter().position(|e| e == edge).map(|e| (*edge, e));
                let off = |e: usize| made[f].off(e);
                let far = wide.iter().filter_map(at).filter(|&(_, e)| off(e) > NEAR * allowed);
                far.filter_map(|(edge, e)| Some((edge, self.nearer(goal, (f, e), made, asks)?)))
                    .collect()
            })
            .collect();
        let mut best: BTreeMap<usize, Trial> = BTreeMap::new();
        for (edge, trial) in by_face.into_iter().flatten() {
            if best.get(&edge).is_none_or(|b| b.worth < trial.worth) {
                best.insert(edge, trial);
            }
        }
        let left = wide.iter().filter(|edge| !best.contains_key(edge));
        let on_cad: Vec<Trial> =
            left.filter_map(|&edge| self.on_cad(goal, edge, made, asks)).collect();
        best.into_values().chain(on_cad).collect()
    }

    /// One trial for each face: what all its edges ask at once, or, where that cannot be made, what is worth most.
    fn of_faces(&self, goal: &Goal, mut trials: Vec<Trial>) -> Vec<Trial> {
        trials.sort_by(|a, b| a.face.cmp(&b.face).then(b.worth.total_cmp(&a.worth)));
        let mut by_face: Vec<Vec<Trial>> = Vec::new();
        for trial in trials {
            match by_face.last_mut().filter(|of| of[0].face == trial.face) {
                Some(of) => of.push(trial),
                None => by_face.push(vec![trial]),
            }
        }
        let one = |mut of: Vec<Trial>| {
            let mut ask = of[0].ask.clone();
            for other in &of[1..] {
                let nearer = ask.borders.iter_mut().zip(&other.ask.borders);
                nearer.for_each(|(own, asked)| *own = own.min(*asked));
                ask.on_cad |= other.ask.on_cad;
            }
            let best = of.swap_remove(0);
            if of.is_empty() {
                return best;
            }
            match self.make(goal, best.face, &ask) {
                Ok(made) => Trial { ask, made, ..best },
                Err(_) => best,
            }
        };
        by_face.into_par_iter().map(one).collect()
    }

    /// A face made anew with its sides nearer to its edge `e`.
    fn nearer(
        &self,
        goal: &Goal,
        (face, e): (usize, usize),
        made: &[Made],
        asks: &[Ask],
    ) -> Option<Trial> {
        let off = |m: &Made| m.off(e);
        let before = &made[face];
        let mut ask = asks[face].clone();
        ask.borders[e] = ask.borders[e].min(0.99 * off(before));
        let after = self.make(goal, face, &ask).ok()?;
        let [more, fewer] = [&after, before].map(|m| m.refined.tool.patches.len() as f64);
        let worth = (off(before) - off(&after)) / (more - fewer).max(0.5);
        Some(Trial { face, ask, made: after, worth })
    }

    /// Of the faces at an edge that whose vertices are farthest off the CAD, made anew with all of them on it.
    fn on_cad(&self, goal: &Goal, edge: usize, made: &[Made], asks: &[Ask]) -> Option<Trial> {
        let moved = |f: usize| made[f].refined.moved_mm;
        let at = |f: &usize| self.parts[*f].edges.contains(&edge);
        let free = (0..self.parts.len()).filter(at);
        let free = free.filter(|&f| !asks[f].on_cad && moved(f) > 0.0);
        let face = free.max_by(|&a, &b| moved(a).total_cmp(&moved(b)).then(b.cmp(&a)))?;
        let ask = Ask { on_cad: true, ..asks[face].clone() };
        let made = self.make(goal, face, &ask).ok()?;
        Some(Trial { face, ask, made, worth: 0.0 })
    }

    /// The tool with its audit and what its faces' conversions found.
    fn finished(
        &self,
        goal: &Goal,
        mut tool: ToolModel,
        made: &[Made],
    ) -> Result<Refined, ToleranceError> {
        let (whole, turned) = (self.whole, self.turned);
        let asked = AuditOptions {
            tolerance_mm: goal.tol_mm.is_finite().then_some(goal.tol_mm),
            normal_tolerance_deg: goal.normal_deg.is_finite().then_some(goal.normal_deg),
            ..AuditOptions::default()
        };
        let audit = audit(&tool, whole.reference, &asked)?.report;
        // What is found between the points that were looked at is no more than this.
        tool.border_gap_mm = 1.01 * audit.jumps.border_gap_mm;
        let report = ConvertReport { turned, creases: crease_count(&tool), ..joined_reports(made) };
        let moved_mm = made.iter().fold(0.0f64, |m, f| m.max(f.refined.moved_mm));
        let slid_mm = made.iter().fold(0.0f64, |m, f| m.max(f.refined.slid_mm));
        let borders = Borders::Independent;
        let found = Refined { tool, report, audit, moved_mm, slid_mm, borders, saved_all: true };
        if exceeding(&found.audit, goal).is_empty() && folded(&found).is_empty() {
            Ok(found)
        } else {
            Err(whole.subject().not_reached(goal, &found))
        }
    }
}

/// What the conversions of all faces found, in the numbers of the one tool.
fn joined_reports(made: &[Made]) -> ConvertReport {
    let mut report = ConvertReport::default();
    let (mut vertices, mut patches) = (0, 0);
    for Made { refined: Refined { tool, report: own, .. }, .. } in made {
        let moved = |e: &StraightEdge| StraightEdge {
            patches: e.patches.iter().map(|k| k + patches).collect(),
            vertices: e.vertices.map(|k| k + vertices),
            fault: e.fault,
        };
        report.straight.extend(own.straight.iter().map(moved));
        report.bent.extend(own.bent.iter().map(moved));
        report.folded.extend(own.folded.iter().map(|k| k + patches));
        report.split += own.split;
        vertices += tool.vertices.len() as u32;
        patches += tool.patches.len() as u32;
    }
    report
}

/// The patches of all faces as one tool; none share a vertex.
fn joined(made: &[Made], options: &ConvertOptions) -> Result<ToolModel, ToleranceError> {
    let (mut vertices, mut normals) = (Vec::new(), Vec::new());
    let (mut corners, mut given) = (Vec::new(), Vec::new());
    for tool in made.iter().map(|m| &m.refined.tool) {
        let (v, n) = (vertices.len() as u32, normals.len() as u32);
        vertices.extend(&tool.vertices);
        normals.extend(&tool.normals);
        for patch in &tool.corners {
            let mut patch = patch.clone();
            patch.vertices.iter_mut().for_each(|k| *k += v);
            patch.normals.iter_mut().for_each(|k| *k += n);
            corners.push(patch);
        }
        let moved = |g: &GivenCurve| GivenCurve { vertices: g.vertices.map(|k| k + v), c: g.c };
        given.extend(tool.curves.iter().map(moved));
    }
    let choice = EdgeChoice { rule: options.edges, given };
    let built = build(options.name.clone(), options.kind, vertices, normals, corners, choice);
    Ok(built.map_err(crate::convert::ConvertError::from)?.0)
}
