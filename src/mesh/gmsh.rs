//! The gmsh program: found, run on the same CAD file in a folder of its own under a time limit, its
//! mesh checked and put back on our faces. Its exit code is not trusted.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use super::outside::{WorkFolder, on_path, wait};
use super::{MeshError, MeshReport, SurfaceMesh, attach, io};
use crate::cad::Model;

/// gmsh's algorithms for surfaces, with its own numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GmshAlgorithm {
    /// MeshAdapt.
    MeshAdapt = 1,
    /// Automatic.
    Automatic = 2,
    /// Delaunay.
    Delaunay = 5,
    /// Frontal-Delaunay (gmsh's default).
    FrontalDelaunay = 6,
    /// BAMG.
    Bamg = 7,
    /// Frontal-Delaunay for quads.
    FrontalQuads = 8,
    /// Packing of parallelograms.
    Parallelograms = 9,
    /// Quasi-structured quads.
    QuasiStructured = 11,
}

/// How gmsh is run.
#[derive(Debug, Clone, PartialEq)]
pub struct GmshOptions {
    /// The program; `None`: environment variable KANAGATA_GMSH, then PATH.
    pub program: Option<PathBuf>,
    /// Recombine triangles to quads.
    pub quads: bool,
    /// Algorithm for surfaces.
    pub algorithm: GmshAlgorithm,
    /// Elements for 360 degrees of turn (`Mesh.MeshSizeFromCurvature`); 0 = off.
    pub per_turn: usize,
    /// Smallest and largest element size (mm); `None` = gmsh's own.
    pub size: [Option<f64>; 2],
    /// Time limit (s); gmsh is killed when it takes longer.
    pub limit_s: f64,
    /// Allowed difference of area from the model's, relative.
    pub area_tolerance: f64,
}

impl Default for GmshOptions {
    fn default() -> Self {
        Self {
            program: None,
            quads: false,
            algorithm: GmshAlgorithm::FrontalDelaunay,
            per_turn: 16,
            size: [None, None],
            limit_s: 300.0,
            area_tolerance: 0.05,
        }
    }
}

/// Lines of gmsh's log kept for the message.
const LOG_LINES: usize = 12;

/// Meshes a CAD file with gmsh and attaches the result to `model`, which was read from the same file.
///
/// # Errors
/// [`MeshError::GmshAbsent`]; [`MeshError::GmshFailed`] with the log's last lines when there is no mesh or
/// the time is over; [`MeshError::Check`] when faces are missing or the area is off.
pub fn mesh(cad: &Path, model: &Model, options: &GmshOptions) -> Result<SurfaceMesh, MeshError> {
    let program = find(options.program.as_deref())?;
    let folder = WorkFolder::new("gmsh")?;
    let run = Run { program: &program, cad, folder: &folder.path, options };
    let found = run.start()?;
    let out = attach(&found, model)?;
    MeshReport::new(&out, model).check(model, options.area_tolerance)?;
    Ok(out)
}

/// The gmsh program: as named, else by KANAGATA_GMSH, else on PATH.
///
/// # Errors
/// [`MeshError::GmshAbsent`] says where it was looked for.
pub fn find(named: Option<&Path>) -> Result<PathBuf, MeshError> {
    let named = named.map(Path::to_path_buf);
    let named = named.or_else(|| std::env::var_os("KANAGATA_GMSH").map(PathBuf::from));
    if let Some(path) = named.filter(|p| !p.as_os_str().is_empty()) {
        if path.is_file() {
            return Ok(path);
        }
        return Err(MeshError::GmshAbsent { tried: format!("no file {}", path.display()) });
    }
    on_path(&["gmsh", "gmsh.exe"]).ok_or_else(|| MeshError::GmshAbsent {
        tried: "no gmsh on PATH, KANAGATA_GMSH not set".into(),
    })
}

struct Run<'a> {
    program: &'a Path,
    cad: &'a Path,
    folder: &'a Path,
    options: &'a GmshOptions,
}

impl Run<'_> {
    fn failed(&self, reason: String) -> MeshError {
        MeshError::GmshFailed { cad: self.cad.to_path_buf(), reason, log: self.log_tail() }
    }

    fn start(&self) -> Result<SurfaceMesh, MeshError> {
        let log = self.folder.join("log.txt");
        let output = fs::File::create(&log);
        let output = output.and_then(|f| Ok((f.try_clone()?, f)));
        let (out, err) =
            output.map_err(|source| crate::files::WriteError { path: log.clone(), source })?;
        let mut command = Command::new(self.program);
        command.args(self.arguments()?).env("PATH", self.search_path());
        command.stdin(Stdio::null()).stdout(out).stderr(err).current_dir(self.folder);
        let mut child = command
            .spawn()
            .map_err(|e| self.failed(format!("{} does not start: {e}", self.program.display())))?;
        let in_time =
            wait(&mut child, Duration::from_secs_f64(self.options.limit_s.clamp(0.0, 1e6)));
        if !in_time {
            let reason = format!("stopped after {} s (--gmsh-limit)", self.options.limit_s);
            return Err(self.failed(reason));
        }
        let file = self.folder.join("out.msh");
        if !file.is_file() {
            return Err(self.failed("it wrote no file".into()));
        }
        let mesh = io::read(&file)?;
        if mesh.elements.is_empty() {
            return Err(self.failed("its file holds no surface elements".into()));
        }
        Ok(mesh)
    }

    /// The program's own folder first: gmsh from PyPI is a script that asks PATH for its Python.
    fn search_path(&self) -> OsString {
        let own = self.program.parent().map(Path::to_path_buf);
        let path = std::env::var_os("PATH").unwrap_or_default();
        let all = own.into_iter().chain(std::env::split_paths(&path));
        std::env::join_paths(all).unwrap_or(path)
    }

    fn arguments(&self) -> Result<Vec<OsString>, MeshError> {
        let cad = self.copy_cad()?;
        let o = self.options;
        let mut numbers: Vec<(&str, f64)> = vec![
            ("General.Terminal", 1.0),
            ("General.NumThreads", 1.0),
            ("Mesh.Algorithm", f64::from(o.algorithm as i32)),
            ("Mesh.MeshSizeFromCurvature", o.per_turn as f64),
            ("Mesh.Binary", 1.0),
            ("Mesh.SaveAll", 1.0),
            ("Mesh.ElementOrder", 1.0),
        ];
        if o.quads {
            numbers.push(("Mesh.RecombineAll", 1.0));
        }
        for (name, size) in ["Mesh.MeshSizeMin", "Mesh.MeshSizeMax"].into_iter().zip(o.size) {
            if let Some(size) = size {
                numbers.push((name, size));
            }
        }
        let mut out: Vec<OsString> = vec![cad, "-2".into(), "-format".into(), "msh41".into()];
        out.extend(["-o", "out.msh", "-setstring", "Geometry.OCCTargetUnit", "MM"].map(Into::into));
        for (name, value) in numbers {
            out.extend(["-setnumber".into(), name.into(), value.to_string().into()]);
        }
        Ok(out)
    }

    /// gmsh tells formats by their ending: the file is copied under one that fits its content.
    fn copy_cad(&self) -> Result<OsString, MeshError> {
        let read = |source| MeshError::Read { path: self.cad.to_path_buf(), source };
        let bytes = fs::read(self.cad).map_err(read)?;
        let start = &bytes[..bytes.len().min(2000)];
        let is_step = start.windows(12).any(|w| w == b"ISO-10303-21");
        let name = if is_step { "cad.stp" } else { "cad.igs" };
        let path = self.folder.join(name);
        fs::write(&path, bytes).map_err(|source| crate::files::WriteError { path, source })?;
        Ok(name.into())
    }

    fn log_tail(&self) -> String {
        let bytes = fs::read(self.folder.join("log.txt")).unwrap_or_default();
        let text = String::from_utf8_lossy(&bytes);
        let lines: Vec<&str> = text.lines().filter(|l| !l.trim().is_empty()).collect();
        lines[lines.len().saturating_sub(LOG_LINES)..].join("\n")
    }
}

#[cfg(all(test, unix))]
mod tests {
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    /// One script at a time: a file still open in a process being started cannot be executed.
    static ONE: std::sync::Mutex<()> = std::sync::Mutex::new(());

    /// Runs a shell script in gmsh's place on a small file.
    fn run_script(script: &str, limit_s: f64) -> Result<SurfaceMesh, MeshError> {
        let _one = ONE.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let folder = tempfile::tempdir().unwrap();
        let program = folder.path().join("gmsh");
        fs::write(&program, format!("#!/bin/sh\n{script}\n")).unwrap();
        fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
        let cad = folder.path().join("part.step");
        fs::write(&cad, "ISO-10303-21;").unwrap();
        let options = GmshOptions { limit_s, ..GmshOptions::default() };
        Run { program: &program, cad: &cad, folder: folder.path(), options: &options }.start()
    }

    #[test]
    fn exit_code_zero_without_a_mesh_is_a_failure_with_the_log() {
        let bad = run_script("echo Error: surface 3 is impossible; exit 0", 20.0).unwrap_err();
        let text = bad.to_string();
        assert!(text.contains("wrote no file") && text.contains("surface 3"), "{text}");
        let empty = "printf '$MeshFormat\\n4.1 0 8\\n$EndMeshFormat\\n' > out.msh";
        let text = run_script(empty, 20.0).unwrap_err().to_string();
        assert!(text.contains("no surface elements"), "{text}");
    }

    #[test]
    fn a_program_that_hangs_is_killed() {
        let text = run_script("exec sleep 60", 0.2).unwrap_err().to_string();
        assert!(text.contains("stopped after 0.2 s"), "{text}");
    }

    #[test]
    fn the_part_is_handed_over_under_its_formats_ending() {
        let text = run_script("ls; echo \"$@\"", 20.0).unwrap_err().to_string();
        assert!(text.contains("cad.stp -2 -format msh41 -o out.msh"), "{text}");
        assert!(text.contains("Mesh.MeshSizeFromCurvature 16"), "{text}");
    }

    #[test]
    fn a_missing_program_is_named_with_the_remedy() {
        let text = find(Some(Path::new("no/such/gmsh"))).unwrap_err().to_string();
        assert!(text.contains("no/such/gmsh") && text.contains("pip install gmsh"), "{text}");
    }

    #[test]
    fn the_real_program_meshes_iges_and_step() {
        let Ok(program) = find(None) else {
            println!("skipped: gmsh is not installed (tools/setup)");
            return;
        };
        let forming = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/forming");
        for file in ["cross_die_144.igs", "cross_die_AP214.stp"] {
            for quads in [false, true] {
                let folder = tempfile::tempdir().unwrap();
                let options = GmshOptions { quads, per_turn: 24, ..GmshOptions::default() };
                let cad = forming.join(file);
                let run =
                    Run { program: &program, cad: &cad, folder: folder.path(), options: &options };
                let mesh = run.start().unwrap();
                let error = mesh.area() / 20_984.966_992_128_233 - 1.0;
                assert!(error.abs() < 0.005, "{file}: {error}");
                let mut surfaces: Vec<u32> = mesh.elements.iter().map(|e| e.face).collect();
                surfaces.sort_unstable();
                surfaces.dedup();
                assert_eq!(surfaces.len(), 15);
                let four = mesh.elements.iter().filter(|e| e.nodes().len() == 4).count();
                assert!(if quads { 2 * four > mesh.elements.len() } else { four == 0 });
            }
        }
    }
}
