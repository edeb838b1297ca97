//! Tool faces that the sheet can touch, and the check after each increment that it has stayed away from the others.
//!
//! The initial position of the sheet and the travels of the tools are known before a run. The sheet is assumed to
//! stay in its bounding box, extended along every axis by the travels of all tools and by a twentieth of its size. In
//! the frame of a tool the box is also shifted by its travel. The travel of a tool on a spring is bounded by the sum
//! of all others; that of a tool driven by force is unbounded.
//!
//! Loads may move the sheet by its own size, or without limit if it is unconstrained against them. Patches outside
//! this box, extended by the radius of the contact search, are excluded from the search. The box is an estimate,
//! which [`Guard`] verifies.

use std::sync::Arc;

use rayon::prelude::*;

use crate::error::SimulationError;
use crate::sheet::sizes::edge_lengths;
use crate::simulation::{SimulationSetup, check};
use crate::stage::state::Simulation;
use crate::tools::motion::Motion;
use crate::tools::tool::{SheetSide, ToolSetup};
use kanagata_geometry::box_tree::BoxTree;
use kanagata_geometry::{Aabb, Vec3};

/// Growth or lift of the rim over the size of the sheet.
const RIM_MARGIN_REL: f64 = 0.05;

/// Excluded patches of a tool.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExcludedPatches {
    /// Index of the tool.
    pub tool: usize,
    /// Number of excluded patches.
    pub patches: usize,
    /// Number of patches of the tool.
    pub of: usize,
}

/// For each tool, the patches that the sheet can touch. Tools must have been placed.
#[must_use]
pub fn reachable(setup: &SimulationSetup) -> Vec<Vec<bool>> {
    let mesh = setup.body.mesh();
    let sheet = Aabb::of_points(&mesh.nodes);
    let travels: Vec<Option<[f64; 2]>> =
        (0..setup.tools.len()).map(|tool| travel_range(setup, tool)).collect();
    let moved = travels.iter().flatten().any(|[low, high]| high > low);
    let load_displacement = load_displacement(setup, sheet.diagonal());
    let is_unbounded = (0..3).any(|k| load_displacement[k].is_infinite());
    let length = |range: &[f64; 2]| range[1] - range[0];
    let total_travel: f64 = if moved && !is_unbounded {
        travels.iter().flatten().map(length).sum::<f64>() + load_displacement.max()
    } else {
        f64::INFINITY
    };
    let rim = (RIM_MARGIN_REL * sheet.diagonal()).max(2.0 * mesh.mean_thickness());
    let margin = rim + edge_lengths(setup.body.mesh()).longest_edge;
    let pushed: Vec3 = setup.tools.iter().zip(&travels).fold(Vec3::zeros(), |sum, (t, range)| {
        let far = if moved { range.as_ref().map_or(0.0, length) } else { f64::INFINITY };
        sum + t.direction.map(|d| along(far, d.abs()))
    });
    let driven = |k: usize| setup.tools.iter().any(|t| t.direction[k].abs() > 1e-12);
    let may_move =
        Vec3::from_fn(|k, _| pushed[k].max(if driven(k) { load_displacement[k] } else { 0.0 }));
    // A tool driven by force reaches the sheet from any distance.
    let forced = |k: usize| {
        setup.stages.iter().any(|stage| matches!(stage.motions.get(k), Some(Motion::Force(_))))
    };
    let reachable_patches =
        |(index, (tool, own)): (usize, (&ToolSetup, &Option<[f64; 2]>))| -> Vec<bool> {
            let unknown =
                || [-total_travel, if forced(index) { f64::INFINITY } else { total_travel }];
            let zone = seen_from(tool, own.unwrap_or_else(unknown), sheet, &may_move, margin);
            let meets =
                |b: &Aabb| (0..3).all(|k| b.min[k] <= zone.max[k] && b.max[k] >= zone.min[k]);
            tool.surface.patch_bounds().iter().map(meets).collect()
        };
    setup.tools.iter().zip(&travels).enumerate().map(reachable_patches).collect()
}

/// Component of a distance along an axis with this direction cosine: zero normal to the axis, even for infinite
/// distances.
fn along(distance: f64, cosine: f64) -> f64 {
    if cosine.abs() > 1e-12 { distance * cosine } else { 0.0 }
}

/// Bounding box of the sheet in the frame of a tool with travels in `[low, high]`, extended by `may_move` along the
/// axes and by `margin` [mm].
fn seen_from(
    tool: &ToolSetup,
    [low, high]: [f64; 2],
    mut sheet: Aabb,
    may_move: &Vec3,
    margin: f64,
) -> Aabb {
    for k in 0..3 {
        let d = tool.direction[k];
        let (a, b) = (along(low, d), along(high, d));
        sheet.min[k] -= tool.offset[k] + a.max(b) + may_move[k] + margin;
        sheet.max[k] += may_move[k] + margin - tool.offset[k] - a.min(b);
    }
    sheet
}

/// Displacement of the sheet due to loads along the axes, without tools [mm]: at most `size`, by rotation about its
/// supports. Infinite along a loaded axis without supports; zero without loads.
fn load_displacement(setup: &SimulationSetup, size: f64) -> Vec3 {
    let nodes = setup.body.mesh().nodes.len();
    let loaded = |k: usize| setup.loads.iter().skip(k).step_by(3).any(|f| *f != 0.0);
    let held = |k: usize| (0..nodes).any(|n| setup.constraints.is_held(n, k));
    if !(0..3).any(loaded) {
        return Vec3::zeros();
    }
    Vec3::from_fn(|k, _| if loaded(k) && !held(k) { f64::INFINITY } else { size })
}

/// Smallest and largest travel of a tool over all stages, including the start [mm]; `None` if it is driven by force, or
/// a stage has no motion for it.
#[must_use]
pub fn travel_range(setup: &SimulationSetup, tool: usize) -> Option<[f64; 2]> {
    let (mut now, mut low, mut high) = (0.0, 0.0_f64, 0.0_f64);
    for stage in &setup.stages {
        let ([a, b], end) = match stage.motions.get(tool)? {
            Motion::Hold | Motion::Release | Motion::Absent => ([now; 2], now),
            Motion::Travel(curve) => (curve.starting_at(now).extent(), curve.at(1.0)),
            Motion::Advance(curve) => {
                (curve.starting_at(0.0).extent().map(|x| x + now), now + curve.at(1.0))
            }
            Motion::Force(_) | Motion::Spring { .. } => return None,
        };
        (low, high, now) = (low.min(a), high.max(b), end);
    }
    Some([low, high])
}

/// Places the tools and excludes patches that the sheet cannot touch from their search. Results are bit-identical;
/// [`Guard::find_violation`] verifies this after each increment.
///
/// # Errors
/// [`SimulationError::Setup`] for a set-up that [`Simulation::new`] refuses, [`SimulationError::NoTouch`].
pub fn exclude_unreachable(
    setup: &mut SimulationSetup,
) -> Result<(Vec<ExcludedPatches>, Guard), SimulationError> {
    check(setup)?;
    setup.place()?;
    let reach = edge_lengths(setup.body.mesh()).longest_edge;
    let mut guard = Guard { reach, tools: Vec::new() };
    let mut out = Vec::new();
    for (tool, is_reachable) in reachable(setup).into_iter().enumerate() {
        let of = is_reachable.len();
        let patches = is_reachable.iter().filter(|k| !**k).count();
        // A tool completely out of reach is an error of the scene and remains visible.
        if patches == 0 || patches == of {
            guard.tools.push(None);
            continue;
        }
        let surface = &setup.tools[tool].surface;
        let boxes = surface.patch_bounds();
        let excluded =
            boxes.iter().zip(&is_reachable).map(|(b, k)| if *k { Aabb::EMPTY } else { *b });
        guard.tools.push(Some(BoxTree::build(&excluded.collect::<Vec<_>>())));
        let reduced = surface.restricted_to(&is_reachable);
        setup.tools[tool].surface = Arc::new(reduced);
        out.push(ExcludedPatches { tool, patches, of });
    }
    Ok((out, guard))
}

/// Verifies that the sheet stays away from the excluded patches.
pub struct Guard {
    /// Radius of the contact search [mm].
    reach: f64,
    tools: Vec<Option<BoxTree>>,
}

impl Guard {
    /// First tool with an excluded patch within the radius of the contact search of a node, and this node.
    #[must_use]
    pub fn find_violation(&self, simulation: &Simulation) -> Option<(usize, usize)> {
        let mesh = simulation.body().mesh();
        let u = simulation.displacements();
        let levels = mesh.nodes_per_column.max(1);
        let shifts = simulation.tool_shifts();
        let sides = simulation.tool_sides();
        for (tool, tree) in self.tools.iter().enumerate() {
            let Some(tree) = tree else { continue };
            let is_candidate = |n: usize| match (sides[tool], n % levels) {
                (SheetSide::Top, level) => level + 1 == levels,
                (SheetSide::Bottom, level) => level == 0,
                (SheetSide::Both, level) => level == 0 || level + 1 == levels,
            };
            let limit = self.reach * self.reach;
            let is_near_excluded = |&n: &usize| {
                let at = mesh.nodes[n] + Vec3::from_column_slice(&u[3 * n..3 * n + 3]);
                // A visit means a box within the limit; the search then ends.
                tree.nearest(&(at - shifts[tool]), limit, |_, _| -1.0) < 0.0
            };
            let found = (0..mesh.nodes.len())
                .into_par_iter()
                .filter(|&n| is_candidate(n))
                .find_first(is_near_excluded);
            if let Some(node) = found {
                return Some((tool, node));
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;
    use crate::assembly::Body;
    use crate::element::ElementKind;
    use crate::material::elastic::Elastic;
    use crate::sheet::hex_mesh::rectangle;
    use crate::test_tools::{arc, revolved};
    use crate::{Constraints, Curve, Limits, Placement, Stage};
    use kanagata_contact::ToolSurface;

    /// A quarter of a ball of radius 7 over the corner of a sheet of 4 x 4 x 0.5 in elements of 1 mm.
    fn ball_over_sheet(motion: Motion) -> SimulationSetup {
        let profile = [arc(12, [0.0, 7.0], 7.0, [-FRAC_PI_2, 0.0], 1.0)];
        let mesh = rectangle(4.0, 4.0, 0.5, 4, 4, 1);
        let mut constraints = Constraints::none(mesh.nodes.len());
        (0..mesh.nodes.len()).for_each(|n| (0..3).for_each(|k| constraints.hold(n, k)));
        let material = Arc::new(Elastic { young: 210_000.0, poisson: 0.3 });
        let tool = ToolSetup {
            name: "ball".into(),
            surface: Arc::new(ToolSurface::new(revolved("ball", 4, FRAC_PI_2, &profile))),
            offset: Vec3::z() * 3.0,
            direction: -Vec3::z(),
            placement: Placement::Touch,
            friction: 0.0,
            side: SheetSide::Top,
            stop: None,
        };
        let stage = Stage {
            name: "press".into(),
            duration: 1.0,
            motions: vec![motion],
            load: Curve::constant(0.0),
            first_step: 1.0,
            largest_step: 1.0,
            ends: Vec::new(),
        };
        SimulationSetup {
            body: Body::new(mesh, ElementKind::Hex8, material).unwrap(),
            constraints,
            loads: Vec::new(),
            tools: vec![tool],
            stages: vec![stage],
            limits: Limits::default(),
            share: 1.0,
        }
    }

    #[test]
    fn patches_are_kept_as_far_as_travels_reach() {
        let mut setup = ball_over_sheet(Motion::Travel(Curve::ramp(0.0, 1.0)));
        setup.place().unwrap();
        assert!((setup.tools[0].offset.z - 0.5).abs() < 1e-9);
        // The sheet ends at 0.5 and may be moved by 1, extended by twice its thickness and an element edge; the ball
        // moves down by 1.
        let height = 0.5 + 1.0 + 1.0 + 1.0 + 1.0 - 0.5;
        let boxes = setup.tools[0].surface.patch_bounds();
        let is_reachable = &reachable(&setup)[0];
        assert!(boxes.iter().zip(is_reachable).all(|(b, k)| *k == (b.min.z <= height)));
        assert!(is_reachable.iter().any(|k| *k) && is_reachable.iter().any(|k| !*k));
        // For a tool driven by force only, and a sheet moved by loads, no depth is known: only patches beside the
        // sheet are excluded.
        let beside = |is_reachable: &[bool]| {
            let over = |b: &Aabb| b.min.x <= 6.0 && b.min.y <= 6.0;
            boxes.iter().zip(is_reachable).all(|(b, k)| *k == over(b))
        };
        let forced = ball_over_sheet(Motion::Force(Curve::constant(1.0)));
        assert!(beside(&reachable(&forced)[0]));
        setup.loads = vec![1.0; 3 * setup.body.mesh().nodes.len()];
        setup.constraints = Constraints::none(setup.body.mesh().nodes.len());
        assert!(beside(&reachable(&setup)[0]));
    }

    /// Loads in the plane of the sheet do not lift it by more than its size, nor do others against which it is
    /// constrained.
    #[test]
    fn a_loaded_sheet_does_not_reach_a_tool_far_above() {
        let mut setup = ball_over_sheet(Motion::Travel(Curve::ramp(0.0, 1.0)));
        setup.place().unwrap();
        let nodes = setup.body.mesh().nodes.len();
        // The diagonal is 5.7 mm.
        let reached = |setup: &mut SimulationSetup, above: f64| {
            setup.tools[0].offset.z += above;
            let any = reachable(setup)[0].iter().any(|k| *k);
            setup.tools[0].offset.z -= above;
            any
        };
        assert!(reached(&mut setup, 3.0) && !reached(&mut setup, 6.0));
        let load =
            |axis: usize| (0..3 * nodes).map(|i| f64::from(u8::from(i % 3 == axis))).collect();
        for axis in [0, 2] {
            setup.loads = load(axis);
            assert!(reached(&mut setup, 8.0) && !reached(&mut setup, 1000.0), "{axis}");
        }
        // Constrained along x only, it stays within reach under a load along x, and moves without limit under one
        // along z.
        setup.constraints = Constraints::none(nodes);
        setup.constraints.hold(0, 0);
        setup.loads = load(0);
        assert!(!reached(&mut setup, 1000.0));
        setup.loads = load(2);
        assert!(reached(&mut setup, 1000.0));
    }

    #[test]
    fn a_stage_with_too_few_motions_is_refused() {
        let mut setup = ball_over_sheet(Motion::Travel(Curve::ramp(0.0, 1.0)));
        setup.stages[0].motions.clear();
        assert_eq!(travel_range(&setup, 0), None);
        assert_eq!(reachable(&setup).len(), 1);
        let Err(SimulationError::Setup(text)) = exclude_unreachable(&mut setup) else {
            panic!("no motion for a tool");
        };
        assert!(text.contains("stage `press` moves 0 tools, there are 1"), "{text}");
    }

    #[test]
    fn the_guard_sees_a_node_come_near() {
        let mut setup = ball_over_sheet(Motion::Travel(Curve::ramp(0.0, 1.0)));
        let (left_out, mut guard) = exclude_unreachable(&mut setup).unwrap();
        assert!(left_out.len() == 1 && left_out[0].patches > 0);
        let simulation = Simulation::new(setup).unwrap();
        assert_eq!(guard.find_violation(&simulation), None);
        let at = |z: f64| {
            let corner = Vec3::new(4.0, 4.0, z) - simulation.tool_shifts()[0];
            Some(BoxTree::build(&[Aabb { min: corner, max: corner + Vec3::repeat(1.0) }]))
        };
        guard.tools = vec![at(0.5 + 0.99 * guard.reach)];
        let find_violation = guard.find_violation(&simulation).unwrap();
        assert_eq!(
            (find_violation.0, simulation.body().mesh().nodes[find_violation.1]),
            (0, Vec3::new(4.0, 4.0, 0.5))
        );
        guard.tools = vec![at(0.5 + 1.01 * guard.reach)];
        assert_eq!(guard.find_violation(&simulation), None);
    }
}
