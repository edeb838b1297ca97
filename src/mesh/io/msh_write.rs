//! MSH 4.1, ASCII: one discrete surface entity per CAD face, tag = face + 1.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::Path;

use crate::{Element, SurfaceMesh};
use kanagata_files::{WriteError, write_atomic};
use kanagata_geometry::Aabb;

/// Writes the mesh with a gmsh entity per CAD face.
pub fn write(mesh: &SurfaceMesh, path: &Path) -> Result<(), WriteError> {
    write_atomic(path, |out| write_to(mesh, out))
}

fn tag(face: u32) -> u64 {
    u64::from(face) + 1
}

fn write_to(mesh: &SurfaceMesh, out: &mut dyn Write) -> io::Result<()> {
    let mut by_face: BTreeMap<u32, Vec<&Element>> = BTreeMap::new();
    for e in &mesh.elements {
        by_face.entry(e.face).or_default().push(e);
    }
    writeln!(out, "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 {} 0", by_face.len())?;
    for (&face, elements) in &by_face {
        let nodes = elements.iter().flat_map(|e| e.nodes());
        let b = Aabb::of_points(nodes.map(|&n| &mesh.vertices[n as usize]));
        let (lo, hi) = (b.min, b.max);
        writeln!(out, "{} {} {} {} {} {} {} 0 0", tag(face), lo.x, lo.y, lo.z, hi.x, hi.y, hi.z)?;
    }
    writeln!(out, "$EndEntities\n$Nodes")?;
    write_nodes(mesh, &by_face, out)?;
    writeln!(out, "$EndNodes\n$Elements")?;
    write_elements(mesh, &by_face, out)?;
    writeln!(out, "$EndElements")
}

/// Nodes in blocks, each under the first face that uses it; unused ones are omitted.
fn write_nodes(
    mesh: &SurfaceMesh,
    by_face: &BTreeMap<u32, Vec<&Element>>,
    out: &mut dyn Write,
) -> io::Result<()> {
    let mut seen = vec![false; mesh.vertices.len()];
    let mut blocks = Vec::new();
    for (&face, elements) in by_face {
        let mut nodes: Vec<u32> = elements.iter().flat_map(|e| e.nodes()).copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes.retain(|&n| !std::mem::replace(&mut seen[n as usize], true));
        blocks.push((face, nodes));
    }
    let count = seen.iter().filter(|s| **s).count();
    let last = seen.iter().rposition(|s| *s).map_or(0, |n| n + 1);
    writeln!(out, "{} {count} 1 {last}", blocks.len())?;
    for (face, nodes) in blocks {
        writeln!(out, "2 {} 0 {}", tag(face), nodes.len())?;
        for n in &nodes {
            writeln!(out, "{}", n + 1)?;
        }
        for &n in &nodes {
            let p = mesh.vertices[n as usize];
            writeln!(out, "{} {} {}", p.x, p.y, p.z)?;
        }
    }
    Ok(())
}

fn write_elements(
    mesh: &SurfaceMesh,
    by_face: &BTreeMap<u32, Vec<&Element>>,
    out: &mut dyn Write,
) -> io::Result<()> {
    let mut blocks = Vec::new();
    for (&face, elements) in by_face {
        for (corners, kind) in [(3, 2), (4, 3)] {
            let these: Vec<_> = elements.iter().filter(|e| e.nodes().len() == corners).collect();
            if !these.is_empty() {
                blocks.push((face, kind, these));
            }
        }
    }
    let count = mesh.elements.len();
    writeln!(out, "{} {count} 1 {count}", blocks.len())?;
    let mut number = 0;
    for (face, kind, elements) in blocks {
        writeln!(out, "2 {} {kind} {}", tag(face), elements.len())?;
        for e in elements {
            number += 1;
            write!(out, "{number}")?;
            for n in e.nodes() {
                write!(out, " {}", n + 1)?;
            }
            writeln!(out)?;
        }
    }
    Ok(())
}
