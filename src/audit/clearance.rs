//! Clearance between two tools at the end of their travel, compared with the sheet thickness. It predicts force peaks
//! such as the 340 kN of the paper before any run.

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::sample::inside;
use kanagata_contact::{Location, ToolSurface};
use kanagata_geometry::Vec3;
use kanagata_tool::{Patch, ToolModel};

/// Options of a clearance audit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClearanceOptions {
    /// Travel of the first tool [mm].
    pub travel: Vec3,
    /// Thickness of the sheet between them [mm], > 0.
    pub thickness_mm: f64,
    /// Intervals of the sample grid per patch side (1 to 256).
    pub samples: usize,
    /// Maximum number of patches around whose closest points the minimum is refined.
    pub refine: usize,
    /// Number of patches listed in `nearest`.
    pub nearest: usize,
}

/// What a clearance audit found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ClearanceReport {
    /// `kanagata-clearance`.
    pub format: String,
    /// File version: 1.
    pub version: u32,
    /// Tool that travels, as its file was named.
    pub tool_file: String,
    /// Tool that stays.
    pub against_file: String,
    /// Travel of the first [mm].
    pub travel_mm: [f64; 3],
    /// Thickness asked for [mm].
    pub thickness_mm: f64,
    /// Least clearance: distance from a point of the first tool along the second one's normal, negative inside
    /// it [mm]; null when no point faces the other tool.
    pub min_mm: Option<f64>,
    /// Where: point of the first tool at the end of its travel [mm].
    pub at_mm: Option<[f64; 3]>,
    /// Patch of the first tool there, and of the second.
    pub patches: Option<[u32; 2]>,
    /// Largest excess of the thickness over the clearance, over the thickness; 0 where there is none.
    pub pinch: f64,
    /// Area of the first tool that faces the second [mm^2].
    pub facing_mm2: f64,
    /// Share of it where the clearance is below the thickness by more than a thousandth.
    pub share_below: f64,
    /// Shares of it by clearance over thickness, in steps of 0.05 from 0 to 2; the first and the last hold what is
    /// beyond.
    pub histogram: Vec<f64>,
    /// Patches of the first tool with the least clearance, worst first.
    pub nearest: Vec<NearPatch>,
}

/// A patch and its least clearance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NearPatch {
    /// Patch of the first tool, from 0.
    pub patch: u32,
    /// Its CAD face id.
    pub face: u32,
    /// Least clearance on it [mm].
    pub clearance_mm: f64,
    /// Where [mm].
    pub point: [f64; 3],
    /// Patch of the second tool there.
    pub against: u32,
}

/// A point of the first tool opposite to the second tool.
#[derive(Debug, Clone, Copy)]
struct Facing {
    eta: f64,
    zeta: f64,
    clearance: f64,
    point: Vec3,
    against: u32,
    jacobian: f64,
}

/// Bin width of the histogram relative to the thickness.
const BIN_WIDTH_REL: f64 = 0.05;
/// Number of bins of the histogram.
const BINS: usize = 40;
/// Deficit of clearance relative to the thickness that is not counted.
const CLEARANCE_TOLERANCE_REL: f64 = 1e-3;
/// Distance in thicknesses beyond which points are not opposite to the other tool.
const OPPOSITE_DISTANCE_MAX: f64 = 8.0;

/// Audits the clearance. The result does not depend on the number of threads.
#[must_use]
pub fn clearance(
    tool: &ToolModel,
    against: &ToolSurface,
    options: &ClearanceOptions,
) -> ClearanceReport {
    let gauge = Gauge { against, options };
    let samples = options.samples.clamp(1, 256);
    let grids: Vec<Vec<(Facing, f64)>> =
        tool.patches.par_iter().map(|p| gauge.grid(p, samples)).collect();
    let minima = gauge.minimum_clearances(tool, &grids, samples);
    let near = |&(patch, f): &(u32, Facing)| NearPatch {
        patch,
        face: tool.faces[patch as usize],
        clearance_mm: f.clearance,
        point: f.point.into(),
        against: f.against,
    };
    let first = minima.first();
    let min = first.map(|f| f.1.clearance);
    let thickness = options.thickness_mm;
    let mut report = ClearanceReport {
        format: "kanagata-clearance".into(),
        version: 1,
        tool_file: String::new(),
        against_file: String::new(),
        travel_mm: options.travel.into(),
        thickness_mm: thickness,
        min_mm: min,
        at_mm: first.map(|f| f.1.point.into()),
        patches: first.map(|f| [f.0, f.1.against]),
        pinch: min.map_or(0.0, |c| (1.0 - c / thickness).max(0.0)),
        facing_mm2: 0.0,
        share_below: 0.0,
        histogram: vec![0.0; BINS],
        nearest: minima.iter().take(options.nearest).map(near).collect(),
    };
    report.accumulate_areas(grids.iter().flatten());
    report
}

impl ClearanceReport {
    /// Accumulates the areas represented by the points.
    fn accumulate_areas<'f>(&mut self, points: impl Iterator<Item = &'f (Facing, f64)>) {
        for (f, area) in points {
            self.facing_mm2 += area;
            if f.clearance < self.thickness_mm * (1.0 - CLEARANCE_TOLERANCE_REL) {
                self.share_below += area;
            }
            let bar = (f.clearance / self.thickness_mm / BIN_WIDTH_REL)
                .clamp(0.0, BINS as f64 - 1.0) as usize;
            self.histogram[bar] += area;
        }
        if self.facing_mm2 > 0.0 {
            self.share_below /= self.facing_mm2;
            self.histogram.iter_mut().for_each(|b| *b /= self.facing_mm2);
        }
    }
}

struct Gauge<'a> {
    against: &'a ToolSurface,
    options: &'a ClearanceOptions,
}

impl Gauge<'_> {
    /// Minimum clearance of every patch opposite to the other tool, in increasing order; the smallest are refined.
    fn minimum_clearances(
        &self,
        tool: &ToolModel,
        grids: &[Vec<(Facing, f64)>],
        samples: usize,
    ) -> Vec<(u32, Facing)> {
        let mut minima: Vec<(u32, Facing)> = (0..)
            .zip(grids)
            .filter_map(|(k, g)| {
                let first =
                    g.iter().map(|f| f.0).min_by(|a, b| a.clearance.total_cmp(&b.clearance));
                first.map(|f| (k, f))
            })
            .collect();
        minima.sort_by(|a, b| a.1.clearance.total_cmp(&b.1.clearance).then(a.0.cmp(&b.0)));
        let refined = minima.len().min(self.options.refine);
        minima[..refined].par_iter_mut().for_each(|(k, f)| {
            *f = self.descend(&tool.patches[*k as usize], *f, 1.0 / samples as f64);
        });
        minima.sort_by(|a, b| a.1.clearance.total_cmp(&b.1.clearance).then(a.0.cmp(&b.0)));
        minima
    }

    /// The point of a patch at the end of the travel if it is opposite to the other tool: its foot point is not on a
    /// border, and the normals oppose each other.
    fn at(&self, patch: &Patch, eta: f64, zeta: f64, hint: Option<u32>) -> Option<Facing> {
        let d = patch.derivs(eta, zeta);
        let point = d.s + self.options.travel;
        let reach = OPPOSITE_DISTANCE_MAX * self.options.thickness_mm;
        let foot = self.against.within(&point, hint, reach);
        if foot.patch == u32::MAX || foot.past_border {
            return None;
        }
        let normal = patch.normal(eta, zeta)?;
        // At a crease the normal of the foot point is not unique: use the distance, with the sign of the gap.
        let clearance = match foot.location {
            Location::Inside => foot.gap,
            _ => (point - foot.point).norm() * foot.gap.signum(),
        };
        (normal.dot(&foot.normal) < -0.2).then_some(Facing {
            eta,
            zeta,
            clearance,
            point,
            against: foot.patch,
            jacobian: d.d1.cross(&d.d2).norm(),
        })
    }

    /// Grid points opposite to the other tool, with the area each represents.
    fn grid(&self, patch: &Patch, n: usize) -> Vec<(Facing, f64)> {
        let sides = patch.sides();
        let cell = 1.0 / (n * n) as f64;
        let end = |k: usize| if k == 0 || k == n { 0.5 } else { 1.0 };
        let mut hint = None;
        let mut out = Vec::new();
        for k in 0..(n + 1) * (n + 1) {
            let (i, j) = (k / (n + 1), k % (n + 1));
            let (eta, zeta) = (i as f64 / n as f64, j as f64 / n as f64);
            if !inside(sides, eta, zeta) {
                continue;
            }
            let Some(f) = self.at(patch, eta, zeta, hint) else { continue };
            hint = Some(f.against);
            // On the diagonal of a triangle half of the cell is outside.
            let half = if sides == 3 && i == j { 0.5 } else { 1.0 };
            out.push((f, f.jacobian * cell * end(i) * end(j) * half));
        }
        out
    }

    /// Pattern search for the minimum clearance around a grid point.
    fn descend(&self, patch: &Patch, start: Facing, step: f64) -> Facing {
        const STEP_BISECTIONS: usize = 8;
        let mut best = start;
        let mut step = 0.5 * step;
        for _ in 0..STEP_BISECTIONS {
            let centre = best;
            for k in 0..9_i32 {
                let (i, j) = (f64::from(k % 3 - 1), f64::from(k / 3 - 1));
                let (eta, zeta) = (centre.eta + step * i, centre.zeta + step * j);
                if !inside(patch.sides(), eta, zeta) {
                    continue;
                }
                let found = self.at(patch, eta, zeta, Some(centre.against));
                if let Some(f) = found.filter(|f| f.clearance < best.clearance) {
                    best = f;
                }
            }
            step *= 0.5;
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_tool::ToolKind;
    use kanagata_tool::bezier::of_nagata;

    /// A square plate of side 10 at height z (x from `x0`), facing up or down, with its middle raised by `bulge`.
    fn plate(x0: f64, z: f64, up: bool, bulge: f64) -> ToolModel {
        let mut points = Vec::new();
        for i in 0..3 {
            for j in 0..3 {
                let (x, y) = (x0 + 5.0 * f64::from(i), 5.0 * f64::from(j));
                let (x, y) = if up { (x, y) } else { (x0 + y, x - x0) };
                let raised = if i == 1 && j == 1 { 4.0 * bulge } else { 0.0 };
                points.push(Vec3::new(x, y, z + raised));
            }
        }
        let patch = of_nagata(&Patch::Bezier { degrees: [2, 2], points });
        ToolModel::of_patches("plate", ToolKind::Bezier, vec![patch], vec![0])
    }

    fn options(thickness_mm: f64) -> ClearanceOptions {
        ClearanceOptions {
            travel: Vec3::new(0.0, 0.0, -20.0),
            thickness_mm,
            samples: 7,
            refine: 64,
            nearest: 3,
        }
    }

    #[test]
    fn parallel_plates_have_their_distance_everywhere() {
        let die = ToolSurface::new(plate(0.0, 0.0, true, 0.0));
        let r = clearance(&plate(0.0, 21.0, false, 0.0), &die, &options(0.8));
        assert!((r.min_mm.unwrap() - 1.0).abs() < 1e-12 && r.share_below == 0.0);
        assert!((r.facing_mm2 - 100.0).abs() < 1e-9 && r.pinch == 0.0);
        let r = clearance(&plate(0.0, 21.0, false, 0.0), &die, &options(1.25));
        assert!((r.share_below - 1.0).abs() < 1e-12 && (r.pinch - 0.2).abs() < 1e-12);
        assert!((r.histogram.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }

    /// The middle control point of a biquadratic patch has weight 1/4: the bulge of 0.3 mm lies between the points of
    /// an odd grid and must still be found.
    #[test]
    fn the_least_clearance_is_found_between_grid_points() {
        let die = ToolSurface::new(plate(0.0, 0.0, true, 0.0));
        let r = clearance(&plate(0.0, 21.0, false, -0.3), &die, &options(0.8));
        assert!((r.min_mm.unwrap() - 0.7).abs() < 1e-4, "{:?}", r.min_mm);
        let at = r.at_mm.unwrap();
        assert!((at[0] - 5.0).abs() < 0.1 && (at[1] - 5.0).abs() < 0.1);
        // 16 x (1 - x) y (1 - y) > 2 / 3 on this fraction of the unit square.
        assert!((r.share_below - 0.2744).abs() < 0.05, "{}", r.share_below);
    }

    #[test]
    fn only_what_faces_the_other_tool_counts() {
        let die = ToolSurface::new(plate(0.0, 0.0, true, 0.0));
        let beside = clearance(&plate(5.0, 21.0, false, 0.0), &die, &options(0.8));
        assert!(beside.facing_mm2 > 45.0 && beside.facing_mm2 < 65.0);
        let away = clearance(&plate(0.0, 21.0, true, 0.0), &die, &options(0.8));
        assert_eq!((away.min_mm, away.facing_mm2), (None, 0.0));
        let through = clearance(&plate(0.0, 19.5, false, 0.0), &die, &options(0.8));
        assert!((through.min_mm.unwrap() + 0.5).abs() < 1e-12);
    }
}
