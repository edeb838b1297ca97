//! Estimate of the error of a face after the vertex motion, for a face evaluated alone. The directions of its vertices
//! follow from the adjacent faces; the shifts are optimal for this face.

use crate::{ConvertError, ConvertOptions};
use kanagata_audit::Audit;
use kanagata_cad::Model;
use kanagata_geometry::{Vec2, Vec3};
use kanagata_mesh::mapped::{is_crease, is_flat};
use kanagata_tool::ToolModel;
use kanagata_tool::side::{SideCurve, side_ends, sides_used_once};

use super::balance::error_rows;
use super::minimax::{largest_error, minimax_shifts};
use super::vertex_directions::{CREASE_SINE_MIN, VertexDirection};

/// Minimum ratio of the estimated error to the error before the motion. The estimate is linear, but slides are not.
const ERROR_RATIO_MIN: f64 = 0.2;
/// Number of patches of a face above which half of its error is assumed without a computation.
const COMPUTED_PATCHES_MAX: usize = 100;
/// Maximum slide, over the length of the longer side at the vertex.
const SLIDE_RATIO_MAX: f64 = 0.3;

/// Adjacency of the faces of a model.
pub(super) struct Neighbours {
    /// For each face its normal, if flat.
    flats: Vec<Option<Vec3>>,
    /// For each edge its faces, and true when they meet at an angle.
    edges: Vec<(Vec<usize>, bool)>,
}

/// Adjacent faces at the borders that meet in a vertex.
#[derive(Default)]
struct VertexBorders {
    /// Flats that continue the face smoothly: normal, and the vertex at the other end of the side.
    smooth: Vec<(Vec3, u32)>,
    /// Normals of flats that meet the face at an angle.
    walls: Vec<Vec3>,
    /// True when a curved face meets the face at an angle: the vertex is fixed.
    fixed: bool,
}

impl Neighbours {
    /// Determines the adjacency of all faces.
    pub fn new(model: &Model) -> Self {
        let normal = |k: usize| {
            let face = &model.faces[k];
            is_flat(face).then(|| face.normal(surface_centre(model, k))).flatten()
        };
        let edge = |e: &kanagata_cad::model::Edge| {
            (e.uses.iter().map(|u| u[0]).collect(), is_crease(model, e))
        };
        Self {
            flats: (0..model.faces.len()).map(normal).collect(),
            edges: model.edges.iter().map(edge).collect(),
        }
    }

    /// True when the model has a smooth edge between a flat and a curved face, along which vertices can slide.
    pub fn allow_slides(&self) -> bool {
        self.edges.iter().any(|(faces, crease)| {
            let flat = |f: &usize| self.flats[*f].is_some();
            !crease && faces.iter().any(flat) && !faces.iter().all(flat)
        })
    }

    /// Estimated shape error of face `f` after the vertex motion [mm], from the audit `found` of its patches. `edge`
    /// gives the edge of a patch side with its two vertices.
    ///
    /// # Errors
    /// [`ConvertError`] when a shifted model cannot be built.
    pub fn estimate_error(
        &self,
        f: usize,
        (tool, found): (&ToolModel, &Audit),
        options: &ConvertOptions,
        edge: impl Fn(&SideCurve<'_>, [u32; 2]) -> Option<usize>,
    ) -> Result<f64, ConvertError> {
        let error = found.report.worst_mm();
        if self.flats[f].is_some() || error <= 0.0 {
            return Ok(error);
        }
        if tool.patches.len() > COMPUTED_PATCHES_MAX {
            return Ok(0.5 * error);
        }
        let directions = vertex_directions(tool, &self.vertex_borders(f, tool, edge));
        let rows = error_rows(tool, &found.samples, &directions, options)?;
        let none = vec![0.0; directions.len()];
        let shifts = minimax_shifts(&rows, &none, &directions);
        let before = largest_error(&rows, &none).max(f64::MIN_POSITIVE);
        Ok(error * (largest_error(&rows, &shifts) / before).clamp(ERROR_RATIO_MIN, 1.0))
    }

    /// Adjacent faces at the vertices of face `f`.
    fn vertex_borders(
        &self,
        f: usize,
        tool: &ToolModel,
        edge: impl Fn(&SideCurve<'_>, [u32; 2]) -> Option<usize>,
    ) -> Vec<VertexBorders> {
        let mut borders: Vec<VertexBorders> = Vec::new();
        borders.resize_with(tool.vertices.len(), VertexBorders::default);
        let rings: Vec<&[u32]> = tool.corners.iter().map(|c| &c.vertices[..]).collect();
        for (sides, (patch, ring)) in
            sides_used_once(&rings).iter().zip(tool.patches.iter().zip(&rings))
        {
            for &side in sides {
                let ends = side_ends(ring, side);
                let Some(e) = edge(&SideCurve::new(patch, side), ends) else { continue };
                let (faces, crease) = &self.edges[e];
                let Some(&other) = faces.iter().find(|&&g| g != f) else { continue };
                for (v, w) in [(ends[0], ends[1]), (ends[1], ends[0])] {
                    let at = &mut borders[v as usize];
                    match (self.flats[other], crease) {
                        (Some(n), false) => at.smooth.push((n, w)),
                        (Some(n), true) => at.walls.push(n),
                        (None, true) => at.fixed = true,
                        (None, false) => {}
                    }
                }
            }
        }
        borders
    }
}

/// Directions of the vertices of a single face, at most one for each.
fn vertex_directions(tool: &ToolModel, borders: &[VertexBorders]) -> Vec<VertexDirection> {
    let mut directions = Vec::new();
    let mut done = vec![false; tool.vertices.len()];
    for corners in &tool.corners {
        for (k, (&v, &n)) in corners.vertices.iter().zip(&corners.normals).enumerate() {
            if std::mem::replace(&mut done[v as usize], true) {
                continue;
            }
            let normal = tool.normals[n as usize];
            let ring = &corners.vertices;
            let lengths = [1, ring.len() - 1].map(|step| {
                let w = ring[(k + step) % ring.len()];
                (tool.vertices[w as usize] - tool.vertices[v as usize]).norm()
            });
            let longest = lengths[0].max(lengths[1]);
            directions.extend(vertex_direction(tool, v, &borders[v as usize], &normal, longest));
        }
    }
    directions
}

/// Centre of the parameter rectangle of a face.
fn surface_centre(model: &Model, face: usize) -> Vec2 {
    let [u, v] = model.faces[face].surface.domain();
    Vec2::new(0.5 * (u[0] + u[1]), 0.5 * (v[0] + v[1]))
}

/// Direction of vertex `v` of a single face with the normal `normal`. `length` is that of its longer side [mm]. `None`
/// when the borders fix the vertex.
fn vertex_direction(
    tool: &ToolModel,
    v: u32,
    borders: &VertexBorders,
    normal: &Vec3,
    length: f64,
) -> Option<VertexDirection> {
    let vertex = v as usize;
    if borders.fixed {
        return None;
    }
    if let Some(&(flat, w)) = borders.smooth.first() {
        let along = tool.vertices[w as usize] - tool.vertices[vertex];
        let vector = flat.cross(&along).try_normalize(1e-12)?;
        let stays = borders.walls.iter().all(|n| n.dot(&vector).abs() < 0.1);
        let range = [-SLIDE_RATIO_MAX * length, SLIDE_RATIO_MAX * length];
        return stays.then_some(VertexDirection { vertex, vector, range, slides: true });
    }
    let within = |rest: Vec3, n: &Vec3| rest - n * n.dot(&rest);
    let rest = borders.walls.iter().fold(*normal, within);
    let range = [f64::NEG_INFINITY, f64::INFINITY];
    (rest.norm() >= CREASE_SINE_MIN).then(|| VertexDirection {
        vertex,
        vector: rest.normalize(),
        range,
        slides: false,
    })
}
