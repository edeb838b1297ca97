//! Reader of `.vtu` files: unstructured grids of one piece, with ascii, base64 or appended arrays, uncompressed or by
//! zlib. These are the default forms of this program, meshio, VTK and ParaView.

mod arrays;

use std::path::{Path, PathBuf};

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use self::arrays::{Encoding, Source};
use kanagata_geometry::Vec3;

/// Why a `.vtu` file cannot be read.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum VtuError {
    /// The file cannot be opened or read.
    #[error("cannot read {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        #[source]
        source: std::io::Error,
    },
    /// The text is not a supported grid.
    #[error("{}, {place}: {found}; allowed: VTK XML UnstructuredGrid, one piece, arrays as ascii, base64 or appended, uncompressed or by zlib; save it again in that form", path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// Array or element.
        place: String,
        /// What was found.
        found: String,
    },
}

/// A grid read from a file. Cells keep VTK's type numbers.
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
    /// Numbers per tuple.
    pub components: usize,
    /// Values, tuple after tuple.
    pub values: Vec<f64>,
}

/// Reads a `.vtu` file.
///
/// # Errors
/// [`VtuError`] names the file and the array that cannot be used.
pub fn read(path: &Path) -> Result<Grid, VtuError> {
    let text = kanagata_files::read(path, kanagata_files::Input::Mesh)
        .map_err(|source| VtuError::Io { path: path.to_path_buf(), source })?;
    parse(&text).map_err(|(place, found)| VtuError::Invalid {
        path: path.to_path_buf(),
        place,
        found,
    })
}

/// The array or element that cannot be read, and what was found there.
pub type Fault = (String, String);

/// Limit of the numbers in a file: a constant, and a number per byte. An uncompressed file holds at most one number per
/// byte; grids of integers and zeros compress to a tenth. The factor of two limits the memory that a malicious file can
/// claim.
const VALUES_BASE_LIMIT: usize = 1 << 20;
const VALUES_PER_BYTE_LIMIT: usize = 2;

fn fault(place: &str, found: impl Into<String>) -> Fault {
    (place.to_owned(), found.into())
}

/// The appended data of a file: arrays one after the other, addressed by their offsets.
struct Appended<'a> {
    base64: bool,
    data: &'a [u8],
}

/// Splits a file into its XML and its appended data.
fn split(text: &[u8]) -> Result<(&[u8], Option<Appended<'_>>), Fault> {
    const TAG: &[u8] = b"<AppendedData";
    let Some(at) = text.windows(TAG.len()).position(|w| w == TAG) else {
        return Ok((text, None));
    };
    let cut = |what: u8, from: usize| {
        let found = text[from..].iter().position(|&b| b == what);
        found.map(|k| from + k).ok_or_else(|| fault("AppendedData", "the file ends in its head"))
    };
    let end = cut(b'>', at)?;
    let tag = String::from_utf8_lossy(&text[at + 1..end]);
    let base64 = match attribute(&BytesStart::from_content(tag, TAG.len() - 1), "encoding") {
        Some(name) if name == "raw" => false,
        Some(name) if name == "base64" => true,
        other => return Err(fault("AppendedData", format!("encoding {other:?}"))),
    };
    Ok((&text[..at], Some(Appended { base64, data: &text[cut(b'_', end)? + 1..] })))
}

/// The grid in the bytes of a `.vtu` file.
///
/// # Errors
/// [`Fault`].
pub fn parse(text: &[u8]) -> Result<Grid, Fault> {
    let (xml, appended) = split(text)?;
    let mut reader = Reader::from_reader(xml);
    let mut contents = Contents {
        appended,
        encoding: Encoding::default(),
        open: Vec::new(),
        arrays: Vec::new(),
        pieces: 0,
        counts: [0; 2],
        values_left: VALUES_BASE_LIMIT
            .saturating_add(VALUES_PER_BYTE_LIMIT.saturating_mul(text.len())),
    };
    let mut buffer = Vec::new();
    loop {
        let event = reader
            .read_event_into(&mut buffer)
            .map_err(|e| fault("XML", format!("{e} at byte {}", reader.buffer_position())))?;
        match event {
            Event::Empty(tag) if tag.name().as_ref() == b"DataArray" => contents.add(&tag, "")?,
            Event::Empty(tag) if tag.name().as_ref() == b"Piece" => contents.begin_piece(&tag)?,
            Event::Start(tag) => contents.begin(&tag, &mut reader)?,
            Event::End(tag) if tag.name().as_ref() == b"VTKFile" => break,
            Event::End(_) => drop(contents.open.pop()),
            Event::Eof if contents.appended.is_some() => break,
            Event::Eof => return Err(fault("VTKFile", "the file ends before </VTKFile>")),
            _ => {}
        }
        buffer.clear();
    }
    if contents.pieces != 1 {
        return Err(fault("Piece", format!("{} pieces", contents.pieces)));
    }
    assemble(contents.arrays, contents.counts)
}

/// State of the reader.
struct Contents<'a> {
    appended: Option<Appended<'a>>,
    encoding: Encoding,
    /// Names of the open elements, outermost first.
    open: Vec<String>,
    /// Arrays, each with the name of the element that contains it.
    arrays: Vec<(String, GridArray)>,
    pieces: usize,
    /// Points and cells that the piece declares.
    counts: [usize; 2],
    /// Numbers that the file may still declare. Compressed arrays and arrays at the same offset may declare far more
    /// than the file holds.
    values_left: usize,
}

impl Contents<'_> {
    /// Handles the start of an element; for an array, `reader` gives its text.
    fn begin(&mut self, tag: &BytesStart<'_>, reader: &mut Reader<&[u8]>) -> Result<(), Fault> {
        match tag.name().as_ref() {
            b"DataArray" => {
                let body = text_of(reader, &attribute(tag, "Name").unwrap_or_default())?;
                return self.add(tag, &body);
            }
            b"VTKFile" => self.encoding = read_encoding(tag)?,
            b"Piece" => self.begin_piece(tag)?,
            _ => {}
        }
        self.open.push(String::from_utf8_lossy(tag.name().as_ref()).into_owned());
        Ok(())
    }

    /// A piece that begins: what it declares.
    fn begin_piece(&mut self, tag: &BytesStart<'_>) -> Result<(), Fault> {
        self.pieces += 1;
        self.counts = [count(tag, "NumberOfPoints")?, count(tag, "NumberOfCells")?];
        Ok(())
    }

    /// Adds the array of an element with the text `body`.
    fn add(&mut self, tag: &BytesStart<'_>, body: &str) -> Result<(), Fault> {
        let array = read_array(tag, body, self.encoding, self.appended.as_ref(), self.values_left)?;
        self.values_left -= array.values.len();
        self.arrays.push((self.open.last().cloned().unwrap_or_default(), array));
        Ok(())
    }
}

/// A count declared by the piece.
fn count(piece: &BytesStart<'_>, name: &str) -> Result<usize, Fault> {
    let found = attribute(piece, name);
    let count = found.as_ref().and_then(|text| text.trim().parse().ok());
    count.ok_or_else(|| fault("Piece", format!("{name} {found:?} for a count")))
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
    let compressor = attribute(tag, "compressor");
    if let Some(name) = compressor.as_ref().filter(|c| *c != "vtkZLibDataCompressor") {
        return Err(fault("VTKFile", format!("compressor '{name}'")));
    }
    Ok(Encoding {
        big_endian: attribute(tag, "byte_order").as_deref() == Some("BigEndian"),
        wide_lengths: attribute(tag, "header_type").as_deref() == Some("UInt64"),
        zlib: compressor.is_some(),
    })
}

/// The text of the current element, without that of its children (VTK writes ranges of norms there).
fn text_of(reader: &mut Reader<&[u8]>, name: &str) -> Result<String, Fault> {
    let mut buffer = Vec::new();
    let mut body = String::new();
    let mut depth = 0usize;
    loop {
        match reader.read_event_into(&mut buffer) {
            Ok(Event::Text(text)) if depth == 0 => body.push_str(&String::from_utf8_lossy(&text)),
            Ok(Event::Start(_)) => depth += 1,
            Ok(Event::End(_)) if depth == 0 => return Ok(body),
            Ok(Event::End(_)) => depth -= 1,
            Ok(Event::Eof) => return Err(fault(name, "the file ends inside the array")),
            Ok(_) => {}
            Err(e) => return Err(fault(name, e.to_string())),
        }
        buffer.clear();
    }
}

fn read_array(
    tag: &BytesStart<'_>,
    body: &str,
    encoding: Encoding,
    appended: Option<&Appended<'_>>,
    max_values: usize,
) -> Result<GridArray, Fault> {
    let name = attribute(tag, "Name").unwrap_or_default();
    let kind = attribute(tag, "type").unwrap_or_default();
    let components = attribute(tag, "NumberOfComponents")
        .map_or(Ok(1), |c| c.parse().map_err(|_| fault(&name, format!("{c} components"))))?;
    let values = match attribute(tag, "format").as_deref() {
        Some("ascii") => body
            .split_ascii_whitespace()
            .map(|w| w.parse::<f64>().map_err(|_| fault(&name, format!("'{w}' for a number"))))
            .collect::<Result<_, _>>()?,
        Some("binary") => {
            let source = Source::Base64(body.trim().as_bytes());
            encoding.numbers(&source, &kind, max_values).map_err(|e| fault(&name, e))?
        }
        Some("appended") => {
            let offset = attribute(tag, "offset").and_then(|o| o.parse::<usize>().ok());
            let place = offset.and_then(|o| Some((appended?.base64, appended?.data.get(o..)?)));
            let source = match place {
                Some((true, data)) => Source::Base64(data),
                Some((false, data)) => Source::Raw(data),
                None => return Err(fault(&name, format!("offset {offset:?}, nothing is there"))),
            };
            encoding.numbers(&source, &kind, max_values).map_err(|e| fault(&name, e))?
        }
        other => return Err(fault(&name, format!("format {other:?}"))),
    };
    if values.len() > max_values {
        return Err(fault(
            &name,
            format!("more than {max_values} numbers, the limit for a file of this size"),
        ));
    }
    Ok(GridArray { name, components, values })
}

/// Assembles the grid of a piece from its arrays and its declared counts of points and cells.
fn assemble(arrays: Vec<(String, GridArray)>, [points, cells]: [usize; 2]) -> Result<Grid, Fault> {
    let mut grid = Grid::default();
    let (mut connectivity, mut offsets, mut types) = (Vec::new(), Vec::new(), Vec::new());
    for (section, array) in arrays {
        match (section.as_str(), array.name.as_str()) {
            ("Points", _) => grid.points = points_of(&array)?,
            ("Cells", "connectivity") => connectivity = array.values,
            ("Cells", "offsets") => offsets = array.values,
            ("Cells", "types") => types = array.values,
            ("PointData", _) => grid.point_data.push(array),
            ("CellData", _) => grid.cell_data.push(array),
            _ => {}
        }
    }
    let declared = [
        ("Points", grid.points.len(), points, "points"),
        ("offsets", offsets.len(), cells, "cells"),
        ("types", types.len(), cells, "cells"),
    ];
    for (name, found, count, of) in declared {
        if found != count {
            let what = format!("{found} entries for the {count} {of} that the piece declares");
            return Err(fault(name, what));
        }
    }
    grid.cells = cells_of(&connectivity, &offsets, &types, points)?;
    let of_points = grid.point_data.iter().map(|a| (a, points));
    for (array, count) in of_points.chain(grid.cell_data.iter().map(|a| (a, cells))) {
        if array.components.checked_mul(count) != Some(array.values.len()) {
            let found = format!("{} numbers for {count} tuples", array.values.len());
            return Err(fault(&array.name, found));
        }
    }
    Ok(grid)
}

/// Points with three finite coordinates each.
fn points_of(array: &GridArray) -> Result<Vec<Vec3>, Fault> {
    let (tuples, rest) = array.values.as_chunks::<3>();
    if !rest.is_empty() || array.components != 3 {
        let (n, c) = (array.values.len(), array.components);
        return Err(fault("Points", format!("{n} numbers in tuples of {c} for points of 3")));
    }
    let lost = tuples.iter().position(|p| p.iter().any(|x| !x.is_finite()));
    match lost {
        Some(k) => Err(fault("Points", format!("coordinates {:?} of point {k}", tuples[k]))),
        None => Ok(tuples.iter().map(|p| Vec3::from(*p)).collect()),
    }
}

/// Type and points of each cell; `offsets[k]` is the end of the points of cell k in `connectivity`.
fn cells_of(
    connectivity: &[f64],
    offsets: &[f64],
    types: &[f64],
    points: usize,
) -> Result<Vec<(u8, Vec<u32>)>, Fault> {
    let is_whole = |x: f64, below: usize| x >= 0.0 && x < below as f64 && x.fract() == 0.0;
    let mut cells = Vec::with_capacity(offsets.len());
    let mut from = 0usize;
    for (k, (&end, &kind)) in offsets.iter().zip(types).enumerate() {
        let ends_at = || fault("offsets", format!("cell {k} ends at {end}"));
        if !is_whole(end, connectivity.len() + 1) {
            return Err(ends_at());
        }
        let ids = connectivity.get(from..end as usize).ok_or_else(ends_at)?;
        if let Some(id) = ids.iter().find(|id| !is_whole(**id, points)) {
            return Err(fault("connectivity", format!("point {id} of {points} in cell {k}")));
        }
        if !is_whole(kind, 256) {
            return Err(fault("types", format!("type {kind} of cell {k}")));
        }
        cells.push((kind as u8, ids.iter().map(|&id| id as u32).collect()));
        from = end as usize;
    }
    if from != connectivity.len() {
        let found = format!("{} entries, of which the cells use {from}", connectivity.len());
        return Err(fault("connectivity", found));
    }
    Ok(cells)
}

#[cfg(test)]
mod tests;
