//! Extremes between the grid points: a pattern search from the worst grid points of every patch that may hold the
//! largest or smallest value of its CAD face, so that the reported maximum is a maximum.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::reference::ReferenceSurface;
use super::sample::{PatchSamples, Probe, Sample, inside};

/// What is made as large as it gets.
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

    /// Differences below this are rounding for a patch around `s`.
    fn rounding(self, s: &Sample) -> f64 {
        match self {
            Self::Normal => 1e-9,
            _ => 1e-13 * s.point.norm(),
        }
    }
}

/// Worst points of one patch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Extremes {
    /// Largest signed error.
    pub max: Sample,
    /// Smallest signed error.
    pub min: Sample,
    /// Largest normal error, if there is any normal.
    pub normal: Option<Sample>,
}

/// A patch's value of one quantity on its grid, and how much more there may be between the points.
struct Estimate {
    patch: usize,
    quantity: Quantity,
    best: f64,
    slack: f64,
}

/// Extremes of every patch (samples must not be empty), refined on at most `limit` patches of each CAD face.
pub(super) fn extremes<R: ReferenceSurface>(
    probes: &[Probe<'_, R>],
    samples: &[PatchSamples],
    limit: usize,
) -> Vec<Extremes> {
    let mut found: Vec<Extremes> = samples.iter().filter_map(on_grid).collect();
    let work = candidates(probes, samples, limit);
    let refined: Vec<Option<Sample>> = work
        .par_iter()
        .map(|(e, floor)| search(&probes[e.patch], &samples[e.patch], e, *floor))
        .collect();
    for ((e, _), sample) in work.iter().zip(refined) {
        let (Some(sample), Some(own)) = (sample, found.get_mut(e.patch)) else { continue };
        match e.quantity {
            Quantity::Max if sample.delta > own.max.delta => own.max = sample,
            Quantity::Min if sample.delta < own.min.delta => own.min = sample,
            Quantity::Normal if sample.normal_deg > own.normal.and_then(|s| s.normal_deg) => {
                own.normal = Some(sample);
            }
            _ => {}
        }
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

/// Patches that may hold an extreme of their face, with the grid's extreme of that face.
fn candidates<R>(
    probes: &[Probe<'_, R>],
    samples: &[PatchSamples],
    limit: usize,
) -> Vec<(Estimate, f64)> {
    let mut work = Vec::new();
    for quantity in QUANTITIES {
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
            work.extend(list.into_iter().take(limit).map(|e| (e, floor)));
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

/// Largest grid value, and half the largest second difference: four times what a parabola of that curvature
/// rises above its grid points.
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

/// Starts of the search in one patch, at most.
const STARTS: usize = 4;
/// The step is halved so often: a 512th of a patch at 8 samples.
const HALVINGS: usize = 6;

/// Pattern search from the local maxima of the grid that may reach `floor`.
fn search<R: ReferenceSurface>(
    probe: &Probe<'_, R>,
    grid: &PatchSamples,
    e: &Estimate,
    floor: f64,
) -> Option<Sample> {
    let mut starts: Vec<(f64, Sample)> = Vec::new();
    for (at, point) in grid.coordinates().zip(&grid.points) {
        let Some((point, value)) = point.as_ref().and_then(|p| Some((p, e.quantity.of(p)?))) else {
            continue;
        };
        let top = DIRECTIONS
            .iter()
            .all(|&d| neighbour(grid, e.quantity, at, d).is_none_or(|v| v <= value));
        if top && value + e.slack > floor {
            starts.push((value, *point));
        }
    }
    starts.sort_by(|a, b| b.0.total_cmp(&a.0));
    let climbed = starts
        .into_iter()
        .take(STARTS)
        .map(|(value, start)| climb(probe, e.quantity, start, value, 1.0 / grid.n as f64));
    climbed.reduce(|a, b| if b.0 > a.0 { b } else { a }).map(|(_, s)| s)
}

fn climb<R: ReferenceSurface>(
    probe: &Probe<'_, R>,
    quantity: Quantity,
    mut best: Sample,
    mut value: f64,
    step: f64,
) -> (f64, Sample) {
    let sides = probe.patch.sides();
    let mut step = step / 2.0;
    for _ in 0..HALVINGS {
        // At most two moves a step length: a start is a grid maximum, twice the step away from the next.
        for _ in 0..2 {
            let start = best;
            for [di, dj] in DIRECTIONS {
                let (eta, zeta) = (start.eta + step * di as f64, start.zeta + step * dj as f64);
                if !inside(sides, eta, zeta) {
                    continue;
                }
                let Some(s) = probe.at(eta, zeta) else { continue };
                if let Some(v) = quantity.of(&s).filter(|v| *v > value) {
                    (best, value) = (s, v);
                }
            }
            if best == start {
                break;
            }
        }
        step /= 2.0;
    }
    (value, best)
}
