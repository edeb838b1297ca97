//! Sides and roles of tools.

use super::GivenTool;
use super::heights::{CELLS, Heights};
use kanagata_geometry::{Aabb, Vec3};

/// Projected area of the faces that look one way, minus that of the others, over the sum of both, from which a tool
/// looks that way. A body whose outside is closed has 0.
const FACING_MIN: f64 = 0.2;

/// What a tool does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    /// Stands still; the sheet is drawn into or over it.
    Die,
    /// Moves.
    Punch,
    /// Presses the sheet against the die.
    Holder,
    /// Stands still until its drive is written.
    Other,
}

/// Why no scene can be proposed for tools.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ProposeError {
    /// Fewer than two tools.
    #[error("found {found} tools; allowed: at least a die and a punch")]
    TooFew {
        /// Number of tools.
        found: usize,
    },
    /// All tools lie on one side of the sheet.
    #[error(
        "all tools ({names}) lie {side} the sheet; allowed: tools on both sides; turn the normals of one round, or write the scene by hand"
    )]
    OneSide {
        /// Names of the tools.
        names: String,
        /// `below` or `above`.
        side: &'static str,
    },
    /// A tool without extent in plan, or two tools of one name.
    #[error("tool {name}: {found}; allowed: {allowed}")]
    Tool {
        /// Name of the tool.
        name: String,
        /// What was found.
        found: &'static str,
        /// What is allowed.
        allowed: &'static str,
    },
}

/// Bounds of a tool.
pub(super) fn bounds(tool: &GivenTool) -> Aabb {
    tool.surface.bounds()
}

/// Whether each tool lies below the sheet.
pub(super) fn below(tools: &[GivenTool]) -> Vec<bool> {
    (0..tools.len()).map(|k| is_below(tools, k)).collect()
}

fn is_below(tools: &[GivenTool], k: usize) -> bool {
    let tool = &tools[k];
    let facing = tool.surface.model().facing(&Vec3::z());
    if tool.has_side && facing.abs() >= FACING_MIN {
        return facing > 0.0;
    }
    let others = (0..tools.len()).filter(|&other| other != k);
    let over = others.clone().filter_map(|other| mean_height_over(tool, &tools[other]));
    let (count, higher) =
        over.fold((0, 0.0), |(n, sum): (usize, f64), height| (n + 1, sum + height.signum()));
    if count > 0 && higher != 0.0 {
        return higher < 0.0;
    }
    let middle = |tool: &GivenTool| bounds(tool).center().z;
    let mean = others.clone().map(|other| middle(&tools[other])).sum::<f64>()
        / others.count().max(1) as f64;
    middle(tool) < mean
}

/// Mean height of a tool over another where one covers the other in plan [mm].
fn mean_height_over(tool: &GivenTool, other: &GivenTool) -> Option<f64> {
    let region = common(&bounds(tool), &bounds(other))?;
    let both =
        |tool: &GivenTool| [true, false].map(|above| Heights::new(&tool.surface, &region, above));
    let (own, its) = (both(tool), both(other));
    let middle =
        |of: &[Heights; 2], cell: usize| Some(0.5 * (of[0].at(cell)?[0] + of[1].at(cell)?[0]));
    let heights = (0..CELLS * CELLS)
        .filter_map(|cell| Some(middle(&own, cell)? - middle(&its, cell)?))
        .collect::<Vec<f64>>();
    (!heights.is_empty()).then(|| heights.iter().sum::<f64>() / heights.len() as f64)
}

/// The part of the plan that both boxes cover.
pub(super) fn common(a: &Aabb, b: &Aabb) -> Option<Aabb> {
    let (mut low, mut high) = (a.min.sup(&b.min), a.max.inf(&b.max));
    (low.z, high.z) = (0.0, 0.0);
    (low.x < high.x && low.y < high.y).then_some(Aabb { min: low, max: high })
}

/// Parts of names that tell a role.
const NAMES: [(Role, &[&str]); 4] = [
    (Role::Holder, &["holder", "binder", "blankholder"]),
    (Role::Other, &["pad", "ejector", "bead", "pin"]),
    (Role::Punch, &["punch", "stamp"]),
    (Role::Die, &["die", "matrix"]),
];

fn named(name: &str) -> Option<Role> {
    let name = name.to_lowercase();
    let is = |parts: &[&str]| parts.iter().any(|part| name.contains(part));
    NAMES.iter().find(|(_, parts)| is(parts)).map(|(role, _)| *role)
}

/// Refuses a single tool, and tools on one side of the sheet.
fn check_sides(tools: &[GivenTool], below: &[bool]) -> Result<(), ProposeError> {
    if tools.len() < 2 {
        return Err(ProposeError::TooFew { found: tools.len() });
    }
    if below.iter().all(|b| *b == below[0]) {
        let names: Vec<&str> = tools.iter().map(|tool| tool.name.as_str()).collect();
        let side = if below[0] { "below" } else { "above" };
        return Err(ProposeError::OneSide { names: names.join(", "), side });
    }
    Ok(())
}

/// The role of every tool. Names decide; without them the tool that is alone on its side is the die, and of those on
/// the other side the one that surrounds another in plan is the holder.
pub(super) fn roles(tools: &[GivenTool], below: &[bool]) -> Result<Vec<Role>, ProposeError> {
    check_sides(tools, below)?;
    let mut found: Vec<Option<Role>> = tools.iter().map(|tool| named(&tool.name)).collect();
    let has = |found: &[Option<Role>], role: Role| found.contains(&Some(role));
    if !has(&found, Role::Die) {
        let alone = |k: &usize| below.iter().filter(|b| **b == below[*k]).count() == 1;
        let free = |k: &usize| found[*k].is_none();
        let all = || (0..tools.len()).filter(free);
        // Of two tools the lower one.
        let die = all().filter(alone).max_by_key(|&k| below[k]).or_else(|| all().next());
        die.iter().for_each(|&k| found[k] = Some(Role::Die));
    }
    if !has(&found, Role::Punch) {
        let free: Vec<usize> = (0..tools.len()).filter(|&k| found[k].is_none()).collect();
        let inner = free.iter().copied().min_by(|&a, &b| {
            let area = |k: usize| plan_area(&bounds(&tools[k]));
            area(a).total_cmp(&area(b))
        });
        inner.iter().for_each(|&k| found[k] = Some(Role::Punch));
    }
    if !has(&found, Role::Holder) {
        let punch = found.iter().position(|role| *role == Some(Role::Punch));
        let surrounds = |k: &usize| {
            let around = |p: usize| {
                let (own, inner) = (bounds(&tools[*k]), bounds(&tools[p]));
                below[*k] == below[p] && plan_area(&own) > plan_area(&inner)
            };
            found[*k].is_none() && punch.is_some_and(around)
        };
        let holder = (0..tools.len()).find(surrounds);
        holder.iter().for_each(|&k| found[k] = Some(Role::Holder));
    }
    Ok(found.into_iter().map(|role| role.unwrap_or(Role::Other)).collect())
}

/// Area of a box in plan [mm^2].
pub(super) fn plan_area(bounds: &Aabb) -> f64 {
    let size = bounds.max - bounds.min;
    size.x * size.y
}
