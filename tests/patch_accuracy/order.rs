//! Orders of accuracy, down to normals 1e-5 rad apart.
//!
//! There the error of a patch is 1e-20 of the radius, far below the rounding of its coordinates in a frame with
//! its origin on the axis. So the patch is set in the frame of a surface point beside it, where vertices and
//! distances have full *relative* precision: the origin lies on the equator of the torus, x along the normal
//! there, and the signed distance is written without cancellation of terms of order one.

use kanagata::audit::{AuditOptions, audit};
use kanagata::geometry::Vec3;
use kanagata::tool::{Patch, ToolModel};

use crate::shapes::{Cells, Torus, grid};

/// The equator of a torus, `side` = 1: the outer one (elliptic), -1: the inner one (hyperbolic).
#[derive(Clone, Copy)]
struct Equator {
    line: f64,
    tube: f64,
    side: f64,
}

impl Equator {
    /// Distance of the origin from the axis.
    fn radius(&self) -> f64 {
        self.line + self.side * self.tube
    }

    /// Point and normal at the angles `theta` round the axis and `phi` round the tube.
    fn at(&self, theta: f64, phi: f64) -> (Vec3, Vec3) {
        let versine = |a: f64| 2.0 * (a / 2.0).sin().powi(2);
        let sunk = -self.side * self.tube * versine(phi);
        let around = self.radius() + sunk;
        let x =
            Vec3::new(sunk - around * versine(theta), around * theta.sin(), self.tube * phi.sin());
        let n = Vec3::new(
            self.side * phi.cos() * theta.cos(),
            self.side * phi.cos() * theta.sin(),
            phi.sin(),
        );
        (x, n)
    }

    /// Signed distance of a point given in the local frame.
    fn distance(&self, p: &Vec3) -> f64 {
        let r0 = self.radius();
        let rho = (r0 + p.x).hypot(p.y);
        let out = (2.0 * r0 * p.x + p.x * p.x + p.y * p.y) / (rho + r0);
        let across = (out + self.side * self.tube).hypot(p.z);
        (out * out + p.z * p.z + 2.0 * self.side * self.tube * out) / (across + self.tube)
    }
}

/// Largest |error| over all patches.
fn error(tool: &ToolModel, shape: &Equator) -> f64 {
    let mut worst: f64 = 0.0;
    for patch in &tool.patches {
        for i in 0..=12 {
            for j in 0..=12 {
                let (e, z) = (f64::from(i) / 12.0, f64::from(j) / 12.0);
                if z <= e || matches!(patch, Patch::Quad(_)) {
                    worst = worst.max(shape.distance(&patch.derivs(e, z).s).abs());
                }
            }
        }
    }
    worst
}

/// Least-squares slope of `log error` over `log size`.
fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let logs: Vec<(f64, f64)> = points.iter().map(|(h, e)| (h.ln(), e.ln())).collect();
    let (mx, my) =
        (logs.iter().map(|p| p.0).sum::<f64>() / n, logs.iter().map(|p| p.1).sum::<f64>() / n);
    let top: f64 = logs.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum();
    top / logs.iter().map(|p| (p.0 - mx).powi(2)).sum::<f64>()
}

/// Sizes of a patch: angles about its equator, from 0.2 rad to 3e-6.
fn sizes() -> impl Iterator<Item = f64> {
    (0..17).map(|k| 0.2 * 0.5f64.powi(k))
}

const SHAPES: [Equator; 2] =
    [Equator { line: 17.0, tube: 7.0, side: 1.0 }, Equator { line: 17.0, tube: 7.0, side: -1.0 }];

/// Shape of a cell in the parameters: its two sides, and how much its third corner is moved, in sizes h.
#[derive(Clone, Copy, Debug)]
struct Corners {
    sides: [[f64; 2]; 2],
    moved: f64,
}

const REGULAR: Corners = Corners { sides: [[1.0, 0.0], [0.0, 1.0]], moved: 0.0 };
const SKEW: Corners = Corners { sides: [[0.9, 0.5], [-0.2, 1.0]], moved: 0.0 };

/// One cell of size h, off the symmetric place.
fn cell(shape: &Equator, h: f64, cells: Cells, corners: Corners) -> ToolModel {
    let place = |s: f64, t: f64| {
        let [a, b] = corners.sides;
        let moved = s * t * corners.moved;
        let along = |k: usize| a[k] * s + b[k] * t + moved;
        shape.at(shape.side * h * (0.3 + along(0)), h * (0.2 + along(1)))
    };
    grid(1, cells, place)
}

/// Largest angle between the normals at two corners [rad].
fn widest(tool: &ToolModel) -> f64 {
    let off = |a: &Vec3| tool.normals.iter().map(|b| (a - b).norm()).fold(0.0, f64::max);
    tool.normals.iter().map(off).fold(0.0, f64::max)
}

/// Errors by size: the slope must reach `order`, and from 0.05 rad on every halving must; no error may exceed
/// `bound * tube * h^ceil(order)`.
fn check(cells: Cells, corners: Corners, order: f64, bound: f64) {
    for shape in &SHAPES {
        let errors: Vec<(f64, f64)> =
            sizes().map(|h| (h, error(&cell(shape, h, cells, corners), shape))).collect();
        let found = slope(&errors);
        println!("{cells:?} {corners:?} side {}: order {found:.3}", shape.side);
        assert!(found >= order, "{cells:?} {corners:?}: order {found}");
        for pair in errors.windows(2).filter(|p| p[0].0 <= 0.051) {
            let halved = (pair[0].1 / pair[1].1).log2();
            assert!(halved >= order, "{cells:?} {corners:?}, h = {}: order {halved}", pair[1].0);
        }
        let last = errors[errors.len() - 1].0;
        let apart = widest(&cell(shape, last, cells, corners));
        assert!(apart < 1e-5, "the smallest normals are {apart} rad apart");
        for (h, e) in &errors {
            let scaled = e / (shape.tube * h.powf(order.ceil()));
            assert!(scaled < bound, "{cells:?}, h = {h}: {scaled}");
        }
    }
}

#[test]
fn regular_quads_are_of_fourth_order() {
    check(Cells::Quads, REGULAR, 3.9, 0.1);
}

#[test]
fn triangles_are_of_third_order() {
    for corners in [REGULAR, SKEW] {
        check(Cells::Triangles, corners, 2.9, 0.05);
        check(Cells::TrianglesAcross, corners, 2.9, 0.05);
    }
}

#[test]
fn skewed_quads_are_of_third_order() {
    check(Cells::Quads, SKEW, 2.9, 0.05);
}

/// A quad whose corners form no parallelogram at any size lacks the `eta^2 zeta^2` term: in the middle it is off by a
/// 32nd of the second fundamental form of the twist, so it is of second order only. A smooth mesh is refined
/// towards parallelograms, where the twist is O(h^2) and the loss O(h^4).
#[test]
fn the_loss_of_twisted_quads_is_the_lost_term() {
    for moved in [0.1, 0.25] {
        for shape in &SHAPES {
            for h in [1e-3, 1e-4, 1e-5] {
                let corners = Corners { moved, ..REGULAR };
                let tool = cell(shape, h, Cells::Quads, corners);
                let found = shape.distance(&tool.patches[0].derivs(0.5, 0.5).s);
                let form = (shape.radius() * shape.side + shape.tube) * (moved * h).powi(2);
                assert!((found.abs() / (form.abs() / 32.0) - 1.0).abs() < 0.02, "{found} {form}");
            }
        }
    }
    for shape in &SHAPES {
        let smooth = |h: f64| {
            let corners = Corners { moved: h, ..SKEW };
            (h, error(&cell(shape, h, Cells::Quads, corners), shape))
        };
        let order = slope(&sizes().map(smooth).collect::<Vec<_>>());
        assert!(order >= 2.9, "smoothly distorted quads: order {order}");
    }
}

/// In the frame of the whole torus, 24 mm from the origin, rounding is all that comes on top.
#[test]
fn far_from_the_origin_rounding_is_all_that_is_added() {
    let torus = Torus { line: 17.0, tube: 7.0 };
    for h in sizes() {
        let tool = grid(1, Cells::Quads, |s, t| {
            let (theta, phi) = (0.7 + h * s, 0.9 + h * t);
            (torus.point(theta, phi), Torus::normal(theta, phi))
        });
        let report = audit(&tool, &torus, &AuditOptions::default()).unwrap().report;
        let worst = report.worst_mm();
        assert!(worst < 0.1 * torus.tube * h.powi(4) + 2e-14, "h = {h}: {worst}");
        assert!(report.normal_max_deg.to_radians() < h.powi(3) + 1e-4 * h, "h = {h}");
    }
}
