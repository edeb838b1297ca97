//! Sides of a border between its corners, and the draw-in along each.

use kanagata_geometry::Vec2;

/// Angle between the two sides that meet at a point of the border, above which it is a corner [degrees]. Nine equal
/// elements around a circle turn by as much; chamfers of 45 degrees are corners. Doubled, only right angles would be.
pub const CORNER_MIN_DEG: f64 = 40.0;

/// A point of the border.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BorderPoint {
    /// Length along the border of the blank from the first point [mm].
    pub arc_mm: f64,
    /// Position on the blank [mm].
    pub initial: Vec2,
    /// Current position in plan [mm].
    pub now: Vec2,
}

/// A point of a side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SidePoint {
    /// The point. A corner is a point of both sides that meet there.
    pub point: BorderPoint,
    /// Component of the displacement along the inward normal of this side of the blank [mm]; negative where the side
    /// moves outwards.
    pub draw_in: f64,
}

/// A smooth piece of a border: between two corners, or all of it. Its normal is that of the circle through a point and
/// its neighbours on the side; at an end, of the circle through the last three points.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Side {
    /// The points in order.
    pub points: Vec<SidePoint>,
}

impl Side {
    /// Smallest and largest draw-in, the first of equal ones; `None` without points.
    #[must_use]
    pub fn extremes(&self) -> Option<[SidePoint; 2]> {
        let of = |better: fn(f64, f64) -> bool| {
            let points = self.points.iter().copied();
            points.reduce(|a, b| if better(b.draw_in, a.draw_in) { b } else { a })
        };
        Some([of(|b, a| b < a)?, of(|b, a| b > a)?])
    }

    /// Length of the side on the blank [mm].
    #[must_use]
    pub fn length_mm(&self) -> f64 {
        let arc = |end: Option<&SidePoint>| end.map_or(0.0, |p| p.point.arc_mm);
        arc(self.points.last()) - arc(self.points.first())
    }
}

/// What follows the two ends of a border: for a closed one its second last and second points, at a symmetry plane the
/// image of the neighbour; `None` at an end without a plane.
pub(super) type Beyond = [Option<Vec2>; 2];

/// Indices of the corners, ends without a neighbour beyond them included.
pub(super) fn corners(points: &[Vec2], beyond: Beyond) -> Vec<usize> {
    let is_corner = |k: &usize| {
        let [before, after] = neighbours(points, beyond, *k);
        let (Some(before), Some(after)) = (before, after) else { return true };
        let turn = (points[*k] - before).angle(&(after - points[*k]));
        turn > CORNER_MIN_DEG.to_radians()
    };
    (0..points.len()).filter(is_corner).collect()
}

fn neighbours(points: &[Vec2], [first, last]: Beyond, k: usize) -> Beyond {
    let before = if k == 0 { first } else { Some(points[k - 1]) };
    let after = if k + 1 == points.len() { last } else { Some(points[k + 1]) };
    [before, after]
}

/// The sides of a border. One that is closed and has corners starts at a corner.
pub(super) fn sides(border: &[BorderPoint], beyond: Beyond) -> Vec<Side> {
    let initial: Vec<Vec2> = border.iter().map(|point| point.initial).collect();
    let found = corners(&initial, beyond);
    let Some(last) = initial.len().checked_sub(1) else { return Vec::new() };
    let mut ends = vec![0];
    ends.extend(found.iter().copied().filter(|&k| k > 0 && k < last));
    ends.push(last);
    let is_corner = |k: usize| found.binary_search(&k).is_ok();
    let side = |pair: &[usize]| {
        let [from, to] = [pair[0], pair[1]];
        let own = &initial[from..=to];
        let of = |end: usize, other: Option<Vec2>| if is_corner(end) { None } else { other };
        let normals = normals(own, [of(from, beyond[0]), of(to, beyond[1])]);
        let points = border[from..=to].iter().zip(normals);
        let point = |(point, inward): (&BorderPoint, Vec2)| SidePoint {
            point: *point,
            draw_in: (point.now - point.initial).dot(&inward),
        };
        Side { points: points.map(point).collect() }
    };
    ends.windows(2).map(side).collect()
}

/// Inward unit normals at the points of a side, to the left of its direction.
fn normals(points: &[Vec2], beyond: Beyond) -> Vec<Vec2> {
    let chord = |k: usize| points[k + 1] - points[k];
    let last = points.len() - 1;
    let tangent = |k: usize| match neighbours(points, beyond, k) {
        [Some(before), Some(after)] => middle_tangent(points[k] - before, after - points[k]),
        _ if last == 1 => chord(0),
        [None, _] => end_tangent(chord(0), chord(1)),
        _ => end_tangent(-chord(last - 1), -chord(last - 2)) * -1.0,
    };
    let left = |t: Vec2| Vec2::new(-t.y, t.x).try_normalize(0.0).unwrap_or_default();
    (0..points.len()).map(|k| left(tangent(k))).collect()
}

/// Tangent of the circle through three points at the middle one, from the chords before and after it: each chord is
/// inclined to it in proportion to its length.
fn middle_tangent(before: Vec2, after: Vec2) -> Vec2 {
    let weighted = |chord: Vec2| chord / chord.norm_squared();
    let both = weighted(before) + weighted(after);
    if both.iter().all(|x| x.is_finite()) { both } else { before + after }
}

/// Tangent of the circle through three points at the first one, from the chord that starts there and the next.
fn end_tangent(first: Vec2, next: Vec2) -> Vec2 {
    let turn = first.perp(&next).atan2(first.dot(&next));
    let (lengths, own) = (first.norm() + next.norm(), first.norm());
    let angle = if lengths > 0.0 { -turn * own / lengths } else { 0.0 };
    let (sin, cos) = angle.sin_cos();
    Vec2::new(cos * first.x - sin * first.y, sin * first.x + cos * first.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Chords of unequal lengths on a circle: the tangents are those of the circle up to the third power of the angles
    /// in the middle, and in proportion of arcs at the ends.
    #[test]
    fn tangents_are_those_of_the_circle() {
        let at = |angle: f64| Vec2::new(angle.cos(), angle.sin()) * 7.0;
        let (a, b, c) = (at(0.2), at(0.3), at(0.55));
        let exact = |angle: f64| Vec2::new(-angle.sin(), angle.cos());
        let found = middle_tangent(b - a, c - b).normalize();
        assert!((found - exact(0.3)).norm() < 1e-14, "{found}");
        let first = end_tangent(b - a, c - b).normalize();
        assert!((first - exact(0.2)).norm() < 1e-4, "{first}");
        let last = -end_tangent(b - c, a - b).normalize();
        assert!((last - exact(0.55)).norm() < 1e-4, "{last}");
        // Equal chords are exact at the ends too.
        let (b, c) = (at(0.5), at(0.8));
        assert!((end_tangent(b - a, c - b).normalize() - exact(0.2)).norm() < 1e-14);
    }

    #[test]
    fn a_corner_turns_by_more_than_its_angle() {
        let bend = |degrees: f64| {
            let angle = degrees.to_radians();
            [Vec2::zeros(), Vec2::new(1.0, 0.0), Vec2::new(1.0 + angle.cos(), angle.sin())]
        };
        let ends = [Some(Vec2::new(-1.0, 0.0)), None];
        assert_eq!(corners(&bend(CORNER_MIN_DEG - 0.01), ends), [2]);
        assert_eq!(corners(&bend(CORNER_MIN_DEG + 0.01), ends), [1, 2]);
        assert_eq!(corners(&bend(-CORNER_MIN_DEG - 0.01), ends), [1, 2]);
    }
}
