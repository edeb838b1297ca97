//! What a scene has too much or too little of, said before it runs, each with what it costs.

mod away;
mod border;
mod clamping;
mod clearance;
mod coarse;
mod curvature;
mod inside;
mod material;
mod seam;
mod sharp;
mod size;
mod stops;
mod symmetry;
mod tools;
mod unheld;
mod unopposed;

use std::fmt;

use self::clamping::Clamping;
use self::sharp::Opposite;
use self::size::Sizes;
use super::cost::Cost;
use crate::scene::Plan;
use crate::solver::element::ElementKind;
use crate::solver::reach::reachable;
use crate::solver::{Motion, SimulationSetup};

/// In-plane size over layer thickness from which fully integrated hexahedra are far too stiff in bending.
const SLENDER: f64 = 4.0;
/// Points through the thickness from which a solid-shell gains nothing in bending, and those that springback wants.
const POINTS: [u8; 2] = [5, 7];
/// Radius of a tool over the thickness below which sections of a sheet that is wiped over it do not stay straight: so at 2 and 5
/// (docs/results/solver.md).
const SHARP: f64 = 6.0;
/// Time grows with this power of the unknowns (`docs/results/solver.md`).
const GROWTH: f64 = 1.5;

/// A remark on a scene.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remark {
    /// What is too much, too little, or missing.
    pub what: String,
    /// What that costs, or what the remedy would.
    pub cost: String,
    /// `--auto` sees to it.
    pub auto: bool,
}

impl Remark {
    fn new(what: String, cost: String) -> Self {
        Self { what, cost, auto: false }
    }
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let auto = if self.auto { " (--auto does it)" } else { "" };
        write!(f, "{}; {}{auto}", self.what, self.cost)
    }
}

/// Remarks on a scene that make what a run finds doubtful.
#[must_use]
pub fn doubts(plan: &Plan, setup: &SimulationSetup) -> Vec<Remark> {
    let mut out: Vec<Remark> = material::remark(&plan.card).into_iter().collect();
    out.extend(seam::remark(setup.body.mesh()));
    out.extend(symmetry::missing(plan, setup));
    unopposed::remarks(setup, &mut out);
    out.extend(unheld::remark(setup));
    out.extend(setup.tools.iter().filter_map(tools::without_area));
    out.extend(idle(setup));
    out
}

/// A remark on a scene in which nothing is to happen.
fn idle(setup: &SimulationSetup) -> Option<Remark> {
    let stands = |m: &Motion| matches!(m, Motion::Hold | Motion::Release | Motion::Absent);
    let idle = setup.stages.iter().flat_map(|stage| &stage.motions).all(stands);
    (idle && setup.loads.iter().all(|&force| force == 0.0)).then(|| {
        Remark::new(
            "no stage moves a tool and no load acts".into(),
            "the sheet stays as it is; say in `drive` of a stage what moves".into(),
        )
    })
}

/// Remarks on a scene whose tools have been placed; none when there is nothing to say.
#[must_use]
pub fn advice(plan: &Plan, setup: &SimulationSetup, cost: &Cost) -> Vec<Remark> {
    let sizes = Sizes::new(setup.body.mesh());
    let mut out = doubts(plan, setup);
    out.extend(symmetry::wrong(plan, setup));
    out.extend(symmetry::unused(plan, setup, cost));
    let (kept, part) = (reachable(setup), symmetry::part(plan, setup));
    let sharpest = tools::sharpest(setup, &kept);
    elements(plan, setup, (sizes.mean, sharpest), cost, &mut out);
    for (k, tool) in setup.tools.iter().enumerate() {
        let opposite = Opposite::new(setup, k, &kept[k], &sizes);
        let clamping = Clamping::new(setup, k, &kept[k], &opposite);
        tools::remarks(tool, &kept[k], (&part, &clamping), (&sizes, cost), &mut out);
        // Of a tool that is out of reach that has been said.
        out.extend(kept[k].contains(&true).then(|| away::remark(setup, k)).flatten());
        out.extend(inside::remark(setup, k, &sizes));
        out.extend(sharp::remark(setup, k, &kept[k], &sizes));
        out.extend(border::remark(setup, k, &kept, &sizes));
    }
    clearance::remarks(plan, setup, &kept, &mut out);
    stops::remarks(setup, &mut out);
    out
}

/// Travel at the end of a stage of a tool that was at `before` when it began [mm]; `None` where a force or a spring has it.
fn end_of(motion: &Motion, before: f64) -> Option<f64> {
    match motion {
        Motion::Hold | Motion::Release | Motion::Absent => Some(before),
        Motion::Travel(curve) => Some(curve.at(1.0)),
        Motion::Advance(curve) => Some(before + curve.at(1.0)),
        Motion::Force(_) | Motion::Spring { .. } => None,
    }
}

/// Layers and points against what bending needs; `size` of the elements and sharpest radius of the tools [mm].
fn elements(
    plan: &Plan,
    setup: &SimulationSetup,
    (size, sharpest): (f64, f64),
    cost: &Cost,
    out: &mut Vec<Remark>,
) {
    let blank = &plan.scene.blank;
    let mesh = setup.body.mesh();
    let layers = mesh.nodes_per_column.saturating_sub(1).max(1);
    let slender = size / (mesh.mean_thickness() / layers as f64);
    let released = |m: &Motion| matches!(m, Motion::Release | Motion::Absent);
    let springs_back = setup.stages.iter().skip(1).any(|s| s.motions.iter().any(released));
    let sharp = springs_back && sharpest < SHARP * mesh.mean_thickness();
    let fewer = (2.0 / (layers + 1) as f64).powf(GROWTH);
    match blank.element {
        ElementKind::Hex8 if slender > SLENDER => out.push(Remark::new(
            format!(
                "hex8 elements of {size:.2} mm are {slender:.0} times as long as thick and too stiff where the sheet bends"
            ),
            if layers > 1 {
                format!("solid-shell bends with one layer, for about {:.0} % of the time", 100.0 * fewer)
            } else {
                "solid-shell bends with one layer".into()
            },
        )),
        ElementKind::SolidShell { .. } if layers == 1 && sharp => out.push(Remark::new(
            format!(
                "one layer of solid-shell over a radius of {sharpest:.2} mm, {:.1} thicknesses, and a stage that releases tools: a flange wiped over such a radius springs back by up to twice what several layers find",
                sharpest / mesh.mean_thickness()
            ),
            format!("two layers take about {}, three or four agree with hexahedra", cost.times(1.5_f64.powf(GROWTH))),
        )),
        ElementKind::SolidShell { .. } if layers > 1 && !sharp => out.push(Remark::new(
            format!("{layers} layers of solid-shell: one bends as well"),
            format!("one takes {} in place of {}", cost.times(fewer), cost.times(1.0)),
        )),
        ElementKind::Hex8Enhanced if layers > 3 => out.push(Remark::new(
            format!("{layers} layers of hex8-enhanced: two bend within a few per cent"),
            format!("two take about {}", cost.times((3.0 / (layers + 1) as f64).powf(GROWTH))),
        )),
        _ => {}
    }
    if let ElementKind::SolidShell { points, .. } = blank.element {
        out.extend(points_remark(points, springs_back, cost));
    }
}

/// A remark on the points through the thickness of solid-shells.
fn points_remark(points: u8, springs_back: bool, cost: &Cost) -> Option<Remark> {
    let wanted = POINTS[usize::from(springs_back)];
    let what = if points > wanted {
        format!("{points} points through the thickness: {wanted} are enough here")
    } else if springs_back && points < wanted {
        format!(
            "{points} points through the thickness and a stage that releases tools: springback wants {wanted}, with fewer the moment of bending is a few per cent low"
        )
    } else {
        return None;
    };
    let share = cost.elements_s * cost.iterations[0] / cost.seconds[0].max(1e-300);
    let change = 1.0 + share * (f64::from(wanted) / f64::from(points) - 1.0);
    Some(Remark::new(what, format!("{wanted} take about {}", cost.times(change))))
}
