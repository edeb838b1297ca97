//! Mesh quality: area error, conformity, corner Jacobians, element shapes.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::{Element, MeshError, SurfaceMesh};
use kanagata_cad::Model;
use kanagata_cad::closest::ClosestPoint;
use kanagata_geometry::Vec3;

/// Quality measures of a mesh.
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
    /// Number of faces of the file without an element; a face split along creases needs elements on any of its parts.
    pub missing: usize,
    /// The first missing face.
    pub first_missing: Option<usize>,
    /// The face of the file with the largest area error.
    pub worst_area: Option<FaceArea>,
    /// Area of the elements, quadrilaterals as two triangles [mm^2].
    pub area_mm2: f64,
    /// Area of the model [mm^2].
    pub model_area_mm2: f64,
    /// `area_mm2 / model_area_mm2 - 1`.
    pub area_error: f64,
    /// Smallest corner Jacobian: signed sine of an element's corner angle relative to the CAD normal.
    pub min_corner_jacobian: f64,
    /// Number of elements with a corner inverted relative to the CAD normal.
    pub inverted: usize,
    /// Largest ratio of longest to shortest side.
    pub max_aspect: f64,
    /// Largest warpage of a quadrilateral: distance of its diagonals over the shorter diagonal.
    pub max_warp: f64,
    /// Number of sides used by one element only.
    pub free_sides: usize,
    /// Number of sides used by more than two elements, or twice in the same direction.
    pub irregular_sides: usize,
}

/// Area of one face of the file; of a face split along creases all parts together.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct FaceArea {
    /// The face, or the first of its parts.
    pub face: usize,
    /// Number of elements on it.
    pub elements: usize,
    /// Area of these elements [mm^2].
    pub area_mm2: f64,
    /// Area of the face [mm^2].
    pub model_area_mm2: f64,
}

impl FaceArea {
    /// Absolute area error [mm^2].
    #[must_use]
    pub fn area_error_mm2(&self) -> f64 {
        (self.area_mm2 - self.model_area_mm2).abs()
    }

    /// True when the area error exceeds `tolerance`, relative to the area of the face.
    #[must_use]
    pub fn exceeds_tolerance(&self, tolerance: f64) -> bool {
        let off = self.area_error_mm2();
        off.is_nan() || off > tolerance * self.model_area_mm2
    }

    fn place(&self, model: &Model) -> String {
        let source = model.faces.get(self.face).map_or("", |f| &f.source);
        format!("face {} ({source})", self.face)
    }
}

/// Multiplicity of element sides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Conformity {
    /// Number of sides used once.
    pub free: usize,
    /// Number of sides used once in each direction.
    pub inner: usize,
    /// Number of sides used otherwise.
    pub irregular: usize,
}

impl SurfaceMesh {
    /// Area of the elements, quadrilaterals as two triangles [mm^2].
    #[must_use]
    pub fn area(&self) -> f64 {
        self.elements.iter().map(|e| self.element_area(e)).sum()
    }

    fn element_area(&self, e: &Element) -> f64 {
        let p = self.corners(e);
        let half = |a: usize, b: usize, c: usize| 0.5 * (p[b] - p[a]).cross(&(p[c] - p[a])).norm();
        if p.len() == 3 { half(0, 1, 2) } else { half(0, 1, 2) + half(0, 2, 3) }
    }

    /// Counts the uses of each side.
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

    /// Largest ratio of longest to shortest side, and largest warpage.
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
    /// Evaluates `mesh` against its model.
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
        let worst = areas.iter().max_by(|a, b| a.area_error_mm2().total_cmp(&b.area_error_mm2()));
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

    /// Rejects a mesh with missing faces, irregular sides, or a relative area error above `area_tolerance`.
    ///
    /// # Errors
    /// [`MeshError::Check`] with the finding.
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

    /// Rejects a mesh with a face whose area error exceeds `area_tolerance` (relative) and 0.1 % of the model's area.
    /// External programs may mesh single faces without interior nodes, or not up to their boundary.
    ///
    /// # Errors
    /// [`MeshError::Check`] with the face.
    pub fn check_faces(&self, model: &Model, area_tolerance: f64) -> Result<(), MeshError> {
        let Some(worst) = self.worst_area else { return Ok(()) };
        if !worst.exceeds_tolerance(area_tolerance)
            || worst.area_error_mm2() <= 1e-3 * self.model_area_mm2
        {
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

/// Smallest corner Jacobian of every element: signed sine of the corner angle relative to the normal of the element's
/// CAD face. Corners without a normal (apexes) are excluded.
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
