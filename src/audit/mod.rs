//! Shape error of a tool model against its CAD (Eq. 24): signed distance and normal error at points of every patch,
//! refined around the worst ones, and the discontinuities between adjacent patches.
//!
//! ```
//! use kanagata_audit::reference::{ReferenceFoot, ReferenceSurface};
//! use kanagata_geometry::Vec3;
//!
//! /// The plane z = 0.
//! struct Plane;
//! impl ReferenceSurface for Plane {
//!     fn closest(&self, p: &Vec3, face: u32) -> Option<ReferenceFoot> {
//!         let point = Vec3::new(p.x, p.y, 0.0);
//!         Some(ReferenceFoot { point, normal: Vec3::z(), own_normal: None, face, on_border: false })
//!     }
//! }
//! assert_eq!(Plane.closest(&Vec3::new(1.0, 2.0, 3.0), 0).unwrap().point.z, 0.0);
//! ```
#![forbid(unsafe_code)]

mod area;
mod borders;
pub mod clearance;
mod doubts;
mod gaps;
mod jumps;
pub mod local;
pub mod map;
mod near;
mod options;
#[cfg(feature = "pages")]
pub mod page;
pub mod reference;
mod refine;
pub mod report;
pub mod sample;
mod side;
mod summary;
pub mod view;

use rayon::prelude::*;

pub use doubts::{doubts, doubts_advising, open_joints_doubt};
pub use gaps::OpenSide;
use kanagata_geometry::Vec2;
use kanagata_tool::ToolModel;
pub use options::AuditOptions;
pub use reference::{CadReference, ReferenceSurface};
pub use report::AuditReport;
use sample::{PatchSamples, Probe};

/// The reason why a tool model cannot be audited.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum AuditError {
    /// A model without patches.
    #[error("the tool model has no patches; convert the CAD again")]
    NoPatches,
    /// A grid without intervals, or one too fine.
    #[error("{found} samples along a side of a patch; allowed: 1 to 256")]
    Samples {
        /// Value given.
        found: usize,
    },
    /// A patch without any point that is finite and has a closest point.
    #[error(
        "patch {patch} cannot be compared with the CAD: none of its points is finite and has a closest point; the CAD model may have no faces, or the tool file holds numbers too large"
    )]
    Incomparable {
        /// Index of the patch.
        patch: usize,
    },
}

/// Result of an audit and its sample points.
#[derive(Debug, Clone, PartialEq)]
pub struct Audit {
    /// Report, as in the JSON file.
    pub report: AuditReport,
    /// Sample points of each patch, in patch order.
    pub samples: Vec<PatchSamples>,
}

/// Audits a tool model against a reference surface. The result does not depend on the number of threads.
///
/// # Errors
/// [`AuditError`] when there is nothing to compare.
pub fn audit(
    tool: &ToolModel,
    reference: &impl ReferenceSurface,
    options: &AuditOptions,
) -> Result<Audit, AuditError> {
    audit_from(tool, reference, options, &vec![None; tool.patches.len()])
}

/// As [`audit()`]; `starts` are parameters of the CAD near the middle of each patch, if they are known.
pub fn audit_from(
    tool: &ToolModel,
    reference: &impl ReferenceSurface,
    options: &AuditOptions,
    starts: &[Option<Vec2>],
) -> Result<Audit, AuditError> {
    if tool.patches.is_empty() {
        return Err(AuditError::NoPatches);
    }
    if !(1..=256).contains(&options.samples) {
        return Err(AuditError::Samples { found: options.samples });
    }
    let (sign, starts) = orientation(tool, reference, starts);
    let probe = |((patch, &face), &start)| Probe { patch, face, reference, sign, start };
    let probes: Vec<Probe<'_, _>> =
        tool.patches.iter().zip(&tool.faces).zip(&starts).map(probe).collect();
    let samples = compared(&probes, options)?;
    let extremes = refine::extremes(&probes, &samples, options);
    let _stage = options.progress.stage("audit, borders", "", 0);
    let (jumps, free) = jumps::find(tool, reference, options.samples);
    let borders =
        options.borders.then(|| borders::compare(tool, reference, &free, options.samples));
    let borders = borders.flatten().unwrap_or_default();
    let mut report = summary::report(
        &summary::Found { tool, samples: &samples, extremes, jumps, borders, sign },
        options,
    );
    report.faces_lost = reference.lost_faces();
    // The audits of a search do without, as without areas.
    if options.borders && options.areas {
        let faces = tool.faces.iter().copied().collect();
        report.open_joints = reference.open_joints(&faces).map(Into::into).unwrap_or_default();
    }
    report.doubts = doubts(&report);
    Ok(Audit { report, samples })
}

/// The points of every patch on its grid, compared with the reference.
///
/// # Errors
/// [`AuditError::Incomparable`] for a patch without a point that can be compared.
fn compared<R: ReferenceSurface>(
    probes: &[Probe<'_, R>],
    options: &AuditOptions,
) -> Result<Vec<PatchSamples>, AuditError> {
    let stage = options.progress.stage("audit, points", "patches", probes.len() as u64);
    let sampled = |probe| {
        let samples = PatchSamples::new(probe, options.samples);
        stage.add(1);
        samples
    };
    let samples: Vec<PatchSamples> = probes.par_iter().map(sampled).collect();
    match samples.iter().position(|s| s.valid().next().is_none()) {
        Some(patch) => Err(AuditError::Incomparable { patch }),
        None => Ok(samples),
    }
}

/// Deviation of the free borders of a tool from those of its CAD at `samples` intervals per side, at least 16; `None`
/// for a reference without known borders.
#[must_use]
pub fn free_borders(
    tool: &ToolModel,
    reference: &impl ReferenceSurface,
    samples: usize,
) -> report::Borders {
    let (_, free) = jumps::find(tool, reference, samples);
    borders::compare(tool, reference, &free, samples).map_or_else(Default::default, |c| c.whole)
}

/// Patch sides without neighbour although the CAD continues beyond them, each with its gap from `samples` intervals, at
/// least 16, refined around the largest. Conforming models have none.
#[must_use]
pub fn open_sides(
    tool: &ToolModel,
    reference: &impl ReferenceSurface,
    samples: usize,
) -> Vec<OpenSide> {
    jumps::open_sides(tool, reference, samples)
}

/// +1, or -1 when the tool model as a whole has the opposite orientation of the CAD (reversed towards the sheet during
/// conversion): area-weighted agreement of the normals at the patch centres, found from `starts`. Also returns the
/// parameters of the CAD surface there, the starts of the samples.
fn orientation(
    tool: &ToolModel,
    reference: &impl ReferenceSurface,
    starts: &[Option<Vec2>],
) -> (f64, Vec<Option<Vec2>>) {
    let agreement = |((patch, &face), &start): ((&kanagata_tool::Patch, &u32), &Option<Vec2>)| {
        let (eta, zeta) = sample::middle(patch);
        let d = patch.derivs(eta, zeta);
        let found = reference.closest_from(&d.s, face, start);
        let normal = found.map(|(f, _)| f.own_normal.unwrap_or(f.normal));
        let fraction = normal.map_or(0.0, |n| d.d1.cross(&d.d2).dot(&n));
        (if fraction.is_finite() { fraction } else { 0.0 }, found.and_then(|f| f.1))
    };
    let (shares, starts): (Vec<f64>, Vec<_>) =
        tool.patches.par_iter().zip(&tool.faces).zip(starts).map(agreement).unzip();
    (if shares.iter().sum::<f64>() < 0.0 { -1.0 } else { 1.0 }, starts)
}

#[cfg(test)]
mod tests;

#[cfg(test)]
#[allow(dead_code)] // Some of these shapes are for the tests of other modules.
#[path = "../cad/query_tests/shapes.rs"]
mod shapes;
