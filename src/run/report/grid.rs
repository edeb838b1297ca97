//! The sheet in the VTU files of a run.

use crate::strains::Principal;
use kanagata_geometry::{Aabb, Vec3};
use kanagata_report::vtu_read::Grid;
use kanagata_solver::sheet::hanging::Hanging;
use kanagata_solver::sheet::hex_mesh::HexMesh;

/// Distance over the size of the sheet within which a column lies in the middle of two others: the rounding of positions
/// less displacements.
const IN_MIDDLE_REL: f64 = 1e-9;

/// VTK's type number of hexahedra.
const HEXAHEDRON: u8 = 12;

/// The undeformed mesh of a grid of the sheet, from positions and displacements. Coordinates are those of the blank up to
/// rounding.
///
/// # Errors
/// The array or cell that is not as a run writes it.
pub(super) fn undeformed(grid: &Grid) -> Result<HexMesh, String> {
    let moved = grid.point_data.iter().find(|a| a.name == "displacement_mm" && a.components == 3);
    let moved = moved.ok_or("no array displacement_mm")?.values.chunks_exact(3);
    let nodes: Vec<Vec3> =
        grid.points.iter().zip(moved).map(|(x, u)| x - Vec3::new(u[0], u[1], u[2])).collect();
    let elements = elements(grid)?;
    let nodes_per_column = nodes_per_column(&elements, nodes.len());
    let mut mesh = HexMesh { nodes, elements, nodes_per_column, hanging: Hanging::default() };
    mesh.hanging = mesh.hanging_found(IN_MIDDLE_REL * Aabb::of_points(&mesh.nodes).diagonal());
    Ok(mesh)
}

/// The elements of a grid of the sheet.
///
/// # Errors
/// The first cell that is no hexahedron.
pub(super) fn elements(grid: &Grid) -> Result<Vec<[u32; 8]>, String> {
    let element = |(k, (kind, nodes)): (usize, &(u8, Vec<u32>))| {
        let nodes = <[u32; 8]>::try_from(nodes.as_slice()).ok().filter(|_| *kind == HEXAHEDRON);
        nodes.ok_or_else(|| format!("cell {k} of type {kind}, which is no hexahedron"))
    };
    grid.cells.iter().enumerate().map(element).collect()
}

/// Nodes of a through-thickness column: consecutive nodes that edges of elements connect upwards. 1 if the mesh has no
/// columns of equal length.
fn nodes_per_column(elements: &[[u32; 8]], nodes: usize) -> usize {
    let mut connected = vec![false; nodes];
    for element in elements {
        for k in 0..4 {
            if element[k + 4] == element[k].saturating_add(1) {
                connected[element[k] as usize] = true;
            }
        }
    }
    let levels = connected.iter().position(|up| !up).map_or(1, |last| last + 1);
    if nodes.is_multiple_of(levels) { levels } else { 1 }
}

/// Strains of the mid-surface of every element in a grid of the sheet; `None` if the grid lacks them.
pub(super) fn strains(grid: &Grid) -> Option<Vec<Principal>> {
    let (major, minor) = (cell_values(grid, "major_strain")?, cell_values(grid, "minor_strain")?);
    let both = major.iter().zip(minor);
    Some(both.map(|(&major, &minor)| Principal { major, minor }).collect())
}

/// One number per element by the name of its array.
pub(super) fn cell_values<'g>(grid: &'g Grid, name: &str) -> Option<&'g [f64]> {
    let found = grid.cell_data.iter().find(|a| a.name == name && a.components == 1)?;
    Some(&found.values)
}

/// One number per node by the name of its array.
pub(super) fn point_values<'g>(grid: &'g Grid, name: &str) -> Option<&'g [f64]> {
    let found = grid.point_data.iter().find(|a| a.name == name && a.components == 1)?;
    Some(&found.values)
}

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_report::vtu_read::GridArray;
    use kanagata_solver::sheet::hex_mesh::{disc, rectangle, thickened};

    fn grid_of(mesh: &HexMesh) -> Grid {
        let values = vec![0.0; 3 * mesh.nodes.len()];
        let cells = mesh.elements.iter().map(|e| (HEXAHEDRON, e.to_vec())).collect();
        let moved = GridArray { name: "displacement_mm".into(), components: 3, values };
        Grid { points: mesh.nodes.clone(), cells, point_data: vec![moved], cell_data: Vec::new() }
    }

    #[test]
    fn meshes_are_read_with_their_columns() {
        let (points, quads) = disc(30.0, 4, 3);
        let meshes = [
            rectangle(2.0, 3.0, 1.0, 2, 3, 1),
            rectangle(2.0, 3.0, 1.0, 1, 1, 4),
            thickened(&points, &quads, 1.0, 2),
        ];
        for mesh in meshes {
            assert_eq!(undeformed(&grid_of(&mesh)).unwrap(), mesh);
        }
    }

    #[test]
    fn a_grid_of_other_cells_or_without_displacements_is_refused() {
        let mut grid = grid_of(&rectangle(1.0, 1.0, 1.0, 1, 1, 1));
        grid.cells.push((5, vec![0, 1, 2]));
        assert_eq!(undeformed(&grid).unwrap_err(), "cell 1 of type 5, which is no hexahedron");
        grid.point_data.clear();
        assert!(undeformed(&grid).unwrap_err().contains("displacement_mm"));
        assert_eq!((strains(&grid), undeformed(&Grid::default()).is_err()), (None, true));
    }
}
