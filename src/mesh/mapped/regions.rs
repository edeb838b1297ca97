//! Four- and three-sided faces: transfinite maps onto the exact surface.

use super::grid::{FourSides, RelativePositions, ThreeSides};
use super::patchwork::{Node, Patchwork};
use super::poles;
use kanagata_cad::model::Face;
use kanagata_geometry::{Vec2, Vec3};

/// Sine of the worst corner below which a map is rejected.
pub const CORNER_SINE_MIN: f64 = 0.05;
/// Sine of the worst corner below which a map in space is tried besides that in the parameter plane.
const POOR_CORNER_SINE: f64 = 0.3;

/// Tensor grid of quadrilaterals between four sides, each a list of nodes in the direction of the loop. `None` when the
/// grid folds. A side that is a point in space (pole) gives a row of triangles, with `quads` quadrilaterals of two
/// each.
pub fn four(face: &Face, sides: &[Vec<Node>; 4], quads: bool) -> Option<Patchwork> {
    let back = |s: &[Node]| s.iter().rev().copied().collect::<Vec<_>>();
    let border = FourSides {
        bottom: sides[0].clone(),
        right: sides[1].clone(),
        top: back(&sides[2]),
        left: back(&sides[3]),
    };
    let plane = grid(face, &border, false);
    let quality = plane.worst_corner(face);
    // At a pole corners are always narrow.
    let has_pole = sides.iter().any(|s| s.iter().all(|n| n.same(&s[0])));
    if quality >= POOR_CORNER_SINE || has_pole {
        let joined = |mut work: Patchwork| {
            if quads && has_pole {
                poles::join(face, &mut work, border.cells());
            }
            work
        };
        return (quality > 0.0).then(|| joined(plane));
    }
    let space = grid(face, &border, true);
    let other = space.worst_corner(face);
    let (best, quality) = if other > quality { (space, other) } else { (plane, quality) };
    (quality >= CORNER_SINE_MIN).then_some(best)
}

fn map<T>(sides: &FourSides<Node>, f: impl Fn(&[Node]) -> Vec<T>) -> FourSides<T> {
    FourSides {
        bottom: f(&sides.bottom),
        right: f(&sides.right),
        top: f(&sides.top),
        left: f(&sides.left),
    }
}

/// Relative positions along each side; a pole uses those of the opposite side.
fn relative_positions(border: &FourSides<Node>) -> RelativePositions {
    let positions = |side: &[Node], opposite: &[Node]| {
        let is_pole = side.iter().all(|n| n.same(&side[0]));
        let side = if is_pole { opposite } else { side };
        let mut out = vec![0.0];
        for w in side.windows(2) {
            out.push(out[out.len() - 1] + (w[1].point - w[0].point).norm());
        }
        let (whole, cells) = (out[out.len() - 1], side.len() - 1);
        let even = |k: usize| k as f64 / cells as f64;
        (0..=cells).map(|k| if whole > 0.0 { out[k] / whole } else { even(k) }).collect()
    };
    FourSides {
        bottom: positions(&border.bottom, &border.top),
        right: positions(&border.right, &border.left),
        top: positions(&border.top, &border.bottom),
        left: positions(&border.left, &border.right),
    }
}

fn grid(face: &Face, border: &FourSides<Node>, in_space: bool) -> Patchwork {
    let [m, n] = border.cells();
    let relative_positions = relative_positions(border);
    let plane: FourSides<Vec2> = map(border, |s| s.iter().map(|n| n.uv).collect());
    let space: FourSides<Vec3> = map(border, |s| s.iter().map(|n| n.point).collect());
    let mut out = Patchwork::default();
    for j in 0..=n {
        for i in 0..=m {
            out.nodes.push(match (i, j) {
                (_, 0) => border.bottom[i],
                (_, j) if j == n => border.top[i],
                (0, _) => border.left[j],
                (i, _) if i == m => border.right[j],
                _ => {
                    let uv = plane.point(&relative_positions, i, j);
                    let wanted = in_space.then(|| space.point(&relative_positions, i, j));
                    Node::inside(
                        face,
                        wanted.map_or(uv, |p| face.surface.closest_near(&p, uv, 0.0).0),
                    )
                }
            });
        }
    }
    push_cells(face, &mut out, [m, n]);
    out
}

/// Adds the elements of a grid of `m` by `n` cells to its nodes.
fn push_cells(face: &Face, out: &mut Patchwork, [m, n]: [usize; 2]) {
    let at = |i: usize, j: usize| (j * (m + 1) + i) as u32;
    for j in 0..n {
        for i in 0..m {
            let ring = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            // A quadrilateral with a straight corner folds: two triangles are used there.
            match (0..4)
                .find(|&k| face.surface.has_degenerate_corner(out.nodes[ring[k] as usize].uv))
            {
                Some(k) => {
                    let turned = |by: usize| ring[(k + by) % 4];
                    out.push(&[turned(0), turned(1), turned(2)]);
                    out.push(&[turned(0), turned(2), turned(3)]);
                }
                None => out.push(&ring),
            }
        }
    }
}

/// Triangles or three blocks of quadrilaterals between three sides with equal counts. `None` when the map folds, or
/// quadrilaterals are required and the count is odd.
pub fn three(face: &Face, sides: &[Vec<Node>; 3], quads: bool) -> Option<Patchwork> {
    let n = sides[0].len() - 1;
    if quads && n % 2 == 1 {
        return None;
    }
    let uv = |s: &[Node]| s.iter().map(|n| n.uv).collect::<Vec<_>>();
    let ac: Vec<Node> = sides[2].iter().rev().copied().collect();
    let map = ThreeSides { ab: uv(&sides[0]), bc: uv(&sides[1]), ac: uv(&ac) };
    let border = ThreeBorders { ab: &sides[0], bc: &sides[1], ac: &ac };
    let out = if quads { blocks(face, &map, &border) } else { triangles(face, &map, &border) };
    (out.worst_corner(face) >= CORNER_SINE_MIN).then_some(out)
}

struct ThreeBorders<'a> {
    ab: &'a [Node],
    bc: &'a [Node],
    ac: &'a [Node],
}

impl ThreeBorders<'_> {
    /// Boundary node at steps (i, j) of n towards B and C, if there is one.
    fn at(&self, i: usize, j: usize, n: usize) -> Option<Node> {
        match (i, j) {
            (i, 0) => Some(self.ab[i]),
            (0, j) => Some(self.ac[j]),
            (i, j) if i + j == n => Some(self.bc[j]),
            _ => None,
        }
    }
}

fn triangles(face: &Face, map: &ThreeSides, border: &ThreeBorders<'_>) -> Patchwork {
    let n = map.ab.len() - 1;
    let mut out = Patchwork::default();
    let mut rows = Vec::new();
    for j in 0..=n {
        rows.push(out.nodes.len() as u32);
        for i in 0..=n - j {
            let uv = || map.point(i as f64 / n as f64, j as f64 / n as f64);
            out.nodes.push(border.at(i, j, n).unwrap_or_else(|| Node::inside(face, uv())));
        }
    }
    let at = |i: usize, j: usize| rows[j] + i as u32;
    for j in 0..n {
        for i in 0..n - j {
            out.push(&[at(i, j), at(i + 1, j), at(i, j + 1)]);
            if i + j + 1 < n {
                out.push(&[at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
    out
}

/// Three blocks of half by half quadrilaterals that meet in the middle of the face.
fn blocks(face: &Face, map: &ThreeSides, border: &ThreeBorders<'_>) -> Patchwork {
    let n = map.ab.len() - 1;
    let half = n / 2;
    // Barycentric steps of 6 n: integers, so that nodes shared by blocks are found again.
    let unit = 6 * n;
    let corner = [[0, 0], [unit, 0], [0, unit]];
    let centre = [unit / 3, unit / 3];
    let middle = |a: [usize; 2], b: [usize; 2]| [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
    let mut out = Patchwork::default();
    let mut known = std::collections::BTreeMap::new();
    for c in 0..3 {
        let (here, next, before) = (corner[c], corner[(c + 1) % 3], corner[(c + 2) % 3]);
        let (right, left) = (middle(here, next), middle(here, before));
        let mut ids = vec![0; (half + 1) * (half + 1)];
        for j in 0..=half {
            for i in 0..=half {
                let [x, y] = bilinear([here, right, left, centre], [i, j], half);
                let key = [(x * 64.0).round() as i64, (y * 64.0).round() as i64];
                ids[j * (half + 1) + i] = *known.entry(key).or_insert_with(|| {
                    let (x, y) = (x / unit as f64, y / unit as f64);
                    let step = |s: f64| (s * n as f64).round() as usize;
                    let on_border = x < 1e-9 || y < 1e-9 || x + y > 1.0 - 1e-9;
                    let met = if on_border { border.at(step(x), step(y), n) } else { None };
                    out.nodes.push(met.unwrap_or_else(|| Node::inside(face, map.point(x, y))));
                    out.nodes.len() as u32 - 1
                });
            }
        }
        let at = |i: usize, j: usize| ids[j * (half + 1) + i];
        for j in 0..half {
            for i in 0..half {
                out.push(&[at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
    out
}

/// Bilinear interpolation between the corners of a block at steps `i` and `j` of `half`, in their barycentric steps.
fn bilinear(
    [here, right, left, centre]: [[usize; 2]; 4],
    [i, j]: [usize; 2],
    half: usize,
) -> [f64; 2] {
    let (x, y, h) = (i as f64, j as f64, half as f64);
    [0, 1].map(|d| {
        ((here[d] as f64 * (h - x) + right[d] as f64 * x) * (h - y)
            + (left[d] as f64 * (h - x) + centre[d] as f64 * x) * y)
            / (h * h)
    })
}
