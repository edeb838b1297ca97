//! General trimmed faces: constrained Delaunay triangulation in a scaled parameter plane ([`plane`]), with interior
//! nodes on isoparametric lines ([`lattice`]) and where the surface is still too strongly curved.

mod corners;
mod lattice;
mod plane;
mod triangulator;

use std::collections::BTreeMap;

use spade::Triangulation;

use self::plane::Plane;
use self::triangulator::{Delaunay, NODES_MAX, Triangulator};
use super::edge_tangents::EdgeTangents;
use super::options::MappedOptions;
use super::patchwork::{Node, Patchwork};
use kanagata_cad::model::Face;
use kanagata_geometry::Aabb;

/// Ratio of the number of nodes to those of boundary and lattice above which the lattice was unsuitable.
const NODE_RATIO_MAX: usize = 4;

/// Triangulates the region between closed loops of boundary nodes (outer loop counter-clockwise, holes clockwise; the
/// first node is not repeated). The boundary segments become undivided sides of triangles.
///
/// # Errors
/// The reason why the loops enclose no region; a finer boundary may.
pub fn triangulate(
    face: &Face,
    loops: &[Vec<Node>],
    edge_tangents: &EdgeTangents,
    options: &MappedOptions,
) -> Result<Patchwork, String> {
    let placed = |n: &Node| n.uv.iter().all(|t| t.is_finite());
    if loops.iter().all(Vec::is_empty) || !loops.iter().flatten().all(placed) {
        return Err("its border has no nodes, or some whose parameters are not numbers".into());
    }
    let by_lengths =
        || in_plane(face, loops, edge_tangents, options, plane::by_lengths(face, loops));
    let Some(plane) = plane::by_divisions(face, loops, options) else {
        return Ok(by_lengths()?.work);
    };
    let first = in_plane(face, loops, edge_tangents, options, plane);
    if first.as_ref().is_ok_and(|made| !made.too_many_nodes && made.work.worst_corner(face) > 0.0) {
        return Ok(first?.work);
    }
    // A few samples may misrepresent the surface: creases, apexes, folds.
    match (first, by_lengths()) {
        (Err(_), other) => Ok(other?.work),
        (Ok(one), Err(_)) => Ok(one.work),
        (Ok(one), Ok(other)) => {
            let better = other.work.worst_corner(face) >= one.work.worst_corner(face);
            Ok(if one.too_many_nodes || better { other.work } else { one.work })
        }
    }
}

/// Triangles, and whether far more nodes were added than the lattice provides.
struct Made {
    work: Patchwork,
    too_many_nodes: bool,
}

fn in_plane(
    face: &Face,
    loops: &[Vec<Node>],
    edge_tangents: &EdgeTangents,
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
    let limit = if work.plane.cell.is_some() { NODE_RATIO_MAX * foreseen } else { NODES_MAX };
    work.refine(options, limit)?;
    let too_many_nodes = work.nodes.len() > limit;
    work.correct_inverted_corners(edge_tangents)?;
    work.smooth(foreseen);
    let mut out = Patchwork { nodes: work.nodes.clone(), elements: Vec::new() };
    for triangle in work.inside() {
        out.push(&triangle.map(|n| n as u32));
    }
    if out.elements.is_empty() {
        return Err("its border bounds no area".into());
    }
    Ok(Made { work: out, too_many_nodes })
}
