//! Reads `.vtu` files back: unstructured grids with ascii or inline base64 arrays, uncompressed.

use std::path::{Path, PathBuf};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use crate::geometry::Vec3;

/// Why a `.vtu` file gives no grid.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum VtuError {
    /// The file cannot be opened or read.
    #[error("cannot read {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        #[source]
        source: std::io::Error,
    },
    /// The text is not a grid this reader knows.
    #[error("{}, {place}: {found}; allowed: VTK XML UnstructuredGrid, one piece, ascii or inline base64 arrays without compression; save it again in that form", path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// Array or element.
        place: String,
        /// What was found.
        found: String,
    },
}

/// What is found where arrays are compressed, as meshio and ParaView do unless told otherwise.
const COMPRESSED: &str = "compressed arrays (write it without: in Python `meshio.write(\"blank.vtu\", mesh, compression=None)`, in ParaView with compressor None)";

/// A grid read back. Cells keep VTK's type numbers.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Grid {
    /// Points.
    pub points: Vec<Vec3>,
    /// (VTK type, point ids) of every cell.
    pub cells: Vec<(u8, Vec<u32>)>,
    /// Point arrays: name, components, flat values.
    pub point_data: Vec<GridArray>,
    /// Cell arrays.
    pub cell_data: Vec<GridArray>,
}

/// A named array of a grid.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct GridArray {
    /// Name.
    pub name: String,
    /// Numbers a tuple.
    pub components: usize,
    /// Values, tuple after tuple.
    pub values: Vec<f64>,
}

/// Reads a `.vtu` file.
///
/// # Errors
/// [`VtuError`] names the file and the array that cannot be used.
pub fn read(path: &Path) -> Result<Grid, VtuError> {
    let text =
        std::fs::read(path).map_err(|source| VtuError::Io { path: path.to_path_buf(), source })?;
    parse(&text).map_err(|(place, found)| VtuError::Invalid {
        path: path.to_path_buf(),
        place,
        found,
    })
}

type Fault = (String, String);

fn fault(place: &str, found: impl Into<String>) -> Fault {
    (place.to_owned(), found.into())
}

/// Number types of VTK, and how the file writes lengths.
#[derive(Clone, Copy)]
struct Encoding {
    big_endian: bool,
    wide_lengths: bool,
}

fn parse(text: &[u8]) -> Result<Grid, Fault> {
    let mut reader = Reader::from_reader(text);
    let mut encoding = Encoding { big_endian: false, wide_lengths: false };
    let mut section = String::new();
    let mut arrays: Vec<(String, GridArray)> = Vec::new();
    let mut pieces = 0;
    let mut buffer = Vec::new();
    loop {
        let event = reader
            .read_event_into(&mut buffer)
            .map_err(|e| fault("XML", format!("{e} at byte {}", reader.buffer_position())))?;
        match event {
            Event::Start(tag) => match tag.name().as_ref() {
                b"VTKFile" => encoding = read_encoding(&tag)?,
                b"Piece" => pieces += 1,
                b"Points" | b"Cells" | b"PointData" | b"CellData" | b"FieldData" => {
                    section = String::from_utf8_lossy(tag.name().as_ref()).into_owned();
                }
                b"DataArray" => {
                    let tag = tag.into_owned();
                    let array = read_array(&mut reader, &tag, encoding)?;
                    arrays.push((section.clone(), array));
                }
                _ => {}
            },
            Event::End(tag) if tag.name().as_ref() == b"VTKFile" => break,
            Event::Eof => return Err(fault("VTKFile", "the file ends before </VTKFile>")),
            _ => {}
        }
        buffer.clear();
    }
    if pieces != 1 {
        return Err(fault("Piece", format!("{pieces} pieces")));
    }
    assemble(arrays)
}

fn attribute(tag: &BytesStart<'_>, name: &str) -> Option<String> {
    let found = tag.attributes().flatten().find(|a| a.key.as_ref() == name.as_bytes())?;
    found.unescape_value().ok().map(|v| v.into_owned())
}

fn read_encoding(tag: &BytesStart<'_>) -> Result<Encoding, Fault> {
    if attribute(tag, "type").as_deref() != Some("UnstructuredGrid") {
        let found = attribute(tag, "type").unwrap_or_default();
        return Err(fault("VTKFile", format!("type '{found}'")));
    }
    if attribute(tag, "compressor").is_some() {
        return Err(fault("VTKFile", COMPRESSED));
    }
    Ok(Encoding {
        big_endian: attribute(tag, "byte_order").as_deref() == Some("BigEndian"),
        wide_lengths: attribute(tag, "header_type").as_deref() == Some("UInt64"),
    })
}

fn read_array(
    reader: &mut Reader<&[u8]>,
    tag: &BytesStart<'_>,
    encoding: Encoding,
) -> Result<GridArray, Fault> {
    let name = attribute(tag, "Name").unwrap_or_default();
    let kind = attribute(tag, "type").unwrap_or_default();
    let components = attribute(tag, "NumberOfComponents")
        .map_or(Ok(1), |c| c.parse().map_err(|_| fault(&name, format!("{c} components"))))?;
    let mut buffer = Vec::new();
    let mut body = String::new();
    loop {
        match reader.read_event_into(&mut buffer) {
            Ok(Event::Text(text)) => body.push_str(&String::from_utf8_lossy(&text)),
            Ok(Event::End(_)) => break,
            Ok(Event::Eof) => return Err(fault(&name, "the file ends inside the array")),
            Ok(_) => {}
            Err(e) => return Err(fault(&name, e.to_string())),
        }
        buffer.clear();
    }
    let values = match attribute(tag, "format").as_deref() {
        Some("ascii") => body
            .split_ascii_whitespace()
            .map(|w| w.parse::<f64>().map_err(|_| fault(&name, format!("'{w}' for a number"))))
            .collect::<Result<_, _>>()?,
        Some("binary") => decode(body.trim(), &kind, encoding).map_err(|e| fault(&name, e))?,
        other => return Err(fault(&name, format!("format {other:?}"))),
    };
    Ok(GridArray { name, components, values })
}

fn decode(body: &str, kind: &str, encoding: Encoding) -> Result<Vec<f64>, String> {
    let raw = STANDARD.decode(body).map_err(|e| e.to_string())?;
    let head = if encoding.wide_lengths { 8 } else { 4 };
    let data = raw.get(head..).ok_or("an array without its length")?;
    let numbers = |size: usize, convert: &dyn Fn([u8; 8]) -> f64| -> Vec<f64> {
        data.chunks_exact(size)
            .map(|chunk| {
                let mut bytes = [0u8; 8];
                bytes[..size].copy_from_slice(chunk);
                if encoding.big_endian {
                    bytes[..size].reverse();
                }
                convert(bytes)
            })
            .collect()
    };
    let low4 = |b: [u8; 8]| [b[0], b[1], b[2], b[3]];
    Ok(match kind {
        "Float64" => numbers(8, &f64::from_le_bytes),
        "Float32" => numbers(4, &|b| f64::from(f32::from_le_bytes(low4(b)))),
        "Int64" => numbers(8, &|b| i64::from_le_bytes(b) as f64),
        "UInt64" => numbers(8, &|b| u64::from_le_bytes(b) as f64),
        "Int32" => numbers(4, &|b| f64::from(i32::from_le_bytes(low4(b)))),
        "UInt32" => numbers(4, &|b| f64::from(u32::from_le_bytes(low4(b)))),
        "UInt8" => numbers(1, &|b| f64::from(b[0])),
        "Int8" => numbers(1, &|b| f64::from(b[0] as i8)),
        other => return Err(format!("numbers of type '{other}'")),
    })
}

fn assemble(arrays: Vec<(String, GridArray)>) -> Result<Grid, Fault> {
    let mut grid = Grid::default();
    let (mut connectivity, mut offsets, mut types) = (Vec::new(), Vec::new(), Vec::new());
    for (section, array) in arrays {
        match (section.as_str(), array.name.as_str()) {
            ("Points", _) => {
                grid.points =
                    array.values.chunks_exact(3).map(|p| Vec3::new(p[0], p[1], p[2])).collect();
            }
            ("Cells", "connectivity") => connectivity = array.values,
            ("Cells", "offsets") => offsets = array.values,
            ("Cells", "types") => types = array.values,
            ("PointData", _) => grid.point_data.push(array),
            ("CellData", _) => grid.cell_data.push(array),
            _ => {}
        }
    }
    let mut from = 0usize;
    for (k, (&end, &kind)) in offsets.iter().zip(&types).enumerate() {
        let end = end as usize;
        let ids = connectivity
            .get(from..end)
            .ok_or_else(|| fault("offsets", format!("cell {k} ends at {end}")))?;
        let inside = |&id: &f64| id >= 0.0 && (id as usize) < grid.points.len();
        if let Some(id) = ids.iter().find(|id| !inside(id)) {
            return Err(fault("connectivity", format!("point {id} in cell {k}")));
        }
        grid.cells.push((kind as u8, ids.iter().map(|&id| id as u32).collect()));
        from = end;
    }
    for (array, count) in grid
        .point_data
        .iter()
        .map(|a| (a, grid.points.len()))
        .chain(grid.cell_data.iter().map(|a| (a, grid.cells.len())))
    {
        if array.components.checked_mul(count) != Some(array.values.len()) {
            let found = format!("{} numbers for {count} tuples", array.values.len());
            return Err(fault(&array.name, found));
        }
    }
    Ok(grid)
}

#[cfg(test)]
mod tests {
    use super::super::vtu::{CellKind, DataArray, Vtu};
    use super::*;

    fn written() -> Vec<u8> {
        let mut grid =
            Vtu::new(vec![Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::new(1.0, 1.0, 0.25)]);
        grid.push_cell(CellKind::Triangle, &[0, 1, 2]);
        grid.push_cell(CellKind::Quad, &[0, 1, 3, 2]);
        grid.point_data.push(DataArray::scalar("error & sign", vec![0.1, -0.2, 0.3, f64::MIN]));
        grid.cell_data.push(DataArray::integer("face", vec![3, -4]));
        let mut bytes = Vec::new();
        grid.write_to(&mut bytes).unwrap();
        bytes
    }

    #[test]
    fn what_is_written_is_read_back() {
        let grid = parse(&written()).unwrap();
        assert_eq!(grid.points[3], Vec3::new(1.0, 1.0, 0.25));
        assert_eq!(grid.cells, [(5, vec![0, 1, 2]), (9, vec![0, 1, 3, 2])]);
        assert_eq!(grid.point_data[0].name, "error & sign");
        assert_eq!(grid.point_data[0].values, [0.1, -0.2, 0.3, f64::MIN]);
        assert_eq!(grid.cell_data[0].values, [3.0, -4.0]);
    }

    #[test]
    fn of_compressed_arrays_the_remedy_is_told() {
        let text = String::from_utf8(written()).unwrap();
        let text = text.replace("<VTKFile ", "<VTKFile compressor=\"vtkZLibDataCompressor\" ");
        let (place, found) = parse(text.as_bytes()).unwrap_err();
        assert!(place == "VTKFile" && found.contains("compression=None"), "{found}");
    }

    #[test]
    fn every_truncation_and_wrong_id_is_an_error_and_never_a_panic() {
        let bytes = written();
        for end in (0..bytes.len() - 20).step_by(7) {
            assert!(parse(&bytes[..end]).is_err(), "{end}");
        }
        let text = String::from_utf8(bytes).unwrap().replace("UInt64", "UInt32");
        let _ = parse(text.as_bytes());
        let ascii = "<VTKFile type=\"UnstructuredGrid\"><Piece><Points><DataArray type=\"Float64\" \
             NumberOfComponents=\"3\" format=\"ascii\">0 0 0</DataArray></Points><Cells>\
             <DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 7</DataArray>\
             <DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">2</DataArray>\
             <DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">3</DataArray></Cells></Piece></VTKFile>";
        let (place, found) = parse(ascii.as_bytes()).unwrap_err();
        assert_eq!((place.as_str(), found.as_str()), ("connectivity", "point 7 in cell 0"));
    }
}
