//! `kanagata-solve check SCENE`: what would be run.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::doubts::options;
use super::exit::{EXIT_HELP, Exit, Failure};
use super::remedy::remedy;
use super::say::{out, out_json};
use crate::report::doubt::DoubtCode;
use crate::run::advice::holder::{Holder, holders};
use crate::run::advice::{Finding, Level, advice, sort};
use crate::run::cost::{Cost, estimate, measure};
use crate::run::resources::memory_limit_megabytes;
use crate::scene::large_sheet::LargeSheet;
use crate::scene::preview::SheetCounts;
use crate::scene::read::read_for_check;
use crate::scene::types::{BlankShape, Course, Drive};
use crate::scene::{Plan, SceneError, read};
use crate::solver::SimulationSetup;
use crate::solver::reach::{exclude_unreachable, reachable};

/// Arguments of `check`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Examples:\n  kanagata-solve check fixtures/dome/dome.scene.json\n  kanagata-solve check fixtures/dome/dome.scene.json --json --measure\n\n\
    Findings have a level: error (run refuses the scene, exit code 2), doubt (a run ends and its result must not be trusted as it\n\
    is, exit code 1; docs/reference/doubts.md), note (a choice that costs accuracy or time). They are sorted by level and effect.\n\n{EXIT_HELP}"))]
pub struct CheckArgs {
    /// Scene file
    scene: PathBuf,
    /// Print JSON
    #[arg(long)]
    json: bool,
    /// Time an element loop and a factorisation on this machine for the cost, in place of an estimate from counts
    #[arg(long)]
    measure: bool,
    /// Examine a large mesh file of the blank as well, however long that takes
    #[arg(long)]
    whole: bool,
    /// End with exit code 0 in place of 1 when there are doubts
    #[arg(long)]
    accept_doubts: bool,
    /// Also say what `run --auto` leaves out
    #[arg(long)]
    auto: bool,
}

impl From<SceneError> for Failure {
    fn from(error: SceneError) -> Self {
        let exit = if matches!(error, SceneError::Io { .. }) { Exit::Io } else { Exit::Input };
        Self::new(exit, error)
    }
}

/// What `check` finds.
#[derive(Serialize)]
struct Judgement<'a> {
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

/// Judges the scene: what would be run, what it would cost, what is wrong or doubtful. A large sheet is judged on a coarser one of
/// the same outline, and its cost by counts, so that nothing is built before the judgement.
///
/// # Errors
/// Exit code 2 for a scene that cannot be run, 4 when the scene cannot be read; 1 with doubts is no error.
pub fn run(args: &CheckArgs) -> Result<Exit, Failure> {
    let (plan, large) = if args.whole || args.measure {
        (read(&args.scene)?, None)
    } else {
        read_for_check(&args.scene)?
    };
    let mut judged = match &large {
        Some(large) => not_examined(&plan, &args.scene, large)?,
        None => examined(&plan, args)?,
    };
    judged.findings.extend(memory(&judged.cost));
    sort(&mut judged.findings);
    let judgement = Judgement {
        format: "kanagata-check",
        version: 1,
        scene: &args.scene.to_string_lossy(),
        name: &plan.scene.name,
        elements: judged.sheet.elements,
        nodes: judged.sheet.nodes,
        cost: &judged.cost,
        holders: judged.placed.as_ref().map_or_else(Vec::new, |setup| pressures(&plan, setup)),
        findings: &judged.findings,
    };
    if args.json {
        out_json!("{}", serde_json::to_string_pretty(&judgement).map_err(Failure::input)?);
    } else {
        print_judgement(&plan, &judged, &judgement);
    }
    if let Some(mut setup) = judged.placed.filter(|_| args.auto && !args.json) {
        print_left_out(&plan, &mut setup)?;
    }
    Ok(exit(&judged.findings, args.accept_doubts))
}

/// Pressures of the tools that clamp the sheet.
fn pressures<'a>(plan: &'a Plan, setup: &SimulationSetup) -> Vec<Pressure<'a>> {
    let share = plan.share();
    let pressure = |holder: &Holder| Pressure {
        tool: &plan.scene.tools[holder.tool].name,
        force_n: holder.force * share,
        clamped_mm2: holder.clamped * share,
        pressure_mpa: holder.pressure(),
    };
    let holders = holders(setup, &reachable(setup));
    holders.iter().filter(|holder| holder.clamped > 0.0).map(pressure).collect()
}

/// What was judged, and found.
struct Judged {
    sheet: SheetCounts,
    cost: Cost,
    /// Forces on the nodes, three a node [N].
    loads: Vec<f64>,
    /// The set-up, if its tools could be placed.
    placed: Option<SimulationSetup>,
    findings: Vec<Finding>,
}

/// The sheet against tools, constraints and stages, a large one on a coarser mesh of the same outline.
fn examined(plan: &Plan, args: &CheckArgs) -> Result<Judged, Failure> {
    let (judged, ratio) = plan.coarsened().unwrap_or_else(|| (plan.clone(), 1.0));
    let mut setup = judged.simulation_setup(&args.scene)?;
    let placed = setup.place();
    let sheet = SheetCounts::of_blank(&plan.scene.blank)
        .unwrap_or_else(|| SheetCounts::of_mesh(setup.body.mesh()));
    let cost = if args.measure {
        measure(&mut plan.simulation_setup(&args.scene)?).map_err(Failure::input)?
    } else {
        estimate(&setup, &sheet)
    };
    let findings = match &placed {
        Ok(()) => advice(&judged, &setup, ratio, &cost),
        Err(error) => {
            let remedy = remedy(error).map_or_else(String::new, |text| format!("Try {text}."));
            vec![Finding::error("tools".into(), error.to_string(), remedy)]
        }
    };
    let loads = setup.loads.clone();
    Ok(Judged { sheet, cost, loads, placed: placed.is_ok().then_some(setup), findings })
}

/// The cost of a sheet by the size of its file, which was not opened, and the doubt that says so.
fn not_examined(plan: &Plan, scene: &Path, large: &LargeSheet) -> Result<Judged, Failure> {
    let setup = plan.one_element(scene)?;
    let megabytes = large.bytes as f64 / 1e6;
    let found = format!(
        "{} has {megabytes:.0} MB and was not opened: tools, constraints and stages were not compared with the sheet, and its counts are estimated from its size.",
        large.path.display()
    );
    let remedy = "Examine it with `check --whole`, or use a coarser mesh.";
    let place = "blank.shape.mesh.file".into();
    let doubt = Finding::doubt(DoubtCode::SheetNotExamined, place, found, remedy.into());
    Ok(Judged {
        sheet: large.counts,
        cost: estimate(&setup, &large.counts),
        loads: Vec::new(),
        placed: None,
        findings: vec![doubt],
    })
}

/// Exit code of the worst finding.
fn exit(findings: &[Finding], accepted: bool) -> Exit {
    match findings.first().map(|worst| worst.level) {
        Some(Level::Error) => Exit::Input,
        Some(Level::Doubt) if !accepted => Exit::Limit,
        _ => Exit::Done,
    }
}

/// A note on more memory than the process may have.
fn memory(cost: &Cost) -> Option<Finding> {
    let there = memory_limit_megabytes()?;
    (cost.memory_mb > there).then(|| {
        Finding::note(
            format!("about {:.0} MB are needed, and {there:.0} MB are there", cost.memory_mb),
            "use fewer elements or layers, symmetry planes, or a larger machine".into(),
        )
        .effect(1.0)
    })
}

fn print_judgement(plan: &Plan, judged: &Judged, judgement: &Judgement<'_>) {
    let scene = &plan.scene;
    out!("{}: {}", judgement.scene, scene.name);
    out!(
        "  blank      {}, {} mm thick, {} elements in {} layers, {} nodes",
        outline(&scene.blank.shape),
        scene.blank.thickness_mm,
        judgement.elements,
        scene.blank.layers,
        judgement.nodes
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
    print_loads(plan, &judged.loads);
    print_stages(plan);
    for holder in &judgement.holders {
        out!(
            "  pressure   {} {:.2} MPa ({} N on {:.0} mm2)",
            holder.tool,
            holder.pressure_mpa,
            holder.force_n,
            holder.clamped_mm2
        );
    }
    print_cost(judgement.cost);
    for finding in judgement.findings {
        out!("  {:10} {finding}{}", finding.level, options(finding));
    }
}

fn print_left_out(plan: &Plan, setup: &mut SimulationSetup) -> Result<(), Failure> {
    let (left_out, _) = exclude_unreachable(setup).map_err(Failure::input)?;
    for left in &left_out {
        let tool = &plan.scene.tools[left.tool].name;
        out!("  auto       leaves out {} of {} patches of {tool}", left.patches, left.of);
    }
    if left_out.is_empty() {
        out!("  auto       leaves out nothing");
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

/// `on_nodes`: of the modelled part (three a node) [N].
fn print_loads(plan: &Plan, on_nodes: &[f64]) {
    let nodes = on_nodes.chunks_exact(3).filter(|force| force.iter().any(|f| *f != 0.0)).count();
    let share = plan.share();
    let of = |force: [f64; 3]| {
        let told = |[x, y, z]: [f64; 3]| format!("({x}, {y}, {z}) N");
        let part = force.map(|f| f / share);
        if share == 1.0 {
            told(force)
        } else {
            format!("{} ({} on the modelled part)", told(force), told(part))
        }
    };
    let forces: Vec<String> = plan.scene.loads.iter().map(|load| of(load.force_n)).collect();
    if !forces.is_empty() {
        out!("  loads      {} on {nodes} nodes in all", forces.join(", "));
    }
}

fn print_stages(plan: &Plan) {
    let share = plan.share();
    for stage in &plan.scene.stages {
        let drives: Vec<String> = stage
            .drive
            .iter()
            .map(|(tool, drive)| match drive {
                Drive::TravelMm(to) => format!("{tool} to {to} mm"),
                Drive::AdvanceMm(by) => format!("{tool} by {by} mm"),
                Drive::ForceN(n @ Course::End(end)) => {
                    format!("{tool} {n} N ({} N on the modelled part)", end / share)
                }
                Drive::ForceN(n) => format!("{tool} {n} N"),
                Drive::Spring(s) => format!(
                    "{tool} held by a spring of {} N/mm, {} N at travel zero",
                    s.stiffness_n_per_mm, s.force_n
                ),
                Drive::Release(_) => format!("{tool} released"),
                Drive::Absent(_) => format!("{tool} away"),
            })
            .chain(stage.load_share.map(|share| format!("loads to {} %", 100.0 * share)))
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
