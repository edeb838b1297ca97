//! CAD to a tool file: `cargo run --release --example convert_die DIE.igs DIE.tool.json`.

use std::path::Path;

use kanagata::prelude::{Cad, ConvertSettings, Error};

fn convert(cad: &Path, tool: &Path) -> Result<(), Error> {
    let cad = Cad::read(cad)?;
    for warning in cad.warnings() {
        eprintln!("warning: {warning}");
    }
    let settings =
        ConvertSettings { sheet_side: Some([0.0, 0.0, 1.0]), ..ConvertSettings::within(0.01) };
    let die = cad.convert(&settings)?;
    println!(
        "{} faces, {} patches, error {:?} mm",
        cad.faces(),
        die.patches(),
        die.shape_error_mm()
    );
    for doubt in die.doubts() {
        eprintln!("doubt {doubt}");
    }
    die.write(tool)
}

fn main() -> Result<(), Error> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [cad, tool] = &arguments[..] else {
        eprintln!("convert_die DIE.igs DIE.tool.json");
        return Ok(());
    };
    convert(cad.as_ref(), tool.as_ref())
}

#[test]
fn the_example_converts() {
    let folder = tempfile::tempdir().unwrap();
    let tool = folder.path().join("die.tool.json");
    convert("fixtures/forming/round_die_144.igs".as_ref(), &tool).unwrap();
    assert!(kanagata::prelude::Tool::read(tool).unwrap().shape_error_mm().unwrap() <= 0.01);
}
