//! Curves on a surface above a curve in plan: `(x, y)(u, v) = C(t)`, followed step by step.
//!
//! Two equations for three unknowns (u, v, t): the tangent is the null vector of their Jacobian, the corrector the
//! Newton step of least length (pseudo-arclength continuation). A vertical wall is no special case: t stays constant
//! there. The curve has the inside of the region on its left in the parameter plane.

use nalgebra::{Matrix2, Matrix2x3, Vector3};

use super::plan::PlanCurve;
use crate::trim_region::TrimRegion;
use kanagata_geometry::nurbs::Surface;
use kanagata_geometry::{Vec2, Vec3};

/// Steps of one curve at most.
const STEPS_MAX: usize = 20_000;
/// Corrections of a step at most.
const CORRECTIONS_MAX: usize = 12;
/// Steps across a face, at least.
const STEPS_PER_SIZE: f64 = 24.0;
/// Largest turn of the tangent within a step: its cosine at 8 degrees.
const TURN_COSINE_MIN: f64 = 0.99;
/// Sine of the angle between surface and plan curve below which they touch.
const TOUCH_SINE_MIN: f64 = 1e-5;
/// Lateral distance from a step, relative to its length, within which an end of the curve lies on it: above the
/// height of an arc of 8 degrees over its chord.
const SAGITTA_REL: f64 = 0.05;
/// Deviation of the fitted parameter curve from the exact one, relative to the tolerance of the model.
pub(super) const FIT_REL: f64 = 0.05;

/// A point of the curve: parameters on the surface, piece of the plan curve and parameter on it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Node {
    pub uv: Vec2,
    pub piece: usize,
    pub t: f64,
    /// The curve has a kink there: a crease of the surface.
    pub kink: bool,
}

/// Where a curve ends.
pub(super) enum End {
    /// At one of these points: its index.
    At(usize),
    /// Where it began.
    Closed,
}

/// Follows curves on one face.
pub(super) struct Tracer<'a> {
    pub surface: &'a Surface,
    pub region: &'a TrimRegion,
    pub curve: &'a PlanCurve,
    /// Distance below which points coincide [mm].
    pub tolerance: f64,
    /// Size of the face [mm].
    pub size: f64,
}

/// Derivatives at a point.
struct Local {
    /// `(x, y)(u, v) - C(t)` [mm].
    residual: Vec2,
    /// Derivatives of the residual by u, v, t, each scaled by `scale`.
    jacobian: Matrix2x3<f64>,
    /// Lengths of the derivatives of surface and curve [mm].
    scale: Vector3<f64>,
    /// Derivatives of the surface [mm].
    su: Vec3,
    sv: Vec3,
    /// Normal of the plan curve to its inside.
    inward: Vec2,
}

impl Tracer<'_> {
    fn local(&self, node: &Node) -> Option<Local> {
        let d = self.surface.derivs(node.uv);
        let c = self.curve.pieces()[node.piece].derivs(node.t);
        let scale = Vector3::new(d.su.norm(), d.sv.norm(), c.d1.norm());
        if !scale.iter().all(|s| *s > 0.0 && s.is_finite()) {
            return None;
        }
        let columns = [d.su.xy() / scale.x, d.sv.xy() / scale.y, -c.d1 / scale.z];
        Some(Local {
            residual: d.s.xy() - c.c,
            jacobian: Matrix2x3::from_columns(&columns),
            scale,
            su: d.su,
            sv: d.sv,
            inward: Vec2::new(-c.d1.y, c.d1.x) / scale.z,
        })
    }

    /// Change of (u, v, t) for 1 mm along the curve, and the tangent in space.
    fn direction(&self, node: &Node) -> Option<(Vector3<f64>, Vec3)> {
        let at = self.local(node)?;
        let [a, b] = [at.jacobian.row(0).transpose(), at.jacobian.row(1).transpose()];
        let null = a.cross(&b);
        if null.norm() < TOUCH_SINE_MIN {
            return None;
        }
        let change = null.component_div(&at.scale);
        let along = at.su * change.x + at.sv * change.y;
        let gradient = Vec2::new(at.inward.dot(&at.su.xy()), at.inward.dot(&at.sv.xy()));
        // The inside is on the left: the gradient of the distance agrees with the left normal.
        let sign = (Vec2::new(-change.y, change.x).dot(&gradient)).signum();
        let length = along.norm();
        (length > 0.0).then(|| (change * (sign / length), along * (sign / length)))
    }

    /// The node moved onto the curve by steps of least length.
    pub(super) fn corrected(&self, mut node: Node, fixed_t: bool) -> Option<Node> {
        let exact = 1e-12 * (self.size + self.tolerance) + 1e-3 * FIT_REL * self.tolerance;
        let [[u0, u1], [v0, v1]] = self.surface.domain();
        for _ in 0..CORRECTIONS_MAX {
            let at = self.local(&node)?;
            if at.residual.norm() <= exact {
                return Some(node);
            }
            let mut j = at.jacobian;
            if fixed_t {
                j.set_column(2, &Vec2::zeros());
            }
            let square: Matrix2<f64> = j * j.transpose();
            let step = j.transpose() * square.try_inverse()? * at.residual;
            let step = step.component_div(&at.scale);
            if !step.iter().all(|x| x.is_finite()) {
                return None;
            }
            node.uv =
                Vec2::new((node.uv.x - step.x).clamp(u0, u1), (node.uv.y - step.y).clamp(v0, v1));
            let [low, high] = self.curve.pieces()[node.piece].domain();
            node.t = (node.t - step.z).clamp(low - (high - low), high + (high - low));
        }
        let left = self.local(&node)?.residual.norm();
        (left <= FIT_REL * self.tolerance).then_some(node)
    }

    /// The point of the surface above C(t) near `uv`, if the surface has one there.
    pub(super) fn above(&self, uv: Vec2, piece: usize, t: f64) -> Option<Node> {
        self.corrected(Node { uv, piece, t, kink: false }, true)
    }

    /// Follows the curve from `start` to one of `ends`, or back to its beginning when `closes`.
    ///
    /// # Errors
    /// The reason why the curve cannot be followed.
    pub(super) fn trace(
        &self,
        start: Node,
        ends: &[Node],
        closes: bool,
    ) -> Result<(Vec<Node>, End), String> {
        let mut nodes = vec![start];
        self.pass_corner(&mut nodes);
        let largest = self.size / STEPS_PER_SIZE;
        let mut step = 0.25 * largest;
        for _ in 0..STEPS_MAX {
            let here = nodes[nodes.len() - 1];
            let (next, taken) = self.advance(here, step, largest)?;
            step = taken;
            if next.uv == here.uv && next.t == here.t {
                return Err(self.leaving(next.uv));
            }
            let first = closes.then_some(start).filter(|_| nodes.len() > 3);
            if let Some(end) = self.end_within(&here, &next, ends, first) {
                let uv = if let End::At(k) = end { ends[k].uv } else { start.uv };
                let near = self.curve.near(self.surface.point(uv).xy());
                let t = if near.piece == next.piece { near.t } else { next.t };
                nodes.push(Node { uv, t, ..next });
                return Ok((nodes, end));
            }
            if !self.region.contains(next.uv) {
                return Err(self.leaving(next.uv));
            }
            nodes.push(next);
            self.pass_corner(&mut nodes);
        }
        Err(format!("the cut has more than {STEPS_MAX} steps"))
    }

    fn leaving(&self, uv: Vec2) -> String {
        let p = self.surface.point(uv);
        format!(
            "the cut leaves the face near ({:.3}, {:.3}, {:.3}) mm and not at a crossing of its border",
            p.x, p.y, p.z
        )
    }

    /// The next node within `step` [mm], and the step to try next.
    fn advance(&self, here: Node, step: f64, largest: f64) -> Result<(Node, f64), String> {
        let touching = || {
            let p = self.surface.point(here.uv);
            format!("the curve touches the face near ({:.3}, {:.3}, {:.3}) mm", p.x, p.y, p.z)
        };
        let (change, along) = self.direction(&here).ok_or_else(touching)?;
        let [low, high] = self.curve.pieces()[here.piece].domain();
        let mut h = step;
        while h > 1e-3 * self.tolerance.min(step) {
            let by = change * h;
            let (uv, t) = (here.uv + by.xy(), here.t + by.z);
            let guess = Node { uv, t, kink: false, ..here };
            let found = self.corrected(guess, false).and_then(|node| {
                let beyond = node.t < low || node.t > high;
                if !beyond {
                    return Some(node);
                }
                // The step ends at the end of the piece of the plan curve.
                let t = node.t.clamp(low, high);
                let fraction = ((t - here.t) / (node.t - here.t)).clamp(0.0, 1.0);
                let uv = here.uv + (node.uv - here.uv) * fraction;
                self.corrected(Node { uv, t, kink: false, ..here }, true)
            });
            let turn = found.as_ref().and_then(|node| Some(self.direction(node)?.1.dot(&along)));
            // A kink remains however short the step is.
            let kink = turn.is_some_and(|turn| turn < TURN_COSINE_MIN);
            if let (Some(node), Some(turn)) = (found, turn)
                && (!kink || h <= self.tolerance && turn > 0.0)
                && self.distance(here.uv, node.uv) <= 2.0 * h
            {
                return Ok((Node { kink, ..node }, (1.5 * h).min(largest)));
            }
            h *= 0.5;
        }
        Err(touching())
    }

    /// At the end of a piece of the plan curve the next one continues.
    fn pass_corner(&self, nodes: &mut [Node]) {
        let count = self.curve.pieces().len();
        let Some(last) = nodes.last_mut() else { return };
        let [low, high] = self.curve.pieces()[last.piece].domain();
        let forward = self.direction(last).map(|(change, _)| change.z);
        let piece = match forward {
            Some(dt) if dt > 0.0 && last.t >= high => (last.piece + 1) % count,
            Some(dt) if dt < 0.0 && last.t <= low => (last.piece + count - 1) % count,
            _ => return,
        };
        let domain = self.curve.pieces()[piece].domain();
        let t = if forward.is_some_and(|dt| dt > 0.0) { domain[0] } else { domain[1] };
        *last = Node { piece, t, ..*last };
    }

    /// Distance of two near points of the surface [mm], measured in the parameter plane.
    pub(super) fn distance(&self, a: Vec2, b: Vec2) -> f64 {
        let d = self.surface.derivs(a);
        (d.su * (b.x - a.x) + d.sv * (b.y - a.y)).norm()
    }

    /// Place of `p` along the step from `a` to `b` [mm], if it lies on it.
    fn along_step(&self, a: Vec2, b: Vec2, p: Vec2) -> Option<f64> {
        let d = self.surface.derivs(a);
        let placed = |p: Vec2| d.su * (p.x - a.x) + d.sv * (p.y - a.y);
        let (to, q) = (placed(b), placed(p));
        let length = to.norm().max(f64::MIN_POSITIVE);
        let t = q.dot(&to) / length;
        let lateral = (q - to * (t / length)).norm();
        let near = 4.0 * self.tolerance;
        let on = lateral <= SAGITTA_REL * length + near && t >= -near && t <= length + near;
        on.then_some(t)
    }

    /// Whether a curve passes a point above the plan curve.
    pub(super) fn passes(&self, nodes: &[Node], point: &Node) -> bool {
        let at = self.surface.point(point.uv);
        let on_step = |w: &[Node]| {
            let end = if w[1].piece == w[0].piece {
                w[1].t
            } else {
                self.piece_end(w[0].piece, w[1].piece)
            };
            let part = (point.t - w[0].t) / (end - w[0].t);
            if w[0].piece != point.piece || !(-0.01..=1.01).contains(&part) {
                return false;
            }
            let guess = w[0].uv + (w[1].uv - w[0].uv) * part;
            let found = self.above(guess, point.piece, point.t);
            found.is_some_and(|f| (self.surface.point(f.uv) - at).norm() <= 8.0 * self.tolerance)
        };
        nodes.windows(2).any(on_step)
    }

    /// The end that lies on the step from `a` to `b`, the first along it.
    fn end_within(&self, a: &Node, b: &Node, ends: &[Node], first: Option<Node>) -> Option<End> {
        let along = |p: Node| {
            let place = self.along_step(a.uv, b.uv, p.uv)?;
            self.is_between(a, b, &p).then_some(place)
        };
        let at = ends.iter().enumerate().filter_map(|(k, p)| Some((along(*p)?, End::At(k))));
        let closed = first.and_then(|p| Some((along(p)?, End::Closed)));
        at.chain(closed).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, end)| end)
    }

    /// Whether a point is above the part of the plan curve between two nodes of a step, within the tolerance. A point
    /// beside the step may be above another piece.
    fn is_between(&self, a: &Node, b: &Node, p: &Node) -> bool {
        let c = &self.curve.pieces()[a.piece];
        let at = self.curve.pieces()[p.piece].point(p.t);
        let near = 4.0 * self.tolerance;
        let [from, to] = [a.t.min(b.t), a.t.max(b.t)];
        let is_end = |t: f64| (c.point(t) - at).norm() <= near;
        is_end(from) || is_end(to) || (p.piece == a.piece && (from..=to).contains(&p.t))
    }

    /// The parameter at which a piece meets a neighbour. A curve has at least three pieces.
    pub(super) fn piece_end(&self, piece: usize, neighbour: usize) -> f64 {
        let [low, high] = self.curve.pieces()[piece].domain();
        if (piece + 1) % self.curve.pieces().len() == neighbour { high } else { low }
    }
}
