//! `kanagata audit TOOL --cad FILE`.

use std::path::{Path, PathBuf};

use super::cad::read_model;
use super::exit::{EXIT_HELP, Exit, Failure};
use super::quantity::{angle_deg, length_mm};
use crate::audit::{Audit, AuditError, AuditOptions, AuditReport, CadReference, audit, page, view};
use crate::files::sha256_hex;
use crate::tool::file::{ToolFileError, read};

/// Arguments of `audit`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Example:\n  kanagata audit die.tool.json --cad die.igs --tol 0.02 \
    --json die.audit.json --vtu die.audit.vtu --html die.audit.html\n\n{EXIT_HELP}"))]
pub struct AuditArgs {
    /// Tool file
    tool: PathBuf,
    /// The CAD file it was made from
    #[arg(long, value_name = "FILE")]
    cad: PathBuf,
    /// Largest |shape error| allowed [mm]; exit code 1 above it
    #[arg(long, value_name = "LENGTH", value_parser = length_mm)]
    tol: Option<f64>,
    /// Largest normal error allowed [degrees]; exit code 1 above it
    #[arg(long, value_name = "ANGLE", value_parser = angle_deg)]
    normal_tol: Option<f64>,
    /// Intervals of the grid of points along a side of a patch
    #[arg(long, value_name = "N", default_value_t = 8)]
    samples: usize,
    /// Write the figures
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write the patches coloured by their error
    #[arg(long, value_name = "FILE")]
    vtu: Option<PathBuf>,
    /// Write a page with tables, histogram and a 3-D view
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
}

impl From<AuditError> for Failure {
    fn from(error: AuditError) -> Self {
        Self::input(error)
    }
}

impl From<ToolFileError> for Failure {
    fn from(error: ToolFileError) -> Self {
        let exit = if matches!(error, ToolFileError::Io { .. }) { Exit::Io } else { Exit::Input };
        Self::new(exit, error)
    }
}

/// Audits the tool.
///
/// # Errors
/// Exit code 2 for bad input, 4 when files cannot be read or written.
pub fn run(args: &AuditArgs) -> Result<Exit, Failure> {
    let loaded = read(&args.tool)?;
    let model = read_model(&args.cad)?;
    let options = AuditOptions {
        samples: args.samples,
        tolerance_mm: args.tol,
        normal_tolerance_deg: args.normal_tol,
        ..AuditOptions::default()
    };
    let mut found = audit(&loaded.model, &CadReference::new(&model), &options)?;
    name_inputs(&mut found.report, args, loaded.sha256)?;
    if loaded.provenance.cad_sha256 != found.report.cad_sha256 {
        eprintln!(
            "warning: {} was made from another CAD file ({}) than {}",
            args.tool.display(),
            loaded.provenance.cad_file,
            args.cad.display()
        );
    }
    write_outputs(args, &loaded.model, &found)?;
    print_report(&found.report);
    Ok(if found.report.within_tolerance == Some(false) { Exit::Limit } else { Exit::Done })
}

fn name_inputs(report: &mut AuditReport, args: &AuditArgs, sha256: String) -> Result<(), Failure> {
    let name = |p: &Path| p.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let bytes = std::fs::read(&args.cad)
        .map_err(|e| Failure::new(Exit::Io, format!("cannot read {}: {e}", args.cad.display())))?;
    report.tool_file = name(&args.tool);
    report.tool_sha256 = sha256;
    report.cad_file = name(&args.cad);
    report.cad_sha256 = sha256_hex(&bytes);
    Ok(())
}

fn write_outputs(
    args: &AuditArgs,
    tool: &crate::tool::ToolModel,
    found: &Audit,
) -> Result<(), Failure> {
    if let Some(path) = &args.json {
        found.report.write(path)?;
    }
    if let Some(path) = &args.vtu {
        view::grid(tool, &found.samples).write(path)?;
    }
    if let Some(path) = &args.html {
        page::page(tool, found).write(path)?;
    }
    Ok(())
}

fn print_report(r: &AuditReport) {
    println!("{} against {}: {} patches, {} points", r.tool_file, r.cad_file, r.patches, r.points);
    println!(
        "  shape error {:+.5} to {:+.5} mm, rms {:.5} mm; 99 % of the area within {:.5} mm",
        r.min_mm, r.max_mm, r.rms_mm, r.percentiles_mm.p99
    );
    println!(
        "  normal error up to {:.3} deg; across shared edges normals jump by up to {:.3} deg",
        r.normal_max_deg, r.jumps.normal_deg
    );
    if !r.folded.is_empty() {
        println!(
            "  {} patches fold, the first ones {:?}",
            r.folded.len(),
            &r.folded[..r.folded.len().min(8)]
        );
    }
    for w in r.worst.iter().take(3) {
        println!(
            "  patch {} on face {}: {:+.5} mm at ({:.3}, {:.3}, {:.3})",
            w.patch, w.face, w.delta_mm, w.point[0], w.point[1], w.point[2]
        );
    }
    if let Some(tolerance) = r.tolerance_mm {
        let kept = if r.within_tolerance == Some(true) { "within" } else { "ABOVE" };
        println!("  {kept} the {tolerance} mm asked for");
    }
}
