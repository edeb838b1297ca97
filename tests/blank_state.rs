//! Mesh files of blanks that hold results of a formed sheet.

use std::fs;
use std::process::Command;

use serde_json::json;

/// Whether `check` takes a blank of one hexahedron of 4 x 4 x 1 mm from a VTU file with a cell array of this name and value, and
/// what it says. `state`: what the scene says becomes of it.
fn checked(array: &str, value: f64, state: Option<&str>) -> (bool, String) {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let vtu = format!(
        r#"<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">
<UnstructuredGrid><Piece NumberOfPoints="8" NumberOfCells="1">
<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">
0 0 0 4 0 0 4 4 0 0 4 0 0 0 1 4 0 1 4 4 1 0 4 1</DataArray></Points>
<Cells><DataArray type="Int64" Name="connectivity" format="ascii">0 1 2 3 4 5 6 7</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">8</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">12</DataArray></Cells>
<CellData><DataArray type="Float64" Name="{array}" format="ascii">{value}</DataArray></CellData>
</Piece></UnstructuredGrid></VTKFile>"#
    );
    fs::write(folder.join("formed.vtu"), vtu).unwrap();
    let plate = json!({
        "format": "kanagata-tool", "version": 1, "name": "plate", "kind": "nagata", "edges": "guarded",
        "provenance": {}, "vertices": [[-1, -1, 1], [5, -1, 1], [5, 5, 1], [-1, 5, 1]], "normals": [[0, 0, -1]],
        "patches": [{ "vertices": [0, 3, 2, 1], "normals": [0, 0, 0, 0], "face": 0 }]
    });
    fs::write(folder.join("plate.tool.json"), plate.to_string()).unwrap();
    let mut mesh = json!({ "file": "formed.vtu" });
    if let Some(state) = state {
        mesh["state"] = json!(state);
    }
    let scene = json!({
        "format": "kanagata-scene", "version": 1, "name": "formed",
        "blank": { "shape": { "mesh": mesh }, "element": "hex8" },
        "material": {
            "name": "steel", "young_mpa": 210000, "poisson": 0.3, "yield": { "criterion": "von-mises" },
            "hardening": { "law": "swift", "k": 500, "eps0": 0.01, "n": 0.2 }
        },
        "holds": [{ "where": { "all": true }, "axes": ["x"] }],
        "tools": [{
            "name": "plate", "file": "plate.tool.json", "direction": [0, 0, -1], "friction": 0.0,
            "place": { "shift": [0, 0, 0] }
        }],
        "stages": [{ "name": "rest" }]
    });
    let file = folder.join("formed.scene.json");
    fs::write(&file, scene.to_string()).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"));
    let done = command.arg("check").arg(&file).output().unwrap();
    let said = [done.stdout, done.stderr].concat();
    (done.status.code() != Some(2), String::from_utf8(said).unwrap())
}

#[test]
fn a_formed_sheet_is_no_blank_unless_its_state_is_dropped() {
    for name in ["plastic_strain", "stress_mpa", "major_strain", "PEEQ"] {
        let (taken, said) = checked(name, 0.1, None);
        assert!(!taken, "{name}: {said}");
        let told = said.contains(name) && said.contains(r#""state": "drop""#);
        assert!(told && said.contains("formed.vtu"), "{said}");
        let (taken, said) = checked(name, 0.1, Some("drop"));
        assert!(taken, "{name}: {said}");
    }
    // A virgin sheet, and what is no result.
    for (name, value) in [("plastic_strain", 0.0), ("face", 3.0)] {
        let (taken, said) = checked(name, value, None);
        assert!(taken, "{name}: {said}");
    }
    assert!(!checked("plastic_strain", 0.1, Some("keep")).0);
}
