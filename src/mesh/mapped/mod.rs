//! The built-in mesher: a conforming mesh of the whole model whose lines run along the borders of its
//! CAD faces.
//!
//! Four-sided faces get a tensor grid of quads on the exact surface, three-sided ones triangles or three
//! blocks of quads, all others a constrained Delaunay triangulation joined to quads. Edges are divided
//! once, so that neighbours share their nodes; how often is agreed over chains of opposite edges
//! ([`divisions`]) from what the curvature asks ([`MappedOptions::arc_divisions`]). Flats get the fewest.

mod bends;
mod bisect;
mod border;
mod bridges;
mod demand;
pub mod divisions;
mod grid;
mod mesher;
mod pairing;
mod patchwork;
pub mod plan;
mod poles;
mod polygon;
mod regions;
mod sample;
mod sides;
#[cfg(test)]
mod tests;
mod trimmed;
mod untangle;

pub use self::demand::{is_crease, is_flat};
use self::mesher::Mesher;
use super::{MeshError, SurfaceMesh};
use crate::cad::Model;
use crate::geometry::Vec3;

/// What kinds of element a mesh is made of.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    Default,
    serde::Serialize,
    serde::Deserialize,
    schemars::JsonSchema,
)]
#[serde(rename_all = "lowercase")]
pub enum MeshStyle {
    /// Quads on four-sided faces, three blocks of quads on curved three-sided ones; elsewhere quads with a
    /// few triangles between.
    #[default]
    Structured,
    /// As structured, with triangles on three-sided faces and wherever two of them join badly.
    Mixed,
    /// Triangles only.
    Triangles,
    /// Quads only (but for triangles at poles).
    Quads,
}

/// Size and style of a mapped mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MappedOptions {
    /// Divisions of a fillet that turns through 90 degrees, 1 to 1000.
    pub arc_divisions: usize,
    /// Longest element side (mm), > 0: faces with longer ones are meshed again; `None` = as long as curvature lets it.
    pub max_size: Option<f64>,
    /// Largest distance of a flat element from the surface (mm) (about), > 0.
    pub chord_error: Option<f64>,
    /// Kinds of element.
    pub style: MeshStyle,
    /// Sides on edges of the CAD will follow these, wherever the normals would have them go: their corners are then never
    /// straight.
    pub through_cad: bool,
    /// Edges that turn very unevenly are divided by that and not into equal lengths.
    pub by_turn: bool,
    /// As few elements as the divisions allow: quads in place of pairs of triangles around poles, flats with holes without
    /// nodes inside.
    pub fewest: bool,
    /// No face is mapped: triangles of about equal size everywhere, joined to quads as the style asks.
    pub unstructured: bool,
}

impl Default for MappedOptions {
    fn default() -> Self {
        Self {
            arc_divisions: 4,
            max_size: None,
            chord_error: None,
            style: MeshStyle::default(),
            through_cad: false,
            by_turn: false,
            fewest: false,
            unstructured: false,
        }
    }
}

/// Meshes every face of `model`.
///
/// # Errors
/// [`MeshError::NoFaces`], [`MeshError::Option`]; [`MeshError::Faces`] names the first of the faces whose
/// border bounds no region even when it is made finer.
pub fn mesh(model: &Model, options: &MappedOptions) -> Result<SurfaceMesh, MeshError> {
    check_options(options)?;
    if model.faces.is_empty() {
        return Err(MeshError::NoFaces { name: model.name.clone() });
    }
    if options.style != MeshStyle::Quads {
        return Mesher::new(model, options, false).run();
    }
    let structured = MappedOptions { style: MeshStyle::Structured, ..*options };
    if let Some(mesh) = even_quads(model, &structured) {
        return Ok(mesh);
    }
    Mesher::new(model, &structured, true).run()
}

/// Quads without halving: all faces mapped but for flats, whose borders are divided until they can be cut into quads.
fn even_quads(model: &Model, options: &MappedOptions) -> Option<SurfaceMesh> {
    if options.unstructured {
        return None;
    }
    let mut mesher = Mesher::new(model, options, false);
    mesher.even_flats = true;
    let mesh = mesher.run().ok()?;
    mesh.elements.iter().all(|e| e.nodes().len() == 4).then_some(mesh)
}

fn check_options(options: &MappedOptions) -> Result<(), MeshError> {
    if !(1..=1000).contains(&options.arc_divisions) {
        let found = options.arc_divisions.to_string();
        return Err(MeshError::Option { option: "--arc-divisions", found, allowed: "1 to 1000" });
    }
    for (option, value) in
        [("--max-size", options.max_size), ("--chord-error", options.chord_error)]
    {
        if let Some(v) = value.filter(|v| !(v.is_finite() && *v > 0.0)) {
            let allowed = "a length in mm above zero";
            return Err(MeshError::Option { option, found: v.to_string(), allowed });
        }
    }
    Ok(())
}

/// Corner normal test shared by the checks: signed sine of the corner at `at` against `normal`.
pub(super) fn corner_sine(before: &Vec3, at: &Vec3, after: &Vec3, normal: &Vec3) -> f64 {
    sine(&(after - at), &(before - at), normal)
}

/// Signed sine of the corner from the side `out` to the side `back` against `normal`; -1 where one of them is zero.
fn sine(out: &Vec3, back: &Vec3, normal: &Vec3) -> f64 {
    let scale = out.norm() * back.norm() * normal.norm();
    if scale > 0.0 { out.cross(back).dot(normal) / scale } else { -1.0 }
}
