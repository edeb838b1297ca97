//! Assembly structure: traverses the graph of representations from its roots and creates the faces of every placed
//! instance.

use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHashSet};

use super::entity::Outcome;
use super::graph::{Child, Graph, graph};
use super::items::{ItemBody, ItemFaces};
use super::place;
use super::resolver::{REFERENCE_DEPTH_MAX, Resolver};
use crate::Severity;
use crate::attributes::{Body, BodyKind, Name, Style, path_below};
use crate::raw::{RawFace, RawModel, max_sides};
use kanagata_geometry::Affine;

/// Reads the faces of the model.
///
/// # Errors
/// For cyclic or self-multiplying references.
pub fn faces(resolver: &Resolver, model: &mut RawModel) -> Outcome<()> {
    let graph = graph(resolver)?;
    let mut counts = vec![None; graph.groups.len()];
    for group in 0..graph.groups.len() {
        count(&graph, group, &mut counts, 0)?;
    }
    let placed = graph.placed();
    let elsewhere = items_placed_elsewhere(&graph, &placed);
    let root = |&g: &usize| !placed[g] && !repeats_component(&graph, g, &elsewhere);
    let all: Vec<usize> = (0..graph.groups.len()).filter(root).collect();
    let roots = of_products(resolver, &graph, all, &counts);
    let total = roots.iter().fold(0, |sum: usize, &g| sum.saturating_add(counts[g].unwrap_or(0)));
    let limit = max_sides(model.bytes);
    if total > limit
        && let Some(sheet) = graph.sheets.first()
    {
        let found = format!("an assembly whose placed faces have {total} sides in all");
        let allowed = format!("at most {limit} in a file of {} bytes", model.bytes);
        let mut fault = sheet.entity.fault(found, allowed);
        fault.fatal = true;
        return Err(fault);
    }
    describe(&graph, model);
    let mut placer = Placer::new(resolver, model);
    // Shape aspects name single faces of a solid again: those of the solid have precedence, at any position in the
    // file.
    let root_sheets = roots.iter().flat_map(|&g| &graph.groups[g].sheets);
    let in_shells = root_sheets.flat_map(|&s| &graph.sheets[s].items).flat_map(|i| &i.faces);
    let in_shells = in_shells.filter(|f| f.shell.is_some()).map(|f| (0, f.source.clone()));
    placer.in_shells = in_shells.collect();
    for &root in &roots {
        placer.place(&graph, root, &counts);
    }
    Ok(())
}

/// The roots that contain the shape of a product, or all roots if none does. Faces of the others are reported and
/// excluded.
fn of_products(
    resolver: &Resolver,
    graph: &Graph,
    roots: Vec<usize>,
    counts: &[Option<usize>],
) -> Vec<usize> {
    let has_faces = |g: &usize| counts[*g].unwrap_or(0) > 0;
    let (products, others): (Vec<usize>, Vec<usize>) =
        roots.iter().partition(|g| graph.groups[**g].of_product);
    if !products.iter().any(has_faces) {
        return roots;
    }
    let mut report_omitted = others.iter().filter(|g| has_faces(g)).peekable();
    if let Some(first) = report_omitted.peek() {
        let place = graph.sheets[graph.groups[**first].sheets[0]].entity.place();
        let n = report_omitted.count();
        let text = format!(
            "{n} representations with faces are the shape of no product (shape aspects, features, construction geometry): \
             left out"
        );
        resolver.note(Severity::Note, "not-of-product", place, text);
    }
    products
}

/// Items of representations that are placed in others.
fn items_placed_elsewhere(graph: &Graph, placed: &[bool]) -> FxHashSet<u32> {
    let groups = graph.groups.iter().zip(placed).filter(|(_, placed)| **placed);
    let sheets = groups.flat_map(|(g, _)| &g.sheets);
    sheets.flat_map(|&s| &graph.sheets[s].items).map(|i| i.entity).collect()
}

/// True for a representation that consists of items of placed components: validation properties repeat a component's
/// solid.
fn repeats_component(graph: &Graph, group: usize, placed: &FxHashSet<u32>) -> bool {
    let g = &graph.groups[group];
    let mut items = g.sheets.iter().flat_map(|&s| &graph.sheets[s].items).peekable();
    g.children.is_empty() && items.peek().is_some() && items.all(|i| placed.contains(&i.entity))
}

fn describe(graph: &Graph, model: &mut RawModel) {
    let with_faces = graph.sheets.iter().filter(|s| s.items.iter().any(|i| !i.faces.is_empty()));
    let first = with_faces.clone().next().or(graph.sheets.first());
    model.unit = first.map_or("mm (assumed)".into(), |s| s.context.name.clone());
    model.unit_mm = first.map_or(1.0, |s| s.context.units.length);
    model.resolution_mm = with_faces.map(|s| s.context.resolution).fold(0.0, f64::max);
    model.loose_curves = graph.sheets.iter().flat_map(|s| &s.items).map(|i| i.loose_curves).sum();
}

/// Number of sides of the faces below a group, including every instance.
fn count(
    graph: &Graph,
    group: usize,
    counts: &mut Vec<Option<usize>>,
    depth: usize,
) -> Outcome<usize> {
    if let Some(n) = counts[group] {
        return Ok(n);
    }
    let g = &graph.groups[group];
    let entity = graph.sheets[g.sheets[0]].entity;
    if depth > REFERENCE_DEPTH_MAX {
        let mut fault = entity.fault(
            "an assembly that contains itself",
            format!("at most {REFERENCE_DEPTH_MAX} levels, no cycles"),
        );
        fault.fatal = true;
        return Err(fault);
    }
    let faces = g.sheets.iter().flat_map(|&s| &graph.sheets[s].items).flat_map(|i| &i.faces);
    let mut n: usize = faces.map(RawFace::sides).sum();
    for child in &g.children {
        n = n.saturating_add(count(graph, child.group, counts, depth + 1)?);
    }
    counts[group] = Some(n);
    Ok(n)
}

/// A placed occurrence of a group.
struct Occurrence {
    map: Affine,
    /// Number of the occurrence; roots are one.
    number: usize,
    /// Names of products and occurrences.
    path: Arc<[Name]>,
    style: Style,
}

impl Occurrence {
    /// The occurrence `number` of a group within this one.
    fn below(&self, graph: &Graph, child: &Child, number: usize) -> Self {
        let names = [graph.groups[child.group].product.clone(), child.name.clone()];
        let or = |own: &Style| Style {
            layers: if own.layers.is_empty() { &self.style } else { own }.layers.clone(),
            colour: own.colour.or(self.style.colour),
        };
        Self {
            map: self.map.after(&child.map),
            number,
            path: path_below(&self.path, &names),
            style: or(&child.style),
        }
    }
}

/// Adds instances to the model, with separate numbers of edges and shells for each.
struct Placer<'r, 't, 'm> {
    resolver: &'r Resolver<'t>,
    model: &'m mut RawModel,
    edges: FxHashMap<(usize, usize), usize>,
    /// Items and faces of shells already placed, by instance.
    seen: FxHashSet<(usize, String)>,
    /// Body of the faces of no solid or shell, by instance.
    loose: FxHashMap<usize, usize>,
    /// Faces in shells of the roots.
    in_shells: FxHashSet<(usize, String)>,
    shells: usize,
    instances: usize,
}

impl<'r, 't, 'm> Placer<'r, 't, 'm> {
    fn new(resolver: &'r Resolver<'t>, model: &'m mut RawModel) -> Self {
        let (edges, seen, loose, in_shells) = Default::default();
        Self { resolver, model, edges, seen, loose, in_shells, shells: 0, instances: 0 }
    }

    /// Places a root group and its descendants. Roots share one numbering, because their items may share edges.
    fn place(&mut self, graph: &Graph, root: usize, counts: &[Option<usize>]) {
        let of_root = [graph.groups[root].product.clone()];
        let path = path_below(&Arc::default(), &of_root);
        let whole =
            Occurrence { map: Affine::identity(), number: 0, path, style: Style::default() };
        let mut todo = vec![(root, whole)];
        while let Some((group, occurrence)) = todo.pop() {
            let g = &graph.groups[group];
            for sheet in &g.sheets {
                for item in &graph.sheets[*sheet].items {
                    self.item(item, &occurrence);
                }
            }
            for child in g.children.iter().rev() {
                if counts[child.group].unwrap_or(0) > 0 {
                    self.instances += 1;
                    todo.push((child.group, occurrence.below(graph, child, self.instances)));
                }
            }
        }
    }

    fn item(&mut self, item: &ItemFaces, occurrence: &Occurrence) {
        let (map, instance) = (&occurrence.map, occurrence.number);
        // An item listed by two representations is placed once, as is a face listed in addition to its shell.
        if !self.seen.insert((instance, format!("item {}", item.entity))) {
            return;
        }
        let mut bodies: FxHashMap<usize, usize> = FxHashMap::default();
        for face in &item.faces {
            let key = (instance, face.source.clone());
            let again = self.in_shells.contains(&key) || self.seen.contains(&key);
            self.seen.insert(key);
            if again && face.shell.is_none() {
                continue;
            }
            match place::face(face, map) {
                Some(mut placed) => {
                    self.number(&mut placed, instance);
                    let attributes = Arc::make_mut(&mut placed.attributes);
                    let own = attributes.body;
                    if let Some(body) = item.bodies.get(own) {
                        let number = bodies.entry(own);
                        attributes.body = *number.or_insert_with(|| self.body(body, occurrence));
                    }
                    attributes.inherit(&occurrence.style);
                    self.model.faces.push(placed);
                }
                None => self.resolver.note(
                    Severity::Warning,
                    "face-skipped",
                    face.source.clone(),
                    "its placement is no similarity (unequal scales): face omitted".into(),
                ),
            }
        }
        self.shells += item.shells;
    }

    /// Number of a body of an occurrence; all its faces of no solid or shell are one.
    fn body(&mut self, body: &ItemBody, occurrence: &Occurrence) -> usize {
        let ItemBody { kind, name, source } = body;
        let fresh = self.model.bodies.len();
        let (number, source) = if *kind == BodyKind::Faces {
            (*self.loose.entry(occurrence.number).or_insert(fresh), String::new())
        } else {
            (fresh, source.clone())
        };
        if number == fresh {
            let path = path_below(&occurrence.path, std::slice::from_ref(name));
            self.model.bodies.push(Body { path, kind: *kind, source });
        }
        number
    }

    fn number(&mut self, face: &mut RawFace, instance: usize) {
        face.shell = face.shell.map(|s| s + self.shells);
        for edge in face.loops.iter_mut().flat_map(|l| &mut l.edges) {
            if let Some(id) = edge.edge_id {
                let fresh = self.edges.len();
                edge.edge_id = Some(*self.edges.entry((instance, id)).or_insert(fresh));
            }
        }
    }
}
