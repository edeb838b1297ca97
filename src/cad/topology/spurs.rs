//! Spurs: places where a loop runs along an edge and straight back.

use crate::cad::model::{EdgeUse, Model, TrimLoop};

/// Two ways along an edge are one if they are no farther apart than this share of their length in the parameter plane:
/// those along a seam are a period apart.
const SAME: f64 = 1e-3;

/// Takes spurs out of the loops, and edges that no loop uses any more out of the model. Loops that are nothing else stay.
pub(super) fn remove(model: &mut Model) {
    let mut removed = false;
    for trim in model.faces.iter_mut().flat_map(|f| &mut f.loops) {
        while let Some(k) = spur(trim) {
            let next = (k + 1) % trim.uses.len();
            trim.uses.remove(k.max(next));
            trim.uses.remove(k.min(next));
            removed = true;
        }
    }
    if removed {
        drop_unused(model);
    }
}

/// Position of a use after which the loop runs back the same way.
fn spur(trim: &TrimLoop) -> Option<usize> {
    let count = trim.uses.len();
    // A loop of three or fewer would have no inside left.
    (0..count)
        .filter(|_| count > 3)
        .find(|&k| runs_back(&trim.uses[k], &trim.uses[(k + 1) % count]))
}

fn runs_back(there: &EdgeUse, back: &EdgeUse) -> bool {
    if there.edge.is_none() || there.edge != back.edge || there.reversed == back.reversed {
        return false;
    }
    let at = |u: &EdgeUse, s: f64| {
        let [a, b] = u.pcurve.domain();
        u.pcurve.point(a + (b - a) * s)
    };
    let length =
        (at(there, 0.5) - at(there, 0.0)).norm() + (at(there, 1.0) - at(there, 0.5)).norm();
    [0.0, 0.5, 1.0].iter().all(|&s| (at(there, s) - at(back, 1.0 - s)).norm() <= SAME * length)
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
    use crate::cad::build::build;
    use crate::cad::raw::{RawEdge, RawFace, RawLoop, RawModel, RawSurface};
    use crate::geometry::nurbs::Curve3;
    use crate::geometry::{Frame, Vec3};

    #[test]
    fn an_overshoot_bridged_back_is_taken_out_of_the_loop() {
        let ends = [
            [0.0, 0.0, 10.3, 0.0],
            [10.0, 0.0, 10.0, 10.0],
            [10.0, 10.0, 0.0, 10.0],
            [0.0, 10.0, 0.0, 0.0],
        ];
        let edge = |[a, b, c, d]: [f64; 4]| RawEdge {
            curve: Some(Curve3::line(Vec3::new(a, b, 0.0), Vec3::new(c, d, 0.0))),
            ..RawEdge::default()
        };
        let ring = RawLoop { outer: None, edges: ends.map(edge).to_vec(), vertex: None };
        let surface = RawSurface::Plane(Frame::world());
        let face = RawFace {
            surface,
            loops: vec![ring],
            flipped: false,
            source: "face".into(),
            shell: None,
        };
        let (model, said) = build(RawModel { faces: vec![face], ..RawModel::default() }, "face");
        assert!(said.iter().any(|d| d.code == "loop-open"), "{said:?}");
        assert_eq!(
            (model.edges.len(), model.vertices.len(), model.faces[0].loops[0].uses.len()),
            (4, 4, 4)
        );
        assert!(model.edges.iter().all(|e| e.uses.len() == 1), "{:?}", model.edges);
        assert!((model.faces[0].area(1e-12) - 100.0).abs() < 1e-9);
    }
}
