//! Nodes and elements of an Abaqus deck: `*NODE`, and `*ELEMENT` of the types C3D8*, SC8R*, S4*, or other four-node
//! surface elements (gmsh writes CPS4, meshio CAX4P).
//!
//! Rigid elements (`R3D...`, the tools) and keywords unrelated to the mesh are ignored. Keywords that change the mesh
//! (generated nodes, included files, several parts, moved instances) are rejected.

mod keyword;

use super::polygon;
use super::tags::Tags;
use super::volumes::{SheetElements, SheetMesh, used};
use crate::MeshError;
use kanagata_geometry::Vec3;

/// Section of a data line.
#[derive(Clone, Copy, PartialEq)]
enum Section {
    Other,
    Nodes,
    Elements(Kind),
    Instance,
}

/// Supported element types.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Solid,
    ContinuumShell,
    Shell,
}

impl Kind {
    fn nodes(self) -> usize {
        if self == Self::Shell { 4 } else { 8 }
    }
}

struct Deck<'a> {
    file: &'a str,
    line: usize,
    section: Section,
    points: Vec<Vec3>,
    ids: Tags,
    parts: usize,
    /// Type, node labels and line of each element.
    elements: Vec<(Kind, Vec<u64>, usize)>,
    /// Line of each element label.
    seen: Tags,
    /// An element continued in the next line.
    open: Option<Vec<u64>>,
    /// `*INITIAL CONDITIONS` of a formed sheet.
    results: Vec<String>,
}

/// Parses a deck; `file` is used in messages.
pub fn parse(bytes: &[u8], file: &str) -> Result<SheetMesh, MeshError> {
    let mut deck = Deck {
        file,
        line: 0,
        section: Section::Other,
        points: Vec::new(),
        ids: Tags::default(),
        parts: 0,
        elements: Vec::new(),
        seen: Tags::default(),
        open: None,
        results: Vec::new(),
    };
    for line in bytes.split(|b| *b == b'\n') {
        deck.line += 1;
        let line = String::from_utf8_lossy(line);
        let line = line.trim();
        if line.is_empty() || line.starts_with("**") {
            continue;
        }
        if let Some(keyword) = line.strip_prefix('*') {
            deck.close()?;
            deck.keyword(keyword)?;
        } else {
            deck.data(line)?;
        }
    }
    deck.close()?;
    deck.finish()
}

impl Deck<'_> {
    fn error(&self, found: impl Into<String>, allowed: impl Into<String>) -> MeshError {
        MeshError::Invalid {
            file: self.file.into(),
            place: format!("line {}", self.line),
            found: found.into(),
            allowed: allowed.into(),
        }
    }

    fn data(&mut self, line: &str) -> Result<(), MeshError> {
        match self.section {
            Section::Other => Ok(()),
            Section::Instance => {
                let still =
                    line.split(',').all(|w| w.trim().parse() == Ok(0.0) || w.trim().is_empty());
                if still {
                    return Ok(());
                }
                Err(self.error("an *INSTANCE that is moved", "an instance where its part is"))
            }
            Section::Nodes => self.node(line),
            Section::Elements(kind) => self.element(line, kind),
        }
    }

    fn node(&mut self, line: &str) -> Result<(), MeshError> {
        let mut words = line.split(',').map(str::trim);
        let label = self.label(words.next().unwrap_or(""))?;
        let mut p = Vec3::zeros();
        for k in 0..3 {
            // Omitted coordinates are zero.
            let word = words.next().unwrap_or("");
            if word.is_empty() {
                continue;
            }
            let number =
                word.replace(['d', 'D'], "e").parse::<f64>().ok().filter(|x| x.is_finite());
            p[k] = number.ok_or_else(|| self.error(quoted(word), "a finite coordinate"))?;
        }
        let id = self.points.len() as u32;
        if self.ids.insert(label, id).is_some() {
            return Err(self.error(format!("node {label} a second time"), "each node once"));
        }
        self.points.push(p);
        Ok(())
    }

    fn label(&self, word: &str) -> Result<u64, MeshError> {
        word.parse().map_err(|_| self.error(quoted(word), "a node or element number"))
    }

    fn element(&mut self, line: &str, kind: Kind) -> Result<(), MeshError> {
        let mut labels = self.open.take().unwrap_or_default();
        for word in line.split(',').map(str::trim).filter(|w| !w.is_empty()) {
            labels.push(self.label(word)?);
        }
        let needed = kind.nodes() + 1;
        match labels.len() {
            n if n == needed => {
                let nodes = labels.split_off(1);
                if let Some(first) = self.seen.insert(labels[0], self.line as u32) {
                    let found = format!("element {} a second time, after line {first}", labels[0]);
                    return Err(self.error(found, "each element once"));
                }
                self.elements.push((kind, nodes, self.line));
            }
            n if n < needed => self.open = Some(labels),
            n => {
                let found = format!("{} nodes", n - 1);
                return Err(self.error(found, format!("{} for this element type", needed - 1)));
            }
        }
        Ok(())
    }

    /// Rejects an incomplete element at the end of its section.
    fn close(&mut self) -> Result<(), MeshError> {
        match (self.open.take(), self.section) {
            (Some(labels), Section::Elements(kind)) => {
                let found = format!(
                    "an element of {} nodes before this line",
                    labels.len().saturating_sub(1)
                );
                Err(self.error(found, kind.nodes().to_string()))
            }
            _ => Ok(()),
        }
    }

    fn finish(mut self) -> Result<SheetMesh, MeshError> {
        let Some(&(first, ..)) = self.elements.first() else {
            return Err(self.error(
                "the end of the deck and no element",
                "*ELEMENT, TYPE=C3D8..., SC8R..., S4..., M3D4... or CPS4...",
            ));
        };
        let (mut quads, mut hexahedra) = (Vec::new(), Vec::new());
        for (kind, labels, line) in std::mem::take(&mut self.elements) {
            self.line = line;
            if kind != first {
                return Err(self.error(
                    "elements of a second kind",
                    "solids, or continuum shells, or shells alone",
                ));
            }
            let nodes = self.nodes_of(&labels)?;
            if let Ok(quad) = <[u32; 4]>::try_from(&nodes[..]) {
                self.check_convex(&quad)?;
                quads.push(quad);
            } else if let Ok(hexahedron) = <[u32; 8]>::try_from(&nodes[..]) {
                hexahedra.push(hexahedron);
            }
        }
        let results = std::mem::take(&mut self.results);
        Ok(if first == Kind::Shell {
            let (points, quads) = used(&self.points, quads);
            SheetMesh { points, elements: SheetElements::Quads(quads), results }
        } else {
            let (points, elements) = used(&self.points, hexahedra);
            let stacked = first == Kind::ContinuumShell;
            let elements = SheetElements::Hexahedra { elements, stacked };
            SheetMesh { points, elements, results }
        })
    }
}

impl Deck<'_> {
    /// Indices of the nodes of an element.
    fn nodes_of(&self, labels: &[u64]) -> Result<Vec<u32>, MeshError> {
        let mut nodes = Vec::with_capacity(labels.len());
        for &label in labels {
            let id = self.ids.get(label);
            nodes.push(
                id.ok_or_else(|| self.error(format!("node {label}"), "nodes listed under *NODE"))?,
            );
        }
        Ok(nodes)
    }

    /// Rejects a concave or self-intersecting quadrilateral: no element can be made of it.
    fn check_convex(&self, quad: &[u32; 4]) -> Result<(), MeshError> {
        let ring = quad.map(|n| (n, Vec3::zeros()));
        if polygon::convex_quad(&ring, &self.points).is_some() {
            return Ok(());
        }
        let corners = quad.map(|n| self.points[n as usize]);
        let found = match polygon::divided(&corners) {
            Ok(parts) if parts.len() == 1 => return Ok(()),
            Ok(_) => "a concave quadrilateral".into(),
            Err(found) => found,
        };
        Err(self.error(found, "convex quadrilaterals"))
    }
}

fn quoted(word: &str) -> String {
    format!("'{}'", word.chars().take(40).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    const DECK: &str = "** a comment\n*Heading\n a block, C3D8\n*Part, name=BLANK\n*NODE, NSET=ALL\n\
        11, 0., 0., 0.\n12, 1.D+0, 0, 0\n 13, 1, 1\n14,,1.,\n\
        21,0,0,0.5\n22,1,0,0.5\n23,1,1,0.5\n24,0,1,0.5\n99,5,5,5\n\
        *Element, type=C3D8R, elset=E\n7, 11, 12, 13, 14, 21,\n 22, 23, 24\n\
        *Element, type=R3D4\n8, 11, 12, 13, 14\n*Solid Section, elset=E, material=M\n1.,\n*End Part\n";

    fn fails(from: &str, to: &str) -> String {
        assert!(DECK.contains(from));
        parse(DECK.replace(from, to).as_bytes(), "d.inp").unwrap_err().to_string()
    }

    #[test]
    fn a_deck_gives_its_nodes_and_elements() {
        let mesh = parse(DECK.as_bytes(), "d.inp").unwrap();
        assert_eq!(mesh.points.len(), 8);
        assert_eq!((mesh.points[1], mesh.points[3]), (Vec3::x(), Vec3::y()));
        let elements = vec![[0, 1, 2, 3, 4, 5, 6, 7]];
        assert_eq!(mesh.elements, SheetElements::Hexahedra { elements, stacked: false });
        let stacked = parse(DECK.replace("C3D8R", "SC8R").as_bytes(), "d.inp").unwrap();
        assert!(matches!(stacked.elements, SheetElements::Hexahedra { stacked: true, .. }));
        let shell = "7, 11, 12, 13, 14\n";
        let shell =
            DECK.replace("C3D8R", "s4r").replace("7, 11, 12, 13, 14, 21,\n 22, 23, 24\n", shell);
        let shell = parse(shell.as_bytes(), "d.inp").unwrap();
        assert_eq!(shell.elements, SheetElements::Quads(vec![[0, 1, 2, 3]]));
        assert_eq!(shell.points.len(), 4);
        // As written by gmsh and by meshio.
        for name in ["CPS4", "CAX4P"] {
            let text = DECK.replace("C3D8R", name).replace("14, 21,\n 22, 23, 24\n", "14\n");
            assert_eq!(parse(text.as_bytes(), "d.inp").unwrap().elements, shell.elements, "{name}");
        }
    }

    #[test]
    fn what_cannot_be_read_is_named_by_line() {
        let cases = [
            ("C3D8R", "C3D10", "line 15: element type 'C3D10'; allowed: found", "C3D8*"),
            ("22, 23, 24", "22, 23", "line 18: found", "8"),
            ("22, 23, 24", "22, 23, 77", "line 17", "node 77"),
            ("1.D+0", "x1", "line 7", "'x1'"),
            ("24,0,1", "23,0,1", "line 13", "node 23 a second time"),
            (
                "22, 23, 24\n",
                "22, 23, 24\n7, 11, 12, 13, 14, 21, 22, 23, 24\n",
                "line 18",
                "element 7 a second time",
            ),
            ("*Heading", "*INCLUDE, INPUT=more.inp", "line 2", "*INCLUDE"),
            (
                "C3D8R, elset=E\n7, 11, 12, 13, 14, 21,\n 22, 23, 24",
                "S4\n7, 11, 13, 12, 14",
                "line 16",
                "cross",
            ),
            ("*Element, type=C3D8R", "*ELEMENTT, type=C3D8R", "line 15", "*ELEMENTT"),
            ("*Element, type=C3D8R", "*ELMENT, type=C3D8R", "line 15", "*ELMENT"),
            ("*NODE, NSET=ALL", "*NDOE, NSET=ALL", "line 5", "*NDOE"),
            ("*NODE, NSET=ALL", "*NODE, SYSTEM=C", "line 5", "'C'"),
        ];
        for (from, to, place, what) in cases {
            let message = fails(from, to);
            let place = place.split(':').next().unwrap();
            assert!(message.contains(place) && message.contains(what), "{message}");
            assert!(message.contains("allowed") || message.contains(';'), "{message}");
        }
        // A truncated deck is a smaller mesh or an error, never a panic.
        for end in 0..DECK.len() {
            let _ = parse(&DECK.as_bytes()[..end], "d.inp");
        }
    }
}
