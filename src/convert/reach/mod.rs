//! Faces of a tool that the sheet of a scene can touch; the others may be left out of its model.
//!
//! What is known before a run is where the sheet begins and how far the tools travel. A face is left out only when
//! one of three things holds over the whole of it:
//!
//! - **beside**: seen along the tool's direction it lies outside the box of the blank, widened by twice the thickness
//!   or a twentieth of the blank's size (whichever is more), and by what tools travel across;
//! - **behind**: it lies farther behind the front of the tool (the foremost point over the blank, which is what
//!   touches the flat sheet first) than all travels together and twice the thickness: no tool carries the sheet there;
//! - **away**: every normal looks away from the sheet by more than 5 degrees, and all that moves or pushes goes along the
//!   tool's direction: a sheet would have to wrap round the tool. A cam from the side may press a flange there.
//!
//! Travels are added up whatever their directions. A tool driven by force is taken to follow the sheet, no farther
//! than the tools driven by travel move it; a scene without a travel, or with loads on the sheet, says nothing about
//! how deep the sheet goes, and no face counts as behind.

mod zone;

use super::part::subset;
use crate::cad::Model;
use crate::cad::model::Face;
use crate::geometry::{Vec2, Vec3};
use crate::mesh::MeshError;
use crate::mesh::mapped::{MappedOptions, mesh};

pub use zone::Zone;

/// Degrees beyond a right angle from which on a normal looks away.
const AWAY_DEG: f64 = 5.0;

/// Why a face is left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Why {
    /// Beside the sheet.
    Beside,
    /// Farther behind the front than any tool travels.
    Behind,
    /// Looks away from the sheet.
    Away,
}

/// Why there is no zone, or nothing in it.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum ReachError {
    /// No tool of the scene is meant.
    #[error("no tool of the scene has the file '{file}' or the name '{name}'; allowed: {allowed}")]
    NoTool {
        /// Name of the output file.
        file: String,
        /// Name of the tool.
        name: String,
        /// Tools of the scene.
        allowed: String,
    },
    /// Every face is out of reach.
    #[error(
        "the sheet reaches none of the {faces} faces; allowed: at least one; check the tool's direction, its place and the blank in the scene, or convert the whole model"
    )]
    Nothing {
        /// Faces of the model.
        faces: usize,
    },
    /// The blank's mesh file.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// A model without the faces that the sheet cannot touch.
#[derive(Debug, Clone)]
pub struct Reached {
    /// The faces within reach, numbered anew.
    pub model: Model,
    /// For each of them its number in the whole model.
    pub kept: Vec<usize>,
    /// Faces left out, and why.
    pub left_out: Vec<(usize, Why)>,
    /// The whole model looks away from the sheet and has to be turned round.
    pub turned: bool,
}

/// Splits `model` into what the sheet can touch and what it cannot. `side`: where the sheet is, if not where the tool
/// goes; `flip`: the model is turned round after that.
///
/// # Errors
/// [`ReachError::Nothing`] when no face is left.
pub fn within_reach(
    model: &Model,
    zone: &Zone,
    side: Option<Vec3>,
    flip: bool,
) -> Result<Reached, ReachError> {
    let coarse = MappedOptions { arc_divisions: 2, ..MappedOptions::default() };
    let mesh = mesh(model, &coarse).ok();
    let away = |m| super::ground::looks_away(m, Some(side.unwrap_or(zone.direction())));
    let turned = mesh.as_ref().is_some_and(away) ^ flip;
    // Vertices lie on the tool: the foremost one over the blank is no farther ahead than the front is.
    let front = if zone.touches {
        let over = |p: &&Vec3| {
            (0..2).all(|k| (zone.blank[k][0]..=zone.blank[k][1]).contains(&p.dot(&zone.axes[k])))
        };
        let on_tool = mesh.iter().flat_map(|m| &m.vertices);
        on_tool.filter(over).map(|p| p.dot(&zone.axes[2])).fold(f64::NEG_INFINITY, f64::max)
    } else {
        zone.blank[2][0]
    };
    let near = 1e-6 * model.bbox().diagonal();
    let mut found = Reached { model: Model::default(), kept: vec![], left_out: vec![], turned };
    for (f, face) in model.faces.iter().enumerate() {
        match why_not(face, zone, front, turned, near) {
            Some(why) => found.left_out.push((f, why)),
            None => found.kept.push(f),
        }
    }
    if found.kept.is_empty() {
        return Err(ReachError::Nothing { faces: model.faces.len() });
    }
    found.model = subset(model, &found.kept);
    Ok(found)
}

fn why_not(face: &Face, zone: &Zone, front: f64, turned: bool, near: f64) -> Option<Why> {
    let corners = face.bbox().widened(near).corners();
    let extent = |k: usize| {
        let at = corners.iter().map(|p| p.dot(&zone.axes[k]));
        at.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)])
    };
    let beside = |k: usize| {
        let ([low, high], [a, b]) = (extent(k), zone.blank[k]);
        high < a - zone.margin[k] || low > b + zone.margin[k]
    };
    if beside(0) || beside(1) {
        Some(Why::Beside)
    } else if extent(2)[1] < front - zone.depth {
        Some(Why::Behind)
    } else if !zone.pressed_across
        && looks_away(face, &(zone.axes[2] * if turned { -1.0 } else { 1.0 }))
    {
        Some(Why::Away)
    } else {
        None
    }
}

/// True when every normal of the face's surface, over the box of its loops, looks away from `side`, by the angle
/// between neighbouring samples more than is asked.
fn looks_away(face: &Face, side: &Vec3) -> bool {
    const N: usize = 12;
    let [[u0, u1], [v0, v1]] = face.surface.domain();
    let at = |k: usize| {
        let (i, j) = ((k / (N + 1)) as f64 / N as f64, (k % (N + 1)) as f64 / N as f64);
        face.normal(Vec2::new(u0 + (u1 - u0) * i, v0 + (v1 - v0) * j))
    };
    let normals: Option<Vec<Vec3>> = (0..(N + 1) * (N + 1)).map(at).collect();
    // A surface without a normal somewhere (a pole) is kept.
    let Some(normals) = normals else { return false };
    let angle = |a: &Vec3, b: &Vec3| a.cross(b).norm().atan2(a.dot(b));
    let mut between: f64 = 0.0;
    for k in 0..normals.len() {
        for next in [k + 1, k + N + 1] {
            if next < normals.len() && (next != k + 1 || next % (N + 1) != 0) {
                between = between.max(angle(&normals[k], &normals[next]));
            }
        }
    }
    let limit = std::f64::consts::FRAC_PI_2 + AWAY_DEG.to_radians() + between;
    normals.iter().all(|n| angle(n, side) > limit)
}

#[cfg(test)]
mod tests;
