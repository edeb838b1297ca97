//! Where the elements of a sheet are short: where a coarser run has bent them most, or tools have penetrated their faces,
//! over its whole history.

use std::collections::BTreeMap;
use std::path::Path;

use kanagata_geometry::{Vec2, Vec3};
use kanagata_report::vtu_read;
use kanagata_run::fields::FACE_PENETRATION;
use kanagata_solver::sheet::hex_mesh::HexMesh;
use kanagata_solver::sheet::refine::plan_elements;

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
    /// of more than a quarter the level below. The depth of tools in faces grows with the square of their length: an
    /// element that is penetrated by more than a quarter of the largest depth has the highest level too, and so on.
    /// `allowed`: depth that needs no refinement [mm]. `None` where files of the steps are missing, or nothing bends.
    pub(super) fn of_run(folder: &Path, mesh: &HexMesh, allowed: f64) -> Option<Self> {
        let quads = plan_elements(mesh);
        let (mut turns, mut depths) = (vec![0.0_f64; quads.len()], vec![0.0_f64; quads.len()]);
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
            let found = grid.cell_data.iter().find(|array| array.name == FACE_PENETRATION);
            if let Some(found) = found {
                deepen(&mut depths, mesh, &quads, &found.values);
            }
        }
        let turned = turns.iter().copied().fold(0.0, f64::max);
        let deepest = depths.iter().copied().fold(allowed, f64::max);
        let level = |largest: f64, base: f64, value: f64| {
            let beyond = |l: &u8| value > largest * base.powi(i32::from(LEVEL_MAX - l) + 1);
            (1..=LEVEL_MAX).rev().find(beyond)
        };
        let leveled = quads.iter().zip(turns.iter().zip(&depths)).filter_map(|(quad, at)| {
            let level = level(turned, 0.5, *at.0).max(level(deepest, 0.25, *at.1));
            Some((bounds(mesh, quad), level?))
        });
        let pattern = Self { boxes: leveled.collect() };
        (turned > 0.0).then_some(pattern)
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

/// Raises the depth of each element in plan to that of all elements above it.
fn deepen(depths: &mut [f64], mesh: &HexMesh, quads: &[[u32; 4]], of_elements: &[f64]) {
    let number: BTreeMap<&[u32; 4], usize> = quads.iter().zip(0..).collect();
    let levels = mesh.nodes_per_column.max(1) as u32;
    for (element, depth) in mesh.elements.iter().zip(of_elements) {
        let columns = [element[0], element[1], element[2], element[3]].map(|node| node / levels);
        if let Some(&k) = number.get(&columns) {
            depths[k] = depths[k].max(*depth);
        }
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
    use kanagata_report::{CellKind, DataArray, Vtu};
    use kanagata_solver::sheet::hex_mesh::rectangle;

    /// The pattern of a strip of 16 elements that is bent by 60 degrees between elements 7 and 8 in one step, and by 20
    /// degrees between elements 3 and 4 in another, in which a tool is `deep` in the face of element 14 [mm].
    fn pattern(mesh: &HexMesh, deep: f64) -> Pattern {
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
            let depth = |k: usize| if name == "000002" && k == 14 { deep } else { 0.0 };
            let depths = (0..16).map(depth).collect();
            for element in &mesh.elements {
                grid.push_cell(CellKind::Hexahedron, element);
            }
            grid.cell_data.push(DataArray::scalar(FACE_PENETRATION, depths));
            grid.write(&folder.path().join(format!("steps/{name}.vtu"))).unwrap();
        }
        Pattern::of_run(folder.path(), mesh, 0.025).unwrap()
    }

    #[test]
    fn elements_that_have_bent_are_refined_whenever_they_did() {
        let mesh = rectangle(16.0, 1.0, 0.5, 16, 1, 1);
        let bent = pattern(&mesh, 0.0);
        assert_eq!(bent.levels(&mesh), "0001100220000000");
        // On a mesh of half the elements every pair with a refined element is refined.
        assert_eq!(bent.levels(&rectangle(16.0, 1.0, 0.5, 8, 1, 1)), "01122000");
        assert_eq!(Pattern::of_run(Path::new("none"), &mesh, 0.025), None);
    }

    #[test]
    fn elements_that_tools_penetrate_are_refined_by_the_depth() {
        let mesh = rectangle(16.0, 1.0, 0.5, 16, 1, 1);
        let last = |deep: f64| pattern(&mesh, deep).levels(&mesh)[12..].to_owned();
        // Over what is allowed: as long as it is a sixteenth of it, a quarter, the largest.
        assert_eq!([0.0015, 0.003, 0.007, 0.2].map(last), ["0000", "0010", "0020", "0020"]);
    }
}
