//! Where columns of the mesh lean to opposite sides by turns, as no sheet does: wide elements that bend well let through-thickness
//! pressure fold them so, which costs them nothing but bending, and forces are far too low there. It is told.

use crate::geometry::Vec3;
use crate::report::record::HourglassRecord;
use crate::solver::sheet::hex_mesh::HexMesh;

/// How far a column leans from the mean of its neighbours that counts [rad], and how far neighbours do so to the other side, over
/// that.
const LEANS: f64 = 0.15;
const BACK: f64 = 0.5;

/// Neighbours that do.
const NEIGHBOURS: usize = 2;

/// Share of the columns from which it is of note: radii that are too sharp for the mesh reach 0.1, meshes that fold so 0.4.
const OF_NOTE: f64 = 0.2;

/// Columns of the sheet, its nodes now at these positions, that lean by turns; `increment`: the one that ended there.
#[must_use]
pub fn zigzag(mesh: &HexMesh, positions: &[Vec3], increment: usize) -> Option<HourglassRecord> {
    let levels = mesh.nodes_per_column;
    if levels < 2 {
        return None;
    }
    let up = |column: usize| {
        let foot = column * levels;
        (positions[foot + 1] - positions[foot]).try_normalize(0.0).unwrap_or_default()
    };
    let ups: Vec<Vec3> = (0..mesh.column_count()).map(up).collect();
    let neighbours = neighbours(mesh);
    let mean = |column: usize| {
        let around = &neighbours[column];
        around.iter().map(|&other| ups[other]).sum::<Vec3>() / around.len() as f64
    };
    // Of a column at the rim, whose neighbours lie to one side, it says nothing.
    let lean = |column: usize| {
        if neighbours[column].len() < 3 { Vec3::zeros() } else { ups[column] - mean(column) }
    };
    let leans: Vec<Vec3> = (0..ups.len()).map(lean).collect();
    let by_turns = |column: &usize| {
        let own = leans[*column];
        let back = |other: &&usize| own.dot(&leans[**other]) < -BACK * own.norm_squared();
        own.norm() > LEANS && neighbours[*column].iter().filter(back).count() >= NEIGHBOURS
    };
    let found: Vec<usize> = (0..ups.len()).filter(by_turns).collect();
    let share = found.len() as f64 / ups.len() as f64;
    let first = *found.first().filter(|_| share > OF_NOTE)?;
    Some(HourglassRecord {
        first_increment: increment,
        fraction: share,
        at_mm: positions[first * levels].into(),
    })
}

/// Columns next to each column.
pub(super) fn neighbours(mesh: &HexMesh) -> Vec<Vec<usize>> {
    let mut out = vec![Vec::new(); mesh.column_count()];
    for element in &mesh.elements {
        let columns = [0, 1, 2, 3].map(|k| element[k] as usize / mesh.nodes_per_column);
        for k in 0..4 {
            let (a, b) = (columns[k], columns[(k + 1) % 4]);
            out[a].push(b);
            out[b].push(a);
        }
    }
    for around in &mut out {
        around.sort_unstable();
        around.dedup();
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::sheet::hex_mesh::rectangle;

    #[test]
    fn columns_that_lean_by_turns_are_found_and_those_of_a_bent_sheet_are_not() {
        let mesh = rectangle(20.0, 20.0, 1.0, 10, 10, 1);
        assert_eq!(zigzag(&mesh, &mesh.nodes, 1), None);
        let leaning = |by: f64, upto: f64| -> Vec<Vec3> {
            let side = |x: &Vec3| if (0.5 * x.x).round() as i64 % 2 == 0 { by } else { -by };
            let moved =
                |x: &Vec3| x + Vec3::x() * if x.x < upto { side(x) * (x.z - 0.5) } else { 0.0 };
            mesh.nodes.iter().map(moved).collect()
        };
        let found = zigzag(&mesh, &leaning(0.4, 100.0), 7).unwrap();
        assert!(found.fraction > 0.6 && found.first_increment == 7, "{found:?}");
        assert_eq!(zigzag(&mesh, &leaning(0.05, 100.0), 1), None);
        // Two rows of eleven.
        assert_eq!(zigzag(&mesh, &leaning(0.4, 3.0), 1), None);
        // Bent to a radius of two elements, from its middle on.
        let bent = |x: &Vec3| {
            let angle = (x.x - 10.0).max(0.0) / 4.0;
            let r = 4.5 - x.z;
            Vec3::new(x.x.min(10.0) + r * angle.sin(), x.y, 4.5 - r * angle.cos())
        };
        let bent: Vec<Vec3> = mesh.nodes.iter().map(bent).collect();
        assert_eq!(zigzag(&mesh, &bent, 1), None);
    }
}
