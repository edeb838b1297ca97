//! Walls of a section: angles to bottom and flange, and sidewall curl.
//!
//! A wall is where the line is inclined to its bottom by more than half of its largest inclination, in the last equilibrium
//! with tools. Bottom, wall and flange are the same material in both states. Their directions are those of chords from 20 to
//! 80 % of their lengths, so that the radii between them have no part in the angles.

use kanagata_geometry::Vec2;
use kanagata_report::record::WallRecord;

/// Inclination over the largest one above which a segment belongs to a wall.
const WALL_REL: f64 = 0.5;
/// Largest inclination below which a line has no wall [degrees].
const WALL_DEG_MIN: f64 = 15.0;
/// Begin and end of the part of a piece that is measured, over its length.
const MEASURED: [f64; 2] = [0.2, 0.8];
/// Height of an arc over its chord below which it is straight.
const STRAIGHT_REL: f64 = 1e-4;

/// A piece of a line between two lengths along it.
type Piece = [f64; 2];

/// The walls of a line of points at the lengths `arc`, at `held` in the last equilibrium with tools and at `released` after.
#[must_use]
pub fn walls(arc: &[f64], held: &[Vec2], released: Option<&[Vec2]>) -> Vec<WallRecord> {
    let pieces = pieces(arc, held);
    let is_wall = |k: usize| pieces[k].1;
    let of = |k: usize| {
        let (wall, _) = pieces[k];
        // The longer neighbour is the bottom, the other one the flange; of two equal ones the first is the bottom.
        let neighbours = [k.checked_sub(1), Some(k + 1).filter(|k| *k < pieces.len())];
        let [before, after] = neighbours.map(|n| n.filter(|n| !is_wall(*n)).map(|n| pieces[n].0));
        let is_bottom_first = match (before, after) {
            (Some(a), Some(b)) => is_bottom(a, b, arc),
            (before, _) => before.is_some(),
        };
        let (bottom, flange) = if is_bottom_first { (before, after) } else { (after, before) };
        let angle = |points: &[Vec2], other: Piece| angle_between(arc, points, wall, other);
        let bottom = bottom?;
        Some(WallRecord {
            arc_mm: wall,
            wall_deg: angle(held, bottom)?,
            released_wall_deg: released.and_then(|points| angle(points, bottom)),
            flange_deg: flange.and_then(|flange| angle(held, flange)),
            released_flange_deg: flange.and_then(|flange| angle(released?, flange)),
            curl_radius_mm: curl(arc, released.unwrap_or(held), wall),
        })
    };
    (0..pieces.len()).filter(|&k| is_wall(k)).filter_map(of).collect()
}

/// Whether the piece before a wall is its bottom: the one nearer to the middle of the line, or to its first point where the
/// line has one wall.
fn is_bottom(before: Piece, after: Piece, arc: &[f64]) -> bool {
    let middle = 0.5 * (arc[0] + arc[arc.len() - 1]);
    let contains = |piece: Piece| piece[0] <= middle && middle <= piece[1];
    contains(before) || !contains(after)
}

/// Pieces of the line, each with whether it is a wall.
fn pieces(arc: &[f64], points: &[Vec2]) -> Vec<(Piece, bool)> {
    let inclination = |k: usize| {
        let along = points[k + 1] - points[k];
        along.y.abs().atan2(along.x.abs()).to_degrees()
    };
    let all: Vec<f64> = (0..points.len().saturating_sub(1)).map(inclination).collect();
    let largest = all.iter().copied().fold(0.0, f64::max);
    if largest < WALL_DEG_MIN {
        return Vec::new();
    }
    let mut out: Vec<(Piece, bool)> = Vec::new();
    for (k, angle) in all.into_iter().enumerate() {
        let is_wall = angle > WALL_REL * largest;
        match out.last_mut() {
            Some((piece, wall)) if *wall == is_wall => piece[1] = arc[k + 1],
            _ => out.push(([arc[k], arc[k + 1]], is_wall)),
        }
    }
    out
}

/// Point at a length along the line.
fn at(arc: &[f64], points: &[Vec2], s: f64) -> Vec2 {
    let k = arc.partition_point(|a| *a <= s).clamp(1, arc.len() - 1);
    let t = (s - arc[k - 1]) / (arc[k] - arc[k - 1]);
    points[k - 1] + (points[k] - points[k - 1]) * t
}

/// The measured part of a piece.
fn measured(piece: Piece) -> Piece {
    MEASURED.map(|t| piece[0] + t * (piece[1] - piece[0]))
}

/// Unit vector along the chord of a piece.
fn direction(arc: &[f64], points: &[Vec2], piece: Piece) -> Option<Vec2> {
    let [a, b] = measured(piece).map(|s| at(arc, points, s));
    (b - a).try_normalize(0.0)
}

/// Angle in the corner between two pieces of the line [degrees]: 180 where they are straight on, 90 in a square corner.
fn angle_between(arc: &[f64], points: &[Vec2], a: Piece, b: Piece) -> Option<f64> {
    let (a, b) = (direction(arc, points, a)?, direction(arc, points, b)?);
    Some(180.0 - a.perp(&b).abs().atan2(a.dot(&b)).to_degrees())
}

/// Radius of the circle through the measured part of a wall, by least squares of `x² + y² = 2 c . x + d` about its middle;
/// `None` for a straight wall.
fn curl(arc: &[f64], points: &[Vec2], wall: Piece) -> Option<f64> {
    let [from, to] = measured(wall);
    let inner = (0..arc.len()).filter(|&k| arc[k] > from && arc[k] < to).map(|k| points[k]);
    let ends = [from, to].map(|s| at(arc, points, s));
    let all: Vec<Vec2> = ends.into_iter().chain(inner).collect();
    let centre = all.iter().sum::<Vec2>() / all.len() as f64;
    let (mut matrix, mut right) = (nalgebra::Matrix3::zeros(), nalgebra::Vector3::zeros());
    for p in all.iter().map(|p| p - centre) {
        let row = nalgebra::Vector3::new(2.0 * p.x, 2.0 * p.y, 1.0);
        matrix += row * row.transpose();
        right += row * p.norm_squared();
    }
    let solution = matrix.lu().solve(&right)?;
    let radius = (solution.z + solution.xy().norm_squared()).sqrt();
    let chord = (ends[1] - ends[0]).norm();
    let height = chord * chord / (8.0 * radius);
    (radius.is_finite() && height > STRAIGHT_REL * chord).then_some(radius)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half of a channel: bottom, wall and flange of length 40 each, of 20 segments; the wall is inclined by `wall`, curved to
    /// `radius`, and the flange turned by `flange` [degrees].
    fn channel(wall: f64, radius: f64, flange: f64) -> (Vec<f64>, Vec<Vec2>) {
        let (mut points, mut arc) = (vec![Vec2::zeros()], vec![0.0]);
        for k in 0..60 {
            let s = 2.0 * (k as f64 + 0.5);
            let angle = match k {
                0..20 => 0.0,
                20..40 => wall.to_radians() + (s - 60.0) / radius,
                _ => flange.to_radians(),
            };
            points.push(points[k] + 2.0 * Vec2::new(angle.cos(), angle.sin()));
            arc.push(2.0 * (k + 1) as f64);
        }
        (arc, points)
    }

    #[test]
    fn angles_and_curl_of_a_channel_are_those_it_is_made_of() {
        let (arc, held) = channel(90.0, 1e12, 0.0);
        let (_, released) = channel(80.0, 150.0, 12.0);
        let found = walls(&arc, &held, Some(&released));
        assert_eq!(found.len(), 1);
        let wall = found[0];
        assert_eq!(wall.arc_mm, [40.0, 80.0]);
        assert!((wall.wall_deg - 90.0).abs() < 1e-9, "{wall:?}");
        assert!((wall.flange_deg.unwrap() - 90.0).abs() < 1e-9);
        assert!((wall.released_wall_deg.unwrap() - 100.0).abs() < 1e-6, "{wall:?}");
        assert!((wall.released_flange_deg.unwrap() - 112.0).abs() < 1e-6, "{wall:?}");
        // Chords of 2 mm are shorter than their arcs: the circle through their ends.
        let circle = 2.0 / (2.0 * (0.5_f64 * 2.0 / 150.0).sin());
        assert!((wall.curl_radius_mm.unwrap() - circle).abs() < 1e-6, "{wall:?} {circle}");
        assert_eq!(walls(&arc, &held, None)[0].curl_radius_mm, None);
        assert_eq!(walls(&arc, &held, None)[0].released_wall_deg, None);
    }

    #[test]
    fn a_whole_channel_has_two_walls_and_a_flat_sheet_none() {
        let (arc, half) = channel(80.0, 1e12, 0.0);
        let left = half.iter().rev().map(|p| Vec2::new(-p.x, p.y));
        let whole: Vec<Vec2> = left.chain(half.iter().copied().skip(1)).collect();
        let long: Vec<f64> = (0..whole.len()).map(|k| 2.0 * k as f64).collect();
        let found = walls(&long, &whole, Some(&whole));
        assert_eq!(found.len(), 2);
        for wall in found {
            assert!((wall.wall_deg - 100.0).abs() < 1e-9, "{wall:?}");
            assert!((wall.released_flange_deg.unwrap() - 100.0).abs() < 1e-9, "{wall:?}");
        }
        let flat: Vec<Vec2> = arc.iter().map(|s| Vec2::new(*s, 0.0)).collect();
        assert!(walls(&arc, &flat, None).is_empty());
        // A bend of a strip: a wall at the end of the line has no flange.
        let bend = walls(&arc[..41], &half[..41], None);
        assert!(bend.len() == 1 && bend[0].flange_deg.is_none(), "{bend:?}");
    }
}
