//! The faces of a conversion, and the tool of them.

use std::time::Duration;

use super::convert::ConvertSettings;
use super::error::Error;
use super::tool::Tool;
use crate::cad::Model;
use crate::cad::offset::{OffsetReport, offset_model};
use crate::convert::bezier::{BezierOptions, FINEST, within_tolerance};
use crate::convert::offset::{doubts as offset_doubts, signed_distance};
use crate::convert::reach::{Zone, within_reach};
use crate::convert::select::choose;
use crate::convert::tolerance::{Goal, Refined, ToleranceError, to_patches, to_tolerance_in_time};
use crate::convert::unfolded::mesh_and_convert;
use crate::convert::{ConvertOptions, renumber};
use crate::geometry::Vec3;
use crate::mesh::mapped::{self, MappedOptions};
use crate::report::doubt::Doubt;
use crate::tool::edge::EdgeRule;
use crate::tool::file::Provenance;
use crate::tool::{ToolKind, ToolModel};

/// Shape error of Bezier patches where none is asked for [mm].
const BEZIER_TOLERANCE_MM: f64 = 1e-4;

/// The faces that become a tool: chosen, offset, within reach of the sheet.
pub(super) struct Source {
    model: Model,
    /// Number of each face in the file; empty where all are taken.
    kept: Vec<usize>,
    pub(super) offset: Option<OffsetReport>,
    /// Direction towards the sheet, if the model is yet to be turned to it.
    side: Option<Vec3>,
    flip: bool,
    /// For the provenance.
    pub(super) words: String,
}

impl Source {
    /// Chooses and offsets the faces of `whole`; with `reach` (the region of the sheet, and its scene) those that the sheet
    /// cannot touch are left out.
    pub(super) fn new(
        whole: &Model,
        settings: &ConvertSettings,
        reach: Option<(&Zone, &str)>,
    ) -> Result<Self, Error> {
        let side = settings.sheet_side.map(Vec3::from);
        let chosen = settings.faces.as_ref().map(|faces| choose(whole, faces)).transpose()?;
        let (mut model, kept) =
            chosen.map_or_else(|| (whole.clone(), vec![]), |c| (c.model, c.kept));
        let mut offset = None;
        if let Some(request) = settings.offset {
            let distance = signed_distance(&model, request, side, settings.flip)?;
            if distance != 0.0 {
                let number = |f: usize| kept.get(f).copied().unwrap_or(f);
                let moved = offset_model(&model, distance, settings.smooth_deg);
                let moved = moved.map_err(|e| e.renumbered(number))?;
                (model, offset) = (moved.model, Some(moved.report));
            }
        }
        let all = Self { model, kept, offset, side, flip: settings.flip, words: String::new() };
        match reach {
            Some((zone, scene)) => all.within(zone, scene),
            None => Ok(all),
        }
    }

    /// Doubts about the offset.
    pub(super) fn doubts(&self) -> Vec<Doubt> {
        self.offset.iter().flat_map(offset_doubts).collect()
    }

    /// The faces that the sheet can touch.
    fn within(self, zone: &Zone, scene: &str) -> Result<Self, Error> {
        let all = self.model.faces.len();
        let reached = within_reach(&self.model, zone, self.side, self.flip)?;
        let number = |f: &usize| self.kept.get(*f).copied().unwrap_or(*f);
        Ok(Self {
            words: Provenance::reach(scene, reached.kept.len(), all),
            kept: reached.kept.iter().map(number).collect(),
            model: reached.model,
            side: None,
            flip: reached.turned,
            offset: self.offset,
        })
    }
}

/// The tool of `source`.
pub(super) fn converted(
    source: &Source,
    settings: &ConvertSettings,
    provenance: Provenance,
) -> Result<Tool, Error> {
    let (mut model, error_mm, mut doubts) = match settings.kind {
        ToolKind::Bezier => bezier(source, settings)?,
        _ => patches(source, settings)?,
    };
    if !source.kept.is_empty() {
        renumber(&mut model, &source.kept);
    }
    doubts.extend(source.doubts());
    let provenance = Provenance { shape_error_mm: error_mm, ..provenance };
    Ok(Tool::made(model, EdgeRule::Guarded, provenance, doubts))
}

/// A tool, its shape error if known [mm], and its doubts.
type Made = (ToolModel, Option<f64>, Vec<Doubt>);

/// Nagata patches or facets, within the tolerance if there is one.
fn patches(source: &Source, settings: &ConvertSettings) -> Result<Made, Error> {
    let options = ConvertOptions {
        name: settings.name.clone(),
        kind: settings.kind,
        through_cad: settings.edges_on_cad,
        smooth_deg: settings.smooth_deg,
        sheet_side: source.side,
        flip: source.flip,
        straighten: settings.is_refined(),
        ..ConvertOptions::default()
    };
    let mesh = MappedOptions {
        arc_divisions: settings.arc_divisions,
        through_cad: settings.edges_on_cad && !settings.is_refined(),
        ..MappedOptions::default()
    };
    if !settings.is_refined() {
        let (model, report) = mesh_and_convert(&source.model, &mesh, &options)?;
        refuse_folds(report.folded.len())?;
        return Ok((model, None, Vec::new()));
    }
    let found = refined(&source.model, settings, &mesh, &options)?;
    refuse_folds(found.report.folded.len())?;
    Ok((found.tool, Some(found.audit.worst_mm()), found.audit.doubts))
}

/// The model with the fewest patches found within the tolerances, or with as many patches as asked.
fn refined(
    model: &Model,
    settings: &ConvertSettings,
    mesh: &MappedOptions,
    options: &ConvertOptions,
) -> Result<Refined, Error> {
    if let Some(patches) = settings.patches {
        return Ok(to_patches(model, mesh, options, patches, true, settings.borders)?);
    }
    let goal = Goal {
        tol_mm: settings.tolerance_mm.unwrap_or(f64::INFINITY),
        normal_deg: settings.normal_tolerance_deg.unwrap_or(f64::INFINITY),
        two_sided: true,
        borders: settings.borders,
    };
    let time = settings.time_s.filter(|s| s.is_finite() && *s >= 0.0).map(Duration::from_secs_f64);
    match to_tolerance_in_time(model, mesh, options, &goal, time) {
        Err(ToleranceError::Above { model, .. }) => Ok(*model),
        found => Ok(found?),
    }
}

/// Bezier patches within the tolerance.
fn bezier(source: &Source, settings: &ConvertSettings) -> Result<Made, Error> {
    let options = BezierOptions {
        name: settings.name.clone(),
        tolerance_mm: settings.tolerance_mm.unwrap_or(BEZIER_TOLERANCE_MM),
        sheet_side: source.side,
        flip: source.flip,
    };
    let mesh = |arc_divisions| {
        mapped::mesh(&source.model, &MappedOptions { arc_divisions, ..MappedOptions::default() })
    };
    let within = within_tolerance(&source.model, &options, false, FINEST, mesh)?;
    Ok((within.tool, Some(within.report.error_mm), Vec::new()))
}

/// Refuses models with folded patches.
fn refuse_folds(count: usize) -> Result<(), Error> {
    if count == 0 {
        return Ok(());
    }
    Err(Error::input(format!(
        "{count} patches fold; allowed: none; divide more finely or repair these faces in the CAD"
    )))
}
