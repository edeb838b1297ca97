//! Graph of representations: products, occurrences, mapped items.

use rustc_hash::{FxHashMap, FxHashSet};

use super::entity::{Entity, Outcome};
use super::items::{ItemFaces, ItemKind, item_kind};
use super::names;
use super::relations::{
    Held, inward, map_between, outward, shapes_of_products, sides, uses_of_relations,
};
use super::resolver::{Resolver, Units};
use super::units::Context;
use crate::Severity;
use crate::attributes::{Name, Style};
use kanagata_geometry::Affine;
use kanagata_geometry::sets::DisjointSets;

/// A representation and its resolved items.
pub struct Sheet<'t> {
    pub entity: Entity<'t>,
    pub context: Context,
    pub items: Vec<ItemFaces>,
}

/// A group placed in another.
pub struct Child {
    pub group: usize,
    pub map: Affine,
    /// Name of the occurrence.
    pub name: Option<Name>,
    /// Layers and colour of the occurrence.
    pub(crate) style: Style,
}

/// Representations of one object in a common coordinate system, and the groups placed in it.
#[derive(Default)]
pub struct Group {
    pub sheets: Vec<usize>,
    pub children: Vec<Child>,
    /// Name of the product.
    pub product: Option<Name>,
    /// Shape of a product, by a `SHAPE_DEFINITION_REPRESENTATION`.
    pub of_product: bool,
}

pub struct Graph<'t> {
    pub sheets: Vec<Sheet<'t>>,
    pub groups: Vec<Group>,
    /// Group of a representation, by instance index.
    group_of: FxHashMap<u32, usize>,
}

/// Reads representations, their relationships, and the faces of their items.
pub fn graph<'t>(resolver: &Resolver<'t>) -> Outcome<Graph<'t>> {
    let mut graph = Graph { sheets: vec![], groups: vec![], group_of: FxHashMap::default() };
    let mut contexts: FxHashMap<u32, Context> = FxHashMap::default();
    let mut unread = Unread::default();
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
        let items = read_items(resolver, items, units, (number, &mut unread))?;
        graph.sheets.push(Sheet { entity: e, context: context_read, items });
    }
    report_skipped(resolver, unread.skipped);
    group_sheets(resolver, &mut graph);
    mapped_items(resolver, &mut graph, &unread.mapped);
    occurrences(resolver, &mut graph);
    if graph.sheets.iter().all(|s| s.items.is_empty()) {
        unreferenced_shapes(resolver, &mut graph)?;
    }
    Ok(graph)
}

/// Representation items without faces of their own.
#[derive(Default)]
struct Unread<'t> {
    /// Mapped items, with the index of their sheet.
    mapped: Vec<(usize, Entity<'t>)>,
    /// Number and first of the tessellated and of the constructive items.
    skipped: [(usize, Option<Entity<'t>>); 2],
}

/// Reads the items of the sheet `number` that are shapes or curves, and adds the others to `unread`.
fn read_items<'t>(
    resolver: &Resolver<'t>,
    items: Vec<Entity<'t>>,
    units: Units,
    (number, unread): (usize, &mut Unread<'t>),
) -> Outcome<Vec<ItemFaces>> {
    let mut read = vec![];
    for item in items {
        match item_kind(item) {
            ItemKind::Shape => read.push(resolver.item(item, units)?),
            ItemKind::Loose => {
                let entity = item.index;
                read.push(ItemFaces { entity, loose_curves: 1, ..ItemFaces::default() });
            }
            ItemKind::Mapped => unread.mapped.push((number, item)),
            ItemKind::Tessellated => tally(&mut unread.skipped[0], item),
            ItemKind::Constructive => tally(&mut unread.skipped[1], item),
            ItemKind::Other => {}
        }
    }
    Ok(read)
}

/// Reports omitted tessellated and constructive items.
fn report_skipped(resolver: &Resolver, skipped: [(usize, Option<Entity>); 2]) {
    for ((n, first), kind) in
        skipped.into_iter().zip([ItemKind::Tessellated, ItemKind::Constructive])
    {
        if let Some(first) = first {
            resolver.report_omitted(kind, n, first);
        }
    }
}

fn tally<'t>(count: &mut (usize, Option<Entity<'t>>), item: Entity<'t>) {
    count.0 += 1;
    count.1 = count.1.or(Some(item));
}

/// Shape representations, and all representations named by a shape definition. Saved views (draughting models) show shapes
/// and are none, also where an entity is both.
pub fn representations<'t>(resolver: &Resolver<'t>) -> Vec<Entity<'t>> {
    let defined: FxHashSet<u32> = resolver
        .entities()
        .filter(|e| e.kind() == "SHAPE_DEFINITION_REPRESENTATION")
        .filter_map(|e| e.attributes().entity(1).ok().map(|r| r.index))
        .collect();
    let is_shape = |e: &Entity| {
        e.parts().iter().any(|p| {
            p.keyword.ends_with("SHAPE_REPRESENTATION")
                && p.keyword != "CONTEXT_DEPENDENT_SHAPE_REPRESENTATION"
        })
    };
    let is = |e: &Entity| (is_shape(e) && !e.has("DRAUGHTING_MODEL")) || defined.contains(&e.index);
    resolver.entities().filter(is).collect()
}

/// Groups representations connected by a relationship without transformation.
fn group_sheets(resolver: &Resolver, graph: &mut Graph) {
    let position: FxHashMap<u32, usize> =
        graph.sheets.iter().enumerate().map(|(k, s)| (s.entity.index, k)).collect();
    let (products, others) = defined_shapes(resolver);
    let is_no_product = |index: &u32| others.contains(index) && !products.contains(index);
    let mut sets = DisjointSets::new(graph.sheets.len());
    for e in resolver.entities() {
        let plain =
            matches!(e.kind(), "SHAPE_REPRESENTATION_RELATIONSHIP" | "REPRESENTATION_RELATIONSHIP");
        if !plain || e.has("REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION") {
            continue;
        }
        let a = e.attributes();
        let sheet = |k: usize| {
            let side = a.entity(k).ok().filter(|r| !is_no_product(&r.index))?;
            position.get(&side.index).copied()
        };
        if let (Some(first), Some(second)) = (sheet(2), sheet(3)) {
            sets.join(first, second);
        }
    }
    let (group_of, count) = sets.numbered();
    let named = names::products(resolver);
    graph.groups.resize_with(count, Group::default);
    for (k, group) in group_of.into_iter().enumerate() {
        let index = graph.sheets[k].entity.index;
        let own = &mut graph.groups[group];
        own.sheets.push(k);
        own.of_product |= products.contains(&index);
        own.product = own.product.take().or_else(|| named.get(&index).cloned());
        graph.group_of.insert(index, group);
    }
}

/// Representations that a `SHAPE_DEFINITION_REPRESENTATION` names as the shape of a product or of its occurrence, and
/// those of other objects: shape aspects, datums, features, properties. By ISO 10303-41 the definition is a property of
/// a product definition or of a relationship of two.
fn defined_shapes(resolver: &Resolver) -> (FxHashSet<u32>, FxHashSet<u32>) {
    let (mut products, mut others) = (FxHashSet::default(), FxHashSet::default());
    for e in resolver.entities().filter(|e| e.kind() == "SHAPE_DEFINITION_REPRESENTATION") {
        let a = e.attributes();
        let Ok(representation) = a.entity(1) else { continue };
        let defined = a.entity(0).and_then(|property| property.attributes().entity(2));
        // Unreadable definitions count as products, so that an error of the file omits nothing.
        let of_product = defined.map_or(true, |d| d.parts().iter().any(|p| is_product(p.keyword)));
        let set = if of_product { &mut products } else { &mut others };
        set.insert(representation.index);
    }
    (products, others)
}

/// True for a product definition or a relationship of two.
fn is_product(keyword: &str) -> bool {
    (keyword.starts_with("PRODUCT_DEFINITION") && keyword != "PRODUCT_DEFINITION_SHAPE")
        || keyword.ends_with("USAGE_OCCURRENCE")
        || keyword.ends_with("ASSEMBLY_COMPONENT_USAGE")
}

impl Graph<'_> {
    fn units(&self, representation: Entity) -> Option<Units> {
        let sheet = self.sheets.iter().find(|s| s.entity.index == representation.index)?;
        Some(sheet.context.units)
    }

    fn add(&mut self, parent: usize, child: Child) {
        self.groups[parent].children.push(child);
    }

    /// For each group, true when it is placed in another one. Where products have shapes, only the groups below them place
    /// others: what else shows a product (saved views, validation) does not hold it.
    pub fn placed(&self) -> Vec<bool> {
        let count = self.groups.len();
        let mut todo: Vec<usize> = (0..count).filter(|&g| self.groups[g].of_product).collect();
        if todo.is_empty() {
            todo = (0..count).collect();
        }
        let (mut placed, mut reached) = (vec![false; count], vec![false; count]);
        while let Some(group) = todo.pop() {
            if std::mem::replace(&mut reached[group], true) {
                continue;
            }
            for child in &self.groups[group].children {
                placed[child.group] = true;
                todo.push(child.group);
            }
        }
        placed
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
                let (name, style) = (names::of_occurrence(e), resolver.style(e));
                graph.add(parent, Child { group: child, map, name, style });
            }
            Ok(None) => {
                let fault = e.fault("a mapped item without a shape", "a shape representation");
                resolver.diagnostics.borrow_mut().push(fault.into_diagnostic("entity-skipped"));
            }
            Err(fault) => {
                resolver.diagnostics.borrow_mut().push(fault.into_diagnostic("entity-invalid"));
            }
        }
    }
}

/// Components placed by `REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION`, once for each
/// `CONTEXT_DEPENDENT_SHAPE_REPRESENTATION` that refers to it (once without any).
fn occurrences(resolver: &Resolver, graph: &mut Graph) {
    let shapes = shapes_of_products(resolver);
    let uses = uses_of_relations(resolver);
    let held = Held::new(resolver);
    for e in resolver.entities() {
        if !e.has("REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION") {
            continue;
        }
        let read = relation(resolver, graph, e, &held);
        let (first, second, map) = match read {
            Ok(Some(found)) => found,
            Ok(None) => continue,
            Err(fault) => {
                resolver.diagnostics.borrow_mut().push(fault.into_diagnostic("entity-invalid"));
                continue;
            }
        };
        for used in uses.get(&e.index).map_or([(None, None)].as_slice(), Vec::as_slice) {
            let (component, name) = (used.0, used.1.clone());
            let child = |group, map| Child { group, map, name, style: Style::default() };
            let shape = component.and_then(|c| shapes.get(&c)).and_then(|s| graph.group_of.get(s));
            // Some writers exchange both: the occurrence identifies the component.
            if shape == Some(&second) && first != second {
                if let Some(back) = map.linear.try_inverse() {
                    let back = Affine { linear: back, shift: -(back * map.shift) };
                    graph.add(first, child(second, back));
                }
            } else {
                graph.add(second, child(first, map));
            }
        }
    }
}

/// Groups on both sides, and the map from the first to the second.
fn relation(
    resolver: &Resolver,
    graph: &Graph,
    e: Entity,
    held: &Held,
) -> Outcome<Option<(usize, usize, Affine)>> {
    let [first, second] = sides(e)?;
    let (Some(&one), Some(&two)) =
        (graph.group_of.get(&first.index), graph.group_of.get(&second.index))
    else {
        return Ok(None);
    };
    let (Some(from), Some(to)) = (graph.units(first), graph.units(second)) else { return Ok(None) };
    Ok(Some((one, two, map_between(resolver, e, [from, to], held)?)))
}

/// For files without any representation of shapes: the solids, otherwise the shells, otherwise the faces.
fn unreferenced_shapes<'t>(resolver: &Resolver<'t>, graph: &mut Graph<'t>) -> Outcome<()> {
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
    let text = format!("{} shapes are in no representation: used without placement", found.len());
    resolver.note(Severity::Warning, "shape-unplaced", found[0].place(), text);
    let units = context.units;
    let items = found.iter().map(|e| resolver.item(*e, units)).collect::<Outcome<_>>()?;
    graph.groups.push(Group { sheets: vec![graph.sheets.len()], ..Group::default() });
    graph.sheets.push(Sheet { entity: found[0], context, items });
    Ok(())
}
