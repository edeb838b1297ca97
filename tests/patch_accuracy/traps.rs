//! Where the plain Eq. 8 fails: each trap with plain edges, and with what guards against it.

use kanagata::audit::reference::{ReferenceFoot, ReferenceSurface};
use kanagata::audit::{AuditOptions, AuditReport, audit};
use kanagata::geometry::Vec3;
use kanagata::tool::build::build;
use kanagata::tool::edge::EdgeRule;
use kanagata::tool::model::{PatchCorners, ToolKind};
use kanagata::tool::{Patch, ToolModel};

use crate::shapes::nagata;

/// A profile in the xz plane, drawn out along y: pieces of constant curvature, tangent to each other, beginning at
/// the origin along x. The normal is 90 degrees to the left.
struct Profile {
    /// Length of a straight piece, or radius and turning angle (positive: to the left).
    pieces: Vec<Piece>,
}

#[derive(Clone, Copy)]
enum Piece {
    Line(f64),
    Arc(f64, f64),
}

impl Profile {
    /// Start and direction angle of every piece, and the end.
    fn joints(&self) -> Vec<([f64; 2], f64)> {
        let mut at = vec![([0.0, 0.0], 0.0f64)];
        for piece in &self.pieces {
            let ([x, z], a) = at[at.len() - 1];
            at.push(match *piece {
                Piece::Line(l) => ([x + l * a.cos(), z + l * a.sin()], a),
                Piece::Arc(r, turn) => {
                    let s = r * turn.signum();
                    let b: f64 = a + turn;
                    ([x + s * (b.sin() - a.sin()), z - s * (b.cos() - a.cos())], b)
                }
            });
        }
        at
    }

    /// One patch 1 mm wide between each pair of joints named.
    fn patches(&self, joints: &[usize], rule: EdgeRule) -> ToolModel {
        let all = self.joints();
        let (mut vertices, mut normals, mut corners) = (vec![], vec![], vec![]);
        for (k, &joint) in (0u32..).zip(joints) {
            let ([x, z], a) = all[joint];
            let n = Vec3::new(-a.sin(), 0.0, a.cos());
            vertices.extend([Vec3::new(x, 0.0, z), Vec3::new(x, 1.0, z)]);
            normals.extend([n, n]);
            if k > 0 {
                let ids = vec![2 * k - 2, 2 * k, 2 * k + 1, 2 * k - 1];
                corners.push(PatchCorners { vertices: ids.clone(), normals: ids, face: 0 });
            }
        }
        nagata(vertices, normals, corners, rule)
    }

    fn report(&self, joints: &[usize], rule: EdgeRule) -> AuditReport {
        let options = AuditOptions { samples: 32, ..AuditOptions::default() };
        audit(&self.patches(joints, rule), self, &options).unwrap().report
    }
}

impl ReferenceSurface for Profile {
    fn closest(&self, p: &Vec3, face: u32) -> Option<ReferenceFoot> {
        let joints = self.joints();
        let mut best: Option<(f64, ReferenceFoot)> = None;
        let mut offer = |[x, z]: [f64; 2], a: f64| {
            let point = Vec3::new(x, p.y, z);
            let normal = Vec3::new(-a.sin(), 0.0, a.cos());
            let distance = (p - point).norm();
            if best.as_ref().is_none_or(|b| distance < b.0) {
                best = Some((
                    distance,
                    ReferenceFoot { point, normal, own_normal: None, face, on_border: false },
                ));
            }
        };
        for (x, a) in &joints {
            offer(*x, *a);
        }
        for (piece, (start, a)) in self.pieces.iter().zip(&joints) {
            match *piece {
                Piece::Line(l) => {
                    let t = (p.x - start[0]) * a.cos() + (p.z - start[1]) * a.sin();
                    let t = t.clamp(0.0, l);
                    offer([start[0] + t * a.cos(), start[1] + t * a.sin()], *a);
                }
                Piece::Arc(r, turn) => {
                    let s = r * turn.signum();
                    let centre = [start[0] - s * a.sin(), start[1] + s * a.cos()];
                    let b = (p.x - centre[0]).atan2(-(p.z - centre[1]));
                    let b = if s > 0.0 { b } else { (centre[0] - p.x).atan2(p.z - centre[1]) };
                    if (0.0..=1.0).contains(&((b - a) / turn)) {
                        offer([centre[0] + s * b.sin(), centre[1] - s * b.cos()], b);
                    }
                }
            }
        }
        best.map(|b| b.1)
    }
}

fn two_arcs(first: f64, second: f64) -> Profile {
    let arc = |degrees: f64| Piece::Arc(7.0, degrees.to_radians());
    Profile { pieces: vec![arc(first), arc(-second)] }
}

fn close(found: f64, expected: f64, relative: f64) {
    assert!((found / expected - 1.0).abs() < relative, "{found} against {expected}");
}

#[test]
fn an_inflected_edge_overshoots_and_is_caught() {
    for second in [29.0, 25.0] {
        let profile = two_arcs(30.0, second);
        let Patch::Quad(c) = &profile.patches(&[0, 2], EdgeRule::Plain).patches[0] else {
            unreachable!()
        };
        // S = c00 + (d - c) e + c e^2: past the end by (|q| - 1)^2 / (4 |q|) of |d| along the chord.
        let (d, c) = (c[1] + c[4], c[4]);
        let q = (c.dot(&d) / d.norm_squared()).abs();
        let overshoot = (q - 1.0).powi(2) / (4.0 * q) * d.norm();
        println!("30/{second}: q {q}, overshoot {overshoot} mm");
        if second == 29.0 {
            close(overshoot, 46.8, 0.002);
        }
        let plain = profile.report(&[0, 2], EdgeRule::Plain);
        assert!(plain.distance_max_mm > overshoot && plain.folded == [0]);
        let guarded = profile.report(&[0, 2], EdgeRule::Guarded);
        assert!(guarded.distance_max_mm < 0.3, "{}", guarded.distance_max_mm);
        assert!(guarded.folded.is_empty());
    }
}

#[test]
fn an_edge_over_an_inflection_is_silently_straight_unless_it_is_cut_there() {
    let profile = two_arcs(30.0, 30.0);
    let tool = profile.patches(&[0, 2], EdgeRule::Plain);
    assert!(tool.patches[0].derivs(0.5, 0.5).d11.norm() < 1e-12, "no curvature at all");
    let across = profile.report(&[0, 2], EdgeRule::Guarded);
    close(across.worst_mm(), 0.24, 0.02);
    let cut = profile.report(&[0, 1, 2], EdgeRule::Guarded);
    let h: f64 = 15f64.to_radians();
    close(cut.worst_mm(), 7.0 * (1.0 - h.cos()).powi(2) / (2.0 * h.cos()), 1e-3);
}

#[test]
fn a_patch_over_flat_and_fillet_is_off_unless_it_is_cut_at_their_border() {
    // Turning right, as over a die shoulder seen from the sheet.
    let profile = Profile { pieces: vec![Piece::Line(3.0), Piece::Arc(7.0, -45f64.to_radians())] };
    let across = profile.report(&[0, 2], EdgeRule::Guarded);
    close(across.min_mm, -0.24, 0.02);
    let cut = profile.report(&[0, 1, 2], EdgeRule::Guarded);
    close(cut.max_mm, 0.02195, 1e-3);
    assert!(cut.min_mm > -1e-12);
}

/// Patches over the unit square in the xy plane with the corner normals given.
fn square(normals: Vec<Vec3>, ids: [u32; 4], rule: EdgeRule) -> ToolModel {
    let vertices = vec![Vec3::zeros(), Vec3::x(), Vec3::x() + Vec3::y(), Vec3::y()];
    let corners = PatchCorners { vertices: vec![0, 1, 2, 3], normals: ids.to_vec(), face: 0 };
    nagata(vertices, normals, vec![corners], rule)
}

#[test]
fn an_averaged_normal_at_a_crease_leaves_no_normal_and_is_caught() {
    let normals = vec![Vec3::z(), Vec3::new(1.0, 0.0, 1.0).normalize()];
    let plain = square(normals.clone(), [1, 0, 0, 1], EdgeRule::Plain);
    assert!(plain.patches[0].derivs(0.0, 0.5).d1.norm() < 1e-12, "no tangent at the crease");
    let guarded = square(normals.clone(), [1, 0, 0, 1], EdgeRule::Guarded);
    assert!(guarded.patches[0].normal(0.0, 0.5).is_some());
    // What the conversion does: each side of the crease keeps its own normal. Then the flat is flat.
    let own = square(normals, [0; 4], EdgeRule::Plain);
    assert_eq!(own.patches[0].derivs(0.3, 0.4).s.z, 0.0);
}

#[test]
fn near_parallel_normals_on_a_tilted_edge_swing_out_and_are_caught() {
    let (tilt, half) = (5f64.to_radians(), 0.05f64.to_radians());
    let leaning = |a: f64| Vec3::new(a.sin(), 0.0, a.cos());
    // Normals that lean by the tilt against the plane of the square.
    let normals = vec![leaning(tilt - half), leaning(tilt + half)];
    let plain = square(normals.clone(), [0, 1, 1, 0], EdgeRule::Plain);
    let out = plain.patches[0].derivs(0.5, 0.5).s - Vec3::new(0.5, 0.5, 0.0);
    close(out.norm(), 100.0 / 4.0, 0.01);
    let vertices = plain.vertices.clone();
    let (guarded, straight) = build(
        "t".into(),
        ToolKind::Nagata,
        vertices,
        normals,
        plain.corners.clone(),
        EdgeRule::Guarded,
    )
    .unwrap();
    assert!((guarded.patches[0].derivs(0.5, 0.5).s - Vec3::new(0.5, 0.5, 0.0)).norm() < 1e-15);
    assert_eq!(straight.len(), 2, "both edges are listed");
}

/// The plane z = 0.
struct Plane;

impl ReferenceSurface for Plane {
    fn closest(&self, p: &Vec3, face: u32) -> Option<ReferenceFoot> {
        let point = Vec3::new(p.x, p.y, 0.0);
        Some(ReferenceFoot { point, normal: Vec3::z(), own_normal: None, face, on_border: false })
    }
}

#[test]
fn a_quad_with_a_corner_past_180_degrees_folds_and_is_named() {
    let folded = |third: f64| {
        let vertices = vec![Vec3::zeros(), Vec3::x(), Vec3::new(third, third, 0.0), Vec3::y()];
        let corners = PatchCorners { vertices: vec![0, 1, 2, 3], normals: vec![0; 4], face: 0 };
        let tool = nagata(vertices, vec![Vec3::z()], vec![corners], EdgeRule::Guarded);
        audit(&tool, &Plane, &AuditOptions::default()).unwrap().report
    };
    let good = folded(0.6);
    assert!(good.folded.is_empty() && good.normal_max_deg < 1e-9);
    let bad = folded(0.4);
    assert_eq!((bad.folded, bad.normal_max_deg), (vec![0], 180.0));
    assert!(bad.max_mm == 0.0 && bad.min_mm == 0.0, "the position alone does not tell");
}
