//! Evaluation of one face alone: errors of its patches for given divisions of its edges, by the audit. Results are
//! cached.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use rustc_hash::FxHashMap;

use super::budget::Budget;
use super::face_result::FaceResult;
use super::results::{Evaluated, Evaluations, Key};
use super::scope::{Scope, shift_face_numbers};
use super::slide_estimate::Neighbours;
use super::starts::patch_starts;
use crate::{ConvertOptions, convert};
use kanagata_audit::local::LocalReference;
use kanagata_audit::{AuditOptions, CadReference, audit_from};
use kanagata_cad::model::Edge;
use kanagata_geometry::{Aabb, Vec3};
use kanagata_mesh::mapped::is_crease;
use kanagata_mesh::mapped::plan::{Divisions, Plan};
use kanagata_mesh::{MeshFeet, SurfaceMesh};
use kanagata_tool::side::{SideCurve, side_ends, sides_used_once};
use kanagata_tool::{Patch, ToolModel};

/// Tolerance factors for faces evaluated alone, largest first: the vertex motion of the complete model reduces the
/// errors.
const TOLERANCE_FACTORS: [f64; 9] = [5.0, 3.5, 2.5, 2.0, 1.8, 1.6, 1.4, 1.2, 1.0];
/// Tolerance factors where the reduction by the vertex motion is estimated. They exceed 1 because adjacent faces share
/// vertices, so that the estimate is not exact.
const TOLERANCE_FACTORS_ESTIMATED: [f64; 3] = [1.6, 1.3, 1.0];

/// Number of patches of a face between whose points the largest normal error is searched, where normals have a
/// tolerance.
const REFINED_PATCHES: usize = 4;
/// Number of patches of a face whose worst points are known to the search.
const WORST_PATCHES: usize = 200;

/// Evaluates the faces of a plan.
pub(super) struct FaceEvaluator<'a> {
    plan: &'a Plan<'a>,
    options: ConvertOptions,
    reference: &'a CadReference<'a>,
    /// Number of the first face of the plan in the reference.
    first: u32,
    /// True when normals have a tolerance.
    normals: bool,
    /// Adjacent faces, if vertices may slide.
    neighbours: Option<&'a Neighbours>,
    /// True when errors are estimated after the vertex motion.
    estimates: bool,
    /// True when meshes have interior nodes that the coarsest ones leave out.
    interior_nodes: bool,
    /// For each edge of the plan, true when the distance of patch sides from it is measured. These are the edges at
    /// free borders and those that adjacent faces divide independently.
    measured_edges: &'a [bool],
    /// For each edge, true at a free border.
    free_edges: &'a [bool],
    /// For each edge, true when its faces meet at an angle.
    creases: Vec<bool>,
    /// Bounding boxes of the edges, widened by the tolerance of vertices on edges.
    boxes: Vec<Aabb>,
    cache: &'a Evaluations,
    /// Results of [`Self::denser`].
    densities: Mutex<FxHashMap<Key, Option<usize>>>,
    budget: &'a Budget,
}

impl<'a> FaceEvaluator<'a> {
    /// Prepares the evaluation of the faces of `scope` and starts a search of its budget. With `estimates`, errors are
    /// estimated after the vertex motion, where vertices may slide.
    pub fn new(scope: &'a Scope<'_>, measured_edges: &'a [bool], estimates: bool) -> Self {
        scope.budget.start_search();
        let options = ConvertOptions { sheet_side: None, flip: false, ..scope.options.clone() };
        let &Scope { ref plan, reference, first, normals, .. } = scope;
        let model = plan.model();
        let hulls = model.edges.iter().map(|e| Aabb::of_points(e.curve.points()));
        let size = hulls.fold(Aabb::EMPTY, |sum, hull| sum.union(&hull)).diagonal();
        let margin = 1e-6 * size + 2.0 * model.join_tolerance;
        let hull = |e: &Edge| Aabb::of_points(e.curve.points()).widened(margin);
        Self {
            plan,
            reference,
            options,
            first,
            normals,
            neighbours: scope.neighbours,
            estimates: estimates && scope.neighbours.is_some(),
            interior_nodes: !scope.mesh.fewest,
            measured_edges,
            free_edges: &scope.free_edges,
            creases: model.edges.iter().map(|e| is_crease(model, e)).collect(),
            boxes: model.edges.iter().map(hull).collect(),
            cache: &scope.evaluations,
            densities: Mutex::default(),
            budget: &scope.budget,
        }
    }

    /// Result of face `f` with these divisions of its edges and, inside, `density` divisions per quarter turn.
    pub fn evaluate(&self, f: usize, divisions: &Divisions, density: usize) -> Arc<FaceResult> {
        let key = self.key(f, divisions, density);
        let chosen = |found: &Evaluated| {
            Arc::clone(if self.estimates { &found.estimated } else { &found.plain })
        };
        let cached = |k: &Key| self.cache.lock().ok()?.get(k).map(chosen);
        if let Some(found) = cached(&key) {
            return found;
        }
        let mesh = self.plan.face(f, divisions, density).ok();
        let count = mesh.as_ref().map_or(0, |mesh| mesh.elements.len());
        let without_area =
            |mesh: &SurfaceMesh| mesh.elements.is_empty().then(|| Evaluated::without_patches(0.0));
        let found = mesh
            .and_then(|mesh| without_area(&mesh).or_else(|| self.evaluate_mesh(f, &mesh)))
            .unwrap_or_else(|| Evaluated::without_patches(f64::INFINITY));
        let result = chosen(&found);
        if let Ok(mut cache) = self.cache.lock()
            && cache.insert(key, found).is_none()
        {
            self.budget.add_evaluated(1 + count as u64);
        }
        result
    }

    /// The smallest density that gives face `f` another number of patches than `density`, in steps that double, up to
    /// `most`.
    pub fn denser(
        &self,
        f: usize,
        divisions: &Divisions,
        density: usize,
        most: usize,
    ) -> Option<usize> {
        let key = self.key(f, divisions, density);
        if let Some(known) = self.densities.lock().ok().and_then(|all| all.get(&key).copied()) {
            return known;
        }
        let count = |density| self.plan.face(f, divisions, density).map_or(0, |m| m.elements.len());
        let now = count(density);
        let larger = (0..usize::BITS).map(|k| density + (1 << k));
        let mut larger = larger.take_while(|&d| d <= most);
        let found = larger.find(|&d| count(d) != now);
        if let Ok(mut all) = self.densities.lock() {
            all.insert(key, found);
        }
        found
    }

    /// Key of the results of a face.
    fn key(&self, f: usize, divisions: &Divisions, density: usize) -> Key {
        let counts = self.edges(f).map(|e| divisions.counts[e]).collect();
        let differs = self.interior_nodes && self.plan.may_save_on(f);
        (f, counts, density, divisions.mapped[f], differs)
    }

    /// Work done and its limits.
    pub fn budget(&self) -> &Budget {
        self.budget
    }

    /// Result of a mesh of face `f`; `None` when its patches fold or cannot be made.
    fn evaluate_mesh(&self, f: usize, mesh: &SurfaceMesh) -> Option<Evaluated> {
        let (mut tool, made) = convert(self.plan.model(), mesh, &self.options).ok()?;
        let edge_deviations = self.edge_deviations(f, &tool, &mesh.feet);
        let starts = patch_starts(&tool, (self.plan.model(), 0), &mesh.feet);
        shift_face_numbers(&mut tool, self.first);
        if !made.folded.is_empty() {
            return None;
        }
        let local = LocalReference(self.reference);
        let found = audit_from(&tool, &local, &self.audit_options(), &starts).ok()?;
        let report = &found.report;
        if !report.folded.is_empty() {
            return None;
        }
        let edge = |side: &SideCurve<'_>, ends| self.edge_of_side(f, side, (ends, &mesh.feet));
        let error_mm = report.worst_mm();
        let estimated_mm = match self.neighbours {
            Some(n) => n.estimate_error(f, (&tool, &found), &self.options, edge).ok()?,
            None => error_mm,
        };
        let (crease_deviation_mm, at) = self.crease_deviation(f, &tool, (&made.redone, &mesh.feet));
        let worst: Vec<(Vec3, f64)> =
            report.worst.iter().map(|w| (w.point.into(), w.delta_mm.abs())).collect();
        let result = |error_mm: f64| FaceResult {
            patches: tool.patches.len(),
            error_mm,
            normal_deg: report.normal_max_deg,
            worst_points: match at.filter(|_| crease_deviation_mm > error_mm) {
                Some(at) => vec![(at, crease_deviation_mm)],
                None => worst.clone(),
            },
            crease_deviation_mm,
            edge_deviations: edge_deviations.clone(),
        };
        let [plain, estimated] = [error_mm, estimated_mm].map(|mm| Arc::new(result(mm)));
        Some(Evaluated { plain, estimated })
    }

    fn audit_options(&self) -> AuditOptions {
        AuditOptions {
            samples: 4,
            refine: if self.normals { REFINED_PATCHES } else { 0 },
            // In the complete model the errors of faces are rather larger.
            estimate: true,
            areas: false,
            borders: false,
            worst: WORST_PATCHES,
            ..AuditOptions::default()
        }
    }

    /// Measured edges of face `f`, each with the maximum distance of the patch sides on it [mm], at 7 interior points
    /// of a side.
    fn edge_deviations(&self, f: usize, tool: &ToolModel, feet: &MeshFeet) -> Vec<(usize, f64)> {
        const STEPS: usize = 8;
        let mut deviations: BTreeMap<usize, f64> =
            self.edges(f).filter(|&e| self.measured_edges[e]).map(|e| (e, 0.0)).collect();
        if deviations.is_empty() {
            return Vec::new();
        }
        let rings: Vec<&[u32]> = tool.corners.iter().map(|c| &c.vertices[..]).collect();
        for ((sides, p), ring) in sides_used_once(&rings).iter().zip(&tool.patches).zip(&rings) {
            for &side in sides {
                let curve = SideCurve::new(p, side);
                let ends = (side_ends(ring, side), feet);
                let Some(e) = self.edge_of_side(f, &curve, ends) else { continue };
                let Some(most) = deviations.get_mut(&e) else { continue };
                let steps = (1..STEPS).map(|k| curve.parameters(k as f64 / STEPS as f64));
                *most = steps.map(|at| self.edge_deviation(e, p, at)).fold(*most, f64::max);
            }
        }
        deviations.into_iter().collect()
    }

    /// Distance of a point of a patch, given by its parameters, from an edge [mm]. At a free border only the component
    /// within the tangent plane of the patch counts.
    fn edge_deviation(&self, e: usize, patch: &Patch, (eta, zeta): (f64, f64)) -> f64 {
        let at = patch.derivs(eta, zeta);
        let curve = &self.plan.model().edges[e].curve;
        let vector = curve.point(curve.closest(&at.s).0) - at.s;
        let normal = at.normal(eta, zeta).filter(|_| self.free_edges[e]);
        normal.map_or(vector, |n| vector - n * n.dot(&vector)).norm()
    }

    /// Maximum distance from their creases of sides that lost their curves [mm], and its position. `redone` lists the
    /// patches whose curves were replaced. Smooth edges are not considered: there the shape error is of second order in
    /// this distance.
    fn crease_deviation(
        &self,
        f: usize,
        tool: &ToolModel,
        (redone, feet): (&[u32], &MeshFeet),
    ) -> (f64, Option<Vec3>) {
        let none = (0.0, None);
        if redone.is_empty() {
            return none;
        }
        let rings: Vec<&[u32]> = tool.corners.iter().map(|c| &c.vertices[..]).collect();
        let once = sides_used_once(&rings);
        let sides =
            redone.iter().flat_map(|&k| once[k as usize].iter().map(move |&side| (k, side)));
        let deviation = |(k, side): (u32, usize)| {
            let curve = SideCurve::new(&tool.patches[k as usize], side);
            let middle = curve.point(0.5);
            let ends = side_ends(rings[k as usize], side);
            let edge = self.edge_of_side(f, &curve, (ends, feet)).filter(|&e| self.creases[e])?;
            Some((self.distance_to_edge(edge, &middle), Some(middle)))
        };
        sides
            .filter_map(deviation)
            .fold(none, |most, next| if next.0 > most.0 { next } else { most })
    }

    /// Distance of a point from an edge of the plan [mm].
    fn distance_to_edge(&self, e: usize, p: &Vec3) -> f64 {
        let curve = &self.plan.model().edges[e].curve;
        (curve.point(curve.closest(p).0) - p).norm()
    }

    /// Tolerance factors to try, largest first.
    pub fn tolerance_factors(&self) -> &'static [f64] {
        if self.estimates { &TOLERANCE_FACTORS_ESTIMATED } else { &TOLERANCE_FACTORS }
    }

    /// Edges of a face.
    fn edges(&self, f: usize) -> impl Iterator<Item = usize> + '_ {
        self.plan.model().faces[f].loops.iter().flat_map(|l| &l.uses).filter_map(|u| u.edge)
    }

    /// Edge of face `f` that contains both ends of a side; of several, the one closest to its middle. `ends` are the
    /// vertices of the side: an edge on which the mesher placed both is that edge, if there is no other such edge.
    fn edge_of_side(
        &self,
        f: usize,
        side: &SideCurve<'_>,
        (ends, feet): ([u32; 2], &MeshFeet),
    ) -> Option<usize> {
        let placed = |e: &usize| ends.iter().all(|&v| feet.on_edge(v, *e as u32).is_some());
        let mut known = self.edges(f).filter(placed);
        if let (Some(edge), None) = (known.next(), known.next()) {
            return Some(edge);
        }
        let [from, middle, to] = [0.0, 0.5, 1.0].map(|t| side.point(t));
        let reached =
            |e: &usize| [from, to].iter().all(|p| self.boxes[*e].distance_squared(p) == 0.0);
        // The middle decides between edges with the same ends.
        let distance = |e: usize, p: &Vec3| self.distance_to_edge(e, p);
        let score = |e: usize| distance(e, &from) + distance(e, &to) + 1e-3 * distance(e, &middle);
        let found = self.edges(f).filter(reached).map(|e| (score(e), e));
        found.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))).map(|f| f.1)
    }
}
