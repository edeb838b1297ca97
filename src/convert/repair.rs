//! Folded patches repaired: without their given curves, as two triangles, with straight edges.

use super::error::ConvertError;
use super::ground::{Exempt, Ground, Source};
use super::normals::NormalTable;
use super::options::ConvertReport;
use crate::geometry::Vec3;
use crate::mesh::{Element, SurfaceMesh};
use crate::tool::edge::EdgeRule;
use crate::tool::{ToolKind, ToolModel};

/// Rounds of repair: a dropped curve can fold a neighbour.
const ROUNDS: usize = 4;
/// Rounds of making edges straight: a chord can fold a neighbour too.
const STRAIGHTENINGS: usize = 16;

impl Ground<'_> {
    /// Converts, and repairs what folds unless Eq. 8 was to be left as it is.
    pub(super) fn convert_and_repair(&self) -> Result<(ToolModel, ConvertReport), ConvertError> {
        let (tool, report) = self.convert(&Exempt::default())?;
        if report.folded.is_empty() || self.options.edges == EdgeRule::Plain {
            return Ok((tool, report));
        }
        repaired(self, (tool, report))
    }
}

/// The model with as few folded patches as found: first the edges of folded patches become those of Eq. 8, then
/// folded quadrilaterals are split, and where that is asked the edges of what still folds become straight.
fn repaired(
    ground: &Ground<'_>,
    first: (ToolModel, ConvertReport),
) -> Result<(ToolModel, ConvertReport), ConvertError> {
    let &Ground { source, mesh, options, .. } = ground;
    let mut best = first;
    let mut exempt = Exempt::default();
    if options.through_cad {
        for _ in 0..ROUNDS {
            grow(&mut exempt.plain, &best.1.folded);
            let next = ground.convert(&exempt)?;
            let done = next.1.folded.iter().all(|k| exempt.plain.contains(k));
            if next.1.folded.len() <= best.1.folded.len() {
                best = next;
            }
            if done {
                break;
            }
        }
    }
    let straighten = options.straighten && options.kind == ToolKind::Nagata;
    let straightened = |ground: &Ground<'_>, exempt, best| {
        if straighten { straightened(ground, exempt, best) } else { Ok(best) }
    };
    let (cut, parents) = split(mesh, &best.0, &best.1.folded);
    if !parents.is_empty() {
        // Split elements are replaced by their first half; the second halves follow at the end, so that ids stay.
        let own = source.own().map(|table| of_parts(table, mesh, &cut, &parents));
        let cut = Ground::new(own.as_ref().map_or(source, Source::Own), &cut, options)?;
        let mut next = cut.convert(&exempt)?;
        if next.1.folded.len() < best.1.folded.len() {
            next.1.split = parents.len();
            return straightened(&cut, exempt, next);
        }
    }
    straightened(ground, exempt, best)
}

/// The edges of folded patches as chords, and those of patches that fold beside them then, until none does or all that
/// fold are straight: the model that folds least.
fn straightened(
    ground: &Ground<'_>,
    mut exempt: Exempt,
    mut best: (ToolModel, ConvertReport),
) -> Result<(ToolModel, ConvertReport), ConvertError> {
    let split = best.1.split;
    let mut folded = best.1.folded.clone();
    for _ in 0..STRAIGHTENINGS {
        let before = exempt.straight.len();
        grow(&mut exempt.straight, &folded);
        if exempt.straight.len() == before {
            break;
        }
        let mut next = ground.convert(&exempt)?;
        folded.clone_from(&next.1.folded);
        if folded.len() < best.1.folded.len() {
            next.1.split = split;
            best = next;
        }
    }
    Ok(best)
}

fn grow(list: &mut Vec<u32>, by: &[u32]) {
    list.extend(by);
    list.sort_unstable();
    list.dedup();
}

/// The mesh with the folded quadrilaterals cut along the diagonal whose triangles turn least against the normals.
/// Elements that the second halves are of follow.
fn split(mesh: &SurfaceMesh, tool: &ToolModel, folded: &[u32]) -> (SurfaceMesh, Vec<u32>) {
    let mut out = mesh.clone();
    let (mut seconds, mut parents) = (Vec::new(), Vec::new());
    for &k in folded {
        let element = mesh.elements[k as usize];
        let [a, b, c, d] = *element.nodes() else { continue };
        let corners = &tool.corners[k as usize];
        let normal: Vec3 = corners.normals.iter().map(|&n| tool.normals[n as usize]).sum();
        // The tool may have been turned round: the area tells which way its elements go.
        let x = |n: u32| mesh.vertices[n as usize];
        let cross = |t: [u32; 3]| (x(t[1]) - x(t[0])).cross(&(x(t[2]) - x(t[0]))).dot(&normal);
        let turned = corners.vertices.first() != element.nodes().first();
        let sign = if turned { -1.0 } else { 1.0 };
        let worst = |pair: [[u32; 3]; 2]| (sign * cross(pair[0])).min(sign * cross(pair[1]));
        let (one, other) = ([[a, b, c], [a, c, d]], [[a, b, d], [b, c, d]]);
        let pair = if worst(one) >= worst(other) { one } else { other };
        if worst(pair) > 0.0 {
            out.elements[k as usize] = Element::triangle(pair[0], element.face);
            seconds.push(Element::triangle(pair[1], element.face));
            parents.push(k);
        }
    }
    out.elements.extend(seconds);
    (out, parents)
}

/// Normals at the corners of a mesh some of whose elements were cut: those of the elements before.
fn of_parts(
    table: &NormalTable,
    before: &SurfaceMesh,
    cut: &SurfaceMesh,
    parents: &[u32],
) -> NormalTable {
    let count = before.elements.len();
    let parent = |k: usize| if k < count { k } else { parents[k - count] as usize };
    let ids = cut.elements.iter().enumerate().map(|(k, element)| {
        let whole = before.elements[parent(k)].nodes().iter().zip(&table.ids[parent(k)]);
        let id = |v: &u32| whole.clone().find(|pair| pair.0 == v).map(|pair| *pair.1);
        element.nodes().iter().filter_map(id).collect()
    });
    NormalTable { ids: ids.collect(), ..table.clone() }
}
