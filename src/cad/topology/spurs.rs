//! Spurs: edges that a loop traverses and immediately retraces.

use std::collections::VecDeque;

use crate::model::{EdgeUse, Model};
use kanagata_geometry::Vec2;

/// Distance between two passes along an edge in the parameter plane, relative to the surface, below which they
/// coincide. Passes along a seam are one period apart; files give parameters to six digits.
const COINCIDENCE_TOLERANCE_REL: f64 = 1e-3;

/// Removes spurs from the loops, and unused edges from the model. Loops that consist of spurs only are kept.
pub(super) fn remove(model: &mut Model) {
    let mut removed = false;
    for face in &mut model.faces {
        let [u, v] = face.surface.domain();
        let near = Vec2::new(u[1] - u[0], v[1] - v[0]) * COINCIDENCE_TOLERANCE_REL;
        for trim in &mut face.loops {
            let kept = outside_spurs(&trim.uses, near);
            if kept.len() < trim.uses.len() && kept.len() > 1 {
                trim.uses = kept.into_iter().map(|k| trim.uses[k].clone()).collect();
                removed = true;
            }
        }
    }
    if removed {
        drop_unused(model);
    }
}

/// Positions of the uses that are not part of a spur.
fn outside_spurs(uses: &[EdgeUse], near: Vec2) -> VecDeque<usize> {
    let mut kept: VecDeque<usize> = VecDeque::with_capacity(uses.len());
    for (k, side) in uses.iter().enumerate() {
        match kept.back() {
            Some(&before) if retraces(&uses[before], side, near) => {
                kept.pop_back();
            }
            _ => kept.push_back(k),
        }
    }
    // A spur at the start of the loop.
    while let (Some(&first), Some(&last)) = (kept.front(), kept.back()) {
        if kept.len() < 2 || !retraces(&uses[last], &uses[first], near) {
            break;
        }
        kept.pop_front();
        kept.pop_back();
    }
    kept
}

/// True when the second use of an edge retraces the first, within `near` in both parameters.
fn retraces(there: &EdgeUse, back: &EdgeUse, near: Vec2) -> bool {
    if there.edge.is_none() || there.edge != back.edge || there.reversed == back.reversed {
        return false;
    }
    let at = |u: &EdgeUse, s: f64| {
        let [a, b] = u.pcurve.domain();
        u.pcurve.point(a + (b - a) * s)
    };
    [0.0, 0.5, 1.0].iter().all(|&s| {
        let off = (at(there, s) - at(back, 1.0 - s)).abs();
        off.x <= near.x && off.y <= near.y
    })
}

fn drop_unused(model: &mut Model) {
    let mut used = vec![false; model.edges.len()];
    let uses = || model.faces.iter().flat_map(|f| &f.loops).flat_map(|l| &l.uses);
    uses().filter_map(|u| u.edge).for_each(|e| used[e] = true);
    let mut next = 0;
    let numbers: Vec<usize> = used
        .iter()
        .map(|&kept| {
            next += usize::from(kept);
            next.saturating_sub(1)
        })
        .collect();
    let mut kept = used.iter();
    model.edges.retain(|_| *kept.next().unwrap_or(&true));
    for side in model.faces.iter_mut().flat_map(|f| &mut f.loops).flat_map(|l| &mut l.uses) {
        side.edge = side.edge.map(|e| numbers[e]);
    }
}

#[cfg(test)]
mod tests {
    use super::{EdgeUse, Vec2, retraces};
    use crate::Diagnostic;
    use crate::build::build;
    use crate::model::Model;
    use crate::raw::{RawEdge, RawFace, RawLoop, RawModel, RawSurface};
    use kanagata_geometry::nurbs::{Curve2, Curve3};
    use kanagata_geometry::{Frame, Vec3};

    /// A square face whose boundary passes through `corners`.
    fn plate(corners: &[[f64; 4]]) -> (Model, Vec<Diagnostic>) {
        let edge = |[a, b, c, d]: &[f64; 4]| RawEdge {
            curve: Some(Curve3::line(Vec3::new(*a, *b, 0.0), Vec3::new(*c, *d, 0.0))),
            ..RawEdge::default()
        };
        let ring = RawLoop { outer: None, edges: corners.iter().map(edge).collect(), vertex: None };
        let surface = RawSurface::Plane(Frame::world());
        let face = RawFace {
            surface,
            loops: vec![ring],
            flipped: false,
            source: "face".into(),
            shell: None,
            attributes: Default::default(),
        };
        build(RawModel { faces: vec![face], ..RawModel::default() }, "face")
    }

    #[test]
    fn an_overshoot_bridged_back_is_taken_out_of_the_loop() {
        let mut sides = [
            [0.0, 0.0, 10.3, 0.0],
            [10.0, 0.0, 10.0, 10.0],
            [10.0, 10.0, 0.0, 10.0],
            [0.0, 10.0, 0.0, 0.0],
        ];
        // For any start of the loop.
        for _ in 0..4 {
            sides.rotate_left(1);
            let (model, said) = plate(&sides);
            assert!(said.iter().any(|d| d.code == "loop-open"), "{said:?}");
            let uses = model.faces[0].loops[0].uses.len();
            assert_eq!((model.edges.len(), model.vertices.len(), uses), (4, 4, 4));
            assert!(model.edges.iter().all(|e| e.uses.len() == 1), "{:?}", model.edges);
            assert!((model.faces[0].area(1e-12) - 100.0).abs() < 1e-9);
        }
    }

    /// A short spur with parameters of six digits, and a seam.
    #[test]
    fn ways_back_are_told_from_seams_by_the_size_of_the_surface() {
        let way = |from: [f64; 2], to: [f64; 2], reversed| EdgeUse {
            pcurve: Curve2::line(from.into(), to.into()),
            edge: Some(7),
            reversed,
        };
        let there = way([4.886361, 0.744298], [4.886174, 0.7443], false);
        let back = way([4.886175, 0.7443], [4.886361, 0.744299], true);
        let near = Vec2::new(5e-3, 1e-3);
        assert!(retraces(&there, &back, near) && !retraces(&there, &there, near));
        let up = way([0.0, 0.0], [0.0, 1.0], false);
        let down = way([6.3, 1.0], [6.3, 0.0], true);
        assert!(!retraces(&up, &down, Vec2::new(6.3e-3, 1e-3)));
    }

    #[test]
    fn a_spur_of_many_sides_about_the_beginning_goes_too() {
        let count = 50;
        let step = |k: usize| 5.0 * k as f64 / count as f64;
        let there = (0..count).map(|k| [step(k), step(k), step(k + 1), step(k + 1)]);
        let back: Vec<[f64; 4]> = there.clone().map(|[a, b, c, d]| [c, d, a, b]).rev().collect();
        let square = [
            [0.0, 0.0, 10.0, 0.0],
            [10.0, 0.0, 10.0, 10.0],
            [10.0, 10.0, 0.0, 10.0],
            [0.0, 10.0, 0.0, 0.0],
        ];
        // The loop starts at the tip of the slit.
        let sides: Vec<[f64; 4]> = back.into_iter().chain(square).chain(there).collect();
        let (model, _) = plate(&sides);
        assert_eq!(
            (model.faces[0].loops[0].uses.len(), model.edges.len(), model.vertices.len()),
            (4, 4, 4)
        );
        assert!((model.faces[0].area(1e-12) - 100.0).abs() < 1e-9);
    }
}
