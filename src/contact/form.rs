//! A part of a patch as a polynomial about its centre: `S(u, v) - centre = sum c_ij u^i v^j`.
//!
//! A square part has `-1 <= u, v <= 1`. A triangular one, about its centroid, has `u, v >= -1/3` and `u + v <= 1/3`.
//! Centred monomials avoid cancellation far from the origin, vanish at the centre except for the first, and are bounded
//! by `|u|, |v| <= 1`.

use kanagata_geometry::{Vec2, Vec3};
use kanagata_tool::Patch;
use kanagata_tool::bezier::monomial;

/// Shape of the domain of a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shape {
    Square,
    Triangle,
}

const THIRD: f64 = 1.0 / 3.0;

impl Shape {
    /// Largest `|u|` and `|v|`.
    #[inline(always)]
    pub(super) fn reach(self) -> f64 {
        if self == Self::Square { 1.0 } else { 2.0 * THIRD }
    }

    /// Corners, counter-clockwise; the last one of a triangle is repeated.
    pub(super) fn corners(self) -> [Vec2; 4] {
        match self {
            Self::Square => [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]],
            Self::Triangle => {
                let far = 1.0 - THIRD;
                [[-THIRD, -THIRD], [far, -THIRD], [-THIRD, far], [-THIRD, far]]
            }
        }
        .map(|[u, v]| Vec2::new(u, v))
    }

    pub(super) fn sides(self) -> usize {
        if self == Self::Square { 4 } else { 3 }
    }

    /// True when `x` is within the domain, to within rounding.
    #[inline(always)]
    pub(super) fn holds(self, x: &Vec2) -> bool {
        const DOMAIN_TOLERANCE: f64 = 1e-9;
        match self {
            Self::Square => {
                x.x.abs() <= 1.0 + DOMAIN_TOLERANCE && x.y.abs() <= 1.0 + DOMAIN_TOLERANCE
            }
            Self::Triangle => {
                x.x.min(x.y) >= -THIRD - DOMAIN_TOLERANCE && x.x + x.y <= THIRD + DOMAIN_TOLERANCE
            }
        }
    }

    /// Affine maps `(u, v) = origin + columns (u', v')` of the four equal parts.
    pub(super) fn quarters(self) -> [Chart; 4] {
        match self {
            Self::Square => self.corners().map(|c| Chart::axes(0.5 * c, 0.5, 0.5)),
            Self::Triangle => {
                let c = self.corners();
                let at = |k: usize| Chart::axes(0.5 * c[k], 0.5, 0.5);
                let turned = Chart::axes(Vec2::zeros(), -0.5, -0.5);
                [at(0), at(1), at(2), turned]
            }
        }
    }
}

/// An affine map of the plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Chart {
    pub(super) origin: Vec2,
    /// Images of the two unit vectors.
    pub(super) columns: [Vec2; 2],
}

impl Chart {
    fn axes(origin: Vec2, a: f64, b: f64) -> Self {
        Self { origin, columns: [Vec2::new(a, 0.0), Vec2::new(0.0, b)] }
    }

    /// Map from the `(u, v)` of a part to the `(eta, zeta)` of the patch.
    pub(super) fn whole(shape: Shape) -> Self {
        match shape {
            Shape::Square => Self::axes(Vec2::new(0.5, 0.5), 0.5, 0.5),
            Shape::Triangle => Self {
                origin: Vec2::new(2.0 * THIRD, THIRD),
                columns: [Vec2::new(1.0, 0.0), Vec2::new(1.0, 1.0)],
            },
        }
    }

    #[inline(always)]
    pub(super) fn at(&self, x: &Vec2) -> Vec2 {
        self.origin + self.columns[0] * x.x + self.columns[1] * x.y
    }

    /// Solution of `at(x) = y`.
    #[inline(always)]
    pub(super) fn inverse(&self, y: &Vec2) -> Vec2 {
        let [a, b] = self.columns;
        let (d, det) = (y - self.origin, a.x * b.y - b.x * a.y);
        Vec2::new(d.x * b.y - b.x * d.y, a.x * d.y - d.x * a.y) / det
    }

    /// The composition `self(inner(x))`.
    pub(super) fn after(&self, inner: &Self) -> Self {
        let turn = |x: &Vec2| self.columns[0] * x.x + self.columns[1] * x.y;
        Self { origin: self.at(&inner.origin), columns: inner.columns.map(|c| turn(&c)) }
    }
}

/// The polynomial. Coefficient (i, j) of a biquadratic part is at `3 i + j`. The data read by a query are adjacent in
/// memory.
#[derive(Debug, Clone)]
#[repr(C)]
pub(super) struct Form {
    /// `c_ij` for i and j up to 2; `c_00` is zero.
    pub(super) low: [Vec3; 9],
    /// All coefficients where a degree is above two.
    pub(super) high: Option<Box<High>>,
    /// `S` at the centre [mm].
    pub(super) centre: Vec3,
    /// Copies of `c_01` to `c_22`, padded to four numbers.
    pub(super) padded: [[f64; 4]; 8],
}

/// Coefficients of higher degree.
#[derive(Debug, Clone)]
pub(super) struct High {
    degrees: [usize; 2],
    c: Vec<Vec3>,
}

/// `S - centre` and its derivatives with respect to u and v.
#[derive(Debug, Clone, Copy)]
pub(super) struct LocalDerivs {
    pub(super) s: Vec3,
    pub(super) d1: Vec3,
    pub(super) d2: Vec3,
    pub(super) d11: Vec3,
    pub(super) d12: Vec3,
    pub(super) d22: Vec3,
}

impl Form {
    /// The part of `patch` that is the image of `chart`.
    pub(super) fn of(patch: &Patch, chart: &Chart) -> Self {
        let o = chart.origin;
        let [a, b] = chart.columns;
        match patch {
            Patch::Bezier { degrees, points } => {
                let mut c: Vec<Vec3> = points.iter().map(|p| p - points[0]).collect();
                c = monomial(*degrees, &c);
                shift(*degrees, &mut c, o, [a.x, b.y]);
                let centre = points[0] + c[0];
                c[0] = Vec3::zeros();
                Self::pack(centre, *degrees, c)
            }
            _ => {
                let d = patch.derivs(o.x, o.y);
                let along = |x: &Vec2| d.d1 * x.x + d.d2 * x.y;
                let bend = |x: &Vec2, y: &Vec2| {
                    d.d11 * (x.x * y.x) + d.d12 * (x.x * y.y + x.y * y.x) + d.d22 * (x.y * y.y)
                };
                let mut low = [Vec3::zeros(); 9];
                low[3] = along(&a);
                low[1] = along(&b);
                low[6] = bend(&a, &a) * 0.5;
                low[4] = bend(&a, &b);
                low[2] = bend(&b, &b) * 0.5;
                if let Patch::Quad(c) = patch {
                    low[7] = c[6] * (a.x * a.x * b.y);
                    low[5] = c[7] * (a.x * b.y * b.y);
                }
                Self::new(d.s, low, None)
            }
        }
    }

    fn new(centre: Vec3, low: [Vec3; 9], high: Option<Box<High>>) -> Self {
        let padded = std::array::from_fn(|k| padded(&low[k + 1]));
        Self { low, high, centre, padded }
    }

    fn pack(centre: Vec3, degrees: [usize; 2], c: Vec<Vec3>) -> Self {
        let [n, m] = degrees;
        let mut low = [Vec3::zeros(); 9];
        for i in 0..=n.min(2) {
            for j in 0..=m.min(2) {
                low[3 * i + j] = c[i * (m + 1) + j];
            }
        }
        let high = (n > 2 || m > 2).then(|| Box::new(High { degrees, c }));
        Self::new(centre, low, high)
    }

    /// Degrees and coefficients, (i, j) at `i (m + 1) + j`.
    pub(super) fn coefficients(&self) -> ([usize; 2], &[Vec3]) {
        match &self.high {
            Some(h) => (h.degrees, &h.c),
            None => ([2, 2], &self.low),
        }
    }

    /// The part that is the image of `chart` (parallel to the axes).
    pub(super) fn part(&self, chart: &Chart) -> Self {
        let scale = [chart.columns[0].x, chart.columns[1].y];
        let Some(high) = &self.high else {
            let mut low = self.low;
            shift([2, 2], &mut low, chart.origin, scale);
            let centre = self.centre + low[0];
            low[0] = Vec3::zeros();
            return Self::new(centre, low, None);
        };
        let (degrees, mut c) = (high.degrees, high.c.clone());
        shift(degrees, &mut c, chart.origin, scale);
        let centre = self.centre + c[0];
        c[0] = Vec3::zeros();
        Self::pack(centre, degrees, c)
    }

    /// `S - centre` and derivatives.
    #[inline(always)]
    pub(super) fn derivs(&self, u: f64, v: f64) -> LocalDerivs {
        if let Some(high) = &self.high {
            return high.derivs(u, v);
        }
        let c = &self.low;
        let (u2, v2) = (2.0 * u, 2.0 * v);
        let row = |k: usize| c[k] + (c[k + 1] + c[k + 2] * v) * v;
        let slope = |k: usize| c[k + 1] + c[k + 2] * v2;
        let (a1, a2) = (row(3), row(6));
        let (b0, b1, b2) = (slope(0), slope(3), slope(6));
        LocalDerivs {
            s: (c[1] + c[2] * v) * v + (a1 + a2 * u) * u,
            d1: a1 + a2 * u2,
            d2: b0 + (b1 + b2 * u) * u,
            d11: a2 * 2.0,
            d12: b1 + b2 * u2,
            d22: (c[2] + (c[5] + c[8] * u) * u) * 2.0,
        }
    }
}

impl High {
    fn derivs(&self, u: f64, v: f64) -> LocalDerivs {
        let z = Vec3::zeros();
        let mut d = LocalDerivs { s: z, d1: z, d2: z, d11: z, d12: z, d22: z };
        for row in self.c.chunks_exact(self.degrees[1] + 1).rev() {
            // Horner's scheme along v with first derivative and half the second, then along u.
            let (mut p0, mut p1, mut p2) = (z, z, z);
            for c in row.iter().rev() {
                p2 = p2 * v + p1;
                p1 = p1 * v + p0;
                p0 = p0 * v + c;
            }
            d.d11 = d.d11 * u + d.d1;
            d.d1 = d.d1 * u + d.s;
            d.s = d.s * u + p0;
            d.d12 = d.d12 * u + d.d2;
            d.d2 = d.d2 * u + p1;
            d.d22 = d.d22 * u + p2;
        }
        d.d11 *= 2.0;
        d.d22 *= 2.0;
        d
    }
}

/// A vector padded to four numbers.
#[inline(always)]
pub(super) fn padded(x: &Vec3) -> [f64; 4] {
    [x.x, x.y, x.z, 0.0]
}

/// Coefficients in `u', v'` with `u = origin.x + scale[0] u'`, `v = origin.y + scale[1] v'`.
fn shift(degrees: [usize; 2], c: &mut [Vec3], origin: Vec2, scale: [f64; 2]) {
    let [n, m] = degrees;
    for row in c.chunks_exact_mut(m + 1) {
        taylor(row, 1, origin.y, scale[1]);
    }
    for j in 0..=m {
        taylor(&mut c[j..=n * (m + 1) + j], m + 1, origin.x, scale[0]);
    }
}

/// The same for one variable; `stride` is the distance between coefficients.
fn taylor(c: &mut [Vec3], stride: usize, origin: f64, scale: f64) {
    let n = c.len().div_ceil(stride) - 1;
    for level in 0..n {
        for k in (level..n).rev() {
            let next = c[(k + 1) * stride];
            c[k * stride] += next * origin;
        }
    }
    let mut power = 1.0;
    for k in 0..=n {
        c[k * stride] *= power;
        power *= scale;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(count: usize) -> Vec<Vec3> {
        let mut s = 7u64;
        let mut random = || {
            s = s.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((s >> 33) as f64) / (1u64 << 31) as f64 - 0.5
        };
        (0..count).map(|_| Vec3::new(100.0 + random(), random(), random())).collect()
    }

    fn patches() -> Vec<Patch> {
        let p = points(49);
        let array = |k: usize| p[k];
        let mut all = vec![
            Patch::Triangle(std::array::from_fn(array)),
            Patch::Quad(std::array::from_fn(array)),
        ];
        for degrees in [[1, 1], [2, 2], [1, 3], [3, 5], [6, 6]] {
            let net = p[..(degrees[0] + 1) * (degrees[1] + 1)].to_vec();
            all.push(Patch::Bezier { degrees, points: net });
        }
        all
    }

    #[test]
    fn a_part_of_a_part_is_the_patch() {
        for patch in patches() {
            let shape = if patch.sides() == 3 { Shape::Triangle } else { Shape::Square };
            let whole = Chart::whole(shape);
            let form = Form::of(&patch, &whole);
            for quarter in shape.quarters() {
                let (part, chart) = (form.part(&quarter), whole.after(&quarter));
                for corner in shape.corners() {
                    let x = 0.7 * corner;
                    let at = chart.at(&x);
                    assert!((chart.inverse(&at) - x).norm() < 1e-15);
                    assert!(patch.sides() == 4 || (0.0 <= at.y && at.y <= at.x && at.x <= 1.0));
                    let (d, exact) = (part.derivs(x.x, x.y), patch.derivs(at.x, at.y));
                    let [a, b] = chart.columns;
                    assert!((part.centre + d.s - exact.s).norm() < 1e-12, "{patch:?}");
                    assert!((d.d1 - exact.d1 * a.x - exact.d2 * a.y).norm() < 1e-11);
                    let mixed = exact.d11 * (a.x * b.x)
                        + exact.d12 * (a.x * b.y + a.y * b.x)
                        + exact.d22 * (a.y * b.y);
                    assert!((d.d12 - mixed).norm() < 1e-10, "{patch:?}");
                    let second = exact.d11 * (b.x * b.x)
                        + exact.d12 * (2.0 * b.x * b.y)
                        + exact.d22 * (b.y * b.y);
                    assert!((d.d22 - second).norm() < 1e-10, "{patch:?}");
                }
            }
        }
    }
}
