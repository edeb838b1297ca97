//! Doubts about a tool from its audit: exceeded tolerances, missing faces, unsuitability for contact.

use super::report::{AuditReport, OpenJoints};
use kanagata_cad::Model;
use kanagata_report::doubt::{Doubt, DoubtCode, place_mm};

/// Maximum number of patches or faces listed in a doubt.
const LISTED_MAX: usize = 8;

/// The doubts of a report in order of importance, missing faces first. An exceeded tolerance advises to convert within it.
#[must_use]
pub fn doubts(r: &AuditReport) -> Vec<Doubt> {
    let within = |limit: String| format!("Convert to a tolerance of {limit}.");
    doubts_advising(r, &within)
}

/// As [`doubts`]; `advice` is the last sentence where a tolerance, given with its unit, is exceeded.
#[must_use]
pub fn doubts_advising(r: &AuditReport, advice: &dyn Fn(String) -> String) -> Vec<Doubt> {
    let exceeded = [shape(r, advice), borders(r, advice), gap(r), normals(r, advice), open(r)];
    [lost(r), folded(r), points(r)].into_iter().chain(exceeded).flatten().collect()
}

fn lost(r: &AuditReport) -> Option<Doubt> {
    let names = r.faces_lost.iter().map(|f| format!("{} ({})", f.source, f.reason));
    let listed = list(names, r.faces_lost.len())?;
    let text = format!(
        "{} faces of {} are not in the model: {listed}. Nothing is compared there. Repair them in the CAD and export it again.",
        r.faces_lost.len(),
        r.cad_file
    );
    let found = [r.faces_lost.len() as f64, 0.0];
    Some(Doubt::of(DoubtCode::FacesLost, r.cad_file.clone(), found, text))
}

fn folded(r: &AuditReport) -> Option<Doubt> {
    let listed = list(r.folded.iter().map(u32::to_string), r.folded.len())?;
    let text = format!(
        "{} of {} patches fold: {listed}. Contact normals on them are unreliable. Convert again without folds, or with a finer mesh.",
        r.folded.len(),
        r.patches
    );
    let found = [r.folded.len() as f64, 0.0];
    Some(Doubt::of(DoubtCode::FoldedPatches, format!("patch {}", r.folded[0]), found, text))
}

fn points(r: &AuditReport) -> Option<Doubt> {
    let found = [r.points_lost as f64, 0.0];
    let text = format!(
        "{} of {} points of the patches could not be compared with the CAD: they are not finite, have no closest point, or the CAD self-intersects there so that the search reached its work limit. Repair the CAD there, or convert the tool again.",
        r.points_lost,
        r.points + r.points_lost
    );
    (r.points_lost > 0).then(|| Doubt::of(DoubtCode::PointsLost, String::new(), found, text))
}

fn shape(r: &AuditReport, advice: &dyn Fn(String) -> String) -> Option<Doubt> {
    let limit = r.tolerance_mm.filter(|limit| r.worst_mm() > *limit)?;
    let worst = r.worst.first();
    let place = worst.map_or_else(String::new, |w| place_mm(&w.point));
    let on =
        worst.map_or_else(String::new, |w| format!(" on patch {} of face {}", w.patch, w.face));
    let text = format!(
        "The tool deviates by {:.5} mm from its CAD at {place}{on}; allowed: {limit} mm. {}",
        r.worst_mm(),
        advice(format!("{limit} mm"))
    );
    Some(Doubt::of(DoubtCode::ToleranceExceeded, place, [r.worst_mm(), limit], text))
}

fn borders(r: &AuditReport, advice: &dyn Fn(String) -> String) -> Option<Doubt> {
    let found = r.borders.deviation_mm();
    let limit = r.tolerance_mm.filter(|limit| found > *limit)?;
    let place = r.borders.at.map_or_else(String::new, |at| place_mm(&at));
    let ends = if r.borders.tool_to_cad_mm >= r.borders.cad_to_tool_mm {
        "the border of the tool is not one of the CAD"
    } else {
        "the tool does not end where the CAD does"
    };
    let text = format!(
        "Free borders of tool and CAD are {found:.5} mm apart at {place}: {ends}; allowed: {limit} mm. {}",
        advice(format!("{limit} mm"))
    );
    Some(Doubt::of(DoubtCode::BordersExceeded, place, [found, limit], text))
}

fn gap(r: &AuditReport) -> Option<Doubt> {
    let found = r.jumps.border_gap_mm;
    let limit = r.tolerance_mm.filter(|limit| found > *limit)?;
    let place = r.jumps.border_gap_at.map_or_else(String::new, |at| place_mm(&at));
    let text = format!(
        "Patches of neighbouring faces are {found:.5} mm apart at {place}; allowed: {limit} mm. Convert with conforming borders."
    );
    Some(Doubt::of(DoubtCode::GapsExceeded, place, [found, limit], text))
}

/// Open joints of the CAD wider than the allowed error, or than that of the tool where none is given.
fn open(r: &AuditReport) -> Option<Doubt> {
    doubt_of(&r.open_joints, r.tolerance_mm.unwrap_or(r.worst_mm()))
}

/// The doubt that faces of `model` end beside each other, more than `limit` [mm] apart, and are not joined.
#[must_use]
pub fn open_joints_doubt(model: &Model, limit: f64) -> Option<Doubt> {
    doubt_of(&model.open_joints(|_| true)?.into(), limit)
}

fn doubt_of(open: &OpenJoints, limit: f64) -> Option<Doubt> {
    let limit = limit.max(open.join_tolerance_mm);
    let place = open.at.map_or_else(String::new, |at| place_mm(&at));
    let found = open.widest_mm;
    let text = format!(
        "Faces of the CAD end {found:.5} mm beside each other at {place} and are not joined ({} edges); allowed: {limit:.5} mm. The \
         tool is open there. Join them in the CAD.",
        open.edges
    );
    (found > limit).then(|| Doubt::of(DoubtCode::OpenJoints, place, [found, limit], text))
}

fn normals(r: &AuditReport, advice: &dyn Fn(String) -> String) -> Option<Doubt> {
    let limit = r.normal_tolerance_deg.filter(|limit| r.normal_max_deg > *limit)?;
    let off = |f: &&super::report::FaceAudit| f.normal_max_deg >= r.normal_max_deg;
    let place = r.faces.iter().find(off).map_or_else(String::new, |f| format!("face {}", f.face));
    let text = format!(
        "Normals of the tool deviate by {:.3} deg from those of its CAD on {place}; allowed: {limit} deg. {}",
        r.normal_max_deg,
        advice(format!("{limit} deg"))
    );
    Some(Doubt::of(DoubtCode::NormalsExceeded, place, [r.normal_max_deg, limit], text))
}

/// Comma-separated list of the first names; `None` without any.
fn list(names: impl Iterator<Item = String>, count: usize) -> Option<String> {
    let more = if count > LISTED_MAX { ", ..." } else { "" };
    (count > 0).then(|| names.take(LISTED_MAX).collect::<Vec<_>>().join(", ") + more)
}
