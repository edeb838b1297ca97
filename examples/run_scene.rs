//! Check and run of a scene: `cargo run --release --example run_scene CUP.scene.json OUT`.

use std::path::Path;

use kanagata::prelude::{Error, Run, RunOptions, Scene};

fn run(scene: &Path, folder: &Path) -> Result<Run, Error> {
    let scene = Scene::read(scene)?;
    let check = scene.check()?;
    for finding in &check.findings {
        println!("{} {finding}", finding.level);
    }
    let run = scene.run(folder, &RunOptions::default(), &mut |progress| {
        println!("{:4.0} %  {:?} N", 100.0 * progress.done, progress.row.force_n);
    })?;
    println!("{:?}, doubts {:?}", run.verdict(), run.doubts());
    for (time, file) in run.steps() {
        println!("  {time}: {}", file.display());
    }
    Ok(run)
}

fn main() -> Result<(), Error> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [scene, folder] = &arguments[..] else {
        eprintln!("run_scene CUP.scene.json OUT");
        return Ok(());
    };
    run(scene.as_ref(), folder.as_ref()).map(drop)
}

#[test]
fn the_example_runs() {
    let folder = tempfile::tempdir().unwrap();
    let run = run("examples/strip/strip.scene.json".as_ref(), &folder.path().join("run")).unwrap();
    let last = run.history().rows.last().unwrap();
    assert_eq!((last.time, run.record().stages), (3.0, 3));
}
