//! Where friction shears the faces of a sheet that is pressed flat as far as its material bears: its middle moves out against
//! them, which elements that are not many through the thickness cannot follow. It is told.

use crate::geometry::Vec3;
use crate::report::record::ThroughThicknessShearRecord;
use crate::solver::assembly::Body;
use crate::solver::element::ElementKind;
use crate::solver::sheet::hex_mesh::HexMesh;

/// Share of the nodes that are pressed so, of which it is of note: sheets that come out right have up to 0.25, others 0.33 and
/// more (docs/results/solver.md).
const OF_NOTE: f64 = 0.3;

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
) -> Option<ThroughThicknessShearRecord> {
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
    let state = |(node, face): (usize, &Face)| {
        let area = face.area.norm();
        let (out, bears) = (face.area / area, face.stress / face.elements);
        let pressure = force(node).dot(&out);
        let shear = (force(node) - pressure * out).norm();
        let pressed = face.elements > 0.0 && -pressure > bears * area;
        (pressed, pressed && shear > bears * area / 3.0_f64.sqrt())
    };
    let (pressed, flows): (Vec<bool>, Vec<bool>) = faces.iter().enumerate().map(state).unzip();
    let flat = flat(mesh, &pressed);
    let count = |which: &[bool]| which.iter().zip(&flat).filter(|(a, b)| **a && **b).count();
    let share = count(&flows) as f64 / count(&pressed) as f64;
    let first = flows.iter().zip(&flat).position(|(a, b)| *a && *b).filter(|_| share > OF_NOTE)?;
    Some(ThroughThicknessShearRecord {
        first_increment: increment,
        fraction: share,
        at_mm: positions[first].into(),
    })
}

/// Nodes that lie on or beside one about which the face is pressed all around: not under an edge or a line of contact.
fn flat(mesh: &HexMesh, pressed: &[bool]) -> Vec<bool> {
    let mut inside = pressed.to_vec();
    for_each_face(mesh, |_, nodes| {
        if nodes.iter().any(|node| !pressed[*node]) {
            nodes.iter().for_each(|node| inside[*node] = false);
        }
    });
    let mut out = vec![false; pressed.len()];
    for_each_face(mesh, |_, nodes| {
        if nodes.iter().any(|node| inside[*node]) {
            nodes.iter().for_each(|node| out[*node] = true);
        }
    });
    out
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
    for_each_face(mesh, |element, nodes| {
        let [a, b, c, d] = nodes.map(|node| positions[node]);
        let quarter = (c - a).cross(&(d - b)) / 8.0;
        for node in nodes {
            out[node].area += quarter;
            out[node].stress += stress[element];
            out[node].elements += 1.0;
        }
    });
    out
}

/// Elements and their nodes in the faces of the sheet, seen from outside counter-clockwise.
fn for_each_face(mesh: &HexMesh, mut see: impl FnMut(usize, [usize; 4])) {
    let last = mesh.nodes_per_column - 1;
    for (k, element) in mesh.elements.iter().enumerate() {
        for (corners, level) in [([3, 2, 1, 0], 0), ([4, 5, 6, 7], last)] {
            let nodes = corners.map(|corner: usize| element[corner] as usize);
            if nodes.iter().all(|node| node % mesh.nodes_per_column == level) {
                see(k, nodes);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::assembly::Evaluation;
    use crate::solver::element::Want;
    use crate::solver::material::card;
    use crate::solver::sheet::hex_mesh::rectangle;

    const LENGTH: f64 = 30.0;

    /// A sheet that flows, pressed on both faces where `x` is in a range by `pressure` and sheared there by `shear` times what it
    /// flows at.
    fn found_within(
        range: std::ops::Range<f64>,
        kind: ElementKind,
        layers: usize,
        [pressure, shear]: [f64; 2],
    ) -> Option<f64> {
        let steel = card::find("mild-steel-neto2012").unwrap().build(0.0).unwrap();
        let mesh = rectangle(LENGTH, 4.0, 0.8, 15, 2, layers);
        let mut body = Body::new(mesh, kind, steel).unwrap();
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
            if !range.contains(&x.x) {
                continue;
            }
            let half = |inside: bool| if inside { 1.0 } else { 0.5 };
            let across = half((0.1..3.9).contains(&x.y));
            let area = 4.0 * half((0.1..LENGTH - 0.1).contains(&x.x)) * across;
            forces[3 * node] = -area * shear * flow;
            forces[3 * node + 2] = -out * area * pressure * flow;
        }
        sheared(&body, &mesh.nodes, &forces, 3).map(|found| found.fraction)
    }

    fn found(kind: ElementKind, layers: usize, times: [f64; 2]) -> Option<f64> {
        found_within(-1.0..LENGTH + 1.0, kind, layers, times)
    }

    #[test]
    fn a_grip_on_a_part_of_the_sheet_is_found_and_a_line_is_not() {
        let shell = ElementKind::SolidShell { points: 5, membrane: true };
        assert_eq!(found_within(25.9..31.0, shell, 1, [2.0, 0.6]), Some(1.0));
        assert_eq!(found_within(9.9..12.1, shell, 1, [2.0, 0.6]), None);
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
