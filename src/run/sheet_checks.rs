//! Checks of the sheet after every increment: self-penetration, hourglass modes, through-thickness shear, overhang at
//! tool edges, penetration. The record keeps the first increment of each.

use super::friction_shear::through_thickness_shear;
use super::hourglassing::hourglass_mode;
use super::self_contact::self_penetration;
use kanagata_geometry::Vec3;
use kanagata_report::record::{
    FacePenetrationRecord, InsideToolRecord, NeckingKind, NeckingRecord, OverhangRecord, RunRecord,
};
use kanagata_scene::types::SymmetryPlane;
use kanagata_solver::FacePenetration;
use kanagata_solver::IncrementReport;
use kanagata_solver::penetration::Inside;
use kanagata_solver::report::REPORTED_DEPTH_REL;

/// Records nodes inside tools at the end of a stage. `thickness` of the sheet [mm].
pub(super) fn record_inside_tools(
    record: &mut RunRecord,
    found: Vec<Inside>,
    stage: &str,
    thickness: f64,
) {
    for inside in found {
        let known = record
            .inside_tool
            .as_ref()
            .map_or(REPORTED_DEPTH_REL * thickness, |known| known.depth_mm);
        if inside.depth > known {
            record.inside_tool = Some(InsideToolRecord {
                tool: inside.tool,
                stage: stage.into(),
                nodes: inside.nodes,
                depth_mm: inside.depth,
                at_mm: inside.at.into(),
            });
        }
    }
}

/// Keeps the first increment with localised thinning, and the smallest thickness found. A band remains a band when it
/// tears later.
pub(super) fn record_necking(record: &mut RunRecord, found: Option<NeckingRecord>) {
    let Some(found) = found else { return };
    record.necking = Some(match record.necking.take() {
        None => found,
        Some(known) if found.thickness_rel < known.thickness_rel => {
            let band = known.kind == NeckingKind::Band;
            NeckingRecord {
                kind: if band { known.kind } else { found.kind },
                first_increment: known.first_increment,
                maximum_force: known.maximum_force.or(found.maximum_force),
                ..found
            }
        }
        Some(known) => known,
    });
}

/// Keeps the deepest penetration of element faces. `thickness` of the sheet [mm].
fn record_face_penetration(
    record: &mut RunRecord,
    found: &FacePenetration,
    tool: &str,
    increment: usize,
    thickness: f64,
) {
    let depth_rel = found.depth / thickness;
    let known = record.face_penetration.take();
    let above = depth_rel > FacePenetrationRecord::ALLOWED_REL;
    let first = known.as_ref().and_then(|known| known.first_increment);
    let first_increment = first.or(above.then_some(increment));
    record.face_penetration = match known {
        Some(known) if known.depth_mm >= found.depth => {
            Some(FacePenetrationRecord { first_increment, ..known })
        }
        _ => Some(FacePenetrationRecord {
            tool: tool.into(),
            increment,
            depth_mm: found.depth,
            depth_rel,
            at_mm: found.at.into(),
            first_increment,
        }),
    };
}

/// Runs all checks of an increment, with the nodes at `positions` [mm].
pub(super) fn check_sheet(
    record: &mut RunRecord,
    report: &IncrementReport<'_>,
    positions: &[Vec3],
    planes: &[SymmetryPlane],
) {
    let (mesh, increment) = (report.body.mesh(), report.increment);
    if let Some(found) = &report.face_penetration {
        let tool = &report.tools[found.tool].name;
        record_face_penetration(record, found, tool, increment, mesh.mean_thickness());
    }
    if let Some(found) = self_penetration(mesh, positions, planes, increment) {
        let known = record.self_penetration.get_or_insert(found);
        known.nodes = known.nodes.max(found.nodes);
    }
    if let Some(found) = hourglass_mode(mesh, positions, increment) {
        let known = record.hourglass.get_or_insert(found);
        known.fraction = known.fraction.max(found.fraction);
    }
    if let Some(found) =
        through_thickness_shear(report.body, positions, report.contact_forces, increment)
    {
        let known = record.through_thickness_shear.get_or_insert(found);
        known.fraction = known.fraction.max(found.fraction);
    }
    if let Some(found) = &report.over_edge {
        let known = record.overhang.get_or_insert_with(|| OverhangRecord {
            first_increment: increment,
            tool: report.tools[found.tool].name.clone(),
            nodes: 0,
            depth_mm: 0.0,
            at_mm: found.at.into(),
        });
        known.nodes = known.nodes.max(found.nodes);
        known.depth_mm = known.depth_mm.max(found.depth);
    }
}
