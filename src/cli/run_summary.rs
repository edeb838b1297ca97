//! Terminal output of a completed run.

use std::path::Path;

use super::terminal::out;
use crate::report::record::RunRecord;

/// Prints cost, state of the sheet and events of a completed run.
pub(super) fn print_record(record: &RunRecord, output: &Path) {
    out!("{}: all stages done", record.name);
    print_cost(record);
    print_sheet(record);
    print_formability(record);
    print_course(record);
    for left in &record.excluded_patches {
        out!("  {} of {} patches of {} excluded", left.patches, left.total, left.tool);
    }
    out!("  {}", output.join("report.html").display());
}

/// Prints increments, iterations, time, memory and errors.
fn print_cost(record: &RunRecord) {
    out!(
        "  {} increments, {} iterations, {} factorisations and {} updates of them, {} step cuts, {} unknowns",
        record.increments,
        record.iterations,
        record.factorisations,
        record.updates,
        record.step_cuts,
        record.unknowns
    );
    out!(
        "  {:.1} s wall, {:.1} s processor on {} threads, {:.0} MB",
        record.wall_s,
        record.cpu_s,
        record.threads,
        record.peak_mb
    );
    for (phase, seconds) in &record.timings_s {
        out!("    {phase:10} {seconds:7.2} s");
    }
    let volume = record.volume_error.map_or(String::new(), |off| format!(", volume {off:.1e}"));
    out!(
        "  relative errors: forces {:.1e}, energy {:.1e}, stored energy {:.1e}{volume}; penetration of nodes up to {:.1e} mm",
        record.force_error,
        record.energy_error,
        record.stored_energy_error,
        record.penetration_mm
    );
    if let Some(error) = &record.increment_error {
        out!(
            "  errors from the length of increments: about {:.1} % of the work, at most {:.1} % of the force (increment {})",
            100.0 * error.of_work,
            100.0 * error.largest,
            error.increment
        );
    }
}

/// Prints thickness, strains and springback.
fn print_sheet(record: &RunRecord) {
    if let Some(thickness) = &record.thickness {
        out!("  minimum thickness {thickness}; maximum {:.4} mm", thickness.maximum_mm);
    }
    if let Some(strain) = &record.strain {
        out!("  strain {strain}");
    }
    if let Some(s) = &record.springback {
        out!(
            "  springback: {:.3} mm maximum, {:.3} mm RMS; released elastic energy {:.0} N mm",
            s.largest_mm,
            s.rms_mm,
            s.energy_nmm
        );
    }
}

/// Prints the formability of the part, and a note where strain paths turned.
fn print_formability(record: &RunRecord) {
    let Some(found) = &record.formability else { return };
    let margin = found.margin.as_ref().map_or_else(
        || "no forming limit in the material card".into(),
        |margin| format!("smallest margin to the forming limit {margin}"),
    );
    out!("  formability: maximum thinning {}; {margin}", found.thinning);
    out!("  area: {}", found.zones);
    let turned = &found.turned_paths;
    if found.margin.is_some() && turned.elements > 0 {
        out!(
            "  note       strain paths of {:.1} % of the area turned by more than {:.0} degrees: the verdict is weaker there, a limit curve holds for straight paths",
            100.0 * turned.share,
            turned.angle_deg
        );
    }
}

/// Prints the events of the run: snap-through, buckling, stabilisation, cycling.
fn print_course(record: &RunRecord) {
    if record.snap_throughs > 0 {
        // A negative value is below the accuracy of the increments.
        let freed = if record.released_elastic_nmm < 0.0 {
            "no measurable energy".into()
        } else {
            format!("{:.1} N mm", record.released_elastic_nmm)
        };
        out!(
            "  {} snap-throughs (or springback past a limit point), released elastic energy: {freed}",
            record.snap_throughs
        );
    }
    if let Some(first) = record.first_buckle {
        out!(
            "  {} bucklings, the first in increment {first}: the sheet left an unstable equilibrium; a symmetric sheet buckles to one of two sides",
            record.buckles
        );
    }
    if record.stabilised_increments > 0 {
        out!(
            "  {} increments needed viscous stabilisation (active-set cycling near a buckling limit); it was removed before they were accepted",
            record.stabilised_increments
        );
    }
    if record.active_set_cycling > 0 {
        out!(
            "  active-set cycling in {} iterations: contact states were changed in smaller blocks",
            record.active_set_cycling
        );
    }
    if let Some(order) = record.convergence_order {
        out!("  Newton converges with order {order:.2} (median over the increments)");
    }
}
