//! Where friction shears the faces of a sheet that is pressed flat as far as its material bears: its middle moves out against
//! them, which elements that are not many through the thickness cannot follow. It is told.

use crate::geometry::Vec3;
use crate::report::record::ShearedRecord;
use crate::solver::assembly::Body;
use crate::solver::blank::HexMesh;
use crate::solver::element::ElementKind;

/// Share of the nodes of both faces from which it is of note: sheets that come out right have up to 0.17, others 0.33 and more
/// (docs/results/solver.md).
const OF_NOTE: f64 = 0.25;

/// Layers of `hex8` that follow it.
const LAYERS: usize = 4;

/// What is seen of it with these forces of the tools on the nodes, three a node [N], its nodes now at these positions;
/// `increment`: the one that ended there.
#[must_use]
pub fn sheared(
    body: &Body,
    positions: &[Vec3],
    forces: &[f64],
    increment: usize,
) -> Option<ShearedRecord> {
    let mesh = body.mesh();
    let layers = mesh.nodes_per_column.checked_sub(1).filter(|layers| *layers > 0)?;
    if body.kind() == ElementKind::Hex8 && layers >= LAYERS {
        return None;
    }
    let force = |node: usize| Vec3::from_column_slice(&forces[3 * node..3 * node + 3]);
    if (0..positions.len()).all(|node| force(node) == Vec3::zeros()) {
        return None;
    }
    let stress: Vec<f64> =
        body.element_states()?.iter().map(|state| state.mean.equivalent_stress).collect();
    let faces = faces(mesh, positions, &stress);
    let flows = |(node, face): &(usize, &Face)| {
        let area = face.area.norm();
        let (out, bears) = (face.area / area, face.stress / face.elements);
        let pressure = force(*node).dot(&out);
        let shear = (force(*node) - pressure * out).norm();
        -pressure > bears * area && shear > bears * area / 3.0_f64.sqrt()
    };
    let outer = || faces.iter().enumerate().filter(|(_, face)| face.elements > 0.0);
    let found: Vec<usize> = outer().filter(flows).map(|(node, _)| node).collect();
    let share = found.len() as f64 / outer().count() as f64;
    let first = *found.first().filter(|_| share > OF_NOTE)?;
    Some(ShearedRecord { first_increment: increment, share, at_mm: positions[first].into() })
}

/// What lies about a node of a face of the sheet.
#[derive(Clone, Copy, Default)]
struct Face {
    /// Its part of the area, outwards [mm²].
    area: Vec3,
    /// Equivalent stress, summed over its elements [MPa].
    stress: f64,
    elements: f64,
}

fn faces(mesh: &HexMesh, positions: &[Vec3], stress: &[f64]) -> Vec<Face> {
    let mut out = vec![Face::default(); positions.len()];
    let last = mesh.nodes_per_column - 1;
    for (element, stress) in mesh.elements.iter().zip(stress) {
        // Seen from outside each runs counter-clockwise.
        for (corners, level) in [([3, 2, 1, 0], 0), ([4, 5, 6, 7], last)] {
            let nodes = corners.map(|corner: usize| element[corner] as usize);
            if nodes.iter().any(|node| node % mesh.nodes_per_column != level) {
                continue;
            }
            let [a, b, c, d] = nodes.map(|node| positions[node]);
            let quarter = (c - a).cross(&(d - b)) / 8.0;
            for node in nodes {
                out[node].area += quarter;
                out[node].stress += stress;
                out[node].elements += 1.0;
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::assembly::Evaluation;
    use crate::solver::blank::rectangle;
    use crate::solver::element::Want;
    use crate::solver::material::card;

    /// A sheet that flows, pressed on both faces by `pressure` and sheared there by `shear` times what it flows at.
    fn found(kind: ElementKind, layers: usize, [pressure, shear]: [f64; 2]) -> Option<f64> {
        let steel = card::find("mild-steel-neto2012").unwrap().build(0.0).unwrap();
        let mut body = Body::new(rectangle(6.0, 4.0, 0.8, 3, 2, layers), kind, steel).unwrap();
        let stretched = |x: &Vec3| [0.05 * x.x, -0.02 * x.y, -0.028 * x.z];
        let u: Vec<f64> = body.mesh().nodes.iter().flat_map(stretched).collect();
        body.evaluate(&u, Want::Residual, &mut Evaluation::default()).unwrap();
        body.commit();
        let flow = body.element_states().unwrap()[0].mean.equivalent_stress;
        let mesh = body.mesh();
        let mut forces = vec![0.0; 3 * mesh.nodes.len()];
        for (node, x) in mesh.nodes.iter().enumerate() {
            let out = match x.z {
                z if z < 1e-9 => -1.0,
                z if z > 0.8 - 1e-9 => 1.0,
                _ => continue,
            };
            let half = |inside: bool| if inside { 1.0 } else { 0.5 };
            let area = 4.0 * half((0.1..5.9).contains(&x.x)) * half((0.1..3.9).contains(&x.y));
            forces[3 * node] = -area * shear * flow;
            forces[3 * node + 2] = -out * area * pressure * flow;
        }
        sheared(&body, &mesh.nodes, &forces, 3).map(|found| found.share)
    }

    #[test]
    fn faces_that_friction_shears_as_far_as_they_bear_are_found() {
        let shell = ElementKind::SolidShell { points: 5, membrane: true };
        for (kind, layers) in [(shell, 1), (shell, 4), (ElementKind::Hex8, 2)] {
            assert_eq!(found(kind, layers, [2.0, 0.6]), Some(1.0), "{kind:?}");
            // Pressed and not sheared, sheared and not pressed.
            assert_eq!(found(kind, layers, [2.0, 0.5]), None, "{kind:?}");
            assert_eq!(found(kind, layers, [0.9, 0.6]), None, "{kind:?}");
            assert_eq!(found(kind, layers, [-2.0, 0.6]), None, "{kind:?}");
        }
        assert_eq!(found(ElementKind::Hex8, 4, [2.0, 0.6]), None);
    }
}
