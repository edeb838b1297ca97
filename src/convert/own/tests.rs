//! Meshes without CAD.

use std::f64::consts::FRAC_PI_2;

use super::*;
use kanagata_mesh::Element;
use kanagata_mesh::io;

/// A quarter cylinder of radius 7 mm between two flats of width 10 mm: `n` quadrilaterals over the quarter turn, 5 mm
/// deep.
fn channel(n: usize) -> SurfaceMesh {
    let mut profile = vec![[-10.0, 0.0]];
    profile.extend((0..=n).map(|k| {
        let a = FRAC_PI_2 * k as f64 / n as f64;
        [7.0 * a.sin(), 7.0 * (a.cos() - 1.0)]
    }));
    profile.push([7.0, -17.0]);
    let vertices =
        profile.iter().flat_map(|&[x, z]| [0.0, 5.0].map(|y| Vec3::new(x, y, z))).collect();
    let quad = |k: u32| Element::quad([2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1], UNATTACHED);
    SurfaceMesh {
        vertices,
        elements: (0..profile.len() as u32 - 1).map(quad).collect(),
        ..SurfaceMesh::default()
    }
}

fn converted(file: &MeshFile, crease_deg: f64) -> (ToolModel, ConvertReport, NormalSource) {
    convert_mesh(file, &ConvertOptions::default(), crease_deg).unwrap()
}

#[test]
fn normals_inside_an_arc_are_exact_and_those_of_flats_tilt_little() {
    let (tool, report, source) = converted(&channel(4).into(), 40.0);
    assert_eq!((source.given, source.estimated, source.regions), (0, 24, 1));
    assert_eq!((report.creases, report.folded.len()), (0, 0));
    let normal = |patch: usize| tool.normals[tool.corners[patch].normals[1] as usize];
    for k in 1..4 {
        let a = FRAC_PI_2 * k as f64 / 4.0;
        assert!((normal(k) - Vec3::new(a.sin(), 0.0, a.cos())).norm() < 1e-12, "{k}");
    }
    // The flat is 10 mm long. The first facet is 14 sin(11.25 deg) mm long and inclined by 11.25 deg.
    let h = FRAC_PI_2 / 8.0;
    let facet = 14.0 * h.sin();
    let expected = (facet * h.sin()).atan2(10.0 + facet * h.cos());
    assert!((normal(0).angle(&Vec3::z()) - expected).abs() < 1e-12);
}

#[test]
fn facets_at_more_than_the_crease_angle_meet_in_a_crease() {
    // 45 degrees inside the arc, 22.5 where it meets the flats.
    let (_, report, source) = converted(&channel(2).into(), 40.0);
    assert_eq!((report.creases, source.regions), (1, 2));
    let (tool, report, source) = converted(&channel(2).into(), 50.0);
    assert_eq!((report.creases, source.regions), (0, 1));
    assert_eq!(tool.faces, [0; 4]);
}

#[test]
fn normals_of_the_file_are_used_and_elements_are_oriented_by_them() {
    let mesh = channel(3);
    let exact = |p: &Vec3| {
        if p.x <= 0.0 || p.z <= -7.0 {
            if p.x <= 0.0 { Vec3::z() } else { Vec3::x() }
        } else {
            Vec3::new(p.x, 0.0, p.z + 7.0).normalize()
        }
    };
    let corners = |e: &Element| {
        let mut normals = [Vec3::zeros(); 4];
        normals.iter_mut().zip(mesh.corners(e)).for_each(|(n, p)| *n = exact(&p));
        normals
    };
    let mut file =
        MeshFile { normals: mesh.elements.iter().map(corners).collect(), mesh: mesh.clone() };
    let (as_it_is, _, source) = converted(&file, 40.0);
    assert_eq!((source.given, source.estimated), (20, 0));
    let h = FRAC_PI_2 / 6.0;
    let sagitta = 7.0 * (1.0 - h.cos()).powi(2) / (2.0 * h.cos());
    let middle = as_it_is.patches[2].derivs(0.5, 0.5).s + Vec3::z() * 7.0;
    assert!((middle.x.hypot(middle.z) - 7.0 - sagitta).abs() < 1e-9, "the arc's closed form");
    // Reversing every other element with its normals gives the same tool.
    for k in [1, 3] {
        file.mesh.elements[k] = file.mesh.elements[k].reversed();
        file.normals[k].reverse();
    }
    let (again, report, _) = converted(&file, 40.0);
    assert!(report.folded.is_empty());
    for (a, b) in as_it_is.patches.iter().zip(&again.patches) {
        let away = |(e, z): (f64, f64)| a.normal(e, z).unwrap().angle(&b.normal(e, z).unwrap());
        assert!([(0.5, 0.5), (0.0, 0.0)].into_iter().all(|at| away(at) < 1e-9));
    }
    // Reversing all normals reverses the tool.
    file.normals.iter_mut().flatten().for_each(|n| *n = -*n);
    let (turned, _, _) = converted(&file, 40.0);
    assert!(turned.patches[0].normal(0.5, 0.5).unwrap().z < -0.9);
}

#[test]
fn a_moebius_strip_is_refused_at_an_edge() {
    let (count, mut vertices) = (8u32, Vec::new());
    for k in 0..count {
        let a = std::f64::consts::TAU * f64::from(k) / f64::from(count);
        let out = Vec3::new(a.cos(), a.sin(), 0.0);
        let across = out * (a / 2.0).cos() + Vec3::z() * (a / 2.0).sin();
        vertices.extend([out * 10.0 - across, out * 10.0 + across]);
    }
    let quad = |k: u32| {
        let (a, b) = (2 * k, 2 * ((k + 1) % count));
        let ends = if k + 1 == count { [b + 1, b] } else { [b, b + 1] };
        Element::quad([a, ends[0], ends[1], a + 1], UNATTACHED)
    };
    let mesh = SurfaceMesh {
        vertices,
        elements: (0..count).map(quad).collect(),
        ..SurfaceMesh::default()
    };
    let error =
        convert_mesh(&mesh.into(), &ConvertOptions::default(), 40.0).unwrap_err().to_string();
    assert!(error.contains("Moebius") && error.contains("mm"), "{error}");
    let none = convert_mesh(&MeshFile::default(), &ConvertOptions::default(), 40.0);
    assert_eq!(none.unwrap_err(), ConvertError::NoElements);
}

#[test]
fn normals_of_obj_and_vtu_are_read_corner_by_corner() {
    let folder = tempfile::tempdir().unwrap();
    let obj = folder.path().join("a.obj");
    let text =
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 2\nvn 0 1 1\nf 1//1 2//1 3//2 4//-1\nf 1 2 3\n";
    std::fs::write(&obj, text).unwrap();
    let file = io::read_file(&obj).unwrap();
    let tilted = Vec3::new(0.0, 1.0, 1.0).normalize();
    assert_eq!(file.normals[0], [Vec3::z(), Vec3::z(), tilted, tilted]);
    assert_eq!(file.normals[1], [Vec3::zeros(); 4], "corners without one");
    std::fs::write(&obj, "v 0 0 0\nv 1 0 0\nv 1 1 0\nvn 0 0 1\nf 1//1 2//1 3//2\n").unwrap();
    let error = io::read_file(&obj).unwrap_err().to_string();
    assert!(error.contains("line 5") && error.contains("normals"), "{error}");
    let mut grid = io::to_vtu(&channel(2));
    let count = channel(2).vertices.len();
    grid.point_data.push(kanagata_report::DataArray::vector("Normals", &vec![tilted; count]));
    let vtu = folder.path().join("a.vtu");
    grid.write(&vtu).unwrap();
    let file = io::read_file(&vtu).unwrap();
    assert!(file.normals.iter().flatten().all(|n| (n - tilted).norm() < 1e-12));
}
