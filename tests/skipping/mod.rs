//! Tests that need something from outside and do not find it: reported, and counted by `tools/test`.

use std::io::Write as _;

/// What the gmsh driver's tests need, and how to get it.
#[allow(dead_code, reason = "not every test needs it")]
pub const GMSH: [&str; 2] =
    ["gmsh 4.12 or newer", "run tools/setup, or name the program in KANAGATA_GMSH"];
/// What tests of foreign mesh formats need, and how to get it.
#[allow(dead_code, reason = "not every test needs it")]
pub const MESHIO: [&str; 2] =
    ["Python with meshio", "run tools/setup, or name the Python in KANAGATA_PYTHON"];
/// What tests with PyVista and VTK need, and how to get it.
#[allow(dead_code, reason = "not every test needs it")]
pub const PYVISTA: [&str; 2] =
    ["Python with PyVista", "run tools/setup --pyvista, or name the Python in KANAGATA_PYTHON"];
/// What tests of foreign CAD files need, and how to get it.
#[allow(dead_code, reason = "not every test needs it")]
pub const CORPUS: [&str; 2] =
    ["foreign CAD files", "name a folder that has a truth.json in KANAGATA_CORPUS"];

/// Records that the calling test is skipped: one line `needs <tab> remedy <tab> test` at the end of the file that
/// KANAGATA_SKIPPED names.
pub fn skip([needs, remedy]: [&str; 2]) {
    println!("skipped: needs {needs}; {remedy}");
    let Some(path) = std::env::var_os("KANAGATA_SKIPPED") else { return };
    let thread = std::thread::current();
    let test = thread.name().unwrap_or("unnamed");
    // One write: lines of tests that run at the same time do not mix.
    let line = format!("{needs}\t{remedy}\t{test}\n");
    let mut file = std::fs::File::options().create(true).append(true).open(path).unwrap();
    file.write_all(line.as_bytes()).unwrap();
}
