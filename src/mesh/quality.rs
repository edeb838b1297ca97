//! What a mesh is worth: area against the model's, conformity, corner Jacobians, shape of elements.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::{Element, MeshError, SurfaceMesh};
use crate::cad::Model;
use crate::cad::closest::ClosestPoint;
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
    /// The first of these.
    pub first_missing: Option<usize>,
    /// The face of the file whose elements are off most in area.
    pub worst_area: Option<FaceArea>,
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

/// Area of one face of the file: of one that was cut at creases, all parts together.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct FaceArea {
    /// The face, or the first of its parts.
    pub face: usize,
    /// Elements on it.
    pub elements: usize,
    /// Area of these (mm^2).
    pub area_mm2: f64,
    /// Area of the face (mm^2).
    pub model_area_mm2: f64,
}

impl FaceArea {
    /// What the elements have too much or too little (mm^2).
    #[must_use]
    pub fn off_mm2(&self) -> f64 {
        (self.area_mm2 - self.model_area_mm2).abs()
    }

    /// Whether that is more than `tolerance` of the face's area.
    #[must_use]
    pub fn is_off(&self, tolerance: f64) -> bool {
        let off = self.off_mm2();
        off.is_nan() || off > tolerance * self.model_area_mm2
    }

    fn place(&self, model: &Model) -> String {
        let source = model.faces.get(self.face).map_or("", |f| &f.source);
        format!("face {} ({source})", self.face)
    }
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
        let areas = face_areas(mesh, model);
        let model_area: f64 = areas.iter().map(|a| a.model_area_mm2).sum();
        let area = mesh.area();
        let (max_aspect, max_warp) = mesh.shape();
        let conformity = mesh.conformity();
        let mut faces: Vec<u32> = mesh.elements.iter().map(|e| e.face).collect();
        faces.sort_unstable();
        faces.dedup();
        let mut missing = areas.iter().filter(|a| a.elements == 0);
        let worst = areas.iter().max_by(|a, b| a.off_mm2().total_cmp(&b.off_mm2()));
        Self {
            vertices: mesh.vertices.len(),
            elements: mesh.elements.len(),
            triangles,
            quads: mesh.elements.len() - triangles,
            faces: faces.len(),
            missing: missing.clone().count(),
            first_missing: missing.next().map(|a| a.face),
            worst_area: worst.copied(),
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
        if let Some(first) = self.first_missing {
            let source = model.faces.get(first).map_or("", |f| &f.source);
            let found = format!(
                "{} of {} CAD faces have no elements, the first is face {first} ({source})",
                self.missing,
                model.faces.len()
            );
            return fail(found, "elements on all".into(), "mesh finer or use the other mesher");
        }
        if self.area_error.is_nan() || self.area_error.abs() > area_tolerance {
            let worst = self.worst_area.map_or_else(String::new, |w| {
                format!(
                    ", most on {}: {:.6} where it has {:.6}",
                    w.place(model),
                    w.area_mm2,
                    w.model_area_mm2
                )
            });
            let found = format!(
                "area {:.6} mm2 where the model has {:.6} ({:+.3} %){worst}",
                self.area_mm2,
                self.model_area_mm2,
                100.0 * self.area_error
            );
            let allowed = format!("{:.3} %", 100.0 * area_tolerance);
            return fail(found, allowed, "mesh finer, or examine the CAD file");
        }
        Ok(())
    }

    /// Refuses a mesh with a face whose area is off by more than `area_tolerance` (relative) and by more than a
    /// thousandth of the model's: outside programs mesh single faces without points inside, or not to their borders.
    ///
    /// # Errors
    /// [`MeshError::Check`] with the face.
    pub fn check_faces(&self, model: &Model, area_tolerance: f64) -> Result<(), MeshError> {
        let Some(worst) = self.worst_area else { return Ok(()) };
        if !worst.is_off(area_tolerance) || worst.off_mm2() <= 1e-3 * self.model_area_mm2 {
            return Ok(());
        }
        Err(MeshError::Check {
            found: format!(
                "{} has elements of {:.6} mm2 where the CAD has {:.6} ({:+.3} %)",
                worst.place(model),
                worst.area_mm2,
                worst.model_area_mm2,
                100.0 * (worst.area_mm2 / worst.model_area_mm2 - 1.0)
            ),
            allowed: format!("{:.3} %", 100.0 * area_tolerance),
            remedy: "mesh finer, choose another algorithm of gmsh, or use the built-in mesher",
        })
    }
}

/// Area of every face of the file and of the elements on it.
#[must_use]
pub fn face_areas(mesh: &SurfaceMesh, model: &Model) -> Vec<FaceArea> {
    let parts: Vec<f64> = model.faces.par_iter().map(|f| f.area(1e-6)).collect();
    let mut found = vec![(0, 0.0); parts.len()];
    for e in &mesh.elements {
        if let Some((count, area)) = found.get_mut(e.face as usize) {
            *count += 1;
            *area += mesh.element_area(e);
        }
    }
    let starts = (0..parts.len()).filter(|&f| model.cut_with(f).start == f);
    let area = |face: usize| {
        let all = model.cut_with(face);
        FaceArea {
            face,
            elements: all.clone().map(|f| found[f].0).sum(),
            area_mm2: all.clone().map(|f| found[f].1).sum(),
            model_area_mm2: all.map(|f| parts[f]).sum(),
        }
    };
    starts.map(area).collect()
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
