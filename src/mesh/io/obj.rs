//! Wavefront OBJ: vertices, normals and faces. Concave faces and those of more than four corners become triangles.

use super::cursor::Cursor;
use super::mesh_file::{MeshFile, UNATTACHED, of_elements};
use super::polygon;
use crate::MeshError;
use kanagata_geometry::Vec3;

/// Index of a corner without normal.
const NO_NORMAL: u32 = u32::MAX;

/// Parses an OBJ file; `file` is used in messages.
pub fn parse(bytes: &[u8], file: &str) -> Result<MeshFile, MeshError> {
    let mut cursor = Cursor::new(bytes, file);
    let (mut vertices, mut normals) = (Vec::new(), Vec::new());
    let mut rings: Vec<(usize, Vec<[u32; 2]>)> = Vec::new();
    let mut number = 0;
    while let Some(line) = cursor.line() {
        number += 1;
        let mut words = line.split_ascii_whitespace();
        let wrong = |allowed: &str| cursor.error(format!("'{}'", short(line)), allowed);
        match words.next() {
            Some("v") => vertices.push(vector(words).ok_or_else(|| wrong("v x y z"))?),
            Some("vn") => normals.push(vector(words).ok_or_else(|| wrong("vn x y z"))?),
            Some("f") => {
                let corners = words.map(|w| corner(w, vertices.len(), normals.len()));
                let ring = corners.collect::<Option<Vec<[u32; 2]>>>().filter(|r| r.len() >= 3);
                let ring = ring.ok_or_else(|| {
                    wrong("f with three or more numbers of vertices, and of normals, above it")
                })?;
                rings.push((number, ring));
            }
            _ => {}
        }
    }
    let normal = |id: u32| normals.get(id as usize).copied().unwrap_or_default();
    let corner = |&[v, n]: &[u32; 2]| (v, normal(n));
    let mut elements = Vec::new();
    for (line, ring) in &rings {
        let ring: Vec<(u32, Vec3)> = ring.iter().map(corner).collect();
        let parts = polygon::elements(&ring, &vertices, UNATTACHED);
        elements
            .extend(parts.map_err(|found| polygon::refused(file, format!("line {line}"), found))?);
    }
    Ok(of_elements(vertices, elements))
}

/// Three finite numbers.
fn vector<'a>(words: impl Iterator<Item = &'a str>) -> Option<Vec3> {
    let x: Vec<f64> = words.take(3).filter_map(|w| w.parse().ok()).collect();
    match x[..] {
        [x, y, z] if (x + y + z).is_finite() => Some(Vec3::new(x, y, z)),
        _ => None,
    }
}

fn short(line: &str) -> String {
    line.chars().take(60).collect()
}

/// Zero-based indices of vertex and normal from `7`, `7/1/2`, `7//2` or `-1` (the last vertex read).
fn corner(word: &str, vertices: usize, normals: usize) -> Option<[u32; 2]> {
    let mut parts = word.split('/');
    let id = |word: &str, count: usize| {
        let number: i64 = word.parse().ok()?;
        let id = if number < 0 { (count as i64).checked_add(number)? } else { number - 1 };
        (id >= 0 && id < count as i64).then_some(id as u32)
    };
    let vertex = id(parts.next()?, vertices)?;
    match parts.nth(1).filter(|word| !word.is_empty()) {
        Some(word) => Some([vertex, id(word, normals)?]),
        None => Some([vertex, NO_NORMAL]),
    }
}
