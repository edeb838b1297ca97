//! Why a scene cannot be run.

use std::path::PathBuf;

use crate::solver::material::card::CardError;
use crate::tool::file::ToolFileError;

/// Key, as a path into the scene; what was found; what is allowed.
pub type Fault = (String, String, String);

/// Why a scene cannot be run.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The scene file cannot be opened or read.
    #[error("cannot read scene {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        #[source]
        source: std::io::Error,
    },
    /// The text is not a scene.
    #[error("{}, line {line}, column {column}: {found}; allowed: the keys and values of schemas/scene.schema.json", path.display())]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What the reader says.
        found: String,
    },
    /// A value out of its range.
    #[error("{}, {place}: found {found}; allowed: {allowed}", path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// Key, as a path into the scene.
        place: String,
        /// What was found.
        found: String,
        /// What is allowed.
        allowed: String,
    },
    /// The blank's mesh file cannot be used.
    #[error("{}, blank.shape.mesh.file: {cause}", path.display())]
    Blank {
        /// The scene.
        path: PathBuf,
        /// What is wrong with the file.
        cause: String,
    },
    /// A tool file that cannot be used.
    #[error("{}, {place}: {cause}", path.display())]
    Tool {
        /// The scene.
        path: PathBuf,
        /// Key, as a path into the scene.
        place: String,
        /// What is wrong with the tool file.
        cause: Box<ToolFileError>,
    },
    /// The material's card file cannot be used.
    #[error("{}, material: {}: {cause}", path.display(), file.display())]
    CardFile {
        /// The scene.
        path: PathBuf,
        /// The card file.
        file: PathBuf,
        /// What is wrong with it.
        cause: String,
    },
    /// A material that cannot be used.
    #[error("{}, material: {cause}", path.display())]
    Material {
        /// The scene.
        path: PathBuf,
        /// What is wrong with the card.
        cause: CardError,
    },
}
