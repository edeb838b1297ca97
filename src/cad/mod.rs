//! Reading of IGES and STEP files into a [`Model`] of trimmed NURBS faces [mm].
//!
//! `iges` and `step` convert the text to a [`raw::RawModel`]: native surfaces, curves as in the file. `build` converts
//! that to the [`Model`]: exact NURBS, loops in the parameter plane, joined edges.

#[cfg(test)]
extern crate self as kanagata_cad;

mod analytic;
mod area;
pub mod attributes;
mod bodies;
mod bounds;
pub mod build;
mod build_diagnostics;
pub mod closest;
mod creases;
mod diagnostic;
mod error;
pub mod health;
pub mod iges;
pub mod inspect;
mod inverse;
mod loops;
pub mod model;
mod native;
mod numbers;
pub mod offset;
mod orient;
#[cfg(test)]
#[allow(dead_code)] // Some of these shapes are for the tests of other modules.
pub(crate) mod query_tests;
mod range;
pub mod raw;
pub mod region;
mod sheets;
pub mod step;
mod topology;
pub mod trim_region;
pub mod usable;

use std::path::Path;

use kanagata_files::FileKind;

pub use build::Creases;
pub use diagnostic::{Diagnostic, Severity};
pub use error::CadError;
pub use model::Model;

/// Reads an IGES or STEP file, identified by content, into a model [mm] and diagnostics.
///
/// # Errors
/// [`CadError`] when the file cannot be read or its text cannot be repaired.
pub fn read(path: &Path) -> Result<(Model, Vec<Diagnostic>), CadError> {
    read_with(path, Creases::Kept)
}

/// As [`read`], with a choice of the treatment of creases inside faces. A tool model needs faces split along creases,
/// because a smooth patch cannot cross one.
///
/// # Errors
/// [`CadError`] as for [`read`].
pub fn read_with(path: &Path, creases: Creases) -> Result<(Model, Vec<Diagnostic>), CadError> {
    let bytes = kanagata_files::read(path, kanagata_files::Input::Cad)
        .map_err(|source| CadError::Io { path: path.to_path_buf(), source })?;
    let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let raw = read_raw(&bytes, &name)?;
    Ok(build::build_with(raw, &name, creases))
}

/// Reads the curves of an IGES or STEP file that bound no face [mm].
///
/// # Errors
/// [`CadError`] as for [`read`].
pub fn read_curves(path: &Path) -> Result<Vec<kanagata_geometry::nurbs::Curve3>, CadError> {
    let bytes = kanagata_files::read(path, kanagata_files::Input::Cad)
        .map_err(|source| CadError::Io { path: path.to_path_buf(), source })?;
    let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    if FileKind::of(&bytes) == Some(FileKind::Step) {
        step::read_curves(&bytes, &name)
    } else {
        iges::read_curves(&bytes, &name)
    }
}

/// Identifies IGES or STEP by content and parses the bytes.
///
/// # Errors
/// [`CadError`] as for [`read`].
pub fn read_raw(bytes: &[u8], name: &str) -> Result<raw::RawModel, CadError> {
    let found = match FileKind::of(bytes) {
        Some(FileKind::Step) => return step::read_bytes(bytes, name),
        Some(FileKind::Iges) => return iges::read_bytes(bytes, name),
        Some(other) => other.to_string(),
        None => {
            let first = String::from_utf8_lossy(&bytes[..bytes.len().min(160)]);
            format!("text that begins with {:?}", first.chars().take(40).collect::<String>())
        }
    };
    Err(CadError::UnknownFormat { file: name.to_owned(), found })
}
