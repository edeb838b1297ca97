//! Directions in which vertices move so that the errors of adjacent patches have both signs.
//!
//! - Vertex of curved faces: the normal of these faces, off the CAD.
//! - Crease with a flat: the component of that normal within the flat.
//! - Smooth border of a flat with a curved face: within the flat, across the border.
//!
//! Flats stay exactly flat.

use kanagata_cad::Model;
use kanagata_geometry::Vec3;
use kanagata_mesh::mapped::is_flat;
use kanagata_tool::ToolModel;
use kanagata_tool::side::SideCurve;

/// Minimum sine of the angle between a curved face and a flat for a vertex on their crease to move. A unit shift
/// changes the error by this sine.
pub(super) const CREASE_SINE_MIN: f64 = 0.5;
/// Sine of the angle between the normals below which a curved face continues a flat smoothly.
const SMOOTH_SINE_MAX: f64 = 2e-3;
/// Maximum slide over the distance to the nearest vertex of the flat in that direction.
const SLIDE_RATIO_MAX: f64 = 0.35;
/// Cosine of the angle between a slide and the way to a vertex above which that vertex limits the slide. Below, it is beside the
/// way, as the image of the vertex at a symmetry plane through the border; rounding does not decide. With 0.1, a panel of 320
/// faces takes 3 % more patches.
const AHEAD_COSINE_MIN: f64 = 0.02;
/// Cosine of the angle between the inward directions of two borders of a flat above which they form one smooth border.
const SMOOTH_BORDER_COSINE_MIN: f64 = 0.9;

/// A direction in which a vertex may move. A vertex at a corner of a flat has two.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct VertexDirection {
    /// Number of the vertex.
    pub vertex: usize,
    /// Displacement for a unit shift.
    pub vector: Vec3,
    /// Minimum and maximum shift [mm].
    pub range: [f64; 2],
    /// True for a slide: the vertex moves within a flat and stays on the CAD.
    pub slides: bool,
}

/// A tool model with the patches around each vertex.
struct VertexPatches<'a> {
    tool: &'a ToolModel,
    /// For each patch, true when its face is flat.
    flat: Vec<bool>,
    /// For each vertex its patches and the corner of each.
    patches: Vec<Vec<(usize, usize)>>,
}

/// Normals at a vertex.
#[derive(Default)]
struct VertexNormals {
    /// Normals of adjacent flats.
    flats: Vec<Vec3>,
    /// Index of the normal of adjacent curved faces.
    curved: Option<u32>,
    /// True when curved faces meet in a crease at the vertex.
    several: bool,
}

/// Patches at a vertex of a flat and the corner of each, by face.
#[derive(Default)]
struct SortedPatches {
    /// Patches of the flat.
    inside: Vec<(usize, usize)>,
    /// Patches of curved faces that continue the flat smoothly.
    outside: Vec<(usize, usize)>,
    /// Patches of other flats, with their normals.
    walls: Vec<((usize, usize), Vec3)>,
}

/// Directions of all vertices. The faces of `model` have the numbers from `first` in the tool.
pub(super) fn vertex_directions(
    tool: &ToolModel,
    model: &Model,
    first: u32,
) -> Vec<VertexDirection> {
    let faces: Vec<bool> = model.faces.iter().map(is_flat).collect();
    let flat = tool.corners.iter().map(|p| faces[(p.face - first) as usize]).collect();
    let mut patches = vec![Vec::new(); tool.vertices.len()];
    for (k, p) in tool.corners.iter().enumerate() {
        let corners = p.vertices.iter().enumerate();
        corners.for_each(|(corner, &v)| patches[v as usize].push((k, corner)));
    }
    let all = VertexPatches { tool, flat, patches };
    (0..tool.vertices.len()).flat_map(|v| all.directions(v)).collect()
}

impl VertexPatches<'_> {
    /// Normals of the faces at vertex `v`.
    fn normals(&self, v: usize) -> VertexNormals {
        let mut normals = VertexNormals::default();
        for &(k, corner) in &self.patches[v] {
            let n = self.tool.corners[k].normals[corner];
            if self.flat[k] {
                normals.flats.push(self.tool.normals[n as usize]);
            } else {
                normals.several |= *normals.curved.get_or_insert(n) != n;
            }
        }
        normals
    }

    /// Directions of a vertex; none at flats only, at creases between curved faces, and at creases of a small angle.
    fn directions(&self, vertex: usize) -> Vec<VertexDirection> {
        let normals = self.normals(vertex);
        let curved = normals.curved.filter(|_| !normals.several);
        let Some(normal) = curved.map(|n| self.tool.normals[n as usize]) else {
            return Vec::new();
        };
        let mut flats: Vec<Vec3> = Vec::new();
        for n in &normals.flats {
            let rest = flats.iter().fold(*n, |rest, f| rest - f * f.dot(&rest));
            // For nearly equal normals the remainder is rounding.
            if rest.norm() > 1e-3 {
                flats.push(rest.normalize());
            }
        }
        let rest = flats.iter().fold(normal, |rest, f| rest - f * f.dot(&rest));
        if rest.norm() >= CREASE_SINE_MIN {
            let range = [f64::NEG_INFINITY, f64::INFINITY];
            let vector = rest.normalize();
            return vec![VertexDirection { vertex, vector, range, slides: false }];
        }
        self.slide_directions(vertex, &normal).unwrap_or_default()
    }

    /// Slide directions of vertex `v` on the smooth border between the flat with normal `normal` and curved faces.
    /// `None` when the borders at the vertex do not leave such a direction.
    fn slide_directions(&self, v: usize, normal: &Vec3) -> Option<Vec<VertexDirection>> {
        let SortedPatches { inside, outside, walls } = self.sort_patches(v, normal)?;
        let reached = |patches: &[(usize, usize)]| -> Vec<u32> {
            patches.iter().flat_map(|&at| self.neighbours(at)).collect()
        };
        let (within, beyond) = (reached(&inside), reached(&outside));
        let mut border: Vec<u32> = within.iter().filter(|w| beyond.contains(w)).copied().collect();
        border.sort_unstable();
        border.dedup();
        let inwards: Option<Vec<Vec3>> =
            border.iter().map(|&w| self.inward_direction(v, w, normal, &inside)).collect();
        let at_wall = reached(&walls.iter().map(|w| w.0).collect::<Vec<_>>());
        // The flat ends at sides of a single patch and at sides shared with another flat.
        let ends = |w: &&u32| {
            let users = within.iter().chain(&beyond).chain(&at_wall).filter(|u| u == w).count();
            users == 1 || at_wall.contains(w)
        };
        let mut ended: Vec<u32> = within.iter().filter(ends).copied().collect();
        ended.sort_unstable();
        ended.dedup();
        let vectors = match (&inwards?[..], &ended[..]) {
            ([a, b], []) if walls.is_empty() => corner_vectors(a, b),
            ([a], [w]) => {
                let along = self.straight_direction(v, *w, &inside)?;
                let stays = walls.iter().all(|(_, n)| n.dot(&along).abs() < 1e-9);
                (stays && along.dot(a) > 0.5).then(|| vec![along / along.dot(a)])?
            }
            _ => return None,
        };
        let direction = |vector: &Vec3| {
            let limit = SLIDE_RATIO_MAX * self.shift_to_vertex(v, vector, &inside, &border)?;
            let range = [-limit, limit];
            Some(VertexDirection { vertex: v, vector: *vector, range, slides: true })
        };
        Some(vectors.iter().filter_map(direction).collect())
    }

    /// Sorts the patches at vertex `v` relative to the flat with normal `normal`. `None` when a curved face meets the
    /// flat at an angle.
    fn sort_patches(&self, v: usize, normal: &Vec3) -> Option<SortedPatches> {
        let smooth = |n: &Vec3| n.cross(normal).norm() < SMOOTH_SINE_MAX && n.dot(normal) > 0.0;
        let mut sorted = SortedPatches::default();
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

    /// Vertices adjacent to a corner of a patch, the next and the previous one.
    fn neighbours(&self, (k, corner): (usize, usize)) -> [u32; 2] {
        let ring = &self.tool.corners[k].vertices;
        [ring[(corner + 1) % ring.len()], ring[(corner + ring.len() - 1) % ring.len()]]
    }

    /// Position of a vertex [mm].
    fn point(&self, v: u32) -> Vec3 {
        self.tool.vertices[v as usize]
    }

    /// The side from `v` to `w` of one of the patches, as a curve over [0, 1].
    fn side_curve(
        &self,
        v: usize,
        w: u32,
        inside: &[(usize, usize)],
    ) -> Option<impl Fn(f64) -> Vec3 + '_> {
        let &(k, corner) = inside.iter().find(|&&at| self.neighbours(at).contains(&w))?;
        let count = self.tool.corners[k].vertices.len();
        let ahead = self.neighbours((k, corner))[0] == w;
        debug_assert_eq!(self.tool.corners[k].vertices[corner] as usize, v);
        let side = if ahead { corner } else { (corner + count - 1) % count };
        let curve = SideCurve::new(&self.tool.patches[k], side);
        Some(move |t: f64| curve.point(if ahead { t } else { 1.0 - t }))
    }

    /// Unit vector within the flat, perpendicular to its border from `v` to `w` at `v`, into the flat. A patch lies to
    /// the left of its sides.
    fn inward_direction(
        &self,
        v: usize,
        w: u32,
        normal: &Vec3,
        inside: &[(usize, usize)],
    ) -> Option<Vec3> {
        let tangent = self.side_curve(v, w, inside)?(1e-4) - self.tool.vertices[v];
        let left = normal.cross(&tangent).try_normalize(1e-12)?;
        let &at = inside.iter().find(|&&at| self.neighbours(at).contains(&w))?;
        let (eta, zeta) =
            if self.tool.corners[at.0].vertices.len() == 3 { (0.6, 0.3) } else { (0.5, 0.5) };
        let outwards = self.tool.patches[at.0].normal(eta, zeta)?.dot(normal) > 0.0;
        Some(if (self.neighbours(at)[0] == w) == outwards { left } else { -left })
    }

    /// Unit vector from `v` to `w`; `None` when the side between them is curved.
    fn straight_direction(&self, v: usize, w: u32, inside: &[(usize, usize)]) -> Option<Vec3> {
        let chord = self.point(w) - self.tool.vertices[v];
        let sagitta = self.side_curve(v, w, inside)?(0.5) - (self.tool.vertices[v] + 0.5 * chord);
        (sagitta.norm() < 1e-9 * chord.norm()).then(|| chord.try_normalize(1e-12)).flatten()
    }

    /// Shift along `along` up to the nearest vertex of the patches of the flat that is not on `border`. `None` without
    /// a vertex in that direction.
    fn shift_to_vertex(
        &self,
        v: usize,
        along: &Vec3,
        inside: &[(usize, usize)],
        border: &[u32],
    ) -> Option<f64> {
        let corners = inside.iter().flat_map(|&(k, _)| &self.tool.corners[k].vertices);
        let others = corners.filter(|w| **w as usize != v && !border.contains(w));
        let way = others.map(|&w| self.point(w) - self.tool.vertices[v]);
        let is_ahead = |way: &Vec3| way.dot(along) > AHEAD_COSINE_MIN * way.norm() * along.norm();
        let depths = way.filter(is_ahead).map(|way| way.dot(along) / along.norm_squared());
        depths.min_by(f64::total_cmp)
    }
}

/// Displacements at a corner between two borders of a flat with the inward unit vectors `a` and `b`. A unit shift moves
/// the vertex by 1 from one border and along the other one. A smooth border has one direction; a corner with a cosine
/// below -0.5 has none.
fn corner_vectors(a: &Vec3, b: &Vec3) -> Vec<Vec3> {
    let cosine = a.dot(b);
    if cosine > SMOOTH_BORDER_COSINE_MIN {
        return vec![(a + b) / (1.0 + cosine)];
    }
    let sine_squared = 1.0 - cosine * cosine;
    if cosine < -0.5 {
        return Vec::new();
    }
    vec![(a - b * cosine) / sine_squared, (b - a * cosine) / sine_squared]
}
