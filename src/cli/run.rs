//! `kanagata-solve run SCENE -o DIR`: the run itself, watched on the terminal.

use std::io::Write as _;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use indicatif::{ProgressBar, ProgressStyle};

use super::exit::{EXIT_HELP, Exit, Failure};
use super::say::out;
use super::stop::stop_flag;
use crate::report::record::RunRecord;
use crate::run::folder::row;
use crate::run::line::{HEADER, json_line, line};
use crate::run::{Progress, RunError, RunOptions};
use crate::scene::{SceneError, read};
use crate::solver::SimulationError;

/// Arguments of `run`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Example:\n  kanagata-solve run fixtures/cross/demo.scene.json -o out/demo\n\n\
    `kanagata-solve status DIR` says how it stands.\n\
    The folder then holds history.csv, run.json, run.pvd, steps/*.vtu, tools/*.vtu and report.html.\n\n{EXIT_HELP}"))]
pub struct RunArgs {
    /// Scene file
    scene: PathBuf,
    /// Folder for the results; made if missing
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Go on from the checkpoint in DIR, to the same results as without the break
    #[arg(long)]
    restart: bool,
    /// Leave out what loses no accuracy (patches of tools that the sheet cannot come near); run.json says what
    #[arg(long)]
    auto: bool,
    /// Stop, leaving a checkpoint, when standard input ends: the run does not outlive the program that started it
    #[arg(long)]
    tied: bool,
    /// No progress bar
    #[arg(short, long)]
    quiet: bool,
    /// A line an increment in place of the bar
    #[arg(long, conflicts_with_all = ["quiet", "json"])]
    lines: bool,
    /// A line of JSON an increment in place of the bar, and run.json in one line at the end
    #[arg(long, conflicts_with = "quiet")]
    json: bool,
}

impl From<RunError> for Failure {
    fn from(error: RunError) -> Self {
        let exit = match &error {
            RunError::Scene(SceneError::Io { .. })
            | RunError::Write(_)
            | RunError::Busy { .. }
            | RunError::Folder { .. } => Exit::Io,
            RunError::Scene(_) | RunError::Checkpoint(_) => Exit::Input,
            RunError::Solver { cause, .. } => match **cause {
                SimulationError::Setup(_) | SimulationError::NoTouch { .. } => Exit::Input,
                SimulationError::Stopped { .. } => Exit::Stopped,
                _ => Exit::NoConvergence,
            },
            RunError::LeftOut { .. } => Exit::NoConvergence,
        };
        Self::new(exit, error)
    }
}

/// Runs the scene.
///
/// # Errors
/// Exit code 2 for a scene that cannot be run, 3 when the solver gives up, 4 when files cannot be read or written.
pub fn run(args: &RunArgs) -> Result<Exit, Failure> {
    let plan = read(&args.scene)?;
    let by_line = args.lines || args.json;
    let bar = progress_bar(args.quiet || by_line);
    let stop = stop_flag();
    if args.tied {
        stop_with_input(Arc::clone(&stop));
    }
    let options = RunOptions { restart: args.restart, auto: args.auto, stop: Some(&stop) };
    if args.lines {
        out!("{HEADER}");
    }
    let tools: Vec<String> = plan.scene.tools.iter().map(|t| t.name.clone()).collect();
    let outcome =
        crate::run::run(&plan, &args.scene, &args.output, &options, &mut |progress| match (
            args.lines, args.json,
        ) {
            (false, false) => show(&bar, progress),
            _ if progress.report.increment == 0 => {}
            (true, _) => print_line(&line(&tools, &row(progress.report))),
            (_, true) => print_line(&json_line(&tools, &row(progress.report))),
        });
    bar.finish_and_clear();
    let record = outcome?;
    if args.json {
        print_line(&serde_json::to_string(&record).map_err(Failure::input)?);
    } else if !args.quiet {
        print_record(&record, &args.output);
    }
    Ok(Exit::Done)
}

/// Sets `stop` when standard input ends.
fn stop_with_input(stop: Arc<AtomicBool>) {
    std::thread::spawn(move || {
        // Input that cannot be read has ended too.
        let _ = std::io::copy(&mut std::io::stdin().lock(), &mut std::io::sink());
        stop.store(true, Ordering::Relaxed);
    });
}

/// Prints a line at once; who no longer listens does not end the run.
fn print_line(line: &str) {
    let mut out = std::io::stdout().lock();
    let _ = writeln!(out, "{line}").and_then(|()| out.flush());
}

const RESOLUTION: u64 = 10_000;

fn progress_bar(quiet: bool) -> ProgressBar {
    if quiet {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(RESOLUTION);
    let style = ProgressStyle::with_template("{bar:24} {percent:>3} %  {msg}");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar
}

fn show(bar: &ProgressBar, progress: &Progress<'_>) {
    let r = progress.report;
    // The tool that moves or pushes most is the one to watch.
    let watched = r.tools.iter().max_by(|a, b| a.travel.abs().total_cmp(&b.travel.abs()));
    let tool = watched.map_or_else(String::new, |t| {
        format!("{} {:.2} mm {:.1} kN", t.name, t.travel, t.force / 1e3)
    });
    let left = if progress.done > 0.01 {
        let seconds = progress.elapsed_s * (1.0 - progress.done) / progress.done;
        format!("{:.0}:{:02.0} left", (seconds / 60.0).floor(), seconds % 60.0)
    } else {
        String::new()
    };
    bar.set_position((progress.done * RESOLUTION as f64) as u64);
    bar.set_message(format!(
        "{} #{} {tool}, {} iterations, {} touch {} slip  {left}",
        r.stage_name, r.increment, r.iterations, r.contacts, r.slipping
    ));
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
            "  WARNING: {} increments, the first of them {first}, ended in a balance that does not last: given a push the sheet buckles or wrinkles there. Shorter steps led to no other: a model as symmetric as its loads does not buckle by itself. To follow it, disturb the model (a small load, a blank mesh that is not quite flat)",
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
    if record.energy_balance > OPEN {
        out!(
            "  WARNING: {:.1} % of the work is not accounted for: increments are too long for what happens in them (contact that closes in one step, a sheet that jumps); a smaller largest_increment sees more",
            100.0 * record.energy_balance
        );
    }
}

fn print_record(record: &RunRecord, output: &std::path::Path) {
    out!("{}: all stages done", record.name);
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
    print_doubts(record);
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
    if record.snaps > 0 {
        out!(
            "  the sheet moved on by itself {} times (snapped, or sprang back): {:.1} N mm set free",
            record.snaps,
            record.snap_work_nmm
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
    for left in &record.left_out {
        out!("  {} of {} patches of {} left out", left.patches, left.of, left.tool);
    }
    out!("  {}", output.join("report.html").display());
}
