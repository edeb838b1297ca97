//! To a tolerance with as few patches as it takes: against the uniform mesh that reaches the same largest error.

use std::path::Path;
use std::time::Duration;

use kanagata::audit::report::PatchAudit;
use kanagata::audit::{AuditOptions, CadReference, audit};
use kanagata::cad::model::{Edge, EdgeUse, Face, SurfaceKind, TrimLoop};
use kanagata::cad::{self, Model};
use kanagata::convert::tolerance::{
    Borders, Goal, Refined, ToleranceError, to_patches, to_tolerance, to_tolerance_in_time,
};
use kanagata::convert::{ConvertOptions, convert};
use kanagata::geometry::nurbs::{Curve2, Curve3, Surface};
use kanagata::geometry::{Vec2, Vec3};
use kanagata::mesh::mapped::{MappedOptions, mesh};

fn read(file: &str) -> Model {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(file);
    cad::read(&path).unwrap().0
}

fn refined(model: &Model, tol_mm: f64, two_sided: bool, through_cad: bool) -> Refined {
    let goal = Goal { tol_mm, normal_deg: f64::INFINITY, two_sided, borders: Borders::Conforming };
    let options = ConvertOptions { through_cad, ..ConvertOptions::default() };
    let found = to_tolerance(model, &MappedOptions::default(), &options, &goal).unwrap();
    let again = audit(&found.tool, &CadReference::new(model), &AuditOptions::default()).unwrap();
    assert!(again.report.worst_mm() <= tol_mm && again.report.folded.is_empty());
    assert!(again.report.jumps.position_mm < 1e-12);
    found
}

/// Patches of the first uniform structured mesh whose largest error is no larger.
fn uniform(model: &Model, error_mm: f64) -> usize {
    for arc_divisions in 1..64 {
        let options = MappedOptions { arc_divisions, ..MappedOptions::default() };
        let (tool, _) =
            convert(model, &mesh(model, &options).unwrap(), &ConvertOptions::default()).unwrap();
        let found = audit(&tool, &CadReference::new(model), &AuditOptions::default()).unwrap();
        if found.report.worst_mm() <= error_mm {
            return tool.patches.len();
        }
    }
    panic!("no uniform mesh reaches {error_mm} mm");
}

#[test]
fn the_cross_die_takes_fewer_patches_than_a_uniform_mesh_of_the_same_error() {
    let model = read("cross/die.igs");
    let found = refined(&model, 0.01, false, false);
    let uniform = uniform(&model, found.audit.worst_mm());
    println!("0.01 mm: {} patches, uniform {uniform}", found.tool.patches.len());
    assert!(found.tool.patches.len() as f64 <= 0.7 * uniform as f64);
    assert_eq!(found.moved_mm, 0.0);
}

#[test]
fn edges_that_follow_the_cad_halve_that() {
    let model = read("cross/die.igs");
    let found = refined(&model, 0.01, false, true);
    let uniform = uniform(&model, found.audit.worst_mm());
    println!("0.01 mm, edges through the CAD: {} patches", found.tool.patches.len());
    assert!(found.tool.patches.len() as f64 <= 0.5 * uniform as f64);
    assert!(!found.tool.curves.is_empty() && found.audit.normal_max_deg < 0.6);
    // As `kanagata convert --tol 0.01mm` does it: with vertices balanced about the CAD, sliding within flats.
    let balanced = refined(&model, 0.01, true, true).tool.patches.len();
    println!("vertices balanced: {balanced} patches");
    assert!(balanced <= 64 && balanced as f64 <= 0.4 * uniform as f64);
}

/// The same mesh: Eq. 8 draws chords where a flat meets a fillet; and the order stays four.
#[test]
fn edges_that_follow_the_cad_take_off_most_of_the_error_of_a_mesh() {
    let model = read("cross/die.igs");
    let made = |arc_divisions, through_cad| {
        let mesh = mesh(&model, &MappedOptions { arc_divisions, ..MappedOptions::default() });
        let options = ConvertOptions { through_cad, ..ConvertOptions::default() };
        let (tool, _) = convert(&model, &mesh.unwrap(), &options).unwrap();
        audit(&tool, &CadReference::new(&model), &AuditOptions::default()).unwrap().report
    };
    let (plain, cad) = (made(4, false), made(4, true));
    println!("{} {}", plain.worst_mm(), cad.worst_mm());
    assert!(cad.worst_mm() < 0.2 * plain.worst_mm());
    assert!(cad.normal_max_deg < 0.2 * plain.normal_max_deg);
    let order = (cad.worst_mm() / made(8, true).worst_mm()).log2();
    assert!(order > 3.9, "{order}");
}

/// A fillet whose patches all stand out of it: half of that is taken off, so fewer do.
#[test]
fn balanced_vertices_need_no_more_patches() {
    let model = read("forming/torus_144.igs");
    let (one, two) = (refined(&model, 0.1, false, false), refined(&model, 0.1, true, false));
    println!("on the CAD {}, balanced {}", one.tool.patches.len(), two.tool.patches.len());
    assert!(two.tool.patches.len() <= one.tool.patches.len());
    assert!(two.audit.max_mm <= 0.1 && two.audit.min_mm >= -0.1);
}

/// A quarter turn between two flats with one patch across: its vertices slide within the flats, which stay flat, and it is
/// within 0.02 of its radius where the parabola of Eq. 8 between the tangent lines is 0.061 off.
#[test]
fn fillets_between_flats_take_one_patch_where_their_vertices_slide() {
    let model = read("forming/square_die_144.igs");
    let tol_mm = 1e-3 * model.bbox().diagonal();
    let (one, two) = (refined(&model, tol_mm, false, true), refined(&model, tol_mm, true, true));
    println!("{} and {} patches", one.tool.patches.len(), two.tool.patches.len());
    assert!(one.tool.patches.len() >= 48 && two.tool.patches.len() <= 24);
    assert!(two.slid_mm > 0.5 && two.moved_mm < 1e-9 && one.slid_mm == 0.0);
    assert!(two.audit.worst_mm() <= tol_mm && two.audit.folded.is_empty());
    for corners in &two.tool.corners {
        let face = &model.faces[corners.face as usize];
        if face.kind == SurfaceKind::Plane {
            let (origin, n) =
                (face.surface.point(Vec2::zeros()), face.normal(Vec2::zeros()).unwrap());
            let off = |v: &u32| (two.tool.vertices[*v as usize] - origin).dot(&n).abs();
            assert!(corners.vertices.iter().map(off).fold(0.0, f64::max) < 1e-9);
        }
    }
}

/// Edges of a closed surface that end on its seam follow the CAD as all others do.
#[test]
fn a_seam_makes_no_difference() {
    for (name, strips) in [("sphere", 8), ("torus", 12)] {
        let model = read(&format!("forming/{name}_144.igs"));
        let options = MappedOptions {
            arc_divisions: strips / 4,
            through_cad: true,
            ..MappedOptions::default()
        };
        let through_cad = ConvertOptions { through_cad: true, ..ConvertOptions::default() };
        let (tool, _) = convert(&model, &mesh(&model, &options).unwrap(), &through_cad).unwrap();
        let found = audit(&tool, &CadReference::new(&model), &AuditOptions::default()).unwrap();
        let off = |p: &PatchAudit| p.max_mm.abs().max(p.min_mm.abs());
        let mut errors: Vec<f64> = found.report.by_patch.iter().map(off).collect();
        errors.sort_by(f64::total_cmp);
        println!(
            "{name}: {} patches, {} to {} mm",
            errors.len(),
            errors[0],
            errors[errors.len() - 1]
        );
        let ring = |ring: &[f64]| ring[ring.len() - 1] - ring[0] < 1e-2 * ring[ring.len() - 1];
        assert!(
            errors.len().is_multiple_of(strips) && errors.chunks(strips).all(ring),
            "{errors:?}"
        );
    }
}

/// Its vertices are all on creases: they move within the flats, which stay flat.
#[test]
fn a_cylinder_between_flats_is_balanced_on_its_creases() {
    let model = read("forming/cylinder_144.igs");
    let tol_mm = 1e-3 * model.bbox().diagonal();
    let (one, two) = (refined(&model, tol_mm, false, true), refined(&model, tol_mm, true, true));
    let worst: Vec<f64> =
        two.audit.faces.iter().map(|f| f.max_mm.abs().max(f.min_mm.abs())).collect();
    println!("{} and {} patches, {worst:?}", one.tool.patches.len(), two.tool.patches.len());
    assert!(two.tool.patches.len() < one.tool.patches.len() && two.moved_mm > 0.0);
    assert!(two.audit.min_mm < -0.3 * two.audit.max_mm);
    let flat = |k: &usize| model.faces[*k].kind == SurfaceKind::Plane;
    assert_eq!((0..worst.len()).filter(flat).count(), 2);
    // Across the flats; along them their border is where the cylinder's patches are.
    let off = two.tool.corners.iter().flat_map(|c| &c.vertices).map(|&v| {
        let x = two.tool.vertices[v as usize];
        (0..worst.len())
            .filter(flat)
            .map(|k| {
                let n = model.faces[k].normal(Vec2::zeros()).unwrap();
                n.dot(&(x - model.faces[k].surface.point(Vec2::zeros()))).abs()
            })
            .fold(f64::INFINITY, f64::min)
    });
    assert!(off.fold(0.0, f64::max) < 1e-9);
}

#[test]
fn a_number_of_patches_is_not_exceeded_and_more_patches_are_better() {
    let model = read("forming/cross_punch_144.igs");
    let made = |patches| {
        to_patches(
            &model,
            &MappedOptions::default(),
            &ConvertOptions::default(),
            patches,
            false,
            Borders::Conforming,
        )
        .unwrap()
    };
    let (few, many) = (made(40), made(120));
    println!("{} {}", few.audit.worst_mm(), many.audit.worst_mm());
    assert!(few.tool.patches.len() <= 40 && many.tool.patches.len() <= 120);
    assert!(many.audit.worst_mm() < 0.5 * few.audit.worst_mm());
}

/// Arcs of a border that reach into coarse quads on a flat: their parts are moved apart, or the border is divided finer.
#[test]
fn quads_on_flats_with_concave_borders_do_not_fold() {
    for file in ["cross/die.igs", "cross/holder.igs"] {
        let model = read(file);
        let options = MappedOptions {
            arc_divisions: 4,
            style: kanagata::mesh::mapped::MeshStyle::Quads,
            ..MappedOptions::default()
        };
        let mesh = mesh(&model, &options).unwrap();
        assert!(mesh.elements.iter().all(|e| e.nodes().len() == 4));
        let (tool, report) = convert(&model, &mesh, &ConvertOptions::default()).unwrap();
        let found = audit(&tool, &CadReference::new(&model), &AuditOptions::default()).unwrap();
        println!("{file}: {} quads", tool.patches.len());
        assert!(report.folded.is_empty() && found.report.folded.is_empty() && report.split == 0);
    }
}

/// A whole sphere has no edge but its seam: what is between its poles is divided too.
#[test]
fn a_whole_sphere_reaches_a_tolerance() {
    let model = read("forming/sphere_AP214.stp");
    let tol_mm = 1e-3 * model.bbox().diagonal();
    let found = refined(&model, tol_mm, true, true);
    let uniform = uniform(&model, found.audit.worst_mm());
    println!("{} patches, uniform {uniform}", found.tool.patches.len());
    assert!(found.tool.patches.len() <= 32 && 2 * found.tool.patches.len() <= uniform);
}

/// A model of one face, whole over its surface; `sides` go around it from corner to corner.
fn one_face(surface: Surface, sides: [Curve3; 4], source: &str) -> Model {
    let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(u, v)| Vec2::new(u, v));
    let uses = (0..4).map(|k| EdgeUse {
        pcurve: Curve2::line(corners[k], corners[(k + 1) % 4]),
        edge: Some(k),
        reversed: false,
    });
    let face = Face {
        loops: vec![TrimLoop { uses: uses.collect() }],
        surface,
        kind: SurfaceKind::Nurbs,
        analytic: None,
        flipped: false,
        source: source.into(),
        shell: None,
        attributes: Default::default(),
    };
    let vertices = sides.iter().map(|c| c.point(0.0)).collect();
    let edges = sides.into_iter().enumerate();
    let edge = |(k, curve)| Edge { curve, vertices: [k, (k + 1) % 4], uses: vec![[0, 0, k]] };
    Model { faces: vec![face], edges: edges.map(edge).collect(), vertices, ..Model::default() }
}

/// The surface over these poles, `[degree; 2]`, and the curves of its sides.
fn patch(degrees: [usize; 2], poles: &[Vec3], source: &str) -> Model {
    let [p, q] = degrees;
    let knots = |n: usize| [vec![0.0; n + 1], vec![1.0; n + 1]].concat();
    let curve = |degree: usize, ids: &mut dyn Iterator<Item = usize>| {
        Curve3::try_new(degree, knots(degree), ids.map(|k| poles[k]).collect(), None).unwrap()
    };
    let at = |i: usize, j: usize| i * (q + 1) + j;
    let sides = [
        curve(p, &mut (0..=p).map(|i| at(i, 0))),
        curve(q, &mut (0..=q).map(|j| at(p, j))),
        curve(p, &mut (0..=p).rev().map(|i| at(i, q))),
        curve(q, &mut (0..=q).rev().map(|j| at(0, j))),
    ];
    let surface = Surface::try_new(degrees, [knots(p), knots(q)], poles.to_vec(), None).unwrap();
    one_face(surface, sides, source)
}

/// Half a nose: the parabola `x = 100 t^2, z = 30 t (1 - t)` mm, its normal along -x at the front, 300 mm wide.
fn nose() -> Model {
    let profile = [(0.0, 0.0), (0.0, 15.0), (100.0, 0.0)];
    let poles: Vec<Vec3> =
        profile.iter().flat_map(|&(x, z)| [0.0, 300.0].map(|y| Vec3::new(x, y, z))).collect();
    patch([2, 1], &poles, "nose")
}

/// A strip that runs out to x = 16.1 mm and back over itself: its normal turns over on the way, however finely it is
/// divided.
#[test]
fn a_face_that_folds_is_refused_by_name() {
    let profile = [(0.0, 0.0), (25.0, 0.1), (10.0, 0.1)];
    let poles: Vec<Vec3> =
        profile.iter().flat_map(|&(x, z)| [0.0, 10.0].map(|y| Vec3::new(x, y, z))).collect();
    let model = patch([2, 1], &poles, "folded strip");
    let goal = Goal {
        tol_mm: 0.05,
        normal_deg: f64::INFINITY,
        two_sided: true,
        borders: Borders::Conforming,
    };
    let found = to_tolerance(&model, &MappedOptions::default(), &ConvertOptions::default(), &goal);
    match found {
        Err(ToleranceError::NoPatches { face: 0, source_entity, alone: false }) => {
            assert_eq!(source_entity, "folded strip")
        }
        Ok(found) => panic!("{} patches", found.tool.patches.len()),
        Err(other) => panic!("{other}"),
    }
}

/// Without any time for a search the default model is the answer, within the tolerance or with its error.
#[test]
fn a_search_without_time_gives_the_default_model_with_its_error() {
    let model = read("cross/die.igs");
    let in_no_time = |tol_mm: f64| {
        let goal = Goal {
            tol_mm,
            normal_deg: f64::INFINITY,
            two_sided: true,
            borders: Borders::Conforming,
        };
        let (mesh, options) = (MappedOptions::default(), ConvertOptions::default());
        to_tolerance_in_time(&model, &mesh, &options, &goal, Some(Duration::ZERO))
    };
    let loose = in_no_time(0.5).unwrap();
    assert!(loose.audit.worst_mm() <= 0.5 && !loose.saved_all);
    let Err(ToleranceError::Above { model: found, why }) = in_no_time(1e-6) else {
        panic!("1e-6 mm in no time")
    };
    assert_eq!(found.tool.patches, loose.tool.patches);
    let again = audit(&found.tool, &CadReference::new(&model), &AuditOptions::default()).unwrap();
    assert!(found.audit.worst_mm() > 1e-6 && found.audit.within_tolerance == Some(false));
    assert_eq!(found.audit.worst_mm().to_bits(), again.report.worst_mm().to_bits());
    assert!(found.audit.folded.is_empty() && why.to_string().contains("asked: 1.000e-6"), "{why}");
}

/// Normals that turn by nearly a right angle: a curve that leaves them for the CAD's middle once stood 6 mm out. Eq. 8
/// has the parabola itself. (To 0.3 mm two patches divided by turn do too, one of them with the guard on inflected profiles.)
#[test]
fn around_a_nose_edges_are_those_of_eq_8() {
    let model = nose();
    let found = refined(&model, 0.1, true, true);
    println!("{} patches, {:.1e} mm", found.tool.patches.len(), found.audit.worst_mm());
    assert!(found.tool.patches.len() <= 2 && found.audit.worst_mm() < 1e-9);
}

#[test]
fn a_tolerance_never_takes_more_patches_than_the_uniform_mesh_of_the_same_error() {
    let files = ["cone_144.igs", "hemi_punch_186.igs", "frustum_AP214.stp", "square_punch_144.igs"];
    for file in files {
        let model = read(&format!("forming/{file}"));
        for share in [3e-3, 1e-3] {
            let found = refined(&model, share * model.bbox().diagonal(), true, true);
            let uniform = uniform(&model, found.audit.worst_mm());
            println!("{file} {share}: {} patches, uniform {uniform}", found.tool.patches.len());
            assert!(found.tool.patches.len() <= uniform, "{file} {share}");
        }
    }
}

/// Patches of tools with few faces at 1e-3 of their size. An estimate above the error costs eight on the sphere. A slide that
/// a vertex beside its way stops costs seven on the die, whose flat is symmetric about x = y: the image of a vertex is
/// ahead by rounding only, and files of the same shape differ.
#[test]
fn neither_estimates_above_the_error_nor_rounding_cost_patches() {
    for (file, tol_mm, most) in [
        ("forming/sphere_144.igs", 0.0866, 32),
        ("forming/cross_die_144.igs", 0.194, 30),
        ("forming/cross_die_186.igs", 0.194, 30),
    ] {
        let patches = refined(&read(file), tol_mm, true, true).tool.patches.len();
        assert!(patches <= most, "{file}: {patches} patches; {most}");
    }
}
