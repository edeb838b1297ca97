//! The gmsh program in a folder of its own: the part copied, a script beside it, run under a time limit.

use std::ffi::OsString;
use std::fs;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use super::outline::{self, Outline};
use super::plan::Plan;
use super::{GmshOptions, script};
use crate::mesh::mapped::MeshStyle;
use crate::mesh::outside::wait;
use crate::mesh::{MeshError, SurfaceMesh, io};

/// Lines of gmsh's log kept for the message.
const LOG_LINES: usize = 12;
/// Characters of a line kept.
const LINE_LENGTH: usize = 400;
/// Bytes at the log's end that are looked at.
const LOG_BYTES: u64 = 100_000;
/// The script's name in the folder.
const SCRIPT: &str = "part.geo";

/// gmsh and one part; all its runs share one time limit.
pub struct Run<'a> {
    program: &'a Path,
    cad: &'a Path,
    folder: &'a Path,
    options: &'a GmshOptions,
    /// The part's name in the folder.
    part: &'static str,
    /// Faces are sewn within this (mm).
    sewn: Option<f64>,
    begun: Instant,
}

impl<'a> Run<'a> {
    /// Copies the part into the folder. gmsh tells formats by their ending: the file gets one that fits its content.
    /// Faces in IGES files do not share curves; those within `tolerance` (mm) are sewn.
    ///
    /// # Errors
    /// [`MeshError::Read`], [`MeshError::Write`].
    pub fn new(
        program: &'a Path,
        cad: &'a Path,
        folder: &'a Path,
        options: &'a GmshOptions,
        tolerance: f64,
    ) -> Result<Self, MeshError> {
        let read = |source| MeshError::Read { path: cad.to_path_buf(), source };
        let bytes = fs::read(cad).map_err(read)?;
        let start = &bytes[..bytes.len().min(2000)];
        let is_step = start.windows(12).any(|w| w == b"ISO-10303-21");
        let part = if is_step { "cad.stp" } else { "cad.igs" };
        write(&folder.join(part), &bytes)?;
        let sewn = (!is_step).then_some(tolerance);
        Ok(Self { program, cad, folder, options, part, sewn, begun: Instant::now() })
    }

    /// Whether faces are sewn.
    pub fn is_sewn(&self) -> bool {
        self.sewn.is_some()
    }

    /// From here on faces are taken as the file has them: sewing loses what gmsh needs at poles.
    pub fn leave_unsewn(&mut self) {
        self.sewn = None;
    }

    /// gmsh's curves and surfaces.
    ///
    /// # Errors
    /// [`MeshError::GmshFailed`] when it writes no file; [`MeshError::Invalid`] when that is no outline.
    pub fn outline(&self) -> Result<Outline, MeshError> {
        let numbers = [("Mesh.Binary", 0.0), ("Mesh.SaveAll", 1.0)];
        let file = self.start(&script::outline(), "-1", "outline.msh", &numbers)?;
        let bytes =
            fs::read(&file).map_err(|source| MeshError::Read { path: file.clone(), source })?;
        outline::parse(&bytes, "gmsh's outline.msh")
    }

    /// The mesh with the grids of a plan.
    ///
    /// # Errors
    /// [`MeshError::GmshFailed`] when it writes no file or one without surface elements, or takes too long.
    pub fn surfaces(&self, plan: &Plan) -> Result<SurfaceMesh, MeshError> {
        let join = self.options.style == MeshStyle::Mixed;
        let text = script::grids(plan, join);
        let file = self.start(&text, "-2", "out.msh", &self.numbers())?;
        let mesh = io::read(&file)?;
        if mesh.elements.is_empty() {
            return Err(self.failed("its file holds no surface elements".into()));
        }
        Ok(mesh)
    }

    fn failed(&self, reason: String) -> MeshError {
        MeshError::GmshFailed { cad: self.cad.to_path_buf(), reason, log: self.log_tail() }
    }

    fn start(
        &self,
        script: &str,
        dimension: &str,
        out: &str,
        numbers: &[(&str, f64)],
    ) -> Result<PathBuf, MeshError> {
        let text = script::merge(self.part, self.sewn) + script;
        write(&self.folder.join(SCRIPT), text.as_bytes())?;
        let file = self.folder.join(out);
        let _ = fs::remove_file(&file);
        let mut command = Command::new(self.program);
        command.args([SCRIPT, dimension, "-format", "msh41", "-o", out]);
        for (name, value) in numbers {
            command.args(["-setnumber", name, &value.to_string()]);
        }
        let mut child = self.spawn(command)?;
        let limit = Duration::from_secs_f64(self.options.limit_s.clamp(0.0, 1e6));
        if !wait(&mut child, limit.saturating_sub(self.begun.elapsed())) {
            let reason = format!(
                "stopped after {} s (allow more with --gmsh-limit SECONDS, or mesh coarser)",
                self.options.limit_s
            );
            return Err(self.failed(reason));
        }
        if file.is_file() { Ok(file) } else { Err(self.failed("it wrote no file".into())) }
    }

    /// Starts the program in the folder, with what it prints in the log.
    fn spawn(&self, mut command: Command) -> Result<Child, MeshError> {
        let log = self.folder.join("log.txt");
        let output = fs::File::create(&log).and_then(|f| Ok((f.try_clone()?, f)));
        let (stdout, stderr) =
            output.map_err(|source| crate::files::WriteError { path: log, source })?;
        command.env("PATH", self.search_path()).current_dir(self.folder);
        command.stdin(Stdio::null()).stdout(stdout).stderr(stderr);
        let failed = |e| self.failed(format!("{} does not start: {e}", self.program.display()));
        command.spawn().map_err(failed)
    }

    /// The program's own folder first: gmsh from PyPI is a script that asks PATH for its Python.
    fn search_path(&self) -> OsString {
        let own = self.program.parent().map(Path::to_path_buf);
        let path = std::env::var_os("PATH").unwrap_or_default();
        let all = own.into_iter().chain(std::env::split_paths(&path));
        std::env::join_paths(all).unwrap_or(path)
    }

    /// gmsh's options for surfaces.
    fn numbers(&self) -> Vec<(&'static str, f64)> {
        let o = self.options;
        let per_turn = if o.divides_bends() { 0 } else { o.per_turn };
        let mut out = vec![
            ("General.Terminal", 1.0),
            ("General.NumThreads", 1.0),
            ("Mesh.Algorithm", f64::from(o.algorithm as i32)),
            ("Mesh.MeshSizeFromCurvature", per_turn as f64),
            ("Mesh.Binary", 1.0),
            ("Mesh.SaveAll", 1.0),
            ("Mesh.ElementOrder", 1.0),
            ("Mesh.TransfiniteTri", 1.0),
        ];
        if matches!(o.style, MeshStyle::Structured | MeshStyle::Quads) {
            out.push(("Mesh.RecombineAll", 1.0));
        }
        for (name, size) in ["Mesh.MeshSizeMin", "Mesh.MeshSizeMax"].into_iter().zip(o.size) {
            out.extend(size.map(|size| (name, size)));
        }
        out
    }

    /// The log's last lines, each cut to a length that people read: gmsh lists thousands of numbers in one.
    fn log_tail(&self) -> String {
        let bytes = tail(&self.folder.join("log.txt")).unwrap_or_default();
        let text = String::from_utf8_lossy(&bytes);
        let lines: Vec<&str> = text.lines().filter(|l| !l.trim().is_empty()).collect();
        let cut = |line: &&str| line.chars().take(LINE_LENGTH).collect::<String>();
        let last = &lines[lines.len().saturating_sub(LOG_LINES)..];
        last.iter().map(cut).collect::<Vec<_>>().join("\n")
    }
}

/// The end of a file.
fn tail(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut file = fs::File::open(path)?;
    let length = file.metadata()?.len();
    file.seek(SeekFrom::Start(length.saturating_sub(LOG_BYTES)))?;
    let mut bytes = Vec::new();
    file.take(LOG_BYTES).read_to_end(&mut bytes)?;
    Ok(bytes)
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), MeshError> {
    let failed = |source| crate::files::WriteError { path: path.to_path_buf(), source }.into();
    fs::write(path, bytes).map_err(failed)
}
