//! Hanging nodes: patch tests, tangent, equilibrium with contact, threads, restart. Rotation is in `turned`.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::cup::{QUICK, cup};
use super::{setup, stage, steel, tool};
use crate::assembly::{Body, Evaluation};
use crate::element::{ElementKind, Want};
use crate::material::card;
use crate::sheet::hex_mesh::{HexMesh, rectangle};
use crate::sheet::refine::{Refinement, plan_elements};
use crate::test_tools::{arc, revolved};
use crate::{
    Constraints, Control, Curve, IncrementReport, Motion, Placement, SheetSide, Simulation,
    SimulationSetup, ToolSetup,
};
use kanagata_geometry::{Mat3, Vec3};

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
    let largest = given.iter().fold(0.0_f64, |m, u| m.max(u.abs()));
    for round in 0..25 {
        body.mesh().set_means(&mut u);
        body.evaluate(&u, Want::ResidualAndTangent, &mut out).unwrap();
        let force =
            DVector::from_iterator(unknowns.len(), unknowns.iter().map(|&k| out.internal_force[k]));
        let step = dense(body, &out, unknowns).lu().solve(&force).unwrap();
        unknowns.iter().zip(step.iter()).for_each(|(&k, step)| u[k] -= step);
        if round > 3 && step.amax() < 1e-14 * largest {
            break;
        }
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

/// Tension, moment and elastic energy of a strip of solid-shells of `2 n` x `n` base elements that is stretched and bent to
/// an arc, given at its ends; `level` of a part in its middle that hangs on all four sides.
fn strip(n: usize, level: u8) -> [f64; 3] {
    let base = rectangle(8.0, 4.0, 0.9, 2 * n, n, 1);
    let inside = |k: usize| (n / 4..3 * n / 4).contains(&k);
    let part = |e: usize| inside((e / n).saturating_sub(n / 2)) && inside(e % n);
    let levels = (0..2 * n * n).map(|e| if part(e) { level } else { 0 }).collect();
    let mesh = Refinement::balanced(plan_elements(&base), levels).mesh(&base, None);
    assert_eq!(mesh.hanging.is_empty(), level == 0);
    let arc = field(&mesh, |x| {
        let (angle, r) = (0.01 * (x.x - 4.0), 100.0 - x.z);
        Vec3::new(1.004 * r * angle.sin() + 4.0, x.y, 100.0 - r * angle.cos()) - x
    });
    let inner = |node: &usize| {
        let x = mesh.nodes[*node];
        x.x > 1e-9 && x.x < 8.0 - 1e-9 && mesh.masters(*node).is_none()
    };
    let unknowns: Vec<usize> =
        (0..mesh.nodes.len()).filter(inner).flat_map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
    let end: Vec<usize> = (0..mesh.nodes.len()).filter(|&n| mesh.nodes[n].x > 8.0 - 1e-9).collect();
    let kind = ElementKind::SolidShell { points: 5, membrane: true };
    let mut body = Body::new(mesh, kind, steel()).unwrap();
    let (_, out) = solved(&mut body, &arc, &unknowns);
    let force = |n: &usize| Vec3::from_column_slice(&out.internal_force[3 * n..3 * n + 3]);
    let (tension, moment) = end.iter().fold((0.0, 0.0), |(f, m), n| {
        (f + force(n).x, m + force(n).x * (body.mesh().nodes[*n].z - 0.45))
    });
    [tension, moment, out.elastic_energy]
}

/// A refined part changes tension, moment and energy of a strip by as little as the size of the elements does, and by less
/// the finer the base mesh is.
#[test]
fn a_stretched_and_bent_strip_with_a_refined_part_converges_to_the_unrefined_one() {
    let change = |n: usize| {
        let (plain, hanging) = (strip(n, 0), strip(n, 1));
        let off: [f64; 3] = std::array::from_fn(|k| (hanging[k] / plain[k] - 1.0).abs());
        println!("{n}: {plain:?} {hanging:?} {off:?}");
        off
    };
    let (coarse, fine) = (change(4), change(8));
    for k in 0..3 {
        assert!(coarse[k] < 0.015 && fine[k] < 0.6 * coarse[k], "{coarse:?} {fine:?}");
    }
}

/// A quarter of a clamped sheet over a ball whose contact crosses the border of the refinement: largest penetration between
/// nodes over the run [mm], and force at its end [N].
fn stretched_over_a_ball(levels: &[u8]) -> (f64, f64) {
    let base = rectangle(20.0, 20.0, 1.0, 8, 8, 1);
    let mesh = Refinement::balanced(plan_elements(&base), levels.to_vec()).mesh(&base, None);
    let mut constraints = Constraints::none(mesh.nodes.len());
    constraints.symmetry_plane(&mesh.nodes, 0, 0.0, 1e-9);
    constraints.symmetry_plane(&mesh.nodes, 1, 0.0, 1e-9);
    for (node, x) in mesh.nodes.iter().enumerate().filter(|(_, x)| x.xy().max() > 20.0 - 1e-9) {
        assert!(mesh.masters(node).is_none(), "{x}");
        (0..3).for_each(|axis| constraints.hold(node, axis));
    }
    let ball = [arc(6, [0.0, 40.0], 40.0, [-FRAC_PI_2, -0.6], 1.0)];
    let ball = tool("ball", revolved("ball", 6, FRAC_PI_2, &ball), -Vec3::z(), SheetSide::Top, 0.1);
    let tools = vec![ToolSetup { placement: Placement::Touch, ..ball }];
    let mut down = stage("down", vec![Motion::Travel(Curve::to(4.0))], 0.1);
    down.largest_step = 0.25;
    let steel = card::find("mild-steel-neto2012").unwrap().build(0.0).unwrap();
    let kind = ElementKind::SolidShell { points: 5, membrane: true };
    let body = Body::new(mesh, kind, steel).unwrap();
    let mut all = setup(body, constraints, tools, vec![down]);
    all.limits.friction_transition = 1e-4;
    let (mut depth, mut force, mut far) = (0.0_f64, 0.0, 0.0_f64);
    let mut sim = Simulation::new(all).unwrap();
    sim.run(&mut |r: &IncrementReport<'_>| {
        depth = depth.max(r.face_penetration.as_ref().map_or(0.0, |found| found.depth));
        force = r.tools[0].force;
        let touching = r.node_contacts.iter().map(|c| r.body.mesh().nodes[c.node].xy().norm());
        far = touching.fold(far, f64::max);
        Control::Continue
    })
    .unwrap();
    assert!(far > 6.0, "the contact reaches {far} mm");
    (depth, force)
}

#[test]
fn nothing_passes_over_a_border_of_refinement() {
    let near =
        |level: u8| -> Vec<u8> { (0..64).map(|e| if e / 8 < 2 { level } else { 0 }).collect() };
    let coarse = stretched_over_a_ball(&near(0));
    let fine = stretched_over_a_ball(&[1; 64]);
    let mixed = stretched_over_a_ball(&near(1));
    println!("coarse {coarse:?}, mixed {mixed:?}, fine {fine:?}");
    assert!(fine.0 > 0.0 && fine.0 < 0.5 * coarse.0);
    assert!(mixed.0 < 1.05 * coarse.0 && mixed.0 > fine.0);
    let between = |x: f64| (x - fine.1).abs() < 1.02 * (coarse.1 - fine.1).abs() + 1e-3 * fine.1;
    assert!(between(mixed.1), "{coarse:?} {mixed:?} {fine:?}");
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
    let mut state: crate::snapshot::SimulationState = serde_json::from_str(&text).unwrap();
    state.material = sim.state().material;
    let mut sim = Simulation::new(refined_cup(ElementKind::Hex8)).unwrap();
    sim.resume(state).unwrap();
    run(sim, &mut left);
    let first = first.unwrap();
    let tail = first.1.len() - left.1.len();
    assert!(tail > 0 && first.1[tail..] == left.1[..] && first.2 == left.2);
}
