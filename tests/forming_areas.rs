//! Areas of all forming files against closed forms.

use kanagata::cad::read;
use std::path::Path;

#[test]
fn areas_are_right_to_1e_6() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/forming");
    let truth: serde_json::Map<String, serde_json::Value> =
        serde_json::from_slice(&std::fs::read(folder.join("truth.json")).unwrap()).unwrap();
    let mut worst = 0.0f64;
    assert_eq!(truth.len(), 53);
    for (name, expected) in truth {
        let exact = expected["exact_area"].as_f64().unwrap();
        let found = read(&folder.join(&name)).unwrap().0.area();
        let off = (found / exact - 1.0).abs();
        println!("{name:28} {found:18.9} {off:.2e}");
        worst = worst.max(off);
        assert!(off < 1e-6, "{name}: {found} where {exact} is exact");
    }
    println!("worst {worst:e}");
}
