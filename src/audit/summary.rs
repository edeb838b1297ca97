//! Statistics of an audit: extremes, area-weighted means and percentiles, by patch, by face and in total.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::area::{area, max_subdivisions};
use super::borders::Compared;
use super::options::AuditOptions;
use super::refine::Extremes;
use super::report::{
    AuditReport, FaceAudit, Jumps, OpenJoints, PatchAudit, Percentiles, WorstPatch,
};
use super::sample::{PatchSamples, Sample};
use kanagata_tool::{Patch, ToolModel};

/// Results at the points of a tool model.
pub(super) struct Found<'a> {
    pub tool: &'a ToolModel,
    pub samples: &'a [PatchSamples],
    pub extremes: Vec<Extremes>,
    pub jumps: Jumps,
    pub borders: Compared,
    pub sign: f64,
}

/// Accumulated statistics of a patch, a face or the tool.
#[derive(Clone, Copy)]
struct Sums {
    patches: usize,
    max: f64,
    min: f64,
    normal: f64,
    /// Area of the patches by Gauss quadrature [mm^2].
    area: f64,
    /// Area represented by the grid points [mm^2]: the weight of their errors.
    weight: f64,
    /// Integral of the squared error.
    square: f64,
    /// Sum of the squared errors and their number, for patches without area.
    plain: [f64; 2],
}

impl Sums {
    fn of_patch(
        patch: &Patch,
        samples: &PatchSamples,
        e: &Extremes,
        max_subdivisions: Option<usize>,
    ) -> Self {
        let areas = samples.areas();
        let mut sums = Self {
            patches: 1,
            max: e.max.delta,
            min: e.min.delta,
            normal: e.normal.and_then(|s| s.normal_deg).unwrap_or(0.0),
            area: max_subdivisions.map_or_else(|| areas.iter().sum(), |most| area(patch, most)),
            weight: 0.0,
            square: 0.0,
            plain: [0.0; 2],
        };
        for (area, point) in areas.iter().zip(&samples.points) {
            let Some(p) = point else { continue };
            sums.weight += area;
            sums.square += area * p.delta * p.delta;
            sums.plain[0] += p.delta * p.delta;
            sums.plain[1] += 1.0;
        }
        sums
    }

    fn add(&mut self, other: &Self) {
        self.patches += other.patches;
        self.max = self.max.max(other.max);
        self.min = self.min.min(other.min);
        self.normal = self.normal.max(other.normal);
        self.area += other.area;
        self.weight += other.weight;
        self.square += other.square;
        self.plain[0] += other.plain[0];
        self.plain[1] += other.plain[1];
    }

    fn rms(&self) -> f64 {
        let [square, weight] =
            if self.weight > 0.0 { [self.square, self.weight] } else { self.plain };
        (square / weight).sqrt()
    }
}

/// The extreme of a patch with the larger absolute value.
fn larger_extreme(e: &Extremes) -> &Sample {
    if e.max.delta.abs() >= e.min.delta.abs() { &e.max } else { &e.min }
}

/// Assembles the report; file names and hashes are left empty for the caller.
pub(super) fn report(found: &Found<'_>, options: &AuditOptions) -> AuditReport {
    let sums = sums_of_patches(found, options.areas);
    let whole = total(&sums);
    let points = measured(found).count();
    let lost = found.samples.iter().map(|s| s.points.len()).sum::<usize>() - points;
    AuditReport {
        format: "kanagata-audit".into(),
        version: 1,
        program: format!("kanagata {}", env!("CARGO_PKG_VERSION")),
        tool: found.tool.name.clone(),
        tool_file: String::new(),
        tool_sha256: String::new(),
        cad_file: String::new(),
        cad_sha256: String::new(),
        patches: found.tool.patches.len(),
        max_mm: whole.max,
        min_mm: whole.min,
        rms_mm: whole.rms(),
        distance_max_mm: largest_distance(found),
        normal_max_deg: whole.normal,
        percentiles_mm: percentiles(found.samples),
        tolerance_mm: options.tolerance_mm,
        normal_tolerance_deg: options.normal_tolerance_deg,
        within_tolerance: within_tolerance(found, options, &whole, lost),
        area_mm2: whole.area,
        points,
        points_lost: lost,
        points_without_normal: measured(found).filter(|s| s.normal_deg.is_none()).count(),
        turned: found.sign < 0.0,
        folded: (0u32..).zip(&sums).filter(|(_, s)| s.normal > 90.0).map(|(k, _)| k).collect(),
        jumps: found.jumps,
        borders: found.borders.whole,
        open_joints: OpenJoints::default(),
        doubts: Vec::new(),
        faces_lost: Vec::new(),
        faces: by_face(&found.tool.faces, &sums, &found.borders),
        worst: worst(found, options.worst),
        by_patch: by_patch(found, &sums),
    }
}

/// Statistics of each patch; `areas` are integrated, or else summed over the grid.
fn sums_of_patches(found: &Found<'_>, areas: bool) -> Vec<Sums> {
    let parts = found.tool.patches.par_iter().zip(found.samples).zip(&found.extremes);
    let max_subdivisions = areas.then(|| max_subdivisions(found.tool.patches.len()));
    parts.map(|((p, s), e)| Sums::of_patch(p, s, e, max_subdivisions)).collect()
}

/// Statistics of all patches together.
fn total(sums: &[Sums]) -> Sums {
    let mut whole = sums[0];
    sums[1..].iter().for_each(|s| whole.add(s));
    whole
}

/// Points with a valid comparison.
fn measured<'a>(found: &'a Found<'_>) -> impl Iterator<Item = &'a Sample> {
    found.samples.iter().flat_map(|s| &s.points).flatten()
}

/// Largest distance from the CAD over all points and the refined extremes [mm].
fn largest_distance(found: &Found<'_>) -> f64 {
    let extreme = found.extremes.iter().flat_map(|e| [e.max.distance, e.min.distance]);
    measured(found).map(|s| s.distance).chain(extreme).fold(0.0, f64::max)
}

/// True when errors, normals, gaps and borders are within the tolerances and no point is lost; `None` without a
/// tolerance.
fn within_tolerance(
    found: &Found<'_>,
    options: &AuditOptions,
    whole: &Sums,
    lost: usize,
) -> Option<bool> {
    let worst_mm = whole.max.abs().max(whole.min.abs());
    let kept = |limit: Option<f64>, value: f64| limit.is_none_or(|l| value <= l);
    let has_tolerance = options.tolerance_mm.is_some() || options.normal_tolerance_deg.is_some();
    let within = kept(options.tolerance_mm, worst_mm)
        && kept(options.normal_tolerance_deg, whole.normal)
        && kept(options.tolerance_mm, found.jumps.border_gap_mm)
        && kept(options.tolerance_mm, found.borders.whole.deviation_mm())
        && lost == 0;
    has_tolerance.then_some(within)
}

fn by_face(faces: &[u32], sums: &[Sums], borders: &Compared) -> Vec<FaceAudit> {
    let mut of_face: BTreeMap<u32, Sums> = BTreeMap::new();
    for (&face, s) in faces.iter().zip(sums) {
        of_face.entry(face).and_modify(|f| f.add(s)).or_insert(*s);
    }
    let audit = |(face, s): (u32, Sums)| FaceAudit {
        face,
        patches: s.patches,
        max_mm: s.max,
        min_mm: s.min,
        rms_mm: s.rms(),
        normal_max_deg: s.normal,
        area_mm2: s.area,
        border_mm: borders.by_face.get(&face).copied().unwrap_or(0.0),
    };
    of_face.into_iter().map(audit).collect()
}

fn by_patch(found: &Found<'_>, sums: &[Sums]) -> Vec<PatchAudit> {
    let audit = |(id, ((s, e), &face)): (u32, ((&Sums, &Extremes), &u32))| PatchAudit {
        id,
        face,
        max_mm: s.max,
        min_mm: s.min,
        rms_mm: s.rms(),
        normal_max_deg: s.normal,
        worst_point: larger_extreme(e).point.into(),
    };
    (0u32..).zip(sums.iter().zip(&found.extremes).zip(&found.tool.faces)).map(audit).collect()
}

fn worst(found: &Found<'_>, count: usize) -> Vec<WorstPatch> {
    let mut order: Vec<usize> = (0..found.extremes.len()).collect();
    let size = |k: usize| larger_extreme(&found.extremes[k]).delta.abs();
    order.sort_by(|&a, &b| size(b).total_cmp(&size(a)));
    let entry = |&k: &usize| {
        let s = larger_extreme(&found.extremes[k]);
        WorstPatch {
            patch: k as u32,
            face: found.tool.faces[k],
            delta_mm: s.delta,
            eta: s.eta,
            zeta: s.zeta,
            point: s.point.into(),
        }
    };
    order.iter().take(count).map(entry).collect()
}

/// Area-weighted percentiles of |delta|.
fn percentiles(samples: &[PatchSamples]) -> Percentiles {
    let mut all: Vec<(f64, f64)> = Vec::new();
    for s in samples {
        let areas = s.areas();
        all.extend(
            areas.iter().zip(&s.points).filter_map(|(a, p)| Some((p.as_ref()?.delta.abs(), *a))),
        );
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = all.iter().map(|p| p.1).sum();
    let mut sum = 0.0;
    let below: Vec<(f64, f64)> = all
        .iter()
        .map(|(value, area)| {
            sum += area;
            (sum, *value)
        })
        .collect();
    let at = |fraction: f64| {
        let place = below.partition_point(|(s, _)| *s < fraction * total);
        below.get(place.min(below.len().saturating_sub(1))).map_or(0.0, |p| p.1)
    };
    Percentiles { p50: at(0.5), p90: at(0.9), p95: at(0.95), p99: at(0.99) }
}
