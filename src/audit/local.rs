//! The trimmed CAD as reference near a known point: the fast query of a search that evaluates many patches.

use super::reference::{CadReference, ReferenceFoot, ReferenceSurface};
use kanagata_geometry::{Vec2, Vec3};

/// The trimmed CAD, where a foot point inside the patch's own face is not compared with other faces, and one beyond its
/// border only with the adjacent face. Distances near a start have an error of up to 1e-3. The error differs from that of
/// [`CadReference`] by more only where another face is closer, as beside a concave crease.
pub struct LocalReference<'r, 'm>(pub &'r CadReference<'m>);

impl ReferenceSurface for LocalReference<'_, '_> {
    fn closest(&self, p: &Vec3, face: u32) -> Option<ReferenceFoot> {
        self.0.closest(p, face)
    }

    fn closest_from(
        &self,
        p: &Vec3,
        face: u32,
        start: Option<Vec2>,
    ) -> Option<(ReferenceFoot, Option<Vec2>)> {
        match start.and_then(|start| self.0.foot_near(p, face, start)) {
            Some((foot, uv)) => Some((foot, Some(uv))),
            None => self.0.closest_from(p, face, None),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    use kanagata_cad::Model;

    /// Points 0.03 mm off the faces of a die, with starts beside their foot points: the query of the whole model from a
    /// start finds what the whole model has, the local query its distance to 1e-3.
    #[test]
    fn a_query_from_a_start_finds_the_closest_point_of_the_whole_model() {
        let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
            .join("fixtures/forming/cross_die_144.igs");
        let (model, _) = kanagata_cad::read(&path).unwrap();
        let reference = CadReference::new(&model);
        let (mut compared, mut inside) = (0, 0);
        for (f, face) in model.faces.iter().enumerate() {
            let [u, v] = face.surface.domain();
            let at = |a: f64, b: f64| Vec2::new(u[0] + (u[1] - u[0]) * a, v[0] + (v[1] - v[0]) * b);
            for (i, j) in (1..8).flat_map(|i| (1..8).map(move |j| (f64::from(i), f64::from(j)))) {
                let uv = at(i / 8.0, j / 8.0);
                let p = face.surface.point(uv) + face.normal(uv).unwrap() * 0.03;
                let start = Some(at((i + 0.3) / 8.5, (j - 0.2) / 8.5));
                let cold = reference.closest(&p, f as u32).unwrap();
                let warm = reference.closest_from(&p, f as u32, start).unwrap().0;
                let local = LocalReference(&reference).closest_from(&p, f as u32, start).unwrap().0;
                let same = |foot: &ReferenceFoot| {
                    (foot.point - cold.point).norm() < 1e-9
                        && (foot.normal - cold.normal).norm() < 1e-6
                };
                assert!(same(&warm), "face {f} at {uv:?}: {warm:?} {cold:?}");
                compared += 1;
                if reference.foot_inside(&p, f as u32, uv).is_some() && cold.face == f as u32 {
                    inside += 1;
                    let distance = (p - local.point).dot(&local.normal);
                    assert!((distance - 0.03).abs() <= 1e-3 * 0.03, "{f} {uv:?}: {distance}");
                    let turn = (local.normal - cold.normal).norm();
                    assert!(turn < 1e-3, "face {f} at {uv:?}: {local:?} {cold:?}");
                }
            }
        }
        assert!(compared > 500 && inside > 300, "{inside} of {compared} inside their faces");
    }

    /// Compares the local query with the complete one at points 0.03 mm off a face, from other starts each. Returns their
    /// number.
    fn compare_face(model: &Model, reference: &CadReference<'_>, f: usize, file: &str) -> usize {
        let fractions = [0.0005, 0.004, 0.01, 0.1, 0.3, 0.7, 0.95, 0.99, 0.996, 0.9995];
        let face = &model.faces[f];
        let [u, v] = face.surface.domain();
        let at = |a: f64, b: f64| Vec2::new(u[0] + (u[1] - u[0]) * a, v[0] + (v[1] - v[0]) * b);
        let mut compared = 0;
        for (a, b) in fractions.iter().flat_map(|&a| fractions.map(|b| (a, b))) {
            let Some(normal) = face.normal(at(a, b)) else { continue };
            let p = face.surface.point(at(a, b)) + normal * 0.03;
            let inside = reference.foot_inside(&p, f as u32, at(a, b)).is_some();
            let cold = reference.closest(&p, f as u32).unwrap();
            let is_near = ((cold.point - p).norm() - 0.03).abs() <= 1e-9;
            if !inside || cold.face != f as u32 || !is_near {
                continue;
            }
            let starts = [(a + 0.02, b - 0.015), (a - 0.02, b + 0.01), (1.0 - a, b), (a, 1.0 - b)];
            for (a, b) in starts {
                let start = Some(at(a.clamp(0.0, 1.0), b.clamp(0.0, 1.0)));
                let query = LocalReference(reference).closest_from(&p, f as u32, start);
                let local = query.unwrap().0;
                let distance = (p - local.point).dot(&local.normal);
                assert!((distance - 0.03).abs() <= 3e-5, "{file} {f} {p:?} {start:?}: {distance}");
                let turn = (local.normal - cold.normal).norm();
                assert!(turn < 1e-2, "{file} {f} {p:?} {start:?}: {turn}");
                compared += 1;
            }
        }
        compared
    }

    /// Points 0.03 mm off surfaces with poles, an apex and seams, close to these. The starts are off in both parameters, or
    /// on the other side of the seam. The local query has the distance to 1e-3, and the normal to 0.6 degrees.
    #[test]
    fn distances_and_normals_beside_poles_and_seams_are_those_of_the_surface() {
        for file in [
            "cone_186.igs",
            "hemi_punch_186.igs",
            "hemi_punch_144.igs",
            "sphere_186.igs",
            "torus_144.igs",
        ] {
            let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
                .join("fixtures/forming")
                .join(file);
            let (model, _) = kanagata_cad::read(&path).unwrap();
            let reference = CadReference::new(&model);
            let faces = 0..model.faces.len();
            let compared: usize = faces.map(|f| compare_face(&model, &reference, f, file)).sum();
            assert!(compared > 200, "{file}: {compared}");
        }
    }

    #[test]
    fn a_point_beyond_the_border_of_its_face_has_no_foot_point_inside() {
        let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
            .join("fixtures/forming/cross_holder_144.igs");
        let (model, _) = kanagata_cad::read(&path).unwrap();
        let reference = CadReference::new(&model);
        let size = model.bbox();
        let beyond = size.max + Vec3::new(5.0, 0.0, 0.0);
        let [u, v] = model.faces[0].surface.domain();
        assert!(reference.foot_inside(&beyond, 0, Vec2::new(u[1], v[1])).is_none());
        let (foot, _) = LocalReference(&reference)
            .closest_from(&beyond, 0, Some(Vec2::new(u[1], v[1])))
            .unwrap();
        assert!(foot.on_border && (foot.point - beyond).norm() >= 5.0 - 1e-9, "{foot:?}");
    }
}
