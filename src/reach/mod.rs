//! Tool faces that the sheet of a scene can touch. Unreachable faces may be excluded from the tool model.
//!
//! The initial position of the sheet and the travels of the tools are known before a run. A face is excluded only when
//! one of three conditions holds over the whole of it:
//!
//! - **beside**: in projection along the tool direction it lies outside the box of the blank. The box is widened by the
//!   larger of twice the thickness and 5 % of the blank diagonal, and by all travels across the tool direction.
//! - **behind**: it lies farther behind the front of the tool than the sum of all travels plus twice the thickness. The
//!   front is the foremost point over the blank, which touches the flat sheet first.
//! - **away**: every normal points away from the sheet by more than 5 degrees beyond a right angle. All tools and loads
//!   act along the tool direction. The sheet would have to wrap around the tool. A cam acting from the side may press a
//!   flange against such a face.
//!
//! Travels are summed regardless of their directions. A tool driven by force is assumed to follow the sheet by at most
//! the sum of all travels. In a scene without travels, or with loads on the sheet, the depth is unknown and no face is
//! 'behind'.

mod zone;

use kanagata_cad::Model;
use kanagata_cad::model::Face;
use kanagata_convert::part::subset;
use kanagata_geometry::{Vec2, Vec3};
use kanagata_mesh::MeshError;
use kanagata_mesh::mapped::{MappedOptions, mesh};

pub use zone::Zone;

/// Angle between normal and sheet direction, beyond a right angle, above which a normal points away [degrees].
const AWAY_ANGLE_MIN_DEG: f64 = 5.0;

/// Reason why a face is excluded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Why {
    /// Outside the projection of the sheet.
    Beside,
    /// Farther behind the front of the tool than the sheet can be drawn.
    Behind,
    /// Normals point away from the sheet.
    Away,
}

/// Errors of the selection of reachable faces.
#[derive(Debug, thiserror::Error)]
pub enum ReachError {
    /// The tool is not in the scene.
    #[error("no tool of the scene has the file '{file}' or the name '{name}'; allowed: {allowed}")]
    NoTool {
        /// Name of the output file.
        file: String,
        /// Name of the tool.
        name: String,
        /// Tools of the scene.
        allowed: String,
    },
    /// All faces are unreachable.
    #[error(
        "the sheet reaches none of the {faces} faces; allowed: at least one; check the direction and place of the tool and the blank in the scene, or convert the whole model"
    )]
    Nothing {
        /// Number of faces of the model.
        faces: usize,
    },
    /// The mesh file of the blank cannot be read.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// A model without its unreachable faces.
#[derive(Debug, Clone)]
pub struct Reached {
    /// The reachable faces, renumbered.
    pub model: Model,
    /// Number of each of these faces in the complete model.
    pub kept: Vec<usize>,
    /// Excluded faces and the reason for each.
    pub left_out: Vec<(usize, Why)>,
    /// True when the complete model points away from the sheet and must be reversed.
    pub turned: bool,
}

/// Excludes the faces of `model` that the sheet cannot touch. `side` is the direction towards the sheet, by default the
/// tool direction. With `flip` the model is reversed after that where `side` is given; one that already looks along the tool
/// direction has nothing to reverse.
///
/// # Errors
/// [`ReachError::Nothing`] when no face remains.
pub fn within_reach(
    model: &Model,
    zone: &Zone,
    side: Option<Vec3>,
    flip: bool,
) -> Result<Reached, ReachError> {
    let coarse = MappedOptions { arc_divisions: 2, ..MappedOptions::default() };
    let mesh = mesh(model, &coarse).ok();
    let away = |m| kanagata_convert::faces_away(m, Some(side.unwrap_or(zone.direction())));
    let turned = mesh.as_ref().is_some_and(away) ^ (flip && side.is_some());
    // Vertices of the coarse mesh lie on the tool: the foremost one over the blank is not ahead of the exact front.
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
        match exclusion_reason(face, zone, front, turned, near) {
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

/// The condition that excludes a face, if any. `front` is the coordinate of the tool front along its direction and
/// `near` a margin [mm].
fn exclusion_reason(face: &Face, zone: &Zone, front: f64, turned: bool, near: f64) -> Option<Why> {
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
        && points_away(face, &(zone.axes[2] * if turned { -1.0 } else { 1.0 }))
    {
        Some(Why::Away)
    } else {
        None
    }
}

/// True when all normals of the surface, over its domain, point away from `side`. The normals are sampled at 13 x 13
/// points. The largest angle between adjacent samples is added to the limit, as a bound on the variation between them.
fn points_away(face: &Face, side: &Vec3) -> bool {
    const N: usize = 12;
    let [[u0, u1], [v0, v1]] = face.surface.domain();
    let at = |k: usize| {
        let (i, j) = ((k / (N + 1)) as f64 / N as f64, (k % (N + 1)) as f64 / N as f64);
        face.normal(Vec2::new(u0 + (u1 - u0) * i, v0 + (v1 - v0) * j))
    };
    let normals: Option<Vec<Vec3>> = (0..(N + 1) * (N + 1)).map(at).collect();
    // A surface without a normal at a sample (pole) is kept.
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
    let limit = std::f64::consts::FRAC_PI_2 + AWAY_ANGLE_MIN_DEG.to_radians() + between;
    normals.iter().all(|n| angle(n, side) > limit)
}

#[cfg(test)]
mod tests;
