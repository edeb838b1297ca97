//! Reading of IGES and STEP files into a [`Model`] of trimmed NURBS faces [mm].
//!
//! `iges` and `step` convert the text to a [`raw::RawModel`]: native surfaces, curves as in the file. `build` converts
//! that to the [`Model`]: exact NURBS, loops in the parameter plane, joined edges.

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
pub(crate) mod query_tests;
mod range;
pub mod raw;
pub mod region;
mod sheets;
pub mod step;
mod topology;
pub mod trim_region;

use std::path::Path;

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
    let bytes = crate::files::read(path, crate::files::Input::Cad)
        .map_err(|source| CadError::Io { path: path.to_path_buf(), source })?;
    let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let raw = read_raw(&bytes, &name)?;
    Ok(build::build_with(raw, &name, creases))
}

/// Reads the curves of an IGES or STEP file that bound no face [mm].
///
/// # Errors
/// [`CadError`] as for [`read`].
pub fn read_curves(path: &Path) -> Result<Vec<crate::geometry::nurbs::Curve3>, CadError> {
    let bytes = crate::files::read(path, crate::files::Input::Cad)
        .map_err(|source| CadError::Io { path: path.to_path_buf(), source })?;
    let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let is_step = bytes[..bytes.len().min(4096)].windows(12).any(|w| w == b"ISO-10303-21");
    if is_step { step::read_curves(&bytes, &name) } else { iges::read_curves(&bytes, &name) }
}

/// First bytes of compressed files.
const GZIP_START: [u8; 2] = [0x1f, 0x8b];
/// See [`GZIP_START`].
const ZIP_START: &[u8] = b"PK\x03\x04";

/// Identifies IGES or STEP by content and parses the bytes.
///
/// # Errors
/// [`CadError`] as for [`read`].
pub fn read_raw(bytes: &[u8], name: &str) -> Result<raw::RawModel, CadError> {
    let head = &bytes[..bytes.len().min(4096)];
    let step = head.windows(12).any(|w| w == b"ISO-10303-21");
    let text = |b: &u8| !b.is_ascii_control() || b.is_ascii_whitespace();
    let iges = head.len() > 72 && head[72] == b'S'
        || head
            .split(|b| *b == b'\n')
            .any(|line| line.len() > 72 && matches!(line[72], b'S' | b'G'));
    if step {
        step::read_bytes(bytes, name)
    } else if iges {
        iges::read_bytes(bytes, name)
    } else {
        let found = if bytes.is_empty() {
            "an empty file".to_owned()
        } else if head.starts_with(&GZIP_START) || head.starts_with(ZIP_START) {
            "a compressed file (gzip or zip), to be unpacked first".to_owned()
        } else if head.iter().all(text) {
            let first: String = String::from_utf8_lossy(head).chars().take(40).collect();
            format!("text that begins with {first:?}")
        } else {
            "bytes that are no text".to_owned()
        };
        Err(CadError::UnknownFormat { file: name.to_owned(), found })
    }
}
