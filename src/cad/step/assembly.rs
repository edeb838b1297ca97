//! Which representation is placed where: products, occurrences, mapped items. Every placed instance gives its
//! faces once.

use rustc_hash::{FxHashMap, FxHashSet};

use super::entity::{Entity, Outcome};
use super::items::{ItemFaces, ItemKind, item_kind};
use super::place;
use super::resolver::{DEEPEST, Resolver, Units};
use super::units::Context;
use crate::cad::Severity;
use crate::cad::raw::{RawFace, RawModel};
use crate::geometry::{Affine, Frame, Mat3};

/// Most placed faces a file may give.
const MOST_FACES: usize = 250_000;

/// A representation and its resolved items.
struct Sheet<'t> {
    entity: Entity<'t>,
    context: Context,
    items: Vec<ItemFaces>,
}

/// Representations of one thing in one system of coordinates, and what is placed in it.
#[derive(Default)]
struct Group {
    sheets: Vec<usize>,
    children: Vec<(usize, Affine)>,
    used: bool,
}

struct Graph<'t> {
    sheets: Vec<Sheet<'t>>,
    groups: Vec<Group>,
    /// Group of a representation, by instance.
    group_of: FxHashMap<u32, usize>,
}

/// Fills the model's faces.
///
/// # Errors
/// When references lead in circles or multiply beyond measure.
pub fn faces(resolver: &Resolver, model: &mut RawModel) -> Outcome<()> {
    let graph = graph(resolver)?;
    let mut counts = vec![None; graph.groups.len()];
    for group in 0..graph.groups.len() {
        count(&graph, group, &mut counts, 0)?;
    }
    let roots: Vec<usize> = (0..graph.groups.len()).filter(|&g| !graph.groups[g].used).collect();
    let total = roots.iter().fold(0, |sum: usize, &g| sum.saturating_add(counts[g].unwrap_or(0)));
    if total > MOST_FACES
        && let Some(sheet) = graph.sheets.first()
    {
        let mut fault = sheet
            .entity
            .fault(format!("an assembly of {total} placed faces"), format!("at most {MOST_FACES}"));
        fault.fatal = true;
        return Err(fault);
    }
    describe(&graph, model);
    let mut placer = Placer::new(resolver, model);
    // Shape aspects name single faces of a solid again: the solid's own counts, wherever it stands in the file.
    let root_sheets = roots.iter().flat_map(|&g| &graph.groups[g].sheets);
    let in_shells = root_sheets.flat_map(|&s| &graph.sheets[s].items).flat_map(|i| &i.faces);
    let in_shells = in_shells.filter(|f| f.shell.is_some()).map(|f| (0, f.source.clone()));
    placer.in_shells = in_shells.collect();
    for &root in &roots {
        placer.place(&graph, root, &counts);
    }
    Ok(())
}

fn describe(graph: &Graph, model: &mut RawModel) {
    let with_faces = graph.sheets.iter().filter(|s| s.items.iter().any(|i| !i.faces.is_empty()));
    let first = with_faces.clone().next().or(graph.sheets.first());
    model.unit = first.map_or("mm (assumed)".into(), |s| s.context.name.clone());
    model.unit_mm = first.map_or(1.0, |s| s.context.units.length);
    model.resolution_mm = with_faces.map(|s| s.context.resolution).fold(0.0, f64::max);
    model.loose_curves = graph.sheets.iter().flat_map(|s| &s.items).map(|i| i.loose_curves).sum();
}

/// Representations, their links, their items' faces.
fn graph<'t>(resolver: &Resolver<'t>) -> Outcome<Graph<'t>> {
    let mut graph = Graph { sheets: vec![], groups: vec![], group_of: FxHashMap::default() };
    let mut contexts: FxHashMap<u32, Context> = FxHashMap::default();
    let mut mapped: Vec<(usize, Entity)> = vec![];
    let mut skipped: [(usize, Option<Entity>); 2] = Default::default();
    for e in representations(resolver) {
        let a = e.attributes();
        let (Ok(items), Ok(context)) = (a.entities(1), a.entity(2)) else {
            let fault = e.fault("no items or no context", "REPRESENTATION(name, items, context)");
            resolver.diagnostics.borrow_mut().push(fault.into_diagnostic("entity-invalid"));
            continue;
        };
        let known = contexts.get(&context.index).cloned();
        let context_read = known.map_or_else(|| resolver.context(context), Ok)?;
        contexts.insert(context.index, context_read.clone());
        let units = context_read.units;
        let number = graph.sheets.len();
        let mut sheet = Sheet { entity: e, context: context_read, items: vec![] };
        for item in items {
            match item_kind(item) {
                ItemKind::Shape => sheet.items.push(resolver.item(item, units)?),
                ItemKind::Loose => {
                    sheet.items.push(ItemFaces {
                        entity: item.index,
                        loose_curves: 1,
                        ..ItemFaces::default()
                    });
                }
                ItemKind::Mapped => mapped.push((number, item)),
                ItemKind::Tessellated => tally(&mut skipped[0], item),
                ItemKind::Constructive => tally(&mut skipped[1], item),
                ItemKind::Other => {}
            }
        }
        graph.sheets.push(sheet);
    }
    for ((n, first), kind) in
        skipped.into_iter().zip([ItemKind::Tessellated, ItemKind::Constructive])
    {
        if let Some(first) = first {
            resolver.left_out(kind, n, first);
        }
    }
    group_sheets(resolver, &mut graph);
    mapped_items(resolver, &mut graph, &mapped);
    occurrences(resolver, &mut graph);
    if graph.sheets.iter().all(|s| s.items.is_empty()) {
        orphans(resolver, &mut graph)?;
    }
    Ok(graph)
}

fn tally<'t>(count: &mut (usize, Option<Entity<'t>>), item: Entity<'t>) {
    count.0 += 1;
    count.1 = count.1.or(Some(item));
}

/// Shape representations, and whatever a shape definition names as one.
fn representations<'t>(resolver: &Resolver<'t>) -> Vec<Entity<'t>> {
    let defined: FxHashSet<u32> = resolver
        .entities()
        .filter(|e| e.kind() == "SHAPE_DEFINITION_REPRESENTATION")
        .filter_map(|e| e.attributes().entity(1).ok().map(|r| r.index))
        .collect();
    let is = |e: &Entity| {
        e.parts().iter().any(|p| {
            p.keyword.ends_with("SHAPE_REPRESENTATION")
                && p.keyword != "CONTEXT_DEPENDENT_SHAPE_REPRESENTATION"
        }) || defined.contains(&e.index)
    };
    resolver.entities().filter(is).collect()
}

/// Joins representations that a relationship without transformation calls the same.
fn group_sheets(resolver: &Resolver, graph: &mut Graph) {
    let position: FxHashMap<u32, usize> =
        graph.sheets.iter().enumerate().map(|(k, s)| (s.entity.index, k)).collect();
    let mut parent: Vec<usize> = (0..graph.sheets.len()).collect();
    let find = |parent: &mut Vec<usize>, mut k: usize| {
        while parent[k] != k {
            parent[k] = parent[parent[k]];
            k = parent[k];
        }
        k
    };
    for e in resolver.entities() {
        let plain =
            matches!(e.kind(), "SHAPE_REPRESENTATION_RELATIONSHIP" | "REPRESENTATION_RELATIONSHIP");
        if !plain || e.has("REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION") {
            continue;
        }
        let a = e.attributes();
        let sheet = |k: usize| a.entity(k).ok().and_then(|r| position.get(&r.index).copied());
        if let (Some(first), Some(second)) = (sheet(2), sheet(3)) {
            let (first, second) = (find(&mut parent, first), find(&mut parent, second));
            parent[first.max(second)] = first.min(second);
        }
    }
    let mut group_of_root: FxHashMap<usize, usize> = FxHashMap::default();
    for k in 0..graph.sheets.len() {
        let root = find(&mut parent, k);
        let fresh = group_of_root.len();
        let group = *group_of_root.entry(root).or_insert(fresh);
        if group == graph.groups.len() {
            graph.groups.push(Group::default());
        }
        graph.groups[group].sheets.push(k);
        graph.group_of.insert(graph.sheets[k].entity.index, group);
    }
}

impl Graph<'_> {
    fn units(&self, representation: Entity) -> Option<Units> {
        let sheet = self.sheets.iter().find(|s| s.entity.index == representation.index)?;
        Some(sheet.context.units)
    }

    fn add(&mut self, parent: usize, child: usize, map: Affine) {
        self.groups[parent].children.push((child, map));
        self.groups[child].used = true;
    }
}

/// `MAPPED_ITEM(name, REPRESENTATION_MAP(origin, representation), target)`.
fn mapped_items(resolver: &Resolver, graph: &mut Graph, mapped: &[(usize, Entity)]) {
    for &(sheet, e) in mapped {
        let into = graph.sheets[sheet].context.units;
        let read = || -> Outcome<Option<(usize, Affine)>> {
            let a = e.attributes();
            let map = a.entity(1)?.attributes();
            let representation = map.entity(1)?;
            let Some(&child) = graph.group_of.get(&representation.index) else { return Ok(None) };
            let from = graph.units(representation).unwrap_or(into);
            let origin = resolver.frame(map.entity(0)?, from)?;
            let target = a.entity(2)?;
            let target = if target.kind().starts_with("CARTESIAN_TRANSFORMATION_OPERATOR") {
                resolver.operator(target, into)?
            } else {
                outward(&resolver.frame(target, into)?)
            };
            Ok(Some((child, target.after(&inward(&origin)))))
        };
        match read() {
            Ok(Some((child, map))) => {
                let parent = graph.group_of[&graph.sheets[sheet].entity.index];
                graph.add(parent, child, map);
            }
            Ok(None) => {
                let fault = e.fault("a map of something without a shape", "a shape representation");
                resolver.diagnostics.borrow_mut().push(fault.into_diagnostic("entity-skipped"));
            }
            Err(fault) => {
                resolver.diagnostics.borrow_mut().push(fault.into_diagnostic("entity-invalid"));
            }
        }
    }
}

/// Components placed by `REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION`, once for each
/// `CONTEXT_DEPENDENT_SHAPE_REPRESENTATION` that uses it (once if none does).
fn occurrences(resolver: &Resolver, graph: &mut Graph) {
    let shapes = shapes_of_products(resolver);
    let mut uses: FxHashMap<u32, Vec<Option<u32>>> = FxHashMap::default();
    for e in resolver.entities().filter(|e| e.kind() == "CONTEXT_DEPENDENT_SHAPE_REPRESENTATION") {
        let a = e.attributes();
        let Ok(relation) = a.entity(0) else { continue };
        let usage = a.entity(1).and_then(|shape| shape.attributes().entity(2));
        if usage.as_ref().is_ok_and(|u| u.kind() == "SPECIFIED_HIGHER_USAGE_OCCURRENCE") {
            continue;
        }
        // NEXT_ASSEMBLY_USAGE_OCCURRENCE(id, name, description, relating, related, ..)
        let component = usage.and_then(|u| u.attributes().entity(4)).ok();
        uses.entry(relation.index).or_default().push(component.map(|c| c.index));
    }
    for e in resolver.entities() {
        if !e.has("REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION") {
            continue;
        }
        let read = relation(resolver, graph, e);
        let (first, second, map) = match read {
            Ok(Some(found)) => found,
            Ok(None) => continue,
            Err(fault) => {
                resolver.diagnostics.borrow_mut().push(fault.into_diagnostic("entity-invalid"));
                continue;
            }
        };
        for component in uses.get(&e.index).map_or([None].as_slice(), Vec::as_slice) {
            let shape = component.and_then(|c| shapes.get(&c)).and_then(|s| graph.group_of.get(s));
            // Some writers exchange the two: the occurrence says which is the component.
            if shape == Some(&second) && first != second {
                if let Some(back) = map.linear.try_inverse() {
                    let back = Affine { linear: back, shift: -(back * map.shift) };
                    graph.add(first, second, back);
                }
            } else {
                graph.add(second, first, map);
            }
        }
    }
}

/// Groups of both sides and the map from the first to the second.
fn relation(
    resolver: &Resolver,
    graph: &Graph,
    e: Entity,
) -> Outcome<Option<(usize, usize, Affine)>> {
    let a = e.attributes();
    let pair = e.part("REPRESENTATION_RELATIONSHIP");
    let sides = pair.as_ref().unwrap_or(&a);
    let (first, second) = (sides.entity(2)?, sides.entity(3)?);
    let by = match e.part("REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION") {
        Some(part) => part.entity(part.len().saturating_sub(1))?,
        None => a.entity(4)?,
    };
    let (Some(&one), Some(&two)) =
        (graph.group_of.get(&first.index), graph.group_of.get(&second.index))
    else {
        return Ok(None);
    };
    let (Some(from), Some(to)) = (graph.units(first), graph.units(second)) else { return Ok(None) };
    let map = if by.kind() == "ITEM_DEFINED_TRANSFORMATION" {
        let t = by.attributes();
        let (origin, target) =
            (resolver.frame(t.entity(2)?, from)?, resolver.frame(t.entity(3)?, to)?);
        outward(&target).after(&inward(&origin))
    } else {
        resolver.operator(by, to)?
    };
    Ok(Some((one, two, map)))
}

/// Shape representation of each product definition.
fn shapes_of_products(resolver: &Resolver) -> FxHashMap<u32, u32> {
    let pair = |e: Entity| -> Outcome<(u32, u32)> {
        let a = e.attributes();
        let definition = a.entity(0)?.attributes().entity(2)?;
        Ok((definition.index, a.entity(1)?.index))
    };
    let definitions = resolver.entities().filter(|e| e.kind() == "SHAPE_DEFINITION_REPRESENTATION");
    definitions.filter_map(|e| pair(e).ok()).collect()
}

/// Without any representation that holds shapes: the solids, else the shells, else the faces of the file.
fn orphans<'t>(resolver: &Resolver<'t>, graph: &mut Graph<'t>) -> Outcome<()> {
    let tiers: [&[&str]; 3] = [
        &[
            "MANIFOLD_SOLID_BREP",
            "BREP_WITH_VOIDS",
            "FACETED_BREP",
            "SHELL_BASED_SURFACE_MODEL",
            "GEOMETRIC_SET",
        ],
        &["CLOSED_SHELL", "OPEN_SHELL", "CONNECTED_FACE_SET"],
        &["ADVANCED_FACE", "FACE_SURFACE"],
    ];
    let of = |tier: &&[&str]| -> Vec<Entity<'t>> {
        resolver.entities().filter(|e| tier.contains(&e.kind())).collect()
    };
    let Some(found) = tiers.iter().map(of).find(|found| !found.is_empty()) else { return Ok(()) };
    let context = resolver.entities().find(|e| e.has("GLOBAL_UNIT_ASSIGNED_CONTEXT"));
    let context = context.map_or_else(
        || {
            let units = Units { length: 1.0, angle: 1.0 };
            Ok(Context { units, name: "mm (assumed)".into(), resolution: 0.0 })
        },
        |c| resolver.context(c),
    )?;
    let text = format!("{} shapes are in no representation: taken as they stand", found.len());
    resolver.note(Severity::Warning, "shape-unplaced", found[0].place(), text);
    let units = context.units;
    let items = found.iter().map(|e| resolver.item(*e, units)).collect::<Outcome<_>>()?;
    graph.groups.push(Group { sheets: vec![graph.sheets.len()], ..Group::default() });
    graph.sheets.push(Sheet { entity: found[0], context, items });
    Ok(())
}

/// Faces under a group, every instance counted.
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
    if depth > DEEPEST {
        let mut fault = entity.fault(
            "an assembly that contains itself",
            format!("at most {DEEPEST} levels, no circles"),
        );
        fault.fatal = true;
        return Err(fault);
    }
    let own: usize =
        g.sheets.iter().flat_map(|&s| &graph.sheets[s].items).map(|i| i.faces.len()).sum();
    let mut n = own;
    for &(child, _) in &g.children {
        n = n.saturating_add(count(graph, child, counts, depth + 1)?);
    }
    counts[group] = Some(n);
    Ok(n)
}

/// Puts instances into the model, numbering edges and shells afresh for each.
struct Placer<'r, 't, 'm> {
    resolver: &'r Resolver<'t>,
    model: &'m mut RawModel,
    edges: FxHashMap<(usize, usize), usize>,
    /// Items placed, and faces of shells placed, by instance.
    seen: FxHashSet<(usize, String)>,
    /// Faces of the roots' shells.
    in_shells: FxHashSet<(usize, String)>,
    shells: usize,
    instances: usize,
}

impl<'r, 't, 'm> Placer<'r, 't, 'm> {
    fn new(resolver: &'r Resolver<'t>, model: &'m mut RawModel) -> Self {
        let (edges, seen, in_shells) = Default::default();
        Self { resolver, model, edges, seen, in_shells, shells: 0, instances: 0 }
    }

    /// Places a root group and all below it. Roots share one numbering: their items may share edges.
    fn place(&mut self, graph: &Graph, root: usize, counts: &[Option<usize>]) {
        let mut todo = vec![(root, Affine::identity(), 0)];
        while let Some((group, map, instance)) = todo.pop() {
            let g = &graph.groups[group];
            for sheet in &g.sheets {
                for item in &graph.sheets[*sheet].items {
                    self.item(item, &map, instance);
                }
            }
            for (child, inner) in g.children.iter().rev() {
                if counts[*child].unwrap_or(0) > 0 {
                    self.instances += 1;
                    todo.push((*child, map.after(inner), self.instances));
                }
            }
        }
    }

    fn item(&mut self, item: &ItemFaces, map: &Affine, instance: usize) {
        // An item listed by two representations of one thing counts once, as does a face listed beside its shell.
        if !self.seen.insert((instance, format!("item {}", item.entity))) {
            return;
        }
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
                    self.model.faces.push(placed);
                }
                None => self.resolver.note(
                    Severity::Warning,
                    "face-skipped",
                    face.source.clone(),
                    "its placement changes shapes (unequal scales): face left out".into(),
                ),
            }
        }
        self.shells += item.shells;
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

/// From a frame's coordinates to those it is given in.
fn outward(f: &Frame) -> Affine {
    Affine { linear: Mat3::from_columns(&[f.x, f.y, f.z]), shift: f.origin }
}

/// The inverse of [`outward`].
fn inward(f: &Frame) -> Affine {
    let linear = Mat3::from_columns(&[f.x, f.y, f.z]).transpose();
    Affine { linear, shift: -(linear * f.origin) }
}
