//! Where vertices may move so that the errors of the patches around them get two sides: off the CAD along the normal of
//! their curved faces (on a crease with a flat: within it), or, where a flat runs on smoothly into a curved face, within the
//! flat, away from that face. Flats stay exactly flat.

use crate::cad::Model;
use crate::geometry::Vec3;
use crate::mesh::mapped::is_flat;
use crate::tool::ToolModel;
use crate::tool::side::SideCurve;

/// Least sine of the angle between a curved face and a flat on whose crease a vertex moves.
pub(super) const STEEPEST: f64 = 0.5;
/// Sine of the angle below which a curved face is the smooth continuation of a flat.
const SMOOTH: f64 = 2e-3;
/// Share of the way to the flat's next vertices that a vertex may slide.
const SHARE: f64 = 0.35;
/// Cosine of the angle between a flat's borders at a vertex from which on they are one smooth border.
const ONE_BORDER: f64 = 0.9;

/// Where a vertex may move; at a corner of a flat it has two ways.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Way {
    /// The vertex.
    pub vertex: usize,
    /// Movement for a shift of one.
    pub direction: Vec3,
    /// Least and largest shift [mm].
    pub range: [f64; 2],
    /// It moves within a flat, and so stays on the CAD.
    pub slides: bool,
}

/// A model and which of its faces are flat, with the patches around each vertex.
struct Around<'a> {
    tool: &'a ToolModel,
    /// For each patch.
    flat: Vec<bool>,
    /// For each vertex its patches, and which corner of each it is.
    patches: Vec<Vec<(usize, usize)>>,
}

/// What faces ask of a vertex: normals of flats around it, and that of its curved faces.
#[derive(Default)]
struct Asked {
    flats: Vec<Vec3>,
    curved: Option<u32>,
    /// Curved faces meet in a crease.
    several: bool,
}

/// Patches at a vertex of a flat, and which corner of each it is.
#[derive(Default)]
struct Sorted {
    /// Of the flat.
    inside: Vec<(usize, usize)>,
    /// Of curved faces that continue it smoothly.
    outside: Vec<(usize, usize)>,
    /// Of other flats, with their normals.
    walls: Vec<((usize, usize), Vec3)>,
}

/// The ways of the vertices. The model's faces have numbers from `first` on.
pub(super) fn ways(tool: &ToolModel, model: &Model, first: u32) -> Vec<Way> {
    let faces: Vec<bool> = model.faces.iter().map(is_flat).collect();
    let flat = tool.corners.iter().map(|p| faces[(p.face - first) as usize]).collect();
    let mut patches = vec![Vec::new(); tool.vertices.len()];
    for (k, p) in tool.corners.iter().enumerate() {
        let corners = p.vertices.iter().enumerate();
        corners.for_each(|(corner, &v)| patches[v as usize].push((k, corner)));
    }
    let around = Around { tool, flat, patches };
    (0..tool.vertices.len()).flat_map(|v| around.ways(v)).collect()
}

impl Around<'_> {
    fn asked(&self, v: usize) -> Asked {
        let mut asked = Asked::default();
        for &(k, corner) in &self.patches[v] {
            let n = self.tool.corners[k].normals[corner];
            if self.flat[k] {
                asked.flats.push(self.tool.normals[n as usize]);
            } else {
                asked.several |= *asked.curved.get_or_insert(n) != n;
            }
        }
        asked
    }

    fn ways(&self, vertex: usize) -> Vec<Way> {
        let asked = self.asked(vertex);
        let curved = asked.curved.filter(|_| !asked.several);
        let Some(normal) = curved.map(|n| self.tool.normals[n as usize]) else {
            return Vec::new();
        };
        let mut flats: Vec<Vec3> = Vec::new();
        for n in &asked.flats {
            let rest = flats.iter().fold(*n, |rest, f| rest - f * f.dot(&rest));
            // Flats that are nearly one leave a direction that rounding picks.
            if rest.norm() > 1e-3 {
                flats.push(rest.normalize());
            }
        }
        let rest = flats.iter().fold(normal, |rest, f| rest - f * f.dot(&rest));
        if rest.norm() >= STEEPEST {
            let range = [f64::NEG_INFINITY, f64::INFINITY];
            return vec![Way { vertex, direction: rest.normalize(), range, slides: false }];
        }
        self.slides(vertex, &normal).unwrap_or_default()
    }

    /// The ways within the flat of normal `normal` on whose smooth border with curved faces the vertex is.
    fn slides(&self, v: usize, normal: &Vec3) -> Option<Vec<Way>> {
        let Sorted { inside, outside, walls } = self.sorted(v, normal)?;
        let reached = |patches: &[(usize, usize)]| -> Vec<u32> {
            patches.iter().flat_map(|&at| self.beside(at)).collect()
        };
        let (within, beyond) = (reached(&inside), reached(&outside));
        let mut border: Vec<u32> = within.iter().filter(|w| beyond.contains(w)).copied().collect();
        border.sort_unstable();
        border.dedup();
        let inwards: Option<Vec<Vec3>> =
            border.iter().map(|&w| self.inwards(v, w, normal, &inside)).collect();
        let at_wall = reached(&walls.iter().map(|w| w.0).collect::<Vec<_>>());
        // Where the flat ends: sides of one patch alone, or of a wall.
        let ends = |w: &&u32| {
            let users = within.iter().chain(&beyond).chain(&at_wall).filter(|u| u == w).count();
            users == 1 || at_wall.contains(w)
        };
        let mut ended: Vec<u32> = within.iter().filter(ends).copied().collect();
        ended.sort_unstable();
        ended.dedup();
        let directions = match (&inwards?[..], &ended[..]) {
            ([a, b], []) if walls.is_empty() => across(a, b),
            ([a], [w]) => {
                let along = self.straight(v, *w, &inside)?;
                let stays = walls.iter().all(|(_, n)| n.dot(&along).abs() < 1e-9);
                (stays && along.dot(a) > 0.5).then(|| vec![along / along.dot(a)])?
            }
            _ => return None,
        };
        let way = |direction: &Vec3| {
            let most = SHARE * self.room(v, direction, &inside, &border)?;
            Some(Way { vertex: v, direction: *direction, range: [-most, most], slides: true })
        };
        Some(directions.iter().filter_map(way).collect())
    }

    /// Sorts the patches at a vertex by how they meet the flat of normal `normal`; `None` where a curved one meets it at an
    /// angle.
    fn sorted(&self, v: usize, normal: &Vec3) -> Option<Sorted> {
        let smooth = |n: &Vec3| n.cross(normal).norm() < SMOOTH && n.dot(normal) > 0.0;
        let mut sorted = Sorted::default();
        for &(k, corner) in &self.patches[v] {
            let n = self.tool.normals[self.tool.corners[k].normals[corner] as usize];
            match (self.flat[k], smooth(&n)) {
                (true, true) => sorted.inside.push((k, corner)),
                (true, false) => sorted.walls.push(((k, corner), n)),
                (false, true) => sorted.outside.push((k, corner)),
                (false, false) => return None,
            }
        }
        Some(sorted)
    }

    /// The vertices beside a corner of a patch.
    fn beside(&self, (k, corner): (usize, usize)) -> [u32; 2] {
        let ring = &self.tool.corners[k].vertices;
        [ring[(corner + 1) % ring.len()], ring[(corner + ring.len() - 1) % ring.len()]]
    }

    fn point(&self, v: u32) -> Vec3 {
        self.tool.vertices[v as usize]
    }

    /// The side from `v` to `w` of one of the patches: points on it, from `v` on.
    fn side(
        &self,
        v: usize,
        w: u32,
        inside: &[(usize, usize)],
    ) -> Option<impl Fn(f64) -> Vec3 + '_> {
        let &(k, corner) = inside.iter().find(|&&at| self.beside(at).contains(&w))?;
        let count = self.tool.corners[k].vertices.len();
        let ahead = self.beside((k, corner))[0] == w;
        debug_assert_eq!(self.tool.corners[k].vertices[corner] as usize, v);
        let side = if ahead { corner } else { (corner + count - 1) % count };
        let curve = SideCurve::new(&self.tool.patches[k], side);
        Some(move |t: f64| curve.point(if ahead { t } else { 1.0 - t }))
    }

    /// Unit vector in the flat across its border from `v` to `w`, into it: patches lie to the left of their sides.
    fn inwards(&self, v: usize, w: u32, normal: &Vec3, inside: &[(usize, usize)]) -> Option<Vec3> {
        let beginning = self.side(v, w, inside)?(1e-4) - self.tool.vertices[v];
        let left = normal.cross(&beginning).try_normalize(1e-12)?;
        let &at = inside.iter().find(|&&at| self.beside(at).contains(&w))?;
        let (eta, zeta) =
            if self.tool.corners[at.0].vertices.len() == 3 { (0.6, 0.3) } else { (0.5, 0.5) };
        let outwards = self.tool.patches[at.0].normal(eta, zeta)?.dot(normal) > 0.0;
        Some(if (self.beside(at)[0] == w) == outwards { left } else { -left })
    }

    /// Direction from `v` to `w` where the side between them is straight.
    fn straight(&self, v: usize, w: u32, inside: &[(usize, usize)]) -> Option<Vec3> {
        let chord = self.point(w) - self.tool.vertices[v];
        let off = self.side(v, w, inside)?(0.5) - (self.tool.vertices[v] + 0.5 * chord);
        (off.norm() < 1e-9 * chord.norm()).then(|| chord.try_normalize(1e-12)).flatten()
    }

    /// Shift at which the nearest other vertex of the flat's patches is reached, if one lies that way.
    fn room(
        &self,
        v: usize,
        along: &Vec3,
        inside: &[(usize, usize)],
        border: &[u32],
    ) -> Option<f64> {
        let corners = inside.iter().flat_map(|&(k, _)| &self.tool.corners[k].vertices);
        let others = corners.filter(|w| **w as usize != v && !border.contains(w));
        let ahead = others
            .map(|&w| (self.point(w) - self.tool.vertices[v]).dot(along) / along.norm_squared());
        ahead.filter(|&depth| depth > 1e-9).min_by(f64::total_cmp)
    }
}

/// Ways at a vertex between two borders of a flat, given the unit vectors across these into it: a shift of one is as far from
/// the border it is for, and stays on the other one.
fn across(a: &Vec3, b: &Vec3) -> Vec<Vec3> {
    let cosine = a.dot(b);
    if cosine > ONE_BORDER {
        return vec![(a + b) / (1.0 + cosine)];
    }
    let sine = 1.0 - cosine * cosine;
    if cosine < -0.5 {
        return Vec::new();
    }
    vec![(a - b * cosine) / sine, (b - a * cosine) / sine]
}
