//! The audit against dense sampling that shares no code with it but the patches and the closest points of the CAD.

use std::path::Path;

use kanagata::audit::{AuditOptions, AuditReport, CadReference, audit};
use kanagata::cad::closest::ClosestPoint;
use kanagata::cad::{self, Model};
use kanagata::convert::bezier::{BezierOptions, bezier_from_cad};
use kanagata::convert::tolerance::{Borders, Goal, to_tolerance};
use kanagata::convert::{ConvertOptions, convert};
use kanagata::mesh::mapped::{MappedOptions, MeshStyle, mesh};
use kanagata::tool::edge::EdgeRule;
use kanagata::tool::{Patch, ToolKind, ToolModel};
use rayon::prelude::*;

fn read(file: &str) -> Model {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(file);
    cad::read(&path).unwrap().0
}

fn made(
    model: &Model,
    arc_divisions: usize,
    style: MeshStyle,
    options: &ConvertOptions,
) -> ToolModel {
    let size = MappedOptions { arc_divisions, style, ..MappedOptions::default() };
    convert(model, &mesh(model, &size).unwrap(), options).unwrap().0
}

fn report(tool: &ToolModel, model: &Model) -> AuditReport {
    audit(tool, &CadReference::new(model), &AuditOptions::default()).unwrap().report
}

/// Parameters spread over a patch on a grid of `n` intervals that has no point but the corners in common with the
/// audit's of eight, its halves and their halves.
fn spread(patch: &Patch, n: usize) -> Vec<(f64, f64)> {
    let at = |k: usize| k as f64 / n as f64;
    let all = (0..(n + 1) * (n + 1)).map(|k| (at(k / (n + 1)), at(k % (n + 1))));
    all.filter(|&(e, z)| patch.sides() == 4 || z <= e).collect()
}

/// Largest and smallest Eq. 24 over dense points of all patches [mm], and the largest normal error where a patch is
/// regular and the foot is on its own face [degrees].
fn sampled(tool: &ToolModel, model: &Model, n: usize) -> [f64; 3] {
    let index = ClosestPoint::new(model);
    let of_patch = |(patch, &face): (&Patch, &u32)| {
        let mut worst = [f64::NEG_INFINITY, f64::INFINITY, 0.0];
        for (e, z) in spread(patch, n) {
            let d = patch.derivs(e, z);
            let foot = index.closest(&d.s).unwrap();
            let delta = (d.s - foot.point).dot(&foot.normal);
            worst[0] = delta.max(worst[0]);
            worst[1] = delta.min(worst[1]);
            let cross = d.d1.cross(&d.d2);
            // At an apex, a corner, the CAD has no normal of its own.
            let corner = [e, z].iter().all(|t| *t == 0.0 || *t == 1.0);
            if !corner
                && foot.face == face as usize
                && cross.norm() > 1e-6 * d.d1.norm() * d.d2.norm()
            {
                let angle = cross.cross(&foot.normal).norm().atan2(cross.dot(&foot.normal));
                worst[2] = angle.to_degrees().max(worst[2]);
            }
        }
        worst
    };
    let all: Vec<[f64; 3]> = tool.patches.par_iter().zip(&tool.faces).map(of_patch).collect();
    let most = |k: usize| all.iter().map(|w| w[k]).fold(f64::NEG_INFINITY, f64::max);
    [most(0), all.iter().map(|w| w[1]).fold(f64::INFINITY, f64::min), most(2)]
}

/// A value is what the audit says at the point it names: it does not exceed the true maximum.
fn is_attained(tool: &ToolModel, model: &Model, found: &AuditReport) {
    let w = &found.worst[0];
    let p = tool.patches[w.patch as usize].derivs(w.eta, w.zeta).s;
    let foot = ClosestPoint::new(model).closest(&p).unwrap();
    let delta = (p - foot.point).dot(&foot.normal);
    assert!((delta - w.delta_mm).abs() <= 1e-9 * found.worst_mm() + 1e-12, "{delta} {w:?}");
    assert!((w.delta_mm.abs() - found.worst_mm()).abs() <= 1e-15);
}

#[test]
fn the_largest_error_reported_is_the_largest_there_is() {
    let nagata = ConvertOptions::default();
    let facets = ConvertOptions { kind: ToolKind::Facets, ..nagata.clone() };
    let cad = ConvertOptions { through_cad: true, ..nagata.clone() };
    use MeshStyle::{Mixed, Quads, Structured, Triangles};
    for (file, divisions, style, options) in [
        ("cross/die.igs", 2, Structured, &nagata),
        ("cross/die.igs", 3, Triangles, &nagata),
        ("cross/die.igs", 3, Mixed, &cad),
        ("cross/punch.igs", 3, Structured, &facets),
        ("forming/hemi_punch_144.igs", 2, Structured, &nagata),
        ("forming/torus_AP214.stp", 3, Structured, &nagata),
        ("forming/square_die_186.igs", 2, Quads, &nagata),
        ("forming/cone_AP214.stp", 2, Structured, &nagata),
        ("forming/round_die_nurbs144.igs", 2, Mixed, &cad),
    ] {
        let model = read(file);
        let tool = made(&model, divisions, style, options);
        check(file, &tool, &model);
    }
}

#[test]
fn so_it_is_of_models_whose_error_has_two_sides() {
    let model = read("cross/die.igs");
    let goal = Goal {
        tol_mm: 0.05,
        normal_deg: f64::INFINITY,
        two_sided: true,
        borders: Borders::Conforming,
    };
    let options = ConvertOptions { through_cad: true, ..ConvertOptions::default() };
    let refined = to_tolerance(&model, &MappedOptions::default(), &options, &goal).unwrap();
    check("die to a tolerance", &refined.tool, &model);
    let size = MappedOptions { arc_divisions: 1, ..MappedOptions::default() };
    let options = BezierOptions {
        name: "b".into(),
        tolerance_mm: 0.05,
        sheet_side: None,
        flip: false,
        progress: Default::default(),
    };
    let (tool, _) = bezier_from_cad(&model, &mesh(&model, &size).unwrap(), &options).unwrap();
    check("die, Bezier", &tool, &model);
}

fn check(what: &str, tool: &ToolModel, model: &Model) {
    let found = report(tool, model);
    let [max, min, normal] = sampled(tool, model, 37);
    let mm = max.max(-min);
    println!(
        "{what}: {} patches; {:+.6} {:+.6} mm, {:.4} deg; sampled {max:+.6} {min:+.6} mm, {normal:.4} deg",
        tool.patches.len(),
        found.max_mm,
        found.min_mm,
        found.normal_max_deg
    );
    let size = model.bbox().diagonal();
    let holds = |found: f64, sampled: f64| found >= 0.99 * sampled - 1e-9 * size;
    assert!(holds(found.worst_mm(), mm), "{what}: {} mm, sampled {mm}", found.worst_mm());
    assert!(holds(found.max_mm, max) && holds(-found.min_mm, -min), "{what}: one side");
    assert!(found.normal_max_deg >= 0.99 * normal - 1e-6, "{what}: normals, sampled {normal}");
    is_attained(tool, model, &found);
}

/// At the apex of a cone the normals of all directions meet: none of them is a fold of a patch that ends there.
#[test]
fn an_apex_is_no_fold() {
    for file in ["forming/cone_144.igs", "forming/cone_186.igs", "forming/cone_AP214.stp"] {
        let model = read(file);
        for divisions in [2, 6] {
            let options = ConvertOptions::default();
            let tool = made(&model, divisions, MeshStyle::Structured, &options);
            let found = report(&tool, &model);
            println!("{file}: {} patches, {:.2} deg", tool.patches.len(), found.normal_max_deg);
            assert!(found.folded.is_empty() && turned_over(&tool, &model).is_empty(), "{file}");
            assert!(found.normal_max_deg < 60.0 / divisions as f64, "{}", found.normal_max_deg);
        }
    }
}

/// Patches whose parametrisation turns over somewhere, by dense sampling against the normal of their own CAD face.
fn turned_over(tool: &ToolModel, model: &Model) -> Vec<u32> {
    let index = ClosestPoint::new(model);
    let folds = |(patch, &face): (&Patch, &u32)| {
        spread(patch, 61).into_iter().any(|(e, z)| {
            let d = patch.derivs(e, z);
            let cross = d.d1.cross(&d.d2);
            let foot = index.closest_on_face(face as usize, &d.s).unwrap();
            let corner = [e, z].iter().all(|t| *t == 0.0 || *t == 1.0);
            !corner && cross.dot(&foot.normal) < -1e-6 * d.d1.norm() * d.d2.norm()
        })
    };
    let flags: Vec<bool> = tool.patches.par_iter().zip(&tool.faces).map(folds).collect();
    (0u32..).zip(flags).filter(|(_, f)| *f).map(|(k, _)| k).collect()
}

/// Coarse meshes with plain Eq. 8 fold; every fold that dense points show is reported, and no patch that shows none.
#[test]
fn folds_are_found_where_the_jacobian_changes_sign() {
    let options = ConvertOptions { edges: EdgeRule::Plain, ..ConvertOptions::default() };
    let mut folded = 0;
    for (file, divisions, style) in [
        ("cross/punch.igs", 1, MeshStyle::Quads),
        ("cross/die.igs", 1, MeshStyle::Triangles),
        ("cross/holder.igs", 1, MeshStyle::Structured),
        ("forming/square_punch_144.igs", 1, MeshStyle::Quads),
        ("forming/hemi_punch_AP214.stp", 1, MeshStyle::Structured),
        ("cross/die.igs", 4, MeshStyle::Structured),
    ] {
        let model = read(file);
        let size = MappedOptions { arc_divisions: divisions, style, ..MappedOptions::default() };
        let (tool, made) = convert(&model, &mesh(&model, &size).unwrap(), &options).unwrap();
        let oracle = turned_over(&tool, &model);
        let audited = report(&tool, &model).folded;
        println!(
            "{file} {divisions} {style:?}: {oracle:?}, audit {audited:?}, made {:?}",
            made.folded
        );
        assert_eq!(oracle, audited, "{file} {divisions} {style:?}");
        assert_eq!(oracle, made.folded, "{file} {divisions} {style:?}");
        folded += oracle.len();
    }
    assert!(folded > 0, "none of the models folds: the test shows nothing");
}
