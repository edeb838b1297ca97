//! Joints: borders inside a tool between independently divided faces.
//!
//! Their patches have no common vertices, and their sides are up to [`ToolModel::border_gap_mm`] apart: a step or a
//! slit. Consider a step of height s and a point at height h above the lower face. Its nearest point is on the side of
//! the upper face within a lateral distance of `sqrt(2 h s)`, much more than s. Such a foot point is not on a border of
//! the tool, and its normal may be that of the wrong side of a crease. [`super::facing`] selects the foot point
//! instead.

use kanagata_geometry::box_tree::BoxTree;
use kanagata_geometry::{Aabb, Vec3};
use kanagata_tool::ToolModel;
use kanagata_tool::side::{SideCurve, corners};

/// Relative positions on a side at which sides of other faces must be adjacent.
const SAMPLE_POSITIONS: [f64; 5] = [0.1, 0.3, 0.5, 0.7, 0.9];

/// A side used by one patch.
struct Single<'a> {
    patch: usize,
    side: usize,
    curve: SideCurve<'a>,
}

fn singles<'a>(model: &'a ToolModel, bits: &[u8]) -> Vec<Single<'a>> {
    let mut out = Vec::new();
    for (patch, bits) in bits.iter().enumerate() {
        for side in (0..4).filter(|k| bits & (1 << k) != 0) {
            let curve = SideCurve::new(&model.patches[patch], side);
            out.push(Single { patch, side, curve });
        }
    }
    out
}

/// Those of the sides in `once`, each used by one patch, with sides of other faces along their entire length within the
/// border gap of the model.
pub(super) fn sides(model: &ToolModel, once: &[u8]) -> Vec<u8> {
    let all = singles(model, once);
    let boxes: Vec<Aabb> = all.iter().map(|s| s.curve.bounds()).collect();
    let tree = BoxTree::build(&boxes);
    let reach = model.border_gap_mm * model.border_gap_mm * (1.0 + 1e-9);
    let is_met = |own: &Single<'_>, p: &Vec3| {
        let visit = |k: u32, best: f64| {
            let other = &all[k as usize];
            let same = model.faces[other.patch] == model.faces[own.patch];
            if same { best } else { best.min(other.curve.distance(p).powi(2)) }
        };
        tree.nearest(p, reach, visit) < reach
    };
    let mut joints = vec![0; once.len()];
    for own in &all {
        if SAMPLE_POSITIONS.iter().all(|&t| is_met(own, &own.curve.point(t))) {
            joints[own.patch] |= 1 << own.side;
        }
    }
    joints
}

/// Ends of the sides on the free border.
pub(super) struct Ends {
    points: Vec<Vec3>,
    tree: BoxTree,
}

/// Ends of the sides in `outer`.
pub(super) fn ends(model: &ToolModel, outer: &[u8]) -> Ends {
    let sides = singles(model, outer);
    let points: Vec<Vec3> =
        sides.iter().flat_map(|s| [s.curve.point(0.0), s.curve.point(1.0)]).collect();
    let boxes: Vec<Aabb> = points.iter().map(|p| Aabb::of_points([p])).collect();
    Ends { points, tree: BoxTree::build(&boxes) }
}

impl Ends {
    /// True when corner `k` of a patch is within the border gap of the model from one of them.
    pub(super) fn near(&self, model: &ToolModel, patch: usize, k: usize) -> bool {
        let patch = &model.patches[patch];
        let Some(&(eta, zeta)) = corners(patch.sides()).get(k) else { return false };
        let p = patch.derivs(eta, zeta).s;
        let reach = model.border_gap_mm * model.border_gap_mm * (1.0 + 1e-9);
        let visit = |k: u32, best: f64| best.min((self.points[k as usize] - p).norm_squared());
        self.tree.nearest(&p, reach, visit) < reach
    }
}

#[cfg(test)]
mod tests {
    use crate::{Location, Outcome, ToolSurface};
    use kanagata_geometry::Vec3;
    use kanagata_tool::build::build;
    use kanagata_tool::edge::EdgeRule;
    use kanagata_tool::model::PatchCorners;
    use kanagata_tool::{ToolKind, ToolModel};

    /// Height of a step, or distance between two faces [mm].
    const STEP: f64 = 0.01;

    /// Flat quads `[corner, side, other side]` with their face, without common vertices.
    fn plates(quads: &[([Vec3; 3], u32)], border_gap_mm: f64) -> ToolModel {
        let (mut vertices, mut normals, mut corners) = (Vec::new(), Vec::new(), Vec::new());
        for &([o, a, b], face) in quads {
            let first = vertices.len() as u32;
            corners.push(PatchCorners {
                vertices: (first..first + 4).collect(),
                normals: vec![normals.len() as u32; 4],
                face,
            });
            vertices.extend([o, o + a, o + a + b, o + b]);
            normals.push(a.cross(&b).normalize());
        }
        let made =
            build("plates".into(), ToolKind::Facets, vertices, normals, corners, EdgeRule::Guarded);
        ToolModel { border_gap_mm, ..made.unwrap().0 }
    }

    /// One plate for x < 0 and two plates for x > 0, lower by a step: a T joint in the middle.
    fn step(gap: f64) -> ToolSurface {
        let (x, y) = (Vec3::x() * 10.0, Vec3::y() * 10.0);
        let low = -Vec3::z() * STEP;
        ToolSurface::new(plates(
            &[([-x, x, y], 0), ([low, x, y * 0.4], 1), ([low + y * 0.4, x, y * 0.6], 1)],
            gap,
        ))
    }

    #[test]
    fn beside_a_step_the_lower_face_is_seen_and_nobody_has_left_the_tool() {
        let surface = step(STEP);
        for k in 0..400 {
            let (t, y) = (1e-3 * f64::from(k % 40 - 20), 0.2 + 0.024 * f64::from(k));
            for h in [1e-4, 0.1, 2.0, -0.1, -2.0] {
                // The nearest point is on the side of the upper plate for t up to sqrt(2 h s).
                let foot = surface.closest(&Vec3::new(t, y, h), None);
                assert!(!foot.past_border, "{t} {y} {h}: {foot:?}");
                assert_eq!(foot.outcome, Outcome::Certified);
                let exact = if t > 0.0 { h + STEP } else { h };
                assert!((foot.gap - exact).abs() <= STEP * (1.0 + 1e-9), "{t} {h}: {foot:?}");
                // Beside the joint the lower face is found.
                if t.abs() > 1e-12 && h > 2.0 * STEP {
                    assert!((foot.gap - exact).abs() < 1e-12, "{t} {h}: {foot:?}");
                }
            }
        }
    }

    #[test]
    fn without_the_gap_declared_such_points_have_left_the_tool() {
        let foot = step(0.0).closest(&Vec3::new(0.1, 3.0, 2.0), None);
        assert!(foot.past_border && foot.location == Location::Edge(1), "{foot:?}");
    }

    #[test]
    fn past_the_end_of_a_joint_is_past_the_border() {
        let surface = step(STEP);
        for x in [-1.0, -1e-3, 0.0, 1e-3, 0.05, 1.0] {
            for y in [-0.5, 10.5] {
                for z in [0.2, -0.2] {
                    assert!(surface.closest(&Vec3::new(x, y, z), None).past_border, "{x} {y} {z}");
                }
            }
        }
        assert!(surface.closest(&Vec3::new(-10.5, 3.0, 0.1), None).past_border);
        assert!(surface.closest(&Vec3::new(10.5, 4.0, 0.1), None).past_border);
    }

    /// The wall of a block is set back from the edge of its top: the side of the top is closer to points in front of
    /// the wall than the wall, and would classify them as inside.
    #[test]
    fn before_a_wall_beside_a_crease_the_gap_is_the_walls() {
        let (x, y, z) = (Vec3::x() * 10.0, Vec3::y() * 10.0, Vec3::z() * 10.0);
        let wall = -Vec3::x() * STEP - z;
        let quads = [([-x, x, y], 0), ([wall, y * 0.4, z], 1), ([wall + y * 0.4, y * 0.6, z], 1)];
        let (apart, open) =
            (ToolSurface::new(plates(&quads, STEP)), ToolSurface::new(plates(&quads, 0.0)));
        for (h, t) in [(1.0, 0.1), (1.0, 0.02), (0.2, 0.05), (0.5, 1e-3)] {
            let p = Vec3::new(h, 3.9, -t);
            let foot = apart.closest(&p, None);
            assert!((foot.gap - h - STEP).abs() < 1e-12 && !foot.past_border, "{h} {t}: {foot:?}");
            assert!(open.closest(&p, None).gap < 0.0, "the top's");
        }
        // Above the edge the more facing foot point is found.
        let over = apart.closest(&Vec3::new(0.3, 2.0, 0.4), None);
        assert!((over.gap - 0.4).abs() < 1e-9 && !over.past_border, "{over:?}");
    }

    #[test]
    fn a_slit_is_no_border() {
        let (x, y) = (Vec3::x() * 10.0, Vec3::y() * 10.0);
        let right = Vec3::x() * STEP;
        let quads = [([-x, x, y], 0), ([right, x, y * 0.3], 1), ([right + y * 0.3, x, y * 0.7], 1)];
        let surface = ToolSurface::new(plates(&quads, STEP));
        for k in 0..50 {
            let p = Vec3::new(STEP * f64::from(k) / 50.0, 0.1 + 0.19 * f64::from(k), 0.3);
            let foot = surface.closest(&p, None);
            assert!(!foot.past_border && (foot.gap - 0.3).abs() < 1e-12, "{foot:?}");
            let on = surface.closest(&Vec3::new(p.x, p.y, -0.02), None);
            assert!(!on.past_border && (on.gap + 0.02).abs() < 1e-12, "{on:?}");
        }
    }
}
