//! CAD and mesh become a tool model: one normal per (vertex, CAD face), merged only where the faces are
//! tangent-continuous, never averaged over a crease.

pub mod bezier;
mod edges;
mod normals;
pub mod own;
pub mod part;
pub mod reach;
mod repair;
pub mod tolerance;
pub mod unfolded;

use std::cell::OnceCell;

use rayon::prelude::*;

use crate::cad::Model;
use crate::geometry::Vec3;
use crate::mesh::SurfaceMesh;
use crate::tool::build::{EdgeChoice, StraightEdge, ToolError, build, edge_ends};
use crate::tool::edge::EdgeRule;
use crate::tool::model::PatchCorners;
use crate::tool::{GivenCurve, Patch, ToolKind, ToolModel};

use self::normals::NormalTable;

/// Choices of a conversion.
#[derive(Debug, Clone, PartialEq)]
pub struct ConvertOptions {
    /// Name of the tool.
    pub name: String,
    /// Nagata patches or facets.
    pub kind: ToolKind,
    /// How edges are curved.
    pub edges: EdgeRule,
    /// What Eq. 8 leaves open, and edges that its guard catches, follow the CAD (Nagata).
    pub through_cad: bool,
    /// Normals of neighbouring faces closer than this at a vertex are one [degrees].
    pub smooth_deg: f64,
    /// Direction to the sheet: the model is turned round if its faces look the other way on the whole.
    pub sheet_side: Option<Vec3>,
    /// Turns the model round (after `sheet_side`).
    pub flip: bool,
    /// Edges of patches that fold whatever else is done are made straight (Nagata).
    pub straighten: bool,
}

impl Default for ConvertOptions {
    fn default() -> Self {
        Self {
            name: "tool".into(),
            kind: ToolKind::Nagata,
            edges: EdgeRule::Guarded,
            through_cad: false,
            smooth_deg: 0.5,
            sheet_side: None,
            flip: false,
            straighten: false,
        }
    }
}

/// What a conversion found.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ConvertReport {
    /// Edges at which the faces on both sides keep normals of their own.
    pub creases: usize,
    /// Edges that the guard made straight.
    pub straight: Vec<StraightEdge>,
    /// Edges that the guard would have made straight and that follow the CAD instead, off their normals.
    pub bent: Vec<StraightEdge>,
    /// Quadrilaterals that folded and were split in two triangles.
    pub split: usize,
    /// Faces that were divided more finely than asked, as patches of them folded.
    pub finer: Vec<usize>,
    /// Faces without a patch: of no area within the tolerance to which the model is joined, or not in the mesh.
    pub bare: Vec<usize>,
    /// Patches whose edges lost the curves that were asked for, as patches folded with them.
    pub redone: Vec<u32>,
    /// Patches that fold still: somewhere `(S_eta x S_zeta) . n < 0`.
    pub folded: Vec<u32>,
    /// The model was turned round to look at the sheet.
    pub turned: bool,
}

/// Why a mesh makes no tool model.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ConvertError {
    /// An element on a face that the model does not have.
    #[error(
        "element {element} lies on CAD face {face}; the model has {count} faces: attach the mesh to this model first"
    )]
    Face {
        /// Element, from 0.
        element: usize,
        /// Face it names.
        face: u32,
        /// Faces there are.
        count: usize,
    },
    /// No normal at a vertex.
    #[error(
        "no normal on {face} at ({x:.4}, {y:.4}, {z:.4}) mm: the surface is degenerate there; mesh the face finer or repair it in the CAD"
    )]
    Normal {
        /// Face.
        face: String,
        /// Position [mm].
        x: f64,
        /// Position [mm].
        y: f64,
        /// Position [mm].
        z: f64,
    },
    /// Only Nagata patches and facets come from a mesh.
    #[error(
        "patches of kind Bezier do not come from vertices and normals; allowed: nagata, facets; see `bezier_from_cad`"
    )]
    Kind,
    /// A mesh without CAD whose elements cannot all look outwards.
    #[error(
        "the elements on both sides of the edge from ({from}) to ({to}) mm cannot be turned alike, as on a Moebius strip; allowed: a mesh with two sides; cut it there, or mesh the part again"
    )]
    OneSided {
        /// One end [mm].
        from: String,
        /// The other one [mm].
        to: String,
    },
    /// A mesh without elements of any area.
    #[error(
        "the mesh has no triangles or quadrilaterals; allowed: one at least; export the surface of the tool"
    )]
    NoElements,
    /// The tool cannot be built.
    #[error(transparent)]
    Tool(#[from] ToolError),
}

/// Converts a mesh of `model` to a tool model. Folded patches are repaired where that is possible without moving a
/// vertex: given curves that fold a patch are dropped, a quadrilateral is split in two triangles.
///
/// # Errors
/// [`ConvertError`] names the element, face or vertex.
pub fn convert(
    model: &Model,
    mesh: &SurfaceMesh,
    options: &ConvertOptions,
) -> Result<(ToolModel, ConvertReport), ConvertError> {
    if options.kind == ToolKind::Bezier {
        return Err(ConvertError::Kind);
    }
    let count = model.faces.len();
    if let Some(element) = mesh.elements.iter().position(|e| e.face as usize >= count) {
        return Err(ConvertError::Face { element, face: mesh.elements[element].face, count });
    }
    Ground::new(Source::Cad(model), mesh, options)?.convert_and_repair()
}

/// Gives the faces of a tool other numbers: `numbers[f]` for face f.
pub fn renumber(tool: &mut ToolModel, numbers: &[usize]) {
    let other = |face: &mut u32| *face = numbers[*face as usize] as u32;
    tool.faces.iter_mut().for_each(other);
    tool.corners.iter_mut().for_each(|c| other(&mut c.face));
}

/// Faces of `model` without an element.
fn bare(model: &Model, mesh: &SurfaceMesh) -> Vec<usize> {
    let mut without = vec![true; model.faces.len()];
    for element in &mesh.elements {
        if let Some(face) = without.get_mut(element.face as usize) {
            *face = false;
        }
    }
    (0..without.len()).filter(|&f| without[f]).collect()
}

/// Elements whose edges are not what was asked.
#[derive(Default, Clone)]
struct Exempt {
    /// Their edges are those of Eq. 8.
    plain: Vec<u32>,
    /// Their edges are chords.
    straight: Vec<u32>,
}

/// Where normals come from.
#[derive(Clone, Copy)]
enum Source<'a> {
    Cad(&'a Model),
    /// Those of a mesh without CAD, corner by corner.
    Own(&'a NormalTable),
}

impl<'a> Source<'a> {
    fn own(self) -> Option<&'a NormalTable> {
        if let Source::Own(table) = self { Some(table) } else { None }
    }
}

/// What a conversion takes from CAD and mesh, whatever elements are exempt.
struct Ground<'a> {
    source: Source<'a>,
    mesh: &'a SurfaceMesh,
    options: &'a ConvertOptions,
    /// The model is turned round to look at the sheet.
    turned: bool,
    normals: Vec<Vec3>,
    corners: Vec<PatchCorners>,
    feet: normals::Feet,
    /// Edges through the CAD, when first asked for.
    followed: OnceCell<edges::Followed>,
}

impl<'a> Ground<'a> {
    fn new(
        source: Source<'a>,
        mesh: &'a SurfaceMesh,
        options: &'a ConvertOptions,
    ) -> Result<Self, ConvertError> {
        let turned = looks_away(mesh, options.sheet_side);
        let turn = turned ^ options.flip;
        let table = match source {
            Source::Cad(model) => normals::table(model, mesh, options.smooth_deg.to_radians())?,
            Source::Own(table) => table.clone(),
        };
        let sign = if turn { -1.0 } else { 1.0 };
        let corners = mesh.elements.iter().zip(table.ids).map(|(element, mut normals)| {
            let mut vertices = element.nodes().to_vec();
            if turn {
                vertices.reverse();
                normals.reverse();
            }
            PatchCorners { vertices, normals, face: element.face }
        });
        Ok(Self {
            source,
            mesh,
            options,
            turned,
            corners: corners.collect(),
            normals: table.normals.iter().map(|n| n * sign).collect(),
            feet: table.feet,
            followed: OnceCell::new(),
        })
    }

    fn followed(&self) -> &edges::Followed {
        let Self { source, mesh, feet, corners, normals, .. } = self;
        self.followed.get_or_init(|| match source {
            Source::Cad(model) => edges::follow(model, mesh, feet, corners, normals),
            Source::Own(_) => edges::Followed::default(),
        })
    }

    /// Converts, and repairs what folds unless Eq. 8 was to be left as it is.
    fn convert_and_repair(&self) -> Result<(ToolModel, ConvertReport), ConvertError> {
        let (tool, report) = self.convert(&Exempt::default())?;
        if report.folded.is_empty() || self.options.edges == EdgeRule::Plain {
            return Ok((tool, report));
        }
        repair::repaired(self, (tool, report))
    }

    /// Converts; no edge of an `exempt` element follows the CAD.
    fn convert(&self, exempt: &Exempt) -> Result<(ToolModel, ConvertReport), ConvertError> {
        let Self { options, corners, .. } = self;
        let mut report = ConvertReport { turned: self.turned, ..ConvertReport::default() };
        let (choice, bent) = edge_choice(options, exempt, corners, || self.followed());
        report.bent = bent;
        let chords = edges::straightened(corners, &exempt.straight);
        let (vertices, normals) = (self.mesh.vertices.clone(), self.normals.clone());
        let (name, kind) = (options.name.clone(), options.kind);
        let (tool, straight) = build(name, kind, vertices, normals, corners.clone(), choice)?;
        report.straight = straight;
        report.straight.extend(chords);
        report.creases = crease_count(&tool);
        if let Source::Cad(model) = self.source {
            report.bare = bare(model, self.mesh);
        }
        report.redone = exempt.plain.iter().chain(&exempt.straight).copied().collect();
        report.folded = folded(&tool);
        Ok((tool, report))
    }
}

/// Curves of the edges, and those of them that leave their normals.
fn edge_choice<'f>(
    options: &ConvertOptions,
    exempt: &Exempt,
    corners: &[PatchCorners],
    follow: impl FnOnce() -> &'f edges::Followed,
) -> (EdgeChoice, Vec<StraightEdge>) {
    let mut choice = EdgeChoice::from(options.edges);
    let mut bent = Vec::new();
    let edges_of = |elements: &[u32]| {
        let some = elements.iter().map(|&k| corners[k as usize].clone());
        edge_ends(&some.collect::<Vec<PatchCorners>>())
    };
    let (plain, chords) = (edges_of(&exempt.plain), edges_of(&exempt.straight));
    if options.through_cad && options.kind == ToolKind::Nagata {
        let found = follow();
        let free = |v: &[u32; 2]| !plain.contains_key(v) && !chords.contains_key(v);
        choice.given = found.given.iter().filter(|g| free(&g.vertices)).copied().collect();
        bent = found.bent.iter().filter(|b| free(&b.vertices)).cloned().collect();
    }
    let chord = |&vertices: &[u32; 2]| GivenCurve { vertices, c: [0.0; 3] };
    choice.given.extend(chords.keys().map(chord));
    (choice, bent)
}

/// Vector area of the mesh against the side the sheet is on.
fn looks_away(mesh: &SurfaceMesh, sheet_side: Option<Vec3>) -> bool {
    let Some(side) = sheet_side else { return false };
    let (mut area, mut whole) = (Vec3::zeros(), 0.0);
    for e in &mesh.elements {
        let x = |k: usize| mesh.vertices[e.nodes()[k] as usize];
        for k in 1..e.nodes().len() - 1 {
            let part = (x(k) - x(0)).cross(&(x(k + 1) - x(0)));
            area += part;
            whole += part.norm();
        }
    }
    // A closed solid has no vector area but rounding, and looks outwards.
    area.dot(&side) < -1e-9 * whole * side.norm()
}

/// Edges whose two patches do not share the normals at both ends.
fn crease_count(tool: &ToolModel) -> usize {
    edge_ends(&tool.corners).values().filter(|pairs| pairs.len() > 1).count()
}

/// Patches whose parametrisation turns over at a corner or inside, against the blend of their corner normals.
fn folded(tool: &ToolModel) -> Vec<u32> {
    let folds = |(patch, corners): (&Patch, &PatchCorners)| {
        let n = |k: usize| tool.normals[corners.normals[k] as usize];
        const STEPS: u32 = 4;
        (0..=STEPS).flat_map(|i| (0..=STEPS).map(move |j| (i, j))).any(|(i, j)| {
            let (e, z) = (f64::from(i) / f64::from(STEPS), f64::from(j) / f64::from(STEPS));
            let blend = if corners.vertices.len() == 3 {
                if z > e {
                    return false;
                }
                n(0) * (1.0 - e) + n(1) * (e - z) + n(2) * z
            } else {
                (n(0) * (1.0 - e) + n(1) * e) * (1.0 - z) + (n(3) * (1.0 - e) + n(2) * e) * z
            };
            let d = patch.derivs(e, z);
            let cross = d.d1.cross(&d.d2);
            cross.dot(&blend) < -1e-9 * d.d1.norm() * d.d2.norm() * blend.norm()
        })
    };
    let flags: Vec<bool> = tool.patches.par_iter().zip(&tool.corners).map(folds).collect();
    flags.iter().enumerate().filter(|(_, f)| **f).map(|(k, _)| k as u32).collect()
}
