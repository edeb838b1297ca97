//! Through-thickness shear at the friction limit.
//!
//! Friction shears the faces of a flat-pressed sheet at the shear flow stress, and the core flows out between them. Few
//! elements through the thickness cannot represent this.

use kanagata_geometry::Vec3;
use kanagata_report::record::ThroughThicknessShearRecord;
use kanagata_solver::assembly::Body;
use kanagata_solver::element::ElementKind;
use kanagata_solver::sheet::hex_mesh::HexMesh;

/// Fraction of the pressed nodes above which the check reports: sound runs reach 0.25, wrong ones 0.33 and more
/// (docs/results/solver.md).
const SHEARED_FRACTION_MIN: f64 = 0.3;

/// Layers of `hex8` that resolve the shear.
const RESOLVING_LAYERS: usize = 4;

/// Checks one increment. `forces`: contact forces, three per node [N]; `positions`: current positions of the nodes [mm];
/// `increment`: its number.
#[must_use]
pub fn through_thickness_shear(
    body: &Body,
    positions: &[Vec3],
    forces: &[f64],
    increment: usize,
) -> Option<ThroughThicknessShearRecord> {
    let mesh = body.mesh();
    let layers = mesh.nodes_per_column.checked_sub(1).filter(|layers| *layers > 0)?;
    if body.kind() == ElementKind::Hex8 && layers >= RESOLVING_LAYERS {
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
    let fraction = count(&flows) as f64 / count(&pressed) as f64;
    let first = flows
        .iter()
        .zip(&flat)
        .position(|(a, b)| *a && *b)
        .filter(|_| fraction > SHEARED_FRACTION_MIN)?;
    let at_mm = positions[first].into();
    Some(ThroughThicknessShearRecord { first_increment: increment, fraction, at_mm })
}

/// Nodes of face elements around a node whose adjacent nodes are all pressed. Nodes under edges and lines of contact are
/// excluded.
fn flat(mesh: &HexMesh, pressed: &[bool]) -> Vec<bool> {
    let mut inside = pressed.to_vec();
    for_each_face(mesh, |element, nodes| {
        let nodes = nodes.map(|node| mesh.effective_node(element, node as u32) as usize);
        if nodes.iter().any(|node| !pressed[*node]) {
            nodes.iter().for_each(|node| inside[*node] = false);
        }
    });
    let mut out = vec![false; pressed.len()];
    for_each_face(mesh, |element, nodes| {
        let nodes = nodes.map(|node| mesh.effective_node(element, node as u32) as usize);
        if nodes.iter().any(|node| inside[*node]) {
            nodes.iter().for_each(|node| out[*node] = true);
        }
    });
    out
}

/// The face area around a node of the sheet.
#[derive(Clone, Copy, Default)]
struct Face {
    /// Tributary area, outward normal [mm²].
    area: Vec3,
    /// Sum of the equivalent stresses of adjacent elements [MPa].
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
    // The masters of a hanging node carry its force, half each.
    for (node, masters) in mesh.hanging_nodes() {
        let Face { area, stress, elements } = std::mem::take(&mut out[node]);
        for master in masters {
            out[master].area += 0.5 * area;
            out[master].stress += 0.5 * stress;
            out[master].elements += 0.5 * elements;
        }
    }
    out
}

/// Calls `see` with each element at a face of the sheet and its face nodes, counter-clockwise from outside.
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
    use kanagata_solver::assembly::Evaluation;
    use kanagata_solver::element::Want;
    use kanagata_solver::material::card;
    use kanagata_solver::sheet::hex_mesh::rectangle;

    const LENGTH: f64 = 30.0;

    /// A flowing sheet pressed on both faces by `pressure` where `x` is in a range, and sheared there by `shear`, both
    /// times the flow stress.
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
        through_thickness_shear(&body, &mesh.nodes, &forces, 3).map(|found| found.fraction)
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
            // Pressed without shear, sheared without pressure.
            assert_eq!(found(kind, layers, [2.0, 0.5]), None, "{kind:?}");
            assert_eq!(found(kind, layers, [0.9, 0.6]), None, "{kind:?}");
            assert_eq!(found(kind, layers, [-2.0, 0.6]), None, "{kind:?}");
        }
        assert_eq!(found(ElementKind::Hex8, 4, [2.0, 0.6]), None);
    }
}
