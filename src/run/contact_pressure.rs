//! Contact pressure under each tool: mean over the area in contact, and largest at a node.

use super::{contact_fields, fields};
use kanagata_geometry::Vec3;
use kanagata_solver::sheet::hex_mesh::HexMesh;
use kanagata_solver::{IncrementReport, NodeContact};

/// Contact pressure under a tool that touches the sheet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToolPressure {
    /// Sum of the normal forces of the nodes in contact over `area_mm2` [MPa].
    pub mean_mpa: f64,
    /// Largest normal force of a node over its area [MPa].
    pub max_mpa: f64,
    /// That node.
    pub node: usize,
    /// Area in contact: that of the nodes in contact, of the modelled part [mm²].
    pub area_mm2: f64,
}

/// Pressure under each of `tools` tools; `None` for a tool that touches no node with an area.
#[must_use]
pub fn of_tools(
    mesh: &HexMesh,
    positions: &[Vec3],
    contacts: &[NodeContact],
    tools: usize,
) -> Vec<Option<ToolPressure>> {
    let areas = contact_fields::face_areas(mesh, positions);
    let mut sums: Vec<Option<(f64, ToolPressure)>> = vec![None; tools];
    for contact in contacts {
        let area = areas.get(contact.node).copied().unwrap_or(0.0);
        let Some(sum) = sums.get_mut(contact.tool).filter(|_| area > 0.0) else { continue };
        let first = ToolPressure { mean_mpa: 0.0, max_mpa: f64::MIN, node: 0, area_mm2: 0.0 };
        let (force, found) = sum.get_or_insert((0.0, first));
        *force += contact.normal_force;
        found.area_mm2 += area;
        if contact.normal_force / area > found.max_mpa {
            (found.max_mpa, found.node) = (contact.normal_force / area, contact.node);
        }
    }
    let mean = |(force, found): (f64, ToolPressure)| ToolPressure {
        mean_mpa: force / found.area_mm2,
        ..found
    };
    sums.into_iter().map(|sum| sum.map(mean)).collect()
}

/// Pressure under each tool after an increment.
#[must_use]
pub fn of_report(report: &IncrementReport<'_>) -> Vec<Option<ToolPressure>> {
    let mesh = report.body.mesh();
    let positions = fields::positions(mesh, report.displacements);
    of_tools(mesh, &positions, report.node_contacts, report.tools.len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_solver::sheet::hex_mesh::rectangle;

    /// A holder over the upper face presses with 2 MPa, and with 5 MPa at one node; a die touches half of the lower face.
    #[test]
    fn pressure_is_force_over_the_area_in_contact() {
        let mesh = rectangle(6.0, 4.0, 0.9, 3, 2, 2);
        let areas = contact_fields::face_areas(&mesh, &mesh.nodes);
        let peak = mesh.top_nodes()[5] as usize;
        let contact = |node: u32, tool, pressure: f64| NodeContact {
            node: node as usize,
            tool,
            slips: false,
            normal_force: pressure * areas[node as usize],
        };
        let press = |node: u32| if node as usize == peak { 5.0 } else { 2.0 };
        let mut contacts: Vec<NodeContact> =
            mesh.top_nodes().into_iter().map(|node| contact(node, 1, press(node))).collect();
        let lower = mesh.bottom_nodes().into_iter();
        let lower = lower.filter(|&node| mesh.nodes[node as usize].x < 2.5);
        contacts.extend(lower.map(|node| contact(node, 0, 3.0)));
        contacts.push(NodeContact { node: usize::MAX, tool: 1, slips: true, normal_force: 1e9 });
        let found = of_tools(&mesh, &mesh.nodes, &contacts, 3);
        let [Some(die), Some(holder), None] = found[..] else { panic!("{found:?}") };
        assert!((die.mean_mpa - 3.0).abs() < 1e-12 && (die.max_mpa - 3.0).abs() < 1e-12);
        // Columns at 0 and 2 mm stand for 1 and 2 mm of the length.
        assert!((die.area_mm2 - 12.0).abs() < 1e-12, "{die:?}");
        let mean = 2.0 + 3.0 * areas[peak] / 24.0;
        assert!((holder.mean_mpa - mean).abs() < 1e-12 && holder.node == peak, "{holder:?}");
        assert!((holder.max_mpa - 5.0).abs() < 1e-12 && (holder.area_mm2 - 24.0).abs() < 1e-12);
    }
}
