//! A scene in outline: everything that tools and wishes determine, before it is written.

use super::blank::{Outline, disc, element_length, rectangle, rounded, two_digits};
use super::heights::extreme;
use super::roles::{ProposeError, Role, below, bounds, plan_area, roles};
use super::symmetry::{Cut, are_of_revolution, cuts};
use super::travel::{closing_travel, height};
use super::{GivenTool, PartKind, Wishes};
use kanagata_geometry::Aabb;
use kanagata_scene::types::ToolCad;

/// Pressure of the holder on the blank outside the punch [MPa]: usual for mild steel; aluminium takes half of it.
const HOLDER_PRESSURE_MPA: f64 = 2.0;

/// Ratio of the largest to the smallest tool in plan above which one of them is probably in another unit: wrong units are
/// factors of 10 and more, and a punch is rarely smaller than a third of its die.
const TOOL_SIZE_RATIO_MAX: f64 = 5.0;

/// A tool and its place in the process.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PlacedTool {
    pub(super) name: String,
    pub(super) file: String,
    pub(super) cad: Option<ToolCad>,
    pub(super) below: bool,
    pub(super) role: Role,
    /// Size along the axes [mm]; `None` for a tool that is still to be made.
    pub(super) size: Option<[f64; 3]>,
}

impl PlacedTool {
    fn new(tool: &GivenTool, below: bool, role: Role) -> Self {
        let (name, file, cad) = (tool.name.clone(), tool.file.clone(), tool.cad.clone());
        Self { name, file, cad, below, role, size: Some(size_of(tool)) }
    }
}

/// Where the travel of the punch comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TravelFrom {
    /// The tools close on the sheet.
    Closing,
    /// Half the height of the punch: the die is open.
    Height,
    /// A value of the template.
    Template,
}

/// A proposed scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    pub(super) name: String,
    pub(super) thickness: f64,
    pub(super) material: String,
    pub(super) outline: Outline,
    pub(super) cuts: Vec<Cut>,
    pub(super) tools: Vec<PlacedTool>,
    pub(super) travel: (f64, TravelFrom),
    /// Force of the whole process [N].
    pub(super) holder_force: f64,
    pub(super) plane_strain: bool,
}

impl Layout {
    /// What is proposed, one line a tool and one for the blank, for whoever gave the tools: a wrong unit shows in sizes.
    #[must_use]
    pub fn summary(&self) -> Vec<String> {
        let tool = |tool: &PlacedTool| {
            let side = if tool.below { "below" } else { "above" };
            let size = tool.size.map_or_else(String::new, |[x, y, z]| {
                format!(", {:.1} x {:.1} x {:.1} mm", x, y, z)
            });
            let drive = match tool.role {
                Role::Holder => format!(", {} N", self.holder_force),
                Role::Punch => format!(", travels {:.1} mm", self.travel.0),
                _ => String::new(),
            };
            format!("{}: {side} the sheet{size}{drive}", tool.name)
        };
        let part = ["", "half ", "a quarter "][self.cuts.len().min(2)];
        let of = if part.is_empty() { "" } else { "of the sheet, " };
        let outline = match &self.outline {
            Outline::Rectangle { size: [x, y], elements: [n, m], .. } => {
                format!("{x:.1} x {y:.1} mm, {n} x {m} elements")
            }
            Outline::QuarterDisc { radius, core, rings }
            | Outline::Disc { radius, core, rings } => {
                format!("radius {radius:.1} mm, core of {core} x {core} elements, {rings} rings")
            }
        };
        let blank = format!("blank: {part}{of}{outline}, {} mm thick", self.thickness);
        self.tools.iter().map(tool).chain([blank]).collect()
    }

    /// A pair of tools whose sizes in plan differ as those of different units do.
    #[must_use]
    pub fn size_warning(&self) -> Option<String> {
        let length = |[x, y, _]: [f64; 3]| x.max(y);
        let sizes = || self.tools.iter().filter_map(|t| Some((t.name.as_str(), length(t.size?))));
        let smallest = sizes().min_by(|a, b| a.1.total_cmp(&b.1))?;
        let largest = sizes().max_by(|a, b| a.1.total_cmp(&b.1))?;
        (largest.1 > TOOL_SIZE_RATIO_MAX * smallest.1).then(|| {
            format!(
                "{} is {:.1} mm across and {} is {:.1} mm, {:.1} times as much: check the units of their files",
                smallest.0, smallest.1, largest.0, largest.1, largest.1 / smallest.1
            )
        })
    }

    /// Names of the tools without a drive, besides the die.
    pub fn idle(&self) -> impl Iterator<Item = &str> {
        let idle = self.tools.iter().filter(|tool| tool.role == Role::Other);
        idle.map(|tool| tool.name.as_str())
    }
}

/// Proposes a scene for tools that move along z.
///
/// # Errors
/// [`ProposeError`] when the tools are fewer than two, on one side of the sheet, without extent, or of one name.
pub fn propose(tools: &[GivenTool], wishes: &Wishes) -> Result<Layout, ProposeError> {
    check(tools)?;
    if is_plane_strain(wishes.kind) {
        check_common(tools)?;
    }
    let below = below(tools);
    let roles = roles(tools, &below)?;
    let of = |role: Role| roles.iter().position(|r| *r == role);
    let die = of(Role::Die).unwrap_or(0);
    let punch = of(Role::Punch).or_else(|| (0..tools.len()).find(|&k| k != die)).unwrap_or(0);
    let carrier = of(Role::Holder).unwrap_or(die);
    let (die, punch, carrier) = (&tools[die], &tools[punch], &tools[carrier]);
    let is_die_below = below[of(Role::Die).unwrap_or(0)];
    let plane_strain = is_plane_strain(wishes.kind);
    let mut cuts = cuts(tools, wishes.thickness_mm);
    cuts.retain(|cut| !(plane_strain && cut.axis == 1));
    let travel = match closing_travel(die, punch, is_die_below, wishes.thickness_mm) {
        Some(travel) => (rounded(travel, 0.1), TravelFrom::Closing),
        None => (rounded(0.5 * height(die, punch), 0.1), TravelFrom::Height),
    };
    let length = element_length(tools, wishes.thickness_mm);
    let outline = outline(&[die, punch, carrier], wishes.kind, &cuts, (travel.0, length));
    let pressed = area_beside(punch, &outline, plane_strain, &cuts);
    let placed = tools.iter().zip(&below).zip(&roles).map(|((tool, &below), &role)| {
        let role = if std::ptr::eq(tool, punch) { Role::Punch } else { role };
        PlacedTool::new(tool, below, role)
    });
    Ok(Layout {
        name: wishes.name.clone(),
        thickness: wishes.thickness_mm,
        material: wishes.material.clone(),
        outline,
        tools: placed.collect(),
        travel,
        holder_force: two_digits((HOLDER_PRESSURE_MPA * pressed).max(100.0)),
        cuts,
        plane_strain,
    })
}

/// Area of the whole blank outside the punch [mm^2].
fn area_beside(punch: &GivenTool, outline: &Outline, plane_strain: bool, cuts: &[Cut]) -> f64 {
    let covered = match outline {
        // Of a strip the punch covers as much as it is wide.
        Outline::Rectangle { size, .. } if plane_strain => {
            size[1] * (bounds(punch).max.x - bounds(punch).min.x)
        }
        _ => plan_area(&bounds(punch)),
    };
    outline.area(1 << cuts.len()) - covered * parts_of(punch, cuts)
}

/// Size of a tool along the axes [mm]: in plan that of its box, along z between its points.
fn size_of(tool: &GivenTool) -> [f64; 3] {
    let size = bounds(tool).max - bounds(tool).min;
    [size.x, size.y, extreme(&tool.surface, true) - extreme(&tool.surface, false)]
}

fn is_plane_strain(kind: Option<PartKind>) -> bool {
    matches!(kind, Some(PartKind::UDraw | PartKind::Bend))
}

/// Number of symmetric parts of a tool of which it has one: it ends at these planes.
fn parts_of(tool: &GivenTool, cuts: &[Cut]) -> f64 {
    let Aabb { min, max } = bounds(tool);
    let near = 1e-3 * (max - min).norm();
    let ends =
        |cut: &&Cut| (min[cut.axis] - cut.at).abs() < near || (max[cut.axis] - cut.at).abs() < near;
    f64::from(1 << cuts.iter().filter(ends).count())
}

fn outline(
    [die, punch, carrier]: &[&GivenTool; 3],
    kind: Option<PartKind>,
    cuts: &[Cut],
    (travel, length): (f64, Option<f64>),
) -> Outline {
    let centred = cuts.len() == 2 && cuts.iter().all(|cut| cut.at == 0.0);
    let quadrant = centred && cuts.iter().all(|cut| cut.side > 0.0);
    let round = match kind {
        Some(PartKind::Cup) => true,
        Some(_) => false,
        None => centred && are_of_revolution(&[die, punch], cuts),
    };
    if round {
        return disc([die, punch, carrier], quadrant, travel, length);
    }
    let strip = is_plane_strain(kind);
    let mut outline = rectangle([die, punch, carrier], cuts, travel, (length, strip));
    if let Outline::Rectangle { corner, size, elements } = &mut outline
        && strip
    {
        // One row of elements, as wide as they are long, in the middle of what all tools have.
        let all = [die, punch, carrier].map(|tool| bounds(tool));
        let low = all.iter().map(|b| b.min.y).fold(f64::NEG_INFINITY, f64::max);
        let high = all.iter().map(|b| b.max.y).fold(f64::INFINITY, f64::min);
        size[1] = (high - low).max(0.0).min(size[0] / elements[0] as f64);
        corner[1] = 0.5 * (low + high) - 0.5 * size[1];
        elements[1] = 1;
    }
    outline
}

/// A strip needs a place along y that all tools have.
fn check_common(tools: &[GivenTool]) -> Result<(), ProposeError> {
    let low = tools.iter().map(|t| bounds(t).min.y).fold(f64::NEG_INFINITY, f64::max);
    let beyond = tools.iter().find(|t| bounds(t).max.y <= low);
    beyond.map_or(Ok(()), |tool| {
        Err(ProposeError::Tool {
            name: tool.name.clone(),
            found: "no place along y that another tool has too",
            allowed: "tools at one place along y, where a strip lies between all of them",
        })
    })
}

fn check(tools: &[GivenTool]) -> Result<(), ProposeError> {
    for (k, tool) in tools.iter().enumerate() {
        let error =
            |found, allowed| Err(ProposeError::Tool { name: tool.name.clone(), found, allowed });
        let size = bounds(tool).max - bounds(tool).min;
        if tools[..k].iter().any(|other| other.name == tool.name) {
            return error("a second tool of this name", "different names of the tool files");
        }
        if !(size.x > 0.0 && size.y > 0.0 && size.iter().all(|s| s.is_finite())) {
            return error("no extent in x and y", "tools that move along z");
        }
    }
    Ok(())
}

/// A scene for a kind of part, with tool files that are still to be made: `die.tool.json`, `punch.tool.json` and, but
/// for a bend, `holder.tool.json`.
#[must_use]
pub fn template(kind: PartKind, wishes: &Wishes) -> Layout {
    let quarter = vec![Cut { axis: 0, at: 0.0, side: 1.0 }, Cut { axis: 1, at: 0.0, side: 1.0 }];
    let rectangle =
        |size: [f64; 2], elements| Outline::Rectangle { corner: [0.0; 2], size, elements };
    let (outline, cuts, travel, holder_force) = match kind {
        PartKind::Cup => {
            let outline = Outline::QuarterDisc { radius: 100.0, core: 14, rings: 24 };
            (outline, quarter, 30.0, 40_000.0)
        }
        PartKind::Pan => (rectangle([150.0, 100.0], [60, 40]), quarter, 25.0, 80_000.0),
        PartKind::UDraw => (rectangle([150.0, 2.0], [75, 1]), quarter[..1].to_vec(), 60.0, 50.0),
        PartKind::Bend => (rectangle([60.0, 1.0], [60, 1]), quarter[..1].to_vec(), 20.0, 0.0),
    };
    let tool = |name: &str, below: bool, role: Role| PlacedTool {
        name: name.into(),
        file: format!("{name}.tool.json"),
        cad: None,
        below,
        role,
        size: None,
    };
    let mut tools = vec![tool("die", true, Role::Die), tool("punch", false, Role::Punch)];
    if kind != PartKind::Bend {
        tools.insert(1, tool("holder", false, Role::Holder));
    }
    Layout {
        name: wishes.name.clone(),
        thickness: wishes.thickness_mm,
        material: wishes.material.clone(),
        outline,
        cuts,
        tools,
        travel: (travel, TravelFrom::Template),
        holder_force,
        plane_strain: is_plane_strain(Some(kind)),
    }
}
