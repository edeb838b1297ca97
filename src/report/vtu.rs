//! VTK XML files: unstructured grids (`.vtu`) with base64 binary arrays, and time collections (`.pvd`).

use std::io::{self, Write};
use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::foreign::escaped;
use crate::files::{WriteError, write_atomic};
use crate::geometry::Vec3;

/// Cell kinds, with VTK's type numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum CellKind {
    /// A point.
    Vertex = 1,
    /// A straight line.
    Line = 3,
    /// A triangle.
    Triangle = 5,
    /// A quadrilateral.
    Quad = 9,
    /// An eight-node hexahedron: lower face first, counter-clockwise seen from above.
    Hexahedron = 12,
}

/// Values of a point or cell array, flattened.
#[derive(Debug, Clone, PartialEq)]
enum Values {
    Float(Vec<f64>),
    Int(Vec<i32>),
}

/// A named array of point, cell or field data.
#[derive(Debug, Clone, PartialEq)]
pub struct DataArray {
    name: String,
    components: usize,
    values: Values,
}

impl DataArray {
    /// One number per point or cell.
    pub fn scalar(name: impl Into<String>, values: Vec<f64>) -> Self {
        Self { name: name.into(), components: 1, values: Values::Float(values) }
    }

    /// One integer per point or cell.
    pub fn integer(name: impl Into<String>, values: Vec<i32>) -> Self {
        Self { name: name.into(), components: 1, values: Values::Int(values) }
    }

    /// One vector per point or cell.
    pub fn vector(name: impl Into<String>, values: &[Vec3]) -> Self {
        let flat = values.iter().flat_map(|v| [v.x, v.y, v.z]).collect();
        Self { name: name.into(), components: 3, values: Values::Float(flat) }
    }

    /// `components` numbers per point or cell, flattened (a symmetric tensor: 6, as xx yy zz xy yz xz).
    pub fn tuples(name: impl Into<String>, components: usize, values: Vec<f64>) -> Self {
        Self { name: name.into(), components, values: Values::Float(values) }
    }

    fn len(&self) -> usize {
        let flat = match &self.values {
            Values::Float(v) => v.len(),
            Values::Int(v) => v.len(),
        };
        flat.checked_div(self.components).unwrap_or(0)
    }

    fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        match &self.values {
            Values::Float(v) => {
                write_array(out, &self.name, "Float64", self.components, v, |x| x.to_le_bytes())
            }
            Values::Int(v) => {
                write_array(out, &self.name, "Int32", self.components, v, |x| x.to_le_bytes())
            }
        }
    }
}

/// An unstructured grid, written as a `.vtu` file.
///
/// ```
/// use kanagata::geometry::Vec3;
/// use kanagata::report::{CellKind, DataArray, Vtu};
///
/// let mut grid = Vtu::new(vec![Vec3::zeros(), Vec3::x(), Vec3::y()]);
/// grid.push_cell(CellKind::Triangle, &[0, 1, 2]);
/// grid.cell_data.push(DataArray::integer("face", vec![7]));
/// let mut text = Vec::new();
/// grid.write_to(&mut text).unwrap();
/// assert!(text.starts_with(b"<?xml"));
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Vtu {
    points: Vec<Vec3>,
    connectivity: Vec<i64>,
    offsets: Vec<i64>,
    types: Vec<u8>,
    /// Arrays with one tuple per point.
    pub point_data: Vec<DataArray>,
    /// Arrays with one tuple per cell.
    pub cell_data: Vec<DataArray>,
    /// Arrays of the whole grid with one tuple each, for example `TimeValue`.
    pub field_data: Vec<DataArray>,
}

impl Vtu {
    /// A grid of `points` (mm) without cells.
    #[must_use]
    pub fn new(points: Vec<Vec3>) -> Self {
        Self { points, ..Self::default() }
    }

    /// Appends a cell over the given points.
    pub fn push_cell(&mut self, kind: CellKind, nodes: &[u32]) {
        self.connectivity.extend(nodes.iter().map(|&n| i64::from(n)));
        self.offsets.push(self.connectivity.len() as i64);
        self.types.push(kind as u8);
    }

    /// Number of cells.
    #[must_use]
    pub fn cells(&self) -> usize {
        self.types.len()
    }

    /// Writes the file, completely or not at all.
    ///
    /// # Errors
    /// [`WriteError`] when the folder is missing or full, or an array's length is not the number of
    /// points (cells).
    pub fn write(&self, path: &Path) -> Result<(), WriteError> {
        write_atomic(path, |out| self.write_to(out))
    }

    /// Writes the grid to `out`.
    ///
    /// # Errors
    /// Errors of `out`; `InvalidInput` if the length of an array is not the number of points (cells).
    pub fn write_to(&self, out: &mut dyn Write) -> io::Result<()> {
        check_lengths("point", self.points.len(), &self.point_data)?;
        check_lengths("cell", self.cells(), &self.cell_data)?;
        let flat: Vec<f64> = self.points.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
        writeln!(out, "<?xml version=\"1.0\"?>")?;
        writeln!(
            out,
            "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">"
        )?;
        writeln!(out, "<UnstructuredGrid>")?;
        if !self.field_data.is_empty() {
            writeln!(out, "<FieldData>")?;
            for array in &self.field_data {
                array.write(out)?;
            }
            writeln!(out, "</FieldData>")?;
        }
        writeln!(
            out,
            "<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">",
            self.points.len(),
            self.cells()
        )?;
        writeln!(out, "<Points>")?;
        write_array(out, "Points", "Float64", 3, &flat, |x| x.to_le_bytes())?;
        writeln!(out, "</Points>\n<Cells>")?;
        write_array(out, "connectivity", "Int64", 1, &self.connectivity, |x| x.to_le_bytes())?;
        write_array(out, "offsets", "Int64", 1, &self.offsets, |x| x.to_le_bytes())?;
        write_array(out, "types", "UInt8", 1, &self.types, |x| x.to_le_bytes())?;
        writeln!(out, "</Cells>")?;
        for (section, arrays) in [("PointData", &self.point_data), ("CellData", &self.cell_data)] {
            writeln!(out, "<{section}>")?;
            for array in arrays {
                array.write(out)?;
            }
            writeln!(out, "</{section}>")?;
        }
        writeln!(out, "</Piece>\n</UnstructuredGrid>\n</VTKFile>")
    }
}

fn check_lengths(what: &str, count: usize, arrays: &[DataArray]) -> io::Result<()> {
    match arrays.iter().find(|a| a.len() != count) {
        Some(a) => Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            format!("{what} array '{}' has {} tuples for {count} {what}s", a.name, a.len()),
        )),
        None => Ok(()),
    }
}

/// Writes one array inline: base64 of an eight-byte length and the little-endian numbers.
fn write_array<T: Copy, const N: usize>(
    out: &mut dyn Write,
    name: &str,
    kind: &str,
    components: usize,
    values: &[T],
    bytes: impl Fn(T) -> [u8; N],
) -> io::Result<()> {
    let mut raw = Vec::with_capacity(8 + values.len() * N);
    raw.extend(((values.len() * N) as u64).to_le_bytes());
    for &v in values {
        raw.extend(bytes(v));
    }
    let tuples = values.len().checked_div(components).unwrap_or(0);
    let shape = if components == 1 {
        String::new()
    } else {
        format!(" NumberOfComponents=\"{components}\"")
    };
    writeln!(
        out,
        "<DataArray type=\"{kind}\" Name=\"{}\"{shape} NumberOfTuples=\"{tuples}\" format=\"binary\">",
        escaped(name)
    )?;
    out.write_all(STANDARD.encode(raw).as_bytes())?;
    writeln!(out, "\n</DataArray>")
}

/// Writes a `.pvd` collection: time and file (relative to the collection) of every step, in order.
///
/// # Errors
/// [`WriteError`] when the folder is missing or full.
pub fn write_pvd(path: &Path, steps: &[(f64, String)]) -> Result<(), WriteError> {
    write_atomic(path, |out| {
        writeln!(out, "<?xml version=\"1.0\"?>")?;
        writeln!(
            out,
            "<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n<Collection>"
        )?;
        for (time, file) in steps {
            let file = escaped(file);
            writeln!(out, "<DataSet timestep=\"{time}\" group=\"\" part=\"0\" file=\"{file}\"/>")?;
        }
        writeln!(out, "</Collection>\n</VTKFile>")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle() -> Vtu {
        let mut grid = Vtu::new(vec![Vec3::zeros(), Vec3::x(), Vec3::y()]);
        grid.push_cell(CellKind::Triangle, &[0, 1, 2]);
        grid
    }

    /// The bytes of the array called `name`, without the length before them.
    fn decode(text: &str, name: &str) -> Vec<u8> {
        let (_, after) = text.split_once(&format!("Name=\"{name}\"")).unwrap();
        let body = after.split_once(">\n").unwrap().1.split_once('\n').unwrap().0;
        let raw = STANDARD.decode(body).unwrap();
        assert_eq!(u64::from_le_bytes(raw[..8].try_into().unwrap()) as usize, raw.len() - 8);
        raw[8..].to_vec()
    }

    #[test]
    fn arrays_come_back_bit_for_bit() {
        let mut grid = triangle();
        grid.point_data.push(DataArray::vector("u", &[Vec3::new(0.1, -2.0, f64::MAX); 3]));
        grid.cell_data.push(DataArray::integer("face <1>", vec![-7]));
        let mut bytes = Vec::new();
        grid.write_to(&mut bytes).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        assert_eq!(decode(&text, "u")[..8], 0.1f64.to_le_bytes());
        assert_eq!(decode(&text, "u").len(), 72);
        assert_eq!(decode(&text, "face &lt;1&gt;"), (-7i32).to_le_bytes());
        assert_eq!(decode(&text, "types"), [5]);
        assert_eq!(decode(&text, "offsets"), 3i64.to_le_bytes());
    }

    #[test]
    fn an_array_of_the_wrong_length_is_refused_and_no_file_is_left() {
        let mut grid = triangle();
        grid.point_data.push(DataArray::scalar("thickness", vec![1.0]));
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.vtu");
        let message = grid.write(&path).unwrap_err().to_string();
        assert!(message.contains("'thickness' has 1 tuples for 3 points"), "{message}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn a_collection_lists_its_steps_in_order() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.pvd");
        write_pvd(&path, &[(0.0, "steps/0.vtu".into()), (0.25, "steps/a&b.vtu".into())]).unwrap();
        let text = std::fs::read_to_string(path).unwrap();
        let (first, second) =
            (text.find("steps/0.vtu").unwrap(), text.find("timestep=\"0.25\"").unwrap());
        assert!(first < second && text.contains("a&amp;b"));
    }
}
