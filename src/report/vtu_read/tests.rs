use super::super::vtu::{CellKind, DataArray, Vtu};
use super::*;

fn written() -> Vec<u8> {
    let mut grid = Vtu::new(vec![Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::new(1.0, 1.0, 0.25)]);
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

/// Files of other programs (fixtures/vtu, from `tools/peers/vtu.py`): the same grid in every form they write.
const FORMS: [(&str, &[u8]); 6] = [
    ("meshio, zlib", include_bytes!("../../../fixtures/vtu/meshio.vtu")),
    ("VTK, ascii", include_bytes!("../../../fixtures/vtu/ascii.vtu")),
    ("VTK, base64, zlib in blocks", include_bytes!("../../../fixtures/vtu/inline.vtu")),
    ("VTK, base64, big-endian", include_bytes!("../../../fixtures/vtu/big-endian.vtu")),
    ("VTK, appended, zlib, wide lengths", include_bytes!("../../../fixtures/vtu/appended.vtu")),
    ("VTK, appended as base64", include_bytes!("../../../fixtures/vtu/appended-base64.vtu")),
];

#[test]
fn every_form_of_other_programs_gives_the_same_grid() {
    for (form, text) in FORMS {
        let grid = parse(text).unwrap_or_else(|e| panic!("{form}: {e:?}"));
        assert_eq!((grid.points.len(), grid.cells.len()), (24, 8), "{form}");
        for (k, p) in grid.points.iter().enumerate() {
            let (i, j, h) = (k % 4, k / 4 % 3, k / 12);
            assert_eq!(*p, Vec3::new(i as f64 / 3.0, 0.1 * j as f64, 0.7 * h as f64), "{form}");
        }
        assert_eq!(grid.cells[5], (12, vec![6, 7, 11, 10, 18, 19, 23, 22]), "{form}");
        assert_eq!(grid.cells[6], (9, vec![0, 1, 5, 4]), "{form}");
        let heat = grid.point_data.iter().find(|a| a.name == "heat").unwrap();
        assert!(heat.values.iter().enumerate().all(|(k, v)| *v == (k * k) as f64 / 7.0), "{form}");
        let part = grid.cell_data.iter().find(|a| a.name == "part").unwrap();
        assert_eq!(part.values, [-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0], "{form}");
    }
}

#[test]
fn files_cut_or_with_a_byte_changed_are_errors_or_grids_and_never_a_panic() {
    for (form, text) in FORMS {
        let mut failed = 0;
        for k in (0..text.len()).step_by(5) {
            failed += usize::from(parse(&text[..k]).is_err());
            let mut changed = text.to_vec();
            changed[k] = changed[k].wrapping_add(1 + (k % 250) as u8);
            let _ = parse(&changed);
        }
        assert!(failed > text.len() / 10, "{form}: {failed}");
    }
}

#[test]
fn a_compressor_that_is_not_read_is_named() {
    let text = String::from_utf8(written()).unwrap();
    let text = text.replace("<VTKFile ", "<VTKFile compressor=\"vtkLZ4DataCompressor\" ");
    let (place, found) = parse(text.as_bytes()).unwrap_err();
    assert!(place == "VTKFile" && found.contains("vtkLZ4"), "{found}");
}

#[test]
fn every_truncation_and_wrong_id_is_an_error_and_never_a_panic() {
    let bytes = written();
    for end in (0..bytes.len() - 20).step_by(7) {
        assert!(parse(&bytes[..end]).is_err(), "{end}");
    }
    let text = String::from_utf8(bytes).unwrap().replace("UInt64", "UInt32");
    let _ = parse(text.as_bytes());
    let ascii = "<VTKFile type=\"UnstructuredGrid\"><Piece NumberOfPoints=\"1\" NumberOfCells=\"1\"><Points><DataArray type=\"Float64\" \
         NumberOfComponents=\"3\" format=\"ascii\">0 0 0</DataArray></Points><Cells>\
         <DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 7</DataArray>\
         <DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">2</DataArray>\
         <DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">3</DataArray></Cells></Piece></VTKFile>";
    let (place, found) = parse(ascii.as_bytes()).unwrap_err();
    assert_eq!((place.as_str(), found.as_str()), ("connectivity", "point 7 of 1 in cell 0"));
}

#[test]
fn arrays_that_do_not_fit_the_declared_counts_are_refused_by_name() {
    const GRID: &str = "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid>\
        <Piece NumberOfPoints=\"4\" NumberOfCells=\"2\"><Points>\
        <DataArray NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 1 1 0 0 1 0</DataArray></Points><Cells>\
        <DataArray Name=\"connectivity\" format=\"ascii\">0 1 2 0 2 3</DataArray>\
        <DataArray Name=\"offsets\" format=\"ascii\">3 6</DataArray>\
        <DataArray Name=\"types\" format=\"ascii\">5 5</DataArray></Cells><CellData>\
        <DataArray Name=\"face\" format=\"ascii\">7 8</DataArray></CellData></Piece></UnstructuredGrid></VTKFile>";
    assert_eq!(parse(GRID.as_bytes()).unwrap().cells.len(), 2);
    let cases = [
        (">5 5<", ">5<", "types", "1 entries for the 2 cells"),
        (">5 5<", ">5 5 5<", "types", "3 entries"),
        (">5 5<", ">5 5.5<", "types", "5.5"),
        (">5 5<", ">5 -5<", "types", "-5"),
        (">3 6<", ">3<", "offsets", "1 entries for the 2 cells"),
        (">3 6<", ">3 5<", "connectivity", "6 entries, of which the cells use 5"),
        (">3 6<", ">3 2<", "offsets", "cell 1 ends at 2"),
        (">3 6<", ">3 nan<", "offsets", "NaN"),
        ("0 2 3<", "0 2 3 1<", "connectivity", "7 entries"),
        ("0 2 3<", "0 2 4<", "connectivity", "point 4 of 4 in cell 1"),
        ("0 2 3<", "0 2 1.5<", "connectivity", "1.5"),
        ("OfPoints=\"4\"", "OfPoints=\"9\"", "Points", "4 entries for the 9 points"),
        ("OfCells=\"2\"", "OfCells=\"7\"", "offsets", "2 entries for the 7 cells"),
        ("OfCells=\"2\"", "OfCells=\"x\"", "Piece", "NumberOfCells"),
        (" NumberOfPoints=\"4\"", "", "Piece", "NumberOfPoints"),
        ("0 1 0<", "0 1<", "Points", "11 numbers"),
        ("0 1 0<", "0 inf 0<", "Points", "point 3"),
        (">7 8<", ">7<", "face", "1 numbers for 2 tuples"),
    ];
    for (from, to, place, what) in cases {
        assert!(GRID.contains(from), "{from}");
        let (at, found) = parse(GRID.replace(from, to).as_bytes()).unwrap_err();
        assert!(at == place && found.contains(what), "{to}: {at}: {found}");
    }
}

/// An array belongs to the element that holds it, not to the section before.
#[test]
fn arrays_of_unknown_elements_are_of_no_section() {
    const OTHER: &str =
        "<Extra><DataArray NumberOfComponents=\"3\" format=\"ascii\">9 9 9</DataArray></Extra>";
    let grid = format!(
        "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece NumberOfPoints=\"1\" NumberOfCells=\"0\">\
         <Points><DataArray NumberOfComponents=\"3\" format=\"ascii\">1 2 3</DataArray></Points>{OTHER}\
         <PointData><DataArray Name=\"heat\" format=\"ascii\">4</DataArray>{OTHER}</PointData>{OTHER}\
         </Piece>{OTHER}</UnstructuredGrid></VTKFile>"
    );
    let grid = parse(grid.as_bytes()).unwrap();
    assert_eq!(grid.points, [Vec3::new(1.0, 2.0, 3.0)]);
    assert_eq!(grid.point_data.len(), 1);
    assert_eq!(
        (grid.point_data[0].name.as_str(), &grid.point_data[0].values[..]),
        ("heat", &[4.0][..])
    );
}

#[test]
fn an_empty_piece_may_close_itself() {
    let grid = |points: usize| {
        format!(
            "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid>\
             <Piece NumberOfPoints=\"{points}\" NumberOfCells=\"0\"/></UnstructuredGrid></VTKFile>"
        )
    };
    assert_eq!(parse(grid(0).as_bytes()), Ok(Grid::default()));
    let (place, found) = parse(grid(2).as_bytes()).unwrap_err();
    assert!(place == "Points" && found.contains("for the 2 points"), "{place}: {found}");
}

/// Zeros compress by a factor of a thousand, and arrays may share an offset: the total of declared numbers is limited by
/// the size of the file.
#[test]
fn compressed_arrays_may_not_say_far_more_than_the_file_holds() {
    use base64::Engine;
    use std::io::Write;
    let grid = |numbers: usize, arrays: usize| {
        let mut zlib = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
        zlib.write_all(&vec![0; 8 * numbers]).unwrap();
        let packed = zlib.finish().unwrap();
        let lengths = [1, 8 * numbers as u64, 8 * numbers as u64, packed.len() as u64];
        let head: Vec<u8> = lengths.iter().flat_map(|n| n.to_le_bytes()).collect();
        let text = |bytes: &[u8]| base64::engine::general_purpose::STANDARD.encode(bytes);
        let array = "<DataArray type=\"Float64\" Name=\"a\" format=\"appended\" offset=\"0\"/>"
            .repeat(arrays);
        format!(
            "<VTKFile type=\"UnstructuredGrid\" header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\">\
             <Piece NumberOfPoints=\"0\" NumberOfCells=\"0\"><FieldData>{array}</FieldData></Piece>\
             <AppendedData encoding=\"base64\">_{}{}</AppendedData></VTKFile>",
            text(&head),
            text(&packed)
        )
    };
    assert_eq!(parse(grid(1_000_000, 1).as_bytes()), Ok(Grid::default()));
    for (numbers, arrays) in [(2_000_000, 1), (100_000, 40)] {
        let text = grid(numbers, arrays);
        assert!(text.len() < 50_000, "{}", text.len());
        let (place, found) = parse(text.as_bytes()).unwrap_err();
        assert!(place == "a" && found.contains("a file of this size"), "{place}: {found}");
    }
}
