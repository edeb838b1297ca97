//! Hourglass mode: thickness fibres of the mesh tilt in alternate directions, as no sheet does.
//!
//! Wide elements with a low bending stiffness fold so under pressure through the thickness, at no cost but that of
//! bending, and forces are far too low.

use kanagata_geometry::Vec3;
use kanagata_report::record::HourglassRecord;
use kanagata_solver::sheet::hex_mesh::HexMesh;

/// Smallest tilt of a fibre from the mean of its neighbours [rad], and smallest ratio of the opposite tilt of a
/// neighbour.
const TILT_MIN: f64 = 0.15;
const OPPOSITE_TILT_RATIO: f64 = 0.5;

/// Smallest number of neighbours with opposite tilt.
const OPPOSITE_NEIGHBOURS_MIN: usize = 2;

/// Fraction of fibres above which the mode is reported: radii too sharp for the mesh reach 0.1, folded meshes 0.4.
const FRACTION_MIN: f64 = 0.2;

/// Checks one increment for the mode, with the nodes at `positions` [mm].
#[must_use]
pub fn hourglass_mode(
    mesh: &HexMesh,
    positions: &[Vec3],
    increment: usize,
) -> Option<HourglassRecord> {
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
    // Fibres at the rim have neighbours on one side only and are not tested.
    let tilt = |column: usize| {
        if neighbours[column].len() < 3 { Vec3::zeros() } else { ups[column] - mean(column) }
    };
    let tilts: Vec<Vec3> = (0..ups.len()).map(tilt).collect();
    let alternates = |column: &usize| {
        let own = tilts[*column];
        let back =
            |other: &&usize| own.dot(&tilts[**other]) < -OPPOSITE_TILT_RATIO * own.norm_squared();
        own.norm() > TILT_MIN
            && neighbours[*column].iter().filter(back).count() >= OPPOSITE_NEIGHBOURS_MIN
    };
    let found: Vec<usize> = (0..ups.len()).filter(alternates).collect();
    let share = found.len() as f64 / ups.len() as f64;
    let first = *found.first().filter(|_| share > FRACTION_MIN)?;
    Some(HourglassRecord {
        first_increment: increment,
        fraction: share,
        at_mm: positions[first * levels].into(),
    })
}

/// Neighbouring columns of each column.
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
    use kanagata_solver::sheet::hex_mesh::rectangle;

    #[test]
    fn fibres_with_alternate_tilt_are_found_and_those_of_a_bent_sheet_are_not() {
        let mesh = rectangle(20.0, 20.0, 1.0, 10, 10, 1);
        assert_eq!(hourglass_mode(&mesh, &mesh.nodes, 1), None);
        let leaning = |by: f64, upto: f64| -> Vec<Vec3> {
            let side = |x: &Vec3| if (0.5 * x.x).round() as i64 % 2 == 0 { by } else { -by };
            let moved =
                |x: &Vec3| x + Vec3::x() * if x.x < upto { side(x) * (x.z - 0.5) } else { 0.0 };
            mesh.nodes.iter().map(moved).collect()
        };
        let found = hourglass_mode(&mesh, &leaning(0.4, 100.0), 7).unwrap();
        assert!(found.fraction > 0.6 && found.first_increment == 7, "{found:?}");
        assert_eq!(hourglass_mode(&mesh, &leaning(0.05, 100.0), 1), None);
        // Two rows of eleven.
        assert_eq!(hourglass_mode(&mesh, &leaning(0.4, 3.0), 1), None);
        // Bent to a radius of two elements, starting from the middle.
        let bent = |x: &Vec3| {
            let angle = (x.x - 10.0).max(0.0) / 4.0;
            let r = 4.5 - x.z;
            Vec3::new(x.x.min(10.0) + r * angle.sin(), x.y, 4.5 - r * angle.cos())
        };
        let bent: Vec<Vec3> = mesh.nodes.iter().map(bent).collect();
        assert_eq!(hourglass_mode(&mesh, &bent, 1), None);
    }
}
