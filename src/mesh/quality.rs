//! What a mesh is worth: area against the model's, conformity, corner Jacobians, shape of elements.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::{Element, MeshError, SurfaceMesh};
use crate::cad::Model;
use crate::cad::model::ClosestPoint;
use crate::geometry::Vec3;

/// Figures of a mesh, for people and programs.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct MeshReport {
    /// Vertices.
    pub vertices: usize,
    /// Elements.
    pub elements: usize,
    /// Triangles among them.
    pub triangles: usize,
    /// Quads among them.
    pub quads: usize,
    /// CAD faces with at least one element.
    pub faces: usize,
    /// Faces of the file without an element: of one that was cut at creases any part will do.
    pub missing: usize,
    /// Area of the elements, quads as two triangles (mm^2).
    pub area_mm2: f64,
    /// Area of the model (mm^2).
    pub model_area_mm2: f64,
    /// `area_mm2 / model_area_mm2 - 1`.
    pub area_error: f64,
    /// Smallest corner Jacobian: signed sine of an element's corner angle against the CAD normal there.
    pub min_corner_jacobian: f64,
    /// Elements with a corner turned against the CAD normal.
    pub inverted: usize,
    /// Largest ratio of longest to shortest side.
    pub max_aspect: f64,
    /// Largest warp of a quad: distance of its diagonals over its shortest diagonal.
    pub max_warp: f64,
    /// Sides used by one element only.
    pub free_sides: usize,
    /// Sides used by more than two elements, or twice in the same direction.
    pub irregular_sides: usize,
}

/// How often sides of elements are used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Conformity {
    /// Sides used once.
    pub free: usize,
    /// Sides used once in each direction.
    pub inner: usize,
    /// Sides used otherwise.
    pub irregular: usize,
}

impl SurfaceMesh {
    /// Area of the elements, quads as two triangles (mm^2).
    #[must_use]
    pub fn area(&self) -> f64 {
        self.elements.iter().map(|e| self.element_area(e)).sum()
    }

    fn element_area(&self, e: &Element) -> f64 {
        let p = self.corners(e);
        let half = |a: usize, b: usize, c: usize| 0.5 * (p[b] - p[a]).cross(&(p[c] - p[a])).norm();
        if p.len() == 3 { half(0, 1, 2) } else { half(0, 1, 2) + half(0, 2, 3) }
    }

    /// How often each side is used.
    #[must_use]
    pub fn conformity(&self) -> Conformity {
        let mut uses: BTreeMap<[u32; 2], [u32; 2]> = BTreeMap::new();
        for [a, b] in self.elements.iter().flat_map(Element::sides) {
            uses.entry([a.min(b), a.max(b)]).or_default()[usize::from(a > b)] += 1;
        }
        let mut out = Conformity::default();
        for n in uses.values() {
            match n {
                [1, 0] | [0, 1] => out.free += 1,
                [1, 1] => out.inner += 1,
                _ => out.irregular += 1,
            }
        }
        out
    }

    /// Largest ratio of longest to shortest side, and largest warp.
    fn shape(&self) -> (f64, f64) {
        let (mut aspect, mut warp) = (1.0f64, 0.0f64);
        for e in &self.elements {
            let p = self.corners(e);
            let length = |k: usize| (p[(k + 1) % p.len()] - p[k]).norm();
            let (mut low, mut high) = (f64::INFINITY, 0.0f64);
            (0..p.len()).for_each(|k| {
                low = low.min(length(k));
                high = high.max(length(k));
            });
            aspect = aspect.max(high / low);
            if let [a, b, c, d] = p[..] {
                let (ac, bd) = (c - a, d - b);
                let across = ac.cross(&bd);
                let gap = (b - a).dot(&across).abs() / across.norm().max(f64::MIN_POSITIVE);
                warp = warp.max(gap / ac.norm().min(bd.norm()).max(f64::MIN_POSITIVE));
            }
        }
        (aspect, warp)
    }
}

impl MeshReport {
    /// Measures `mesh` against the model it was made of.
    #[must_use]
    pub fn new(mesh: &SurfaceMesh, model: &Model) -> Self {
        let triangles = mesh.elements.iter().filter(|e| e.nodes().len() == 3).count();
        let corners = corner_jacobians(mesh, model);
        let areas: Vec<f64> = model.faces.par_iter().map(|f| f.area(1e-6)).collect();
        let model_area: f64 = areas.iter().sum();
        let area = mesh.area();
        let (max_aspect, max_warp) = mesh.shape();
        let conformity = mesh.conformity();
        let mut faces: Vec<u32> = mesh.elements.iter().map(|e| e.face).collect();
        faces.sort_unstable();
        faces.dedup();
        let has = |f: &usize| faces.binary_search(&(*f as u32)).is_ok();
        let missing = (0..model.faces.len())
            .filter(|&f| model.cut_with(f).start == f && !model.cut_with(f).any(|part| has(&part)))
            .count();
        Self {
            vertices: mesh.vertices.len(),
            elements: mesh.elements.len(),
            triangles,
            quads: mesh.elements.len() - triangles,
            faces: faces.len(),
            missing,
            area_mm2: area,
            model_area_mm2: model_area,
            area_error: area / model_area - 1.0,
            min_corner_jacobian: corners.iter().copied().fold(1.0, f64::min),
            inverted: corners.iter().filter(|&&j| j <= 0.0).count(),
            max_aspect,
            max_warp,
            free_sides: conformity.free,
            irregular_sides: conformity.irregular,
        }
    }

    /// Refuses a mesh that misses faces, is irregular, or whose area is off by more than `area_tolerance`
    /// (relative).
    ///
    /// # Errors
    /// [`MeshError::Check`] with what was found.
    pub fn check(&self, model: &Model, area_tolerance: f64) -> Result<(), MeshError> {
        let fail = |found: String, allowed: String, remedy| {
            Err(MeshError::Check { found, allowed, remedy })
        };
        if self.missing > 0 {
            let found = format!("{} of {} CAD faces have elements", self.faces, model.faces.len());
            return fail(found, "all".into(), "mesh finer or use the other mesher");
        }
        if self.area_error.is_nan() || self.area_error.abs() > area_tolerance {
            let found = format!(
                "area {:.6} mm2 where the model has {:.6} ({:+.3} %)",
                self.area_mm2,
                self.model_area_mm2,
                100.0 * self.area_error
            );
            let allowed = format!("{:.3} %", 100.0 * area_tolerance);
            return fail(
                found,
                allowed,
                "mesh finer, or check the CAD file with `kanagata inspect`",
            );
        }
        Ok(())
    }
}

/// Smallest corner Jacobian of every element: signed sine of the corner's angle against the normal of the
/// element's own CAD face there; corners without a normal (apexes) do not count.
#[must_use]
pub fn corner_jacobians(mesh: &SurfaceMesh, model: &Model) -> Vec<f64> {
    let index = ClosestPoint::new(model);
    let worst = |e: &Element| {
        let p = mesh.corners(e);
        let count = p.len();
        let corner = |k: usize| {
            let foot = index.closest_on_face(e.face as usize, &p[k]);
            let normal = foot.map_or_else(Vec3::zeros, |f| f.normal);
            let (before, after) = (&p[(k + count - 1) % count], &p[(k + 1) % count]);
            if normal.norm() > 0.5 {
                super::mapped::corner_sine(before, &p[k], after, &normal)
            } else {
                1.0
            }
        };
        (0..count).map(corner).fold(1.0, f64::min)
    };
    mesh.elements.par_iter().map(worst).collect()
}
