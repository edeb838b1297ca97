//! Prints the figures of an audit.

use std::path::Path;

use crate::audit::AuditReport;
use crate::audit::report::{Jumps, WorstPatch};
use crate::cli::terminal::out;

/// Prints one row of a table of tools.
pub(super) fn print_row(tool: &Path, r: &AuditReport) {
    out!(
        "{:32} {:>8} {:>+10.5} {:>+10.5} {:>10.5} {:>10.5} {:>8.3} {:>8.3} {:>9.1e}",
        short(tool),
        r.patches,
        r.max_mm,
        r.min_mm,
        r.rms_mm,
        r.percentiles_mm.p99,
        r.normal_max_deg,
        r.jumps.normal_deg,
        r.jumps.position_mm.max(r.jumps.border_gap_mm)
    );
}

pub(super) fn print_report(r: &AuditReport) {
    out!("{} against {}: {} patches, {} points", r.tool_file, r.cad_file, r.patches, r.points);
    out!(
        "  shape error {:+.5} to {:+.5} mm, rms {:.5} mm; 99 % of the area within {:.5} mm",
        r.min_mm,
        r.max_mm,
        r.rms_mm,
        r.percentiles_mm.p99
    );
    out!(
        "  normal error up to {:.3} deg; across shared edges normals jump by up to {:.3} deg",
        r.normal_max_deg,
        r.jumps.normal_deg
    );
    print_jumps(&r.jumps);
    print_borders(r);
    if let Some([x, y, z]) = r.open_joints.at {
        out!(
            "  {} free edges of the CAD run beside those of other faces, up to {:.5} mm away, widest at ({x:.3}, {y:.3}, {z:.3}) mm",
            r.open_joints.edges,
            r.open_joints.widest_mm
        );
    }
    if !r.folded.is_empty() {
        out!(
            "  {} patches fold, the first ones {:?}",
            r.folded.len(),
            &r.folded[..r.folded.len().min(8)]
        );
    }
    print_worst(&r.worst);
    if let Some(tolerance) = r.tolerance_mm {
        let kept = if r.within_tolerance == Some(true) { "within" } else { "ABOVE" };
        out!("  {kept} the {tolerance} mm asked for");
    }
}

/// Prints the discontinuities along shared edges, and along edges where faces meet.
fn print_jumps(jumps: &Jumps) {
    out!(
        "  {} edges shared, {} of them creases, gap up to {:.1e} mm; {} sides do not meet their neighbours', gap up to {:.5} mm",
        jumps.shared_edges,
        jumps.creases,
        jumps.position_mm,
        jumps.open_sides,
        jumps.border_gap_mm
    );
    if let (Some([x, y, z]), Some(patch)) = (jumps.border_gap_at, jumps.border_gap_patch) {
        out!("    that gap is at patch {patch} at ({x:.3}, {y:.3}, {z:.3})");
    }
}

/// Prints the positions of the largest shape errors.
fn print_worst(worst: &[WorstPatch]) {
    for w in worst.iter().take(3) {
        out!(
            "  patch {} on face {}: {:+.5} mm at ({:.3}, {:.3}, {:.3})",
            w.patch,
            w.face,
            w.delta_mm,
            w.point[0],
            w.point[1],
            w.point[2]
        );
    }
}

fn print_borders(r: &AuditReport) {
    let b = &r.borders;
    if let (Some([x, y, z]), Some(face)) = (b.at, b.face) {
        out!(
            "  free borders: tool up to {:.5} mm from the CAD's, CAD up to {:.5} mm from the tool's, largest at ({x:.3}, {y:.3}, {z:.3}) mm on face {face}; compared every {:.3} mm",
            b.tool_to_cad_mm,
            b.cad_to_tool_mm,
            b.step_mm
        );
    }
}

pub(super) fn file_name(p: &Path) -> String {
    p.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Folder and name without extension, short enough for a table.
pub(super) fn short(p: &Path) -> String {
    let folder = p.parent().and_then(Path::file_name).unwrap_or_default().to_string_lossy();
    let name = file_name(p);
    let name = name.strip_suffix(".tool.json").unwrap_or(&name);
    if folder.is_empty() { name.to_owned() } else { format!("{folder}/{name}") }
}
