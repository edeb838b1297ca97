//! Warped shells and large rotations: twisted beam and slit annular plate.

use std::f64::consts::{FRAC_PI_2, PI};

use super::*;

/// MacNeal & Harder's beam of length 12 and width 1.1, twisted by 90 degrees, under a unit end force. Returns the
/// displacement along the force, normal to the clamped end (`1`) or in its plane (`0`).
fn twisted_beam(kind: ElementKind, cells: [usize; 2], normal: usize) -> f64 {
    let (thickness, force) = (0.32, 1e-2);
    let mut mesh = hex_mesh::rectangle(12.0, 1.1, thickness, cells[0], cells[1], 1);
    for x in &mut mesh.nodes {
        let (s, c) = (FRAC_PI_2 * x.x / 12.0).sin_cos();
        let (y, z) = (x.y - 0.55, x.z - 0.5 * thickness);
        *x = Vec3::new(x.x, c * y - s * z, s * y + c * z);
    }
    let end = select(&mesh, |x| x.x > 12.0 - 1e-9);
    let held = clamp(&select(&mesh, |x| x.x < 1e-9));
    let share = |node: usize| if mesh.nodes[node].z.abs() > 0.55 - 1e-9 { 1.0 } else { 2.0 };
    let problem = Problem { held, loads: spread(&end, force, 1 + normal, share), steps: 1 };
    let (u, _) = solve(&mut body(&mesh, kind, 29e6, 0.22), &problem);
    end.iter().map(|&node| u[3 * node + 1 + normal]).sum::<f64>() / end.len() as f64 / force
}

/// Published: 0.005424 normal to the clamped end and 0.001754 in its plane (MacNeal & Harder 1985).
#[test]
fn twisted_beam_bends_in_and_out_of_plane() {
    for kind in [SHELL, SHELL_ENHANCED, ElementKind::Hex8Enhanced] {
        for (normal, published) in [(1, 5.424e-3), (0, 1.754e-3)] {
            let error = twisted_beam(kind, [48, 8], normal) / published - 1.0;
            println!("twisted beam, {kind:?}: {error:+.4}");
            assert!(error.abs() < 0.02, "{kind:?}, {normal}: {error:+.4}");
        }
    }
}

/// Annular plate of radii 6 and 10, thickness 0.03, slit along x > 0: one side clamped, the other lifted by 0.8 per
/// unit length. Returns the deflection of the inner and outer corner of the lifted side.
fn slit_plate(kind: ElementKind, cells: [usize; 2], steps: usize) -> [f64; 2] {
    let mut mesh = hex_mesh::rectangle(1.0, 1.0, 0.03, cells[0], cells[1], 1);
    let mut angles = Vec::new();
    for x in &mut mesh.nodes {
        let (radius, angle) = (6.0 + 4.0 * x.x, 2.0 * PI * x.y);
        angles.push(angle);
        *x = Vec3::new(radius * angle.cos(), radius * angle.sin(), x.z - 0.015);
    }
    let side = |at: f64| -> Vec<usize> {
        (0..mesh.nodes.len()).filter(|&n| (angles[n] - at).abs() < 1e-9).collect()
    };
    let lifted = side(2.0 * PI);
    let radius = |node: usize| mesh.nodes[node].xy().norm();
    let share = |node: usize| if (radius(node) - 8.0).abs() > 2.0 - 1e-9 { 1.0 } else { 2.0 };
    let loads = spread(&lifted, 0.8 * 4.0, 2, share);
    let problem = Problem { held: clamp(&side(0.0)), loads, steps };
    let (u, _) = solve(&mut body(&mesh, kind, 21e6, 0.0), &problem);
    [6.0, 10.0].map(|r| {
        let corner: Vec<usize> =
            lifted.iter().copied().filter(|&n| (radius(n) - r).abs() < 1e-9).collect();
        corner.iter().map(|&n| u[3 * n + 2]).sum::<f64>() / corner.len() as f64
    })
}

/// Sze, Liu & Lo (2004): 13.891 and 17.528. With 24 steps an iterate of this undamped Newton solver inverts an
/// element.
#[test]
fn slit_annular_plate_lifts_as_published() {
    let found = slit_plate(SHELL_ENHANCED, [8, 60], 48);
    for (found, published) in found.iter().zip([13.891, 17.528]) {
        let error = found / published - 1.0;
        println!("slit plate: {found:.4} of {published} ({error:+.4})");
        assert!(error.abs() < 0.02, "{found} of {published}");
    }
}
