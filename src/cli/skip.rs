//! `--skip-bad-faces` for faces that cannot be meshed: the work continues without them.

use std::collections::BTreeMap;

use super::exit::Failure;
use super::terminal::err;
use crate::cad::Model;
use crate::convert::part::Part;
use crate::convert::tolerance::ToleranceError;
use crate::mesh::MeshError;

/// Applies `make` to `model`. If faces fail and `skips` is set, it is repeated for the part of the model without them,
/// which is also returned.
///
/// # Errors
/// The error of `make`, with face indices of `model`.
pub(super) fn skipping<T>(
    skips: bool,
    model: &Model,
    make: impl Fn(&Model) -> Result<T, Failure>,
) -> Result<(T, Option<Part>), Failure> {
    let mut bad: BTreeMap<usize, String> = BTreeMap::new();
    let mut part: Option<Part> = None;
    loop {
        let failure = match make(part.as_ref().map_or(model, |p| &p.model)) {
            Ok(made) => {
                warn(model, &bad);
                return Ok((made, part));
            }
            Err(failure) => failure,
        };
        let number = |f: usize| part.as_ref().map_or(f, |p| p.kept[f]);
        let failed = if skips { failed(&failure) } else { Vec::new() };
        let none = failed.is_empty();
        bad.extend(failed.into_iter().map(|(f, reason)| (number(f), reason)));
        let next = Part::without(model, &bad).filter(|_| !none);
        if next.is_none() {
            return Err(renumbered(failure, number));
        }
        part = next;
    }
}

/// Faces without which the work may continue, and the reasons.
fn failed(failure: &Failure) -> Vec<(usize, String)> {
    let error = &failure.error;
    let of_mesh = match error.downcast_ref::<ToleranceError>() {
        Some(ToleranceError::Mesh(error)) => Some(error),
        Some(ToleranceError::NoPatches { face, .. }) => {
            return vec![(*face, "its patches fold or cannot be made".into())];
        }
        _ => error.downcast_ref::<MeshError>(),
    };
    match of_mesh {
        Some(MeshError::Faces { failed, .. }) => failed.clone(),
        _ => Vec::new(),
    }
}

/// The same failure with other face indices.
pub(super) fn renumbered(mut failure: Failure, number: impl Fn(usize) -> usize) -> Failure {
    if let Some(ToleranceError::NotReached { face, .. } | ToleranceError::NoPatches { face, .. }) =
        failure.error.downcast_mut::<ToleranceError>()
    {
        *face = number(*face);
    }
    failure
}

fn warn(model: &Model, bad: &BTreeMap<usize, String>) {
    for (&f, reason) in bad {
        let source = &model.faces[f].source;
        err!("warning: face {f} ({source}) is left out: {reason}; the result lacks it");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::remedy::remedy;
    use crate::shapes::{holed_square, joined};

    /// Fails at the faces with these sources, like a mesher.
    fn failing(model: &Model, sources: &[&str]) -> Result<Vec<String>, Failure> {
        let is_bad = |f: &usize| sources.contains(&model.faces[*f].source.as_str());
        let failed: Vec<(usize, String)> =
            (0..model.faces.len()).filter(is_bad).map(|f| (f, "no region".into())).collect();
        let Some((face, reason)) = failed.first().cloned() else {
            return Ok(model.faces.iter().map(|f| f.source.clone()).collect());
        };
        let (count, total) = (failed.len(), model.faces.len());
        let source_entity = model.faces[face].source.clone();
        Err(MeshError::Faces { count, total, face, source_entity, reason, failed }.into())
    }

    fn three() -> Model {
        let mut model = joined(vec![holed_square(10.0), holed_square(20.0), holed_square(30.0)]);
        for (face, name) in model.faces.iter_mut().zip(["a", "b", "c"]) {
            face.source = name.into();
        }
        model
    }

    #[test]
    fn faces_that_cannot_be_meshed_are_left_out_and_lost() {
        let (made, part) = skipping(true, &three(), |m| failing(m, &["a", "c"])).unwrap();
        let part = part.unwrap();
        assert_eq!((made, part.kept), (vec!["b".to_owned()], vec![1]));
        let lost: Vec<&str> = part.model.lost.iter().map(|f| f.source.as_str()).collect();
        assert_eq!(lost, ["a", "c"]);
        assert!(part.model.edges.iter().flat_map(|e| &e.uses).all(|u| u[0] == 0));
    }

    #[test]
    fn without_leave_or_without_any_face_left_the_failure_stays() {
        for (skips, bad) in [(false, &["b"][..]), (true, &["a", "b", "c"])] {
            let failure = skipping(skips, &three(), |m| failing(m, bad)).unwrap_err();
            let remedy = remedy(&*failure.error).unwrap_or_default();
            assert!(remedy.contains("--skip-bad-faces"), "{remedy}");
        }
    }

    #[test]
    fn a_face_that_keeps_no_tolerance_is_named_by_its_number_in_the_whole_model() {
        let not_reached = |m: &Model| -> Result<(), Failure> {
            failing(m, &["a"])?;
            let source_entity = "c".to_owned();
            Err(ToleranceError::NotReached {
                face: 1,
                source_entity,
                found: 2.0,
                near: String::new(),
                allowed: 1.0,
                unit: "mm",
                patches: 1,
                spent: None,
            }
            .into())
        };
        let failure = skipping(true, &three(), not_reached).unwrap_err();
        assert!(failure.error.to_string().contains("(face 2)"), "{}", failure.error);
    }
}
