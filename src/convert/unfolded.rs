//! The built-in mesh, its faces divided more finely where their patches fold.

use super::{ConvertError, ConvertOptions, ConvertReport, convert};
use crate::cad::Model;
use crate::mesh::MeshError;
use crate::mesh::mapped::MappedOptions;
use crate::mesh::mapped::plan::Plan;
use crate::tool::ToolModel;

/// Times the folded faces are divided more finely.
const ROUNDS: usize = 12;
/// Times without fewer folded patches, after which it ends.
const PATIENCE: usize = 4;
/// Patches over those of the mesh as asked, at which it ends.
const MOST_TIMES: usize = 16;

/// Why there is no model.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum UnfoldedError {
    /// No mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// No tool model.
    #[error(transparent)]
    Convert(#[from] ConvertError),
}

/// Meshes and converts `model`. A face of which patches fold is meshed again with a third more divisions of its edges
/// and of its inside, until none folds; [`ConvertReport::finer`] lists those faces. Where that does not help, the model
/// with the fewest folded patches.
///
/// # Errors
/// [`UnfoldedError`]: as the mesher and [`convert`] say.
pub fn mesh_and_convert(
    model: &Model,
    mesh: &MappedOptions,
    options: &ConvertOptions,
) -> Result<(ToolModel, ConvertReport), UnfoldedError> {
    let plan = Plan::new(model, mesh)?;
    let mut minima = plan.minima().to_vec();
    let mut density = vec![mesh.arc_divisions; model.faces.len()];
    let mut best = convert(model, &plan.mesh(&minima, &density)?, options)?;
    let most = MOST_TIMES * best.0.patches.len();
    let mut folded = faces_of(&best);
    let mut finer = vec![false; model.faces.len()];
    let mut in_vain = 0;
    for _ in 0..ROUNDS {
        if folded.is_empty() || in_vain == PATIENCE {
            break;
        }
        let counts = plan.agree(&minima).counts;
        let more = |n: usize| n + n.div_ceil(3);
        for &f in &folded {
            finer[f] = true;
            density[f] = more(density[f]);
            let uses = model.faces[f].loops.iter().flat_map(|l| &l.uses);
            for e in uses.filter_map(|u| u.edge) {
                minima[e] = minima[e].max(more(counts[e]));
            }
        }
        // Too fine to be meshed, or a vertex without a normal: what there is.
        let Ok(mesh) = plan.mesh(&minima, &density) else { break };
        let Ok(next) = convert(model, &mesh, options) else { break };
        if next.0.patches.len() > most {
            break;
        }
        folded = faces_of(&next);
        in_vain += 1;
        if next.1.folded.len() < best.1.folded.len() {
            best = next;
            best.1.finer = (0..finer.len()).filter(|&f| finer[f]).collect();
            in_vain = 0;
        }
    }
    Ok(best)
}

/// Faces with a folded patch, each once.
fn faces_of((tool, report): &(ToolModel, ConvertReport)) -> Vec<usize> {
    let mut faces: Vec<usize> =
        report.folded.iter().map(|&k| tool.faces[k as usize] as usize).collect();
    faces.sort_unstable();
    faces.dedup();
    faces
}
