//! The gmsh program: found, run on the same CAD file in a folder of its own under a time limit, its
//! mesh checked and put back on our faces. Its exit code is not trusted.
//!
//! - [`outline`]: what gmsh makes of the file, from a first run that divides its curves
//! - [`plan`]: surfaces with three or four sides meshed as grids, the divisions of their curves agreed
//! - [`script`], [`run`]: what gmsh is told, and how it is started
//!
//! A grid that folds or is off in area is given up, and its surface meshed by the chosen algorithm.

mod faults;
mod options;
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

pub use self::options::{GmshAlgorithm, GmshOptions};

use self::faults::Fault;
use self::plan::Plan;
use self::run::Run;
use super::outside::{from_any_folder, on_path, work_folder};
use super::{MeshError, MeshReport, SurfaceMesh, attach};
use crate::cad::Model;
use crate::geometry::Aabb;

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
                notes.push(note_without_grids(&error));
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

/// Notes that there is no mesh with grids, with the first line of the reason.
fn note_without_grids(error: &MeshError) -> String {
    let reason = error.to_string();
    let reason = reason.lines().next().unwrap_or_default();
    format!("no mesh with grids, one without them is made: {reason}")
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
