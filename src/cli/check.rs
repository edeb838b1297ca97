//! `kanagata-solve check SCENE`: what would be run.

use std::path::PathBuf;

use super::exit::{EXIT_HELP, Exit, Failure};
use crate::geometry::Vec3;
use crate::run::advice::advice;
use crate::scene::types::{BlankShape, Drive};
use crate::scene::{Plan, SceneError, read};
use crate::solver::SimulationSetup;
use crate::solver::linear::multifrontal::{PatternRef, Symbolic};

/// Arguments of `check`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Example:\n  kanagata-solve check fixtures/cross/demo.scene.json\n\n{EXIT_HELP}"))]
pub struct CheckArgs {
    /// Scene file
    scene: PathBuf,
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
    let setup = plan.simulation_setup(&args.scene)?;
    let mesh = setup.body.mesh();
    let scene = &plan.scene;
    println!("{}: {}", args.scene.display(), scene.name);
    println!(
        "  blank      {}, {} mm thick, {} elements in {} layers, {} nodes",
        outline(&scene.blank.shape),
        scene.blank.thickness_mm,
        mesh.elements.len(),
        scene.blank.layers,
        mesh.nodes.len()
    );
    println!("  material   {}", plan.card.name);
    for (tool, loaded) in scene.tools.iter().zip(&plan.tools) {
        let error =
            loaded.shape_error_mm.map_or_else(String::new, |e| format!(", shape error {e:.4} mm"));
        println!(
            "  tool       {}: {} patches{error}, friction {}",
            tool.name,
            loaded.surface.model().patches.len(),
            tool.friction
        );
    }
    print_stages(&plan);
    print_cost(&setup)?;
    for remark in advice(&plan, &setup) {
        println!("  note       {remark}");
    }
    Ok(Exit::Done)
}

fn outline(shape: &BlankShape) -> String {
    match shape {
        BlankShape::Rectangle { size_mm: [x, y], .. } => format!("{x} x {y} mm"),
        BlankShape::QuarterDisc { radius_mm, .. } => format!("quarter disc, radius {radius_mm} mm"),
        BlankShape::Mesh { file } => file.clone(),
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
                Drive::ForceN(n) => format!("{tool} {n} N ({} N on the modelled part)", n / share),
                Drive::Release(_) => format!("{tool} released"),
                Drive::Absent(_) => format!("{tool} away"),
            })
            .collect();
        println!("  stage      {}: {}", stage.name, drives.join(", "));
    }
}

/// Unknowns, memory and work of a factorisation.
fn print_cost(setup: &SimulationSetup) -> Result<(), Failure> {
    let mesh = setup.body.mesh();
    let pattern = setup.body.pattern();
    let unknowns = 3 * mesh.nodes.len();
    let levels = mesh.nodes_per_column.max(1);
    let block: Vec<u32> = (0..unknowns).map(|i| (i / (3 * levels)) as u32).collect();
    let centers: Vec<Vec3> =
        mesh.column_coordinates().iter().map(|c| Vec3::new(c.x, c.y, 0.0)).collect();
    let columns: Vec<u32> = pattern.col_idx.iter().map(|&c| c as u32).collect();
    let pattern = PatternRef { row_start: &pattern.row_ptr, columns: &columns };
    let plan = Symbolic::new(pattern, &block, &centers).map_err(Failure::input)?;
    println!("  unknowns   {unknowns}");
    println!(
        "  a factorisation  {:.2} Gflop, {:.0} MB of factors and workspace",
        plan.flops() / 1e9,
        plan.bytes() as f64 / 1e6
    );
    Ok(())
}
