//! `--max-size-mm`: no side of an element is longer.

use std::path::Path;

use kanagata::cad;
use kanagata::mesh::mapped::{MappedOptions, MeshStyle, mesh};
use kanagata::mesh::{Element, SurfaceMesh};

fn longest(mesh: &SurfaceMesh) -> f64 {
    let length = |[a, b]: [u32; 2]| (mesh.vertices[a as usize] - mesh.vertices[b as usize]).norm();
    mesh.elements.iter().flat_map(Element::sides).map(length).fold(0.0, f64::max)
}

const STYLES: [MeshStyle; 4] =
    [MeshStyle::Structured, MeshStyle::Mixed, MeshStyle::Triangles, MeshStyle::Quads];

/// Mapped and not, in all styles; before, sides were up to 1.8 times as long, and 3.2 where nothing is mapped.
#[test]
fn no_side_is_longer_than_the_largest_size() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures");
    for (file, size) in [
        ("cross/die.igs", 15.0),
        ("cross/holder.igs", 20.0),
        ("forming/hemi_punch_144.igs", 15.0),
        ("forming/cone_144.igs", 8.0),
        ("forming/sphere_144.igs", 8.0),
        ("forming/torus_144.igs", 10.0),
    ] {
        let model = cad::read(&root.join(file)).unwrap().0;
        let (area, size_mm) = (model.area(), Some(size));
        for (style, unstructured) in STYLES.iter().flat_map(|&s| [(s, false), (s, true)]) {
            let options = MappedOptions {
                max_size: size_mm,
                style,
                unstructured,
                arc_divisions: 2,
                ..MappedOptions::default()
            };
            let made = mesh(&model, &options).unwrap();
            let (times, count) = (longest(&made) / size, made.elements.len());
            // Squares of that size would be so many; right triangles twice.
            let ideal = area / (size * size);
            println!("{file} {style:?} {unstructured}: {times:.6}, {count} elements, {ideal:.0}");
            assert!(times <= 1.00001, "{file} {style:?} {unstructured}: {times}");
            assert!(times > 0.6, "{file} {style:?} {unstructured}: {times}, {count} elements");
            assert!((count as f64) < 15.0 * ideal, "{file}: {count} elements, {ideal:.0} squares");
            let uses = made.conformity();
            assert_eq!(uses.irregular, 0, "{file} {style:?} {unstructured}: {uses:?}");
        }
    }
}
