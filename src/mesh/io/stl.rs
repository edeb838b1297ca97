//! STL, ASCII and binary: corners with identical coordinates become one vertex.

use super::cursor::Cursor;
use super::mesh_file::Merger;
use crate::{MeshError, SurfaceMesh};
use kanagata_geometry::Vec3;

/// Parses an STL file; `file` is used in messages.
pub fn parse(bytes: &[u8], file: &str) -> Result<SurfaceMesh, MeshError> {
    let declared = bytes.get(80..84).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    let binary = declared.is_some_and(|n| bytes.len() as u64 == 84 + 50 * u64::from(n));
    if binary { binary_stl(bytes, file) } else { text_stl(bytes, file) }
}

fn binary_stl(bytes: &[u8], file: &str) -> Result<SurfaceMesh, MeshError> {
    let mut cursor = Cursor::new(bytes, file);
    cursor.binary = true;
    cursor.skip(84);
    let mut merger = Merger::default();
    while !cursor.at_end() {
        cursor.skip(12);
        let mut corners = [Vec3::zeros(); 3];
        for p in &mut corners {
            *p = Vec3::new(cursor.float4()?, cursor.float4()?, cursor.float4()?);
        }
        cursor.skip(2);
        merger.triangle(corners);
    }
    Ok(merger.mesh)
}

fn text_stl(bytes: &[u8], file: &str) -> Result<SurfaceMesh, MeshError> {
    let mut cursor = Cursor::new(bytes, file);
    let start = cursor.line().unwrap_or("");
    if !start.to_ascii_lowercase().starts_with("solid") {
        let short: String = start.chars().take(40).collect();
        return Err(
            cursor.error(format!("'{short}'"), "'solid NAME', or binary STL of 84 + 50 n bytes")
        );
    }
    let mut merger = Merger::default();
    let mut corners = Vec::new();
    let mut is_open = true;
    while let Ok(word) = cursor.word() {
        match word.to_ascii_lowercase().as_str() {
            "vertex" => corners.push(Vec3::new(cursor.float()?, cursor.float()?, cursor.float()?)),
            "endloop" => match corners[..] {
                [a, b, c] => {
                    merger.triangle([a, b, c]);
                    corners.clear();
                }
                _ => {
                    let found = format!("a loop of {} vertices", corners.len());
                    return Err(cursor.error(found, "3"));
                }
            },
            "solid" => is_open = true,
            "endsolid" => is_open = false,
            _ => {}
        }
    }
    if is_open || !corners.is_empty() {
        return Err(cursor.error("the end of the file inside a solid", "facets up to 'endsolid'"));
    }
    Ok(merger.mesh)
}
