//! Creases inside a face of the CAD: cut where a tool model is made of it.

use kanagata::audit::{AuditOptions, CadReference, audit};
use kanagata::cad::Creases;
use kanagata::cad::build::build_with;
use kanagata::cad::raw::{RawFace, RawModel, RawSurface};
use kanagata::convert::tolerance::{Borders, Goal, to_tolerance};
use kanagata::convert::{ConvertOptions, convert};
use kanagata::geometry::nurbs::Surface;
use kanagata::geometry::{Vec2, Vec3};
use kanagata::mesh::mapped::{MappedOptions, mesh};
use kanagata::mesh::{Element, MeshReport, SurfaceMesh, attach};

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
    let face = RawFace {
        surface,
        loops: vec![],
        flipped: false,
        source: "roof".into(),
        shell: None,
        attributes: Default::default(),
    };
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

/// The mesh of a program that knows of no crease: `count` by `count` quads over each of some surfaces, numbered by them.
fn foreign(surfaces: &[&Surface], count: usize) -> SurfaceMesh {
    let mut mesh = SurfaceMesh::default();
    for (number, surface) in surfaces.iter().enumerate() {
        let first = mesh.vertices.len();
        let [u, v] = surface.domain();
        let at = |r: [f64; 2], k: usize| r[0] + (r[1] - r[0]) * k as f64 / count as f64;
        for k in 0..(count + 1) * (count + 1) {
            let uv = Vec2::new(at(u, k % (count + 1)), at(v, k / (count + 1)));
            mesh.vertices.push(surface.point(uv));
        }
        for k in 0..count * count {
            let corner = (first + k % count + k / count * (count + 1)) as u32;
            let row = count as u32 + 1;
            let ring = [corner, corner + 1, corner + 1 + row, corner + row];
            mesh.elements.push(Element::quad(ring, 7 + number as u32));
        }
    }
    mesh
}

#[test]
fn meshes_of_other_programs_are_put_on_both_sides_of_a_crease() {
    let mut raw = roof();
    let RawSurface::Nurbs(one) = raw.faces[0].surface.clone() else { unreachable!() };
    let far = |p: &Vec3| p + Vec3::new(0.0, 200.0, 0.0);
    let points = one.points().iter().map(far).collect();
    let other = Surface::try_new([3, 2], one.knots().map(<[f64]>::to_vec), points, None).unwrap();
    raw.faces.push(RawFace { surface: RawSurface::Nurbs(other.clone()), ..raw.faces[0].clone() });
    let made = |count, creases| {
        let (model, _) = build_with(raw.clone(), "roofs", creases);
        let mesh = attach(&foreign(&[&one, &other], count), &model).unwrap();
        MeshReport::new(&mesh, &model).check(&model, 0.05).unwrap();
        let (tool, report) = convert(&model, &mesh, &ConvertOptions::default()).unwrap();
        assert!(report.folded.is_empty());
        let found = audit(&tool, &CadReference::new(&model), &AuditOptions::default()).unwrap();
        (model.faces.len(), mesh, found.report)
    };
    // Lines of the mesh along the ridges: as good as the built-in mesh.
    let (faces, mesh, report) = made(8, Creases::Cut);
    let on = |f| mesh.elements.iter().filter(|e| e.face == f).count();
    assert_eq!((faces, [0, 1, 2, 3].map(on)), (4, [32; 4]));
    assert!(report.worst_mm() < 0.2, "{}", report.worst_mm());
    // Elements across the ridges: no worse than without the cut.
    let (_, _, cut) = made(7, Creases::Cut);
    let (_, _, kept) = made(7, Creases::Kept);
    println!("{} {} {}", report.worst_mm(), cut.worst_mm(), kept.worst_mm());
    assert!(cut.worst_mm() <= 1.001 * kept.worst_mm(), "{} {}", cut.worst_mm(), kept.worst_mm());
}

/// A rib of a wing as its modeller writes it: flat, between a straight line and a profile, from the trailing edge on. Both
/// rest together in the middle, and before the last of the pieces of the spline, in which the profile comes down to the end
/// of the line.
fn rib() -> RawModel {
    let line = [100.0, 80.0, 50.0, 50.0, 10.0, 10.0, 10.0].map(|x| [x, 0.0]);
    let heights = [0.0, 5.0, 9.0, 9.0, 6.0, 6.0, 0.0];
    let profile: [_; 7] = std::array::from_fn(|k| [line[k][0], heights[k]]);
    let mut points = Vec::new();
    for row in [line, profile] {
        let at = |[x, z]: [f64; 2]| Vec3::new(x + 0.1, 0.3, z + 0.7);
        points.push(at(row[0]));
        for pair in row.windows(2) {
            let (a, b) = (at(pair[0]), at(pair[1]));
            points.extend((1..=3).map(|k| if a == b { a } else { a.lerp(&b, f64::from(k) / 3.0) }));
        }
    }
    let inner = (0..=6).flat_map(|k| [f64::from(k); 3]);
    let v: Vec<f64> = std::iter::once(0.0).chain(inner).chain([6.0]).collect();
    let surface = RawSurface::Nurbs(
        Surface::try_new([1, 3], [vec![0.0, 0.0, 1.0, 1.0], v], points, None).unwrap(),
    );
    let face = RawFace {
        surface,
        loops: vec![],
        flipped: false,
        source: "rib".into(),
        shell: None,
        attributes: Default::default(),
    };
    RawModel { faces: vec![face], ..RawModel::default() }
}

#[test]
fn surfaces_that_rest_ask_for_no_divisions_there() {
    let mapped = |raw, arc_divisions| {
        let (model, _) = build_with(raw, "rib", Creases::Cut);
        let options = MappedOptions { arc_divisions, ..MappedOptions::default() };
        (mesh(&model, &options).unwrap(), model)
    };
    for n in [1, 4, 16] {
        let (mesh, model) = mapped(rib(), n);
        assert!(mesh.elements.len() <= 60 * n, "{n}: {} elements", mesh.elements.len());
        let (tool, report) = convert(&model, &mesh, &ConvertOptions::default()).unwrap();
        let found = audit(&tool, &CadReference::new(&model), &AuditOptions::default()).unwrap();
        assert!(found.report.worst_mm() < 1e-9, "{n}: {:?}", found.report.worst);
        assert!(report.straight.is_empty(), "{n}: normals that differ: {:?}", report.straight);
        // With nodes between the ends of the last side triangles beside it have no area.
        assert!(n > 1 || report.folded.is_empty(), "{n}: {:?}", report.folded);
    }
    let (model, _) = build_with(rib(), "rib", Creases::Cut);
    let borders = Borders::Conforming;
    let goal = Goal { tol_mm: 0.1, normal_deg: 1.0, two_sided: true, borders };
    let options = ConvertOptions { through_cad: true, straighten: true, ..Default::default() };
    let found = to_tolerance(&model, &MappedOptions::default(), &options, &goal).unwrap();
    assert!(found.audit.worst_mm() <= 0.1 && found.audit.folded.is_empty());
    assert!(found.tool.patches.len() <= 20, "{}", found.tool.patches.len());
}
