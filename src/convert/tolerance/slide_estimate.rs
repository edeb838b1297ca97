//! What moving its vertices will take off the error of a face that is judged alone: the ways its vertices have beside
//! the faces around it, and the error after the shifts that are best for it.

use crate::audit::Audit;
use crate::cad::Model;
use crate::convert::{ConvertError, ConvertOptions};
use crate::geometry::{Vec2, Vec3};
use crate::mesh::mapped::{is_crease, is_flat};
use crate::tool::ToolModel;
use crate::tool::side::{SideCurve, sides_used_once};

use super::balance::rows;
use super::minimax::{least_shifts, left};
use super::vertex_directions::{STEEPEST, Way};

/// Share of the error that slides leave at best: what is foreseen is linear, and they are not.
const LEAST: f64 = 0.2;
/// Patches of a face from which on half of its error is foreseen without looking.
const MANY: usize = 100;
/// Slides, over the length of the sides beside a border.
const SLIDE: f64 = 0.3;

/// The faces of a model as neighbours.
pub(super) struct Neighbours {
    /// For each face its normal, if it is flat.
    flats: Vec<Option<Vec3>>,
    /// For each edge its faces, and whether they meet at an angle.
    edges: Vec<(Vec<usize>, bool)>,
}

/// What the borders at a vertex ask of it.
#[derive(Default)]
struct Asked {
    /// Flats that run on smoothly: their normals, and the vertex at the other end of the side.
    smooth: Vec<(Vec3, u32)>,
    /// Flats met at an angle.
    walls: Vec<Vec3>,
    /// Curved faces met at an angle.
    held: bool,
}

impl Neighbours {
    pub fn new(model: &Model) -> Self {
        let normal = |k: usize| {
            let face = &model.faces[k];
            is_flat(face).then(|| face.normal(middle(model, k))).flatten()
        };
        let edge = |e: &crate::cad::model::Edge| {
            (e.uses.iter().map(|u| u[0]).collect(), is_crease(model, e))
        };
        Self {
            flats: (0..model.faces.len()).map(normal).collect(),
            edges: model.edges.iter().map(edge).collect(),
        }
    }

    /// True when a flat somewhere runs on smoothly into a curved face.
    pub fn slides(&self) -> bool {
        self.edges.iter().any(|(faces, crease)| {
            let flat = |f: &usize| self.flats[*f].is_some();
            !crease && faces.iter().any(flat) && !faces.iter().all(flat)
        })
    }

    /// The error that is left of `found`, the audit of the patches of face `f`, whose sides are on the edges that `edge` says [mm].
    pub fn foreseen(
        &self,
        f: usize,
        (tool, found): (&ToolModel, &Audit),
        options: &ConvertOptions,
        edge: impl Fn(&SideCurve<'_>) -> Option<usize>,
    ) -> Result<f64, ConvertError> {
        let error = found.report.worst_mm();
        if self.flats[f].is_some() || error <= 0.0 {
            return Ok(error);
        }
        if tool.patches.len() > MANY {
            return Ok(0.5 * error);
        }
        let ways = ways(tool, &self.asked(f, tool, edge));
        let rows = rows(tool, &found.samples, &ways, options)?;
        let none = vec![0.0; ways.len()];
        let shifts = least_shifts(&rows, &none, &ways);
        let share = left(&rows, &shifts) / left(&rows, &none).max(f64::MIN_POSITIVE);
        Ok(error * share.clamp(LEAST, 1.0))
    }

    /// What the borders of a face ask of its vertices.
    fn asked(
        &self,
        f: usize,
        tool: &ToolModel,
        edge: impl Fn(&SideCurve<'_>) -> Option<usize>,
    ) -> Vec<Asked> {
        let mut asked: Vec<Asked> = Vec::new();
        asked.resize_with(tool.vertices.len(), Asked::default);
        let rings: Vec<&[u32]> = tool.corners.iter().map(|c| &c.vertices[..]).collect();
        for (sides, (patch, ring)) in
            sides_used_once(&rings).iter().zip(tool.patches.iter().zip(&rings))
        {
            for &side in sides {
                let Some(e) = edge(&SideCurve::new(patch, side)) else { continue };
                let (faces, crease) = &self.edges[e];
                let Some(&other) = faces.iter().find(|&&g| g != f) else { continue };
                let ends = [ring[side], ring[(side + 1) % ring.len()]];
                for (v, w) in [(ends[0], ends[1]), (ends[1], ends[0])] {
                    let at = &mut asked[v as usize];
                    match (self.flats[other], crease) {
                        (Some(n), false) => at.smooth.push((n, w)),
                        (Some(n), true) => at.walls.push(n),
                        (None, true) => at.held = true,
                        (None, false) => {}
                    }
                }
            }
        }
        asked
    }
}

/// Lists the directions of the vertices of a face alone, each vertex once.
fn ways(tool: &ToolModel, asked: &[Asked]) -> Vec<Way> {
    let mut ways = Vec::new();
    let mut done = vec![false; tool.vertices.len()];
    for corners in &tool.corners {
        for (k, (&v, &n)) in corners.vertices.iter().zip(&corners.normals).enumerate() {
            if std::mem::replace(&mut done[v as usize], true) {
                continue;
            }
            let normal = tool.normals[n as usize];
            let ring = &corners.vertices;
            let reach = [1, ring.len() - 1].map(|step| {
                let w = ring[(k + step) % ring.len()];
                (tool.vertices[w as usize] - tool.vertices[v as usize]).norm()
            });
            ways.extend(way(tool, v, &asked[v as usize], &normal, reach[0].max(reach[1])));
        }
    }
    ways
}

/// Parameters in the middle of a face's surface.
fn middle(model: &Model, face: usize) -> Vec2 {
    let [u, v] = model.faces[face].surface.domain();
    Vec2::new(0.5 * (u[0] + u[1]), 0.5 * (v[0] + v[1]))
}

fn way(tool: &ToolModel, v: u32, asked: &Asked, normal: &Vec3, reach: f64) -> Option<Way> {
    let vertex = v as usize;
    if asked.held {
        return None;
    }
    if let Some(&(flat, w)) = asked.smooth.first() {
        let along = tool.vertices[w as usize] - tool.vertices[vertex];
        let direction = flat.cross(&along).try_normalize(1e-12)?;
        let stays = asked.walls.iter().all(|n| n.dot(&direction).abs() < 0.1);
        let range = [-SLIDE * reach, SLIDE * reach];
        return stays.then_some(Way { vertex, direction, range, slides: true });
    }
    let within = |rest: Vec3, n: &Vec3| rest - n * n.dot(&rest);
    let rest = asked.walls.iter().fold(*normal, within);
    let range = [f64::NEG_INFINITY, f64::INFINITY];
    (rest.norm() >= STEEPEST).then(|| Way {
        vertex,
        direction: rest.normalize(),
        range,
        slides: false,
    })
}
