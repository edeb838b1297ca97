//! Maps of the convergence of methods:
//! - Newton's method of the paper by starting point; forms of evaluation by degree; Eq. 8 by the normals of an edge
//! - penalty contact by the size of the increments; facets by their number, with the roughness of the force

mod description;
mod edges;
mod evaluation;
mod forming;
mod newton;
mod panel;

use std::path::Path;

pub use self::description::{
    EdgeMap, EvaluationMap, FormatTag, FormingMap, NewtonMap, StabilityStudy,
};

use self::forming::Draw;
use self::panel::Panel;
use super::StudyError;
use kanagata_files::write_atomic;
use kanagata_report::drawing::{Chart, HeatMap, write_chart, write_heat_maps};

/// Drawings of a study; each has a table of the same name (CSV).
pub const DRAWINGS: [&str; 6] =
    ["newton", "edges", "evaluation", "increments", "facets", "roughness"];

/// Computes all maps and writes [`DRAWINGS`] and their tables (CSV) into `folder`. Returns one line of text per panel.
///
/// # Errors
/// [`StudyError::Value`] for values out of range, [`StudyError::Write`].
pub fn run(study: &StabilityStudy, file: &Path, folder: &Path) -> Result<Vec<String>, StudyError> {
    check(study, file)?;
    let mut report = Vec::new();
    let panels = newton::maps(&study.newton);
    maps(folder, "newton", &panels, 0.0..1.0, "share")?;
    report.extend(panels.iter().map(|p| {
        format!(
            "paper's Newton, {}: every start converges in {:.1} % of the cells",
            p.map.title,
            100.0 * p.sound
        )
    }));
    let panels = edges::maps(&study.edges);
    maps(folder, "edges", &panels, -1.0..3.0, "log10")?;
    report.extend(panels.iter().map(|p| {
        format!(
            "{}: |c| < 2 |d| and no turning back in {:.1} % of the cells",
            p.map.title,
            100.0 * p.sound
        )
    }));
    let chart = evaluation::chart(&study.evaluation);
    write_chart(&folder.join("evaluation.svg"), &chart)?;
    write_lines(&folder.join("evaluation.csv"), &chart)?;
    report.extend(chart.lines.iter().map(|l| {
        let last = l.points.last().map_or((0.0, 0.0), |p| *p);
        format!("{}: error {:.1} units of rounding at degree {}", l.name, last.1, last.0)
    }));
    report.extend(forming_charts(&study.forming, folder)?);
    Ok(report)
}

fn forming_charts(plan: &FormingMap, folder: &Path) -> Result<Vec<String>, StudyError> {
    let depth = plan.depth_mm;
    let drawn = forming::by_increments(plan);
    let titles = ["equal increments, no cuts", "increments of the draw", "depth reached [mm]"];
    let chart = forming::chart(titles, &drawn, |d| Some(d.depth));
    let mut report = write_draws(folder, "increments", &chart, depth, &drawn)?;
    let drawn = forming::by_divisions(plan);
    let titles = ["steps as the solver takes them", "patches over 90 degrees", "Newton iterations"];
    let reached = |d: &Draw| d.reached(depth).then_some(d.iterations as f64);
    let chart = forming::chart(titles, &drawn, reached);
    report.extend(write_draws(folder, "facets", &chart, depth, &drawn)?);
    let drawn = forming::by_divisions_finely(plan);
    let titles =
        ["increments of 0.1 mm", "patches over 90 degrees", "roughness of the punch force [%]"];
    let rough = |d: &Draw| d.roughness().filter(|_| d.reached(depth)).map(|r| 100.0 * r);
    let chart = forming::chart(titles, &drawn, rough);
    write_chart(&folder.join("roughness.svg"), &chart)?;
    write_lines(&folder.join("roughness.csv"), &chart)?;
    report.extend(chart.lines.iter().flat_map(|line| {
        line.points
            .iter()
            .map(|(x, y)| format!("{}, {x} over 90 degrees: force rough by {y:.2} %", line.name))
    }));
    Ok(report)
}

/// Writes chart and table of draws; returns one line of text each.
fn write_draws(
    folder: &Path,
    name: &str,
    chart: &Chart,
    depth: f64,
    drawn: &[Draw],
) -> Result<Vec<String>, StudyError> {
    write_chart(&folder.join(format!("{name}.svg")), chart)?;
    write_atomic(&folder.join(format!("{name}.csv")), |w| {
        writeln!(w, "line,x,iterations,depth_mm,force_n")?;
        for d in drawn {
            let line = d.line.replace(',', ";");
            writeln!(w, "{line},{},{},{},{}", d.x, d.iterations, d.depth, d.force)?;
        }
        Ok(())
    })?;
    let say = |d: &Draw| {
        let end = if d.reached(depth) { "in" } else { "not converged after" };
        let (line, x, depth, n) = (&d.line, &chart.x.0, d.depth, d.iterations);
        format!("{line}, {} {x}: {depth:.2} mm, {end} {n} iterations", d.x)
    };
    Ok(drawn.iter().map(say).collect())
}

fn check(study: &StabilityStudy, file: &Path) -> Result<(), StudyError> {
    let fault = |place: &str, found: String, allowed: &str| {
        Err(StudyError::Value {
            path: file.to_path_buf(),
            place: place.into(),
            found,
            allowed: allowed.into(),
        })
    };
    let (n, e) = (&study.newton, &study.evaluation);
    if study.version != 1 {
        return fault("version", study.version.to_string(), "1");
    }
    if let Some(angle) = n.angles_deg.iter().find(|a| !(**a > 0.0 && **a < 180.0)) {
        return fault("newton.angles_deg", angle.to_string(), "above 0 and below 180");
    }
    for (place, count) in [
        ("newton.starts", n.starts),
        ("newton.columns", n.columns),
        ("newton.rows", n.rows),
        ("edges.cells", study.edges.cells),
    ] {
        if !(1..=1000).contains(&count) {
            return fault(place, count.to_string(), "1 to 1000");
        }
    }
    if !(2..=12).contains(&e.highest_degree) {
        return fault("evaluation.highest_degree", e.highest_degree.to_string(), "2 to 12");
    }
    if !(1..=1_000_000).contains(&e.polynomials) {
        return fault("evaluation.polynomials", e.polynomials.to_string(), "1 to 1000000");
    }
    check_forming(&study.forming, &fault)
}

fn check_forming(
    plan: &FormingMap,
    fault: &dyn Fn(&str, String, &str) -> Result<(), StudyError>,
) -> Result<(), StudyError> {
    if !(plan.depth_mm > 0.0 && plan.depth_mm <= forming::DEPTH_MAX_MM) {
        return fault("forming.depth_mm", plan.depth_mm.to_string(), "above 0 and at most 15");
    }
    let positive = |s: f64| s > 0.0 && s.is_finite();
    let mut stiffnesses = plan.methods.iter().filter_map(|m| m.stiffness());
    if let Some(stiffness) = stiffnesses.find(|s| !positive(*s)) {
        return fault("forming.methods", stiffness.to_string(), "stiffnesses above 0");
    }
    for (place, counts, largest) in [
        ("forming.increments", plan.increments.as_slice(), 100_000),
        ("forming.divisions", plan.divisions.as_slice(), 1000),
        ("forming.patches", &[plan.patches], 1000),
    ] {
        if let Some(count) = counts.iter().find(|c| !(1..=largest).contains(*c)) {
            return fault(place, count.to_string(), &format!("1 to {largest}"));
        }
    }
    Ok(())
}

fn maps(
    folder: &Path,
    name: &str,
    panels: &[Panel],
    scale: std::ops::Range<f64>,
    meaning: &str,
) -> Result<(), StudyError> {
    let drawn: Vec<HeatMap> = panels.iter().map(|p| p.map.clone()).collect();
    write_heat_maps(&folder.join(format!("{name}.svg")), &drawn, scale, meaning)?;
    write_atomic(&folder.join(format!("{name}.csv")), |w| {
        writeln!(w, "panel,x,y,value")?;
        for map in &drawn {
            for (k, value) in map.values.iter().enumerate() {
                let (x, y) = middle(map, k);
                writeln!(w, "{},{x},{y},{value}", map.title.replace(',', ";"))?;
            }
        }
        Ok(())
    })?;
    Ok(())
}

/// Middle of cell `k`.
fn middle(map: &HeatMap, k: usize) -> (f64, f64) {
    let rows = (map.values.len() / map.columns) as f64;
    let share = |i: usize, n: f64, r: &std::ops::Range<f64>| {
        r.start + (i as f64 + 0.5) / n * (r.end - r.start)
    };
    (share(k % map.columns, map.columns as f64, &map.x.1), share(k / map.columns, rows, &map.y.1))
}

fn write_lines(path: &Path, chart: &Chart) -> Result<(), StudyError> {
    write_atomic(path, |w| {
        writeln!(w, "line,x,y")?;
        for line in &chart.lines {
            for (x, y) in &line.points {
                writeln!(w, "{},{x},{y}", line.name.replace(',', ";"))?;
            }
        }
        Ok(())
    })?;
    Ok(())
}

#[cfg(test)]
mod tests;
