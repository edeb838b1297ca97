//! Reading of other mesh formats through Python's meshio.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use super::mesh_file::MeshFile;
use super::obj;
use crate::MeshError;
use crate::external::{self, End, from_any_folder, on_path, work_folder};
use kanagata_files::Input;

/// Time limit [s].
const LIMIT_S: u64 = 300;
/// Exit code of the script when meshio is not installed.
const EXIT_WITHOUT_MESHIO: i32 = 77;

/// Writes the corners of all triangles and quadrilaterals, also of higher order, as OBJ text with all digits of their
/// coordinates, and point normals if present. Planar points get z = 0.
const SCRIPT: &str = r#"
import sys
try:
    import meshio
except ImportError as error:
    print(error, file=sys.stderr)
    sys.exit(77)
mesh = meshio.read(sys.argv[1])
with open(sys.argv[2], "w") as out:
    for point in mesh.points:
        x = [float(c) for c in point[:3]] + [0.0] * (3 - len(point))
        out.write("v %r %r %r\n" % tuple(x))
    data = {name.lower(): values for name, values in mesh.point_data.items()}
    normals = data.get("normals")
    if normals is None and all(name in data for name in ("nx", "ny", "nz")):
        normals = list(zip(data["nx"], data["ny"], data["nz"]))
    for normal in [] if normals is None else normals:
        out.write("vn %r %r %r\n" % tuple(float(c) for c in normal))
    corner = "%d" if normals is None else "%d//%d"
    for block in mesh.cells:
        corners = 3 if block.type.startswith("triangle") else 4 if block.type.startswith("quad") else 0
        for cell in block.data if corners else []:
            ids = [int(n) + 1 for n in cell[:corners]]
            out.write("f %s\n" % " ".join(corner % ((n,) * corner.count("%d")) for n in ids))
"#;

/// Reads `path` with the Python of KANAGATA_PYTHON, or the one on PATH.
pub fn read(path: &Path, file: &str) -> Result<MeshFile, MeshError> {
    let named = std::env::var_os("KANAGATA_PYTHON").map(PathBuf::from);
    let named = named.filter(|p| !p.as_os_str().is_empty());
    // A name without folder is looked up on PATH by the system.
    let named = named.map(|p| if p.components().count() > 1 { from_any_folder(p) } else { p });
    let python = named.or_else(|| on_path(&["python3", "python", "python.exe"]));
    let python = python.ok_or_else(|| MeshError::MeshioAbsent {
        file: file.into(),
        tried: "no python3 on PATH, KANAGATA_PYTHON not set".into(),
    })?;
    read_with(&python, path, file)
}

/// Reads `path` with the given Python.
pub(super) fn read_with(python: &Path, path: &Path, file: &str) -> Result<MeshFile, MeshError> {
    let folder = work_folder("meshio")?;
    let out = folder.path().join("mesh.obj");
    let mut command = Command::new(python);
    // The program runs in another folder.
    let read = |source| MeshError::Read { path: path.to_path_buf(), source };
    kanagata_files::open(path, Input::Mesh).map_err(read)?;
    command.arg("-c").arg(SCRIPT).arg(path.canonicalize().map_err(read)?).arg(&out);
    let absent = |tried: String| MeshError::MeshioAbsent { file: file.into(), tried };
    let outcome = external::run(&mut command, folder.path(), Duration::from_secs(LIMIT_S))
        .map_err(|e| absent(format!("{} does not start: {e}", python.display())))?;
    let failed = |reason: String| MeshError::MeshioFailed { file: file.into(), reason };
    match outcome.end {
        End::TooLong => return Err(failed(format!("stopped after {LIMIT_S} s"))),
        End::TooLarge => return Err(failed(external::too_large())),
        End::Ended(status) if !status.success() => {
            let message = last_line(&outcome.log);
            return Err(match status.code() {
                Some(EXIT_WITHOUT_MESHIO) => absent(format!("{}: {message}", python.display())),
                _ => failed(message),
            });
        }
        End::Ended(_) => {}
    }
    let bytes = kanagata_files::read(&out, Input::Mesh).map_err(read)?;
    let found = obj::parse(&bytes, file)?;
    if found.mesh.elements.is_empty() {
        return Err(failed("it holds no triangles or quadrilaterals".into()));
    }
    Ok(found)
}

/// Last non-empty line.
fn last_line(log: &[u8]) -> String {
    let text = String::from_utf8_lossy(log);
    let line = text.lines().rev().map(str::trim).find(|l| !l.is_empty());
    line.unwrap_or("it said nothing").chars().take(300).collect()
}
