//! Consistent orientation of joined faces.

use super::model::{Model, SurfaceKind};
use super::{Diagnostic, Severity};

impl Model {
    /// Reverses the orientation of every face.
    pub fn flip(&mut self) {
        self.faces.iter_mut().for_each(|f| f.flipped = !f.flipped);
    }
}

/// True when a face traverses an edge against its curve, seen from outside. Loops are counter-clockwise in the
/// parameter plane, so that a flipped face traverses them in opposite direction.
pub(super) fn runs_against(model: &Model, [f, l, k]: [usize; 3]) -> bool {
    model.faces[f].loops[l].uses[k].reversed ^ model.faces[f].flipped
}

/// Orients faces consistently: two faces traverse a shared edge in opposite directions. In each connected part the
/// orientation of the majority is kept.
pub(super) fn make_consistent(model: &mut Model) -> Vec<Diagnostic> {
    let neighbours = neighbours(model);
    let mut turn: Vec<Option<bool>> = vec![None; model.faces.len()];
    let mut diagnostics = Vec::new();
    for first in 0..model.faces.len() {
        if turn[first].is_some() {
            continue;
        }
        let (part, one_sided) = traverse(first, &neighbours, &mut turn);
        let turned = part.iter().filter(|&&f| turn[f] == Some(true)).count();
        let majority = 2 * turned > part.len();
        let flips: Vec<usize> =
            part.iter().copied().filter(|&f| turn[f] == Some(!majority)).collect();
        diagnostics.extend(flips.iter().filter_map(|&f| doubt(model, f)));
        for &f in &flips {
            model.faces[f].flipped = !model.faces[f].flipped;
        }
        let (of, place) = (part.len(), &model.faces[first].source);
        let mut say = |severity, code, text| {
            diagnostics.push(Diagnostic { severity, code, place: place.clone(), text });
        };
        if !flips.is_empty() {
            let text = format!(
                "{} of {of} joined faces reversed to agree with their neighbours",
                flips.len()
            );
            say(Severity::Note, "faces-turned", text);
        }
        if one_sided {
            let text = format!(
                "{of} joined faces have no consistent orientation (a one-sided surface, or coincident faces)"
            );
            say(Severity::Warning, "one-sided", text);
        }
    }
    diagnostics
}

/// Warning `side-doubtful` for a face to be reversed whose region follows from the direction of its loops. On a closed
/// surface loops bound two regions; a face of a shell that contradicts its neighbours may be the wrong one.
fn doubt(model: &Model, f: usize) -> Option<Diagnostic> {
    let face = &model.faces[f];
    let is_own = |edge: usize| model.edges[edge].uses.iter().all(|u| u[0] == f);
    let has_natural_border = || {
        let [outer, _, ..] = face.loops.as_slice() else { return false };
        outer.uses.iter().all(|u| u.edge.is_none_or(is_own))
    };
    let is_closed = matches!(face.kind, SurfaceKind::Sphere | SurfaceKind::Torus);
    if face.shell.is_none() || !(is_closed || has_natural_border()) {
        return None;
    }
    let text = "its loops run against those of its neighbours in the shell, and its surface is closed: the face may be the \
                region on the other side of its loops; compare its area with that in the CAD, or export it again"
        .into();
    let place = face.source.clone();
    Some(Diagnostic { severity: Severity::Warning, code: "side-doubtful", place, text })
}

/// For each face its neighbours across edges, and whether their orientations agree.
fn neighbours(model: &Model) -> Vec<Vec<(usize, bool)>> {
    let mut neighbours: Vec<Vec<(usize, bool)>> = vec![Vec::new(); model.faces.len()];
    for edge in &model.edges {
        let [a, b] = edge.uses[..] else { continue };
        if a[0] != b[0] {
            let agree = runs_against(model, a) != runs_against(model, b);
            neighbours[a[0]].push((b[0], agree));
            neighbours[b[0]].push((a[0], agree));
        }
    }
    neighbours
}

/// Traverses the faces connected to `first` and marks those to be reversed; true when no consistent orientation exists.
fn traverse(
    first: usize,
    neighbours: &[Vec<(usize, bool)>],
    turn: &mut [Option<bool>],
) -> (Vec<usize>, bool) {
    turn[first] = Some(false);
    let (mut part, mut at, mut one_sided) = (vec![first], 0, false);
    while let Some(&face) = part.get(at) {
        at += 1;
        let own = turn[face].unwrap_or(false);
        for &(other, agree) in &neighbours[face] {
            let wanted = own ^ !agree;
            match turn[other] {
                None => {
                    turn[other] = Some(wanted);
                    part.push(other);
                }
                Some(there) => one_sided |= there != wanted,
            }
        }
    }
    (part, one_sided)
}
