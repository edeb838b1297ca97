//! Runs the gmsh program in a temporary folder with a copy of the part and a script, under a time limit.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use super::options::GmshOptions;
use super::outline::{self, Outline};
use super::plan::Plan;
use super::script;
use crate::external::{self, End};
use crate::mapped::MeshStyle;
use crate::{MeshError, SurfaceMesh, io};
use kanagata_files::Input;

/// Number of lines of gmsh's log in a message.
const LOG_LINES: usize = 12;
/// Maximum number of characters per line.
const LINE_LENGTH: usize = 400;
/// File name of the script.
const SCRIPT: &str = "part.geo";

/// gmsh and one part; all runs share one time limit.
pub struct Run<'a> {
    program: &'a Path,
    cad: &'a Path,
    folder: &'a Path,
    options: &'a GmshOptions,
    /// File name of the part in the folder.
    part: &'static str,
    /// Sewing tolerance [mm].
    sewn: Option<f64>,
    begun: Instant,
}

impl<'a> Run<'a> {
    /// Copies the part into the folder. gmsh identifies formats by file extension, so that the copy gets one that
    /// matches its content. Faces of IGES files have no common curves; those within `tolerance` [mm] are sewn.
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
        let bytes = kanagata_files::read(cad, Input::Cad).map_err(read)?;
        let start = &bytes[..bytes.len().min(2000)];
        let is_step = start.windows(12).any(|w| w == b"ISO-10303-21");
        let part = if is_step { "cad.stp" } else { "cad.igs" };
        write(&folder.join(part), &bytes)?;
        let sewn = (!is_step).then_some(tolerance);
        Ok(Self { program, cad, folder, options, part, sewn, begun: Instant::now() })
    }

    /// True when faces are sewn.
    pub fn is_sewn(&self) -> bool {
        self.sewn.is_some()
    }

    /// Disables sewing, which removes entities that gmsh needs at poles.
    pub fn disable_sewing(&mut self) {
        self.sewn = None;
    }

    /// Curves and surfaces as read by gmsh.
    ///
    /// # Errors
    /// [`MeshError::GmshFailed`] when no file was written; [`MeshError::Invalid`] when it is not an outline.
    pub fn outline(&self) -> Result<Outline, MeshError> {
        let numbers = [("Mesh.Binary", 0.0), ("Mesh.SaveAll", 1.0)];
        let file = self.start(&script::outline(), "-1", "outline.msh", &numbers)?;
        let bytes = kanagata_files::read(&file, Input::Mesh)
            .map_err(|source| MeshError::Read { path: file.clone(), source })?;
        outline::parse(&bytes, "gmsh's outline.msh")
    }

    /// The mesh with the grids of a plan.
    ///
    /// # Errors
    /// [`MeshError::GmshFailed`] when no file was written, it has no surface elements, or the time limit is reached.
    pub fn surfaces(&self, plan: &Plan) -> Result<SurfaceMesh, MeshError> {
        let join = self.options.style == MeshStyle::Mixed;
        let text = script::grids(plan, join);
        let file = self.start(&text, "-2", "out.msh", &self.numbers())?;
        let mesh = io::read_unchecked(&file)?;
        if mesh.elements.is_empty() {
            return Err(self.failed("its file holds no surface elements".into(), ""));
        }
        Ok(mesh)
    }

    fn failed(&self, reason: String, log: &str) -> MeshError {
        MeshError::GmshFailed { cad: self.cad.to_path_buf(), reason, log: log.to_owned() }
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
        let limit = Duration::from_secs_f64(self.options.limit_s.clamp(0.0, 1e6));
        let left = limit.saturating_sub(self.begun.elapsed());
        command.env("PATH", self.search_path());
        let outcome = external::run(&mut command, self.folder, left).map_err(|e| {
            self.failed(format!("{} does not start: {e}", self.program.display()), "")
        })?;
        let log = log_tail(&outcome.log);
        match outcome.end {
            End::TooLong => {
                let reason = format!(
                    "stopped after {} s (allow more by `limit_s`, or mesh coarser)",
                    self.options.limit_s
                );
                return Err(self.failed(reason, &log));
            }
            End::TooLarge => return Err(self.failed(external::too_large(), &log)),
            End::Ended(_) => {}
        }
        if file.is_file() { Ok(file) } else { Err(self.failed("it wrote no file".into(), &log)) }
    }

    /// PATH with the program's own folder first: gmsh from PyPI is a script that looks up its Python in PATH.
    fn search_path(&self) -> OsString {
        let own = self.program.parent().map(Path::to_path_buf);
        let path = std::env::var_os("PATH").unwrap_or_default();
        let all = own.into_iter().chain(std::env::split_paths(&path));
        std::env::join_paths(all).unwrap_or(path)
    }

    /// gmsh options for surfaces.
    fn numbers(&self) -> Vec<(&'static str, f64)> {
        let o = self.options;
        let per_turn = if o.divides_by_turning_angle() { 0 } else { o.per_turn };
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
}

/// Last lines of the log, truncated: gmsh may print thousands of numbers in one line.
fn log_tail(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(bytes);
    let lines: Vec<&str> = text.lines().filter(|l| !l.trim().is_empty()).collect();
    let cut = |line: &&str| line.chars().take(LINE_LENGTH).collect::<String>();
    let last = &lines[lines.len().saturating_sub(LOG_LINES)..];
    last.iter().map(cut).collect::<Vec<_>>().join("\n  ")
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), MeshError> {
    Ok(kanagata_files::write_atomic(path, |w| w.write_all(bytes))?)
}
