//! Fields on sheet and tools as VTU grids.

use super::formed::Formed;
use super::{contact_fields, tensor_fields};
use kanagata_geometry::Vec3;
use kanagata_report::record::ThicknessRecord;
use kanagata_report::{CellKind, DataArray, Vtu};
use kanagata_solver::NodeContact;
use kanagata_solver::assembly::Body;
use kanagata_solver::sheet::hex_mesh::HexMesh;
use kanagata_tool::{Patch, ToolModel};

/// Current positions of the nodes [mm] from displacements (three per node).
#[must_use]
pub fn positions(mesh: &HexMesh, displacements: &[f64]) -> Vec<Vec3> {
    let moved = |(x, u): (&Vec3, &[f64])| x + Vec3::new(u[0], u[1], u[2]);
    mesh.nodes.iter().zip(displacements.chunks_exact(3)).map(moved).collect()
}

/// Thickness of every column: distance between its lowest and highest node [mm].
#[must_use]
pub fn column_thickness(mesh: &HexMesh, positions: &[Vec3]) -> Vec<f64> {
    let (low, high) = (mesh.bottom_nodes(), mesh.top_nodes());
    low.iter()
        .zip(&high)
        .map(|(&a, &b)| (positions[b as usize] - positions[a as usize]).norm())
        .collect()
}

/// Minimum (relative to the initial one) and maximum thickness at `displacements`; `None` for a sheet without columns.
#[must_use]
pub fn thickness(mesh: &HexMesh, displacements: &[f64]) -> Option<ThicknessRecord> {
    let positions = positions(mesh, displacements);
    let (now, before) = (column_thickness(mesh, &positions), column_thickness(mesh, &mesh.nodes));
    let share = |column: &usize| now[*column] / before[*column];
    let thinnest = (0..now.len()).min_by(|a, b| share(a).total_cmp(&share(b)))?;
    Some(ThicknessRecord {
        minimum_mm: now[thinnest],
        initial_mm: before[thinnest],
        at_mm: positions[mesh.top_nodes()[thinnest] as usize].into(),
        maximum_mm: now.iter().copied().fold(0.0, f64::max),
    })
}

/// Array of the depth of tools in the faces of elements [mm].
pub const FACE_PENETRATION: &str = "face_penetration_mm";

/// The sheet after an increment.
#[derive(Clone, Copy)]
pub struct SheetState<'a> {
    /// The sheet with the history of this state.
    pub body: &'a Body,
    /// Displacements, three per node [mm].
    pub displacements: &'a [f64],
    /// Contact forces, three per node [N]; empty if unknown.
    pub contact_forces: &'a [f64],
    /// Nodes in contact; `None` if unknown.
    pub contacts: Option<&'a [NodeContact]>,
    /// Depth of tools in the faces of each element [mm]; empty if unknown.
    pub face_depths: &'a [f64],
}

/// The deformed sheet with the arrays of `docs/reference/vtu.md`. Points are current positions.
#[must_use]
pub fn sheet(state: &SheetState<'_>, formed: &Formed) -> Vtu {
    let (mesh, displacements) = (state.body.mesh(), state.displacements);
    let positions = positions(mesh, displacements);
    let levels = mesh.nodes_per_column.max(1);
    let by_column = column_thickness(mesh, &positions);
    let normals = contact_fields::normals(mesh, &positions);
    let thickness = (0..positions.len()).map(|node| by_column[node / levels]).collect();
    let normals: Vec<Vec3> = (0..positions.len()).map(|node| normals[node / levels]).collect();
    let vectors = |flat: &[f64]| -> Vec<Vec3> {
        flat.chunks_exact(3).map(|v| Vec3::new(v[0], v[1], v[2])).collect()
    };
    let mut data = vec![
        DataArray::vector("displacement_mm", &vectors(displacements)),
        DataArray::scalar("thickness_mm", thickness),
        DataArray::single_vector("normal", &normals),
    ];
    if state.contact_forces.len() == displacements.len() {
        data.push(DataArray::vector("contact_force_n", &vectors(state.contact_forces)));
    }
    if let Some(contacts) = state.contacts {
        data.extend(contact_fields::arrays(mesh, &positions, contacts));
    }
    let mut grid = Vtu::new(positions);
    for element in &mesh.elements {
        grid.push_cell(CellKind::Hexahedron, element);
    }
    grid.point_data = data;
    grid.cell_data = formed.cell_data();
    grid.cell_data.extend(tensor_fields::arrays(state.body, displacements));
    if state.face_depths.len() == mesh.elements.len() {
        grid.cell_data.push(DataArray::single(FACE_PENETRATION, state.face_depths.to_vec()));
    }
    grid
}

/// Points and triangles of a tool, moved by `shift`; each patch has `divisions` intervals in each direction.
#[must_use]
pub fn tessellate(model: &ToolModel, divisions: usize, shift: &Vec3) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let n = divisions.max(1);
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for patch in &model.patches {
        let first = points.len() as u32;
        let triangular = matches!(patch, Patch::Triangle(_));
        // Row i has zeta = 0 .. eta in a triangle, 0 .. 1 in a quadrilateral.
        let length = |i: usize| if triangular { i + 1 } else { n + 1 };
        let start = |i: usize| first + (0..i).map(length).sum::<usize>() as u32;
        for i in 0..=n {
            for j in 0..length(i) {
                let d = patch.derivs(i as f64 / n as f64, j as f64 / n as f64);
                points.push(d.s + shift);
            }
        }
        for i in 0..n {
            let (low, high) = (start(i), start(i + 1));
            for j in 0..length(i) as u32 {
                if j + 1 < length(i + 1) as u32 {
                    triangles.push([low + j, high + j, high + j + 1]);
                }
                if j + 1 < length(i) as u32 {
                    triangles.push([low + j, high + j + 1, low + j + 1]);
                }
            }
        }
    }
    (points, triangles)
}

/// A tool as a grid of triangles, its points in single precision.
#[must_use]
pub fn tool(model: &ToolModel, divisions: usize, shift: &Vec3) -> Vtu {
    let (points, triangles) = tessellate(model, divisions, shift);
    let mut grid = Vtu::new(points);
    grid.single_points = true;
    for t in &triangles {
        grid.push_cell(CellKind::Triangle, t);
    }
    grid
}

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_solver::sheet::hex_mesh::rectangle;

    #[test]
    fn thickness_follows_the_columns() {
        let mesh = rectangle(2.0, 2.0, 0.8, 1, 1, 2);
        let mut u = vec![0.0; 3 * mesh.nodes.len()];
        let top = mesh.top_nodes()[3] as usize;
        u[3 * top + 2] = -0.1;
        let thickness = column_thickness(&mesh, &positions(&mesh, &u));
        assert!((thickness[3] - 0.7).abs() < 1e-15 && (thickness[0] - 0.8).abs() < 1e-15);
        let found = super::thickness(&mesh, &u).unwrap();
        assert_eq!(found.to_string(), "0.7000 of 0.8000 mm at (2.0, 2.0, 0.7) mm");
        assert_eq!(found.maximum_mm, 0.8);
        u[3 * top + 2] = -0.5;
        let found = super::thickness(&mesh, &u).unwrap().to_string();
        assert_eq!(found, "0.3000 of 0.8000 mm at (2.0, 2.0, 0.3) mm");
    }

    #[test]
    fn tessellations_turn_like_the_patch_and_cover_it() {
        let flat =
            |c: &[(f64, f64)]| c.iter().map(|&(x, y)| Vec3::new(x, y, 0.0)).collect::<Vec<_>>();
        let z = Vec3::zeros();
        let c = flat(&[(0.0, 0.0), (2.0, 0.0), (0.0, 1.0)]);
        let patches = [
            (Patch::Triangle([c[0], c[1], c[2], z, z, z]), 1.0),
            (Patch::Quad([c[0], c[1], c[2], z, z, z, z, z]), 2.0),
        ];
        for (patch, area) in patches {
            let model =
                ToolModel::of_patches("", kanagata_tool::ToolKind::Nagata, vec![patch], vec![0]);
            let (points, triangles) = tessellate(&model, 3, &Vec3::zeros());
            let signed: f64 = triangles
                .iter()
                .map(|t| {
                    let [a, b, c] = t.map(|k| points[k as usize]);
                    0.5 * (b - a).cross(&(c - a)).z
                })
                .sum();
            assert!((signed - area).abs() < 1e-12, "{signed}");
        }
    }
}
