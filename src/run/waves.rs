//! Waves of the sheet between two tools: how far it stands off the nearer of them where it is compressed in its plane.
//!
//! At a column of nodes let `g_u` and `g_l` be the gaps of the upper and the lower face to the tools above and below
//! them. The offset `min(g_u, g_l)` is zero on sheet that is clamped, and on sheet that lies on one tool, however far
//! the other has lifted. It is evaluated where both tools are within a thickness and the minor principal membrane stress is
//! compressive, without which a sheet does not wrinkle.
//!
//! A wave of amplitude `A` (height `2 A`) whose crests and troughs touch both tools has offsets up to `A`, where it passes
//! the middle. One that touches one of the tools only has offsets up to its height `2 A`, at its crests.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::{contact_fields, fields};
use kanagata_contact::ToolSurface;
use kanagata_geometry::{Mat3, Vec3};
use kanagata_report::record::WaveRecord;
use kanagata_solver::IncrementReport;
use kanagata_solver::sheet::hex_mesh::HexMesh;

/// Array of the offsets [mm].
pub const WAVE_OFFSET: &str = "wave_offset_mm";

/// Gap over the mean thickness up to which a tool limits waves. With two thicknesses, the wall of a drawn part that hangs
/// free between punch and die would count.
const REACH_REL: f64 = 1.0;
/// Smallest cosine between the normals of sheet and tool that face each other: 60 degrees.
const FACING_COS_MIN: f64 = 0.5;

/// Offsets of the sheet at an increment.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Waves {
    /// The increment.
    pub increment: usize,
    /// Offset at every column of nodes; `None` where it is not evaluated. Empty without tools, and for a material without
    /// a stress history.
    pub columns: Vec<Option<Offset>>,
    /// Nodes of a column.
    levels: usize,
}

/// Offset of a column between two tools.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Offset {
    /// Distance from the nearer of them [mm].
    pub mm: f64,
    /// Tools below and above it.
    pub tools: [usize; 2],
}

/// A tool in contact with the sheet: its surface and the shift of its frame [mm].
pub type PlacedTool<'a> = (usize, &'a ToolSurface, Vec3);

impl Waves {
    /// Offsets after an increment between tools with these surfaces. Tools without contact are left out.
    #[must_use]
    pub fn of(report: &IncrementReport<'_>, surfaces: &[Arc<ToolSurface>]) -> Self {
        let increment = report.increment;
        let tensors = report.body.element_tensors(report.displacements);
        let Some(tensors) = tensors.filter(|_| !report.free) else {
            return Self { increment, ..Self::default() };
        };
        let stresses: Vec<[f64; 6]> = tensors.iter().map(|one| one.mean.stress).collect();
        let mesh = report.body.mesh();
        let positions = fields::positions(mesh, report.displacements);
        let touching = report.tools.iter().zip(surfaces).enumerate();
        let touching = touching.filter(|(_, (tool, _))| tool.contacts > 0);
        let tools: Vec<PlacedTool<'_>> =
            touching.map(|(k, (tool, surface))| (k, &**surface, tool.shift.into())).collect();
        Self { increment, ..Self::of_state(mesh, &positions, &stresses, &tools) }
    }

    /// Offsets of a sheet with its nodes at `positions` [mm] and a mean Cauchy stress in every element (`xx, yy, zz, xy,
    /// yz, xz`) [MPa] between tools.
    #[must_use]
    pub fn of_state(
        mesh: &HexMesh,
        positions: &[Vec3],
        stresses: &[[f64; 6]],
        tools: &[PlacedTool<'_>],
    ) -> Self {
        let levels = mesh.nodes_per_column.max(1);
        let normals = contact_fields::normals(mesh, positions);
        let minor = minor_membrane_stress(mesh, &normals, stresses);
        let reach = REACH_REL * mesh.mean_thickness();
        let (low, high) = (mesh.bottom_nodes(), mesh.top_nodes());
        let gap = |node: u32, outward: Vec3| {
            nearest_tool(&positions[node as usize], outward, reach, tools)
        };
        let of = |column: usize| {
            let normal = normals[column];
            let (below, above) = if minor[column] < 0.0 {
                gap(low[column], -normal).zip(gap(high[column], normal))?
            } else {
                return None;
            };
            Some(Offset { mm: below.1.min(above.1).max(0.0), tools: [below.0, above.0] })
        };
        let columns = (0..mesh.column_count()).map(of).collect();
        Self { columns, levels, increment: 0 }
    }

    /// Offset at every node, the same through the thickness [mm]; NaN where it is not evaluated. `None` where no column
    /// could be.
    #[must_use]
    pub fn at_nodes(&self) -> Option<Vec<f64>> {
        let of = |column: &Option<Offset>| column.map_or(f64::NAN, |offset| offset.mm);
        let columns = self.columns.iter();
        let nodes = columns.flat_map(|column| std::iter::repeat_n(of(column), self.levels));
        (!self.columns.is_empty()).then(|| nodes.collect())
    }

    /// The largest offset, the first of equal ones; `None` if none was evaluated.
    #[must_use]
    pub fn largest(&self, report: &IncrementReport<'_>) -> Option<WaveRecord> {
        let mesh = report.body.mesh();
        let known = self.columns.iter().enumerate().filter_map(|(k, one)| Some((k, (*one)?)));
        let (column, offset) = known.reduce(|a, b| if b.1.mm > a.1.mm { b } else { a })?;
        let node = mesh.top_nodes()[column] as usize;
        let moved = &report.displacements[3 * node..3 * node + 3];
        let name =
            |tool: usize| report.tools.get(tool).map_or_else(String::new, |t| t.name.clone());
        let initial = fields::column_thickness(mesh, &mesh.nodes)[column];
        Some(WaveRecord {
            increment: self.increment,
            offset_mm: offset.mm,
            offset_rel: offset.mm / initial,
            at_mm: std::array::from_fn(|k| mesh.nodes[node][k] + moved[k]),
            tools: offset.tools.map(name),
        })
    }
}

/// The tool that faces a point of the sheet with this outward normal, and the gap to it [mm]; `None` beyond `reach`.
fn nearest_tool(
    at: &Vec3,
    outward: Vec3,
    reach: f64,
    tools: &[PlacedTool<'_>],
) -> Option<(usize, f64)> {
    let gap = |(tool, surface, shift): &PlacedTool<'_>| {
        let foot = surface.within(&(at - shift), None, reach);
        let faces = -foot.normal.dot(&outward) > FACING_COS_MIN;
        (!foot.past_border && faces && foot.gap <= reach).then_some((*tool, foot.gap))
    };
    tools.iter().filter_map(gap).reduce(|a, b| if b.1 < a.1 { b } else { a })
}

/// Minor principal stress in the plane of the sheet at every column [MPa]: of the mean of the adjacent elements through
/// the thickness. Zero for a column without elements.
fn minor_membrane_stress(mesh: &HexMesh, normals: &[Vec3], stresses: &[[f64; 6]]) -> Vec<f64> {
    let levels = mesh.nodes_per_column.max(1);
    let mut sums = vec![([0.0; 6], 0_usize); mesh.column_count()];
    for (element, stress) in mesh.elements.iter().zip(stresses) {
        for node in &element[..4] {
            let (sum, count) = &mut sums[*node as usize / levels];
            (0..6).for_each(|k| sum[k] += stress[k]);
            *count += 1;
        }
    }
    let minor = |((sum, count), normal): (&([f64; 6], usize), &Vec3)| {
        let [xx, yy, zz, xy, yz, xz] = sum.map(|s| s / (*count).max(1) as f64);
        let stress = Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        let one = normal.cross(&Vec3::ith(normal.iamin(), 1.0)).try_normalize(0.0);
        let one = one.unwrap_or_default();
        let other = normal.cross(&one);
        let (a, b, c) =
            (one.dot(&(stress * one)), other.dot(&(stress * other)), one.dot(&(stress * other)));
        0.5 * (a + b) - (0.5 * (a - b)).hypot(c)
    };
    sums.iter().zip(normals).map(minor).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_tools::plane;
    use kanagata_solver::sheet::hex_mesh::rectangle;

    /// A square plane at z = 0 whose normal is along `sign` times z.
    fn plane_z(sign: f64) -> ToolSurface {
        let corner = Vec3::new(-100.0, -100.0, 0.0);
        let (x, y) = (Vec3::x() * 300.0, Vec3::y() * 300.0);
        let (a, b) = if sign > 0.0 { (x, y) } else { (y, x) };
        ToolSurface::new(plane("plane", corner, a, b, Vec3::z() * sign))
    }

    const THICKNESS: f64 = 0.8;
    const AMPLITUDE: f64 = 0.15;

    /// A sheet with waves along x of this amplitude, 24 elements long each, whose mid-surface has the mean height `z`.
    fn wavy(z: f64) -> (HexMesh, Vec<Vec3>) {
        let mesh = rectangle(48.0, 4.0, THICKNESS, 48, 4, 2);
        let wave = |x: &Vec3| {
            let phase = x.x * std::f64::consts::TAU / 24.0;
            // Nodes move along the normal of the mid-surface.
            let slope = AMPLITUDE * phase.cos() * std::f64::consts::TAU / 24.0;
            let normal = Vec3::new(-slope, 0.0, 1.0).normalize();
            let middle = Vec3::new(x.x, x.y, z + AMPLITUDE * phase.sin());
            middle + normal * (x.z - 0.5 * THICKNESS)
        };
        let positions = mesh.nodes.iter().map(wave).collect();
        (mesh, positions)
    }

    /// Die below z = 0, holder above `lift` over the thickness.
    fn offsets(mean: f64, lift: f64, stress: [f64; 6]) -> Vec<f64> {
        let (mesh, positions) = wavy(mean);
        let die = plane_z(1.0);
        let holder = plane_z(-1.0);
        let tools: [PlacedTool<'_>; 2] =
            [(0, &die, Vec3::zeros()), (1, &holder, Vec3::z() * (THICKNESS + lift))];
        let stresses = vec![stress; mesh.elements.len()];
        let found = Waves::of_state(&mesh, &positions, &stresses, &tools);
        let at_nodes = found.at_nodes().unwrap();
        mesh.top_nodes().iter().map(|&node| at_nodes[node as usize]).collect()
    }

    fn largest(offsets: &[f64]) -> f64 {
        assert!(offsets.iter().all(|x| x.is_finite()));
        offsets.iter().copied().fold(0.0, f64::max)
    }

    const COMPRESSED: [f64; 6] = [-80.0, 200.0, 0.0, 0.0, 0.0, 0.0];

    /// Crests touch the holder and troughs the die, which are apart by the thickness and twice the amplitude: the offset is
    /// the amplitude. With a holder that lies higher it is the height at the crests.
    #[test]
    fn the_offset_of_a_wave_between_tools_is_its_amplitude() {
        let mean = 0.5 * THICKNESS + AMPLITUDE;
        let both = offsets(mean, 2.0 * AMPLITUDE, COMPRESSED);
        assert!((largest(&both) - AMPLITUDE).abs() < 0.01 * AMPLITUDE, "{both:?}");
        let smallest = both.iter().copied().fold(f64::INFINITY, f64::min);
        assert!(smallest < 0.01 * AMPLITUDE, "crests touch: {smallest}");
        let one_sided = offsets(mean, 4.5 * AMPLITUDE, COMPRESSED);
        assert!((largest(&one_sided) - 2.0 * AMPLITUDE).abs() < 0.01 * AMPLITUDE);
    }

    #[test]
    fn sheet_in_tension_and_sheet_without_a_second_tool_have_no_offset() {
        let mean = 0.5 * THICKNESS + AMPLITUDE;
        let stretched = [80.0, 200.0, 0.0, 0.0, 0.0, 0.0];
        assert!(offsets(mean, 2.0 * AMPLITUDE, stretched).iter().all(|x| x.is_nan()));
        assert!(offsets(mean, 3.0 * THICKNESS, COMPRESSED).iter().all(|x| x.is_nan()));
        // Compression along z of a flat sheet is no stress in its plane.
        let pressed = [10.0, 10.0, -300.0, 0.0, 0.0, 0.0];
        assert!(offsets(mean, 2.0 * AMPLITUDE, pressed).iter().all(|x| x.is_nan()));
    }

    /// A flat sheet on the die has none, though the holder is lifted.
    #[test]
    fn sheet_that_lies_on_one_tool_has_no_offset_under_a_lifted_holder() {
        let mesh = rectangle(10.0, 4.0, THICKNESS, 10, 4, 1);
        let die = plane_z(1.0);
        let holder = plane_z(-1.0);
        let tools: [PlacedTool<'_>; 2] =
            [(0, &die, Vec3::zeros()), (1, &holder, Vec3::z() * (THICKNESS + 0.3))];
        let stresses = vec![COMPRESSED; mesh.elements.len()];
        let found = Waves::of_state(&mesh, &mesh.nodes, &stresses, &tools);
        assert!(found.at_nodes().unwrap().iter().all(|offset| offset.abs() < 1e-12));
        assert_eq!(found.columns[0].unwrap().tools, [0, 1]);
        // A checkpoint keeps what is not evaluated.
        let stretched = vec![[1.0; 6]; mesh.elements.len()];
        let none = Waves::of_state(&mesh, &mesh.nodes, &stretched, &[]);
        let text = serde_json::to_string(&none).unwrap();
        assert_eq!(serde_json::from_str::<Waves>(&text).unwrap(), none);
        assert!(none.at_nodes().unwrap().iter().all(|offset| offset.is_nan()));
    }

    /// The minor stress of a turned sheet is that in its plane.
    #[test]
    fn the_membrane_stress_is_in_the_plane_of_the_sheet() {
        let mesh = rectangle(2.0, 2.0, 1.0, 2, 2, 2);
        let turn = nalgebra::Rotation3::from_euler_angles(0.4, -0.8, 1.9).into_inner();
        let own = Mat3::new(50.0, 30.0, 0.0, 30.0, -20.0, 0.0, 0.0, 0.0, -500.0);
        let m = turn * own * turn.transpose();
        let stress = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)].map(|place| m[place]);
        let positions: Vec<Vec3> = mesh.nodes.iter().map(|x| turn * x).collect();
        let normals = contact_fields::normals(&mesh, &positions);
        let expected = 15.0 - 35.0_f64.hypot(30.0);
        for minor in minor_membrane_stress(&mesh, &normals, &vec![stress; mesh.elements.len()]) {
            assert!((minor - expected).abs() < 1e-10, "{minor} {expected}");
        }
    }
}
