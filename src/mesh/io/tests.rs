use std::path::Path;

use super::*;
use crate::{Element, MeshError, SurfaceMesh};
use kanagata_geometry::Vec3;

/// Two quads and a triangle on faces 0 and 3.
fn sample() -> SurfaceMesh {
    let p = |x: f64, y: f64| Vec3::new(x, y, 0.1 * x * y);
    SurfaceMesh {
        vertices: vec![
            p(0.0, 0.0),
            p(1.0, 0.0),
            p(1.0, 1.0),
            p(0.0, 1.0),
            p(2.0, 0.0),
            p(2.0, 1.0),
        ],
        elements: vec![
            Element::quad([0, 1, 2, 3], 0),
            Element::triangle([1, 4, 2], 3),
            Element::triangle([4, 5, 2], 3),
        ],
        ..SurfaceMesh::default()
    }
}

fn parse(text: &str) -> Result<SurfaceMesh, MeshError> {
    msh_read::parse(text.as_bytes(), "t.msh")
}

#[test]
fn msh_and_vtu_come_back() {
    let folder = tempfile::tempdir().unwrap();
    for (name, shift) in [("a.msh", 1), ("a.vtu", 0)] {
        let path = folder.path().join(name);
        write(&sample(), &path).unwrap();
        let back = read(&path).unwrap();
        assert_eq!(back.vertices, sample().vertices);
        let faces: Vec<u32> = back.elements.iter().map(|e| e.face).collect();
        assert_eq!(faces, [shift, 3 + shift, 3 + shift]);
        assert!(back.elements.iter().zip(sample().elements).all(|(a, b)| a.nodes() == b.nodes()));
    }
}

const MSH2: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n7 0 0 0\n8 1 0 0\n9 0 1 0\n\
                    $EndNodes\n$Elements\n2\n1 15 2 0 1 7\n2 2 2 0 5 7 8 9\n$EndElements\n";

#[test]
fn msh_2_text_and_binary_agree() {
    let mut binary = b"$MeshFormat\n2.2 1 8\n\x01\0\0\0\n$EndMeshFormat\n$Nodes\n3\n".to_vec();
    for (tag, x, y) in [(7i32, 0.0f64, 0.0f64), (8, 1.0, 0.0), (9, 0.0, 1.0)] {
        binary.extend(tag.to_le_bytes());
        [x, y, 0.0].iter().for_each(|v| binary.extend(v.to_le_bytes()));
    }
    binary.extend(b"\n$EndNodes\n$Elements\n1\n");
    [2, 1, 2, 2, 0, 5, 7, 8, 9].iter().for_each(|v: &i32| binary.extend(v.to_le_bytes()));
    binary.extend(b"\n$EndElements\n");
    let (text, raw) = (parse(MSH2).unwrap(), msh_read::parse(&binary, "b.msh").unwrap());
    assert_eq!(text, raw);
    assert_eq!(text.elements, vec![Element::triangle([0, 1, 2], 5)]);
    // A truncated file is an error or a smaller mesh, never a panic.
    for k in 0..binary.len() {
        let _ = msh_read::parse(&binary[..k], "cut.msh");
    }
}

#[test]
fn msh_4_binary_is_read() {
    let mut b = b"$MeshFormat\n4.1 1 8\n\x01\0\0\0\n$EndMeshFormat\n$Nodes\n".to_vec();
    let sizes = |b: &mut Vec<u8>, v: &[u64]| v.iter().for_each(|x| b.extend(x.to_le_bytes()));
    let ints = |b: &mut Vec<u8>, v: &[i32]| v.iter().for_each(|x| b.extend(x.to_le_bytes()));
    sizes(&mut b, &[1, 4, 1, 4]);
    ints(&mut b, &[2, 6, 0]);
    sizes(&mut b, &[4, 1, 2, 3, 4]);
    for x in [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0f64] {
        b.extend(x.to_le_bytes());
    }
    b.extend(b"\n$EndNodes\n$Elements\n");
    sizes(&mut b, &[1, 1, 1, 1]);
    ints(&mut b, &[2, 6, 3]);
    sizes(&mut b, &[1, 1, 1, 2, 3, 4]);
    b.extend(b"\n$EndElements\n");
    let mesh = msh_read::parse(&b, "b.msh").unwrap();
    assert_eq!(mesh.elements, vec![Element::quad([0, 1, 2, 3], 6)]);
    for k in 0..b.len() {
        let _ = msh_read::parse(&b[..k], "cut.msh");
    }
}

#[test]
fn broken_msh_says_where_and_what() {
    let message = |text: &str| parse(text).unwrap_err().to_string();
    let bad = message(&MSH2.replace("8 1 0 0", "8 1 x 0"));
    assert!(bad.contains("t.msh, line 7: 'x'; allowed: a number"), "{bad}");
    let bad = message(&MSH2.replace("5 7 8 9", "5 7 8 99"));
    assert!(bad.contains("an element that uses node 99"), "{bad}");
    assert!(message(&MSH2.replace("2.2", "4.0")).contains("MSH version 4"));
    // A count far beyond the data fails at the end of the file without allocating memory for it.
    let bad =
        message("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 9 1 9\n2 1 0 99999999999999\n1 2");
    assert!(bad.contains("the end of the file"), "{bad}");
    assert!(message("").contains("$MeshFormat"));
}

#[test]
fn stl_corners_are_merged() {
    let text = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n\
                endloop\nendfacet\nfacet normal 0 0 1\nouter loop\nvertex 1 0 0\nvertex 1 1 0\n\
                vertex -0 1 0\nendloop\nendfacet\nendsolid\n";
    let mesh = stl::parse(text.as_bytes(), "a.stl").unwrap();
    assert_eq!((mesh.vertices.len(), mesh.elements.len()), (4, 2));
    let mut binary = vec![b's'; 80];
    binary.extend(2u32.to_le_bytes());
    for e in &mesh.elements {
        binary.extend([0u8; 12]);
        for p in mesh.corners(e) {
            p.iter().for_each(|x| binary.extend((*x as f32).to_le_bytes()));
        }
        binary.extend([0u8; 2]);
    }
    assert_eq!(stl::parse(&binary, "b.stl").unwrap(), mesh);
    assert!(stl::parse(b"hello", "c.stl").unwrap_err().to_string().contains("'hello'"));
}

#[test]
fn obj_takes_slashes_and_negative_numbers() {
    let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv -1 .5 0\nvn 0 0 1\nvn 1 0 0\n\
                vn 0 1 0\nf 1/2 2/2/3 3//1 4\nf -1 1 4\nf 1 2 3 4 5\n";
    let mesh = obj::parse(text.as_bytes(), "a.obj").unwrap().mesh;
    assert_eq!(mesh.elements.len(), 2 + 3);
    assert_eq!(mesh.elements[1].nodes(), [4, 0, 3]);
    let bad = obj::parse(b"v 0 0 0\nf 1 2 9\n", "b.obj").unwrap_err().to_string();
    assert!(bad.contains("b.obj, line"), "{bad}");
}

#[test]
fn endings_this_program_does_not_know_are_named() {
    let bad = write(&sample(), Path::new("x.ply")).unwrap_err().to_string();
    assert!(bad.contains("'.ply'") && bad.contains(".msh, .vtu"), "{bad}");
    assert!(matches!(read(Path::new("none.msh")), Err(MeshError::Read { .. })));
}

/// Two quads and a triangle as an Abaqus deck.
const DECK: &str = "*NODE\n1, 0., 0., 0.\n2, 1., 0., 0.25\n3, 1., 1., 0.1\n4, 0., 1., 0.\n5, 2., 0., 0.\n6, 2., 1., 0.\n\
                    *ELEMENT, TYPE=S4\n1, 1, 2, 3, 4\n2, 2, 5, 6, 3\n*ELEMENT, TYPE=S3\n3, 1, 2, 4\n";

/// A Python that has meshio, if there is one.
fn python_with_meshio() -> Option<std::path::PathBuf> {
    let own =
        Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join(".local/venv/bin/python");
    let named = std::env::var_os("KANAGATA_PYTHON").map(std::path::PathBuf::from);
    [named, Some(own), Some("python3".into())].into_iter().flatten().find(|p| {
        let asked = std::process::Command::new(p).args(["-c", "import meshio"]).output();
        asked.is_ok_and(|o| o.status.success())
    })
}

#[test]
fn other_formats_are_read_by_meshio() {
    let Some(python) = python_with_meshio() else {
        crate::skipping::skip(crate::skipping::MESHIO);
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("deck.inp");
    std::fs::write(&path, DECK).unwrap();
    let mesh = meshio::read_with(&python, &path, "deck.inp").unwrap().mesh;
    let sizes: Vec<usize> = mesh.elements.iter().map(|e| e.nodes().len()).collect();
    assert_eq!(sizes, [4, 4, 3]);
    assert_eq!(mesh.vertices[1], Vec3::new(1.0, 0.0, 0.25));
    assert!(mesh.elements.iter().all(|e| e.face == UNATTACHED));
    let path = folder.path().join("normals.vtk");
    let text = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 3 double\n0 0 0 1 0 0 0 1 0\n\
                CELLS 1 4\n3 0 1 2\nCELL_TYPES 1\n5\nPOINT_DATA 3\nVECTORS Normals double\n0 0 1 0 0 1 0 0 1\n";
    std::fs::write(&path, text).unwrap();
    let file = meshio::read_with(&python, &path, "normals.vtk").unwrap();
    assert_eq!(file.normals[0][..3], [Vec3::z(); 3]);
    for (name, text) in
        [("torn.inp", &DECK[..60]), ("what.xyzzy", "?"), ("points.inp", &DECK[..30])]
    {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        let said = meshio::read_with(&python, &path, name).unwrap_err().to_string();
        assert!(said.starts_with(&format!("meshio cannot read {name}: ")), "{said}");
    }
}

#[cfg(unix)]
#[test]
fn without_meshio_it_is_said_what_to_install() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let deck = folder.path().join("deck.bdf");
    std::fs::write(&deck, "GRID\n").unwrap();
    let python = folder.path().join("python");
    let script = "#!/bin/sh\necho \"No module named 'meshio'\" >&2\nexit 77\n";
    std::fs::write(&python, script).unwrap();
    std::fs::set_permissions(&python, std::fs::Permissions::from_mode(0o755)).unwrap();
    for (program, why) in [(python.as_path(), "No module"), (Path::new("no/python"), "not start")] {
        let said = meshio::read_with(program, &deck, "deck.bdf").unwrap_err().to_string();
        let remedy = ["deck.bdf", "pip install meshio", "KANAGATA_PYTHON", ".msh, .stl", why];
        assert!(remedy.iter().all(|w| said.contains(w)), "{said}");
    }
}

/// An L of 300 mm2 as one face.
const L_SHAPE: &str = "v 0 0 0\nv 20 0 0\nv 20 10 0\nv 10 10 0\nv 10 20 0\nv 0 20 0\n";

fn area(mesh: &SurfaceMesh) -> f64 {
    let fan = |e: &Element| {
        let p = mesh.corners(e);
        let cross = |k: usize| (p[k] - p[0]).cross(&(p[k + 1] - p[0]));
        0.5 * (1..p.len() - 1).map(cross).sum::<Vec3>().norm()
    };
    mesh.elements.iter().map(fan).sum()
}

#[test]
fn concave_faces_of_obj_keep_their_area_from_any_corner_and_crossing_ones_name_their_line() {
    for first in 0..6 {
        let ids: Vec<String> = (0..6).map(|k| ((first + k) % 6 + 1).to_string()).collect();
        let text = format!("{L_SHAPE}f {}\n", ids.join(" "));
        let mesh = obj::parse(text.as_bytes(), "l.obj").unwrap().mesh;
        assert_eq!((mesh.elements.len(), area(&mesh)), (4, 300.0), "{first}");
    }
    // A concave quadrilateral, from its concave corner.
    let dart = format!("{L_SHAPE}v 4 4 0\nf 7 6 1 2\n");
    let mesh = obj::parse(dart.as_bytes(), "d.obj").unwrap().mesh;
    assert_eq!((mesh.elements.len(), area(&mesh)), (2, 80.0));
    let crossing = format!("{L_SHAPE}f 1 2 3 6\nf 1 3 2 6 5\n");
    let message = obj::parse(crossing.as_bytes(), "x.obj").unwrap_err().to_string();
    assert!(message.contains("line 8") && message.contains("cross"), "{message}");
}

/// A VTU file of one cell over the points of an L.
fn one_cell(kind: u8, nodes: &str) -> String {
    let count = nodes.split(' ').count();
    format!(
        "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece NumberOfPoints=\"6\" NumberOfCells=\"1\"><Points>\
         <DataArray NumberOfComponents=\"3\" format=\"ascii\">0 0 0 20 0 0 20 10 0 10 10 0 10 20 0 0 20 0</DataArray>\
         </Points><Cells><DataArray Name=\"connectivity\" format=\"ascii\">{nodes}</DataArray>\
         <DataArray Name=\"offsets\" format=\"ascii\">{count}</DataArray>\
         <DataArray Name=\"types\" format=\"ascii\">{kind}</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>"
    )
}

#[test]
fn polygons_pixels_and_strips_of_vtu_are_surfaces_and_crossing_ones_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("one.vtu");
    let read_one = |kind: u8, nodes: &str| {
        std::fs::write(&path, one_cell(kind, nodes)).unwrap();
        read(&path)
    };
    let cases = [
        (7, "0 1 2 3 4 5", 4, 300.0),
        (9, "5 3 2 0", 2, 150.0),
        (8, "0 1 5 4", 1, 300.0),
        (6, "0 1 3 2", 2, 150.0),
        (22, "0 1 5 0 3 0", 1, 200.0),
        (3, "0 1", 0, 0.0),
    ];
    for (kind, nodes, count, exact) in cases {
        let mesh = read_one(kind, nodes).unwrap();
        assert_eq!((mesh.elements.len(), area(&mesh)), (count, exact), "{kind}");
    }
    for (kind, nodes, what) in [(9, "0 2 1 5", "cross"), (9, "0 1 2", "with 3 points")] {
        let message = read_one(kind, nodes).unwrap_err().to_string();
        assert!(message.contains("cell 0") && message.contains(what), "{message}");
    }
}

#[test]
fn counts_that_lie_are_errors_in_every_format() {
    let cases = [
        (MSH2.replace("$Nodes\n3", "$Nodes\n2"), "line 8", "$EndNodes"),
        (MSH2.replace("$Nodes\n3", "$Nodes\n4"), "line 9", "$EndNodes"),
        (MSH2.replace("$Elements\n2", "$Elements\n1"), "line 13", "$EndElements"),
        (MSH2.replace("\n9 0 1 0", "\n8 0 1 0"), "line 8", "node 8 a second time"),
        (MSH2.replace("9 0 1 0", "9 0 nan 0"), "line 8", "finite"),
        (MSH2.replace("7 8 9\n$EndE", "7 8 5\n$EndE"), "node 5", "$Nodes"),
    ];
    for (text, place, what) in cases {
        let message = parse(&text).unwrap_err().to_string();
        assert!(message.contains(place) && message.contains(what), "{message}");
    }
    let solid = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n\
                 endfacet\n";
    assert!(stl::parse(format!("{solid}endsolid a\n").as_bytes(), "a.stl").is_ok());
    let message = stl::parse(solid.as_bytes(), "a.stl").unwrap_err().to_string();
    assert!(message.contains("endsolid"), "{message}");
}
