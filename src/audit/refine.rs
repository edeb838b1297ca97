//! Extremes between grid points: search from the worst grid points of every patch that may contain the maximum or
//! minimum of its CAD face.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::options::AuditOptions;
use super::reference::ReferenceSurface;
use super::sample::{PatchSamples, Probe, Sample, inside};

/// Quantity to be maximised.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Quantity {
    Max,
    Min,
    Normal,
}

const QUANTITIES: [Quantity; 3] = [Quantity::Max, Quantity::Min, Quantity::Normal];

impl Quantity {
    fn of(self, s: &Sample) -> Option<f64> {
        match self {
            Self::Max => Some(s.delta),
            Self::Min => Some(-s.delta),
            Self::Normal => s.normal_deg,
        }
    }

    /// Differences below this are rounding errors for a patch near `s`.
    fn rounding(self, s: &Sample) -> f64 {
        match self {
            Self::Normal => 1e-9,
            _ => 1e-13 * s.point.norm(),
        }
    }
}

/// Extremes of one patch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Extremes {
    /// Largest signed error.
    pub max: Sample,
    /// Smallest signed error.
    pub min: Sample,
    /// Largest normal error, if any normal exists.
    pub normal: Option<Sample>,
}

impl Extremes {
    /// The extreme of a quantity.
    fn of(&self, quantity: Quantity) -> Option<&Sample> {
        match quantity {
            Quantity::Max => Some(&self.max),
            Quantity::Min => Some(&self.min),
            Quantity::Normal => self.normal.as_ref(),
        }
    }

    /// Takes `sample` as extreme of a quantity where it is larger.
    fn raise(&mut self, quantity: Quantity, sample: Sample) {
        let before = self.of(quantity).and_then(|s| quantity.of(s));
        if quantity.of(&sample) <= before {
            return;
        }
        match quantity {
            Quantity::Max => self.max = sample,
            Quantity::Min => self.min = sample,
            Quantity::Normal => self.normal = Some(sample),
        }
    }

    /// Raises the extremes by the estimated excess between grid points: that of the parabola through the point and its
    /// neighbours. It is too large where the error falls on one side only: 11 % on a sphere.
    fn raise_by_parabolas(&mut self, grid: &PatchSamples) {
        self.max.delta += parabola_excess(grid, Quantity::Max, &self.max);
        self.min.delta -= parabola_excess(grid, Quantity::Min, &self.min);
        if let Some(normal) = &mut self.normal {
            let excess = parabola_excess(grid, Quantity::Normal, normal);
            normal.normal_deg = normal.normal_deg.map(|deg| deg + excess);
        }
    }
}

/// Largest excess over the value at a grid point of the parabolas through it and its neighbours on opposite sides.
fn parabola_excess(grid: &PatchSamples, quantity: Quantity, top: &Sample) -> f64 {
    let at = [top.eta, top.zeta].map(|x| (x * grid.n as f64).round() as usize);
    let Some(centre) = quantity.of(top) else { return 0.0 };
    let of = |[di, dj]: [isize; 2]| {
        let ahead = neighbour(grid, quantity, at, [di, dj])?;
        let behind = neighbour(grid, quantity, at, [-di, -dj])?;
        let (slope, bend) = (0.5 * (ahead - behind), ahead - 2.0 * centre + behind);
        (bend < 0.0).then(|| -0.5 * slope * slope / bend)
    };
    DIRECTIONS[..4].iter().filter_map(|&d| of(d)).fold(0.0, f64::max)
}

/// Raises the extremes by one point of each patch, the vertex of the parabola through its grid extreme and the points around
/// it. Patches are left out whose grid extreme and [`Estimate::slack`] together are below the grid extreme of their face.
fn raise_by_vertices<R: ReferenceSurface>(
    probes: &[Probe<'_, R>],
    samples: &[PatchSamples],
    (options, found): (&AuditOptions, &mut [Extremes]),
) {
    let unlimited = AuditOptions { refine: usize::MAX, ..options.clone() };
    for (e, _) in candidates(probes, samples, &unlimited) {
        let (probe, grid, own) = (&probes[e.patch], &samples[e.patch], &mut found[e.patch]);
        let vertex = own.of(e.quantity).and_then(|&sample| {
            let value = e.quantity.of(&sample)?;
            let at = [sample.eta, sample.zeta].map(|x| (x * grid.n as f64).round() as usize);
            let ring = DIRECTIONS.map(|d| neighbour(grid, e.quantity, at, d));
            let search = MaximumSearch { probe, quantity: e.quantity };
            search.parabola_vertex(&Top { value, sample }, &ring, 1.0 / grid.n as f64)
        });
        vertex.into_iter().for_each(|top| own.raise(e.quantity, top.sample));
    }
}

/// Grid value of a quantity on a patch, and the possible excess between grid points.
struct Estimate {
    patch: usize,
    quantity: Quantity,
    best: f64,
    slack: f64,
}

/// Extremes of every patch (samples must not be empty), refined on at most `options.refine` patches per CAD face.
pub(super) fn extremes<R: ReferenceSurface>(
    probes: &[Probe<'_, R>],
    samples: &[PatchSamples],
    options: &AuditOptions,
) -> Vec<Extremes> {
    let mut found: Vec<Extremes> = samples.iter().filter_map(on_grid).collect();
    if options.refine == 0 {
        if options.estimate {
            found.iter_mut().zip(samples).for_each(|(e, grid)| e.raise_by_parabolas(grid));
        } else {
            raise_by_vertices(probes, samples, (options, &mut found));
        }
        return found;
    }
    let work = candidates(probes, samples, options);
    let stage = options.progress.stage("audit, extremes", "searches", work.len() as u64);
    let refine = |(e, floor): &(Estimate, f64)| {
        let sample = search(&probes[e.patch], &samples[e.patch], e, *floor);
        stage.add(1);
        sample
    };
    let refined: Vec<Option<Sample>> = work.par_iter().map(refine).collect();
    for ((e, _), sample) in work.iter().zip(refined) {
        let (Some(sample), Some(own)) = (sample, found.get_mut(e.patch)) else { continue };
        own.raise(e.quantity, sample);
    }
    found
}

fn on_grid(samples: &PatchSamples) -> Option<Extremes> {
    let first = samples.valid().next()?;
    let mut e = Extremes { max: *first, min: *first, normal: None };
    for s in samples.valid() {
        if s.delta > e.max.delta {
            e.max = *s;
        }
        if s.delta < e.min.delta {
            e.min = *s;
        }
        if s.normal_deg > e.normal.and_then(|n| n.normal_deg) {
            e.normal = Some(*s);
        }
    }
    Some(e)
}

/// Patches that may contain an extreme of their face, with the grid extreme of that face.
fn candidates<R>(
    probes: &[Probe<'_, R>],
    samples: &[PatchSamples],
    options: &AuditOptions,
) -> Vec<(Estimate, f64)> {
    let mut work = Vec::new();
    let wanted = |q: &Quantity| *q != Quantity::Normal || options.refine_normals;
    for quantity in QUANTITIES.into_iter().filter(wanted) {
        let mut of_face: BTreeMap<u32, Vec<Estimate>> = BTreeMap::new();
        for (patch, (probe, grid)) in probes.iter().zip(samples).enumerate() {
            if let Some(e) = estimate(grid, patch, quantity) {
                of_face.entry(probe.face).or_default().push(e);
            }
        }
        for mut list in of_face.into_values() {
            let floor = list.iter().map(|e| e.best).fold(f64::NEG_INFINITY, f64::max);
            list.retain(|e| e.slack > 0.0 && e.best + e.slack > floor);
            list.sort_by(|a, b| (b.best + b.slack).total_cmp(&(a.best + a.slack)));
            work.extend(list.into_iter().take(options.refine).map(|e| (e, floor)));
        }
    }
    work
}

const DIRECTIONS: [[isize; 2]; 8] =
    [[1, 0], [0, 1], [1, 1], [1, -1], [-1, 0], [0, -1], [-1, -1], [-1, 1]];

fn neighbour(
    grid: &PatchSamples,
    quantity: Quantity,
    [i, j]: [usize; 2],
    [di, dj]: [isize; 2],
) -> Option<f64> {
    let index = grid.index(i.checked_add_signed(di)?, j.checked_add_signed(dj)?)?;
    quantity.of(grid.points.get(index)?.as_ref()?)
}

/// Largest grid value, and half the largest second difference: four times the excess of a parabola of that curvature
/// over its grid points.
fn estimate(grid: &PatchSamples, patch: usize, quantity: Quantity) -> Option<Estimate> {
    let mut best = f64::NEG_INFINITY;
    let mut bend: f64 = 0.0;
    let mut rounding: f64 = 0.0;
    for (at, point) in grid.coordinates().zip(&grid.points) {
        let Some((point, value)) = point.as_ref().and_then(|p| Some((p, quantity.of(p)?))) else {
            continue;
        };
        best = best.max(value);
        rounding = rounding.max(quantity.rounding(point));
        for [di, dj] in &DIRECTIONS[..4] {
            let ends = (
                neighbour(grid, quantity, at, [*di, *dj]),
                neighbour(grid, quantity, at, [-di, -dj]),
            );
            if let (Some(a), Some(b)) = ends {
                bend = bend.max((a - 2.0 * value + b).abs());
            }
        }
    }
    let slack = if grid.n == 1 { best.abs() } else { bend / 2.0 };
    let slack = if slack <= rounding { 0.0 } else { slack };
    best.is_finite().then_some(Estimate { patch, quantity, best, slack })
}

/// Maximum number of starting points per patch.
const STARTS_MAX: usize = 4;
/// Number of rings of points around the best one, each a quarter as wide as its predecessor: the last is 1/32 of the
/// grid spacing, and the vertex of its parabola far more accurate.
const RINGS: usize = 3;
/// Width of the first ring relative to the grid spacing.
const FIRST_WIDTH_REL: f64 = 0.5;

/// Maximum number of moves with one ring width, while the best point is on the ring.
const MOVES_MAX: usize = 3;

/// Values around a point, in the order of [`DIRECTIONS`].
type Ring = [Option<f64>; 8];

/// Search from the local maxima of the grid that may exceed `floor`.
fn search<R: ReferenceSurface>(
    probe: &Probe<'_, R>,
    grid: &PatchSamples,
    e: &Estimate,
    floor: f64,
) -> Option<Sample> {
    let mut starts: Vec<(Top, Ring)> = Vec::new();
    for (at, point) in grid.coordinates().zip(&grid.points) {
        let Some((sample, value)) = point.as_ref().and_then(|p| Some((p, e.quantity.of(p)?)))
        else {
            continue;
        };
        let ring = DIRECTIONS.map(|d| neighbour(grid, e.quantity, at, d));
        if ring.iter().flatten().all(|v| *v <= value) && value + e.slack > floor {
            starts.push((Top { value, sample: *sample }, ring));
        }
    }
    starts.sort_by(|a, b| b.0.value.total_cmp(&a.0.value));
    let climb = MaximumSearch { probe, quantity: e.quantity };
    let climbed = starts
        .into_iter()
        .take(STARTS_MAX)
        .map(|(top, ring)| climb.from(top, &ring, 1.0 / grid.n as f64));
    climbed.reduce(|a, b| if b.value > a.value { b } else { a }).map(|top| top.sample)
}

/// The best point found.
#[derive(Clone, Copy)]
struct Top {
    value: f64,
    sample: Sample,
}

/// Search for a maximum on one patch with rings of points and the vertices of the interpolating parabolas.
struct MaximumSearch<'a, R> {
    probe: &'a Probe<'a, R>,
    quantity: Quantity,
}

impl<R: ReferenceSurface> MaximumSearch<'_, R> {
    /// Search from a grid maximum with its neighbours at the distance `spacing`.
    fn from(&self, mut top: Top, ring: &Ring, spacing: f64) -> Top {
        if let Some(better) = self.parabola_vertex(&top, ring, spacing) {
            top = better;
        }
        let mut width = FIRST_WIDTH_REL * spacing;
        for _ in 0..RINGS {
            for _ in 0..MOVES_MAX {
                let (before, next) = (top.sample, self.step(top, width));
                top = next;
                let moved =
                    (top.sample.eta - before.eta).abs().max((top.sample.zeta - before.zeta).abs());
                // The maximum is inside the ring: continue with a narrower one.
                if moved < 0.7 * width {
                    break;
                }
            }
            width /= 4.0;
        }
        top
    }

    /// The best of a point, a ring around it and the vertex of the interpolating parabola.
    fn step(&self, top: Top, width: f64) -> Top {
        let around =
            DIRECTIONS.map(|[di, dj]| self.at(&top, [width * di as f64, width * dj as f64]));
        let values = around.map(|t| t.map(|t| t.value));
        let parabola_vertex = self.parabola_vertex(&top, &values, width);
        let best = around.into_iter().chain([parabola_vertex]).flatten();
        best.fold(top, |a, b| if b.value > a.value { b } else { a })
    }

    /// The point at a shift from `top`, if it is on the patch.
    fn at(&self, top: &Top, [eta, zeta]: [f64; 2]) -> Option<Top> {
        let (eta, zeta) = (top.sample.eta + eta, top.sample.zeta + zeta);
        let sample = inside(self.probe.patch.sides(), eta, zeta)
            .then(|| self.probe.at(eta, zeta, top.sample.uv))
            .flatten()?;
        Some(Top { value: self.quantity.of(&sample)?, sample })
    }

    /// The vertex of the parabola through the ring, if its value is higher; along one direction at the border of the
    /// patch.
    fn parabola_vertex(&self, top: &Top, ring: &Ring, width: f64) -> Option<Top> {
        let [x, y] = parabola(top.value, ring)?;
        let shift = [x.clamp(-1.0, 1.0) * width, y.clamp(-1.0, 1.0) * width];
        self.at(top, shift).filter(|t| t.value > top.value)
    }
}

/// Vertex of the parabola through the value at the centre and a ring around it, in ring widths. Where the ring is
/// incomplete or the curvature positive, along the most promising direction; `None` without any.
fn parabola(centre: f64, ring: &Ring) -> Option<[f64; 2]> {
    let [px, py, pp, pm, mx, my, mm, mp] = *ring;
    if let (Some(px), Some(py), Some(mx), Some(my)) = (px, py, mx, my)
        && let (Some(pp), Some(pm), Some(mm), Some(mp)) = (pp, pm, mm, mp)
    {
        let (gx, gy) = (0.5 * (px - mx), 0.5 * (py - my));
        let (hxx, hyy) = (px - 2.0 * centre + mx, py - 2.0 * centre + my);
        let hxy = 0.25 * (pp - pm - mp + mm);
        let det = hxx * hyy - hxy * hxy;
        if hxx < 0.0 && det > 0.0 {
            return Some([(hxy * gy - hyy * gx) / det, (hxy * gx - hxx * gy) / det]);
        }
    }
    let along = |k: usize| {
        let (ahead, behind) = (ring[k]?, ring[k + 4]?);
        let (slope, bend) = (0.5 * (ahead - behind), ahead - 2.0 * centre + behind);
        let fraction = (-slope / bend).clamp(-1.0, 1.0);
        let rise = slope * fraction + 0.5 * bend * fraction * fraction;
        (bend < 0.0 && rise > 0.0).then_some((rise, k, fraction))
    };
    let best = (0..4).filter_map(along).max_by(|a, b| a.0.total_cmp(&b.0));
    best.map(|(_, k, fraction)| DIRECTIONS[k].map(|d| fraction * d as f64))
}
