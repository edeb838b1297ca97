//! Repair of folded patches without moving a vertex: edges by Eq. 8, quadrilaterals split into two triangles, straight
//! edges.

use super::conversion::{Conversion, EdgeOverrides, Source};
use super::error::ConvertError;
use super::normals::NormalTable;
use super::options::ConvertReport;
use kanagata_geometry::Vec3;
use kanagata_mesh::{Element, SurfaceMesh};
use kanagata_tool::edge::EdgeRule;
use kanagata_tool::{ToolKind, ToolModel};

/// Maximum rounds of replacing prescribed curves by Eq. 8. More than one is needed because a changed curve can fold an
/// adjacent patch.
const EQ8_ROUNDS_MAX: usize = 4;
/// Maximum rounds of making edges straight. More than one is needed because a chord can fold an adjacent patch.
const STRAIGHTENING_ROUNDS_MAX: usize = 16;

impl Conversion<'_> {
    /// Converts the mesh and repairs folded patches. There is no repair with [`EdgeRule::Plain`].
    pub(super) fn convert_and_repair(&self) -> Result<(ToolModel, ConvertReport), ConvertError> {
        let (tool, report) = self.convert(&EdgeOverrides::default())?;
        if report.folded.is_empty() || self.options.edges == EdgeRule::Plain {
            return Ok((tool, report));
        }
        repair(self, (tool, report))
    }
}

/// Returns the model with the fewest folded patches found by three repairs in this order:
///
/// 1. the edges of folded patches follow Eq. 8;
/// 2. folded quadrilaterals are split;
/// 3. the edges of patches that remain folded become straight, with [`ConvertOptions::straighten`].
///
/// [`ConvertOptions::straighten`]: super::ConvertOptions::straighten
fn repair(
    conversion: &Conversion<'_>,
    first: (ToolModel, ConvertReport),
) -> Result<(ToolModel, ConvertReport), ConvertError> {
    let &Conversion { source, mesh, options, .. } = conversion;
    let mut best = first;
    let mut overrides = EdgeOverrides::default();
    if options.through_cad {
        for _ in 0..EQ8_ROUNDS_MAX {
            insert(&mut overrides.eq8, &best.1.folded);
            let next = conversion.convert(&overrides)?;
            let done = next.1.folded.iter().all(|k| overrides.eq8.contains(k));
            if next.1.folded.len() <= best.1.folded.len() {
                best = next;
            }
            if done {
                break;
            }
        }
    }
    let straighten = options.straighten && options.kind == ToolKind::Nagata;
    let finish = |conversion: &Conversion<'_>, overrides, best| {
        if straighten { straighten_edges(conversion, overrides, best) } else { Ok(best) }
    };
    let (cut, parents) = split_quads(mesh, &best.0, &best.1.folded);
    if !parents.is_empty() {
        // The first half replaces the element and the second half is appended, so that element numbers remain valid.
        let own =
            source.mesh_normals().map(|table| normals_after_split(table, mesh, &cut, &parents));
        let cut = Conversion::new(own.as_ref().map_or(source, Source::Mesh), &cut, options)?;
        let mut next = cut.convert(&overrides)?;
        if next.1.folded.len() < best.1.folded.len() {
            next.1.split = parents.len();
            return finish(&cut, overrides, next);
        }
    }
    finish(conversion, overrides, best)
}

/// Replaces the edges of folded patches by chords until no patch folds or all folded patches have straight edges.
/// Returns the model with the fewest folded patches.
fn straighten_edges(
    conversion: &Conversion<'_>,
    mut overrides: EdgeOverrides,
    mut best: (ToolModel, ConvertReport),
) -> Result<(ToolModel, ConvertReport), ConvertError> {
    let split = best.1.split;
    let mut folded = best.1.folded.clone();
    for _ in 0..STRAIGHTENING_ROUNDS_MAX {
        let before = overrides.straight.len();
        insert(&mut overrides.straight, &folded);
        if overrides.straight.len() == before {
            break;
        }
        let mut next = conversion.convert(&overrides)?;
        folded.clone_from(&next.1.folded);
        if folded.len() < best.1.folded.len() {
            next.1.split = split;
            best = next;
        }
    }
    Ok(best)
}

/// Inserts `elements` into a sorted list without duplicates.
fn insert(list: &mut Vec<u32>, elements: &[u32]) {
    list.extend(elements);
    list.sort_unstable();
    list.dedup();
}

/// Splits folded quadrilaterals along the diagonal with the larger minimum of (area vector . mean normal) over its two
/// triangles. A quadrilateral is not split when that minimum is not positive. Returns the mesh and, for each appended
/// second half, the number of the split element.
fn split_quads(mesh: &SurfaceMesh, tool: &ToolModel, folded: &[u32]) -> (SurfaceMesh, Vec<u32>) {
    let mut out = mesh.clone();
    let (mut seconds, mut parents) = (Vec::new(), Vec::new());
    for &k in folded {
        let element = mesh.elements[k as usize];
        let [a, b, c, d] = *element.nodes() else { continue };
        let corners = &tool.corners[k as usize];
        let normal: Vec3 = corners.normals.iter().map(|&n| tool.normals[n as usize]).sum();
        // The tool may be reversed against the mesh; the first vertex shows this.
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

/// Corner normals of the mesh `cut` with split elements, taken from the original elements; `parents` as from
/// [`split_quads`].
fn normals_after_split(
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
