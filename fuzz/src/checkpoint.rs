//! Checkpoints: bodies that get their right digest, so that damage reaches what reads them.

use std::cell::RefCell;
use std::path::Path;

use kanagata::files::sha256_hex;
use kanagata::run::checkpoint::{first_line, parse, write};
use kanagata::run::folder::RunFolder;
use kanagata::scene::Plan;
use kanagata::solver::{Control, Simulation};

use super::readers::{Outcome, plan_of};

/// A file of this body: a line of JSON, and the history of the material points.
#[must_use]
pub fn sealed(body: &[u8]) -> Vec<u8> {
    let mut file = first_line(&sha256_hex(body)).into_bytes();
    file.push(b'\n');
    file.extend_from_slice(body);
    file
}

/// The body of a checkpoint of the small simulation after its first increment, written once into a temporary folder.
#[must_use]
pub fn body() -> Vec<u8> {
    let folder = std::env::temp_dir().join(format!("kanagata-fuzz-{}", std::process::id()));
    let plan = small_plan();
    let mut simulation = simulation(&plan);
    simulation.advance(&mut |_| Control::Continue).expect("an increment that converges");
    let unknowns = simulation.displacements().len();
    let run = RunFolder::create(&folder, &plan, Path::new("x"), unknowns).expect("room for files");
    write(&run, &simulation.state(), 0).expect("room for files");
    let file = std::fs::read(folder.join("checkpoint-0.bin")).expect("a file just written");
    std::fs::remove_dir_all(&folder).expect("a folder of our own");
    let first = file.iter().position(|&b| b == b'\n').expect("a first line");
    file[first + 1..].to_vec()
}

/// Restores a small simulation from the checkpoint of this body; one time in 64, by its digest, the run goes on for an
/// increment, which takes a hundred times as long.
pub fn restore(body: &[u8]) -> Outcome {
    thread_local!(static OWN: RefCell<Simulation> = RefCell::new(simulation(&small_plan())));
    let file = sealed(body);
    let checkpoint = parse(&file)?;
    let digest = sha256_hex(body);
    drop(checkpoint.folder.history.untouched());
    OWN.with_borrow_mut(|own| {
        own.resume(checkpoint.state).map_err(|e| e.to_string())?;
        drop((own.state(), own.contact_forces(), own.tool_shifts()));
        if digest.starts_with(['0', '1', '2', '3']) && digest.ends_with('0') {
            own.advance(&mut |_| Control::Continue).map_err(|e| e.to_string())?;
        }
        Ok(())
    })
}

/// A sheet of two elements under the punch of the U-draw.
fn small_plan() -> Plan {
    const SCENE: &str = r#"{
        "format": "kanagata-scene", "version": 1, "name": "checkpoint", "material": "mild-steel-numisheet93",
        "blank": {"shape": {"rectangle": {"size_mm": [4, 1], "elements": [2, 1]}}, "thickness_mm": 0.8,
                  "layers": 1, "element": "hex8"},
        "holds": [{"where": {"all": true}, "axes": ["y"]}, {"where": {"plane": {"normal": "x"}}, "axes": ["x", "z"]}],
        "tools": [{"name": "punch", "file": "punch.tool.json", "direction": [0, 0, -1], "friction": 0.1}],
        "stages": [{"name": "draw", "drive": {"punch": {"travel_mm": 0.1}}}]
    }"#;
    let scene = kanagata::scene::read::parse(SCENE.as_bytes(), Path::new("x"));
    plan_of(scene.expect("a sound scene")).expect("a sound scene")
}

/// The simulation of the plan, its tool placed touching.
fn simulation(plan: &Plan) -> Simulation {
    let mut setup = plan.simulation_setup(Path::new("x")).expect("a sound scene");
    setup.place().expect("a punch above the sheet");
    Simulation::new(setup).expect("a sound scene")
}
