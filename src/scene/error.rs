//! Errors of a scene.

use std::path::PathBuf;

use kanagata_files::WrongKind;
use kanagata_solver::material::card::CardError;
use kanagata_tool::file::ToolFileError;

/// Key as a path into the scene; what was found; what is allowed.
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
        /// The error of the system.
        #[source]
        source: std::io::Error,
    },
    /// The text is not a valid scene.
    #[error("{}, line {line}, column {column}: {found}; allowed: the keys and values of schemas/scene.schema.json", path.display())]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// The error of the parser.
        found: String,
    },
    /// The file is of another kind.
    #[error(transparent)]
    Kind(#[from] WrongKind),
    /// The scene is not valid with the values that were set from outside.
    #[error("{} with {set}: {cause}", path.display())]
    Set {
        /// The file.
        path: PathBuf,
        /// The assignments.
        set: String,
        /// Key, what was found, what is allowed.
        cause: String,
    },
    /// A value is out of range.
    #[error("{}, {place}: found {found}; allowed: {allowed}", path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// Key as a path into the scene.
        place: String,
        /// What was found.
        found: String,
        /// What is allowed.
        allowed: String,
    },
    /// The mesh file of the blank cannot be used.
    #[error("{}, blank.shape.mesh.file: {cause}", path.display())]
    Blank {
        /// The scene.
        path: PathBuf,
        /// What is wrong with the file.
        cause: String,
    },
    /// A tool file cannot be used.
    #[error("{}, {place}: {cause}", path.display())]
    Tool {
        /// The scene.
        path: PathBuf,
        /// Key as a path into the scene.
        place: String,
        /// Whether the scene names the CAD of the tool.
        has_cad: bool,
        /// What is wrong with the tool file.
        cause: Box<ToolFileError>,
    },
    /// The material card file cannot be used.
    #[error("{}, material: {}: {cause}", path.display(), file.display())]
    CardFile {
        /// The scene.
        path: PathBuf,
        /// The card file.
        file: PathBuf,
        /// What is wrong with it.
        cause: String,
    },
    /// The material cannot be used.
    #[error("{}, material: {cause}", path.display())]
    Material {
        /// The scene.
        path: PathBuf,
        /// What is wrong with the card.
        cause: CardError,
    },
}
