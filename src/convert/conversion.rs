//! Normals, edge curves and patches of one mesh: a single conversion, without repairs.

use std::cell::OnceCell;

use rayon::prelude::*;

use super::error::ConvertError;
use super::normals::NormalTable;
use super::options::{ConvertOptions, ConvertReport};
use super::searches::{SearchLimits, Searches};
use super::{edges, normals};
use kanagata_cad::Model;
use kanagata_geometry::Vec3;
use kanagata_mesh::SurfaceMesh;
use kanagata_tool::build::{EdgeChoice, StraightEdge, build, edge_ends};
use kanagata_tool::model::PatchCorners;
use kanagata_tool::{GivenCurve, Patch, ToolKind, ToolModel};

/// Lists the faces of `model` without an element.
fn faces_without_elements(model: &Model, mesh: &SurfaceMesh) -> Vec<usize> {
    let mut without = vec![true; model.faces.len()];
    for element in &mesh.elements {
        if let Some(face) = without.get_mut(element.face as usize) {
            *face = false;
        }
    }
    (0..without.len()).filter(|&f| without[f]).collect()
}

/// Elements whose edges deviate from the requested rule. Both lists are sorted.
#[derive(Default, Clone)]
pub(super) struct EdgeOverrides {
    /// Elements with edges by Eq. 8 instead of edges that follow the CAD.
    pub(super) eq8: Vec<u32>,
    /// Elements with straight edges.
    pub(super) straight: Vec<u32>,
}

impl EdgeOverrides {
    /// The elements with changed edges, each once, in ascending order.
    fn elements(&self) -> Vec<u32> {
        let mut elements = [&self.eq8[..], &self.straight].concat();
        elements.sort_unstable();
        elements.dedup();
        elements
    }
}

/// Source of the normals.
#[derive(Clone, Copy)]
pub(super) enum Source<'a> {
    /// The surfaces of a CAD model.
    Cad(&'a Model),
    /// Normals at the corners of a mesh without CAD.
    Mesh(&'a NormalTable),
}

impl<'a> Source<'a> {
    /// The normals of a mesh without CAD.
    pub(super) fn mesh_normals(self) -> Option<&'a NormalTable> {
        if let Source::Mesh(table) = self { Some(table) } else { None }
    }
}

/// Data of a conversion that do not depend on the [`EdgeOverrides`].
pub(super) struct Conversion<'a> {
    pub(super) source: Source<'a>,
    pub(super) mesh: &'a SurfaceMesh,
    pub(super) options: &'a ConvertOptions,
    /// True when the model is reversed to face the sheet.
    pub(super) turned: bool,
    /// Unit normals, indexed by `corners`.
    pub(super) normals: Vec<Vec3>,
    /// Vertices and normals of each patch, reversed where the model is.
    pub(super) corners: Vec<PatchCorners>,
    /// Surface parameters of the vertices.
    pub(super) feet: normals::Feet,
    /// Edges that follow the CAD, computed on first use.
    pub(super) cad_edges: OnceCell<edges::CadEdges>,
    /// Closest-point searches on the CAD; `None` for a mesh without CAD.
    searches: Option<Searches<'a>>,
}

impl<'a> Conversion<'a> {
    /// Computes the normals and orients the patches.
    pub(super) fn new(
        source: Source<'a>,
        mesh: &'a SurfaceMesh,
        options: &'a ConvertOptions,
    ) -> Result<Self, ConvertError> {
        let turned = faces_away(mesh, options.sheet_side);
        let turn = turned ^ options.flip;
        let (table, searches) = match source {
            Source::Cad(model) => {
                let searches = Searches::new(model, mesh, SearchLimits::NAGATA);
                let searches = searches.watched(&options.progress);
                let smooth = options.smooth_deg.to_radians();
                (normals::vertex_normals(model, mesh, smooth, &searches)?, Some(searches))
            }
            Source::Mesh(table) => (table.clone(), None),
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
            cad_edges: OnceCell::new(),
            searches,
        })
    }

    /// Edges that follow the CAD; none for a mesh without CAD.
    fn cad_edges(&self) -> &edges::CadEdges {
        let Self { source, mesh, feet, corners, normals, .. } = self;
        self.cad_edges.get_or_init(|| match (source, &self.searches) {
            (Source::Cad(model), Some(searches)) => {
                edges::edges_through_cad(model, mesh, feet, (corners, normals), searches)
            }
            _ => edges::CadEdges::default(),
        })
    }

    /// Builds the tool model. No edge of an element in `overrides` follows the CAD.
    pub(super) fn convert(
        &self,
        overrides: &EdgeOverrides,
    ) -> Result<(ToolModel, ConvertReport), ConvertError> {
        let Self { options, corners, .. } = self;
        let mut report = ConvertReport { turned: self.turned, ..ConvertReport::default() };
        let (choice, bent) = edge_choice(options, overrides, corners, || self.cad_edges());
        report.bent = bent;
        self.searches.as_ref().map_or(Ok(()), Searches::check)?;
        let chords = edges::straight_edges(corners, &overrides.straight);
        let (vertices, normals) = (self.mesh.vertices.clone(), self.normals.clone());
        let (name, kind) = (options.name.clone(), options.kind);
        let (tool, straight) = build(name, kind, vertices, normals, corners.clone(), choice)?;
        report.straight = straight;
        report.straight.extend(chords);
        report.creases = crease_count(&tool);
        if let Source::Cad(model) = self.source {
            report.bare = faces_without_elements(model, self.mesh);
        }
        report.redone = overrides.elements();
        report.folded = folded_patches(&tool);
        Ok((tool, report))
    }
}

/// Curves of the edges, and the edges among them that are not perpendicular to their normals. `cad_edges` is evaluated
/// only with [`ConvertOptions::through_cad`].
fn edge_choice<'f>(
    options: &ConvertOptions,
    overrides: &EdgeOverrides,
    corners: &[PatchCorners],
    cad_edges: impl FnOnce() -> &'f edges::CadEdges,
) -> (EdgeChoice, Vec<StraightEdge>) {
    let mut choice = EdgeChoice::from(options.edges);
    let mut bent = Vec::new();
    let edges_of = |elements: &[u32]| {
        let some = elements.iter().map(|&k| corners[k as usize].clone());
        edge_ends(&some.collect::<Vec<PatchCorners>>())
    };
    let (eq8, chords) = (edges_of(&overrides.eq8), edges_of(&overrides.straight));
    if options.through_cad && options.kind == ToolKind::Nagata {
        let found = cad_edges();
        let free = |v: &[u32; 2]| !eq8.contains_key(v) && !chords.contains_key(v);
        choice.given = found.given.iter().filter(|g| free(&g.vertices)).copied().collect();
        bent = found.bent.iter().filter(|b| free(&b.vertices)).cloned().collect();
    }
    let chord = |&vertices: &[u32; 2]| GivenCurve { vertices, c: [0.0; 3] };
    choice.given.extend(chords.keys().map(chord));
    (choice, bent)
}

/// True when the vector area of the mesh points away from `sheet_side`; false without a side.
#[must_use]
pub fn faces_away(mesh: &SurfaceMesh, sheet_side: Option<Vec3>) -> bool {
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
    // The vector area of a closed solid is zero to within rounding. Its normals point outwards and are kept.
    area.dot(&side) < -1e-9 * whole * side.norm()
}

/// Number of edges whose patches have different normals at an end.
pub(super) fn crease_count(tool: &ToolModel) -> usize {
    edge_ends(&tool.corners).values().filter(|pairs| pairs.len() > 1).count()
}

/// Lists the folded patches: `(S_eta x S_zeta) . n < 0` at one of 5 x 5 points, where n is the blend of the corner
/// normals. The comparison has a margin of 1e-9 relative to the lengths of the three vectors.
fn folded_patches(tool: &ToolModel) -> Vec<u32> {
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

#[cfg(test)]
mod tests {
    use super::EdgeOverrides;

    #[test]
    fn an_element_whose_edges_change_twice_is_listed_once() {
        let overrides = EdgeOverrides { eq8: vec![1, 4, 9], straight: vec![0, 4] };
        assert_eq!(overrides.elements(), [0, 1, 4, 9]);
    }
}
