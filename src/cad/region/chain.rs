//! Curves of a file as one closed curve.

use super::error::RegionError;
use kanagata_geometry::Vec2;
use kanagata_geometry::nurbs::Curve2;

/// Curves of a chain at most.
const CURVES_MAX: usize = 5_000;

/// Curves in the order and direction in which they follow each other; their ends are moved onto each other.
///
/// # Errors
/// [`RegionError::Curve`] when they are not one closed curve within `gap` [mm].
pub(super) fn chained(curves: Vec<Curve2>, gap: f64) -> Result<Vec<Curve2>, RegionError> {
    let count = curves.len();
    if count == 0 || count > CURVES_MAX {
        return Err(RegionError::curve(format!("{count} curves")));
    }
    let mut rest = curves;
    let mut chain = vec![rest.swap_remove(0)];
    while !rest.is_empty() {
        let at = chain.last().map_or_else(Vec2::zeros, end);
        let distance = |c: &Curve2| {
            let (a, b) = ((start(c) - at).norm(), (end(c) - at).norm());
            if a <= b { (a, false) } else { (b, true) }
        };
        let found = rest.iter().map(distance).enumerate();
        let found = found.min_by(|a, b| a.1.0.total_cmp(&b.1.0));
        let Some((k, (off, turned))) = found.filter(|f| f.1.0 <= gap) else {
            let text = format!(
                "{count} curves, of which {} are connected, up to ({:.3}, {:.3}) mm",
                chain.len(),
                at.x,
                at.y
            );
            return Err(RegionError::curve(text));
        };
        debug_assert!(off <= gap);
        let next = rest.swap_remove(k);
        let next = if turned { next.reversed() } else { next };
        chain.push(next.with_start(at));
    }
    let first = start(&chain[0]);
    let last = chain.len() - 1;
    let off = (end(&chain[last]) - first).norm();
    if off > gap {
        return Err(RegionError::curve(format!("an open curve whose ends are {off:.3e} mm apart")));
    }
    chain[last] = chain[last].with_end(first);
    Ok(chain)
}

/// First point.
pub(super) fn start(c: &Curve2) -> Vec2 {
    c.point(c.domain()[0])
}

/// Last point.
pub(super) fn end(c: &Curve2) -> Vec2 {
    c.point(c.domain()[1])
}
