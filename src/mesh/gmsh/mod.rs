//! The gmsh program: found, run on the same CAD file in a folder of its own under a time limit, its
//! mesh checked and put back on our faces. Its exit code is not trusted.
//!
//! - [`outline`]: what gmsh makes of the file, from a first run that divides its curves
//! - [`plan`]: surfaces with three or four sides meshed as grids, the divisions of their curves agreed
//! - [`script`], [`run`]: what gmsh is told, and how it is started
//!
//! A grid that folds or is off in area is given up, and its surface meshed by the chosen algorithm.

mod faults;
mod outline;
mod plan;
#[cfg(test)]
mod real_tests;
mod run;
mod script;
#[cfg(all(test, unix))]
mod tests;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use self::faults::Fault;
use self::plan::Plan;
use self::run::Run;
use super::mapped::MeshStyle;
use super::outside::{from_any_folder, on_path, work_folder};
use super::{MeshError, MeshReport, SurfaceMesh, attach};
use crate::cad::Model;
use crate::geometry::Aabb;

/// gmsh's algorithms for surfaces, with its own numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GmshAlgorithm {
    /// MeshAdapt.
    MeshAdapt = 1,
    /// Automatic.
    Automatic = 2,
    /// The triangulation of the divided edges, without points inside.
    InitialOnly = 3,
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
    /// Structured: grids of quads where the CAD allows, triangles joined to quads elsewhere; mixed: triangles
    /// elsewhere; quads: triangles joined to quads everywhere; triangles.
    pub style: MeshStyle,
    /// No grids, whatever the style.
    pub unstructured: bool,
    /// Algorithm for surfaces.
    pub algorithm: GmshAlgorithm,
    /// Elements for 360 degrees of turn: of curves around grids, elsewhere `Mesh.MeshSizeFromCurvature`; 0 = off.
    pub per_turn: usize,
    /// Smallest and largest element size (mm); `None` = gmsh's own.
    pub size: [Option<f64>; 2],
    /// Time limit (s) for all runs on a part; gmsh is killed when it takes longer.
    pub limit_s: f64,
    /// Allowed difference of area from the model's, relative; of the whole and of each face.
    pub area_tolerance: f64,
}

impl Default for GmshOptions {
    fn default() -> Self {
        Self {
            program: None,
            style: MeshStyle::Structured,
            unstructured: false,
            algorithm: GmshAlgorithm::FrontalDelaunay,
            per_turn: 16,
            size: [None, None],
            limit_s: 300.0,
            area_tolerance: 0.05,
        }
    }
}

impl GmshOptions {
    /// Surfaces with three or four sides become grids; quasi-structured meshes are made without them in any case.
    fn has_grids(&self) -> bool {
        !self.unstructured
            && self.algorithm != GmshAlgorithm::QuasiStructured
            && matches!(self.style, MeshStyle::Structured | MeshStyle::Mixed)
    }

    /// Allowed difference of area of one face, relative: squared half angle of an element, which flat elements
    /// in two curved directions keep, and so much as chords of circles take off flat rings.
    fn face_tolerance(&self) -> f64 {
        match self.per_turn {
            0 => self.area_tolerance,
            n => (std::f64::consts::PI / n as f64).powi(2).clamp(0.05, 0.7),
        }
    }

    /// Curves are divided by their turn, not by gmsh: BAMG does not end with sizes from curvature.
    fn divides_bends(&self) -> bool {
        self.algorithm == GmshAlgorithm::Bamg
    }

    fn check(&self) -> Result<(), MeshError> {
        if self.limit_s.is_finite() && self.limit_s > 0.0 {
            return Ok(());
        }
        let found = self.limit_s.to_string();
        Err(MeshError::Option { option: "--gmsh-limit", found, allowed: "seconds above zero" })
    }
}

/// A mesh made by gmsh.
#[derive(Debug, Clone, PartialEq)]
pub struct GmshMesh {
    /// The mesh, attached to the model.
    pub mesh: SurfaceMesh,
    /// Faces that could have been grids and are not, with the reason.
    pub notes: Vec<String>,
}

/// gmsh's smallest element as a share of the model's diagonal: at an apex curvature has no bound.
const SMALLEST: f64 = 1e-4;
/// Said of a part whose faces are left as they are in the file.
const UNSEWN: &str = "gmsh does not mesh the faces of this part when they are sewn: unless the file itself joins them, \
                      the mesh has borders between them";
/// Rounds in which grids are given up one by one; then all are.
const ROUNDS: usize = 3;

/// Meshes a CAD file with gmsh and attaches the result to `model`, which was read from the same file.
///
/// # Errors
/// [`MeshError::Option`]; [`MeshError::GmshAbsent`]; [`MeshError::GmshFailed`] with the log's last lines when there
/// is no mesh or the time is over; [`MeshError::Check`] when faces are missing or the area is off.
pub fn mesh(cad: &Path, model: &Model, options: &GmshOptions) -> Result<GmshMesh, MeshError> {
    options.check()?;
    let program = find(options.program.as_deref())?;
    let folder = work_folder("gmsh")?;
    let diagonal = model.faces.iter().fold(Aabb::EMPTY, |b, f| b.union(&f.bbox())).diagonal();
    let mut options = options.clone();
    options.size[0] = options.size[0].or(Some(SMALLEST * diagonal));
    let mut run = Run::new(&program, cad, folder.path(), &options, model.join_tolerance)?;
    match checked(&run, model, &options) {
        Err(error) if run.is_sewn() => {
            run.leave_unsewn();
            // The first reason is the better one where this way leads nowhere either.
            let mut made = checked(&run, model, &options).map_err(|_| error)?;
            made.notes.insert(0, UNSEWN.into());
            Ok(made)
        }
        other => other,
    }
}

/// Grids where they are sound, faces and areas checked.
fn checked(run: &Run<'_>, model: &Model, options: &GmshOptions) -> Result<GmshMesh, MeshError> {
    let (mesh, notes) = with_grids(run, model, options)?;
    let report = MeshReport::new(&mesh, model);
    report.check(model, options.area_tolerance)?;
    report.check_faces(model, options.face_tolerance())?;
    Ok(GmshMesh { mesh, notes })
}

/// The mesh with as many grids as are sound, and why others are not.
fn with_grids(
    run: &Run<'_>,
    model: &Model,
    options: &GmshOptions,
) -> Result<(SurfaceMesh, Vec<String>), MeshError> {
    let mut notes = Vec::new();
    if !options.has_grids() && !options.divides_bends() {
        return Ok((attach(&run.surfaces(&Plan::default())?, model)?, notes));
    }
    let outline = run.outline()?;
    let mut refused = BTreeSet::new();
    for round in 0..=ROUNDS {
        if round == ROUNDS && refused.len() < outline.surfaces.len() {
            notes.push(
                "without the grids that fold, others fold: no face is meshed as a transfinite grid"
                    .into(),
            );
            refused.extend(outline.surfaces.keys().copied());
        }
        let plan = Plan::new(&outline, options, &refused);
        let found = run.surfaces(&plan).and_then(|found| Ok((attach(&found, model)?, found)));
        let (mesh, found) = match found {
            Err(error) if !plan.grids.is_empty() => {
                let reason = error.to_string();
                let reason = reason.lines().next().unwrap_or_default();
                notes.push(format!("no mesh with grids, one without them is made: {reason}"));
                refused.extend(outline.surfaces.keys().copied());
                continue;
            }
            other => other?,
        };
        let faults = faults::of_grids(&plan, &found, &mesh, model, options.face_tolerance());
        let said = faults.iter().map(|f| f.note(model)).filter(|note| !notes.contains(note));
        notes.extend(said.collect::<Vec<_>>());
        refused.extend(faults.iter().filter(|f| f.is_bad()).map(Fault::surface));
        if !faults.iter().any(Fault::is_bad) {
            return Ok((mesh, notes));
        }
    }
    let mesh = attach(&run.surfaces(&Plan::default())?, model)?;
    Ok((mesh, notes))
}

/// The gmsh program, with its whole path: as named (relative to the current folder), else by KANAGATA_GMSH, else on PATH.
///
/// # Errors
/// [`MeshError::GmshAbsent`] says where it was looked for.
pub fn find(named: Option<&Path>) -> Result<PathBuf, MeshError> {
    let named = named.map(Path::to_path_buf);
    let named = named.or_else(|| std::env::var_os("KANAGATA_GMSH").map(PathBuf::from));
    if let Some(path) = named.filter(|p| !p.as_os_str().is_empty()) {
        if path.is_file() {
            return Ok(from_any_folder(path));
        }
        return Err(MeshError::GmshAbsent { tried: format!("no file {}", path.display()) });
    }
    on_path(&["gmsh", "gmsh.exe"]).ok_or_else(|| MeshError::GmshAbsent {
        tried: "no gmsh on PATH, KANAGATA_GMSH not set".into(),
    })
}
