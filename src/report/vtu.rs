//! VTK XML files of unstructured grids (`.vtu`) with base64 binary arrays.

use std::io::{self, Write};
use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::foreign::escaped;
use kanagata_files::{WriteError, write_atomic};
use kanagata_geometry::Vec3;

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
    Single(Vec<f32>),
    Int(Vec<i32>),
    Byte(Vec<u8>),
}

/// A named array of point, cell or field data.
#[derive(Debug, Clone, PartialEq)]
pub struct DataArray {
    name: String,
    components: usize,
    /// Names of the components; empty for none.
    labels: &'static [&'static str],
    values: Values,
}

/// Names of the components of a vector, of a symmetric tensor in VTK's order, and of principal values.
const XYZ: [&str; 3] = ["X", "Y", "Z"];
const SYMMETRIC: [&str; 6] = ["XX", "YY", "ZZ", "XY", "YZ", "XZ"];
const PRINCIPAL: [&str; 3] = ["1", "2", "3"];

impl DataArray {
    fn new(name: impl Into<String>, labels: &'static [&'static str], values: Values) -> Self {
        Self { name: name.into(), components: labels.len().max(1), labels, values }
    }

    /// One number per point or cell.
    pub fn scalar(name: impl Into<String>, values: Vec<f64>) -> Self {
        Self::new(name, &[], Values::Float(values))
    }

    /// One number per point or cell, in single precision.
    pub fn single(name: impl Into<String>, values: impl IntoIterator<Item = f64>) -> Self {
        Self::new(name, &[], Values::Single(values.into_iter().map(|x| x as f32).collect()))
    }

    /// One integer per point or cell.
    pub fn integer(name: impl Into<String>, values: Vec<i32>) -> Self {
        Self::new(name, &[], Values::Int(values))
    }

    /// One integer from 0 to 255 per point or cell.
    pub fn byte(name: impl Into<String>, values: Vec<u8>) -> Self {
        Self::new(name, &[], Values::Byte(values))
    }

    /// One vector per point or cell.
    pub fn vector(name: impl Into<String>, values: &[Vec3]) -> Self {
        let flat = values.iter().flat_map(|v| [v.x, v.y, v.z]).collect();
        Self::new(name, &XYZ, Values::Float(flat))
    }

    /// One vector per point or cell, in single precision.
    pub fn single_vector(name: impl Into<String>, values: &[Vec3]) -> Self {
        let flat = values.iter().flat_map(|v| [v.x, v.y, v.z]).map(|x| x as f32);
        Self::new(name, &XYZ, Values::Single(flat.collect()))
    }

    /// One symmetric tensor `xx, yy, zz, xy, yz, xz` per point or cell, in single precision.
    pub fn symmetric(name: impl Into<String>, values: impl Iterator<Item = [f64; 6]>) -> Self {
        let flat = values.flatten().map(|x| x as f32).collect();
        Self::new(name, &SYMMETRIC, Values::Single(flat))
    }

    /// Three principal values per point or cell, in single precision.
    pub fn principal(name: impl Into<String>, values: impl Iterator<Item = [f64; 3]>) -> Self {
        let flat = values.flatten().map(|x| x as f32).collect();
        Self::new(name, &PRINCIPAL, Values::Single(flat))
    }

    fn len(&self) -> usize {
        let flat = match &self.values {
            Values::Float(v) => v.len(),
            Values::Single(v) => v.len(),
            Values::Int(v) => v.len(),
            Values::Byte(v) => v.len(),
        };
        flat.checked_div(self.components).unwrap_or(0)
    }

    fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        let Self { name, labels, .. } = self;
        match &self.values {
            Values::Float(v) => write_array(out, (name, labels), "Float64", v, |x| x.to_le_bytes()),
            Values::Single(v) => {
                write_array(out, (name, labels), "Float32", v, |x| x.to_le_bytes())
            }
            Values::Int(v) => write_array(out, (name, labels), "Int32", v, |x| x.to_le_bytes()),
            Values::Byte(v) => write_array(out, (name, labels), "UInt8", v, |x| x.to_le_bytes()),
        }
    }
}

/// An unstructured grid, written as a `.vtu` file.
///
/// ```
/// use kanagata_geometry::Vec3;
/// use kanagata_report::{CellKind, DataArray, Vtu};
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
    connectivity: Vec<u32>,
    offsets: Vec<usize>,
    types: Vec<u8>,
    /// Whether the points are written in single precision.
    pub single_points: bool,
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
        self.connectivity.extend(nodes);
        self.offsets.push(self.connectivity.len());
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
        let points = if self.single_points { DataArray::single_vector } else { DataArray::vector };
        points("Points", &self.points).write(out)?;
        writeln!(out, "</Points>\n<Cells>")?;
        self.write_cells(out)?;
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

    /// Writes the arrays of the cells: ids of four bytes where they are large enough.
    fn write_cells(&self, out: &mut dyn Write) -> io::Result<()> {
        let plain = |name| (name, &[][..]);
        let (ids, ends) = (&self.connectivity, &self.offsets);
        let fits = i32::try_from(ids.len().max(self.points.len())).is_ok();
        if fits {
            write_array(out, plain("connectivity"), "Int32", ids, |id| id.to_le_bytes())?;
            write_array(out, plain("offsets"), "Int32", ends, |end| (end as u32).to_le_bytes())?;
        } else {
            let wide = |id| u64::from(id).to_le_bytes();
            write_array(out, plain("connectivity"), "Int64", ids, wide)?;
            write_array(out, plain("offsets"), "Int64", ends, |end| (end as u64).to_le_bytes())?;
        }
        write_array(out, plain("types"), "UInt8", &self.types, |kind| kind.to_le_bytes())
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

/// Writes one array inline: base64 of an eight-byte length and the little-endian numbers. Without names of components it
/// has one.
fn write_array<T: Copy, const N: usize>(
    out: &mut dyn Write,
    (name, labels): (&str, &[&str]),
    kind: &str,
    values: &[T],
    bytes: impl Fn(T) -> [u8; N],
) -> io::Result<()> {
    let mut raw = Vec::with_capacity(8 + values.len() * N);
    raw.extend(((values.len() * N) as u64).to_le_bytes());
    for &v in values {
        raw.extend(bytes(v));
    }
    write!(out, "<DataArray type=\"{kind}\" Name=\"{}\"", escaped(name))?;
    if !labels.is_empty() {
        write!(out, " NumberOfComponents=\"{}\"", labels.len())?;
    }
    for (k, label) in labels.iter().enumerate() {
        write!(out, " ComponentName{k}=\"{label}\"")?;
    }
    let tuples = values.len() / labels.len().max(1);
    writeln!(out, " NumberOfTuples=\"{tuples}\" format=\"binary\">")?;
    out.write_all(STANDARD.encode(raw).as_bytes())?;
    writeln!(out, "\n</DataArray>")
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
        assert_eq!(decode(&text, "offsets"), 3i32.to_le_bytes());
        assert_eq!(decode(&text, "Points").len(), 72);
        grid.single_points = true;
        let mut bytes = Vec::new();
        grid.write_to(&mut bytes).unwrap();
        assert_eq!(decode(&String::from_utf8(bytes).unwrap(), "Points").len(), 36);
    }

    #[test]
    fn tensors_have_named_components_in_the_order_of_vtk() {
        let mut grid = triangle();
        let tensor = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        grid.cell_data.push(DataArray::symmetric("s", [tensor].into_iter()));
        grid.cell_data.push(DataArray::principal("p", [[3.0, 2.0, 1.0]].into_iter()));
        grid.cell_data.push(DataArray::byte("b", vec![200]));
        let mut bytes = Vec::new();
        grid.write_to(&mut bytes).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        let names = "ComponentName0=\"XX\" ComponentName1=\"YY\" ComponentName2=\"ZZ\" ComponentName3=\"XY\" \
                     ComponentName4=\"YZ\" ComponentName5=\"XZ\"";
        assert!(text.contains(names), "{text}");
        let single: Vec<u8> = (1..=6).flat_map(|k| (k as f32).to_le_bytes()).collect();
        assert_eq!(decode(&text, "s"), single);
        let read = crate::vtu_read::parse(text.as_bytes()).unwrap().cell_data;
        let all: Vec<_> = read.iter().map(|a| (a.components, a.values.clone())).collect();
        assert_eq!(all, [(6, tensor.into()), (3, vec![3.0, 2.0, 1.0]), (1, vec![200.0])]);
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
}
