//! The two searches of the paper as published (Sec. 3.1-3.3), for comparison with [`super::ToolSurface`].
//!
//! Details not specified in the paper: the first phase selects tools by the normals of their patches and has no effect
//! for a single tool. The thresholds of Eq. 21 are 1e-10, with at most 30 iterations. A solution is valid when its
//! parameters are within 1e-6 of the patch. The 'minimum normal distance' is that of `|d|`.

use super::foot::{locate, weingarten};
use super::projection::{ContactSearch, Outcome, Projection};
use super::topology::corner_ids;
use kanagata_geometry::{Vec2, Vec3};
use kanagata_tool::{Patch, ToolModel};

const CANDIDATE_PATCHES: usize = 10;

/// Selection of patches before the grid search.
enum Preselection {
    /// All patches (Sec. 3.1).
    All,
    /// Patches adjacent to one of the `count` nearest nodes (Sec. 3.2).
    Nodes { points: Vec<Vec3>, patches: Vec<Vec<u32>>, count: usize },
}

/// Sec. 3.1 or 3.2 prepared for a tool.
pub struct PaperSearch {
    model: ToolModel,
    preselection: Preselection,
    /// Grid points of every patch and their parameters.
    grid: Vec<Vec<(Vec3, Vec2)>>,
}

impl PaperSearch {
    /// Sec. 3.1: a grid of twice the highest degrees of the tool on each patch (Eq. 16).
    #[must_use]
    pub fn bezier_grid(model: ToolModel) -> Self {
        let degrees = |p: &Patch| match p {
            Patch::Bezier { degrees, .. } => *degrees,
            _ => [2, 2],
        };
        let max_degrees =
            model.patches.iter().map(degrees).fold([1, 1], |a, b| [a[0].max(b[0]), a[1].max(b[1])]);
        let grid = model
            .patches
            .iter()
            .map(|p| grid(p, [2 * max_degrees[0], 2 * max_degrees[1]]))
            .collect();
        Self { model, preselection: Preselection::All, grid }
    }

    /// Sec. 3.2: the patches of the `5 + int(0.015 R^2)` nearest nodes (Eq. 17), with a grid of `int(max(2, R / 10))`
    /// on each (Eq. 18); `R` is the largest ratio of edge lengths of an element.
    #[must_use]
    pub fn nagata_nodes(model: ToolModel) -> Self {
        let ratio = model.patches.iter().map(edge_ratio).fold(1.0, f64::max).min(1e3);
        let count = 5 + (0.015 * ratio * ratio) as usize;
        let divisions = (ratio / 10.0).max(2.0) as usize;
        let grid = model.patches.iter().map(|p| grid(p, [divisions; 2])).collect();
        let ids = corner_ids(&model);
        let nodes = ids.iter().flatten().max().map_or(0, |&k| k as usize + 1);
        let mut points = vec![Vec3::zeros(); nodes];
        let mut patches = vec![Vec::new(); nodes];
        for (k, (patch, corners)) in model.patches.iter().zip(&ids).enumerate() {
            for (&id, point) in corners.iter().zip(corner_points(patch)) {
                points[id as usize] = point;
                patches[id as usize].push(k as u32);
            }
        }
        Self { model, preselection: Preselection::Nodes { points, patches, count }, grid }
    }

    /// Global search: ten patches and the nearest grid point on each.
    #[must_use]
    pub fn candidates(&self, p: &Vec3) -> Vec<(u32, Vec2)> {
        let nearest = |k: u32| {
            let points = self.grid[k as usize].iter().map(|(s, x)| ((s - p).norm_squared(), k, *x));
            points.min_by(|a, b| a.0.total_cmp(&b.0))
        };
        let mut found: Vec<(f64, u32, Vec2)> = match &self.preselection {
            Preselection::All => (0..self.grid.len() as u32).filter_map(nearest).collect(),
            Preselection::Nodes { points, patches, count } => {
                let mut near: Vec<(f64, usize)> =
                    points.iter().enumerate().map(|(k, s)| ((s - p).norm_squared(), k)).collect();
                smallest(&mut near, *count, |n| n.0);
                let mut ids: Vec<u32> = near.iter().flat_map(|n| &patches[n.1]).copied().collect();
                ids.sort_unstable();
                ids.dedup();
                ids.into_iter().filter_map(nearest).collect()
            }
        };
        smallest(&mut found, CANDIDATE_PATCHES, |f| f.0);
        found.into_iter().map(|(_, k, x)| (k, x)).collect()
    }

    /// Local search on given candidates: Newton iteration on each, minimum normal distance.
    #[must_use]
    pub fn project(&self, p: &Vec3, candidates: &[(u32, Vec2)]) -> Projection {
        let feet = candidates.iter().filter_map(|&(k, start)| {
            let patch = &self.model.patches[k as usize];
            let foot = newton(patch, p, start)?;
            let allowed = is_inside(patch, foot.at, 1e-6);
            allowed.then_some((foot.distance.abs(), k, foot.at))
        });
        match feet.min_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((_, k, at)) => self.projection(p, k, at),
            None => Projection { outcome: Outcome::Failed, ..Projection::nowhere() },
        }
    }

    fn projection(&self, p: &Vec3, k: u32, at: Vec2) -> Projection {
        let patch = &self.model.patches[k as usize];
        let d = patch.derivs(at.x, at.y);
        let normal = d.normal(at.x, at.y).unwrap_or_else(Vec3::z);
        Projection {
            patch: k,
            eta: at.x,
            zeta: at.y,
            location: locate(patch.sides(), at).0,
            past_border: false,
            point: d.s,
            normal,
            gap: (p - d.s).dot(&normal),
            curvature: weingarten(&d, &normal),
            outcome: Outcome::Local,
        }
    }
}

impl ContactSearch for PaperSearch {
    fn find(&self, p: &Vec3, _: Option<&Projection>) -> Projection {
        self.project(p, &self.candidates(p))
    }
}

/// Keeps the `count` smallest items, in order.
fn smallest<T>(items: &mut Vec<T>, count: usize, key: impl Fn(&T) -> f64) {
    let order = |a: &T, b: &T| key(a).total_cmp(&key(b));
    if items.len() > count {
        items.select_nth_unstable_by(count, order);
        items.truncate(count);
    }
    items.sort_by(order);
}

fn grid(patch: &Patch, [n, m]: [usize; 2]) -> Vec<(Vec3, Vec2)> {
    let at = |i: usize, j: usize| Vec2::new(i as f64 / n as f64, j as f64 / m as f64);
    (0..=n)
        .flat_map(|i| (0..=m).map(move |j| (i, j)))
        .filter(|&(i, j)| patch.sides() == 4 || j * n <= i * m)
        .map(|(i, j)| (patch.derivs(at(i, j).x, at(i, j).y).s, at(i, j)))
        .collect()
}

fn corner_points(patch: &Patch) -> Vec<Vec3> {
    let all = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
    all[..patch.sides()].iter().map(|&(eta, zeta)| patch.derivs(eta, zeta).s).collect()
}

/// Ratio of longest to shortest edge of a patch, excluding collapsed edges.
fn edge_ratio(patch: &Patch) -> f64 {
    let c = corner_points(patch);
    let lengths: Vec<f64> =
        (0..c.len()).map(|k| (c[(k + 1) % c.len()] - c[k]).norm()).filter(|l| *l > 0.0).collect();
    let longest = lengths.iter().fold(0.0_f64, |a, &b| a.max(b));
    longest / lengths.iter().fold(f64::INFINITY, |a, &b| a.min(b))
}

fn is_inside(patch: &Patch, x: Vec2, slack: f64) -> bool {
    let square = x.min() >= -slack && x.max() <= 1.0 + slack;
    square && (patch.sides() == 4 || x.y <= x.x + slack)
}

/// Solution of Eq. 19.
#[derive(Debug, Clone, Copy)]
pub struct NewtonFoot {
    /// `(eta, zeta)`; may lie outside the patch.
    pub at: Vec2,
    /// Normal distance d [mm].
    pub distance: f64,
    /// Number of iterations.
    pub iterations: usize,
}

/// The paper's Newton iteration (Eq. 19-23) for `S + d n - p = 0` from `start` with `d = 0`; `None` when it does not
/// converge or its matrix is singular. The derivatives of the normal follow from the Weingarten equations.
#[must_use]
pub fn newton(patch: &Patch, p: &Vec3, start: Vec2) -> Option<NewtonFoot> {
    const ITERATIONS_MAX: usize = 30;
    const THRESHOLD: f64 = 1e-10;
    let (mut at, mut distance) = (start, 0.0);
    for iterations in 1..=ITERATIONS_MAX {
        let d = patch.derivs(at.x, at.y);
        let n = d.normal(at.x, at.y)?;
        let residual = d.s + n * distance - p;
        let (e, f, g) = (d.d1.norm_squared(), d.d1.dot(&d.d2), d.d2.norm_squared());
        let (l, m, r) = (n.dot(&d.d11), n.dot(&d.d12), n.dot(&d.d22));
        let det = e * g - f * f;
        let n1 = (d.d1 * (f * m - g * l) + d.d2 * (f * l - e * m)) / det;
        let n2 = (d.d1 * (f * r - g * m) + d.d2 * (f * m - e * r)) / det;
        let jacobian =
            kanagata_geometry::Mat3::from_columns(&[d.d1 + n1 * distance, d.d2 + n2 * distance, n]);
        let step = jacobian.try_inverse()? * residual;
        at -= Vec2::new(step.x, step.y);
        distance -= step.z;
        if !(at.amax() < 1e6 && distance.abs() < 1e12) {
            return None;
        }
        if step.norm() <= THRESHOLD && residual.norm() <= THRESHOLD {
            return Some(NewtonFoot { at, distance, iterations });
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_tools::{arc, revolved};
    use crate::{SearchKind, ToolSurface};

    fn ball() -> ToolModel {
        let half = std::f64::consts::FRAC_PI_2;
        revolved("ball", 6, half, &[arc(6, [0.0, 0.0], 10.0, [-half, 0.0], 1.0)])
    }

    #[test]
    fn newton_of_eq_19_converges_quadratically_to_the_foot() {
        let model = ball();
        let patch = &model.patches[17];
        let d = patch.derivs(0.4, 0.6);
        let n = d.normal(0.4, 0.6).unwrap();
        for gap in [0.5, -2.0, 8.0] {
            let foot = newton(patch, &(d.s + n * gap), Vec2::new(0.5, 0.5)).expect("converges");
            assert!((foot.at - Vec2::new(0.4, 0.6)).norm() < 1e-9 && foot.iterations <= 8);
            assert!((foot.distance - gap).abs() < 1e-10);
        }
    }

    #[test]
    fn near_a_smooth_tool_the_three_searches_agree() {
        let tree = ToolSurface::new(ball());
        for kind in [SearchKind::BezierGrid, SearchKind::NagataNodes, SearchKind::Tree] {
            let search = kind.prepare(ball());
            for k in 0..50 {
                let (a, b) = (0.2 + 0.02 * f64::from(k), -0.4 - 0.015 * f64::from(k));
                let p = Vec3::new(a.cos() * b.cos(), a.sin() * b.cos(), b.sin()) * 10.7;
                let (found, best) = (search.find(&p, None), tree.closest(&p, None));
                assert!((found.gap - best.gap).abs() < 1e-6, "{kind:?} {found:?} {best:?}");
            }
        }
    }

    #[test]
    fn eq_17_and_18_count_nodes_and_divisions() {
        let search = PaperSearch::nagata_nodes(ball());
        let Preselection::Nodes { count, .. } = &search.preselection else { panic!("nodes") };
        assert!(*count >= 5 && search.grid[20].len() == 9, "{count}");
        assert_eq!(PaperSearch::bezier_grid(ball()).grid[20].len(), 25);
        let (s, c) = 0.8_f64.sin_cos();
        assert_eq!(search.candidates(&(Vec3::new(c * c, s * c, -s) * 11.0)).len(), 10);
    }
}
