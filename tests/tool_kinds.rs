//! One die as Nagata patches, facets and Bezier patches: same file, same audit, same search.

use std::path::Path;

use kanagata::audit::{AuditOptions, AuditReport, CadReference, audit};
use kanagata::cad::{self, Model};
use kanagata::contact::ToolSurface;
use kanagata::convert::{ConvertOptions, convert};
use kanagata::geometry::Vec3;
use kanagata::mesh::mapped::{MappedOptions, MeshStyle, mesh};
use kanagata::tool::edge::EdgeRule;
use kanagata::tool::exchange::{to_bezier, to_nagata};
use kanagata::tool::file::{Provenance, ToolFile, read};
use kanagata::tool::{ToolKind, ToolModel};

fn die() -> Model {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/cross/die.igs");
    cad::read(&path).unwrap().0
}

fn made(model: &Model, kind: ToolKind, style: MeshStyle) -> ToolModel {
    let options = MappedOptions { arc_divisions: 4, style, ..MappedOptions::default() };
    let convert_options =
        ConvertOptions { kind, sheet_side: Some(Vec3::z()), ..ConvertOptions::default() };
    convert(model, &mesh(model, &options).unwrap(), &convert_options).unwrap().0
}

fn audited(tool: &ToolModel, model: &Model) -> AuditReport {
    audit(tool, &CadReference::new(model), &AuditOptions::default()).unwrap().report
}

/// Closest distance by dense sampling of every patch: never below the true one.
fn sampled(tool: &ToolModel, p: &Vec3) -> f64 {
    const N: usize = 24;
    let mut best = f64::INFINITY;
    for patch in &tool.patches {
        for k in 0..(N + 1) * (N + 1) {
            let (e, z) = ((k / (N + 1)) as f64 / N as f64, (k % (N + 1)) as f64 / N as f64);
            if patch.sides() == 4 || z <= e {
                best = best.min((patch.derivs(e, z).s - p).norm());
            }
        }
    }
    best
}

#[test]
fn every_kind_is_written_read_audited_and_searched() {
    let model = die();
    let folder = tempfile::tempdir().unwrap();
    let nagata = made(&model, ToolKind::Nagata, MeshStyle::Mixed);
    let facets = made(&model, ToolKind::Facets, MeshStyle::Mixed);
    for (tool, error) in [(&nagata, 0.03), (&to_bezier(&nagata), 0.03), (&facets, 0.7)] {
        let path = folder.path().join("die.tool.json");
        ToolFile::of_model(tool, EdgeRule::Guarded, Provenance::default()).write(&path).unwrap();
        let tool = read(&path).unwrap().model;
        let report = audited(&tool, &model);
        println!("{:?}: {:+.5} {:+.5} mm", tool.kind, report.max_mm, report.min_mm);
        assert!(report.worst_mm() < error && report.folded.is_empty() && !report.turned);
        assert!(report.jumps.position_mm < 1e-12);
        let surface = ToolSurface::new(tool.clone());
        for k in 0..60 {
            let turn = f64::from(k) * 0.7548776662;
            let p = Vec3::new(
                125.0 * turn.fract(),
                125.0 * (turn * 1.7).fract(),
                20.0 - 60.0 * (turn * 2.3).fract(),
            );
            let foot = surface.closest(&p, None);
            let distance = (foot.point - p).norm();
            let on_patch = tool.patches[foot.patch as usize].derivs(foot.eta, foot.zeta).s;
            assert!(distance <= sampled(&tool, &p) + 1e-9, "{:?} {p:?}", tool.kind);
            assert!((on_patch - foot.point).norm() < 1e-12);
        }
    }
}

/// Nagata and converted Bezier models have the same errors at the same points; facets need many more patches.
#[test]
fn bezier_has_the_error_of_nagata_and_comes_back_without_loss() {
    let model = die();
    for style in [MeshStyle::Structured, MeshStyle::Mixed] {
        let nagata = made(&model, ToolKind::Nagata, style);
        let bezier = to_bezier(&nagata);
        let (a, b) = (audited(&nagata, &model), audited(&bezier, &model));
        assert!((a.worst_mm() - b.worst_mm()).abs() < 1e-5, "{} {}", a.worst_mm(), b.worst_mm());
        let (back, lost) = to_nagata(&bezier).unwrap();
        println!("{style:?}: lost {:.1e} mm", lost.max_mm);
        assert!(lost.max_mm < 1e-11 && back.patches.len() == nagata.patches.len());
        assert!(back.vertices.len() == nagata.vertices.len());
        assert!((audited(&back, &model).worst_mm() - a.worst_mm()).abs() < 1e-9);
    }
}
