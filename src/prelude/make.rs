//! The faces of a conversion, and the tool of them.

use std::time::Duration;

use super::convert::ConvertSettings;
use super::error::Error;
use super::tool::Tool;
use crate::audit::open_joints_doubt;
use crate::cad::Model;
use crate::cad::offset::{OffsetReport, offset_model_watched};
use crate::convert::bezier::{BezierOptions, FINEST, within_tolerance};
use crate::convert::offset::{OffsetRequest, doubts as offset_doubts, signed_distance};
use crate::convert::select::choose;
use crate::convert::tolerance::{Aim, Goal, Refined, refined_to};
use crate::convert::unfolded::mesh_and_convert;
use crate::convert::{ConvertOptions, renumber};
use crate::geometry::Vec3;
use crate::mesh::mapped::{self, MappedOptions};
use crate::reach::{Zone, within_reach};
use crate::report::doubt::{Doubt, DoubtCode};
use crate::tool::edge::EdgeRule;
use crate::tool::file::Provenance;
use crate::tool::selection::FaceSelection;
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
    /// Chooses and offsets the faces of `whole`. With `reach` (the region of the sheet, and its scene) those that the sheet
    /// cannot touch are left out before, as an offset is not defined at the sharp edges of a block's sides.
    pub(super) fn new(
        whole: &Model,
        settings: &ConvertSettings,
        reach: Option<(&Zone, &str)>,
    ) -> Result<Self, Error> {
        let side = settings.sheet_side.map(Vec3::from);
        let chosen = settings.faces.as_ref().map(|faces| choose(whole, faces)).transpose()?;
        let (model, kept) = chosen.map_or_else(|| (whole.clone(), vec![]), |c| (c.model, c.kept));
        let flip = settings.flip;
        let mut source = Self { model, kept, offset: None, side, flip, words: String::new() };
        let Some((zone, scene)) = reach else {
            let request = settings.offset;
            let signed = |request| signed_distance(&source.model, request, side, flip);
            let distance = request.map(signed).transpose()?;
            source.offset(distance, settings)?;
            return Ok(source);
        };
        let turned = source.keep_within(zone, scene)?;
        let signed = |request| match request {
            // The normals look at the sheet before they are flipped.
            OffsetRequest::Towards(distance) => {
                Ok(if turned ^ flip { -distance } else { distance })
            }
            sheet => signed_distance(&source.model, sheet, None, turned),
        };
        let distance = settings.offset.map(signed).transpose()?;
        source.offset(distance, settings)?;
        Ok(Self { side: None, flip: turned, ..source })
    }

    /// Offsets the faces along their normals, unless the distance is zero.
    fn offset(&mut self, distance: Option<f64>, settings: &ConvertSettings) -> Result<(), Error> {
        let Some(distance) = distance.filter(|distance| *distance != 0.0) else { return Ok(()) };
        let number = |f: usize| self.kept.get(f).copied().unwrap_or(f);
        let (smooth_deg, progress) = (settings.smooth_deg, &settings.progress);
        let moved = offset_model_watched(&self.model, distance, smooth_deg, progress);
        let moved = moved.map_err(|e| e.renumbered(number))?;
        (self.model, self.offset) = (moved.model, Some(moved.report));
        Ok(())
    }

    /// Leaves out the faces that the sheet cannot touch. Returns whether the others must be reversed to look at it.
    fn keep_within(&mut self, zone: &Zone, scene: &str) -> Result<bool, Error> {
        let all = self.model.faces.len();
        let reached = within_reach(&self.model, zone, self.side, self.flip)?;
        let number = |f: &usize| self.kept.get(*f).copied().unwrap_or(*f);
        self.kept = reached.kept.iter().map(number).collect();
        self.words = Provenance::reach(scene, &self.kept, all);
        self.model = reached.model;
        Ok(reached.turned)
    }

    /// The choice of faces, for the provenance: an audit repeats it and the offset. The offset of the faces within reach is
    /// that of these faces alone.
    pub(super) fn selection(&self, settings: &ConvertSettings) -> Option<FaceSelection> {
        if self.offset.is_none() || self.words.is_empty() {
            return settings.faces.clone();
        }
        let faces = self.kept.iter().map(usize::to_string).collect();
        Some(FaceSelection { faces, ..FaceSelection::default() })
    }

    /// Doubts about the offset, and about faces that are not joined, farther apart than `limit_mm`; without it, which neither
    /// a tolerance nor a shape error gives, about the offset only.
    pub(super) fn doubts(&self, limit_mm: Option<f64>) -> Vec<Doubt> {
        let of_offset = self.offset.iter().flat_map(offset_doubts);
        let open = limit_mm.and_then(|limit| open_joints_doubt(&self.model, limit));
        of_offset.chain(open).collect()
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
    let known: Vec<DoubtCode> = doubts.iter().map(|doubt| doubt.code).collect();
    let of_source = source.doubts(settings.tolerance_mm.or(error_mm)).into_iter();
    doubts.extend(of_source.filter(|doubt| !known.contains(&doubt.code)));
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
        through_cad: settings.edges_follow_cad(),
        smooth_deg: settings.smooth_deg,
        sheet_side: source.side,
        flip: source.flip,
        straighten: settings.is_refined(),
        progress: settings.progress.clone(),
        ..ConvertOptions::default()
    };
    let mesh = MappedOptions {
        arc_divisions: settings.arc_divisions,
        through_cad: settings.edges_follow_cad() && !settings.is_refined(),
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
    let (two_sided, borders) = (true, settings.borders);
    let goal = Goal {
        tol_mm: settings.tolerance_mm.unwrap_or(f64::INFINITY),
        normal_deg: settings.normal_tolerance_deg.unwrap_or(f64::INFINITY),
        two_sided,
        borders,
    };
    let time = settings.time_s.filter(|s| s.is_finite() && *s >= 0.0).map(Duration::from_secs_f64);
    let aim = match settings.patches {
        Some(patches) => Aim::Patches { patches, two_sided, borders },
        None => Aim::Within(goal, time),
    };
    Ok(refined_to(model, mesh, options, &aim)?)
}

/// Bezier patches within the tolerance.
fn bezier(source: &Source, settings: &ConvertSettings) -> Result<Made, Error> {
    let options = BezierOptions {
        name: settings.name.clone(),
        tolerance_mm: settings.tolerance_mm.unwrap_or(BEZIER_TOLERANCE_MM),
        sheet_side: source.side,
        flip: source.flip,
        progress: settings.progress.clone(),
    };
    let mesh = |arc_divisions| {
        let options = MappedOptions { arc_divisions, ..MappedOptions::default() };
        mapped::mesh_watched(&source.model, &options, &settings.progress)
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
