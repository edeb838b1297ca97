//! Sample points of a patch and their errors by Eq. 24.

use super::reference::ReferenceSurface;
use kanagata_geometry::frame::unit;
use kanagata_geometry::{Vec2, Vec3};
use kanagata_tool::{Patch, PatchDerivs};

/// A point of a patch compared with the reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Parameter along the patch's first side.
    pub eta: f64,
    /// Parameter along its second side.
    pub zeta: f64,
    /// Point of the patch [mm].
    pub point: Vec3,
    /// Signed shape error [mm], positive where the patch is outside the CAD: `(P_patch - P_CAD) . n_CAD` of Eq. 24.
    /// Where the closest point is on a free border it is the distance with that sign.
    pub delta: f64,
    /// `(P_patch - P_CAD) . n_CAD` of Eq. 24 at all points [mm]: the part removable by moving the patch along the
    /// normal.
    pub normal_part: f64,
    /// `n_CAD` of Eq. 24, out of the tool; the patch's own normal where the CAD has none, zero where neither has one.
    pub reference_normal: Vec3,
    /// Distance of the patch point from the CAD [mm].
    pub distance: f64,
    /// Angle between the normals of patch and CAD [degrees]; `None` where one of them is undefined.
    pub normal_deg: Option<f64>,
    /// `|S_eta x S_zeta|` [mm^2].
    pub jacobian: f64,
    /// Parameters of the CAD surface there, if the reference gives them.
    pub uv: Option<Vec2>,
}

/// One patch and its reference.
pub(super) struct Probe<'a, R> {
    pub patch: &'a Patch,
    pub face: u32,
    pub reference: &'a R,
    /// -1 when tool and CAD have opposite orientation.
    pub sign: f64,
    /// Parameters of the CAD surface at the middle of the patch, if the reference gives them.
    pub start: Option<Vec2>,
}

impl<R: ReferenceSurface> Probe<'_, R> {
    /// Eq. 24 at one point; `None` when the point is not finite or has no closest point. `start` are parameters of the
    /// CAD surface at a point nearby.
    pub fn at(&self, eta: f64, zeta: f64, start: Option<Vec2>) -> Option<Sample> {
        let d = self.patch.derivs(eta, zeta);
        if d.s.iter().any(|x| !x.is_finite()) {
            return None;
        }
        let (foot, uv) = self.reference.closest_from(&d.s, self.face, start)?;
        let cross = d.d1.cross(&d.d2);
        let normal = patch_normal(&d);
        let offset = d.s - foot.point;
        // At an apex the CAD has no normal: the patch normal determines the side, and the distance is the error.
        let reference = unit(foot.normal).map(|n| n * self.sign);
        let normal_part = match unit(foot.normal) {
            Some(n) => offset.dot(&n) * self.sign,
            None => normal.map_or(1.0, |n| offset.dot(&n).signum()) * offset.norm(),
        };
        let angle = |n: Vec3| Some(angle_deg(&unit(n * self.sign)?, &normal?));
        let normal_deg = match foot.own_normal {
            None => angle(foot.normal),
            Some(own) => angle(own).map(|a| angle(foot.normal).map_or(a, |b| a.min(b))),
        };
        let jacobian = cross.norm();
        let distance = offset.norm();
        let delta = if foot.on_border { distance.copysign(normal_part) } else { normal_part };
        (delta.is_finite() && jacobian.is_finite() && distance.is_finite()).then_some(Sample {
            eta,
            zeta,
            point: d.s,
            delta,
            normal_part,
            reference_normal: reference.or(normal).unwrap_or_default(),
            distance,
            normal_deg,
            jacobian,
            uv,
        })
    }
}

/// Angle between two directions [degrees], accurate for small angles.
pub(super) fn angle_deg(a: &Vec3, b: &Vec3) -> f64 {
    a.cross(b).norm().atan2(a.dot(b)).to_degrees()
}

/// Uncertainty of coordinates over their size: those of files have ten digits. Ten times the value: normals of slivers of
/// 1e-8 of the distance from the origin are left out.
const COORDINATE_ROUNDING_REL: f64 = 1e-9;

/// Unit normal `S_eta x S_zeta / |S_eta x S_zeta|`. `None` where the product is rounding only: the derivatives are
/// parallel, or one is negligible, to within the rounding of the coordinates. The former occurs at a corner of 180 degrees (two sides on one
/// smooth border), the latter in the middle of a side between two such corners.
pub(super) fn patch_normal(d: &PatchDerivs) -> Option<Vec3> {
    let cross = d.d1.cross(&d.d2);
    let longest = d.d1.norm().max(d.d2.norm());
    let rounding = COORDINATE_ROUNDING_REL * (longest + d.s.abs().max());
    (cross.norm() > rounding * longest).then(|| unit(cross)).flatten()
}

/// Parameters of an interior point of a patch.
pub fn middle(patch: &Patch) -> (f64, f64) {
    if patch.sides() == 3 { (2.0 / 3.0, 1.0 / 3.0) } else { (0.5, 0.5) }
}

/// True inside the domain of a patch with `sides` sides.
pub(super) fn inside(sides: usize, eta: f64, zeta: f64) -> bool {
    let unit = 0.0..=1.0;
    unit.contains(&eta) && unit.contains(&zeta) && (sides == 4 || zeta <= eta)
}

/// Sample grid of one patch: `(i, j)` at `(i/n, j/n)`, `0 <= i, j <= n`, on triangles `j <= i`.
#[derive(Debug, Clone, PartialEq)]
pub struct PatchSamples {
    /// Sides of the patch: 3 or 4.
    pub sides: usize,
    /// Intervals n per side.
    pub n: usize,
    /// Points in rows of constant i; `None` where the comparison failed.
    pub points: Vec<Option<Sample>>,
}

impl PatchSamples {
    pub(super) fn new<R: ReferenceSurface>(probe: &Probe<'_, R>, n: usize) -> Self {
        let sides = probe.patch.sides();
        let points = Vec::with_capacity((n + 1) * (n + 1));
        let mut samples = Self { sides, n, points };
        for i in 0..=n {
            let last = if sides == 3 { i } else { n };
            for j in 0..=last {
                let start = samples.predicted_uv(i, j).or(probe.start);
                let found = probe.at(i as f64 / n as f64, j as f64 / n as f64, start);
                samples.points.push(found);
            }
        }
        samples
    }

    /// Parameters of the CAD surface at grid point `(i, j)`, extrapolated from the points before it: by the parallelogram
    /// rule `u(i, j-1) + u(i-1, j) - u(i-1, j-1)`, along a line, or those of one neighbour.
    fn predicted_uv(&self, i: usize, j: usize) -> Option<Vec2> {
        let known = |back_i: usize, back_j: usize| {
            let index = self.index(i.checked_sub(back_i)?, j.checked_sub(back_j)?)?;
            self.points.get(index)?.as_ref()?.uv
        };
        let extrapolated = |a: Option<Vec2>, b: Option<Vec2>, c: Option<Vec2>| Some(a? + b? - c?);
        extrapolated(known(0, 1), known(1, 0), known(1, 1))
            .or_else(|| extrapolated(known(0, 1), known(0, 1), known(0, 2)))
            .or_else(|| extrapolated(known(1, 0), known(1, 0), known(2, 0)))
            .or_else(|| extrapolated(known(1, 1), known(1, 1), known(2, 2)))
            .or_else(|| known(0, 1))
            .or_else(|| known(1, 0))
            .or_else(|| known(1, 1))
    }

    /// Index of grid point `(i, j)` in `points`; `None` outside the patch.
    #[must_use]
    pub fn index(&self, i: usize, j: usize) -> Option<usize> {
        if i > self.n || j > self.n || (self.sides == 3 && j > i) {
            return None;
        }
        Some(if self.sides == 3 { i * (i + 1) / 2 + j } else { i * (self.n + 1) + j })
    }

    /// Grid coordinates of every index of `points`.
    pub fn coordinates(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        (0..=self.n)
            .flat_map(move |i| (0..=if self.sides == 3 { i } else { self.n }).map(move |j| [i, j]))
    }

    /// Points with a valid comparison.
    pub fn valid(&self) -> impl Iterator<Item = &Sample> {
        self.points.iter().flatten()
    }

    /// Area represented by each point [mm^2], in the order of `points` (trapezoidal rule on the grid cells).
    #[must_use]
    pub fn areas(&self) -> Vec<f64> {
        let cell = 1.0 / (self.n * self.n) as f64;
        self.coordinates()
            .zip(&self.points)
            .map(|(at, point)| point.map_or(0.0, |p| p.jacobian * cell * self.fraction(at)))
            .collect()
    }

    /// Fraction of a cell represented by a grid point: 1/4 at the corner of a square, 1/6 per adjacent triangle.
    fn fraction(&self, [i, j]: [usize; 2]) -> f64 {
        let n = self.n;
        let end = |k: usize| if k == 0 || k == n { 0.5 } else { 1.0 };
        if self.sides == 4 {
            return end(i) * end(j);
        }
        // Adjacent sub-triangles: six inside, three on a side, one at the corners (half a cell each, one third of it
        // per corner).
        let borders = usize::from(j == 0) + usize::from(j == i) + usize::from(i == n);
        let triangles = match borders {
            0 => 6.0,
            1 => 3.0,
            _ => 1.0,
        };
        triangles / 6.0
    }

    /// Cells as indices into `points`: quadrilaterals, or triangles on a triangular patch.
    #[must_use]
    pub fn cells(&self) -> Vec<Vec<usize>> {
        let mut cells = Vec::new();
        for i in 0..self.n {
            for j in 0..self.n {
                let ring = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
                let ids: Vec<usize> = ring.iter().filter_map(|&(i, j)| self.index(i, j)).collect();
                if self.sides == 4 {
                    cells.push(ids);
                } else if ids.len() >= 3 {
                    cells.push(ids[..3].to_vec());
                    if let [a, _, c, d] = ids[..] {
                        cells.push(vec![a, c, d]);
                    }
                }
            }
        }
        cells
    }
}
