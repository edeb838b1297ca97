//! Approximation of a function by a piecewise polynomial curve with adaptive bisection.

use std::sync::OnceLock;

use nalgebra::{SMatrix, SVector};

use super::curve::Curve;

/// Degree of the polynomial pieces.
const DEGREE: usize = 5;
/// Maximum number of bisections of an interval between two breaks. Doubled: non-smooth functions produce more pieces
/// before the fit stops.
const BISECTION_DEPTH_MAX: u32 = 16;

impl<const D: usize> Curve<D> {
    /// A B-spline of degree 5 that approximates `f` over the intervals between `breaks` (increasing, at least two).
    ///
    /// It interpolates `f` at all piece ends; the error at the sample points is at most `tolerance`. `f` should be
    /// smooth between breaks. Bisection stops after 16 levels, or when three bisections do not halve the error (`f` is
    /// then noise at this scale).
    #[must_use]
    pub fn fitted(f: impl Fn(f64) -> SVector<f64, D>, breaks: &[f64], tolerance: f64) -> Self {
        Self::fitted_near(|t, _| f(t), breaks, tolerance)
    }

    /// As [`Curve::fitted`], for a function evaluated by a local search. `f` also receives an estimate of its value
    /// where a coarser piece supplies one.
    #[must_use]
    pub fn fitted_near(
        f: impl Fn(f64, Option<SVector<f64, D>>) -> SVector<f64, D>,
        breaks: &[f64],
        tolerance: f64,
    ) -> Self {
        let mut ends = Vec::new();
        let mut points = vec![];
        let basis = Basis::get();
        for w in breaks.windows(2) {
            let mut stack: Vec<Interval<D>> = vec![Interval::new(w[0], w[1])];
            while let Some(whole) = stack.pop() {
                let (a, b) = (whole.from, whole.to);
                let known = [points.last().copied(), whole.end()];
                let piece = interpolate(&|t| f(t, whole.parent_value(t)), basis, [a, b], known);
                let off = error(&f, &piece, a, b);
                if whole.depth < BISECTION_DEPTH_MAX
                    && off > tolerance
                    && off <= 0.5 * whole.ancestor_errors[2]
                {
                    stack.extend(whole.halves(piece, off));
                    continue;
                }
                if points.is_empty() {
                    points.push(piece[0]);
                }
                points.extend_from_slice(&piece[1..]);
                ends.push(b);
            }
        }
        let mut knots = vec![breaks[0]; DEGREE + 1];
        for &end in &ends {
            knots.extend([end; DEGREE]);
        }
        knots.push(breaks[breaks.len() - 1]);
        let weights = vec![1.0; points.len()];
        Self::raw(DEGREE, knots, points, weights)
    }
}

impl<const D: usize> Curve<D> {
    /// The polynomial of degree 5 on `[a, b]` that interpolates `f` at [`Curve::nodes_between`].
    #[must_use]
    pub fn through(f: &dyn Fn(f64) -> SVector<f64, D>, a: f64, b: f64) -> Self {
        let points = interpolate(&|t| f(t), Basis::get(), [a, b], [None; 2]);
        Self::bezier(points.to_vec(), a, b)
    }

    /// The polynomial of degree 5 on `[a, b]` with the given values at [`Curve::nodes_between`].
    #[must_use]
    pub fn through_values(values: &[SVector<f64, D>; DEGREE + 1], a: f64, b: f64) -> Self {
        Self::bezier(controls(values, &Basis::get().inverse).to_vec(), a, b)
    }

    /// The six Chebyshev-Lobatto interpolation nodes of `[a, b]`, including both ends.
    #[must_use]
    pub fn nodes_between(a: f64, b: f64) -> [f64; DEGREE + 1] {
        Basis::get().nodes.map(|t| if t >= 1.0 { b } else { a + (b - a) * t })
    }

    fn bezier(points: Vec<SVector<f64, D>>, a: f64, b: f64) -> Self {
        let knots = [vec![a; DEGREE + 1], vec![b; DEGREE + 1]].concat();
        let weights = vec![1.0; points.len()];
        Self::raw(DEGREE, knots, points, weights)
    }
}

/// Chebyshev-Lobatto nodes of `[0, 1]`, including both ends.
fn nodes() -> [f64; DEGREE + 1] {
    std::array::from_fn(|k| 0.5 - 0.5 * (std::f64::consts::PI * k as f64 / DEGREE as f64).cos())
}

fn bernstein(t: f64) -> [f64; DEGREE + 1] {
    let mut b = [0.0; DEGREE + 1];
    b[0] = 1.0;
    for k in 1..=DEGREE {
        for i in (0..=k).rev() {
            let left = if i > 0 { b[i - 1] } else { 0.0 };
            b[i] = (1.0 - t) * b[i] + t * left;
        }
    }
    b
}

/// An interval on the bisection stack.
struct Interval<const D: usize> {
    from: f64,
    to: f64,
    depth: u32,
    /// Errors of its three nearest ancestors, the parent first.
    ancestor_errors: [f64; 3],
    /// Bezier points of the parent's polynomial, and the parent interval.
    parent: Option<([SVector<f64, D>; DEGREE + 1], f64, f64)>,
}

impl<const D: usize> Interval<D> {
    fn new(from: f64, to: f64) -> Self {
        Self { from, to, depth: 0, ancestor_errors: [f64::INFINITY; 3], parent: None }
    }

    /// Both halves, the first half last (top of the stack).
    fn halves(&self, piece: [SVector<f64, D>; DEGREE + 1], off: f64) -> [Self; 2] {
        let middle = 0.5 * (self.from + self.to);
        [(middle, self.to), (self.from, middle)].map(|(from, to)| Self {
            from,
            to,
            depth: self.depth + 1,
            ancestor_errors: [off, self.ancestor_errors[0], self.ancestor_errors[1]],
            parent: Some((piece, self.from, self.to)),
        })
    }

    /// Value at the end of the interval, if the parent interval ends there too.
    fn end(&self) -> Option<SVector<f64, D>> {
        let (piece, _, b) = self.parent.as_ref()?;
        (*b == self.to).then_some(piece[DEGREE])
    }

    /// Value of the parent's polynomial at `t`.
    fn parent_value(&self, t: f64) -> Option<SVector<f64, D>> {
        let (piece, a, b) = self.parent.as_ref()?;
        Some(blend(piece, &bernstein((t - a) / (b - a))))
    }
}

fn blend<const D: usize>(
    piece: &[SVector<f64, D>; DEGREE + 1],
    weights: &[f64; DEGREE + 1],
) -> SVector<f64, D> {
    piece.iter().zip(weights).map(|(p, w)| p * *w).sum()
}

/// Constants of the interpolation.
struct Basis {
    nodes: [f64; DEGREE + 1],
    /// Maps values at the nodes to Bezier points.
    inverse: SMatrix<f64, 6, 6>,
    /// Bernstein polynomials at [`CHECK_PARAMETERS`].
    checks: [[f64; DEGREE + 1]; CHECK_PARAMETERS.len()],
}

/// Local parameters at which the error of a piece is sampled, between the interpolation nodes.
const CHECK_PARAMETERS: [f64; 6] = [0.03, 0.22, 0.41, 0.59, 0.78, 0.97];

impl Basis {
    fn get() -> &'static Self {
        static BASIS: OnceLock<Basis> = OnceLock::new();
        BASIS.get_or_init(|| {
            let nodes = nodes();
            let matrix = SMatrix::<f64, 6, 6>::from_fn(|r, c| bernstein(nodes[r])[c]);
            // Unisolvence: the Bernstein matrix at distinct nodes is regular.
            let inverse = matrix.try_inverse().unwrap_or_else(SMatrix::identity);
            Self { nodes, inverse, checks: CHECK_PARAMETERS.map(bernstein) }
        })
    }
}

/// Bezier points of the polynomial that interpolates f at the nodes of `[a, b]`; known end values are not evaluated
/// again.
fn interpolate<const D: usize>(
    f: &impl Fn(f64) -> SVector<f64, D>,
    basis: &Basis,
    [a, b]: [f64; 2],
    [start, end]: [Option<SVector<f64, D>>; 2],
) -> [SVector<f64, D>; DEGREE + 1] {
    let values = std::array::from_fn(|k| match k {
        0 => start.unwrap_or_else(|| f(a)),
        DEGREE => end.unwrap_or_else(|| f(b)),
        _ => f(a + (b - a) * basis.nodes[k]),
    });
    controls(&values, &basis.inverse)
}

fn controls<const D: usize>(
    values: &[SVector<f64, D>; DEGREE + 1],
    inverse: &SMatrix<f64, 6, 6>,
) -> [SVector<f64, D>; DEGREE + 1] {
    let mut points =
        std::array::from_fn(|i| values.iter().enumerate().map(|(r, v)| v * inverse[(i, r)]).sum());
    points[0] = values[0];
    points[DEGREE] = values[DEGREE];
    points
}

/// Largest distance from f at the sample points [`CHECK_PARAMETERS`].
fn error<const D: usize>(
    f: &impl Fn(f64, Option<SVector<f64, D>>) -> SVector<f64, D>,
    piece: &[SVector<f64, D>; DEGREE + 1],
    a: f64,
    b: f64,
) -> f64 {
    let off = |(t, weights): (f64, &[f64; DEGREE + 1])| {
        let found = blend(piece, weights);
        (found - f(a + (b - a) * t, Some(found))).norm()
    };
    CHECK_PARAMETERS.into_iter().zip(&Basis::get().checks).map(off).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::super::Curve2;
    use crate::Vec2;

    #[test]
    fn a_fitted_circle_keeps_the_tolerance() {
        for tolerance in [1e-4, 1e-8, 1e-11] {
            let f = |t: f64| Vec2::new(t.cos(), t.sin());
            let c = Curve2::fitted(f, &[0.0, 2.0, 6.0], tolerance);
            let worst = (0..=1000)
                .map(|k| (c.point(0.006 * f64::from(k)) - f(0.006 * f64::from(k))).norm())
                .fold(0.0, f64::max);
            assert!(worst < 2.0 * tolerance, "{tolerance}: {worst}");
            assert_eq!(c.point(6.0), f(6.0));
        }
    }

    #[test]
    fn noise_and_jumps_do_not_make_pieces_without_end() {
        let noise = |t: f64| Vec2::new(t, 1e-7 * (1e9 * t).sin());
        assert!(Curve2::fitted(noise, &[0.0, 1.0], 1e-11).points().len() < 200);
        let jump = |t: f64| Vec2::new(t, f64::from(t > 0.3));
        assert!(Curve2::fitted(jump, &[0.0, 1.0], 1e-11).points().len() < 200);
    }

    #[test]
    fn a_straight_line_is_one_piece() {
        let c = Curve2::fitted(|t| Vec2::new(2.0 * t, 1.0 - t), &[0.0, 1.0], 1e-12);
        assert_eq!(c.points().len(), 6);
    }
}
