//! Sheets in the form of foreign meshes.

use super::turning::reversed;
use super::*;
use crate::sheet::hex_mesh::{quarter_disc, rectangle, thickened};

/// A mesh with permuted nodes and arbitrarily rotated elements, as other programs write it.
fn foreign(mesh: &HexMesh) -> (Vec<Vec3>, Vec<[u32; 8]>) {
    // These two generate all 24 rotations: about the third direction, and the first to the third.
    let spin = |e: [u32; 8]| [e[1], e[2], e[3], e[0], e[5], e[6], e[7], e[4]];
    let tip = |e: [u32; 8]| [e[4], e[5], e[1], e[0], e[7], e[6], e[2], e[3]];
    let count = mesh.nodes.len() as u32;
    let other = |n: u32| (n * 7 + 3) % count;
    assert_ne!(count % 7, 0);
    let mut points = vec![Vec3::zeros(); mesh.nodes.len()];
    mesh.nodes.iter().enumerate().for_each(|(n, x)| points[other(n as u32) as usize] = *x);
    let turned = |(k, e): (usize, &[u32; 8])| {
        let mut e = e.map(other);
        (0..k % 4).for_each(|_| e = spin(e));
        (0..k / 4 % 4).for_each(|_| e = tip(e));
        (0..k / 16 % 4).for_each(|_| e = spin(e));
        e
    };
    (points, mesh.elements.iter().enumerate().map(turned).collect())
}

/// Elements as sets of positions, and whether each is upright.
fn same_sheet(a: &HexMesh, b: &HexMesh) {
    assert_eq!((a.nodes.len(), a.nodes_per_column), (b.nodes.len(), b.nodes_per_column));
    let column = |m: &HexMesh, c: usize| {
        m.nodes[c * m.nodes_per_column..(c + 1) * m.nodes_per_column].to_vec()
    };
    for c in 0..a.column_count() {
        let own = column(a, c);
        assert!((0..b.column_count()).any(|k| column(b, k) == own), "column {c}");
    }
    let bottom = |m: &HexMesh, e: &[u32; 8]| {
        // Starting at the smallest corner, so that the ring does not depend on the first corner.
        let ring = [0, 1, 2, 3].map(|k| m.nodes[e[k] as usize]);
        let key = |x: &Vec3| (x.x, x.y, x.z);
        let first = (0..4).min_by(|&i, &j| key(&ring[i]).partial_cmp(&key(&ring[j])).unwrap());
        let above = [0, 1, 2, 3].map(|k| m.nodes[e[k + 4] as usize]);
        let turn = |r: [Vec3; 4]| [0, 1, 2, 3].map(|k| r[(k + first.unwrap()) % 4]);
        (turn(ring), turn(above))
    };
    for (e, f) in a.elements.iter().zip(&b.elements) {
        assert_eq!(bottom(a, e), bottom(b, f));
    }
}

#[test]
fn a_sheet_comes_back_from_any_numbering_and_turning() {
    let (points, quads) = quarter_disc(10.0, 3, 4);
    let disc = thickened(&points, &quads, 0.5, 2);
    // Elements smaller in plan than through the thickness are handled correctly.
    let fine = thickened(&points, &quads, 3.0, 1);
    for mesh in [rectangle(8.0, 5.0, 0.8, 5, 3, 2), disc, fine, rectangle(4.0, 2.0, 1.5, 4, 8, 1)] {
        let (points, elements) = foreign(&mesh);
        same_sheet(&mesh, &from_hexahedra(&points, &elements, false, None).unwrap());
        let upside: Vec<[u32; 8]> = mesh
            .elements
            .iter()
            .map(|e| [e[4], e[7], e[6], e[5], e[0], e[3], e[2], e[1]])
            .collect();
        same_sheet(&mesh, &from_hexahedra(&mesh.nodes, &upside, true, None).unwrap());
        // Inverted, as in a mirrored file.
        let mirrored: Vec<[u32; 8]> =
            mesh.elements.iter().map(|e| [4, 5, 6, 7, 0, 1, 2, 3].map(|k| e[k])).collect();
        same_sheet(&mesh, &from_hexahedra(&mesh.nodes, &mirrored, true, None).unwrap());
    }
}

#[test]
fn a_sheet_that_is_no_plane_keeps_its_thickness() {
    let mut mesh = rectangle(30.0, 5.0, 1.0, 12, 2, 1);
    let bend = |x: &Vec3| {
        let (s, c) = (x.x / 12.0).sin_cos();
        Vec3::new((12.0 + x.z) * s, x.y, (12.0 + x.z) * c)
    };
    mesh.nodes = mesh.nodes.iter().map(bend).collect();
    let (points, elements) = foreign(&mesh);
    same_sheet(&mesh, &from_hexahedra(&points, &elements, false, None).unwrap());
}

#[test]
fn what_is_no_sheet_says_why() {
    let mesh = rectangle(4.0, 4.0, 1.0, 2, 2, 1);
    let mut twice = mesh.elements.clone();
    twice.push(twice[0]);
    let found = |e: &[[u32; 8]]| from_hexahedra(&mesh.nodes, e, false, None).unwrap_err();
    assert!(matches!(found(&twice), SheetError::Branches { .. } | SheetError::NoDirection));
    let apart = [mesh.elements[0], mesh.elements[3]];
    assert_eq!(found(&apart), SheetError::Parts { parts: 2, element: 1 });
    let mut flat = mesh.elements.clone();
    flat[2][1] = flat[2][0];
    assert_eq!(found(&flat), SheetError::Degenerate { element: 2 });
    // A step: two layers on one side, one on the other.
    let stairs = rectangle(4.0, 4.0, 2.0, 2, 2, 2);
    let kept: Vec<[u32; 8]> = stairs.elements[..7].to_vec();
    let error = from_hexahedra(&stairs.nodes, &kept, true, None).unwrap_err();
    assert!(matches!(error, SheetError::Levels { .. }), "{error}");
}

#[test]
fn quads_are_turned_towards_z_and_a_moebius_band_is_refused() {
    let (points, quads) = quarter_disc(10.0, 2, 2);
    let mixed = |(k, q): (usize, &[u32; 4])| if k % 3 == 0 { reversed(q) } else { *q };
    let mixed: Vec<[u32; 4]> = quads.iter().enumerate().map(mixed).collect();
    let up = oriented(&points, &mixed).unwrap();
    for (a, b) in up.iter().zip(&quads) {
        let turned = (0..4).any(|k| [0, 1, 2, 3].map(|i| a[(i + k) % 4]) == *b);
        assert!(turned, "{a:?} {b:?}");
    }
    let ring = |k: u32| [2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1];
    let mut band: Vec<[u32; 4]> = (0..4).map(ring).collect();
    band.push([8, 1, 0, 9]);
    let points: Vec<Vec3> =
        (0..10).map(|k| Vec3::new(f64::from(k / 2), f64::from(k % 2), 0.0)).collect();
    assert!(matches!(oriented(&points, &band), Err(SheetError::OneSided { .. })));
    let apart = oriented(&points, &[ring(0), ring(2)]).unwrap_err();
    assert_eq!(apart, SheetError::Parts { parts: 2, element: 1 });
}

/// A slice half as wide as it is thick: its shortest columns run across it.
#[test]
fn the_given_thickness_selects_the_direction() {
    let slice = rectangle(10.0, 0.5, 1.0, 10, 1, 1);
    let found = |thickness| {
        from_hexahedra(&slice.nodes, &slice.elements, false, thickness).unwrap().mean_thickness()
    };
    assert!((found(None) - 0.5).abs() < 1e-12);
    assert!((found(Some(1.0)) - 1.0).abs() < 1e-12);
}
