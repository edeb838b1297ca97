//! What the terminal says of a run that has come to its end.

use std::path::Path;

use super::say::out;
use crate::report::record::RunRecord;

/// Prints what the run was, what of it is not as it should be, and what became of the sheet.
pub(super) fn print_record(record: &RunRecord, output: &Path) {
    out!("{}: all stages done", record.name);
    print_cost(record);
    print_doubts(record);
    print_sheet(record);
    print_course(record);
    for left in &record.left_out {
        out!("  {} of {} patches of {} left out", left.patches, left.of, left.tool);
    }
    out!("  {}", output.join("report.html").display());
}

/// Increments, iterations, time, memory and how well all balances.
fn print_cost(record: &RunRecord) {
    out!(
        "  {} increments, {} iterations, {} factorisations and {} updates of them, {} cuts, {} unknowns",
        record.increments,
        record.iterations,
        record.factorisations,
        record.updates,
        record.cuts,
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
    let volume =
        record.volume_balance.map_or(String::new(), |off| format!(", volume to {off:.1e}"));
    out!(
        "  forces balance to {:.1e}, energy to {:.1e}, what is stored of it to {:.1e}{volume}, penetration at most {:.1e} mm",
        record.force_balance,
        record.energy_balance,
        record.stored_balance,
        record.penetration_mm
    );
}

/// What of a run that came to its end is not as it should be.
fn print_doubts(record: &RunRecord) {
    /// Share of the thickness that a node may lie in a tool, and of the work that energy may lack.
    const DEEP: f64 = 0.05;
    const OPEN: f64 = 0.01;
    let thickness = record.thickness.as_ref().map_or(f64::INFINITY, |t| t.most_mm);
    if record.penetration_mm > DEEP * thickness {
        out!(
            "  WARNING: nodes lie up to {:.3} mm in a tool, as another tool holds them, of two tools at one node only one is seen (a corner made of two files, a tool that pushes on an edge between two others), or as the springs of `solver.contact` are soft",
            record.penetration_mm
        );
    }
    if let Some(first) = record.first_unstable {
        out!(
            "  WARNING: {} increments, the first of them {first}, ended in a balance that does not last: the sheet buckles or wrinkles there, and neither shorter steps nor a push along the motion in which it gives way led to another balance. To follow it, try a smaller largest_increment, a finer mesh or a small load across",
            record.unstable
        );
    }
    for doubt in &record.doubts {
        out!("  WARNING: {doubt}");
    }
    if let Some(through) = &record.through_itself {
        let [x, y, z] = through.at_mm;
        out!(
            "  WARNING: the sheet passes through itself from increment {} on, up to {} nodes, first at ({x:.1}, {y:.1}, {z:.1}) mm: nothing keeps it from that, and forces are too low from there on",
            through.first_increment,
            through.nodes
        );
    }
    if let Some(edge) = &record.over_edge {
        let [x, y, z] = edge.at_mm;
        out!(
            "  WARNING: the sheet bends over the border of {} from increment {} on, up to {} nodes, first at ({x:.1}, {y:.1}, {z:.1}) mm, {:.2} mm deep: tools hold nodes and see nothing between them, so that forces there go by the mesh, and a node drawn back over the border may lock the sheet. Give the tool its edge radius, or let it end beyond the sheet",
            edge.tool,
            edge.first_increment,
            edge.nodes,
            edge.depth_mm
        );
    }
    if record.energy_balance > OPEN {
        out!(
            "  WARNING: {:.1} % of the work is not accounted for: increments are too long for what happens in them (contact that closes in one step, a sheet that jumps); a smaller largest_increment sees more",
            100.0 * record.energy_balance
        );
    }
}

/// Thickness, strains and springback.
fn print_sheet(record: &RunRecord) {
    if let Some(thickness) = &record.thickness {
        out!("  thickness {thickness}, {:.4} mm at most", thickness.most_mm);
    }
    if let Some(strain) = &record.strain {
        out!("  strain {strain}");
    }
    if let Some(s) = &record.springback {
        out!(
            "  springback: {:.3} mm at most, {:.3} mm RMS; {:.0} N mm of elastic energy given back",
            s.largest_mm,
            s.rms_mm,
            s.energy_nmm
        );
    }
}

/// What happened on the way.
fn print_course(record: &RunRecord) {
    if record.snaps > 0 {
        out!(
            "  the sheet moved on by itself {} times (snapped, or sprang back): {:.1} N mm set free",
            record.snaps,
            record.snap_work_nmm
        );
    }
    if let Some(first) = record.first_buckle {
        out!(
            "  the sheet buckled {} times, first in increment {first}: pushed out of a balance that does not last, to one of two sides where it is symmetric",
            record.buckles
        );
    }
    if record.steadied > 0 {
        out!(
            "  {} increments had no balance next to the last iterate (a sheet about to buckle between its tools): dampers led to one, and were taken away",
            record.steadied
        );
    }
    if record.cycling > 0 {
        out!(
            "  contact states went back and forth {} times and were changed in part",
            record.cycling
        );
    }
    if let Some(order) = record.convergence_order {
        out!("  Newton converges with order {order:.2} (median over the increments)");
    }
}
