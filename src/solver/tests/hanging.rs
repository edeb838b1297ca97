//! Hanging nodes: patch tests, tangent, equilibrium with contact, threads, restart. Rotation is in `turned`.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::cup::{QUICK, cup};
use super::steel;
use crate::geometry::{Mat3, Vec3};
use crate::solver::assembly::{Body, Evaluation};
use crate::solver::element::{ElementKind, Want};
use crate::solver::material::card;
use crate::solver::sheet::hex_mesh::{HexMesh, rectangle};
use crate::solver::sheet::refine::{Refinement, plan_elements};
use crate::solver::{Constraints, Control, IncrementReport, Simulation, SimulationSetup};

const KINDS: [ElementKind; 3] = [
    ElementKind::Hex8,
    ElementKind::Hex8Enhanced,
    ElementKind::SolidShell { points: 5, membrane: true },
];

/// `base` with its elements refined to `levels`, balanced.
fn refined(base: &HexMesh, levels: &[u8]) -> HexMesh {
    let mesh = Refinement::balanced(plan_elements(base), levels.to_vec()).mesh(base, None);
    assert!(!mesh.hanging.is_empty());
    mesh
}

/// A sheet of 4 x 3 distorted base elements, three levels of them side by side.
fn irregular(layers: usize) -> HexMesh {
    let mut base = rectangle(8.0, 6.0, 0.9, 4, 3, layers);
    for x in &mut base.nodes {
        let inside = x.x * (8.0 - x.x) * x.y * (6.0 - x.y) / 144.0;
        let by = inside * (1.3 * x.x + 0.7 * x.y).sin();
        (x.x, x.y) = (x.x + 0.5 * by, x.y - 0.4 * by);
    }
    refined(&base, &[0, 0, 0, 0, 2, 1, 0, 0, 0, 1, 0, 0])
}

fn field(mesh: &HexMesh, of: impl Fn(&Vec3) -> Vec3) -> Vec<f64> {
    mesh.nodes.iter().flat_map(|x| <[f64; 3]>::from(of(x))).collect()
}

/// Unknowns of nodes that do not hang and are not on the border of the sheet in plan.
fn inner_unknowns(mesh: &HexMesh) -> Vec<usize> {
    let inside = |v: f64, size: f64| v > 1e-9 && v < size - 1e-9;
    let free = |node: &usize| {
        let x = mesh.nodes[*node];
        inside(x.x, 8.0) && inside(x.y, 6.0) && mesh.masters(*node).is_none()
    };
    (0..mesh.nodes.len()).filter(free).flat_map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect()
}

/// Tangent of some unknowns, dense.
fn dense(body: &Body, out: &Evaluation, unknowns: &[usize]) -> DMatrix<f64> {
    let (n, pattern) = (unknowns.len(), body.pattern());
    let entry = |i: usize, j: usize| {
        pattern.position(unknowns[i], unknowns[j]).map_or(0.0, |at| out.tangent[at])
    };
    DMatrix::from_fn(n, n, entry)
}

/// Newton's method on `unknowns`, which start at zero; the other displacements are given.
fn solved(body: &mut Body, given: &[f64], unknowns: &[usize]) -> (Vec<f64>, Evaluation) {
    let (mut u, mut out) = (given.to_vec(), Evaluation::default());
    unknowns.iter().for_each(|&k| u[k] = 0.0);
    for _ in 0..25 {
        body.mesh().set_means(&mut u);
        body.evaluate(&u, Want::ResidualAndTangent, &mut out).unwrap();
        let force =
            DVector::from_iterator(unknowns.len(), unknowns.iter().map(|&k| out.internal_force[k]));
        let step = dense(body, &out, unknowns).lu().solve(&force).unwrap();
        unknowns.iter().zip(step.iter()).for_each(|(&k, step)| u[k] -= step);
    }
    body.mesh().set_means(&mut u);
    body.evaluate(&u, Want::ResidualAndTangent, &mut out).unwrap();
    (u, out)
}

/// A linear displacement of the border of the sheet makes that of all nodes, and a uniform stress.
#[test]
fn patch_tests_pass_over_hanging_nodes() {
    let mut strain = Mat3::new(2.0, 0.8, 0.0, -0.4, -1.1, 0.0, 0.0, 0.0, 0.0) * 1e-4;
    // Plane stress of the logarithmic strain, whose trace in the plane is the logarithm of the area ratio.
    let area = (strain + Mat3::identity()).determinant();
    strain[(2, 2)] = area.powf(-0.3 / 0.7) - 1.0;
    let steel = card::find("mild-steel-neto2012").unwrap().build(0.0).unwrap();
    for layers in [1, 2] {
        let mesh = irregular(layers);
        let linear = field(&mesh, |x| strain * x);
        let unknowns = inner_unknowns(&mesh);
        for kind in KINDS {
            let mut body = Body::new(mesh.clone(), kind, Arc::clone(&steel)).unwrap();
            let (u, out) = solved(&mut body, &linear, &unknowns);
            let largest = linear.iter().fold(0.0_f64, |m, u| m.max(u.abs()));
            let off = u.iter().zip(&linear).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off < 1e-10 * largest, "{kind:?}, {layers} layers: {off:e} of {largest:e}");
            let force = out.internal_force.iter().fold(0.0_f64, |m, f| m.max(f.abs()));
            let rest = unknowns.iter().map(|&k| out.internal_force[k].abs()).fold(0.0, f64::max);
            assert!(rest < 1e-10 * force, "{kind:?}, {layers} layers: {rest:e} of {force:e}");
            body.commit();
            let states = body.element_tensors(&u).unwrap();
            let first = states[0].mean.stress;
            let size = first.iter().fold(0.0_f64, |m, s| m.max(s.abs()));
            for one in states.iter().flat_map(|state| [state.lower, state.upper]) {
                let off = (0..6).map(|k| (one.stress[k] - first[k]).abs()).fold(0.0, f64::max);
                assert!(size > 10.0 && off < 1e-10 * size, "{kind:?}: {off:e} of {size}");
            }
        }
    }
}

/// A bent and stretched displacement with the means at hanging nodes.
fn bent(mesh: &HexMesh) -> Vec<f64> {
    let mut u = field(mesh, |x| {
        let bow = 0.01 * x.x * (x.z - 0.4);
        Vec3::new(0.004 * x.x - bow, 0.002 * x.x * x.y / 8.0, 0.005 * x.x * x.x + 0.01 * x.y * x.z)
    });
    mesh.set_means(&mut u);
    u
}

#[test]
fn the_tangent_is_symmetric_and_the_derivative_of_the_force() {
    for kind in KINDS {
        let mesh = irregular(1);
        let mut body = Body::new(mesh.clone(), kind, steel()).unwrap();
        let (u, mut out) = (bent(&mesh), Evaluation::default());
        // Enough evaluations for the internal modes to converge.
        let mut at = |u: &[f64], out: &mut Evaluation| {
            (0..8).for_each(|_| body.evaluate(u, Want::ResidualAndTangent, out).unwrap());
        };
        at(&u, &mut out);
        let free: Vec<usize> = (0..mesh.nodes.len())
            .filter(|&node| mesh.masters(node).is_none())
            .flat_map(|n| [3 * n, 3 * n + 1, 3 * n + 2])
            .collect();
        let mut way: Vec<f64> = (0..u.len()).map(|i| (1.7 * i as f64).sin()).collect();
        mesh.set_means(&mut way);
        let (h, mut ends) = (1e-6, [Evaluation::default(), Evaluation::default()]);
        for (end, sign) in ends.iter_mut().zip([h, -h]) {
            let moved: Vec<f64> = u.iter().zip(&way).map(|(u, w)| u + sign * w).collect();
            at(&moved, end);
        }
        let tangent = dense(&body, &out, &free);
        let largest = tangent.amax();
        let skew = (&tangent - tangent.transpose()).amax();
        assert!(skew < 1e-13 * largest, "{kind:?}: {skew:e} of {largest:e}");
        let along = DVector::from_iterator(free.len(), free.iter().map(|&k| way[k]));
        let product = &tangent * along;
        for (i, &k) in free.iter().enumerate() {
            let slope = (ends[0].internal_force[k] - ends[1].internal_force[k]) / (2.0 * h);
            let off = (slope - product[i]).abs();
            assert!(off < 1e-6 * product.amax(), "{kind:?}: {off:e} of {:e}", product.amax());
        }
        for (node, _) in mesh.hanging_nodes() {
            assert_eq!(out.internal_force[3 * node..3 * node + 3], [0.0; 3]);
            assert_eq!(body.pattern().row_ptr[3 * node + 1] - body.pattern().row_ptr[3 * node], 3);
        }
    }
}

/// A strip of solid-shells stretched and bent into an arc, given at its ends, is as stiff with a part refined as without.
#[test]
fn a_stretched_and_bent_strip_is_as_stiff_as_an_unrefined_one() {
    let base = rectangle(8.0, 6.0, 0.9, 8, 4, 1);
    // A refined part in the middle of the strip that hangs on all four sides.
    let levels: Vec<u8> =
        (0..32).map(|e| u8::from((3..5).contains(&(e / 4)) && (1..3).contains(&(e % 4)))).collect();
    let solve = |mesh: HexMesh| {
        let arc = field(&mesh, |x| {
            let (angle, r) = (0.01 * (x.x - 4.0), 100.0 - x.z);
            Vec3::new(1.004 * r * angle.sin() + 4.0, x.y, 100.0 - r * angle.cos()) - x
        });
        let inner = |node: &usize| {
            let x = mesh.nodes[*node];
            x.x > 1e-9 && x.x < 8.0 - 1e-9 && mesh.masters(*node).is_none()
        };
        let unknowns: Vec<usize> = (0..mesh.nodes.len())
            .filter(inner)
            .flat_map(|n| [3 * n, 3 * n + 1, 3 * n + 2])
            .collect();
        let end: Vec<usize> =
            (0..mesh.nodes.len()).filter(|&n| mesh.nodes[n].x > 8.0 - 1e-9).collect();
        let kind = ElementKind::SolidShell { points: 5, membrane: true };
        let mut body = Body::new(mesh, kind, steel()).unwrap();
        let (_, out) = solved(&mut body, &arc, &unknowns);
        let force = |n: &usize| Vec3::from_column_slice(&out.internal_force[3 * n..3 * n + 3]);
        let (tension, moment) = end.iter().fold((0.0, 0.0), |(f, m), n| {
            (f + force(n).x, m + force(n).x * (body.mesh().nodes[*n].z - 0.45))
        });
        (tension, moment, out.elastic_energy)
    };
    let (plain, hanging) = (solve(base.clone()), solve(refined(&base, &levels)));
    for (a, b) in [(plain.0, hanging.0), (plain.1, hanging.1), (plain.2, hanging.2)] {
        assert!((a - b).abs() < 2e-3 * a.abs(), "{plain:?} {hanging:?}");
    }
}

/// The cup with elements under the die radius and the punch radius refined.
fn refined_cup(kind: ElementKind) -> SimulationSetup {
    let setup = cup(&QUICK);
    let base = setup.body.mesh();
    let levels: Vec<u8> = plan_elements(base)
        .iter()
        .map(|quad| {
            let x: Vec3 =
                quad.iter().map(|&c| base.nodes[c as usize * base.nodes_per_column]).sum();
            u8::from((20.0..42.0).contains(&(x / 4.0).xy().norm()))
        })
        .collect();
    let mesh = refined(base, &levels);
    let mut constraints = Constraints::none(mesh.nodes.len());
    constraints.symmetry_plane(&mesh.nodes, 0, 0.0, 1e-9);
    constraints.symmetry_plane(&mesh.nodes, 1, 0.0, 1e-9);
    let body = Body::new(mesh, kind, Arc::clone(&setup.body.material)).unwrap();
    SimulationSetup { body, constraints, ..setup }
}

/// What a run with contact leaves: iterations, forces of the tools, displacements.
type Left = (Vec<usize>, Vec<f64>, Vec<f64>);

fn run(mut sim: Simulation, left: &mut Left) -> Simulation {
    sim.run(&mut |r: &IncrementReport<'_>| {
        left.0.push(r.iterations);
        left.1.extend(r.tools.iter().map(|t| t.force));
        left.2 = r.displacements.to_vec();
        let largest = r.tools.iter().map(|t| t.force.abs()).fold(0.0, f64::max);
        let sum: f64 = r.tools.iter().map(|t| t.force_vector[2]).sum();
        assert!(sum.abs() <= 1e-8 * largest, "{sum:e} of {largest:e}");
        for (node, [a, b]) in r.body.mesh().hanging_nodes() {
            for k in 0..3 {
                let mean = 0.5 * (r.displacements[3 * a + k] + r.displacements[3 * b + k]);
                assert_eq!(r.displacements[3 * node + k], mean);
            }
            assert_eq!(r.contact_forces[3 * node..3 * node + 3], [0.0; 3]);
        }
        Control::Continue
    })
    .unwrap();
    sim
}

#[test]
fn a_refined_cup_is_the_same_for_any_number_of_threads_and_over_a_restart() {
    let mut first: Option<Left> = None;
    for threads in [1, 2, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let left = pool.install(|| {
            let mut left = Left::default();
            run(Simulation::new(refined_cup(ElementKind::Hex8)).unwrap(), &mut left);
            left
        });
        assert!(left.1.last().unwrap().abs() > 100.0, "{left:?}");
        match &first {
            None => first = Some(left),
            Some(first) => assert!(*first == left, "{threads} threads"),
        }
    }
    let mut sim = Simulation::new(refined_cup(ElementKind::Hex8)).unwrap();
    let mut left = Left::default();
    let mut increments = 0;
    while increments < 3 {
        sim.advance(&mut |r: &IncrementReport<'_>| {
            increments = r.increment;
            Control::Continue
        })
        .unwrap();
    }
    let text = serde_json::to_string(&sim.state()).unwrap();
    let mut state: crate::solver::snapshot::SimulationState = serde_json::from_str(&text).unwrap();
    state.material = sim.state().material;
    let mut sim = Simulation::new(refined_cup(ElementKind::Hex8)).unwrap();
    sim.resume(state).unwrap();
    run(sim, &mut left);
    let first = first.unwrap();
    let tail = first.1.len() - left.1.len();
    assert!(tail > 0 && first.1[tail..] == left.1[..] && first.2 == left.2);
}
