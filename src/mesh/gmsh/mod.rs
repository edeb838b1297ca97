//! Driver of the gmsh program. It runs on the same CAD file in a temporary folder under a time limit; its mesh is
//! checked and attached to the faces of the model. The exit code is ignored.
//!
//! - [`outline`]: curves and surfaces as read by gmsh, from a first run that meshes the curves
//! - [`plan`]: surfaces with three or four sides as transfinite grids, with consistent divisions of their curves
//! - [`script`], [`run`]: input of gmsh and its execution
//!
//! A grid that folds or has a wrong area is rejected, and its surface is meshed with the chosen algorithm.

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

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

pub use self::options::{GmshAlgorithm, GmshOptions};

use self::faults::Fault;
use self::plan::Plan;
use self::run::Run;
use super::external::{from_any_folder, on_path, work_folder};
use super::inverted::{self, Mended};
use super::{MeshError, MeshReport, SurfaceMesh, attach};
use kanagata_cad::Model;
use kanagata_geometry::Aabb;

/// A mesh made by gmsh.
#[derive(Debug, Clone, PartialEq)]
pub struct GmshMesh {
    /// The mesh, attached to the model.
    pub mesh: SurfaceMesh,
    /// Faces suitable for a grid but meshed otherwise, with the reason.
    pub notes: Vec<String>,
}

/// Smallest element size relative to the model's diagonal: curvature is unbounded at an apex.
const SIZE_MIN_REL: f64 = 1e-4;
/// Message for a part whose faces are not sewn.
const UNSEWN_TEXT: &str = "gmsh does not mesh the faces of this part when they are sewn: unless the file itself joins them, \
                      the mesh has borders between them";
/// Rounds in which defective grids are rejected individually; after them all grids are rejected.
const REJECTION_ROUNDS: usize = 3;

/// Meshes a CAD file with gmsh and attaches the result to `model`, read from the same file.
///
/// # Errors
/// [`MeshError::Option`]; [`MeshError::GmshAbsent`]; [`MeshError::GmshFailed`] with the end of the log when there is no
/// mesh or the time limit is reached; [`MeshError::Check`] for missing faces, inverted elements or a wrong area.
pub fn mesh(cad: &Path, model: &Model, options: &GmshOptions) -> Result<GmshMesh, MeshError> {
    options.check()?;
    let program = find(options.program.as_deref())?;
    let folder = work_folder("gmsh")?;
    let diagonal = model.faces.iter().fold(Aabb::EMPTY, |b, f| b.union(&f.bbox())).diagonal();
    let mut options = options.clone();
    options.size[0] = options.size[0].or(Some(SIZE_MIN_REL * diagonal));
    let mut run = Run::new(&program, cad, folder.path(), &options, model.join_tolerance)?;
    match checked(&run, model, &options) {
        Err(error) if run.is_sewn() => {
            run.disable_sewing();
            // If this fails as well, the first error is the more informative one.
            let mut made = checked(&run, model, &options).map_err(|_| error)?;
            made.notes.insert(0, UNSEWN_TEXT.into());
            Ok(made)
        }
        other => other,
    }
}

/// A mesh with valid grids, after the check of faces and areas.
fn checked(run: &Run<'_>, model: &Model, options: &GmshOptions) -> Result<GmshMesh, MeshError> {
    let (mut mesh, mut notes) = with_grids(run, model, options)?;
    let mut report = MeshReport::new(&mesh, model);
    if report.inverted > 0 {
        let mended = inverted::mend(&mut mesh, model);
        notes.extend(note_of_mending(&mended));
        inverted::check(&mesh, model)?;
        report = MeshReport::new(&mesh, model);
    }
    report.check(model, options.area_tolerance)?;
    report.check_faces(model, options.face_tolerance())?;
    Ok(GmshMesh { mesh, notes })
}

/// Message on changes of the mesh; `None` without any.
fn note_of_mending(mended: &Mended) -> Option<String> {
    let Mended { inverted, moved, split, .. } = mended;
    (moved + split > 0).then(|| {
        format!(
            "{inverted} elements of gmsh were inverted against the CAD normal: {moved} nodes moved on their faces, {split} \
             quadrilaterals split in two triangles"
        )
    })
}

/// The mesh attached to the model, with the elements of each surface oriented alike: gmsh orients them so, and an
/// element that looks the other way is inverted.
fn attached(found: &SurfaceMesh, model: &Model) -> Result<SurfaceMesh, MeshError> {
    let mut mesh = attach(found, model)?;
    let turned = |k: usize| mesh.elements[k].nodes() != found.elements[k].nodes();
    let turned: Vec<bool> = (0..mesh.elements.len()).map(turned).collect();
    let mut votes: BTreeMap<u32, [usize; 2]> = BTreeMap::new();
    for (e, &turned) in found.elements.iter().zip(&turned) {
        votes.entry(e.face).or_default()[usize::from(turned)] += 1;
    }
    for (k, e) in found.elements.iter().enumerate() {
        let [kept, reversed] = votes[&e.face];
        if turned[k] != (reversed > kept) {
            mesh.elements[k] = mesh.elements[k].reversed();
        }
    }
    Ok(mesh)
}

/// The mesh with as many valid grids as possible, and the reasons for those rejected.
fn with_grids(
    run: &Run<'_>,
    model: &Model,
    options: &GmshOptions,
) -> Result<(SurfaceMesh, Vec<String>), MeshError> {
    let mut notes = Vec::new();
    if !options.has_grids() && !options.divides_by_turning_angle() {
        return Ok((attached(&run.surfaces(&Plan::default())?, model)?, notes));
    }
    let outline = run.outline()?;
    let mut refused = BTreeSet::new();
    for round in 0..=REJECTION_ROUNDS {
        if round == REJECTION_ROUNDS && refused.len() < outline.surfaces.len() {
            notes.push(
                "without the grids that fold, others fold: no face is meshed as a transfinite grid"
                    .into(),
            );
            refused.extend(outline.surfaces.keys().copied());
        }
        let plan = Plan::new(&outline, options, &refused);
        let found = run.surfaces(&plan).and_then(|found| Ok((attached(&found, model)?, found)));
        let (mesh, found) = match found {
            Err(error) if !plan.grids.is_empty() => {
                notes.push(note_without_grids(&error));
                refused.extend(outline.surfaces.keys().copied());
                continue;
            }
            other => other?,
        };
        let faults = faults::of_grids(&plan, &found, &mesh, model, options.face_tolerance());
        let texts = faults.iter().map(|f| f.note(model)).filter(|note| !notes.contains(note));
        notes.extend(texts.collect::<Vec<_>>());
        refused.extend(faults.iter().filter(|f| f.is_bad()).map(Fault::surface));
        if !faults.iter().any(Fault::is_bad) {
            return Ok((mesh, notes));
        }
    }
    let mesh = attached(&run.surfaces(&Plan::default())?, model)?;
    Ok((mesh, notes))
}

/// Message that no mesh with grids was made, with the first line of the reason.
fn note_without_grids(error: &MeshError) -> String {
    let reason = error.to_string();
    let reason = reason.lines().next().unwrap_or_default();
    format!("no mesh with grids, one without them is made: {reason}")
}

/// Absolute path of the gmsh program: as given (relative to the current folder), then KANAGATA_GMSH, then PATH.
///
/// # Errors
/// [`MeshError::GmshAbsent`] with the locations searched.
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
