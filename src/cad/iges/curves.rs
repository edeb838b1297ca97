//! Curves: 100 arc, 102 composite, 110 line, and the table of all others.

use std::f64::consts::TAU;

use super::file::{Fault, PIECE_COST};
use super::reader::{POINTER_DEPTH_MAX, Reader, similarity};
use kanagata_geometry::nurbs::{Curve2, Curve3, NurbsError};
use kanagata_geometry::{Affine, Frame, Vec2, Vec3};

/// Entity types that are curves.
pub(super) const CURVES: [u32; 8] = [100, 102, 104, 106, 110, 112, 126, 130];

/// A segment of a curve, with its shape where it is known.
#[derive(Debug, Clone)]
pub(super) struct Piece {
    /// Rational form; its domain is the entity's parameter range.
    pub curve: Curve3,
    /// Shape.
    pub shape: Shape,
}

/// Shape of a curve segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Shape {
    /// A segment, parameter 0 to 1.
    Line,
    /// A circular arc `origin + radius (cos t x + sin t y)`. Its parameter t is the angle [rad]; the rational form
    /// agrees with it at span ends only.
    Arc {
        /// Centre and axes.
        frame: Frame,
        /// Radius.
        radius: f64,
    },
    /// Any other curve, with the parametrisation of its entity.
    Free,
    /// A curve (conic) whose rational form has another parametrisation than its entity inside the spans.
    Reparametrised,
}

impl Reader<'_, '_> {
    /// Segments of a curve entity in order, transformed by their own matrices and `map`. Composites are expanded
    /// iteratively; cycles end at a fixed depth.
    pub fn pieces(&self, entity: usize, map: &Affine) -> Result<Vec<Piece>, Fault> {
        self.pieces_at(entity, map, 0)
    }

    fn pieces_at(&self, entity: usize, map: &Affine, depth: usize) -> Result<Vec<Piece>, Fault> {
        let mut out = Vec::new();
        let mut stack = vec![(entity, *map, depth)];
        while let Some((member, map, depth)) = stack.pop() {
            let placed = self.placed(member, &map)?;
            match self.file.entry(member).kind {
                102 if depth >= POINTER_DEPTH_MAX => {
                    return Err(self.file.fault(
                        member,
                        "composite-depth",
                        "composite curves are cyclic or too deeply nested",
                        format!("at most {POINTER_DEPTH_MAX} levels of composite curves"),
                    ));
                }
                102 => {
                    let mut members = self.members(member)?;
                    members.reverse();
                    stack.extend(members.into_iter().map(|m| (m, placed, depth + 1)));
                }
                116 | 132 => {}
                _ => out.push(self.placed_leaf(member, depth, &placed)?),
            }
        }
        if out.is_empty() {
            return Err(self.file.fault(
                entity,
                "curve-empty",
                "a composite curve of no curves",
                "one or more",
            ));
        }
        Ok(out)
    }

    /// Reads a curve that is not a composite [mm]; infinite coordinates are an error.
    fn placed_leaf(&self, member: usize, depth: usize, placed: &Affine) -> Result<Piece, Fault> {
        self.file.charge(member, PIECE_COST)?;
        let piece = self.leaf(member, depth)?.transformed(placed);
        if !piece.curve.points().iter().all(|p| p.iter().all(|c| c.is_finite())) {
            return Err(self.file.fault(
                member,
                "curve-infinite",
                "coordinates outside the range of double precision in mm",
                "finite coordinates",
            ));
        }
        Ok(piece)
    }

    /// Members of a composite curve (102): N, DE 1 .. DE N.
    fn members(&self, entity: usize) -> Result<Vec<usize>, Fault> {
        let mut p = self.file.params(entity)?;
        let count = p.count("number of members", 1)?;
        (0..count).map(|_| p.pointer("member")).collect()
    }

    /// A single curve in its definition space.
    fn leaf(&self, entity: usize, depth: usize) -> Result<Piece, Fault> {
        match self.file.entry(entity).kind {
            100 => self.arc(entity),
            104 => self.conic(entity),
            106 => self.copious(entity),
            110 => self.line(entity),
            112 => self.spline(entity),
            126 => self.rational_curve(entity),
            130 => self.offset_curve(entity, depth),
            kind => Err(self.file.fault(
                entity,
                "wrong-entity",
                format!("entity {kind} where a curve is needed"),
                "a curve: 100, 102, 104, 106, 110, 112, 126 or 130",
            )),
        }
    }

    /// Circular arc (100): ZT, X1, Y1 centre, X2, Y2 start, X3, Y3 end; counter-clockwise, a full circle when start and
    /// end coincide. The parameter is the angle, with the start in [0, 2 pi).
    fn arc(&self, entity: usize) -> Result<Piece, Fault> {
        let mut p = self.file.params(entity)?;
        let z = p.real("ZT")?;
        let mut xy = || -> Result<Vec2, Fault> { Ok(Vec2::new(p.real("x")?, p.real("y")?)) };
        let (centre, start, end) = (xy()?, xy()?, xy()?);
        let radius = (start - centre).norm();
        let other = (end - centre).norm();
        if !(radius > 0.0 && (radius - other).abs() <= 0.05 * radius) {
            let found = format!("an arc from radius {radius} to radius {other}");
            return Err(self.file.fault(entity, "entity-invalid", found, "equal radii above 0"));
        }
        let [from, to] = arc_range(&(start - centre), &(end - centre));
        let frame = Frame { origin: Vec3::new(centre.x, centre.y, z), ..Frame::world() };
        let curve = Curve3::ellipse_arc(&frame, radius, radius, from, to);
        Ok(Piece { curve, shape: Shape::Arc { frame, radius } })
    }

    /// Line (110): start, end. Forms 1 and 2 are unbounded.
    fn line(&self, entity: usize) -> Result<Piece, Fault> {
        if self.file.entry(entity).form != 0 {
            self.file.warn(
                entity,
                "line-unbounded",
                "an unbounded line (form 1 or 2) is trimmed to its two points",
            );
        }
        let mut p = self.file.params(entity)?;
        let (a, b) = (p.vec3("start")?, p.vec3("end")?);
        Ok(Piece { curve: Curve3::line(a, b), shape: Shape::Line })
    }

    /// A curve as a single rational B-spline. The domain of a composite is the sum of the ranges of its members, from
    /// 0.
    pub fn joined(&self, entity: usize, map: &Affine) -> Result<Piece, Fault> {
        self.joined_at(entity, map, 0)
    }

    /// [`Reader::joined`] at a given pointer depth.
    pub fn joined_at(&self, entity: usize, map: &Affine, depth: usize) -> Result<Piece, Fault> {
        let mut pieces = self.pieces_at(entity, map, depth)?;
        if pieces.len() == 1
            && let Some(only) = pieces.pop()
        {
            return Ok(only);
        }
        let exact = pieces.iter().all(|p| matches!(p.shape, Shape::Line | Shape::Free));
        let curves: Vec<Curve3> = pieces.into_iter().map(|p| p.curve).collect();
        let curve = super::join::join(&curves).map_err(|e| self.nurbs_fault(entity, &e))?;
        Ok(Piece { curve, shape: if exact { Shape::Free } else { Shape::Reparametrised } })
    }

    /// Segments of a curve in a parameter plane (z is dropped).
    pub fn flat_pieces(&self, entity: usize) -> Result<Vec<Curve2>, Fault> {
        let pieces = self.pieces(entity, &Affine::identity())?;
        pieces.iter().map(|p| flat(&p.curve).map_err(|e| self.nurbs_fault(entity, &e))).collect()
    }

    /// Converts an error of the control data to a fault of the entity.
    pub fn nurbs_fault(&self, entity: usize, error: &NurbsError) -> Fault {
        self.file.fault(
            entity,
            "spline-invalid",
            error.to_string(),
            "the control data of a rational B-spline",
        )
    }
}

impl Piece {
    fn transformed(&self, map: &Affine) -> Self {
        if *map == Affine::identity() {
            return self.clone();
        }
        let shape = match (self.shape, similarity(map)) {
            (Shape::Arc { frame, radius }, Some(scale)) => {
                let (x, y) = (map.vector(&frame.x) / scale, map.vector(&frame.y) / scale);
                let frame = Frame { origin: map.point(&frame.origin), x, y, z: x.cross(&y) };
                Shape::Arc { frame, radius: radius * scale }
            }
            (Shape::Arc { .. }, None) => Shape::Reparametrised,
            (shape, _) => shape,
        };
        Self { curve: self.curve.transformed(map), shape }
    }
}

/// Angular range of an arc from the directions of its ends: start in [0, 2 pi), sweep in (0, 2 pi].
pub(super) fn arc_range(start: &Vec2, end: &Vec2) -> [f64; 2] {
    let mut from = start.y.atan2(start.x);
    if from < -1e-9 {
        from += TAU;
    }
    if (end - start).norm() <= 1e-8 * start.norm() {
        return [from, from + TAU];
    }
    let mut sweep = (start.x * end.y - start.y * end.x).atan2(start.dot(end));
    if sweep <= 0.0 {
        sweep += TAU;
    }
    [from, from + sweep]
}

/// Projection of a space curve onto the xy plane.
pub(super) fn flat(curve: &Curve3) -> Result<Curve2, NurbsError> {
    let points = curve.points().iter().map(|p| p.xy()).collect();
    Curve2::try_new(curve.degree(), curve.knots().to_vec(), points, Some(curve.weights().to_vec()))
}
