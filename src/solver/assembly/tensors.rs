//! Stress and strain tensors of elements in global axes, for output.

use rayon::prelude::*;

use super::body::Body;
use crate::element::{ElementKind, rotation};
use crate::material::corotational::Corotational;
use kanagata_geometry::{Mat3, Vec3};

/// Cauchy stress and logarithmic strain in global axes of the deformed sheet, each as `xx, yy, zz, xy, yz, xz`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Tensors {
    /// Cauchy stress [MPa].
    pub stress: [f64; 6],
    /// Logarithmic strain `ln V = R (ln U) Rᵀ`, with tensor shear components.
    pub strain: [f64; 6],
}

/// Volume-weighted means of an element, and values at its faces.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ElementTensors {
    /// Over all points.
    pub mean: Tensors,
    /// At the lower face. Solid-shells: over the four points nearest to it. Solids: extrapolated.
    pub lower: Tensors,
    /// At the upper face, likewise.
    pub upper: Tensors,
}

impl Body {
    /// Tensors of every element at the last commit, whose displacements (three per node [mm]) are given; `None` for a
    /// material without history. Not finite in an element whose base vectors are parallel.
    #[must_use]
    pub fn element_tensors(&self, displacement: &[f64]) -> Option<Vec<ElementTensors>> {
        self.material.history_layout()?;
        let places = self.kind.point_places(&self.thickness_rule);
        let shared = self.point_weights();
        let of_element = |element: usize| {
            let own = || self.evaluation_data().geometry[element].map(|point| point.weight).into();
            let weights = shared.clone().unwrap_or_else(own);
            let points = self.point_tensors(element, displacement, &places)?;
            let [lower, upper] =
                self.kind.outermost_points().map(|row| mean(&points, &weights, row));
            let [lower, upper] = match self.kind {
                ElementKind::SolidShell { .. } => [lower, upper],
                ElementKind::Hex8 | ElementKind::Hex8Enhanced => at_faces(&lower, &upper),
            };
            Some(ElementTensors { mean: mean(&points, &weights, 0..points.len()), lower, upper })
        };
        (0..self.mesh.elements.len()).into_par_iter().map(of_element).collect()
    }

    /// Tensors at the points of an element, with these natural coordinates.
    fn point_tensors(
        &self,
        element: usize,
        displacement: &[f64],
        places: &[[f64; 3]],
    ) -> Option<Vec<Tensors>> {
        let (stride, len) = (self.stride(), self.material.state_len());
        let history = &self.evaluation_data().committed[element * stride..][..places.len() * len];
        let ids = self.mesh.elements[element].map(|node| node as usize);
        let nodes = ids.map(|node| self.mesh.nodes[node]);
        let moved = ids.map(|node| {
            self.mesh.nodes[node] + Vec3::from_column_slice(&displacement[3 * node..3 * node + 3])
        });
        // Histories are in the material axes of the element, if it has its own.
        let axes = self.axes.as_ref().map_or_else(Mat3::identity, |axes| axes[element]);
        let tensors = |(state, xi): (&[f64], &[f64; 3])| {
            let own = Corotational::of(&self.material.log_state(state)?);
            let stretch = axes * own.stretch * axes.transpose();
            let turn = rotation(&nodes, &moved, *xi, &stretch);
            let turn = turn.unwrap_or_else(|| Mat3::repeat(f64::NAN)) * axes;
            let global = |tensor: Mat3| components(&(turn * tensor * turn.transpose()));
            Some(Tensors { stress: global(own.stress), strain: global(own.strain) })
        };
        history.chunks_exact(len).zip(places).map(tensors).collect()
    }
}

fn components(m: &Mat3) -> [f64; 6] {
    [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)].map(|place| m[place])
}

/// Values at the faces `zeta = -1` and `1` of a solid from those at its two rows of points at `zeta = -+1/sqrt(3)`, on the
/// straight line through both: `t(zeta) = (t_u + t_l) / 2 + zeta sqrt(3) (t_u - t_l) / 2`. Strains of bending are on it;
/// a stress beyond the yield stress may be extrapolated from points that yield.
fn at_faces(lower: &Tensors, upper: &Tensors) -> [Tensors; 2] {
    let line = |l: &[f64; 6], u: &[f64; 6], zeta: f64| {
        std::array::from_fn(|k| 0.5 * (u[k] + l[k] + zeta * 3.0_f64.sqrt() * (u[k] - l[k])))
    };
    [-1.0, 1.0].map(|zeta| Tensors {
        stress: line(&lower.stress, &upper.stress, zeta),
        strain: line(&lower.strain, &upper.strain, zeta),
    })
}

/// Weighted mean of some points.
fn mean(
    points: &[Tensors],
    weights: &[f64],
    chosen: impl IntoIterator<Item = usize> + Clone,
) -> Tensors {
    let all: f64 = chosen.clone().into_iter().map(|k| weights[k]).sum();
    let mut out = Tensors::default();
    for k in chosen {
        let weight = weights[k] / all;
        for i in 0..6 {
            out.stress[i] += weight * points[k].stress[i];
            out.strain[i] += weight * points[k].strain[i];
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::assembly::evaluation::Evaluation;
    use crate::element::{ElementKind, Want};
    use crate::material::Material;
    use crate::material::card;
    use crate::sheet::hex_mesh::{HexMesh, rectangle};

    const SHELL: ElementKind = ElementKind::SolidShell { points: 5, membrane: true };
    const KINDS: [ElementKind; 4] = [
        ElementKind::Hex8,
        ElementKind::Hex8Enhanced,
        ElementKind::SolidShell { points: 3, membrane: false },
        SHELL,
    ];

    fn steel() -> Arc<dyn Material> {
        card::find("mild-steel-neto2012").unwrap().build(0.0).unwrap()
    }

    /// Von Mises with the flow stress `k (0.005 + p)^0.2` [MPa].
    fn isotropic(k: f64) -> Arc<dyn Material> {
        let card = serde_json::json!({"name": "isotropic", "young_mpa": 2e5, "poisson": 0.3,
            "yield": {"criterion": "von-mises"},
            "hardening": {"law": "swift", "k": k, "eps0": 0.005, "n": 0.2}});
        serde_json::from_value::<card::MaterialCard>(card).unwrap().build(0.0).unwrap()
    }

    fn turned(angles: [f64; 3]) -> Mat3 {
        nalgebra::Rotation3::from_euler_angles(angles[0], angles[1], angles[2]).into_inner()
    }

    /// Moves the nodes to `to` in ten steps.
    fn deform(body: &mut Body, to: impl Fn(f64, &Vec3) -> Vec3) -> Vec<f64> {
        let (mut u, mut out) = (Vec::new(), Evaluation::default());
        for step in 1..=10 {
            let moved = |x: &Vec3| <[f64; 3]>::from(to(0.1 * f64::from(step), x) - x);
            u = body.mesh().nodes.iter().flat_map(moved).collect();
            // Enough evaluations for the internal modes to converge.
            let want = Want::ResidualAndTangent;
            (0..8).for_each(|_| body.evaluate(&u, want, &mut out).unwrap());
            body.commit();
        }
        u
    }

    fn matrix([xx, yy, zz, xy, yz, xz]: [f64; 6]) -> Mat3 {
        Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
    }

    fn near(found: [f64; 6], expected: &Mat3, within: f64) {
        let off = (matrix(found) - expected).norm();
        assert!(off < within, "{found:?} is off {expected} by {off:e}");
    }

    /// Principal stretches along axes that turn with the sheet; the stress of the law has the same axes, so that Cauchy's
    /// is `R T Rᵀ / J`.
    #[test]
    fn a_stretched_and_turned_sheet_has_the_turned_tensors() {
        let long = 0.2;
        let strain = Vec3::new(long, -0.13, -0.0695);
        let turn = turned([0.4, -1.1, 2.0]);
        for kind in KINDS {
            let mut body = Body::new(rectangle(4.0, 2.0, 0.8, 2, 2, 1), kind, steel()).unwrap();
            let u = deform(&mut body, |share, x| {
                let turn = turned([0.4 * share, -1.1 * share, 2.0 * share]);
                turn * (share * strain).map(f64::exp).component_mul(x)
            });
            let expected = turn * Mat3::from_diagonal(&strain) * turn.transpose();
            let data = body.evaluation_data();
            let law = body.material.log_state(&data.committed).unwrap();
            let diagonal = Vec3::new(law.stress[0], law.stress[1], law.stress[2]);
            let own = Mat3::from_diagonal(&(diagonal / strain.sum().exp()));
            let stress = turn * own * turn.transpose();
            assert!(own[(0, 0)] > 200.0 && stress[(1, 2)].abs() > 50.0, "{stress}");
            for found in body.element_tensors(&u).unwrap() {
                for found in [found.mean, found.lower, found.upper] {
                    near(found.strain, &expected, 1e-12);
                    near(found.stress, &stress, 1e-8 * stress.norm());
                }
            }
        }
    }

    /// Tension at 37 degrees to the axes: `σ = s n ⊗ n`, with the flow stress of the curve and no stress elsewhere.
    #[test]
    fn tension_at_an_angle_is_a_dyad_of_the_flow_stress() {
        let material = isotropic(500.0);
        let (s, c) = 37.0_f64.to_radians().sin_cos();
        let axes = Mat3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0);
        let long = 0.1;
        for kind in KINDS {
            let mesh = rectangle(4.0, 2.0, 0.8, 2, 2, 1);
            let mut body = Body::new(mesh, kind, Arc::clone(&material)).unwrap();
            // Lateral strains: half of the plastic and Poisson's part of the elastic strain.
            let side = |e: f64| {
                let mut elastic = 1e-3;
                for _ in 0..100 {
                    elastic = 500.0 * (0.005 + (e - elastic)).powf(0.2) / 2e5;
                }
                if e <= elastic { -0.3 * e } else { -0.5 * (e - elastic) - 0.3 * elastic }
            };
            let u = deform(&mut body, |share, x| {
                let e = share * long;
                let stretch = Vec3::new(e, side(e), side(e)).map(f64::exp);
                axes * Mat3::from_diagonal(&stretch) * axes.transpose() * x
            });
            let found = body.element_tensors(&u).unwrap();
            let states = body.element_states().unwrap();
            let plastic = states[0].mean.plastic_strain;
            let flow = 500.0 * (0.005 + plastic).powf(0.2);
            let volume = (long + 2.0 * side(long)).exp();
            let n = axes.column(0);
            let expected = n * n.transpose() * (flow / volume);
            for found in found {
                near(found.mean.stress, &expected, 1e-6 * flow);
                near(found.upper.stress, &expected, 1e-6 * flow);
            }
        }
    }

    const BEND_RADIUS: f64 = 800.0;
    const BEND_COUNT: usize = 100;

    /// A strip of 0.8 mm bent upwards by less than yield over a quarter of a radian, and turned: stress and strain along the arc
    /// and stress along the normal at the lower face, in the mean, and at the upper face of every element.
    fn bent_strip(kind: ElementKind) -> Vec<[[f64; 3]; 3]> {
        let angle = 0.25;
        let tilt = turned([0.3, 0.5, -0.7]);
        // A chord is shorter than its arc by (l/r)²/24, here 5e-4 of the bending strain.
        let mesh: HexMesh = rectangle(BEND_RADIUS * angle, 8.0, 0.8, BEND_COUNT, 1, 1);
        let mut body = Body::new(mesh, kind, isotropic(5000.0)).unwrap();
        let poisson = 0.3 / 0.7;
        let u = deform(&mut body, |share, x| {
            let r = BEND_RADIUS / share;
            let (s, c) = (x.x / r).sin_cos();
            let z = x.z - 0.4;
            // Thinner where it is stretched: the normal stress vanishes.
            let z = z + poisson * 0.5 * z * z / r;
            tilt * Vec3::new((r - z) * s, x.y, r - (r - z) * c)
        });
        let of = |(k, found): (usize, ElementTensors)| {
            let middle = angle * (k as f64 + 0.5) / BEND_COUNT as f64;
            let (s, c) = middle.sin_cos();
            let (along, normal) = (tilt * Vec3::new(c, 0.0, s), tilt * Vec3::new(-s, 0.0, c));
            let in_direction = |tensor: [f64; 6], n: &Vec3| n.dot(&(matrix(tensor) * n));
            [found.lower, found.mean, found.upper].map(|t| {
                let stress = [along, normal].map(|n| in_direction(t.stress, &n));
                [stress[0], in_direction(t.strain, &along), stress[1]]
            })
        };
        body.element_tensors(&u).unwrap().into_iter().enumerate().map(of).collect()
    }

    /// `σ = E/(1-ν²) z/r` and `ε = z/r` along the arc: of solid-shells at the outermost points, of enhanced hexahedra at
    /// the faces. Compression above, no stress along the normal.
    #[test]
    fn a_bent_strip_has_opposite_stresses_at_its_faces() {
        for (kind, height) in
            [(SHELL, SHELL.thickness_rule()[4].0), (ElementKind::Hex8Enhanced, 1.0)]
        {
            let strain = height * 0.4 / BEND_RADIUS;
            let bending = 2e5 / (1.0 - 0.09) * strain;
            for [lower, mean, upper] in bent_strip(kind) {
                assert!((lower[0] / bending - 1.0).abs() < 0.01, "{lower:?} {bending}");
                assert!((upper[0] / bending + 1.0).abs() < 0.01, "{upper:?} {bending}");
                assert!((lower[1] / strain - 1.0).abs() < 0.01, "{lower:?} {strain}");
                assert!((upper[1] / strain + 1.0).abs() < 0.01, "{upper:?} {strain}");
                assert!(mean[0].abs() < 0.01 * bending && mean[1].abs() < 0.01 * strain);
                assert!([lower, mean, upper].iter().all(|t| t[2].abs() < 0.01 * bending));
            }
        }
    }

    /// Mean dilatation takes the volume strain `z/r` of bending off in equal parts: two thirds of `z/r` remain along the
    /// arc at the faces, with the stress `2 G ε`, and one third of it with the other sign along the normal.
    #[test]
    fn a_bent_strip_of_hexahedra_has_the_deviator_at_its_faces() {
        let strain = 2.0 / 3.0 * 0.4 / BEND_RADIUS;
        let bending = 2e5 / 1.3 * strain;
        for [lower, _, upper] in bent_strip(ElementKind::Hex8) {
            for (found, sign) in [(lower, 1.0), (upper, -1.0)] {
                assert!((found[0] / bending - sign).abs() < 0.01, "{found:?} {bending}");
                assert!((found[1] / strain - sign).abs() < 0.01, "{found:?} {strain}");
                assert!((found[2] / bending + 0.5 * sign).abs() < 0.01, "{found:?} {bending}");
            }
        }
    }

    /// A sheet with material axes of its own in every element has the tensors of one whose law is turned.
    #[test]
    fn tensors_are_global_whatever_the_material_axes_are() {
        let (angle, mesh) = (0.4_f64, rectangle(4.0, 2.0, 0.8, 2, 2, 1));
        let plain = card::find("mild-steel-neto2012").unwrap();
        let f = Mat3::new(1.1, 0.08, 0.0, -0.02, 0.97, 0.0, 0.0, 0.0, 0.94);
        let to = |share: f64, x: &Vec3| x + share * (f - Mat3::identity()) * x;
        let mut own = Body::new(mesh.clone(), SHELL, plain.build(0.0).unwrap()).unwrap();
        let (s, c) = angle.sin_cos();
        own.set_rolling_direction(&Vec3::new(c, s, 0.0)).unwrap();
        let mut of_law = Body::new(mesh, SHELL, plain.build(angle).unwrap()).unwrap();
        let u = deform(&mut own, to);
        assert_eq!(u, deform(&mut of_law, to));
        let both =
            own.element_tensors(&u).unwrap().into_iter().zip(of_law.element_tensors(&u).unwrap());
        for (own, of_law) in both {
            near(own.mean.stress, &matrix(of_law.mean.stress), 1e-6);
            near(own.mean.strain, &matrix(of_law.mean.strain), 1e-12);
            assert!(own.mean.stress[3].abs() > 5.0);
        }
    }
}
