//! `kanagata-solve check SCENE`: findings and cost before a run.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::doubts::options;
use super::exit::{EXIT_HELP, Exit, Failure};
use super::paths::input_path;
use super::remedy::remedy;
use super::terminal::{out, out_json};
use crate::report::digits::four_digits;
use crate::report::doubt::DoubtCode;
use crate::run::advice::holder::{Holder, holders};
use crate::run::advice::{Finding, Level, advice, sort};
use crate::run::cost::{Cost, estimate, measure};
use crate::run::resources::memory_limit_megabytes;
use crate::scene::large_sheet::LargeSheet;
use crate::scene::preview::SheetCounts;
use crate::scene::read::{read_for_check, read_with};
use crate::scene::set_value::SetValue;
use crate::scene::types::{BlankShape, Course, Drive};
use crate::scene::{Plan, SceneError};
use crate::solver::SimulationSetup;
use crate::solver::reach::exclude_unreachable;

/// Arguments of `check`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Examples:\n  kanagata-solve check fixtures/dome/dome.scene.json\n  kanagata-solve check fixtures/dome/dome.scene.json --json --measure\n\n\
    Findings have a level: error (run refuses the scene, exit code 2), doubt (a run ends and its result must not be trusted as it\n\
    is, exit code 1; docs/reference/doubts.md), note (a choice that costs accuracy or time). They are sorted by level and effect.\n\n{EXIT_HELP}"))]
pub struct CheckArgs {
    /// Scene file; - for standard input, with the files it names relative to the current folder
    #[arg(value_parser = input_path)]
    scene: PathBuf,
    /// Set a value of the scene, as for `run`
    #[arg(long, value_name = "PATH=VALUE")]
    set: Vec<SetValue>,
    /// Print JSON
    #[arg(long)]
    json: bool,
    /// Time an element loop and a factorisation on this machine for the cost, instead of estimating them from counts
    #[arg(long)]
    measure: bool,
    /// Read a large mesh file of the blank too, however long that takes
    #[arg(long)]
    whole: bool,
    /// End with exit code 0 instead of 1 when there are doubts
    #[arg(long)]
    accept_doubts: bool,
    /// Also list what `run --auto` excludes
    #[arg(long)]
    auto: bool,
}

impl From<SceneError> for Failure {
    fn from(error: SceneError) -> Self {
        let exit = if matches!(error, SceneError::Io { .. }) { Exit::Io } else { Exit::Input };
        Self::new(exit, error)
    }
}

/// Output of `check --json`.
#[derive(Serialize)]
struct Output<'a> {
    format: &'static str,
    version: u32,
    scene: &'a str,
    name: &'a str,
    elements: usize,
    nodes: usize,
    cost: &'a Cost,
    holders: Vec<Pressure<'a>>,
    findings: &'a [Finding],
}

/// Mean pressure of a blank holder.
#[derive(Serialize)]
struct Pressure<'a> {
    tool: &'a str,
    force_n: f64,
    clamped_mm2: f64,
    pressure_mpa: f64,
}

/// Checks the scene: what would run, its cost, and its findings. A large sheet is checked with a coarser mesh of the
/// same outline and its cost estimated from counts, so that the check remains quick.
///
/// # Errors
/// Exit code 2 for a scene that cannot be run, 4 when the scene cannot be read. Doubts (exit code 1) are not an error.
pub fn run(args: &CheckArgs) -> Result<Exit, Failure> {
    let (plan, large) = if args.whole || args.measure {
        (read_with(&args.scene, &args.set)?, None)
    } else {
        read_for_check(&args.scene, &args.set)?
    };
    let mut check = match &large {
        Some(large) => check_unread_sheet(&plan, &args.scene, large)?,
        None => check_sheet(&plan, args)?,
    };
    check.findings.extend(memory(&check.cost));
    sort(&mut check.findings);
    let output = Output {
        format: "kanagata-check",
        version: 1,
        scene: &args.scene.to_string_lossy(),
        name: &plan.scene.name,
        elements: check.sheet.elements,
        nodes: check.sheet.nodes,
        cost: &check.cost,
        holders: check.placed.as_ref().map_or_else(Vec::new, |setup| pressures(&plan, setup)),
        findings: &check.findings,
    };
    if args.json {
        out_json!("{}", serde_json::to_string_pretty(&output).map_err(Failure::input)?);
    } else {
        print_output(&plan, &check, &output);
    }
    if let Some(mut setup) = check.placed.filter(|_| args.auto && !args.json) {
        print_excluded(&plan, &mut setup)?;
    }
    Ok(exit(&check.findings, args.accept_doubts))
}

/// Prints the check of a scene before it is run.
///
/// # Errors
/// As [`run`].
pub(super) fn print(scene: &Path, set: &[SetValue]) -> Result<Exit, Failure> {
    run(&CheckArgs {
        scene: scene.into(),
        set: set.to_vec(),
        json: false,
        measure: false,
        whole: false,
        accept_doubts: true,
        auto: false,
    })
}

/// Mean pressures of the blank holders.
fn pressures<'a>(plan: &'a Plan, setup: &SimulationSetup) -> Vec<Pressure<'a>> {
    let share = plan.symmetry_factor();
    let pressure = |holder: &Holder| Pressure {
        tool: &plan.scene.tools[holder.tool].name,
        force_n: holder.force * share,
        clamped_mm2: holder.clamped * share,
        pressure_mpa: holder.pressure(),
    };
    let holders = holders(setup);
    holders.iter().filter(|holder| holder.clamped > 0.0).map(pressure).collect()
}

/// Result of a check.
struct Check {
    sheet: SheetCounts,
    cost: Cost,
    /// Nodal forces, three per node [N].
    loads: Vec<f64>,
    /// The set-up, if its tools could be placed.
    placed: Option<SimulationSetup>,
    findings: Vec<Finding>,
}

/// Checks the scene with its sheet; a large sheet is replaced by a coarser mesh of the same outline.
fn check_sheet(plan: &Plan, args: &CheckArgs) -> Result<Check, Failure> {
    let (check, ratio) = plan.coarsened().unwrap_or_else(|| (plan.clone(), 1.0));
    let mut setup = check.simulation_setup(&args.scene)?;
    let placed = setup.place();
    let sheet = SheetCounts::of_blank(&plan.scene.blank)
        .unwrap_or_else(|| SheetCounts::of_mesh(setup.body.mesh()));
    let cost = if args.measure {
        measure(&mut plan.simulation_setup(&args.scene)?).map_err(Failure::input)?
    } else {
        estimate(&setup, &sheet)
    };
    let findings = match &placed {
        Ok(()) => advice(&check, &setup, ratio, &cost),
        Err(error) => {
            let remedy = remedy(error).map_or_else(String::new, |text| format!("Try {text}."));
            vec![Finding::error("tools".into(), error.to_string(), remedy)]
        }
    };
    let loads = setup.loads.clone();
    Ok(Check { sheet, cost, loads, placed: placed.is_ok().then_some(setup), findings })
}

/// Estimates the cost of a sheet from the size of its unread file, and raises a doubt.
fn check_unread_sheet(plan: &Plan, scene: &Path, large: &LargeSheet) -> Result<Check, Failure> {
    let setup = plan.one_element(scene)?;
    let megabytes = large.bytes as f64 / 1e6;
    let found = format!(
        "{} has {megabytes:.0} MB and was not opened: tools, constraints and stages were not compared with the sheet, and its counts are estimated from its size.",
        large.path.display()
    );
    let remedy = "Examine it with `check --whole`, or use a coarser mesh.";
    let place = "blank.shape.mesh.file".into();
    let doubt = Finding::doubt(DoubtCode::SheetNotExamined, place, found, remedy.into());
    Ok(Check {
        sheet: large.counts,
        cost: estimate(&setup, &large.counts),
        loads: Vec::new(),
        placed: None,
        findings: vec![doubt],
    })
}

/// Exit code of the most severe finding.
fn exit(findings: &[Finding], accepted: bool) -> Exit {
    match findings.first().map(|worst| worst.level) {
        Some(Level::Error) => Exit::Input,
        Some(Level::Doubt) if !accepted => Exit::Limit,
        _ => Exit::Done,
    }
}

/// A note if the run needs more memory than available.
fn memory(cost: &Cost) -> Option<Finding> {
    let available = memory_limit_megabytes()?;
    (cost.memory_mb > available).then(|| {
        Finding::note(
            format!(
                "about {:.0} MB are needed, and {available:.0} MB are available",
                cost.memory_mb
            ),
            "use fewer elements or layers, symmetry planes, or a larger machine".into(),
        )
        .effect(1.0)
    })
}

fn print_output(plan: &Plan, check: &Check, output: &Output<'_>) {
    let scene = &plan.scene;
    out!("{}: {}", output.scene, scene.name);
    out!(
        "  blank      {}, {} mm thick, {} elements in {} layers, {} nodes",
        outline(&scene.blank.shape),
        scene.blank.thickness_mm,
        output.elements,
        scene.blank.layers,
        output.nodes
    );
    out!("  material   {}", plan.card.name);
    for (tool, loaded) in scene.tools.iter().zip(&plan.tools) {
        let error =
            loaded.shape_error_mm.map_or_else(String::new, |e| format!(", shape error {e:.4} mm"));
        out!(
            "  tool       {}: {} patches{error}, friction {}",
            tool.name,
            loaded.surface.model().patches.len(),
            tool.friction.map_or("not given".into(), |mu| mu.to_string())
        );
    }
    print_loads(plan, &check.loads);
    print_stages(plan);
    for holder in &output.holders {
        out!(
            "  pressure   {} {:.2} MPa ({} N on {:.0} mm2)",
            holder.tool,
            holder.pressure_mpa,
            four_digits(holder.force_n),
            holder.clamped_mm2
        );
    }
    print_cost(output.cost);
    for finding in output.findings {
        out!("  {:10} {finding}{}", finding.level, options(finding));
    }
}

fn print_excluded(plan: &Plan, setup: &mut SimulationSetup) -> Result<(), Failure> {
    let (excluded, _) = exclude_unreachable(setup).map_err(Failure::input)?;
    for left in &excluded {
        let tool = &plan.scene.tools[left.tool].name;
        out!("  auto       excludes {} of {} patches of {tool}", left.patches, left.of);
    }
    if excluded.is_empty() {
        out!("  auto       excludes nothing");
    }
    Ok(())
}

fn outline(shape: &BlankShape) -> String {
    match shape {
        BlankShape::Rectangle { size_mm: [x, y], .. } => format!("{x} x {y} mm"),
        BlankShape::QuarterDisc { radius_mm, .. } => format!("quarter disc, radius {radius_mm} mm"),
        BlankShape::Disc { radius_mm, .. } => format!("disc, radius {radius_mm} mm"),
        BlankShape::Mesh { file, .. } => file.clone(),
    }
}

/// Prints the loads; `on_nodes`: nodal forces on the modelled part (three per node) [N].
fn print_loads(plan: &Plan, on_nodes: &[f64]) {
    let nodes = on_nodes.chunks_exact(3).filter(|force| force.iter().any(|f| *f != 0.0)).count();
    let share = plan.symmetry_factor();
    let of = |force: [f64; 3]| {
        let text_of = |[x, y, z]: [f64; 3]| format!("({x}, {y}, {z}) N");
        let [x, y, z] = force.map(|f| four_digits(f / share));
        if share == 1.0 {
            text_of(force)
        } else {
            format!("{} (({x}, {y}, {z}) N on the modelled part)", text_of(force))
        }
    };
    let forces: Vec<String> = plan.scene.loads.iter().map(|load| of(load.force_n)).collect();
    if !forces.is_empty() {
        out!("  loads      {} on {nodes} nodes in all", forces.join(", "));
    }
}

fn print_stages(plan: &Plan) {
    let share = plan.symmetry_factor();
    for stage in &plan.scene.stages {
        let drives: Vec<String> = stage
            .drive
            .iter()
            .map(|(tool, drive)| match drive {
                Drive::TravelMm(to) => format!("{tool} to {to} mm"),
                Drive::AdvanceMm(by) => format!("{tool} by {by} mm"),
                Drive::ForceN(n @ Course::End(end)) => {
                    let part = four_digits(end / share);
                    format!("{tool} {n} N ({part} N on the modelled part)")
                }
                Drive::ForceN(n) => format!("{tool} {n} N"),
                Drive::Spring(s) => format!(
                    "{tool} held by a spring of {} N/mm, {} N at travel zero",
                    s.stiffness_n_per_mm, s.force_n
                ),
                Drive::Release(_) => format!("{tool} released"),
                Drive::Absent(_) => format!("{tool} away"),
            })
            .chain(
                stage.load_share.map(|share| format!("loads to {} %", four_digits(100.0 * share))),
            )
            .collect();
        let drives = if drives.is_empty() {
            "tools keep their travel or their force".into()
        } else {
            drives.join(", ")
        };
        out!("  stage      {}: {drives}", stage.name);
    }
}

fn print_cost(cost: &Cost) {
    out!("  unknowns   {}", cost.unknowns);
    out!(
        "  memory     about {:.0} MB, {:.0} MB of them factors and workspace",
        cost.memory_mb,
        cost.factors_mb
    );
    out!(
        "  {:10} an element loop {:.3} s, a factorisation {:.3} s ({:.2} Gflop), on {} threads",
        if cost.measured { "measured" } else { "estimated" },
        cost.elements_s,
        cost.factor_s,
        cost.flop / 1e9,
        rayon::current_num_threads()
    );
    out!(
        "  expected   {:.0} to {:.0} increments, {:.0} to {:.0} iterations, {}",
        cost.increments[0],
        cost.increments[1],
        cost.iterations[0],
        cost.iterations[1],
        cost.times(1.0)
    );
}
