//! Names of products and of their occurrences.

use rustc_hash::FxHashMap;

use super::entity::Entity;
use super::resolver::Resolver;
use crate::attributes::{Name, name};

/// Beginning of the names that a widespread library gives to products without one.
const MADE_UP: &str = "Open CASCADE STEP translator";

/// Name of the product whose shape a representation is, by the instance of the representation.
pub fn products(resolver: &Resolver) -> FxHashMap<u32, Name> {
    let definitions = resolver.entities().filter(|e| e.kind() == "SHAPE_DEFINITION_REPRESENTATION");
    definitions.filter_map(product).collect()
}

/// `SHAPE_DEFINITION_REPRESENTATION(property, representation)`, the property being that of
/// `PRODUCT_DEFINITION(id, description, formation, ..)` of `PRODUCT_DEFINITION_FORMATION(id, description, product)` of
/// `PRODUCT(id, name, ..)`.
fn product(e: Entity) -> Option<(u32, Name)> {
    let a = e.attributes();
    let representation = a.entity(1).ok()?;
    let definition = a.entity(0).ok()?.attributes().entity(2).ok()?;
    if !definition.kind().starts_with("PRODUCT_DEFINITION") {
        return None;
    }
    let formation = definition.attributes().entity(2).ok()?;
    let product = formation.attributes().entity(2).ok()?.attributes();
    let own = |k: usize| name(&product.text(k)).filter(|name| !name.starts_with(MADE_UP));
    let found = own(1).or_else(|| own(0))?;
    Some((representation.index, found))
}

/// Name of an occurrence: `NEXT_ASSEMBLY_USAGE_OCCURRENCE(id, name, ..)` or `MAPPED_ITEM(name, ..)`. Labels that a
/// library has made up (`=>[0:1:1:2]`) are no names.
pub fn of_occurrence(e: Entity) -> Option<Name> {
    let k = if e.kind() == "MAPPED_ITEM" { 0 } else { 1 };
    name(&e.attributes().text(k)).filter(|found| !found.starts_with("=>["))
}
