//! Blank holders: tools pressed by a force against a stationary one. Their mean pressure, and whether the blank is
//! between them.

use super::clamping::{opposes, opposite_tools};
use super::finding::Finding;
use crate::holding::{Placed, area_between, lower_faces};
use kanagata_geometry::Vec3;
use kanagata_report::doubt::DoubtCode;
use kanagata_report::record::HolderLostRecord;
use kanagata_solver::{Motion, SimulationSetup, Stage, ToolSetup};

/// Mean holder pressure below which a doubt is raised [MPa]: a tenth of the minimum of Siebel's rule for drawing, 0.5 to
/// 5 MPa. A force in kN in place of N is a factor of 1000.
const HOLDER_PRESSURE_MIN_MPA: f64 = 0.05;
/// Mean holder pressure above which a note is given [MPa]: twice the maximum of this rule. Doubled: a pan whose blank is drawn
/// out from under its holder, pressed with 13.7 MPa, has no note.
const HOLDER_PRESSURE_MAX_MPA: f64 = 10.0;

/// A blank holder.
#[derive(Debug, Clone, PartialEq)]
pub struct Holder {
    /// Index of the tool.
    pub tool: usize,
    /// Indices of the stationary tools opposite.
    pub dies: Vec<usize>,
    /// Unit vector of its travel, towards the sheet.
    pub direction: Vec3,
    /// Whether its travel has a limit: it rests there when the sheet has left it.
    pub has_stop: bool,
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

    /// Whether the blank is between the holder and the tools opposite at the start.
    #[must_use]
    pub fn is_on_blank(&self) -> bool {
        self.clamped >= HolderLostRecord::AREA_MIN_REL * self.blank
    }

    /// Whether a force drives the holder in a stage.
    #[must_use]
    pub fn is_forced(&self, stage: usize) -> bool {
        self.forced.get(stage) == Some(&true)
    }
}

/// The blank holders of a scene with placed tools.
#[must_use]
pub fn holders(setup: &SimulationSetup) -> Vec<Holder> {
    let at_rest = |tool: usize| {
        let rests = |m: &Motion| matches!(m, Motion::Hold | Motion::Release | Motion::Absent);
        setup.stages.iter().all(|stage| rests(&stage.motions[tool]))
    };
    let of = |tool: usize| {
        let force = largest_force(setup, tool).filter(|force| *force > 0.0)?;
        let dies: Vec<usize> = opposite_tools(setup, tool)
            .filter(|&other| at_rest(other) && opposes(setup, other, tool))
            .collect();
        (!dies.is_empty()).then(|| {
            let (clamped, blank) = clamped_area(setup, tool, &dies);
            let ToolSetup { direction, stop, .. } = setup.tools[tool];
            let has_stop = stop.is_some();
            let is_force_driven = |stage: &Stage| matches!(stage.motions[tool], Motion::Force(_));
            let forced = setup.stages.iter().map(is_force_driven).collect();
            Holder {
                tool,
                dies,
                direction,
                has_stop,
                force: force / setup.share,
                forced,
                clamped,
                blank,
            }
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
    let (mesh, direction) = (setup.body.mesh(), &setup.tools[tool].direction);
    let placed = |tool: usize| {
        let ToolSetup { surface, offset, .. } = &setup.tools[tool];
        Placed { surface, shift: *offset }
    };
    let faces = lower_faces(mesh, &mesh.nodes, direction);
    let dies: Vec<Placed<'_>> = dies.iter().map(|&die| placed(die)).collect();
    let between = area_between(&faces, direction, mesh.mean_thickness(), (&placed(tool), &dies));
    (between, faces.iter().map(|(_, area)| area).sum())
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
        if !holder.is_on_blank() {
            let ratio = holder.clamped / holder.blank;
            out.push(
                Finding::doubt(
                    DoubtCode::BlankTooSmall,
                    name.clone(),
                    format!(
                        "The blank is hardly between {name} and the tool opposite: {:.1} of {:.1} mm2 ({:.0} % at least expected). It lies within their opening.",
                        holder.clamped,
                        holder.blank,
                        100.0 * HolderLostRecord::AREA_MIN_REL
                    ),
                    "Check the size of the blank, its place and its symmetry planes.".into(),
                )
                .exceeds([ratio, HolderLostRecord::AREA_MIN_REL]),
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
