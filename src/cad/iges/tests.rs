//! Claims on whole files.

use super::*;

fn fixture(name: &str) -> RawModel {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/forming").join(name);
    read_bytes(&std::fs::read(path).unwrap(), name).unwrap()
}

#[test]
fn forming_tools_have_the_faces_they_were_made_of() {
    for dialect in ["144", "186", "nurbs144"] {
        let model = fixture(&format!("cross_die_{dialect}.igs"));
        assert_eq!(model.faces.len(), 15, "{dialect}: {:?}", model.diagnostics);
    }
}
