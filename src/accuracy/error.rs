//! Why a sequence of runs ends without a result.

use std::path::PathBuf;

use kanagata_files::WriteError;
use kanagata_run::RunError;
use kanagata_scene::SceneError;

/// Why a sequence of runs ends without a result.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum AccuracyError {
    /// The scene cannot be read.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A run failed.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The results of a run cannot be read.
    #[error("{}: {found}; allowed: the files of a run of this scene; remove its folder to repeat it", path.display())]
    Results {
        /// The file.
        path: PathBuf,
        /// What was found.
        found: String,
    },
    /// No run of the sequence has converged, or that with the chosen options has not.
    #[error("{}: the run did not converge: {message}; give the scene a finer mesh, or a larger error", path.display())]
    NotConverged {
        /// Its record.
        path: PathBuf,
        /// Message of the solver.
        message: String,
    },
    /// The blank is a mesh file.
    #[error("{}: blank.shape.mesh: the elements of a mesh file cannot be changed; allowed with `accuracy`: rectangle, quarter_disc and disc", path.display())]
    MeshFile {
        /// The scene.
        path: PathBuf,
    },
    /// No accuracy is asked for.
    #[error("{}: accuracy: found none; allowed: an error for at least one of force, thickness, draw-in and springback", path.display())]
    NoAccuracy {
        /// The scene.
        path: PathBuf,
    },
    /// A quantity that the scene does not have.
    #[error("{}: accuracy.{key}: {found}", path.display())]
    NoQuantity {
        /// The scene.
        path: PathBuf,
        /// The key.
        key: &'static str,
        /// Why it cannot be judged, and what to do.
        found: &'static str,
    },
    /// A result cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}
