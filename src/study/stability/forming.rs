//! A strip drawn over a radius: contact methods over the number of equal increments, and facets compared with Nagata
//! patches by their iterations.

use std::sync::Arc;

use rayon::prelude::*;

use super::description::FormingMap;
use kanagata_contact::ToolSurface;
use kanagata_geometry::Vec3;
use kanagata_report::drawing::{Chart, Line};
use kanagata_solver::assembly::Body;
use kanagata_solver::element::ElementKind;
use kanagata_solver::material::card;
use kanagata_solver::sheet::hex_mesh::rectangle;
use kanagata_solver::{
    Constraints, ContactMethod, Control, Curve, Limits, Motion, Placement, SheetSide, Simulation,
    SimulationSetup, Stage, ToolSetup,
};
use kanagata_tool::build::build;
use kanagata_tool::edge::EdgeRule;
use kanagata_tool::model::PatchCorners;
use kanagata_tool::{ToolKind, ToolModel};

/// Largest depth for which the tools are long enough [mm].
pub(super) const DEPTH_MAX_MM: f64 = 15.0;
/// Half length and thickness of the strip [mm].
const STRIP_MM: [f64; 2] = [70.0, 0.8];
/// Half width of the punch [mm].
const PUNCH_HALF_WIDTH_MM: f64 = 25.0;
/// Radius of the punch [mm].
const PUNCH_RADIUS_MM: f64 = 5.0;
/// Radius of the die [mm].
const DIE_RADIUS_MM: f64 = 7.0;
/// Clearance between the walls of punch and die [mm].
const CLEARANCE_MM: f64 = 1.1;
/// Clearance between holder and strip [mm].
const HOLDER_CLEARANCE_MM: f64 = 0.016;
/// Pulling force at the end of the strip per width [N/mm].
const PULL_N_PER_MM: f64 = 16.0;
const FRICTION: f64 = 0.1;

/// Result of a draw.
pub(super) struct Draw {
    /// Name of its line in the chart.
    pub(super) line: String,
    /// Abscissa in the chart.
    pub(super) x: usize,
    /// Depth reached [mm].
    pub(super) depth: f64,
    /// Newton iterations, including those of increments that did not converge.
    pub(super) iterations: usize,
    /// Final punch force per width [N/mm].
    pub(super) force: f64,
    /// Travel [mm] and punch force per width [N/mm] after every increment.
    pub(super) curve: Vec<[f64; 2]>,
}

/// Largest increment for the roughness of forces [mm]: a tenth of an element.
const FINE_INCREMENT_MM: f64 = 0.1;

/// Draws with each contact method and each number of equal increments.
pub(super) fn by_increments(plan: &FormingMap) -> Vec<Draw> {
    let cases: Vec<(ContactMethod, usize)> = plan
        .methods
        .iter()
        .flat_map(|method| plan.increments.iter().map(|count| (*method, *count)))
        .collect();
    let draw = |&(contact, count): &(ContactMethod, usize)| {
        let mut setup = setup(plan.depth_mm, ToolKind::Nagata, plan.patches);
        setup.limits.contact = contact;
        // Equal steps: neither growth nor cuts.
        (setup.stages[0].first_step, setup.stages[0].largest_step) =
            (1.0 / count as f64, 1.0 / count as f64);
        (setup.limits.wanted_iterations, setup.limits.smallest_step) =
            (setup.limits.iterations, 1.0);
        run(setup, name(contact), count)
    };
    cases.par_iter().map(draw).collect()
}

/// Draws with each number of patches and facets per 90 degrees, with automatic steps.
pub(super) fn by_divisions(plan: &FormingMap) -> Vec<Draw> {
    let draw = |(kind, line, count): (ToolKind, &str, usize)| {
        run(setup(plan.depth_mm, kind, count), line.into(), count)
    };
    divided(plan).into_par_iter().map(draw).collect()
}

/// The same draws in short steps, for the roughness of their forces.
pub(super) fn by_divisions_finely(plan: &FormingMap) -> Vec<Draw> {
    let draw = |(kind, line, count): (ToolKind, &str, usize)| {
        let mut setup = setup(plan.depth_mm, kind, count);
        setup.stages[0].largest_step = (FINE_INCREMENT_MM / plan.depth_mm).min(1.0);
        run(setup, line.into(), count)
    };
    divided(plan).into_par_iter().map(draw).collect()
}

/// Nagata patches and facets with each number per 90 degrees.
fn divided(plan: &FormingMap) -> Vec<(ToolKind, &'static str, usize)> {
    let kinds = [(ToolKind::Nagata, "Nagata patches"), (ToolKind::Facets, "facets")];
    let all = kinds
        .iter()
        .flat_map(|(kind, name)| plan.divisions.iter().map(|count| (*kind, *name, *count)));
    all.collect()
}

/// A chart with one line per method or kind of tool.
pub(super) fn chart(
    [title, x, y]: [&str; 3],
    drawn: &[Draw],
    value: impl Fn(&Draw) -> Option<f64>,
) -> Chart {
    let mut lines: Vec<Line> = Vec::new();
    for one in drawn {
        if lines.last().is_none_or(|l| l.name != one.line) {
            lines.push(Line { name: one.line.clone(), points: Vec::new(), marks_only: false });
        }
        if let (Some(line), Some(value)) = (lines.last_mut(), value(one)) {
            line.points.push((one.x as f64, value));
        }
    }
    Chart { title: title.into(), x: (x.into(), true), y: (y.into(), false), lines }
}

impl Draw {
    /// Whether the draw reached `depth` [mm].
    pub(super) fn reached(&self, depth: f64) -> bool {
        self.depth >= depth * (1.0 - 1e-9)
    }

    /// Roughness of the force after the first 3 mm: RMS of the deviation from a local linear fit (1 mm to either side),
    /// over the mean force. `None` for shorter draws.
    pub(super) fn roughness(&self) -> Option<f64> {
        const FIT_HALF_WIDTH_MM: f64 = 1.0;
        const SKIPPED_MM: f64 = 3.0;
        let last = self.curve.last()?[0];
        let sound =
            self.curve.iter().filter(|[x, _]| (SKIPPED_MM..=last - FIT_HALF_WIDTH_MM).contains(x));
        let left: Vec<[f64; 2]> = sound
            .map(|&[x, force]| {
                let near = self.curve.iter().filter(|p| (p[0] - x).abs() <= FIT_HALF_WIDTH_MM);
                let sums = near.fold([0.0; 5], |s, &[a, f]| {
                    let a = a - x;
                    [s[0] + 1.0, s[1] + a, s[2] + a * a, s[3] + f, s[4] + a * f]
                });
                let [n, a, aa, f, af] = sums;
                // Value of the fitted line at x.
                let line = (aa * f - a * af) / (n * aa - a * a);
                [force - line, force]
            })
            .collect();
        let mean =
            |of: &dyn Fn(&[f64; 2]) -> f64| left.iter().map(of).sum::<f64>() / left.len() as f64;
        (left.len() > 2).then(|| mean(&|p| p[0] * p[0]).sqrt() / mean(&|p| p[1]))
    }
}

fn name(contact: ContactMethod) -> String {
    match contact {
        ContactMethod::Exact => "exact".into(),
        ContactMethod::Penalty { stiffness } => format!("penalty, {stiffness}"),
        ContactMethod::Augmented { stiffness } => format!("augmented, {stiffness}"),
    }
}

fn run(setup: SimulationSetup, line: String, x: usize) -> Draw {
    let mut sim = Simulation::new(setup).expect("a sound set-up");
    let mut drawn = Draw { line, x, depth: 0.0, iterations: 0, force: 0.0, curve: Vec::new() };
    // A draw that does not converge is a result too: its depth.
    let _ = sim.run(&mut |report| {
        (drawn.depth, drawn.force) = (report.tools[2].travel, report.tools[2].force);
        drawn.curve.push([drawn.depth, drawn.force]);
        Control::Continue
    });
    drawn.iterations = sim.summary().iterations;
    drawn
}

/// The strip between die, holder and punch, with `count` patches per 90 degrees of each radius.
fn setup(depth: f64, kind: ToolKind, count: usize) -> SimulationSetup {
    let [length, thickness] = STRIP_MM;
    let mesh = rectangle(length, 1.0, thickness, 70, 1, 2);
    let nodes = mesh.nodes.len();
    let mut constraints = Constraints::none(nodes);
    let mut loads = vec![0.0; 3 * nodes];
    let ends: Vec<usize> = (0..nodes).filter(|&n| mesh.nodes[n].x > length - 1e-9).collect();
    for node in 0..nodes {
        constraints.hold(node, 1);
        if mesh.nodes[node].x < 1e-9 {
            constraints.hold(node, 0);
        }
    }
    for &node in &ends {
        loads[3 * node] = PULL_N_PER_MM / ends.len() as f64;
    }
    let steel =
        card::find("mild-steel-neto2012").and_then(|c| c.build(0.0)).expect("a card of our own");
    let shell = ElementKind::SolidShell { points: 5, membrane: true };
    let travel = Motion::Travel(Curve::ramp(0.0, depth));
    SimulationSetup {
        body: Body::new(mesh, shell, steel).expect("a sound mesh"),
        constraints,
        loads,
        tools: tools(kind, count),
        stages: vec![Stage {
            name: "draw".into(),
            duration: 1.0,
            motions: vec![Motion::Hold, Motion::Hold, travel],
            load: Curve::constant(1.0),
            first_step: 0.01,
            largest_step: 0.1,
            ends: Vec::new(),
        }],
        limits: Limits { friction_transition: 1e-5, ..Limits::default() },
        share: 1.0,
    }
}

fn tools(kind: ToolKind, count: usize) -> Vec<ToolSetup> {
    let [length, thickness] = STRIP_MM;
    let (wall, end, below) =
        (PUNCH_HALF_WIDTH_MM + CLEARANCE_MM, length + 5.0, DEPTH_MAX_MM + 10.0);
    let arc = |x: f64, z: f64, radius: f64, from: f64| {
        (0..=count).map(move |k| {
            let (s, c) = (from + 90.0 * k as f64 / count as f64).to_radians().sin_cos();
            [x + radius * c, z + radius * s, c, s]
        })
    };
    let mut die = vec![[end, 0.0, 0.0, 1.0]];
    die.extend(arc(wall + DIE_RADIUS_MM, -DIE_RADIUS_MM, DIE_RADIUS_MM, 90.0));
    die.push([wall, -DIE_RADIUS_MM - below, -1.0, 0.0]);
    let lid = thickness + HOLDER_CLEARANCE_MM;
    let holder = vec![[wall + DIE_RADIUS_MM, lid, 0.0, -1.0], [end, lid, 0.0, -1.0]];
    let mut punch = vec![[0.0, thickness, 0.0, -1.0]];
    let (x, z) = (PUNCH_HALF_WIDTH_MM - PUNCH_RADIUS_MM, thickness + PUNCH_RADIUS_MM);
    punch.extend(arc(x, z, PUNCH_RADIUS_MM, -90.0));
    punch.push([PUNCH_HALF_WIDTH_MM, z + below, 1.0, 0.0]);
    let all = [
        ("die", die, 1.0, SheetSide::Bottom),
        ("holder", holder, -1.0, SheetSide::Top),
        ("punch", punch, -1.0, SheetSide::Top),
    ];
    let tool = |(name, chain, up, side): (&str, Vec<[f64; 4]>, f64, SheetSide)| ToolSetup {
        name: name.into(),
        surface: Arc::new(ToolSurface::new(extruded(name, kind, &chain))),
        offset: Vec3::zeros(),
        direction: Vec3::z() * up,
        placement: Placement::AsGiven,
        friction: FRICTION,
        side,
        stop: None,
    };
    all.into_iter().map(tool).collect()
}

/// A profile of points and normals in x and z, extruded along y beyond the strip.
fn extruded(name: &str, kind: ToolKind, chain: &[[f64; 4]]) -> ToolModel {
    let rows = chain.iter().flat_map(|&[x, z, nx, nz]| {
        [-0.5, 1.5].map(|y| (Vec3::new(x, y, z), Vec3::new(nx, 0.0, nz)))
    });
    let (vertices, normals): (Vec<Vec3>, Vec<Vec3>) = rows.unzip();
    let corners = (0..chain.len() as u32 - 1).map(|k| {
        let ids = [2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1];
        let [a, b, c] = [0, 1, 3].map(|i| vertices[ids[i] as usize]);
        let outward =
            (b - a).cross(&(c - a)).dot(&(normals[ids[0] as usize] + normals[ids[1] as usize]))
                > 0.0;
        let ids: Vec<u32> =
            if outward { ids.to_vec() } else { ids.iter().rev().copied().collect() };
        PatchCorners { vertices: ids.clone(), normals: ids, face: 0 }
    });
    let corners = corners.collect();
    let built = build(name.into(), kind, vertices, normals, corners, EdgeRule::Guarded);
    built.expect("a sound profile").0
}
