//! Blank holders: tools pressed by a force against a stationary one. Their mean pressure, and whether the blank is
//! between them.

use super::clamping::{opposes, opposite_tools};
use super::finding::Finding;
use kanagata_geometry::Vec3;
use kanagata_report::doubt::DoubtCode;
use kanagata_solver::{Motion, SimulationSetup, Stage, ToolSetup};

/// Mean holder pressure below which a doubt is raised [MPa]: a tenth of the minimum of Siebel's rule for drawing, 0.5 to
/// 5 MPa. A force in kN in place of N is a factor of 1000.
const HOLDER_PRESSURE_MIN_MPA: f64 = 0.05;
/// Mean holder pressure above which a note is given [MPa]: twice the maximum of this rule. Doubled: a pan whose blank is drawn
/// out from under its holder, pressed with 13.7 MPa, has no note.
const HOLDER_PRESSURE_MAX_MPA: f64 = 10.0;
/// Ratio of clamped area to blank area below which the blank is not between the tools.
const CLAMPED_AREA_MIN_REL: f64 = 0.01;
/// Smallest cosine between a tool's direction and the normal of a clamping face.
const CLAMP_COS_MIN: f64 = 0.9;
/// Largest lateral distance of a foot point from the line along the tool's direction, over the thickness.
const FOOT_OFFSET_MAX_REL: f64 = 0.1;

/// A blank holder.
#[derive(Debug, Clone, PartialEq)]
pub struct Holder {
    /// Index of the tool.
    pub tool: usize,
    /// Largest force over all stages, on the modelled part [N].
    pub force: f64,
    /// Whether a force drives the tool, by stage.
    pub forced: Vec<bool>,
    /// Area of the blank between the holder and stationary tools, of the modelled part [mm²].
    pub clamped: f64,
    /// Area of the blank, of the modelled part [mm²].
    pub blank: f64,
}

impl Holder {
    /// Mean pressure on the clamped area [MPa].
    #[must_use]
    pub fn pressure(&self) -> f64 {
        self.force / self.clamped
    }
}

/// The blank holders of a scene with placed tools. `kept`: reachable patches of each tool.
#[must_use]
pub fn holders(setup: &SimulationSetup, kept: &[Vec<bool>]) -> Vec<Holder> {
    let at_rest = |tool: usize| {
        let rests = |m: &Motion| matches!(m, Motion::Hold | Motion::Release | Motion::Absent);
        setup.stages.iter().all(|stage| rests(&stage.motions[tool]))
    };
    let of = |tool: usize| {
        let force = largest_force(setup, tool).filter(|force| *force > 0.0)?;
        let dies: Vec<usize> = opposite_tools(setup, tool)
            .filter(|&other| at_rest(other) && opposes(setup, other, tool, &kept[tool]))
            .collect();
        (!dies.is_empty()).then(|| {
            let (clamped, blank) = clamped_area(setup, tool, &dies);
            let is_force_driven = |stage: &Stage| matches!(stage.motions[tool], Motion::Force(_));
            let forced = setup.stages.iter().map(is_force_driven).collect();
            Holder { tool, force: force / setup.share, forced, clamped, blank }
        })
    };
    (0..setup.tools.len()).filter_map(of).collect()
}

/// Largest force of a tool over all stages, of the whole process [N]; `None` if no force drives it.
fn largest_force(setup: &SimulationSetup, tool: usize) -> Option<f64> {
    let of = |motion: &Motion| match motion {
        Motion::Force(curve) => Some(curve.extent()[1]),
        _ => None,
    };
    setup.stages.iter().filter_map(|stage| of(&stage.motions[tool])).reduce(f64::max)
}

/// Areas projected along the tool's direction [mm²]: of the blank between the tool's front and a face of `dies`, and of
/// the whole blank.
fn clamped_area(setup: &SimulationSetup, tool: usize, dies: &[usize]) -> (f64, f64) {
    let mesh = setup.body.mesh();
    let own = &setup.tools[tool];
    let faces =
        mesh.elements.iter().filter(|e| (e[0] as usize).is_multiple_of(mesh.nodes_per_column));
    let (mut places, mut areas) = (Vec::new(), Vec::new());
    for element in faces {
        let [a, b, c, d] = [0, 1, 2, 3].map(|k| mesh.nodes[element[k] as usize]);
        places.push(0.25 * (a + b + c + d));
        areas.push(0.5 * (c - a).cross(&(d - b)).dot(&own.direction).abs());
    }
    let near = FOOT_OFFSET_MAX_REL * mesh.mean_thickness();
    let over = |other: &ToolSetup, sign: f64| -> Vec<bool> {
        let points: Vec<Vec3> = places.iter().map(|x| x - other.offset).collect();
        let feet = other.surface.closest_of_all(&points, &[]);
        let faces = points.iter().zip(&feet).map(|(x, foot)| {
            let away = x - foot.point;
            let beside = (away - own.direction * away.dot(&own.direction)).norm();
            beside < near && sign * foot.normal.dot(&own.direction) > CLAMP_COS_MIN
        });
        faces.collect()
    };
    let front = over(own, 1.0);
    let backs: Vec<Vec<bool>> = dies.iter().map(|&die| over(&setup.tools[die], -1.0)).collect();
    let between = |k: usize| front[k] && backs.iter().any(|back| back[k]);
    let clamped = (0..areas.len()).filter(|&k| between(k)).fold(0.0, |sum, k| sum + areas[k]);
    (clamped, areas.iter().sum())
}

/// A note on a pressure above those of drawing.
fn strong(holder: &Holder, name: &str) -> Finding {
    Finding::note(
        format!(
            "{name} presses with {:.1} MPa on {:.0} mm2, {:.0} % of the blank; holders need 0.5 to 5 MPa",
            holder.pressure(),
            holder.clamped,
            100.0 * holder.clamped / holder.blank
        ),
        "a larger blank or a smaller force: a rim near the opening is drawn out from under the holder".into(),
    )
}

/// Findings on blank holders.
pub(super) fn findings(setup: &SimulationSetup, holders: &[Holder], out: &mut Vec<Finding>) {
    for holder in holders {
        let name = &setup.tools[holder.tool].name;
        let ratio = holder.clamped / holder.blank;
        if ratio < CLAMPED_AREA_MIN_REL {
            out.push(
                Finding::doubt(
                    DoubtCode::BlankTooSmall,
                    name.clone(),
                    format!(
                        "The blank is hardly between {name} and the tool opposite: {:.1} of {:.1} mm2 ({:.0} % at least expected). It lies within their opening.",
                        holder.clamped,
                        holder.blank,
                        100.0 * CLAMPED_AREA_MIN_REL
                    ),
                    "Check the size of the blank, its place and its symmetry planes.".into(),
                )
                .exceeds([ratio, CLAMPED_AREA_MIN_REL]),
            );
        } else if holder.pressure() < HOLDER_PRESSURE_MIN_MPA {
            out.push(
                Finding::doubt(
                    DoubtCode::HolderPressure,
                    format!("{name}.force_n"),
                    format!(
                        "{name} presses with {:.3e} MPa ({:.4} N on {:.0} mm2, modelled part); holders need 0.5 to 5 MPa (below {HOLDER_PRESSURE_MIN_MPA} they do not hold).",
                        holder.pressure(),
                        holder.force,
                        holder.clamped
                    ),
                    "Check the unit: forces are in N, of the whole process.".into(),
                )
                .exceeds([holder.pressure(), HOLDER_PRESSURE_MIN_MPA]),
            );
        } else if holder.pressure() > HOLDER_PRESSURE_MAX_MPA {
            out.push(strong(holder, name));
        }
    }
}
