//! Creases inside a face of the CAD: cut where a tool model is made of it.

use kanagata::cad::Creases;
use kanagata::cad::build::build_with;
use kanagata::cad::raw::{RawFace, RawModel, RawSurface};
use kanagata::convert::ConvertOptions;
use kanagata::convert::tolerance::{Borders, Goal, to_tolerance};
use kanagata::geometry::Vec3;
use kanagata::geometry::nurbs::Surface;
use kanagata::mesh::mapped::MappedOptions;

/// A roof of 60 by 60 mm with three equal knots at u = 1, where it turns by 90 degrees at one end of the ridge and not
/// at all at the other.
fn roof() -> RawModel {
    let mut points = Vec::new();
    for i in 0..7 {
        for (j, slope) in [1.0, 0.2, 0.0].into_iter().enumerate() {
            let x = 10.0 * f64::from(i) - 30.0;
            points.push(Vec3::new(x, 30.0 * j as f64, -x.abs() * slope));
        }
    }
    let u = vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0];
    let v = vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
    let surface = RawSurface::Nurbs(Surface::try_new([3, 2], [u, v], points, None).unwrap());
    let face =
        RawFace { surface, loops: vec![], flipped: false, source: "roof".into(), shell: None };
    RawModel { faces: vec![face], ..RawModel::default() }
}

#[test]
fn a_ridge_inside_a_face_is_cut_for_patches() {
    let options = ConvertOptions { through_cad: true, straighten: true, ..Default::default() };
    let borders = Borders::Conforming;
    let goal = Goal { tol_mm: 0.05, normal_deg: 1.0, two_sided: true, borders };
    let to = |creases| {
        let (model, _) = build_with(roof(), "roof", creases);
        to_tolerance(&model, &MappedOptions::default(), &options, &goal)
    };
    let found = to(Creases::Cut).unwrap();
    assert!(found.audit.worst_mm() <= 0.05 && found.audit.folded.is_empty());
    assert!(found.tool.patches.len() <= 100, "{}", found.tool.patches.len());
    // Patches that meet in the ridge without a border there have one normal where the roof has two.
    assert!(to(Creases::Kept).is_err());
}
