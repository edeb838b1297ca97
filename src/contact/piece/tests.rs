use super::*;
use crate::hull::{Hull, control_net};

struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as f64) / (1u64 << 31) as f64 - 0.5
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next())
    }
}

fn bent(random: &mut Random, degrees: [usize; 2], bend: f64) -> Patch {
    let points = (0..=degrees[0])
        .flat_map(|i| (0..=degrees[1]).map(move |j| (i, j)))
        .map(|(i, j)| {
            let at = Vec3::new(i as f64 / degrees[0] as f64, j as f64 / degrees[1] as f64, 0.0);
            at * 3.0 + random.vector() * bend
        })
        .collect();
    Patch::Bezier { degrees, points }
}

fn samples(shape: Shape) -> Vec<Vec2> {
    let c = shape.corners();
    let mut all = Vec::new();
    for i in 0..=8 {
        for j in 0..=8 {
            let (a, b) = (f64::from(i) / 8.0, f64::from(j) / 8.0);
            all.push(match shape {
                Shape::Square => c[0] + (c[2] - c[0]).component_mul(&Vec2::new(a, b)),
                Shape::Triangle => c[0] + (c[1] - c[0]) * (a * (1.0 - b)) + (c[2] - c[0]) * b,
            });
        }
    }
    all
}

fn pieces() -> Vec<Piece> {
    let mut random = Random(5);
    let mut all = Vec::new();
    for bend in [0.0, 0.3, 2.0] {
        let mut patches = vec![];
        for degrees in [[1, 1], [2, 2], [3, 2], [6, 6]] {
            patches.push(bent(&mut random, degrees, bend));
        }
        let mut c = [Vec3::zeros(); 8].map(|_| random.vector() * bend);
        c[1] += Vec3::x() * 2.0;
        c[2] += Vec3::y() * 2.0;
        patches.push(Patch::Quad(c));
        patches.push(Patch::Triangle([c[0], c[1], c[2], c[3], c[4], c[5]]));
        for patch in patches {
            all.extend(pieces_of(0, &patch).into_iter().map(|p| p.0));
        }
    }
    all
}

#[test]
fn no_point_of_a_piece_is_below_its_floor_and_convex_means_convex() {
    let mut random = Random(9);
    let (mut convex, mut tight) = (0, 0);
    for piece in pieces() {
        for reach in [1.0, 5.0, 50.0] {
            let w = random.vector() * reach;
            let floor = piece.floor(Plain, &w);
            let mut least = f64::INFINITY;
            for x in samples(piece.shape) {
                let d = piece.form.derivs(x.x, x.y);
                let q = w - d.s;
                least = least.min(0.5 * q.norm_squared());
                let h11 = d.d1.norm_squared() - q.dot(&d.d11);
                let h22 = d.d2.norm_squared() - q.dot(&d.d22);
                let h12 = d.d1.dot(&d.d2) - q.dot(&d.d12);
                if floor.convex {
                    assert!(h11 > 0.0 && h11 * h22 > h12 * h12);
                }
            }
            let sharp = piece.sharp_floor(&w).value;
            assert!(floor.value <= least && sharp <= least, "{floor:?} {sharp} {least}");
            convex += usize::from(floor.convex);
            tight += usize::from(floor.value > 0.5 * least);
        }
    }
    assert!(convex > 50 && tight > 100, "{convex} {tight}: the bounds must be of use");
}

#[test]
fn no_point_of_a_piece_or_part_is_below_the_floor_about_any_other() {
    let mut random = Random(21);
    let (mut tight, mut of_parts) = (0, 0);
    for piece in pieces() {
        for reach in [0.5, 5.0, 50.0] {
            let w = random.vector() * reach;
            let min_curvature = piece.floor(Plain, &w).min_curvature;
            let value = |x: &Vec2| 0.5 * (w - piece.form.derivs(x.x, x.y).s).norm_squared();
            let places = samples(piece.shape);
            let lowest = places.iter().map(value).fold(f64::INFINITY, f64::min);
            for x in places.iter().step_by(7) {
                let d = piece.form.derivs(x.x, x.y);
                let q = w - d.s;
                let gradient = Vec2::new(-q.dot(&d.d1), -q.dot(&d.d2));
                let floor = floor_about(piece.shape, x, value(x), &gradient, min_curvature);
                assert!(floor <= lowest, "{floor} {lowest} about {x:?}");
                tight += usize::from(floor > 0.9 * lowest);
            }
            for cut in piece.cuts() {
                let floor = piece.floor_of_part(&w, min_curvature, &cut);
                let inside = places.iter().map(|x| value(&cut.at(x)));
                let lowest = inside.fold(f64::INFINITY, f64::min);
                assert!(floor <= lowest, "{floor} {lowest} in {cut:?}");
                of_parts += usize::from(floor > 0.9 * lowest);
            }
        }
    }
    assert!(tight > 500 && of_parts > 300, "{tight} {of_parts}: the bounds must be of use");
}

#[test]
fn the_control_net_holds_the_piece() {
    for piece in pieces() {
        let net = kanagata_geometry::Aabb::of_points(&control_net(&piece));
        for x in samples(piece.shape) {
            let s = piece.form.derivs(x.x, x.y).s;
            assert!(net.distance_squared(&s) < 1e-24);
        }
    }
}

#[test]
fn pieces_cover_their_patch_once() {
    let mut random = Random(3);
    for patch in [bent(&mut random, [3, 3], 2.0), bent(&mut random, [2, 2], 0.1)] {
        let area = |chart: &Chart| {
            let [a, b] = chart.columns;
            4.0 * (a.x * b.y - a.y * b.x)
        };
        let sum: f64 = pieces_of(0, &patch).iter().map(|(_, chart)| area(chart)).sum();
        assert!((sum - 1.0).abs() < 1e-14);
    }
}

/// From any point of a piece as foot point, not only the closest one.
#[test]
fn no_point_of_a_piece_is_below_the_floor_of_its_hull() {
    let mut random = Random(11);
    let mut flat = Vec::new();
    for taper in [0.3, 0.6, 1.0] {
        for noise in [0.0, 1e-9, 0.05] {
            let corner = |x: f64, y: f64| Vec3::new(x * (1.0 + y * (taper - 1.0)), 4.0 * y, 0.0);
            let points = [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)]
                .map(|(x, y)| corner(x, y) * 5.0 + random.vector() * noise);
            flat.push(Patch::Bezier { degrees: [1, 1], points: points.to_vec() });
        }
    }
    let flat = flat.iter().flat_map(|p| pieces_of(0, p)).map(|p| p.0);
    let (mut known, mut tight) = (0, 0);
    for piece in pieces().into_iter().chain(flat) {
        let hull = Hull::of(&piece);
        for reach in [0.1, 1.0, 5.0] {
            let w = random.vector() * reach;
            let all: Vec<_> =
                samples(piece.shape).iter().map(|x| piece.form.derivs(x.x, x.y)).collect();
            let value = |d: &crate::form::LocalDerivs| 0.5 * (w - d.s).norm_squared();
            let least = all.iter().map(value).fold(f64::INFINITY, f64::min);
            for foot in &all {
                let floor = hull.floor(&w, foot);
                assert!(floor <= least + 1e-13, "{floor} {least} {piece:?}");
                known += usize::from(floor.is_finite());
                tight += usize::from(floor > 0.9 * least);
            }
        }
    }
    assert!(known > 5000 && tight > 500, "{known} {tight}: the bounds must be of use");
}
