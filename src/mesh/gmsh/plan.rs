//! Selection of surfaces meshed as transfinite grids, with equal divisions on opposite sides.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::{PI, TAU};

use super::options::GmshOptions;
use super::outline::{Curve, Outline};
use crate::mapped::divisions::{self, Rule};
use kanagata_geometry::Vec3;

/// Angle between curves above which their common point is a corner [rad].
const CORNER_ANGLE_MIN_RAD: f64 = PI / 7.2;
/// Turning angle above which a curve is not straight [rad].
const CURVED_TURN_MIN_RAD: f64 = 0.1;
/// Fraction of a division that is not rounded up.
const ROUNDING_DIVISIONS: f64 = 0.02;
/// Maximum number of divisions of a curve.
const DIVISIONS_MAX: f64 = 20_000.0;

/// Divisions of curves and grids on surfaces for the gmsh script.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Plan {
    /// Divisions of curves; all other curves are divided by gmsh's element sizes.
    pub divisions: BTreeMap<i64, usize>,
    /// Surfaces meshed as grids.
    pub grids: Vec<Grid>,
}

/// A surface with three or four sides.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// gmsh tag of the surface.
    pub surface: i64,
    /// Points at its corners, in order.
    pub corners: Vec<i64>,
    /// Curves of each side; the first side is between the first two corners.
    pub sides: Vec<Vec<i64>>,
}

impl Plan {
    /// Grids on all surfaces with three or four sides, except for those in `refused`.
    #[must_use]
    pub fn new(outline: &Outline, options: &GmshOptions, refused: &BTreeSet<i64>) -> Self {
        let tags: Vec<i64> = outline.curves.keys().copied().collect();
        let index: BTreeMap<i64, usize> = tags.iter().enumerate().map(|(k, &t)| (t, k)).collect();
        let (minima, lengths) = demand(outline, options);
        let allowed = outline.surfaces.iter().filter(|(s, _)| !refused.contains(s));
        let mut grids: Vec<Grid> =
            allowed.filter_map(|(&s, around)| Grid::new(outline, s, around)).collect();
        if !options.has_grids() {
            grids.clear();
        }
        let rules: Vec<Rule> = grids.iter().flat_map(|g| g.rules(&index)).collect();
        let agreed = divisions::assign(&minima, &lengths, &rules);
        let mut kept = agreed.kept.chunks(2).map(|pair| pair.iter().all(|&k| k));
        grids.retain(|_| kept.next().unwrap_or(false));
        let mut used: BTreeSet<i64> = grids.iter().flat_map(|g| g.sides.concat()).collect();
        if options.divides_by_turning_angle() {
            used.extend(
                outline
                    .curves
                    .iter()
                    .filter(|(_, c)| c.turn() > CURVED_TURN_MIN_RAD)
                    .map(|(t, _)| t),
            );
        }
        let divisions = used.into_iter().map(|t| (t, agreed.counts[index[&t]])).collect();
        Self { divisions, grids }
    }

    /// Number of quadrilaterals on a surface of four sides.
    #[must_use]
    pub fn quads(&self, grid: &Grid) -> Option<usize> {
        let count = |k: usize| -> usize { grid.sides[k].iter().map(|c| self.divisions[c]).sum() };
        (grid.sides.len() == 4).then(|| count(0) * count(1))
    }
}

/// Minimum divisions and lengths [mm] of all curves.
fn demand(outline: &Outline, options: &GmshOptions) -> (Vec<usize>, Vec<f64>) {
    let mut between: BTreeMap<[i64; 2], usize> = BTreeMap::new();
    let ends = |c: &Curve| [c.ends[0].min(c.ends[1]), c.ends[0].max(c.ends[1])];
    outline.curves.values().for_each(|c| *between.entry(ends(c)).or_default() += 1);
    let minimum = |c: &Curve| {
        let (length, turn) = (c.length(), c.turn());
        let by_turn = turn / TAU * options.per_turn as f64 - ROUNDING_DIVISIONS;
        let by_size = options.size[1].map_or(0.0, |size| length / size - ROUNDING_DIVISIONS);
        // Curves between the same two points must not have a common chord.
        let floor = match c.ends {
            [a, b] if a == b => 3.0,
            _ if between[&ends(c)] > 1 && turn > CURVED_TURN_MIN_RAD => 2.0,
            _ => 1.0,
        };
        by_turn.max(by_size).ceil().clamp(floor, DIVISIONS_MAX) as usize
    };
    let curves = || outline.curves.values();
    (curves().map(minimum).collect(), curves().map(Curve::length).collect())
}

impl Grid {
    /// The sides of a surface bounded by one loop without a seam and with three or four corners.
    fn new(outline: &Outline, surface: i64, around: &[i64]) -> Option<Self> {
        let ring = ring(outline, around)?;
        let starts: Vec<usize> =
            (0..ring.len()).filter(|&k| is_corner(outline, &ring, k)).collect();
        if !(3..=4).contains(&starts.len()) {
            return None;
        }
        let side = |k: usize| {
            let (from, to) = (starts[k], starts[(k + 1) % starts.len()]);
            let count = (to + ring.len() - from - 1) % ring.len() + 1;
            (0..count).map(|i| ring[(from + i) % ring.len()].0).collect()
        };
        Some(Self {
            surface,
            corners: starts.iter().map(|&k| start(outline, ring[k])).collect(),
            sides: (0..starts.len()).map(side).collect(),
        })
    }

    /// Equal divisions on opposite sides, on a triangle on all sides: gmsh then puts triangles along one side, instead
    /// of a narrow fan at one corner.
    fn rules(&self, index: &BTreeMap<i64, usize>) -> [Rule; 2] {
        let side = |k: usize| self.sides[k].iter().map(|c| index[c]).collect();
        [Rule::Equal(side(0), side(2)), Rule::Equal(side(1), side(self.sides.len() - 1))]
    }
}

/// A curve in a loop; true when reversed.
type Use = (i64, bool);

fn start(outline: &Outline, (curve, backwards): Use) -> i64 {
    outline.curves[&curve].ends[usize::from(backwards)]
}

fn end(outline: &Outline, (curve, backwards): Use) -> i64 {
    outline.curves[&curve].ends[usize::from(!backwards)]
}

/// Curves in the order of one simple loop; `None` for several loops, seams and closed curves.
fn ring(outline: &Outline, around: &[i64]) -> Option<Vec<Use>> {
    let mut left: BTreeSet<i64> = around.iter().copied().collect();
    let open = |c: &i64| outline.curves.get(c).is_some_and(|c| c.ends[0] != c.ends[1]);
    if left.len() != around.len() || !left.iter().all(open) {
        return None;
    }
    let mut ring: Vec<Use> = vec![(left.pop_first()?, false)];
    let mut seen = BTreeSet::from([start(outline, ring[0])]);
    while let Some(&last) = ring.last() {
        let at = end(outline, last);
        if !seen.insert(at) {
            let closed = at == start(outline, ring[0]) && left.is_empty();
            return closed.then_some(ring);
        }
        let next = left.iter().copied().find(|c| outline.curves[c].ends.contains(&at))?;
        left.remove(&next);
        ring.push((next, outline.curves[&next].ends[0] != at));
    }
    None
}

/// True when the loop has a corner at the start of its curve `k`.
fn is_corner(outline: &Outline, ring: &[Use], k: usize) -> bool {
    let before = tangents(outline, ring[(k + ring.len() - 1) % ring.len()])[1];
    let after = tangents(outline, ring[k])[0];
    before.angle(&after) > CORNER_ANGLE_MIN_RAD
}

/// Tangents at the start and the end of a curve in a loop.
fn tangents(outline: &Outline, (curve, backwards): Use) -> [Vec3; 2] {
    let line = &outline.curves[&curve].line;
    let chord = |k: usize| line.get(k + 1).zip(line.get(k)).map_or(Vec3::zeros(), |(b, a)| b - a);
    let (first, last) = (chord(0), chord(line.len().saturating_sub(2)));
    if backwards { [-last, -first] } else { [first, last] }
}
