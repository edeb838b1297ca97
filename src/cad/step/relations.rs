//! Relationships of representations that place a component in an assembly: their uses, and their transformations.

use rustc_hash::{FxHashMap, FxHashSet};

use super::entity::{Entity, Outcome};
use super::names;
use super::resolver::{Resolver, Units};
use crate::attributes::Name;
use kanagata_geometry::{Affine, Frame, Mat3};

/// A use of a relationship: its component and the name of the occurrence, where the file says them.
pub(super) type Use = (Option<u32>, Option<Name>);

/// Uses of each relationship, by its instance.
pub(super) fn uses_of_relations(resolver: &Resolver) -> FxHashMap<u32, Vec<Use>> {
    let mut uses: FxHashMap<u32, Vec<Use>> = FxHashMap::default();
    for e in resolver.entities().filter(|e| e.kind() == "CONTEXT_DEPENDENT_SHAPE_REPRESENTATION") {
        let a = e.attributes();
        let Ok(relation) = a.entity(0) else { continue };
        let usage = a.entity(1).and_then(|shape| shape.attributes().entity(2));
        if usage.as_ref().is_ok_and(|u| u.kind() == "SPECIFIED_HIGHER_USAGE_OCCURRENCE") {
            continue;
        }
        // NEXT_ASSEMBLY_USAGE_OCCURRENCE(id, name, description, relating, related, ..)
        let name = usage.as_ref().ok().and_then(|u| names::of_occurrence(*u));
        let component = usage.and_then(|u| u.attributes().entity(4)).ok();
        uses.entry(relation.index).or_default().push((component.map(|c| c.index), name));
    }
    uses
}

/// Placements among the items of representations, as pairs of instances (representation, item).
pub(super) struct Held(FxHashSet<(u32, u32)>);

impl Held {
    pub(super) fn new(resolver: &Resolver) -> Self {
        let is_placement = |e: &Entity| e.kind() == "AXIS2_PLACEMENT_3D";
        let (mut held, mut read) = (FxHashSet::default(), FxHashSet::default());
        let places = |e: &Entity| e.has("REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION");
        for e in resolver.entities().filter(places) {
            for side in sides(e).into_iter().flatten().filter(|s| read.insert(s.index)) {
                let items = side.attributes().entities(1).unwrap_or_default();
                let placements = items.into_iter().filter(is_placement);
                held.extend(placements.map(|i| (side.index, i.index)));
            }
        }
        Self(held)
    }

    /// True when more of the two items are in the other representation than in that of their position: some writers name
    /// the item of the assembly first.
    fn is_exchanged(&self, [first, second]: [Entity; 2], [one, two]: [Entity; 2]) -> bool {
        let holds = |side: Entity, item: Entity| self.0.contains(&(side.index, item.index));
        let held = |pairs: [(Entity, Entity); 2]| {
            pairs.into_iter().filter(|&(side, item)| holds(side, item)).count()
        };
        held([(first, two), (second, one)]) > held([(first, one), (second, two)])
    }
}

/// The representations on both sides of a relationship.
pub(super) fn sides<'t>(e: Entity<'t>) -> Outcome<[Entity<'t>; 2]> {
    let a = e.attributes();
    let pair = e.part("REPRESENTATION_RELATIONSHIP");
    let sides = pair.as_ref().unwrap_or(&a);
    Ok([sides.entity(2)?, sides.entity(3)?])
}

/// The map from the first side of a relationship to the second, with the units of both.
pub(super) fn map_between(
    resolver: &Resolver,
    e: Entity,
    [from, to]: [Units; 2],
    held: &Held,
) -> Outcome<Affine> {
    let by = match e.part("REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION") {
        Some(part) => part.entity(part.len().saturating_sub(1))?,
        None => e.attributes().entity(4)?,
    };
    if by.kind() != "ITEM_DEFINED_TRANSFORMATION" {
        return resolver.operator(by, to);
    }
    let t = by.attributes();
    let mut items = [t.entity(2)?, t.entity(3)?];
    if held.is_exchanged(sides(e)?, items) {
        items.swap(0, 1);
    }
    let (origin, target) = (resolver.frame(items[0], from)?, resolver.frame(items[1], to)?);
    Ok(outward(&target).after(&inward(&origin)))
}

/// Shape representation of each product definition.
pub(super) fn shapes_of_products(resolver: &Resolver) -> FxHashMap<u32, u32> {
    let pair = |e: Entity| -> Outcome<(u32, u32)> {
        let a = e.attributes();
        let definition = a.entity(0)?.attributes().entity(2)?;
        Ok((definition.index, a.entity(1)?.index))
    };
    let definitions = resolver.entities().filter(|e| e.kind() == "SHAPE_DEFINITION_REPRESENTATION");
    definitions.filter_map(|e| pair(e).ok()).collect()
}

/// Map from the coordinates of a frame to those of its parent.
pub(super) fn outward(f: &Frame) -> Affine {
    Affine { linear: Mat3::from_columns(&[f.x, f.y, f.z]), shift: f.origin }
}

/// The inverse of [`outward`].
pub(super) fn inward(f: &Frame) -> Affine {
    let linear = Mat3::from_columns(&[f.x, f.y, f.z]).transpose();
    Affine { linear, shift: -(linear * f.origin) }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::raw::{RawModel, RawSurface};
    use crate::step::read_bytes;

    /// A cylinder about z with more entities in its file.
    fn cylinder_with(more: &str) -> RawModel {
        let folder =
            Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("fixtures/forming");
        let text = std::fs::read_to_string(folder.join("cylinder_AP214.stp")).unwrap();
        let (data, end) = text.rsplit_once("ENDSEC;").unwrap();
        read_bytes(format!("{data}{more}\nENDSEC;{end}").as_bytes(), "more.stp").unwrap()
    }

    /// Saved views of AP242 are shape representations too, and map the product that they show.
    #[test]
    fn a_saved_view_is_no_shape_of_its_own() {
        let view = |n: u32| {
            format!(
                "#9{n}1=(CHARACTERIZED_OBJECT(*,*)CHARACTERIZED_REPRESENTATION()DRAUGHTING_MODEL()\
                 REPRESENTATION('view',(#9{n}3),#113)SHAPE_REPRESENTATION()TESSELLATED_SHAPE_REPRESENTATION());\n\
                 #9{n}2=REPRESENTATION_MAP(#11,#10);\n#9{n}3=MAPPED_ITEM('',#9{n}2,#11);\n"
            )
        };
        let plain = cylinder_with("").faces.len();
        for views in 1..=2 {
            let text: String = (1..=views).map(view).collect();
            let model = cylinder_with(&text);
            assert_eq!(model.faces.len(), plain, "{views} views");
            assert!(model.diagnostics.is_empty(), "{:?}", model.diagnostics);
        }
    }

    /// Representations of no product that map one neither double nor hide it.
    #[test]
    fn what_is_no_product_places_none() {
        let copy = |n: u32| {
            format!(
                "#9{n}1=SHAPE_REPRESENTATION('copy',(#9{n}3),#113);\n#9{n}2=REPRESENTATION_MAP(#11,#10);\n\
                 #9{n}3=MAPPED_ITEM('',#9{n}2,#11);\n"
            )
        };
        let plain = cylinder_with("").faces.len();
        let model = cylinder_with(&(copy(1) + &copy(2)));
        assert_eq!(model.faces.len(), plain);
        let codes: Vec<&str> = model.diagnostics.iter().map(|d| d.code).collect();
        assert_eq!(codes, ["not-of-product"]);
    }

    /// The transformation leads from the item of the component to that of the assembly, whichever is named first.
    #[test]
    fn a_component_is_placed_by_the_representations_that_hold_the_items() {
        let placed = |items: &str| {
            let model = cylinder_with(&format!(
                "#900=CARTESIAN_POINT('',(100.,0.,0.));\n#901=AXIS2_PLACEMENT_3D('',#900,$,$);\n\
                 #902=SHAPE_REPRESENTATION('assembly',(#11,#901),#113);\n\
                 #903=ITEM_DEFINED_TRANSFORMATION('','',{items});\n\
                 #904=(REPRESENTATION_RELATIONSHIP('','',#10,#902)\
                 REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#903)SHAPE_REPRESENTATION_RELATIONSHIP());\n\
                 #905=PRODUCT('assembly','assembly','',(#8));\n\
                 #906=PRODUCT_DEFINITION_FORMATION('','',#905);\n\
                 #907=PRODUCT_DEFINITION('design','',#906,#9);\n#908=PRODUCT_DEFINITION_SHAPE('','',#907);\n\
                 #909=SHAPE_DEFINITION_REPRESENTATION(#908,#902);\n\
                 #910=NEXT_ASSEMBLY_USAGE_OCCURRENCE('1','','',#907,#5,$);\n\
                 #911=PRODUCT_DEFINITION_SHAPE('','',#910);\n\
                 #912=CONTEXT_DEPENDENT_SHAPE_REPRESENTATION(#904,#911);\n"
            ));
            let axis = model.faces.iter().find_map(|f| match &f.surface {
                RawSurface::Cylinder { frame, .. } => Some(frame.origin.x),
                _ => None,
            });
            axis.unwrap()
        };
        for items in ["#11,#901", "#901,#11"] {
            assert!((placed(items) - 100.0).abs() < 1e-12, "{items}: {}", placed(items));
        }
    }
}
