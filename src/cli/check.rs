//! `kanagata-solve check SCENE`: what would be run.

use std::path::PathBuf;

use super::exit::{EXIT_HELP, Exit, Failure};
use super::say::out;
use crate::run::advice::advice;
use crate::run::cost::{Cost, cost};
use crate::scene::types::{BlankShape, Course, Drive};
use crate::scene::{Plan, SceneError, read};
use crate::solver::reach::leave_out;

/// Arguments of `check`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Example:\n  kanagata-solve check fixtures/cross/demo.scene.json\n\n{EXIT_HELP}"))]
pub struct CheckArgs {
    /// Scene file
    scene: PathBuf,
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

/// Reads and sets up the scene and prints what it holds.
///
/// # Errors
/// Exit code 2 for a scene that cannot be run, 4 when the scene cannot be read.
pub fn run(args: &CheckArgs) -> Result<Exit, Failure> {
    let plan = read(&args.scene)?;
    let mut setup = plan.simulation_setup(&args.scene)?;
    let placed = setup.place();
    let cost = cost(&mut setup).map_err(Failure::input)?;
    let mesh = setup.body.mesh();
    let scene = &plan.scene;
    out!("{}: {}", args.scene.display(), scene.name);
    out!(
        "  blank      {}, {} mm thick, {} elements in {} layers, {} nodes",
        outline(&scene.blank.shape),
        scene.blank.thickness_mm,
        mesh.elements.len(),
        scene.blank.layers,
        mesh.nodes.len()
    );
    out!("  material   {}", plan.card.name);
    for (tool, loaded) in scene.tools.iter().zip(&plan.tools) {
        let error =
            loaded.shape_error_mm.map_or_else(String::new, |e| format!(", shape error {e:.4} mm"));
        out!(
            "  tool       {}: {} patches{error}, friction {}",
            tool.name,
            loaded.surface.model().patches.len(),
            tool.friction
        );
    }
    print_loads(&plan, &setup.loads);
    print_stages(&plan);
    print_cost(&cost);
    // What is wrong with a placement is said last, after all that is known.
    placed.map_err(Failure::input)?;
    for remark in advice(&plan, &setup, &cost) {
        out!("  note       {remark}");
    }
    if args.auto {
        let (left_out, _) = leave_out(&mut setup).map_err(Failure::input)?;
        for left in &left_out {
            let tool = &plan.scene.tools[left.tool].name;
            out!("  auto       leaves out {} of {} patches of {tool}", left.patches, left.of);
        }
        if left_out.is_empty() {
            out!("  auto       leaves out nothing");
        }
    }
    Ok(Exit::Done)
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
        let drives =
            if drives.is_empty() { "tools go on as they were".into() } else { drives.join(", ") };
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
        "  measured   an element loop {:.3} s, a factorisation {:.3} s ({:.2} Gflop), on {} threads",
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
