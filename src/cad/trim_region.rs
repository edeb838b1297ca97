//! Point-in-region test for the trimming loops of a face in the parameter plane.

use super::model::Face;
use kanagata_geometry::Vec2;

/// A Bezier segment of a loop: homogeneous control points, and the bounding box of the Cartesian ones.
#[derive(Debug, Clone)]
struct Piece {
    points: Vec<(Vec2, f64)>,
    low: Vec2,
    high: Vec2,
    chord: Chord,
}

impl Piece {
    fn new(points: Vec<(Vec2, f64)>) -> Self {
        let part = Part::new(&points);
        let (low, high, chord) = (part.low, part.high, part.chord());
        Self { points, low, high, chord }
    }

    fn line(a: Vec2, b: Vec2) -> Self {
        Self::new(vec![(a, 1.0), (b, 1.0)])
    }

    /// The chord of a segment that is straight to within rounding.
    fn straightened(self) -> Self {
        let (a, b) = (self.start(), self.end());
        let d = b - a;
        let length = d.norm();
        let on_chord = |(p, w): &(Vec2, f64)| {
            let r = p / *w - a;
            let (off, along) = (d.perp(&r) / length, d.dot(&r) / length);
            off.abs() <= STRAIGHT_REL * length && (0.0..=length).contains(&along)
        };
        let inner = 1..self.points.len() - 1;
        let straight = length > 0.0 && self.points[inner].iter().all(on_chord);
        if straight { Self::line(a, b) } else { self }
    }

    fn start(&self) -> Vec2 {
        self.chord.ends[0]
    }

    fn end(&self) -> Vec2 {
        self.chord.ends[1]
    }

    /// Appends the parts of the segment, each with at most `area` between its control points and its chord.
    fn divide_to(self, area: f64, depth: u32, out: &mut Vec<Self>) {
        if depth == 0 || self.chord.widest * self.chord.length <= area {
            out.push(self);
        } else {
            self.halves().into_iter().for_each(|half| half.divide_to(area, depth - 1, out));
        }
    }

    /// Both halves.
    fn halves(&self) -> [Self; 2] {
        let (mut left, mut right) = (self.points.clone(), self.points.clone());
        divide(&mut left, &mut right, 0.5);
        [Self::new(left), Self::new(right)]
    }

    /// Signed ray crossings; `None` for a point on the segment.
    fn crossings(&self, uv: Vec2, border: f64) -> Option<i32> {
        let part = Part { points: &self.points, low: self.low, high: self.high };
        if part.is_outside_box(uv, border) {
            return Some(part.by_ends(uv, self.chord.ends));
        }
        let count = self.points.len();
        if let Some(crossings) = (count > 2).then(|| self.chord.crossings(uv, border)).flatten() {
            return Some(crossings);
        }
        match count {
            2 => self.line_crossings(uv, border),
            0..=4 => self.crossings_sized::<4>(uv, border),
            5..=10 => self.crossings_sized::<10>(uv, border),
            _ => self.crossings_sized::<CONTROL_POINTS_MAX>(uv, border),
        }
    }

    /// As [`Self::crossings`] by subdivision, in buffers of `N` control points.
    fn crossings_sized<const N: usize>(&self, uv: Vec2, border: f64) -> Option<i32> {
        let count = self.points.len();
        let mut first = [(Vec2::zeros(), 0.0); N];
        first.get_mut(..count)?.copy_from_slice(&self.points);
        let mut winding = 0;
        let mut stack: Vec<([(Vec2, f64); N], u32)> = vec![(first, 0)];
        while let Some((mut points, depth)) = stack.pop() {
            let part = Part::new(&points[..count]);
            if part.is_outside_box(uv, border) {
                winding += part.by_ends(uv, part.ends());
                continue;
            }
            let chord = part.chord();
            if let Some(crossings) = chord.crossings(uv, border) {
                winding += crossings;
                continue;
            }
            let on_it = chord.widest <= border && chord.is_beside(uv, border);
            if on_it || depth >= SUBDIVISION_DEPTH_MAX || (part.high - part.low).norm() <= border {
                return None;
            }
            // Where the speed along a segment varies, the range may miss the point; every second part is halved.
            let [from, to] = if depth % 2 == 0 { chord.near(uv) } else { [0.0, 0.5] };
            let mut rest = points;
            if to < 1.0 {
                divide(&mut points[..count], &mut rest[..count], to);
                stack.push((rest, depth + 1));
                rest = points;
            }
            if from > 0.0 {
                divide(&mut points[..count], &mut rest[..count], from / to);
                stack.push((points, depth + 1));
            }
            stack.push((rest, depth + 1));
        }
        Some(winding)
    }

    fn line_crossings(&self, uv: Vec2, border: f64) -> Option<i32> {
        let (a, b) = (self.start(), self.end());
        let (d, r) = (b - a, uv - a);
        let length = d.norm();
        if length <= border {
            return None;
        }
        let (side, along) = (d.perp(&r) / length, d.dot(&r) / length);
        if side.abs() <= border && along >= -border && along <= length + border {
            return None;
        }
        Some(crossed(a, b, uv, side))
    }
}

/// Divides a Bezier segment at parameter `t` by de Casteljau's algorithm. Both slices hold its control points; they become
/// those of the part before `t` and of the part after it.
fn divide(left: &mut [(Vec2, f64)], right: &mut [(Vec2, f64)], t: f64) {
    let degree = right.len() - 1;
    for (r, end) in left.iter_mut().enumerate().skip(1) {
        for k in 0..=degree - r {
            let (a, b) = (right[k], right[k + 1]);
            right[k] = (a.0 * (1.0 - t) + b.0 * t, a.1 * (1.0 - t) + b.1 * t);
        }
        *end = right[0];
    }
}

/// A part of a segment, and its bounding box.
struct Part<'a> {
    points: &'a [(Vec2, f64)],
    low: Vec2,
    high: Vec2,
}

impl<'a> Part<'a> {
    fn new(points: &'a [(Vec2, f64)]) -> Self {
        let (mut low, mut high) = (Vec2::repeat(f64::INFINITY), Vec2::repeat(f64::NEG_INFINITY));
        for (p, w) in points {
            low = low.inf(&(p / *w));
            high = high.sup(&(p / *w));
        }
        Self { points, low, high }
    }

    fn ends(&self) -> [Vec2; 2] {
        [self.points[0], self.points[self.points.len() - 1]].map(|(p, w)| p / w)
    }

    /// True when the point is outside the bounding box of the part by more than `border`.
    fn is_outside_box(&self, uv: Vec2, border: f64) -> bool {
        uv.y < self.low.y - border
            || uv.y > self.high.y + border
            || uv.x > self.high.x + border
            || uv.x < self.low.x - border
    }

    /// Signed ray crossings from the second coordinates of the end points alone.
    fn by_ends(&self, uv: Vec2, [a, b]: [Vec2; 2]) -> i32 {
        if uv.x > self.high.x {
            return 0;
        }
        i32::from(a.y <= uv.y && uv.y < b.y) - i32::from(b.y <= uv.y && uv.y < a.y)
    }

    fn chord(&self) -> Chord {
        let ends = self.ends();
        let d = ends[1] - ends[0];
        let length = d.norm();
        let off = |p: &(Vec2, f64)| (d.perp(&(p.0 / p.1 - ends[0])) / length).abs();
        let widest = self.points.iter().map(off).fold(0.0, f64::max);
        Chord { ends, length, widest }
    }
}

/// The chord of a segment.
#[derive(Debug, Clone, Copy)]
struct Chord {
    ends: [Vec2; 2],
    length: f64,
    /// Largest distance of a control point of the segment from the chord.
    widest: f64,
}

impl Chord {
    /// Signed ray crossings of the segment, those of the chord, when no control point is as far from the chord as the
    /// point: the segment can then be deformed to its chord without passing over the point.
    fn crossings(&self, uv: Vec2, border: f64) -> Option<i32> {
        let [a, b] = self.ends;
        if self.length <= border {
            return None;
        }
        let side = (b - a).perp(&(uv - a)) / self.length;
        (side.abs() > self.widest + border).then(|| crossed(a, b, uv, side))
    }

    /// True within `border` of the chord.
    fn is_beside(&self, uv: Vec2, border: f64) -> bool {
        let [a, b] = self.ends;
        let (d, r) = (b - a, uv - a);
        let along = d.dot(&r) / self.length;
        d.perp(&r).abs() <= border * self.length
            && along >= -border
            && along <= self.length + border
    }

    /// Parameters at which a segment of even speed passes a point that is no further off than its control points; their first
    /// half where that is most of them. For even speed the point is outside the boxes of the other parts, and the range shrinks
    /// with the square of its length. Otherwise it is a guess, and the other parts decide.
    fn near(&self, uv: Vec2) -> [f64; 2] {
        let [a, b] = self.ends;
        let at = (b - a).dot(&(uv - a)) / (self.length * self.length);
        let reach = NEAR_RANGE * self.widest / self.length;
        let range = [at - reach, at + reach].map(|t| t.clamp(0.0, 1.0));
        if range[1] - range[0] > 0.0 && range[1] - range[0] < 0.5 { range } else { [0.0, 0.5] }
    }
}

/// Signed crossing of the ray from `uv` with the line from `a` to `b`, with the point on its `side`. The line lies to
/// the right of a point on its left side while it rises.
fn crossed(a: Vec2, b: Vec2, uv: Vec2, side: f64) -> i32 {
    i32::from(a.y <= uv.y && uv.y < b.y && side > 0.0)
        - i32::from(b.y <= uv.y && uv.y < a.y && side < 0.0)
}

/// The region inside the trimming loops of a face.
#[derive(Debug, Clone)]
pub struct TrimRegion {
    pieces: Vec<Piece>,
    /// Segments that overlap each of the equal rows of the region, in increasing v.
    rows: Vec<Vec<u32>>,
    /// Smallest parameters of the loops.
    pub low: Vec2,
    /// Largest parameters of the loops.
    pub high: Vec2,
    /// Points within this distance of a loop count as inside.
    border: f64,
}

/// Distance of the control points of a segment from its chord, over the length of the chord, up to which it is straight.
const STRAIGHT_REL: f64 = 1e-12;
/// Maximum number of control points of a segment: one more than the largest degree of a curve.
const CONTROL_POINTS_MAX: usize = 26;
/// Half of the range of parameters in which a segment may pass a point, over the distance of its control points from its chord
/// over the length of that. Doubled: the range shrinks to four times the length.
const NEAR_RANGE: f64 = 4.0;
/// Maximum subdivision depth of a segment before a point near it counts as on it.
const SUBDIVISION_DEPTH_MAX: u32 = 96;
/// Width of the boundary zone relative to the size of the region.
const BOUNDARY_WIDTH_REL: f64 = 1e-9;
/// Area between a segment and its chord, over that of the bounding box of the loops, above which the segment is divided
/// once for all tests: a point in it needs a division in each. Halved: a quarter more parts, as their area falls with the cube of
/// their length.
const CHORD_AREA_REL: f64 = 1e-3;
/// Maximum number of halvings of a segment for that.
const HALVINGS_MAX: u32 = 5;
/// Maximum number of rows; fewer for fewer segments.
const ROWS_MAX: usize = 256;

impl TrimRegion {
    /// Builds the region from the loops of a face. Gaps between the curves of a loop are closed by straight lines.
    #[must_use]
    pub fn new(face: &Face) -> Self {
        let pieces: Vec<Piece> = face.loops.iter().flat_map(closed_pieces).collect();
        let low = pieces.iter().fold(Vec2::repeat(f64::INFINITY), |m, p| m.inf(&p.low));
        let high = pieces.iter().fold(Vec2::repeat(f64::NEG_INFINITY), |m, p| m.sup(&p.high));
        let border = if pieces.is_empty() { 0.0 } else { BOUNDARY_WIDTH_REL * (high - low).norm() };
        let area = CHORD_AREA_REL * (high.x - low.x) * (high.y - low.y);
        let mut parts = Vec::with_capacity(pieces.len());
        pieces.into_iter().for_each(|piece| piece.divide_to(area, HALVINGS_MAX, &mut parts));
        let [u, v] = face.surface.domain();
        let low = Vec2::new(low.x.max(u[0]), low.y.max(v[0]));
        let high = Vec2::new(high.x.min(u[1]), high.y.min(v[1]));
        let mut region = Self { rows: Vec::new(), pieces: parts, low, high, border };
        region.rows = vec![Vec::new(); region.pieces.len().clamp(1, ROWS_MAX)];
        for (k, piece) in region.pieces.iter().enumerate() {
            let [from, to] = [piece.low.y - border, piece.high.y + border].map(|v| region.row(v));
            region.rows[from..=to].iter_mut().for_each(|row| row.push(k as u32));
        }
        region
    }

    fn row(&self, v: f64) -> usize {
        let fraction = (v - self.low.y) / (self.high.y - self.low.y);
        // The cast saturates at 0 below the region (and for NaN); above it the index is limited to the last row.
        ((fraction * self.rows.len() as f64) as usize).min(self.rows.len() - 1)
    }

    /// True inside the loops or on them (within 1e-9 of the size of their bounding box), from the winding number by
    /// crossings of a ray towards +u.
    #[must_use]
    pub fn contains(&self, uv: Vec2) -> bool {
        if !(uv.x.is_finite() && uv.y.is_finite()) {
            return false;
        }
        let mut winding = 0;
        for &k in &self.rows[self.row(uv.y)] {
            match self.pieces[k as usize].crossings(uv, self.border) {
                Some(n) => winding += n,
                None => return true,
            }
        }
        winding != 0
    }

    /// False only when no loop enters the rectangle.
    #[must_use]
    pub fn touches(&self, low: Vec2, high: Vec2) -> bool {
        let margin = Vec2::repeat(self.border);
        let (low, high) = (low - margin, high + margin);
        let apart = |p: &Piece| (0..2).any(|k| p.low[k] > high[k] || p.high[k] < low[k]);
        let mut stack: Vec<(Piece, u32)> =
            self.pieces.iter().filter(|p| !apart(p)).map(|p| (p.clone(), 0)).collect();
        while let Some((piece, depth)) = stack.pop() {
            let within = |q: Vec2| (0..2).all(|k| q[k] >= low[k] && q[k] <= high[k]);
            if depth >= 6 || within(piece.start()) || within(piece.end()) {
                return true;
            }
            stack.extend(piece.halves().into_iter().filter(|h| !apart(h)).map(|h| (h, depth + 1)));
        }
        false
    }
}

/// Bezier segments of a loop, each starting exactly at the end of its predecessor.
fn closed_pieces(ring: &super::model::TrimLoop) -> Vec<Piece> {
    let mut out: Vec<Piece> = Vec::new();
    for bezier in ring.uses.iter().flat_map(|u| u.pcurve.bezier_pieces()) {
        let points = bezier.points().iter().zip(bezier.weights()).map(|(p, &w)| (p * w, w));
        let piece = Piece::new(points.collect()).straightened();
        if let Some(end) = out.last().map(Piece::end).filter(|&end| end != piece.start()) {
            out.push(Piece::line(end, piece.start()));
        }
        out.push(piece);
    }
    if let (Some(first), Some(last)) = (out.first(), out.last())
        && first.start() != last.end()
    {
        let line = Piece::line(last.end(), first.start());
        out.push(line);
    }
    out
}

impl Face {
    /// True when `uv` is inside the trimmed region or on its boundary. For many points, build a [`TrimRegion`] once.
    #[must_use]
    pub fn contains(&self, uv: Vec2) -> bool {
        TrimRegion::new(self).contains(uv)
    }
}
