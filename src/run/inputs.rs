//! Digests of the inputs of a run.

use std::collections::BTreeMap;

use kanagata_scene::Plan;

/// SHA-256 of the scene and of the files it names: tools, mesh of the blank, material card, and the history whose
/// increments are followed.
#[must_use]
pub fn inputs(plan: &Plan) -> BTreeMap<String, String> {
    let tools = plan.scene.tools.iter().zip(&plan.tools);
    let tools = tools.map(|(tool, loaded)| (tool.file.clone(), loaded.sha256.clone()));
    let followed = plan.followed.iter().map(|f| (f.file.clone(), f.sha256.clone()));
    std::iter::once(("scene".to_owned(), plan.sha256.clone()))
        .chain(tools)
        .chain(plan.files.iter().map(|f| (f.file.clone(), f.sha256.clone())))
        .chain(followed)
        .collect()
}
