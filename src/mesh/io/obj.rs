//! Wavefront OBJ: vertices and faces; faces of more than four corners are cut into triangles.

use super::UNATTACHED;
use super::cursor::Cursor;
use crate::geometry::Vec3;
use crate::mesh::{Element, MeshError, SurfaceMesh};

/// Parses an OBJ file; `file` is used in messages.
pub fn parse(bytes: &[u8], file: &str) -> Result<SurfaceMesh, MeshError> {
    let mut cursor = Cursor::new(bytes, file);
    let mut mesh = SurfaceMesh::default();
    let mut rings: Vec<Vec<u32>> = Vec::new();
    while let Some(line) = cursor.line() {
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("v") => {
                let x: Vec<f64> = words.take(3).filter_map(|w| w.parse().ok()).collect();
                match x[..] {
                    [x, y, z] if (x + y + z).is_finite() => mesh.vertices.push(Vec3::new(x, y, z)),
                    _ => return Err(cursor.error(format!("'{}'", short(line)), "v x y z")),
                }
            }
            Some("f") => {
                let ids: Option<Vec<u32>> =
                    words.map(|w| vertex_id(w, mesh.vertices.len())).collect();
                let ids = ids.filter(|ids| ids.len() >= 3);
                rings.push(ids.ok_or_else(|| {
                    let allowed = "f with three or more numbers of vertices above it";
                    cursor.error(format!("'{}'", short(line)), allowed)
                })?);
            }
            _ => {}
        }
    }
    for ring in &rings {
        if ring.len() <= 4 {
            mesh.elements.extend(Element::from_ring(ring, UNATTACHED));
        } else {
            let fan = (1..ring.len() - 1).map(|k| [ring[0], ring[k], ring[k + 1]]);
            mesh.elements.extend(fan.filter_map(|t| Element::from_ring(&t, UNATTACHED)));
        }
    }
    mesh.compact();
    Ok(mesh)
}

fn short(line: &str) -> String {
    line.chars().take(60).collect()
}

/// `7`, `7/1/2` or `-1` (the last vertex so far) as a zero-based id.
fn vertex_id(word: &str, count: usize) -> Option<u32> {
    let number: i64 = word.split('/').next()?.parse().ok()?;
    let id = if number < 0 { count as i64 + number } else { number - 1 };
    (id >= 0 && id < count as i64).then_some(id as u32)
}
