//! Shape error of a tool (Eq. 24): `cargo run --release --example audit_tool DIE.tool.json DIE.igs`.

use std::path::Path;

use kanagata::prelude::{Audit, AuditOptions, Cad, Error, Tool};

fn audit(tool: &Path, cad: &Path) -> Result<Audit, Error> {
    let options = AuditOptions { tolerance_mm: Some(0.05), ..AuditOptions::default() };
    let audit = Tool::read(tool)?.audit(&Cad::read(cad)?, &options)?;
    let report = &audit.report;
    println!(
        "shape error {:.5} to {:.5} mm, rms {:.5} mm",
        report.min_mm, report.max_mm, report.rms_mm
    );
    for worst in &report.worst {
        println!("  patch {} on face {}: {worst:?}", worst.patch, worst.face);
    }
    Ok(audit)
}

fn main() -> Result<(), Error> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [tool, cad] = &arguments[..] else {
        eprintln!("audit_tool DIE.tool.json DIE.igs");
        return Ok(());
    };
    audit(tool.as_ref(), cad.as_ref()).map(drop)
}

#[test]
fn the_example_audits() {
    let folder = tempfile::tempdir().unwrap();
    let tool = folder.path().join("punch.tool.json");
    let cad = Path::new("fixtures/forming/hemi_punch_144.igs");
    let settings = kanagata::prelude::ConvertSettings::within(0.05);
    Cad::read(cad).unwrap().convert(&settings).unwrap().write(&tool).unwrap();
    let audit = audit(&tool, cad).unwrap();
    assert!(audit.report.worst_mm() <= 0.05 && audit.report.doubts.is_empty());
}
