//! Any trimmed face: constrained Delaunay triangulation in a parameter plane scaled to lengths in space or to divisions
//! ([`plane`]), with points on lines along its parameters ([`lattice`]) and where the surface still curves too much.

mod corners;
mod lattice;
mod plane;
mod triangulator;

use std::collections::BTreeMap;

use spade::Triangulation;

use self::plane::Plane;
use self::triangulator::{Delaunay, MOST_NODES, Triangulator};
use super::bends::Bends;
use super::options::MappedOptions;
use super::patchwork::{Node, Patchwork};
use crate::cad::model::Face;
use crate::geometry::Aabb;

/// Times as many nodes as border and lattice have, beyond which the lattice was not the surface's.
const STRAYS: usize = 4;

/// Triangles between closed loops of border nodes (outer loop counter-clockwise, holes clockwise; the
/// first node is not repeated). The border's segments are sides of the triangles, undivided.
///
/// # Errors
/// A sentence saying why the loops bound no region; finer borders may.
pub fn triangulate(
    face: &Face,
    loops: &[Vec<Node>],
    bends: &Bends,
    options: &MappedOptions,
) -> Result<Patchwork, String> {
    let placed = |n: &Node| n.uv.iter().all(|t| t.is_finite());
    if loops.iter().all(Vec::is_empty) || !loops.iter().flatten().all(placed) {
        return Err("its border has no nodes, or some whose parameters are not numbers".into());
    }
    let by_lengths = || in_plane(face, loops, bends, options, plane::by_lengths(face, loops));
    let Some(plane) = plane::by_divisions(face, loops, options) else {
        return Ok(by_lengths()?.work);
    };
    let first = in_plane(face, loops, bends, options, plane);
    if first.as_ref().is_ok_and(|made| !made.strays && made.work.worst_corner(face) > 0.0) {
        return Ok(first?.work);
    }
    // What a few points say of the surface is not what it is: creases, tips, folds.
    match (first, by_lengths()) {
        (Err(_), other) => Ok(other?.work),
        (Ok(one), Err(_)) => Ok(one.work),
        (Ok(one), Ok(other)) => {
            let better = other.work.worst_corner(face) >= one.work.worst_corner(face);
            Ok(if one.strays || better { other.work } else { one.work })
        }
    }
}

/// Triangles, and whether far more nodes were added to them than the lattice foresaw.
struct Made {
    work: Patchwork,
    strays: bool,
}

fn in_plane(
    face: &Face,
    loops: &[Vec<Node>],
    bends: &Bends,
    options: &MappedOptions,
    plane: Plane,
) -> Result<Made, String> {
    let mut work = Triangulator {
        face,
        plane,
        size: Aabb::of_points(loops.iter().flatten().map(|n| &n.point)).diagonal(),
        cdt: Delaunay::new(),
        nodes: Vec::new(),
        normals: Vec::new(),
        vertices: BTreeMap::new(),
    };
    let segments = work.insert_border(loops)?;
    let inside = work.inside();
    work.check_border(&inside, &segments)?;
    work.add_lattice(loops)?;
    let foreseen = work.nodes.len();
    let most = if work.plane.cell.is_some() { STRAYS * foreseen } else { MOST_NODES };
    work.refine(options, most)?;
    let strays = work.nodes.len() > most;
    work.open_corners(bends)?;
    work.smooth(foreseen);
    let mut out = Patchwork { nodes: work.nodes.clone(), elements: Vec::new() };
    for triangle in work.inside() {
        out.push(&triangle.map(|n| n as u32));
    }
    if out.elements.is_empty() {
        return Err("its border bounds no area".into());
    }
    Ok(Made { work: out, strays })
}
