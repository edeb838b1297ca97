//! Results that the searches in one model share: of single faces, of complete models, and the candidates for a goal
//! that is not reached.

use std::sync::{Arc, Mutex};

use rustc_hash::FxHashMap;

use super::face_result::FaceResult;
use super::faults::Faults;
use super::goal::{Goal, Refined};
use super::state::State;
use kanagata_mesh::SurfaceMesh;

/// Key of a result: face, divisions of its edges in loop order, density, mapped, and whether the mesh has interior nodes
/// that the coarsest meshes leave out.
pub(super) type Key = (usize, Vec<usize>, usize, bool, bool);

/// Result of a face with its errors as they are, and with those estimated after the vertex motion.
#[derive(Debug, Clone)]
pub(super) struct Evaluated {
    pub plain: Arc<FaceResult>,
    pub estimated: Arc<FaceResult>,
}

/// Results of all searches in one model.
pub(super) type Evaluations = Mutex<FxHashMap<Key, Evaluated>>;

impl Evaluated {
    /// As [`FaceResult::without_patches`].
    pub fn without_patches(error: f64) -> Self {
        let result = Arc::new(FaceResult::without_patches(error));
        Self { plain: Arc::clone(&result), estimated: result }
    }
}

/// A complete model with moved vertices, and its violations of the goal.
#[derive(Debug)]
pub(super) struct CompleteModel {
    pub goal: Goal,
    pub mesh: SurfaceMesh,
    pub refined: Refined,
    pub faults: Faults,
}

/// Complete models made by the searches in one model.
pub(super) type Models = Mutex<Vec<Arc<CompleteModel>>>;

/// Candidates of the searches in one model, each with its ratio of error to tolerance.
#[derive(Default)]
pub(super) struct Candidates {
    /// Complete model with the smallest ratio.
    pub model: Option<(f64, Arc<Refined>)>,
    /// State with the smallest ratio, and whether its mesh has the nodes that the coarsest meshes leave out.
    pub state: Option<(f64, State, bool)>,
}

/// Candidates, shared by the scopes of one model.
pub(super) type Closest = Mutex<Candidates>;
