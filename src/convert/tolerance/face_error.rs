//! One face judged alone: its patches for given divisions of its edges, audited. Answers are kept.

use std::collections::BTreeMap;
use std::sync::Mutex;

use rustc_hash::FxHashMap;

use super::budget::Budget;
use super::figures::Figures;
use super::scope::{Work, renumber};
use super::slide_estimate::Neighbours;
use crate::audit::{AuditOptions, CadReference, audit};
use crate::cad::model::Edge;
use crate::convert::{ConvertOptions, convert};
use crate::geometry::{Aabb, Vec3};
use crate::mesh::SurfaceMesh;
use crate::mesh::mapped::is_crease;
use crate::mesh::mapped::plan::{Divisions, Plan};
use crate::tool::side::{SideCurve, sides_used_once};
use crate::tool::{Patch, ToolModel};

/// Shares of the tolerance that faces judged alone are held to, largest first: balancing takes the rest off.
const LOOSENINGS: [f64; 9] = [5.0, 3.5, 2.5, 2.0, 1.8, 1.6, 1.4, 1.2, 1.0];
/// The same where what balancing takes off is foreseen: not all of it, as faces share vertices.
const FORESEEN: [f64; 3] = [1.6, 1.3, 1.0];

/// Divisions of the face's edges in loop order, density, mapped.
type Key = (usize, Vec<usize>, usize, bool);

/// Judges faces.
pub(super) struct Judge<'a> {
    plan: &'a Plan<'a>,
    reference: &'a CadReference<'a>,
    options: ConvertOptions,
    /// Number of the plan's first face in the reference.
    first: u32,
    /// Whether normals have a tolerance.
    normals: bool,
    /// The faces around each one, where errors are those that moving vertices leaves.
    neighbours: Option<&'a Neighbours>,
    /// Edges of the plan's model from which the distance of the patches' sides is measured: those at free borders and those
    /// that other faces divide in their own way.
    measured: &'a [bool],
    /// Edges at free borders.
    free: &'a [bool],
    /// Whether the faces at each edge meet at an angle.
    creases: Vec<bool>,
    /// Boxes around its edges, a little wider.
    boxes: Vec<Aabb>,
    known: Mutex<FxHashMap<Key, Figures>>,
    budget: &'a Budget,
}

impl<'a> Judge<'a> {
    pub fn new(
        work: &'a Work<'_>,
        measured: &'a [bool],
        neighbours: Option<&'a Neighbours>,
    ) -> Self {
        work.budget.begin();
        let options = ConvertOptions { sheet_side: None, flip: false, ..work.options.clone() };
        let &Work { ref plan, reference, first, normals, .. } = work;
        let model = plan.model();
        let near = 1e-6 * model.bbox().diagonal() + 2.0 * model.join_tolerance;
        let hull = |e: &Edge| Aabb::of_points(e.curve.points()).widened(near);
        Self {
            plan,
            reference,
            options,
            first,
            normals,
            neighbours,
            measured,
            free: &work.free,
            creases: model.edges.iter().map(|e| is_crease(model, e)).collect(),
            boxes: model.edges.iter().map(hull).collect(),
            known: Mutex::default(),
            budget: &work.budget,
        }
    }

    /// Figures of face `f`.
    pub fn of(&self, f: usize, divisions: &Divisions, density: usize) -> Figures {
        let counts = self.edges(f).map(|e| divisions.counts[e]).collect();
        let key: Key = (f, counts, density, divisions.mapped[f]);
        let known = |k: &Key| self.known.lock().ok()?.get(k).cloned();
        if let Some(found) = known(&key) {
            return found;
        }
        let mesh = self.plan.face(f, divisions, density).ok();
        let work = mesh.as_ref().map_or(0, |mesh| mesh.elements.len());
        let bare = |mesh: &SurfaceMesh| mesh.elements.is_empty().then_some(Figures::bare(0.0));
        let found = mesh
            .and_then(|mesh| bare(&mesh).or_else(|| self.judge(f, &mesh)))
            .unwrap_or(Figures::bare(f64::INFINITY));
        if let Ok(mut known) = self.known.lock()
            && known.insert(key, found.clone()).is_none()
        {
            self.budget.add(1 + work as u64);
        }
        found
    }

    /// Work done so far, and its limits.
    pub fn budget(&self) -> &Budget {
        self.budget
    }

    /// Figures of one face's mesh; none when its patches fold or cannot be made.
    fn judge(&self, f: usize, mesh: &SurfaceMesh) -> Option<Figures> {
        let (mut tool, made) = convert(self.plan.model(), mesh, &self.options).ok()?;
        let off = self.off(f, &tool);
        renumber(&mut tool, self.first);
        if !made.folded.is_empty() {
            return None;
        }
        let options = AuditOptions {
            samples: 4,
            refine: 4,
            refine_normals: self.normals,
            borders: false,
            ..AuditOptions::default()
        };
        let found = audit(&tool, self.reference, &options).ok()?;
        let report = &found.report;
        if !report.folded.is_empty() {
            return None;
        }
        let edge = |side: &SideCurve<'_>| self.edge(f, side);
        let error_mm = match self.neighbours {
            Some(n) => n.foreseen(f, (&tool, &found), &self.options, edge).ok()?,
            None => report.worst_mm(),
        };
        let (cut_mm, at) = self.cut_off(f, &tool, &made.redone);
        let worst = report.worst.first().map(|w| w.point.into());
        Some(Figures {
            patches: tool.patches.len(),
            error_mm,
            normal_deg: report.normal_max_deg,
            worst: if cut_mm > error_mm { at } else { worst },
            cut_mm,
            off,
        })
    }

    /// How far the sides of the patches of face `f` are from its edges that are measured, on these [mm].
    fn off(&self, f: usize, tool: &ToolModel) -> Vec<(usize, f64)> {
        const STEPS: usize = 8;
        let mut off: BTreeMap<usize, f64> =
            self.edges(f).filter(|&e| self.measured[e]).map(|e| (e, 0.0)).collect();
        if off.is_empty() {
            return Vec::new();
        }
        let rings: Vec<&[u32]> = tool.corners.iter().map(|c| &c.vertices[..]).collect();
        for (sides, p) in sides_used_once(&rings).iter().zip(&tool.patches) {
            for curve in sides.iter().map(|&side| SideCurve::new(p, side)) {
                let Some(e) = self.edge(f, &curve) else { continue };
                let Some(most) = off.get_mut(&e) else { continue };
                let steps = (1..STEPS).map(|k| curve.parameters(k as f64 / STEPS as f64));
                *most = steps.map(|at| self.beside(e, p, at)).fold(*most, f64::max);
            }
        }
        off.into_iter().collect()
    }

    /// Distance of a point of a patch, given by its parameters, from an edge [mm]: from one at a free border within the
    /// patch.
    fn beside(&self, e: usize, patch: &Patch, (eta, zeta): (f64, f64)) -> f64 {
        let at = patch.derivs(eta, zeta);
        let curve = &self.plan.model().edges[e].curve;
        let away = curve.point(curve.closest(&at.s).0) - at.s;
        let normal = at.normal(eta, zeta).filter(|_| self.free[e]);
        normal.map_or(away, |n| away - n * n.dot(&away)).norm()
    }

    /// How far sides that lost their curves are from the edges they are on [mm], and where that is most. Where faces run on
    /// smoothly it takes them off their surfaces by its square only.
    fn cut_off(&self, f: usize, tool: &ToolModel, redone: &[u32]) -> (f64, Option<Vec3>) {
        let none = (0.0, None);
        if redone.is_empty() {
            return none;
        }
        let rings: Vec<&[u32]> = tool.corners.iter().map(|c| &c.vertices[..]).collect();
        let once = sides_used_once(&rings);
        let sides =
            redone.iter().flat_map(|&k| once[k as usize].iter().map(move |&side| (k, side)));
        let curves = sides.map(|(k, side)| SideCurve::new(&tool.patches[k as usize], side));
        let off = |side: SideCurve<'_>| {
            let middle = side.point(0.5);
            let edge = self.edge(f, &side).filter(|&e| self.creases[e])?;
            Some((self.far(edge, &middle), Some(middle)))
        };
        curves.filter_map(off).fold(none, |most, next| if next.0 > most.0 { next } else { most })
    }

    /// Distance of a point from an edge of the plan's model [mm].
    fn far(&self, e: usize, p: &Vec3) -> f64 {
        let curve = &self.plan.model().edges[e].curve;
        (curve.point(curve.closest(p).0) - p).norm()
    }

    /// Shares of the tolerance that faces are held to.
    pub fn loosenings(&self) -> &'static [f64] {
        if self.neighbours.is_some() { &FORESEEN } else { &LOOSENINGS }
    }

    /// Edges of a face.
    fn edges(&self, f: usize) -> impl Iterator<Item = usize> + '_ {
        self.plan.model().faces[f].loops.iter().flat_map(|l| &l.uses).filter_map(|u| u.edge)
    }

    /// The edge of face `f` that both ends of a side are on; of several the one its middle is nearest to.
    fn edge(&self, f: usize, side: &SideCurve<'_>) -> Option<usize> {
        let [from, middle, to] = [0.0, 0.5, 1.0].map(|t| side.point(t));
        let reached =
            |e: &usize| [from, to].iter().all(|p| self.boxes[*e].distance_squared(p) == 0.0);
        // The middle decides between edges of the same ends.
        let away = |e: usize| self.far(e, &from) + self.far(e, &to) + 1e-3 * self.far(e, &middle);
        let found = self.edges(f).filter(reached).map(|e| (away(e), e));
        found.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))).map(|f| f.1)
    }
}
