//! Sheet meshes of files: hexahedra, or quadrilaterals without thickness.

use kanagata_geometry::{Aabb, Vec3};

/// Hexahedra of a file that may also have surfaces.
pub(super) struct Volumes {
    pub(super) points: Vec<Vec3>,
    pub(super) hexahedra: Vec<[u32; 8]>,
}

/// True when the name and values of a field indicate a deformed mesh. Values that are all zero, and a uniform
/// thickness, do not.
pub(super) fn is_result(name: &str, values: &[f64]) -> bool {
    /// Parts of the names of result fields in this and other solvers.
    const NAMES: [&str; 6] =
        ["strain", "stress", "displacement", "plastic", "peeq", "contact_force"];
    /// Relative difference of thicknesses that is attributed to rounding.
    const UNIFORM_TOLERANCE_REL: f64 = 1e-5;
    let name = name.to_lowercase();
    if name.contains("thickness") && !name.contains("strain") {
        let ends = values
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(*x), high.max(*x)]);
        return ends[1] - ends[0] > UNIFORM_TOLERANCE_REL * ends[1].abs();
    }
    NAMES.iter().any(|part| name.contains(part)) && values.iter().any(|x| *x != 0.0)
}

/// Elements of a sheet, with the corner order of VTK, gmsh and Abaqus.
#[derive(Debug, Clone, PartialEq)]
pub enum SheetElements {
    /// Quadrilaterals.
    Quads(Vec<[u32; 4]>),
    /// Hexahedra: a ring of four nodes and the ring above it.
    Hexahedra {
        /// Node ids.
        elements: Vec<[u32; 8]>,
        /// The rings are the lower and the upper face of the sheet (continuum shells); otherwise the orientation is
        /// arbitrary.
        stacked: bool,
    },
}

/// A sheet of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct SheetMesh {
    /// Points used by elements [mm], in file order.
    pub points: Vec<Vec3>,
    /// Elements.
    pub elements: SheetElements,
    /// Names of fields that indicate a deformed mesh: strains, stresses, displacements, a varying thickness.
    pub results: Vec<String>,
}

impl SheetMesh {
    /// Bounding box of all points.
    #[must_use]
    pub fn bbox(&self) -> Aabb {
        Aabb::of_points(&self.points)
    }
}

/// Points used by elements, in file order, and the renumbered elements.
pub(super) fn used<const N: usize>(
    points: &[Vec3],
    mut elements: Vec<[u32; N]>,
) -> (Vec<Vec3>, Vec<[u32; N]>) {
    let mut number = vec![u32::MAX; points.len()];
    elements.iter().flatten().for_each(|&n| number[n as usize] = 0);
    let mut kept = Vec::new();
    for (id, p) in number.iter_mut().zip(points).filter(|(id, _)| **id == 0) {
        *id = kept.len() as u32;
        kept.push(*p);
    }
    elements.iter_mut().flatten().for_each(|n| *n = number[*n as usize]);
    (kept, elements)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_of_a_deformed_sheet_are_told_from_those_of_a_virgin_one() {
        for (name, values, expected) in [
            ("plastic_strain", [0.0, 0.1], true),
            ("plastic_strain", [0.0, 0.0], false),
            ("PEEQ", [0.0, 0.1], true),
            ("Stress_mpa", [1.0, -1.0], true),
            ("displacement_mm", [0.0, 1e-3], true),
            ("thickness_mm", [1.0, 0.9], true),
            ("thickness_mm", [1.0, 1.0 + 1e-8], false),
            ("thickness_strain", [-0.1, -0.1], true),
            ("face", [3.0, 4.0], false),
        ] {
            assert_eq!(is_result(name, &values), expected, "{name} {values:?}");
        }
    }
}
