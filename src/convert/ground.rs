//! What a conversion takes from CAD and mesh, and the tool model of it.

use std::cell::OnceCell;

use rayon::prelude::*;

use super::error::ConvertError;
use super::normals::NormalTable;
use super::options::{ConvertOptions, ConvertReport};
use super::searches::{SearchLimits, Searches};
use super::{edges, normals};
use crate::cad::Model;
use crate::geometry::Vec3;
use crate::mesh::SurfaceMesh;
use crate::tool::build::{EdgeChoice, StraightEdge, build, edge_ends};
use crate::tool::model::PatchCorners;
use crate::tool::{GivenCurve, Patch, ToolKind, ToolModel};

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
pub(super) struct Exempt {
    /// Their edges are those of Eq. 8.
    pub(super) plain: Vec<u32>,
    /// Their edges are chords.
    pub(super) straight: Vec<u32>,
}

/// Where normals come from.
#[derive(Clone, Copy)]
pub(super) enum Source<'a> {
    Cad(&'a Model),
    /// Those of a mesh without CAD, corner by corner.
    Own(&'a NormalTable),
}

impl<'a> Source<'a> {
    pub(super) fn own(self) -> Option<&'a NormalTable> {
        if let Source::Own(table) = self { Some(table) } else { None }
    }
}

/// What a conversion takes from CAD and mesh, whatever elements are exempt.
pub(super) struct Ground<'a> {
    pub(super) source: Source<'a>,
    pub(super) mesh: &'a SurfaceMesh,
    pub(super) options: &'a ConvertOptions,
    /// The model is turned round to look at the sheet.
    pub(super) turned: bool,
    pub(super) normals: Vec<Vec3>,
    pub(super) corners: Vec<PatchCorners>,
    pub(super) feet: normals::Feet,
    /// Edges through the CAD, when first asked for.
    pub(super) followed: OnceCell<edges::Followed>,
    /// Closest points on the CAD.
    searches: Option<Searches<'a>>,
}

impl<'a> Ground<'a> {
    pub(super) fn new(
        source: Source<'a>,
        mesh: &'a SurfaceMesh,
        options: &'a ConvertOptions,
    ) -> Result<Self, ConvertError> {
        let turned = looks_away(mesh, options.sheet_side);
        let turn = turned ^ options.flip;
        let (table, searches) = match source {
            Source::Cad(model) => {
                let searches = Searches::new(model, mesh, SearchLimits::NAGATA);
                let smooth = options.smooth_deg.to_radians();
                (normals::table(model, mesh, smooth, &searches)?, Some(searches))
            }
            Source::Own(table) => (table.clone(), None),
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
            searches,
        })
    }

    fn followed(&self) -> &edges::Followed {
        let Self { source, mesh, feet, corners, normals, .. } = self;
        self.followed.get_or_init(|| match (source, &self.searches) {
            (Source::Cad(model), Some(searches)) => {
                edges::follow(model, mesh, feet, (corners, normals), searches)
            }
            _ => edges::Followed::default(),
        })
    }

    /// Converts; no edge of an `exempt` element follows the CAD.
    pub(super) fn convert(
        &self,
        exempt: &Exempt,
    ) -> Result<(ToolModel, ConvertReport), ConvertError> {
        let Self { options, corners, .. } = self;
        let mut report = ConvertReport { turned: self.turned, ..ConvertReport::default() };
        let (choice, bent) = edge_choice(options, exempt, corners, || self.followed());
        report.bent = bent;
        self.searches.as_ref().map_or(Ok(()), Searches::check)?;
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
pub(super) fn looks_away(mesh: &SurfaceMesh, sheet_side: Option<Vec3>) -> bool {
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
pub(super) fn crease_count(tool: &ToolModel) -> usize {
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
