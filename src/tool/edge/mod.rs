//! The Nagata edge: the coefficient of Eq. 8, its guard, and the common curve of a crease.

mod followed;
#[cfg(test)]
mod tests;

use nalgebra::{DMatrix, DVector};

pub use followed::nearest_coefficient;

use kanagata_geometry::Vec3;

/// How edges are curved.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    Default,
    serde::Serialize,
    serde::Deserialize,
    schemars::JsonSchema,
)]
#[serde(rename_all = "lowercase")]
pub enum EdgeRule {
    /// Eq. 8 where its curve runs forward, straight elsewhere.
    #[default]
    Guarded,
    /// Eq. 8 everywhere, also where it fails.
    Plain,
}

/// The reason why an edge is replaced by its chord.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum EdgeFault {
    /// `|q| > 0.99`: the parabola reverses its direction at an end, or nearly so (an inflected profile, a normal
    /// averaged over a crease, an inaccurate normal at one end).
    TurnsBack,
    /// `|c| >= 2 |d|`: large lateral deviation (nearly parallel normals on an oblique edge).
    SwingsOut,
    /// Both ends coincide, or the normals are opposite.
    Degenerate,
    /// An adjacent patch would fold: two borders meet there at a straight angle, or are tangent.
    Folds,
}

impl std::fmt::Display for EdgeFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::TurnsBack => "the parabola would reverse its direction (an inflected profile, a normal averaged over a crease, or an apex)",
            Self::SwingsOut => "the parabola would have a large lateral deviation (nearly parallel normals on an oblique edge)",
            Self::Degenerate => "its ends coincide or their normals are opposite",
            Self::Folds => "an adjacent patch would fold (tangent borders, or a corner near 180 degrees)",
        })
    }
}

/// Coefficient of an edge and the result of the guard.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeCurve {
    /// Quadratic coefficient c of Eq. 7 [mm].
    pub c: Vec3,
    /// Violated criterion of the guard; `c` is then zero (under [`EdgeRule::Guarded`]).
    pub fault: Option<EdgeFault>,
}

/// Half difference of unit normals below which it is noise of CAD files (1e-9 of their lengths, 1e-10 in their
/// normals). Along it the edge is straight. A tangential part `(nu . d)/|dl|^2 dl` due to noise alone could be as long
/// as the edge, and flat faces next to the fillets of a die would fold.
const NORMAL_NOISE: f64 = 1e-8;
/// Pairs (half difference of the normals, ratio): for half differences below the first value, the direction of the
/// difference is noise when the inclination of the mean normal along the edge exceeds the ratio times the half
/// difference. Eq. 8 would then bend the edge within the surface in an arbitrary direction.
///
/// On a smooth surface the inclination is of the order of the edge length. It is 0.1 where the curvature changes by 60
/// % along the edge. Above 1/3 the profile is inflected, which a parabola cannot represent. A quarter of a 3 : 1
/// ellipse has 0.45 at a half difference of 0.7.
const INCLINATION_LIMITS: [(f64, f64); 2] = [(0.01, 0.1), (0.1, 1.0 / 3.0)];
/// Length of the mean normal below which the normals are opposite.
const OPPOSITE_MEAN_MAX: f64 = 1e-12;
/// Largest admissible `|c| / |d|`; an arc of 90 degrees has 1, one of 120 degrees 1.73.
const LATERAL_RATIO_MAX: f64 = 2.0;

/// Largest admissible `|q| = |c . d| / d^2`. At 1 the tangent of the parabola vanishes at an end, and beyond it
/// reverses. Where one normal is perpendicular to the chord and the other is slightly inaccurate, rounding decides on
/// which side of 1 it is.
const REVERSAL_RATIO_MAX: f64 = 0.99;

/// The coefficient c of `x0 + (d - c) e + c e^2` for the edge vector `d = x1 - x0` and unit normals `n0`, `n1`: the
/// smallest c with `n0 . (d - c) = 0` and `n1 . (d + c) = 0` (Eq. 8).
///
/// With the orthogonal vectors `nu = (n0 + n1)/2` and `dl = (n0 - n1)/2`,
/// `c = (dl . d)/|nu|^2 nu + (nu . d)/|dl|^2 dl`. The relative rounding error grows as 1e-16 / |dl|, so that the order
/// of accuracy is preserved down to normals 1e-7 rad apart. The reversed edge has the same c.
#[must_use]
pub fn coefficient(d: &Vec3, n0: &Vec3, n1: &Vec3) -> Vec3 {
    let nu = (n0 + n1) * 0.5;
    let dl = (n0 - n1) * 0.5;
    let (nu2, dl2) = (nu.norm_squared(), dl.norm_squared());
    let mut c = Vec3::zeros();
    if nu2 > OPPOSITE_MEAN_MAX * OPPOSITE_MEAN_MAX {
        c += nu * (dl.dot(d) / nu2);
    }
    if dl2 > NORMAL_NOISE * NORMAL_NOISE {
        c += dl * (nu.dot(d) / dl2);
    }
    c
}

/// True when the direction of the difference of the normals is noise.
fn is_noise(d: &Vec3, n0: &Vec3, n1: &Vec3) -> bool {
    let (nu, dl) = ((n0 + n1) * 0.5, (n0 - n1) * 0.5);
    let inclination = nu.dot(d).abs() / d.norm();
    INCLINATION_LIMITS.iter().any(|&(half_difference, ratio)| {
        dl.norm() < half_difference && inclination > ratio * dl.norm()
    })
}

/// The curve of an edge with the normals `ends` at its two ends, one pair per adjacent patch. One distinct pair: Eq. 8.
/// Several: a crease with one common curve and end tangents along `n_left x n_right` (least squares where they are
/// inconsistent).
#[must_use]
pub fn edge_curve(d: &Vec3, ends: &[[Vec3; 2]], rule: EdgeRule) -> EdgeCurve {
    let c = match ends {
        [] => Vec3::zeros(),
        [[n0, n1]] => coefficient(d, n0, n1),
        several => smallest_solution(&conditions(d, several, Kept::All, as_it_is), &Vec3::zeros()),
    };
    let fault = check(d, &c, ends);
    match (rule, fault) {
        (EdgeRule::Guarded, Some(_)) => EdgeCurve { c: Vec3::zeros(), fault },
        (EdgeRule::Guarded, None) if ends.iter().any(|[n0, n1]| is_noise(d, n0, n1)) => {
            let sound = conditions(d, ends, Kept::Sound, as_it_is);
            EdgeCurve { c: smallest_solution(&sound, &Vec3::zeros()), fault }
        }
        _ => EdgeCurve { c, fault },
    }
}

fn check(d: &Vec3, c: &Vec3, ends: &[[Vec3; 2]]) -> Option<EdgeFault> {
    let d2 = d.norm_squared();
    let opposed = ends.iter().any(|[n0, n1]| (n0 + n1).norm() < 1e-6);
    if d2 == 0.0 || opposed || c.iter().any(|x| !x.is_finite()) {
        Some(EdgeFault::Degenerate)
    } else if c.dot(d).abs() > REVERSAL_RATIO_MAX * d2 {
        Some(EdgeFault::TurnsBack)
    } else if c.norm_squared() >= LATERAL_RATIO_MAX * LATERAL_RATIO_MAX * d2 {
        Some(EdgeFault::SwingsOut)
    } else {
        None
    }
}

/// Selection of the conditions on an edge.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kept {
    All,
    /// All except differences of normals that are noise.
    Sound,
    /// Those on the means of normals.
    Means,
}

/// Whether the difference of two normals is a condition. Below `NORMAL_NOISE` it is rounding; the side is flat along the
/// edge.
fn uses_difference(d: &Vec3, [n0, n1]: [&Vec3; 2], kept: Kept) -> bool {
    let is_selected = match kept {
        Kept::All => true,
        Kept::Sound => !is_noise(d, n0, n1),
        Kept::Means => false,
    };
    is_selected && (0.5 * (n0 - n1)).norm() > NORMAL_NOISE
}

/// A row `a . c = b` unchanged.
fn as_it_is(a: Vec3, b: f64) -> (Vec3, f64) {
    (a, b)
}

/// Rows `nu . c = dl . d` and, if selected, `dl . c = nu . d` of every side, with a length of about one. `difference`
/// changes the rows of the second kind.
fn conditions(
    d: &Vec3,
    ends: &[[Vec3; 2]],
    kept: Kept,
    difference: impl Fn(Vec3, f64) -> (Vec3, f64),
) -> Vec<(Vec3, f64)> {
    let mut rows: Vec<(Vec3, f64)> = Vec::with_capacity(2 * ends.len());
    for [n0, n1] in ends {
        let (nu, dl) = ((n0 + n1) * 0.5, (n0 - n1) * 0.5);
        rows.push((nu, dl.dot(d)));
        let size = dl.norm();
        if uses_difference(d, [n0, n1], kept) {
            rows.push(difference(dl / size, nu.dot(d) / size));
        }
    }
    rows
}

/// Singular value over the largest one below which a direction is not determined by the normals: no deviation along it.
const SINGULAR_VALUE_MIN_REL: f64 = 1e-6;
/// Cosine of the angle between two rows below which they are orthogonal.
const ORTHOGONAL_COSINE_MAX: f64 = 1e-12;

/// Least-squares solution of the rows `a . (start + x) = b` with the smallest norm of `x`.
fn smallest_solution(rows: &[(Vec3, f64)], start: &Vec3) -> Vec3 {
    let crossed = |a: &Vec3, b: &Vec3| a.dot(b).abs() > ORTHOGONAL_COSINE_MAX * a.norm() * b.norm();
    if rows.len() <= 2 && !rows.windows(2).any(|w| crossed(&w[0].0, &w[1].0)) {
        // Mean and half difference of the unit normals of one side: their lengths are the singular values.
        let largest = rows.iter().map(|row| row.0.norm_squared()).fold(0.0, f64::max);
        let sound =
            |a: &Vec3| a.norm_squared() > SINGULAR_VALUE_MIN_REL * SINGULAR_VALUE_MIN_REL * largest;
        let part = |(a, b): &(Vec3, f64)| a * ((b - a.dot(start)) / a.norm_squared());
        return rows.iter().filter(|row| sound(&row.0)).map(part).sum();
    }
    let matrix = DMatrix::from_fn(rows.len(), 3, |r, k| rows[r].0[k]);
    let right = DVector::from_fn(rows.len(), |r, _| rows[r].1 - rows[r].0.dot(start));
    let svd = matrix.svd(true, true);
    let smallest = SINGULAR_VALUE_MIN_REL * svd.singular_values.max();
    svd.solve(&right, smallest).map_or_else(|_| Vec3::zeros(), |c| Vec3::new(c[0], c[1], c[2]))
}
