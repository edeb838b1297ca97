//! MSH 2.2 and 4.1, ASCII and binary: nodes, surface triangles and quadrilaterals, and hexahedra (corner nodes of
//! elements of higher order). All other sections and elements are ignored.

use super::cursor::Cursor;
use super::mesh_file::UNATTACHED;
use super::polygon;
use super::tags::Tags;
use super::volumes::{Volumes, is_result};
use crate::{Element, MeshError, SurfaceMesh};
use kanagata_geometry::Vec3;

/// Number of corners of hexahedral element types, 0 for other volume types, `None` for other types.
fn volume_type(kind: i64) -> Option<usize> {
    match kind {
        5 | 12 | 17 | 92 | 93 => Some(8),
        4 | 6 | 7 | 11 | 13 | 14 | 18 | 19 | 29 | 30 | 31 => Some(0),
        _ => None,
    }
}

/// Number of nodes and corners of an element type; 0 corners for types that are not surface elements.
fn element_type(kind: i64) -> Option<(usize, usize)> {
    Some(match kind {
        2 => (3, 3),
        9 => (6, 3),
        20 => (9, 3),
        21 => (10, 3),
        22 => (12, 3),
        23 | 24 => (15, 3),
        25 => (21, 3),
        3 => (4, 4),
        16 => (8, 4),
        10 => (9, 4),
        15 => (1, 0),
        1 => (2, 0),
        8 => (3, 0),
        4 | 26 => (4, 0),
        7 | 27 => (5, 0),
        6 | 28 => (6, 0),
        5 => (8, 0),
        11 => (10, 0),
        12 => (27, 0),
        13 => (18, 0),
        14 => (14, 0),
        17 | 29 => (20, 0),
        18 => (15, 0),
        19 => (13, 0),
        30 => (35, 0),
        31 => (56, 0),
        92 => (64, 0),
        93 => (125, 0),
        _ => return None,
    })
}

/// A surface element: the tags of its three or four corners, and its surface.
struct Cell {
    tags: [u64; 4],
    corners: usize,
    surface: u32,
}

struct Reader<'a> {
    cursor: Cursor<'a>,
    version: f64,
    vertices: Vec<Vec3>,
    ids: Tags,
    /// Surface elements, resolved when all nodes are known.
    cells: Vec<Cell>,
    /// Corner tags of hexahedra.
    hexahedra: Vec<[u64; 8]>,
    /// Error for the first volume element that is not a hexahedron.
    other: Option<MeshError>,
}

/// Parses the surfaces of a MSH file; `file` is used in messages.
pub fn parse(bytes: &[u8], file: &str) -> Result<SurfaceMesh, MeshError> {
    read(bytes, file)?.surfaces(ConcaveQuads::Divide)
}

/// As [`parse`], with concave and self-intersecting quadrilaterals unchanged; the caller checks them.
pub fn parse_unchecked(bytes: &[u8], file: &str) -> Result<SurfaceMesh, MeshError> {
    read(bytes, file)?.surfaces(ConcaveQuads::Keep)
}

/// Treatment of non-convex quadrilaterals.
#[derive(Clone, Copy, PartialEq, Eq)]
enum ConcaveQuads {
    /// Divided into triangles, or rejected.
    Divide,
    /// Unchanged.
    Keep,
}

/// Names of the fields of an MSH file (`$NodeData`, `$ElementData`) that contain results.
pub fn fields(bytes: &[u8]) -> Vec<String> {
    let mut lines = bytes.split(|b| *b == b'\n').map(<[u8]>::trim_ascii);
    let mut out = Vec::new();
    while let Some(line) = lines.next() {
        if ![&b"$NodeData"[..], b"$ElementData", b"$ElementNodeData"].contains(&line) {
            continue;
        }
        // The number of names, and the first of them in quotes.
        let name = lines.nth(1).map(String::from_utf8_lossy).unwrap_or_default();
        let name = name.trim_matches('"');
        // The values are not parsed: 0 and 1 represent a field that is not constant.
        if is_result(name, &[0.0, 1.0]) {
            out.push(name.to_owned());
        }
    }
    out
}

/// Parses the hexahedra of an MSH file or, without any, its surfaces.
pub fn parse_sheet(bytes: &[u8], file: &str) -> Result<Result<Volumes, SurfaceMesh>, MeshError> {
    let mut read = read(bytes, file)?;
    if let Some(error) = read.other.take() {
        return Err(error);
    }
    if read.hexahedra.is_empty() {
        return Ok(Err(read.surfaces(ConcaveQuads::Divide)?));
    }
    Ok(Ok(read.volumes()?))
}

fn read<'a>(bytes: &'a [u8], file: &'a str) -> Result<Reader<'a>, MeshError> {
    let cursor = Cursor::new(bytes, file);
    let mut reader = Reader {
        cursor,
        version: 0.0,
        vertices: Vec::new(),
        ids: Tags::default(),
        cells: Vec::new(),
        hexahedra: Vec::new(),
        other: None,
    };
    while let Some(line) = reader.cursor.line() {
        let Some(section) = line.strip_prefix('$') else { continue };
        if section == "MeshFormat" {
            reader.format()?;
        } else if reader.version == 0.0 {
            break;
        } else if section == "Nodes" {
            if reader.version < 4.0 { reader.nodes2()? } else { reader.nodes4()? }
        } else if section == "Elements" {
            if reader.version < 4.0 { reader.elements2()? } else { reader.elements4()? }
        }
        let end = format!("$End{section}");
        if matches!(section, "Nodes" | "Elements") {
            reader.cursor.expect(end.as_bytes())?;
        } else {
            reader.cursor.skip_past(end.as_bytes());
        }
    }
    if reader.version == 0.0 {
        let found = "no $MeshFormat section at the start";
        return Err(reader.cursor.error(found, "a gmsh mesh of version 2.2 or 4.1"));
    }
    Ok(reader)
}

impl Reader<'_> {
    fn format(&mut self) -> Result<(), MeshError> {
        self.version = self.cursor.float()?;
        let (kind, width) = (self.cursor.int()?, self.cursor.int()?);
        let known = (2.0..3.0).contains(&self.version) || (4.1..4.2).contains(&self.version);
        if !known {
            let found = format!("MSH version {}", self.version);
            return Err(self.cursor.error(found, "2.0 to 2.2 or 4.1 (gmsh -format msh41)"));
        }
        if width != 8 {
            return Err(self.cursor.error(format!("numbers of {width} bytes"), "8"));
        }
        self.cursor.line();
        if kind == 1 {
            self.cursor.binary = true;
            self.cursor.swapped = match self.cursor.int()? {
                1 => false,
                0x0100_0000 => true,
                other => return Err(self.cursor.error(format!("byte order mark {other}"), "1")),
            };
        }
        Ok(())
    }

    /// Counts of version 2 are on a text line in binary files, too.
    fn text_count(&mut self) -> Result<u64, MeshError> {
        let line = self.cursor.line().unwrap_or("");
        line.parse().map_err(|_| self.cursor.error(format!("'{line}'"), "a count"))
    }

    fn add_node(&mut self, tag: u64) -> Result<(), MeshError> {
        let p = Vec3::new(self.cursor.float()?, self.cursor.float()?, self.cursor.float()?);
        if self.ids.insert(tag, self.vertices.len() as u32).is_some() {
            return Err(self.cursor.error(format!("node {tag} a second time"), "each node once"));
        }
        self.vertices.push(p);
        Ok(())
    }

    fn nodes2(&mut self) -> Result<(), MeshError> {
        for _ in 0..self.text_count()? {
            let tag = self.cursor.int()?;
            self.add_node(tag as u64)?;
        }
        Ok(())
    }

    fn nodes4(&mut self) -> Result<(), MeshError> {
        let [blocks, declared] = self.counts4()?;
        let before = self.vertices.len();
        for _ in 0..blocks {
            let (dim, _tag, parametric) =
                (self.cursor.int()?, self.cursor.int()?, self.cursor.int()?);
            let count = self.cursor.size()?;
            let mut tags = Vec::new();
            for _ in 0..count {
                tags.push(self.cursor.size()?);
            }
            for tag in tags {
                self.add_node(tag)?;
                if parametric != 0 {
                    (0..dim.clamp(0, 3)).try_for_each(|_| self.cursor.float().map(|_| ()))?;
                }
            }
        }
        self.holds((self.vertices.len() - before) as u64, declared, "nodes")
    }

    /// Numbers of blocks and entities declared by a section of version 4; its smallest and largest tag are skipped.
    fn counts4(&mut self) -> Result<[u64; 2], MeshError> {
        let counts = [self.cursor.size()?, self.cursor.size()?];
        (0..2).try_for_each(|_| self.cursor.size().map(|_| ()))?;
        Ok(counts)
    }

    /// Rejects a section whose blocks contain another number than declared.
    fn holds(&self, found: u64, declared: u64, what: &str) -> Result<(), MeshError> {
        if found == declared {
            return Ok(());
        }
        let found = format!("{found} {what} in the blocks of a section that declares {declared}");
        Err(self.cursor.error(found, "as many as declared"))
    }

    fn kind(&self, kind: i64) -> Result<(usize, usize), MeshError> {
        let known = element_type(kind);
        known.ok_or_else(|| {
            self.cursor.error(format!("element type {kind}"), "gmsh's types 1 to 31, 92, 93")
        })
    }

    /// Reads the nodes of an element; surface elements and hexahedra are kept. `wide`: eight-byte tags.
    fn element(&mut self, kind: i64, surface: u32, wide: bool) -> Result<(), MeshError> {
        let shape = self.kind(kind)?;
        let volume = volume_type(kind);
        if volume == Some(0) && self.other.is_none() {
            let found = format!("a volume element of gmsh's type {kind}");
            self.other = Some(self.cursor.error(found, "hexahedra (type 5)"));
        }
        let mut tags = [0; 8];
        for k in 0..shape.0 {
            let tag = if wide { self.cursor.size()? } else { self.cursor.int()? as u64 };
            if let Some(place) = tags.get_mut(k) {
                *place = tag;
            }
        }
        if volume == Some(8) {
            self.hexahedra.push(tags);
        } else if shape.1 > 0 {
            let [a, b, c, d, ..] = tags;
            self.cells.push(Cell { tags: [a, b, c, d], corners: shape.1, surface });
        }
        Ok(())
    }

    fn elements2(&mut self) -> Result<(), MeshError> {
        let count = self.text_count()?;
        let mut read = 0u64;
        while read < count {
            let head = [self.cursor.int()?, self.cursor.int()?, self.cursor.int()?];
            // Text: number, type, tags. Binary: type, number of elements, tags.
            let (kind, follow, tags) = if self.cursor.binary {
                (head[0], head[1], head[2])
            } else {
                (head[1], 1, head[2])
            };
            self.kind(kind)?;
            for _ in 0..follow.max(1) {
                if self.cursor.binary {
                    self.cursor.int()?;
                }
                let mut surface = UNATTACHED;
                for t in 0..tags {
                    let tag = self.cursor.int()?;
                    if t == 1 && tag >= 0 {
                        surface = tag as u32;
                    }
                }
                self.element(kind, surface, false)?;
                read += 1;
            }
        }
        Ok(())
    }

    fn elements4(&mut self) -> Result<(), MeshError> {
        let [blocks, declared] = self.counts4()?;
        let mut found = 0;
        for _ in 0..blocks {
            let (_dim, tag, kind) = (self.cursor.int()?, self.cursor.int()?, self.cursor.int()?);
            self.kind(kind)?;
            for _ in 0..self.cursor.size()? {
                self.cursor.size()?;
                self.element(kind, tag as u32, true)?;
                found += 1;
            }
        }
        self.holds(found, declared, "elements")
    }

    fn node(&self, tag: u64) -> Result<u32, MeshError> {
        self.ids.get(tag).ok_or_else(|| {
            let found = format!("an element that uses node {tag}");
            self.cursor.error(found, "nodes listed in $Nodes")
        })
    }

    fn surfaces(self, faces: ConcaveQuads) -> Result<SurfaceMesh, MeshError> {
        let mut elements = Vec::with_capacity(self.cells.len());
        for Cell { tags, corners, surface } in &self.cells {
            let tags = &tags[..*corners];
            let mut ring = [(0, Vec3::zeros()); 4];
            for (corner, tag) in ring.iter_mut().zip(tags) {
                corner.0 = self.node(*tag)?;
            }
            let ring = &ring[..*corners];
            if faces == ConcaveQuads::Keep {
                let ids: Vec<u32> = ring.iter().map(|corner| corner.0).collect();
                elements.extend(Element::from_ring(&ids, *surface));
            } else if let Some(quad) = polygon::convex_quad(ring, &self.vertices) {
                elements.push(Element::quad(quad, *surface));
            } else {
                let parts = polygon::elements(ring, &self.vertices, *surface);
                let parts = parts.map_err(|found| {
                    let place = format!("element with nodes {tags:?}");
                    polygon::refused(self.cursor.file(), place, found)
                })?;
                elements.extend(parts.into_iter().map(|(element, _)| element));
            }
        }
        let mut mesh = SurfaceMesh { vertices: self.vertices, elements, ..SurfaceMesh::default() };
        mesh.compact();
        Ok(mesh)
    }

    fn volumes(self) -> Result<Volumes, MeshError> {
        let mut hexahedra = Vec::with_capacity(self.hexahedra.len());
        for tags in &self.hexahedra {
            let mut nodes = [0; 8];
            for (node, tag) in nodes.iter_mut().zip(tags) {
                *node = self.node(*tag)?;
            }
            hexahedra.push(nodes);
        }
        Ok(Volumes { points: self.vertices, hexahedra })
    }
}
