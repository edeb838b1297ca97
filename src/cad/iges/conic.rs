//! Conic arcs (104), exact as rational quadratic B-splines.

use nalgebra::{Matrix2, Matrix3, SymmetricEigen};

use super::curves::{Piece, Shape, arc_range};
use super::file::Fault;
use super::reader::Reader;
use kanagata_geometry::nurbs::Curve3;
use kanagata_geometry::{Frame, Vec2, Vec3};

/// `A x^2 + B x y + C y^2 + D x + E y + F = 0` as a symmetric form of (x, y, 1).
struct Conic {
    form: Matrix3<f64>,
}

impl Reader<'_, '_> {
    /// Conic arc (104): A, B, C, D, E, F, ZT, X1, Y1 start, X2, Y2 end; ellipses run counter-clockwise.
    pub(super) fn conic(&self, entity: usize) -> Result<Piece, Fault> {
        let mut p = self.file.params(entity)?;
        let [a, b, c, d, e, f] =
            [p.real("A")?, p.real("B")?, p.real("C")?, p.real("D")?, p.real("E")?, p.real("F")?];
        let z = p.real("ZT")?;
        let start = Vec2::new(p.real("X1")?, p.real("Y1")?);
        let end = Vec2::new(p.real("X2")?, p.real("Y2")?);
        let form = Matrix3::new(a, b / 2.0, d / 2.0, b / 2.0, c, e / 2.0, d / 2.0, e / 2.0, f);
        let conic = Conic { form };
        let quadratic = Matrix2::new(a, b / 2.0, b / 2.0, c);
        let ellipse = quadratic.determinant() > 1e-12 * quadratic.norm_squared();
        let curve = if ellipse {
            conic.ellipse(&quadratic, z, start, end)
        } else {
            conic.open(z, start, end)
        };
        curve.map(|curve| Piece { curve, shape: Shape::Reparametrised }).ok_or_else(|| {
            let found = format!("{a} x2 + {b} xy + {c} y2 + {d} x + {e} y + {f} = 0");
            self.file.fault(
                entity,
                "entity-invalid",
                found,
                "a real ellipse, parabola or hyperbola whose arc joins both points",
            )
        })
    }
}

impl Conic {
    fn ellipse(&self, quadratic: &Matrix2<f64>, z: f64, start: Vec2, end: Vec2) -> Option<Curve3> {
        let linear = Vec2::new(self.form[(0, 2)], self.form[(1, 2)]);
        let centre = -quadratic.try_inverse()? * linear;
        let level = -(linear.dot(&centre) + self.form[(2, 2)]);
        let eigen = SymmetricEigen::new(*quadratic);
        let radius = |i: usize| {
            let square = level / eigen.eigenvalues[i];
            (square.is_finite() && square > 0.0).then(|| square.sqrt())
        };
        let (rx, ry) = (radius(0)?, radius(1)?);
        let x: Vec2 = eigen.eigenvectors.column(0).into();
        let x = if x.x + x.y < 0.0 { -x } else { x };
        let y = Vec2::new(-x.y, x.x);
        let angle = |p: Vec2| {
            let d = p - centre;
            Vec2::new(d.dot(&x) / rx, d.dot(&y) / ry)
        };
        let [from, to] = arc_range(&angle(start), &angle(end));
        let origin = Vec3::new(centre.x, centre.y, z);
        let frame = Frame {
            origin,
            x: Vec3::new(x.x, x.y, 0.0),
            y: Vec3::new(y.x, y.y, 0.0),
            z: Vec3::z(),
        };
        Some(Curve3::ellipse_arc(&frame, rx, ry, from, to))
    }

    /// Parabola or hyperbola: one rational quadratic segment. The middle control point is the intersection of the end
    /// tangents, `w^2 = -Q(P0, P2) / (2 Q(P1, P1))`.
    fn open(&self, z: f64, start: Vec2, end: Vec2) -> Option<Curve3> {
        let lift = |p: Vec2| Vec3::new(p.x, p.y, 1.0);
        let (p0, p2) = (lift(start), lift(end));
        let meet = (self.form * p0).cross(&(self.form * p2));
        if meet.z.abs() <= 1e-14 * meet.norm() {
            return None;
        }
        let p1 = meet / meet.z;
        let square = -p0.dot(&(self.form * p2)) / (2.0 * p1.dot(&(self.form * p1)));
        let weight = (square.is_finite() && square > 0.0).then(|| square.sqrt())?;
        let at = |p: Vec3| Vec3::new(p.x, p.y, z);
        let knots = vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
        let points = vec![at(p0), at(p1), at(p2)];
        Curve3::try_new(2, knots, points, Some(vec![1.0, weight, 1.0])).ok()
    }
}
