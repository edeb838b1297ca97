//! `kanagata audit TOOL... --against TOOL`: clearance between tools.

use std::path::{Path, PathBuf};

use super::args::AuditArgs;
use super::json::write_json;
use super::print::{file_name, short};
use crate::audit::clearance::{ClearanceOptions, ClearanceReport, clearance};
use crate::cli::exit::{Exit, Failure};
use crate::cli::terminal::out;
use crate::contact::ToolSurface;
use crate::geometry::Vec3;
use crate::tool::file::read;

/// Audits the clearance of the tools to another one.
pub(super) fn clearances(
    args: &AuditArgs,
    against: &Path,
    thickness_mm: f64,
) -> Result<Vec<Exit>, Failure> {
    let die = ToolSurface::new(read(against)?.model);
    if args.tools.len() > 1 {
        let (clearance, pinch, below) = ("clearance [mm]", "pinch %", "below %");
        out!("{:32} {:>8} {clearance:>14} {pinch:>9} {below:>11}", "tool", "patches");
    }
    let each = |tool: &PathBuf| cleared(args, tool, &die, thickness_mm);
    let found = args.tools.iter().map(each).collect::<Result<Vec<_>, _>>()?;
    let (reports, exits): (Vec<_>, Vec<_>) = found.into_iter().unzip();
    write_json(args, &reports)?;
    Ok(exits)
}

/// Audits the clearance of one tool.
fn cleared(
    args: &AuditArgs,
    tool: &Path,
    against: &ToolSurface,
    thickness_mm: f64,
) -> Result<(ClearanceReport, Exit), Failure> {
    let loaded = read(tool)?;
    let options = ClearanceOptions {
        travel: args.travel.unwrap_or_else(Vec3::zeros),
        thickness_mm,
        samples: args.samples.max(2),
        refine: 256,
        nearest: 10,
    };
    let mut r = clearance(&loaded.model, against, &options);
    r.tool_file = file_name(tool);
    r.against_file = args.against.as_deref().map_or_else(String::new, file_name);
    let Some(min) = r.min_mm else {
        write_json(args, &[&r])?;
        return Err(Failure::input(format!(
            "{}: no point faces {} at the end of the travel; check --travel and the tools' sides",
            tool.display(),
            r.against_file
        )));
    };
    let [pinch, below] = [100.0 * r.pinch, 100.0 * r.share_below];
    if args.tools.len() > 1 {
        out!(
            "{:32} {:>8} {min:>14.5} {pinch:>9.2} {below:>11.3}",
            short(tool),
            loaded.model.patches.len()
        );
    } else {
        print_clearance(&r, min);
    }
    let exit = if r.pinch > args.pinch { Exit::Limit } else { Exit::Done };
    Ok((r, exit))
}

fn print_clearance(r: &ClearanceReport, min: f64) {
    out!("{} against {} after {:?} mm", r.tool_file, r.against_file, r.travel_mm);
    out!(
        "  least clearance {min:.5} mm, {:.2} % below the {} mm asked for",
        100.0 * r.pinch,
        r.thickness_mm
    );
    out!(
        "  {:.3} % of the {:.1} mm2 that face each other have less",
        100.0 * r.share_below,
        r.facing_mm2
    );
    for n in r.nearest.iter().take(3) {
        let [x, y, z] = n.point;
        out!(
            "  patch {} on face {}: {:.5} mm to patch {} at ({x:.3}, {y:.3}, {z:.3})",
            n.patch,
            n.face,
            n.clearance_mm,
            n.against
        );
    }
}
