use std::path::Path;

use super::*;
use kanagata_audit::{AuditOptions, CadReference, audit};
use kanagata_cad as cad;
use kanagata_mesh::mapped::{MappedOptions, MeshStyle, mesh};

fn read(file: &str) -> Model {
    cad::read(&Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("fixtures").join(file))
        .unwrap()
        .0
}

fn options(tolerance_mm: f64) -> BezierOptions {
    BezierOptions {
        name: "t".into(),
        tolerance_mm,
        sheet_side: None,
        flip: false,
        progress: Default::default(),
    }
}

fn coarse(model: &Model, arc_divisions: usize, style: MeshStyle) -> SurfaceMesh {
    mesh(model, &MappedOptions { arc_divisions, style, ..MappedOptions::default() }).unwrap()
}

#[test]
fn the_cross_die_has_fewer_patches_than_in_the_paper_and_almost_no_error() {
    let model = read("cross/die.igs");
    let (tool, report) =
        bezier_from_cad(&model, &coarse(&model, 1, MeshStyle::Quads), &options(1e-4)).unwrap();
    assert!(tool.patches.len() < 61 && report.degree <= MAX_DEGREE, "{report:?}");
    let found = audit(&tool, &CadReference::new(&model), &AuditOptions::default()).unwrap().report;
    println!(
        "{} patches, {report:?}; audit {:+.2e} {:+.2e} mm, normal {:.4}, jump {:.2e} mm {:.4} deg",
        tool.patches.len(),
        found.max_mm,
        found.min_mm,
        found.normal_max_deg,
        found.jumps.position_mm,
        found.jumps.normal_deg
    );
    assert!(report.error_mm <= 1e-4 && found.worst_mm() <= 1.5e-4 && found.folded.is_empty());
    assert!(found.jumps.position_mm < 1e-12 && found.jumps.normal_deg < 0.05);
}

#[test]
fn a_looser_tolerance_takes_lower_degrees_and_is_kept() {
    let model = read("cross/punch.igs");
    let mesh = coarse(&model, 2, MeshStyle::Structured);
    let mut points = usize::MAX;
    for tolerance in [1e-5, 1e-3, 0.05] {
        let (tool, report) = bezier_from_cad(&model, &mesh, &options(tolerance)).unwrap();
        let net = |p: &Patch| match p {
            Patch::Bezier { points, .. } => points.len(),
            _ => 0,
        };
        let count = tool.patches.iter().map(net).sum();
        println!("{tolerance}: {count} points, {report:?}");
        assert!(report.error_mm <= tolerance && count < points);
        points = count;
    }
}

#[test]
fn reversed_models_have_opposite_normals() {
    let model = read("cross/die.igs");
    let mesh = coarse(&model, 1, MeshStyle::Structured);
    let (up, a) = bezier_from_cad(&model, &mesh, &options(1e-3)).unwrap();
    let (down, b) = bezier_from_cad(
        &model,
        &mesh,
        &BezierOptions { sheet_side: Some(-Vec3::z()), ..options(1e-3) },
    )
    .unwrap();
    assert!(a.turned != b.turned);
    for (p, q) in up.patches.iter().zip(&down.patches) {
        assert!((p.derivs(0.3, 0.8).s - q.derivs(0.8, 0.3).s).norm() < 1e-12);
        let (n, m) = (p.normal(0.3, 0.8).unwrap(), q.normal(0.8, 0.3).unwrap());
        assert!((n + m).norm() < 1e-9);
    }
}

#[test]
fn patches_are_continuous_at_poles_and_seams() {
    let model = read("forming/hemi_punch_AP214.stp");
    let (tool, report) =
        bezier_from_cad(&model, &coarse(&model, 2, MeshStyle::Structured), &options(1e-4)).unwrap();
    let found = audit(&tool, &CadReference::new(&model), &AuditOptions::default()).unwrap().report;
    println!("{report:?} {:+.2e} {:+.2e} {}", found.max_mm, found.min_mm, found.jumps.position_mm);
    assert!(found.worst_mm() < 2e-4 && found.jumps.position_mm < 1e-12);
}

/// Folded patches by dense sampling: the normal points against that of the CAD face at one of 62 x 62 points.
fn folded_by_sampling(tool: &ToolModel, model: &Model) -> Vec<u32> {
    const N: usize = 61;
    let index = kanagata_cad::closest::ClosestPoint::new(model);
    let folds = |(patch, &face): (&Patch, &u32)| {
        (0..(N + 1) * (N + 1)).any(|k| {
            let d = patch.derivs((k / (N + 1)) as f64 / N as f64, (k % (N + 1)) as f64 / N as f64);
            let cross = d.d1.cross(&d.d2);
            let foot = index.closest_on_face(face as usize, &d.s).unwrap();
            cross.dot(&foot.normal) < -1e-6 * d.d1.norm() * d.d2.norm()
        })
    };
    let flags: Vec<bool> = tool.patches.par_iter().zip(&tool.faces).map(folds).collect();
    (0u32..).zip(flags).filter(|(_, f)| *f).map(|(k, _)| k).collect()
}

/// At one division per quarter turn an arc of a flat of the punch bulges past the opposite side. The reported patches
/// equal those of dense sampling, there and on models without folds.
#[test]
fn folded_patches_are_found() {
    let mut folded = Vec::new();
    for (file, divisions) in [("cross/punch.igs", 1), ("cross/punch.igs", 2), ("cross/die.igs", 1)]
    {
        let model = read(file);
        let mesh = coarse(&model, divisions, MeshStyle::Quads);
        let (tool, report) = bezier_from_cad(&model, &mesh, &options(1e-4)).unwrap();
        let oracle = folded_by_sampling(&tool, &model);
        println!("{file} {divisions}: reported {:?}, sampled {oracle:?}", report.folded);
        assert_eq!(report.folded, oracle, "{file} {divisions}");
        folded.push(oracle.len());
    }
    assert!(folded[0] > 0 && folded[2] == 0, "{folded:?}");
}

/// Degrees are raised before the mesh is refined, so that a looser tolerance needs no more patches.
#[test]
fn a_looser_tolerance_never_takes_more_patches() {
    for file in ["cross/die.igs", "cross/punch.igs"] {
        let model = read(file);
        let mesh_of = |arc_divisions| {
            mesh(&model, &MappedOptions { arc_divisions, ..MappedOptions::default() })
        };
        let mut most = usize::MAX;
        for tolerance in [1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0] {
            let found = within_tolerance(&model, &options(tolerance), false, 16, mesh_of).unwrap();
            let (count, report) = (found.tool.patches.len(), &found.report);
            println!("{file} {tolerance:.0e} mm: {count} patches, {report:?}");
            assert!(count <= most && report.error_mm <= tolerance && report.folded.is_empty());
            most = count;
        }
    }
}

/// A flat face with an elliptical border.
const DISC: &str = "\
ISO-10303-21;
HEADER;
FILE_DESCRIPTION((''),'2;1');
FILE_NAME('','',(''),(''),'','','');
FILE_SCHEMA(('AUTOMOTIVE_DESIGN'));
ENDSEC;
DATA;
#1=CARTESIAN_POINT('',(0.,0.,0.));
#2=DIRECTION('',(0.,0.,1.));
#3=DIRECTION('',(1.,0.,0.));
#4=AXIS2_PLACEMENT_3D('',#1,#2,#3);
#5=PLANE('',#4);
#6=ELLIPSE('',#4,30.,18.);
#7=CARTESIAN_POINT('',(30.,0.,0.));
#8=VERTEX_POINT('',#7);
#9=EDGE_CURVE('',#8,#8,#6,.T.);
#10=ORIENTED_EDGE('',*,*,#9,.T.);
#11=EDGE_LOOP('',(#10));
#12=FACE_OUTER_BOUND('',#11,.T.);
#13=ADVANCED_FACE('',(#12),#5,.T.);
#14=OPEN_SHELL('',(#13));
#15=SHELL_BASED_SURFACE_MODEL('',(#14));
#16=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));
#17=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));
#18=(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT());
#19=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#16,#17,#18))REPRESENTATION_CONTEXT('',''));
#20=MANIFOLD_SURFACE_SHAPE_REPRESENTATION('',(#15),#19);
ENDSEC;
END-ISO-10303-21;
";

/// Patches of any degree reproduce a flat face. The degrees must follow from its curved border.
#[test]
fn the_curved_border_of_a_plane_sets_the_degrees_of_its_patches() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("disc.step");
    std::fs::write(&file, DISC).unwrap();
    let model = cad::read(&file).unwrap().0;
    let area = std::f64::consts::PI * 30.0 * 18.0;
    for (divisions, tolerance) in [(1, 0.05), (4, 1e-4)] {
        let mesh = coarse(&model, divisions, MeshStyle::Structured);
        let (tool, report) = bezier_from_cad(&model, &mesh, &options(tolerance)).unwrap();
        let found = audit(&tool, &CadReference::new(&model), &AuditOptions::default()).unwrap();
        let error = (found.report.area_mm2 / area - 1.0).abs();
        println!(
            "{divisions}: {} patches, {report:?}, relative area error {error:e}",
            tool.patches.len()
        );
        // Bound: the border deviates by the maximum error along its full length of 153 mm.
        assert!(error < report.error_mm.max(1e-9) * 153.0 / area, "{error} {report:?}");
        assert!(report.degree > 1);
    }
}
