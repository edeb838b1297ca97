//! Curves that bound no face.

use super::entity::{Entity, Outcome};
use super::graph::representations;
use super::items::{ItemKind, item_kind};
use super::resolver::{Resolver, Units};
use super::table::parse;
use crate::CadError;
use kanagata_geometry::nurbs::Curve3;

/// Keyword of an occurrence in an assembly.
const OCCURRENCE: &str = "NEXT_ASSEMBLY_USAGE_OCCURRENCE";
/// Curves of a file at most.
const CURVES_MAX: usize = 20_000;

/// Reads the curves of the representations of a STEP file that bound no face [mm].
///
/// # Errors
/// [`CadError::Invalid`] as for a file of faces, for an assembly, and for a curve that cannot be read.
pub fn read_curves(bytes: &[u8], name: &str) -> Result<Vec<Curve3>, CadError> {
    let table = parse(bytes, name)?;
    let resolver = Resolver::new(&table, bytes.len());
    let occurrence = |e: &Entity| e.parts().iter().any(|p| p.keyword == OCCURRENCE);
    if let Some(e) = resolver.entities().find(occurrence) {
        let fault = e.fault(
            "an assembly, whose placements move the curve",
            "the curve in a file of its own",
        );
        return Err(fault.into_error(name));
    }
    let mut found = Vec::new();
    for representation in representations(&resolver) {
        let a = representation.attributes();
        let (Ok(items), Ok(context)) = (a.entities(1), a.entity(2)) else { continue };
        let read = || -> Outcome<Vec<Curve3>> {
            let units = resolver.context(context)?.units;
            curves_of(&resolver, items, units)
        };
        found.extend(read().map_err(|fault| fault.into_error(name))?);
    }
    found.truncate(CURVES_MAX);
    Ok(found)
}

/// Curves among some items, and in their sets of curves.
fn curves_of<'t>(
    resolver: &Resolver<'t>,
    items: Vec<Entity<'t>>,
    units: Units,
) -> Outcome<Vec<Curve3>> {
    let mut out = Vec::new();
    let (mut open, mut sets) = (items, 0);
    open.reverse();
    while let Some(item) = open.pop() {
        resolver.charge(item, sets, 0)?;
        match item.kind() {
            "GEOMETRIC_CURVE_SET" | "GEOMETRIC_SET" => {
                sets += 1;
                open.extend(item.attributes().entities(1)?.into_iter().rev());
            }
            "EDGE_CURVE" => {
                let edge = resolver.edge_curve(item, units)?;
                out.extend(edge.curve.clone());
            }
            _ if item_kind(item) == ItemKind::Loose => {
                let whole = resolver.curve(item, units, 0)?.whole();
                out.push(whole.ok_or_else(|| item.fault("an unbounded curve", "bounded curves"))?);
            }
            _ => {}
        }
    }
    Ok(out)
}
