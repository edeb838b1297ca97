//! Curve entities: conics, lines, splines, composites, trimmed and offset ones.

use super::entity::{Attributes, Entity, Outcome};
use super::form::Form;
use super::resolver::{Resolver, Units};
use super::table::Value;
use crate::iges::join::join;
use kanagata_geometry::Vec3;
use kanagata_geometry::nurbs::Curve3;

impl Resolver<'_> {
    /// Reads any curve; `depth` is the number of references followed.
    pub fn curve(&self, e: Entity, units: Units, depth: usize) -> Outcome<Form> {
        self.charge(e, depth, 0)?;
        let a = e.attributes();
        let inner = |k: usize| self.curve(a.entity(k)?, units, depth + 1);
        match e.kind() {
            "LINE" => {
                Ok(Form::Line(self.point(a.entity(1)?, units)?, self.vector(a.entity(2)?, units)?))
            }
            "CIRCLE" | "ELLIPSE" | "HYPERBOLA" | "PARABOLA" => self.conic(e, &a, units),
            "POLYLINE" => self.polyline(e, &a, units, depth),
            "TRIMMED_CURVE" => self.trimmed_curve(e, &a, units, depth),
            "COMPOSITE_CURVE"
            | "COMPOSITE_CURVE_ON_SURFACE"
            | "BOUNDARY_CURVE"
            | "OUTER_BOUNDARY_CURVE" => self.composite(e, units, depth),
            "SURFACE_CURVE" | "SEAM_CURVE" | "INTERSECTION_CURVE" | "BOUNDED_SURFACE_CURVE" => {
                inner(1)
            }
            "CURVE_REPLICA" => {
                let map = self.operator(a.entity(2)?, units)?;
                let parent = inner(1)?;
                parent.transformed(&map).ok_or_else(|| e.fault("a bad transformation", "a scale"))
            }
            "OFFSET_CURVE_3D" => self.offset_curve(e, &a, units, depth),
            kind if kind.contains("B_SPLINE_CURVE")
                || matches!(kind, "BEZIER_CURVE" | "UNIFORM_CURVE" | "QUASI_UNIFORM_CURVE") =>
            {
                self.spline_curve(e, units, depth).map(Form::Free)
            }
            kind => Err(e.fault(format!("a {kind} as a curve"), "a curve entity of AP203/214/242")),
        }
    }

    /// Reads a circle, ellipse or hyperbola; any other type as a parabola. Lengths in mm.
    fn conic(&self, e: Entity, a: &Attributes, units: Units) -> Outcome<Form> {
        match e.kind() {
            "CIRCLE" => {
                let r = length(e, a, 2, units)?;
                Ok(Form::Ellipse(self.frame(a.entity(1)?, units)?, r, r))
            }
            "ELLIPSE" | "HYPERBOLA" => {
                let (p, q) = (length(e, a, 2, units)?, length(e, a, 3, units)?);
                let frame = self.frame(a.entity(1)?, units)?;
                let ellipse = e.kind() == "ELLIPSE";
                Ok(if ellipse { Form::Ellipse(frame, p, q) } else { Form::Hyperbola(frame, p, q) })
            }
            _ => Ok(Form::Parabola(self.frame(a.entity(1)?, units)?, length(e, a, 2, units)?)),
        }
    }

    fn polyline(&self, e: Entity, a: &Attributes, units: Units, depth: usize) -> Outcome<Form> {
        let points = a.entities(1)?;
        self.charge(e, depth, points.len())?;
        let points: Vec<Vec3> =
            points.iter().map(|p| self.point(*p, units)).collect::<Outcome<_>>()?;
        let n = points.len();
        if n < 2 {
            return Err(e.fault(format!("{n} points"), "at least 2"));
        }
        let mut knots: Vec<f64> = (0..n).map(|k| k as f64).collect();
        knots.insert(0, 0.0);
        knots.push((n - 1) as f64);
        Curve3::try_new(1, knots, points, None).map(Form::Free).map_err(|x| spline_fault(e, &x))
    }

    /// `TRIMMED_CURVE(name, basis, trim 1, trim 2, sense, preferred)`.
    fn trimmed_curve(
        &self,
        e: Entity,
        a: &Attributes,
        units: Units,
        depth: usize,
    ) -> Outcome<Form> {
        let basis = self.curve(a.entity(1)?, units, depth + 1)?;
        let sense = a.flag(4)?;
        let by_point = a.enumeration(5) == Some("CARTESIAN");
        let ends = [
            self.trim(e, a.list(2)?, &basis, units, by_point)?,
            self.trim(e, a.list(3)?, &basis, units, by_point)?,
        ];
        let [from, to] = if sense { ends } else { [ends[1], ends[0]] };
        let cut = basis.cut_wrapped(from, to);
        let cut = cut.ok_or_else(|| e.fault(format!("trims {from} to {to}"), "a range"))?;
        self.charge(e, depth, cut.points().len())?;
        Ok(Form::Free(if sense { cut } else { cut.reversed() }))
    }

    /// One trimming set: `PARAMETER_VALUE(t)`, a point, or both.
    fn trim(
        &self,
        e: Entity,
        set: &[Value],
        basis: &Form,
        units: Units,
        by_point: bool,
    ) -> Outcome<f64> {
        let (mut parameter, mut point) = (None, None);
        for value in set {
            if let Value::Reference(id) = value {
                if let Some(index) = self.table.find(*id) {
                    point = Some(self.point(self.entity(index), units)?);
                }
            } else {
                parameter = super::entity::number(self.table, *value).or(parameter);
            }
        }
        let angular = matches!(basis, Form::Ellipse(..));
        let parameter = parameter.map(|t| if angular { t * units.angle } else { t });
        let projected = point.map(|p| basis.parameter(&p));
        let chosen = if by_point { projected.or(parameter) } else { parameter.or(projected) };
        chosen.ok_or_else(|| e.fault("a trim of neither point nor parameter", "one of them"))
    }

    /// Members of a composite curve, in order and direction.
    pub fn members<'e>(&self, e: Entity<'e>) -> Outcome<Vec<(Entity<'e>, bool)>> {
        let mut out = vec![];
        for segment in e.attributes().entities(1)? {
            let s = segment.attributes();
            // COMPOSITE_CURVE_SEGMENT(transition, same_sense, parent_curve)
            out.push((s.entity(2)?, s.flag(1)?));
        }
        Ok(out)
    }

    fn composite(&self, e: Entity, units: Units, depth: usize) -> Outcome<Form> {
        let mut pieces = vec![];
        for (curve, sense) in self.members(e)? {
            let piece = self.curve(curve, units, depth + 1)?.whole();
            let piece =
                piece.ok_or_else(|| curve.fault("an unbounded segment", "bounded curves"))?;
            self.charge(e, depth, 4 * piece.points().len())?;
            pieces.push(if sense { piece } else { piece.reversed() });
        }
        join(&pieces).map(Form::Free).map_err(|x| spline_fault(e, &x))
    }

    /// `B_SPLINE_CURVE(name, degree, points, form, closed, self-intersect)` and its subtypes.
    fn spline_curve(&self, e: Entity, units: Units, depth: usize) -> Outcome<Curve3> {
        let a = e.attributes();
        let degree = degree(e, &a, 1)?;
        let points = a.entities(2)?;
        self.charge(e, depth, points.len())?;
        let points: Vec<Vec3> =
            points.iter().map(|p| self.point(*p, units)).collect::<Outcome<_>>()?;
        let knots = knots(e, &a, e.kind(), degree, points.len(), [6, 7])?;
        let weights = match e.part("RATIONAL_B_SPLINE_CURVE") {
            Some(part) => Some(part.reals(part.len().saturating_sub(1))?),
            None => None,
        };
        Curve3::try_new(degree, knots, points, weights).map_err(|x| spline_fault(e, &x))
    }

    /// `OFFSET_CURVE_3D(name, basis, distance, self-intersect, ref direction)`: along `reference x tangent`.
    fn offset_curve(&self, e: Entity, a: &Attributes, units: Units, depth: usize) -> Outcome<Form> {
        let basis = self.curve(a.entity(1)?, units, depth + 1)?;
        let distance = a.real(2)? * units.length;
        let reference = self.direction(a.entity(4)?)?;
        match basis {
            Form::Line(origin, direction) => {
                let across = kanagata_geometry::frame::unit(reference.cross(&direction));
                let across = across.ok_or_else(|| e.fault("a parallel reference", "another"))?;
                Ok(Form::Line(origin + across * distance, direction))
            }
            Form::Ellipse(frame, r, s) if r == s && reference.dot(&frame.z).abs() > 1.0 - 1e-9 => {
                // reference x tangent points to the centre when the reference is the axis.
                let r = r - distance * reference.dot(&frame.z).signum();
                if r > 0.0 {
                    Ok(Form::Ellipse(frame, r, r))
                } else {
                    Err(e.fault("an offset past the centre", "a smaller offset"))
                }
            }
            _ => Err(e.fault("an offset of a free curve", "offsets of lines and circles")),
        }
    }
}

/// A positive length [mm].
pub fn length(e: Entity, a: &Attributes, k: usize, units: Units) -> Outcome<f64> {
    let value = a.real(k)? * units.length;
    if value > 0.0 && value.is_finite() {
        return Ok(value);
    }
    Err(e.fault(format!("length {}", a.real(k)?), "a length above 0"))
}

/// Degree of a spline, checked before use.
pub fn degree(e: Entity, a: &Attributes, k: usize) -> Outcome<usize> {
    let n = a.integer(k)?;
    match usize::try_from(n) {
        Ok(n @ 1..=25) => Ok(n),
        _ => Err(e.fault(format!("degree {n}"), "1 to 25")),
    }
}

/// Converts an error of the control data to a fault.
pub fn spline_fault(
    e: Entity,
    error: &kanagata_geometry::nurbs::NurbsError,
) -> Box<super::entity::Fault> {
    e.fault(error.to_string(), "a rational B-spline")
}

/// Knots of a spline: explicit (`[multiplicities, knots]` at `at`), or implied by its type.
pub fn knots(
    e: Entity,
    a: &Attributes,
    kind: &str,
    degree: usize,
    points: usize,
    at: [usize; 2],
) -> Outcome<Vec<f64>> {
    if kind.contains("UNIFORM") || kind.contains("BEZIER") {
        return Ok(implied_knots(kind, degree, points));
    }
    let count = points + degree + 1;
    let (multiplicities, values) = (a.list(at[0])?, a.reals(at[1])?);
    let mut knots = Vec::new();
    for (m, value) in multiplicities.iter().zip(&values) {
        let room = count.saturating_sub(knots.len());
        match m {
            Value::Integer(m) if (1..=room as i64).contains(m) => {
                knots.extend(std::iter::repeat_n(*value, *m as usize));
            }
            other => {
                let found = format!("knot multiplicity {other:?}");
                return Err(e.fault(found, format!("1 to {room} ({count} knots in all)")));
            }
        }
    }
    if multiplicities.len() != values.len() {
        let found = format!("{} multiplicities of {} knots", multiplicities.len(), values.len());
        return Err(e.fault(found, "one each"));
    }
    Ok(knots)
}

/// Knots of a uniform, quasi-uniform or Bezier spline with `points` control points.
fn implied_knots(kind: &str, degree: usize, points: usize) -> Vec<f64> {
    let count = points + degree + 1;
    let bezier = kind.contains("BEZIER");
    let step = if bezier { degree } else { 1 };
    let last = points.saturating_sub(1) / step
        - usize::from(!bezier) * (degree - 1).min(points.saturating_sub(1));
    let knot = |k: usize| {
        let k = k as f64 - degree as f64;
        match kind {
            "UNIFORM_CURVE" | "UNIFORM_SURFACE" => k,
            _ if bezier => ((k - 1.0) / step as f64 + 1.0).floor().clamp(0.0, last as f64),
            _ => k.clamp(0.0, last as f64),
        }
    };
    (0..count).map(knot).collect()
}
