//! Diagnostics of the solver in `report.html`: cost, accuracy, stability, faults, and time of the phases.

use kanagata_report::digits::four_digits;
use kanagata_report::page::Page;
use kanagata_report::record::{OverhangRecord, RunRecord};

/// A quantity and its value as text.
type Row = (&'static str, String);

/// Writes the figures and the wall time of the phases.
pub(super) fn tables(page: &mut Page, record: &RunRecord) {
    let groups = [
        course(record),
        errors(record),
        stability(record),
        sheet_faults(record),
        contact_faults(record),
    ];
    let rows: Vec<Vec<String>> =
        groups.into_iter().flatten().map(|(a, b)| vec![a.to_owned(), b]).collect();
    page.table(&["", ""], &rows);
    let timings: Vec<Vec<String>> =
        record.timings_s.iter().map(|(k, v)| vec![k.clone(), format!("{v:.2}")]).collect();
    page.table(&["phase", "wall time [s]"], &timings);
}

/// Outcome and cost.
fn course(r: &RunRecord) -> Vec<Row> {
    vec![
        ("verdict", r.verdict.to_string()),
        (
            "increments, iterations, step cuts",
            format!("{}, {}, {}", r.increments, r.iterations, r.step_cuts),
        ),
        ("unknowns", r.unknowns.to_string()),
        ("wall time, processor time", format!("{:.1} s, {:.1} s", r.wall_s, r.cpu_s)),
        ("peak memory", format!("{:.0} MB", r.peak_mb)),
    ]
}

/// Errors of equilibrium, energy and volume.
fn errors(r: &RunRecord) -> Vec<Row> {
    let volume = r.volume_error.map_or("-".into(), |off| format!("{off:.1e} of the sheet's"));
    vec![
        ("force residual", format!("{:.1e} of the largest", r.force_error)),
        ("unaccounted energy", format!("{:.2e} of the work done", r.energy_error)),
        ("internal work not stored", format!("{:.2e} of the work done", r.stored_energy_error)),
        ("forces, from the length of increments", increments(r)),
        ("artificial (hourglass) energy", format!("{} N mm", four_digits(r.artificial_energy_nmm))),
        ("volume error", volume),
    ]
}

/// Estimated error from the length of the increments.
fn increments(r: &RunRecord) -> String {
    r.increment_error.map_or("-".into(), |e| {
        format!(
            "about {:.1} % of the work, {:.1} % of the force in increment {}",
            100.0 * e.of_work,
            100.0 * e.largest,
            e.increment
        )
    })
}

fn stability(r: &RunRecord) -> Vec<Row> {
    let unstable = r.first_unstable.map_or("none".into(), |first| {
        format!("{}, first increment {first}", r.unstable_increments)
    });
    let buckled = r
        .first_buckle
        .map_or("no".into(), |first| format!("{} times, first increment {first}", r.buckles));
    vec![
        (
            "snap-throughs, released elastic energy",
            format!("{}, {:.1} N mm", r.snap_throughs, r.released_elastic_nmm),
        ),
        ("increments with viscous stabilisation", r.stabilised_increments.to_string()),
        ("increments in unstable equilibrium", unstable),
        ("bucklings", buckled),
    ]
}

/// Phenomena that the model does not resolve: self-contact, hourglass modes, through-thickness shear.
fn sheet_faults(r: &RunRecord) -> Vec<Row> {
    let through = r.self_penetration.map_or("no".into(), |t| {
        format!("from increment {} on, up to {} nodes", t.first_increment, t.nodes)
    });
    let hourglass = r.hourglass.map_or("no".into(), |z| {
        format!(
            "{:.0} %, from increment {} on: forces are too low",
            100.0 * z.fraction,
            z.first_increment
        )
    });
    let sheared = r.through_thickness_shear.map_or("no".into(), |s| {
        format!(
            "from increment {} on, up to {:.0} % of the nodes pressed so",
            s.first_increment,
            100.0 * s.fraction
        )
    });
    vec![
        ("self-penetration", through),
        ("hourglass mode", hourglass),
        ("through-thickness shear at the friction limit", sheared),
    ]
}

/// Penetrations, and overhang at tool edges.
fn contact_faults(r: &RunRecord) -> Vec<Row> {
    let overhang = r.overhang.as_ref().map_or("no".into(), |edge| {
        let OverhangRecord { tool, first_increment, nodes, depth_mm, .. } = edge;
        format!("{tool}, from increment {first_increment} on, up to {nodes} nodes, {depth_mm:.2} mm deep")
    });
    let in_tool = r.inside_tool.as_ref().map_or("no".into(), |found| {
        format!("{}, by {:.3} mm at the end of {}", found.tool, found.depth_mm, found.stage)
    });
    let on_faces = r.face_penetration.as_ref().map_or("none".into(), |found| {
        format!(
            "{:.3} mm ({:.0} % of the thickness), {}, increment {}",
            found.depth_mm,
            100.0 * found.depth_rel,
            found.tool,
            found.increment
        )
    });
    vec![
        ("overhang at a tool edge", overhang),
        ("nodes inside a tool at the end of a stage", in_tool),
        ("largest penetration of a node", format!("{:.1e} mm", r.penetration_mm)),
        ("largest penetration of a face between nodes", on_faces),
    ]
}
