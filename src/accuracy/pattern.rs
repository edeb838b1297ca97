//! Where the elements of a sheet are short: where a coarser run has bent them most, over its whole history.

use std::collections::BTreeMap;
use std::path::Path;

use crate::geometry::{Vec2, Vec3};
use crate::report::vtu_read;
use crate::solver::sheet::hex_mesh::HexMesh;
use crate::solver::sheet::refine::plan_elements;

/// Highest level of refinement. Elements that bend most are then a quarter as long as those of flat parts. With one level
/// fewer flat parts have four times the elements; with one more their elements are eight times as long as those that bend.
pub(super) const LEVEL_MAX: u8 = 2;

/// Shrinkage of an element about its centre before it is compared with others, so that neighbours do not overlap.
const SHRINK_REL: f64 = 1e-6;

/// Levels of refinement over the plan of a blank.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Pattern {
    /// Boxes of the elements of the coarser run in plan [mm] that are refined, with their levels.
    boxes: Vec<([Vec2; 2], u8)>,
}

impl Pattern {
    /// The pattern of a run: an element that has turned by more than half of the largest angle has the highest level, one
    /// of more than a quarter the level below. `None` where files of the steps are missing, or nothing bends.
    pub(super) fn of_run(folder: &Path, mesh: &HexMesh) -> Option<Self> {
        let quads = plan_elements(mesh);
        let mut turns = vec![0.0_f64; quads.len()];
        let files = std::fs::read_dir(folder.join("steps")).ok()?.flatten();
        let steps =
            files.map(|file| file.path()).filter(|p| p.extension().is_some_and(|e| e == "vtu"));
        for step in steps {
            let grid = vtu_read::read(&step).ok()?;
            if grid.points.len() != mesh.nodes.len() {
                return None;
            }
            for (turn, now) in turns.iter_mut().zip(angles(mesh, &quads, &grid.points)) {
                *turn = turn.max(now);
            }
        }
        let largest = turns.iter().copied().fold(0.0, f64::max);
        let level = |turn: f64| {
            (1..=LEVEL_MAX)
                .rev()
                .find(|l| turn > largest * 0.5_f64.powi(i32::from(LEVEL_MAX - l) + 1))
        };
        let leveled = quads
            .iter()
            .zip(&turns)
            .filter_map(|(quad, turn)| Some((bounds(mesh, quad), level(*turn)?)));
        let pattern = Self { boxes: leveled.collect() };
        (largest > 0.0).then_some(pattern)
    }

    /// Level of every element in plan of a mesh, as digits in their order.
    pub(super) fn levels(&self, mesh: &HexMesh) -> String {
        let of = |quad: &[u32; 4]| {
            let [low, high] = bounds(mesh, quad);
            let overlaps = |b: &[Vec2; 2]| (0..2).all(|k| b[0][k] < high[k] && b[1][k] > low[k]);
            let levels = self.boxes.iter().filter(|(b, _)| overlaps(b)).map(|(_, level)| *level);
            char::from(b'0' + levels.max().unwrap_or(0))
        };
        plan_elements(mesh).iter().map(of).collect()
    }
}

/// Corners of an element in plan, of its lower face in the flat blank.
fn corners(mesh: &HexMesh, quad: &[u32; 4]) -> [Vec3; 4] {
    quad.map(|column| mesh.nodes[column as usize * mesh.nodes_per_column])
}

/// Bounds of an element in plan, shrunk about its centre.
fn bounds(mesh: &HexMesh, quad: &[u32; 4]) -> [Vec2; 2] {
    let at = corners(mesh, quad).map(|x| x.xy());
    let low = at.iter().copied().reduce(|a, b| a.inf(&b)).unwrap_or_default();
    let high = at.iter().copied().reduce(|a, b| a.sup(&b)).unwrap_or_default();
    let inwards = (high - low) * SHRINK_REL;
    [low + inwards, high - inwards]
}

/// Largest angle between the normals of each element in plan and its neighbours over a side [rad].
fn angles(mesh: &HexMesh, quads: &[[u32; 4]], positions: &[Vec3]) -> Vec<f64> {
    let levels = mesh.nodes_per_column;
    let middle = |column: u32| {
        let first = column as usize * levels;
        (positions[first] + positions[first + levels - 1]) * 0.5
    };
    let normal = |quad: &[u32; 4]| {
        let [a, b, c, d] = quad.map(middle);
        (c - a).cross(&(d - b)).try_normalize(0.0).unwrap_or_default()
    };
    let normals: Vec<Vec3> = quads.iter().map(normal).collect();
    let mut sides: BTreeMap<[u32; 2], usize> = BTreeMap::new();
    let mut largest = vec![0.0_f64; quads.len()];
    for (k, quad) in quads.iter().enumerate() {
        for side in 0..4 {
            let (a, b) = (quad[side], quad[(side + 1) % 4]);
            let Some(&other) = sides.get(&[a.min(b), a.max(b)]) else {
                sides.insert([a.min(b), a.max(b)], k);
                continue;
            };
            let (n, m) = (normals[k], normals[other]);
            let angle = n.cross(&m).norm().atan2(n.dot(&m));
            largest[k] = largest[k].max(angle);
            largest[other] = largest[other].max(angle);
        }
    }
    largest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::{DataArray, Vtu};
    use crate::solver::sheet::hex_mesh::rectangle;

    /// A strip of 16 elements that is bent by 60 degrees between elements 7 and 8 in one step, and by 20 degrees between
    /// elements 3 and 4 in another.
    #[test]
    fn elements_that_have_bent_are_refined_whenever_they_did() {
        let mesh = rectangle(16.0, 1.0, 0.5, 16, 1, 1);
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("steps")).unwrap();
        for (name, at, degrees) in [("000001", 8.0, 60.0_f64), ("000002", 4.0, 20.0)] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let bent = |x: &Vec3| {
                let beyond = x.x - at;
                if beyond <= 0.0 {
                    *x
                } else {
                    Vec3::new(at + cos * beyond - sin * x.z, x.y, sin * beyond + cos * x.z)
                }
            };
            let mut grid = Vtu::new(mesh.nodes.iter().map(bent).collect());
            grid.point_data.push(DataArray::scalar("a", vec![0.0; mesh.nodes.len()]));
            grid.write(&folder.path().join(format!("steps/{name}.vtu"))).unwrap();
        }
        let pattern = Pattern::of_run(folder.path(), &mesh).unwrap();
        assert_eq!(pattern.levels(&mesh), "0001100220000000");
        // On a mesh of half the elements every pair with a refined element is refined.
        assert_eq!(pattern.levels(&rectangle(16.0, 1.0, 0.5, 8, 1, 1)), "01122000");
        assert_eq!(Pattern::of_run(folder.path(), &rectangle(1.0, 1.0, 0.5, 1, 1, 1)), None);
    }
}
