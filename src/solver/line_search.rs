//! How much of a correction to take where whole ones lead nowhere.
//!
//! Elastic and plastic, sticking and sliding points in turn make Newton's iteration swing between two iterates. The
//! work of the residual along the correction, `G(s) = du . R(u + s du)`, is the slope of the incremental energy: it is
//! negative where a correction begins and vanishes where its best part ends.

use super::element::Want;
use super::linearised::Correction;
use super::newton::apply;
use super::system::System;

/// A correction is good when the slope at its end is at most this share of the slope at its beginning.
const GOOD: f64 = 0.5;
/// Trials.
const TRIALS: usize = 5;
/// Smallest share taken.
const LEAST: f64 = 0.05;

/// Work of the residual along a correction, with the conditions that [`System::assemble`] left.
fn slope(sys: &System, correction: &Correction) -> f64 {
    let of_nodes = sys.unbalanced().zip(correction.u.chunks_exact(3));
    let nodes: f64 =
        of_nodes.map(|(force, du)| (0..3).map(|k| force[k] * du[k]).sum::<f64>()).sum();
    let tools: f64 = correction
        .travels
        .iter()
        .map(|&(tool, travel)| match sys.roles[tool].push(sys.tools[tool].travel) {
            Some(wanted) => {
                (sys.tool_force(tool).dot(&sys.tools[tool].setup.direction) - wanted) * travel
            }
            None => 0.0,
        })
        .sum();
    nodes + tools
}

/// Share of `correction`, at most `most`, after which the slope has nearly vanished. The iterate stays where it was.
pub(super) fn share(sys: &mut System, correction: &Correction, most: f64) -> f64 {
    let start = slope(sys, correction);
    if start >= 0.0 {
        return most;
    }
    let mut at = |share: f64| {
        apply(sys, correction, share);
        let found = sys.evaluate(Want::Residual).is_ok().then(|| {
            sys.search();
            sys.assemble();
            slope(sys, correction)
        });
        apply(sys, correction, -share);
        found
    };
    // The slope changes sign between `low` and `high`.
    let (mut low, mut high) = ((0.0, start), None);
    let mut share = most;
    for _ in 0..TRIALS {
        match at(share) {
            Some(g) if g.abs() <= -GOOD * start => return share,
            Some(g) if g < 0.0 && high.is_none() => return share,
            Some(g) if g < 0.0 => low = (share, g),
            Some(g) => high = Some((share, g)),
            None => high = Some((share, f64::INFINITY)),
        }
        let Some((right, g)) = high else { return share };
        let secant = low.0 - low.1 * (right - low.0) / (g - low.1);
        let (least, largest) = (low.0 + 0.1 * (right - low.0), low.0 + 0.7 * (right - low.0));
        share = if g.is_finite() { secant.clamp(least, largest) } else { 0.5 * (low.0 + right) };
    }
    share.max(LEAST)
}
