//! Colours and layers of representation items.

use std::sync::Arc;

use rustc_hash::FxHashMap;

use super::entity::{Entity, number};
use super::table::{Table, Value};
use crate::attributes::{BASIC_COLOURS, Name, Style, name, rgb};

/// Entities of one style that are searched for its colour; a style of a surface has about eight.
const STYLE_ENTITIES_MAX: usize = 64;

/// Entities between a styled item and the colour of its surface.
const OF_SURFACE: [&str; 9] = [
    "PRESENTATION_STYLE_ASSIGNMENT",
    "PRESENTATION_STYLE_BY_CONTEXT",
    "SURFACE_STYLE_USAGE",
    "SURFACE_SIDE_STYLE",
    "SURFACE_STYLE_FILL_AREA",
    "FILL_AREA_STYLE",
    "FILL_AREA_STYLE_COLOUR",
    "SURFACE_STYLE_RENDERING",
    "SURFACE_STYLE_RENDERING_WITH_PROPERTIES",
];

/// Colours and layers by the instance of the item.
#[derive(Debug, Default)]
pub struct Styles {
    colours: FxHashMap<u32, [u8; 3]>,
    layers: FxHashMap<u32, Arc<[Name]>>,
}

impl Styles {
    /// Reads `STYLED_ITEM`, `OVER_RIDING_STYLED_ITEM`, `PRESENTATION_LAYER_ASSIGNMENT` and the assignments of `GROUP`s.
    pub fn of<'t>(entities: impl Iterator<Item = Entity<'t>>) -> Self {
        let mut styles = Self::default();
        let mut overriding = Vec::new();
        let mut layers: FxHashMap<u32, Vec<Name>> = FxHashMap::default();
        for e in entities {
            let kind = e.kind();
            if kind == "STYLED_ITEM" {
                styles.add_colour(e, false);
            } else if kind.ends_with("STYLED_ITEM") {
                overriding.push(e);
            } else if kind == "PRESENTATION_LAYER_ASSIGNMENT" {
                add_layer(e, name(&e.attributes().text(0)), 2, &mut layers);
            } else if kind.ends_with("GROUP_ASSIGNMENT") {
                let group = e.attributes().entity(0).ok();
                let named = group.and_then(|g| name(&g.attributes().text(0)));
                add_layer(e, named, 1, &mut layers);
            }
        }
        overriding.into_iter().for_each(|e| styles.add_colour(e, true));
        styles.layers = layers.into_iter().map(|(item, names)| (item, names.into())).collect();
        styles
    }

    /// `STYLED_ITEM(name, styles, item)`.
    fn add_colour(&mut self, e: Entity, overrides: bool) {
        let a = e.attributes();
        let (Ok(item), Some(colour)) = (a.entity(2), colour_below(e, a.get(1))) else { return };
        if overrides {
            self.colours.insert(item.index, colour);
        } else {
            self.colours.entry(item.index).or_insert(colour);
        }
    }

    /// Layers and colour of an item.
    pub(crate) fn style(&self, item: Entity) -> Style {
        let layers = self.layers.get(&item.index).cloned().unwrap_or_default();
        Style { layers, colour: self.colours.get(&item.index).copied() }
    }
}

/// Puts the items of list `k` on a layer. An item may be a styled one.
fn add_layer(e: Entity, layer: Option<Name>, k: usize, layers: &mut FxHashMap<u32, Vec<Name>>) {
    let Some(layer) = layer else { return };
    for item in references(e.table, e.attributes().get(k), usize::MAX) {
        let styled = item.kind().ends_with("STYLED_ITEM");
        let on = if styled { item.attributes().entity(2).ok() } else { Some(item) };
        let names = on.map(|on| layers.entry(on.index).or_default());
        if let Some(names) = names.filter(|names| names.last() != Some(&layer)) {
            names.push(Arc::clone(&layer));
        }
    }
}

/// The instances that a value refers to, also in nested lists, of which the first `most` items are read.
fn references<'t>(table: &'t Table<'t>, value: Value<'t>, most: usize) -> Vec<Entity<'t>> {
    let (mut found, mut open) = (Vec::new(), vec![value]);
    while let Some(value) = open.pop() {
        match value {
            Value::Reference(id) => {
                found.extend(table.find(id).map(|index| Entity { table, index }));
            }
            Value::List(span) => open.extend(table.values(span).iter().take(most).rev()),
            _ => {}
        }
    }
    found
}

/// The first colour below the styles of a surface.
fn colour_below<'t>(e: Entity<'t>, styles: Value<'t>) -> Option<[u8; 3]> {
    let mut open = references(e.table, styles, STYLE_ENTITIES_MAX);
    open.reverse();
    for _ in 0..STYLE_ENTITIES_MAX {
        let next = open.pop()?;
        if let Some(colour) = colour(next) {
            return Some(colour);
        }
        if OF_SURFACE.contains(&next.kind()) {
            let a = next.attributes();
            let below = (0..a.len().min(STYLE_ENTITIES_MAX)).rev();
            let values = below.map(|k| a.get(k));
            open.extend(values.flat_map(|v| references(e.table, v, STYLE_ENTITIES_MAX)));
        }
    }
    None
}

/// `COLOUR_RGB(name, red, green, blue)` or `DRAUGHTING_PRE_DEFINED_COLOUR(name)`.
fn colour(e: Entity) -> Option<[u8; 3]> {
    let a = e.attributes();
    if e.has("COLOUR_RGB") {
        let first = a.len().checked_sub(3)?;
        let part = |k: usize| number(e.table, a.get(first + k));
        return rgb([part(0)?, part(1)?, part(2)?]);
    }
    if !e.kind().ends_with("PRE_DEFINED_COLOUR") {
        return None;
    }
    let text = (0..a.len()).map(|k| a.text(k)).find(|t| !t.is_empty())?;
    BASIC_COLOURS.iter().find(|c| c.0.eq_ignore_ascii_case(text.trim())).map(|c| c.1)
}
