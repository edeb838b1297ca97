//! Closest-point queries on a tool surface.

use rayon::prelude::*;

use super::foot::{locate, unit_normal, weingarten};
use super::form::{Chart, Form, Shape};
use super::project::Descent;
use super::projection::{ContactSearch, Location, Outcome, Projection};
use super::search::{Best, Search};
use super::surface::ToolSurface;
use super::wide::{Plain, Wide};
use kanagata_geometry::{Vec2, Vec3};

impl ToolSurface {
    /// Globally closest point to `p` (tool frame); `hint` is the patch of the last result for this point.
    ///
    /// Among foot points at equal distance (on a common side or corner) the most facing patch is preferred, then one
    /// with an interior foot point, then the lowest id. At a crease the sign of the gap is then correct for the solid.
    /// For a model without patches, or a point that is not finite, the distance is infinite.
    #[must_use]
    pub fn closest(&self, p: &Vec3, hint: Option<u32>) -> Projection {
        self.within(p, hint, f64::INFINITY)
    }

    /// As [`Self::closest`] within the distance `reach` [mm]; beyond it the result is [`Projection::nowhere`]. Distant
    /// points then cost very little.
    #[must_use]
    pub fn within(&self, p: &Vec3, hint: Option<u32>, reach: f64) -> Projection {
        let first = hint.and_then(|patch| self.nearest_piece(patch, p)).map(|k| (k, None));
        Query { surface: self, p, first, reach }.run()
    }

    /// As [`Self::within`], starting from the last result for this or a nearby point: Newton's iteration starts there,
    /// and the initial bound for all other patches is tighter. The result does not depend on the start, except for foot
    /// points at equal distance.
    #[must_use]
    pub fn from_last(&self, p: &Vec3, last: &Projection, reach: f64) -> Projection {
        let at = Vec2::new(last.eta, last.zeta);
        let first = self.pieces_of(last.patch).iter().find_map(|&k| {
            let x = self.charts[k as usize].inverse(&at);
            self.pieces[k as usize].shape.holds(&x).then_some((k as usize, Some(x)))
        });
        Query { surface: self, p, first, reach }.run()
    }

    /// Closest points to all `points`, in parallel; `last` contains earlier results for the same points, or is empty.
    #[must_use]
    pub fn closest_of_all(&self, points: &[Vec3], last: &[Projection]) -> Vec<Projection> {
        let one = |(k, p): (usize, &Vec3)| match last.get(k) {
            Some(last) => self.from_last(p, last, f64::INFINITY),
            None => self.closest(p, None),
        };
        points.par_iter().enumerate().with_min_len(64).map(one).collect()
    }

    /// Projection onto one patch extended smoothly past its sides by 5 % of its parameters, from a known foot point. It
    /// is used for a node that alternates between two patches. `None` outside that range.
    #[must_use]
    pub fn extended_projection(&self, p: &Vec3, from: &Projection) -> Option<Projection> {
        const EXTENSION: f64 = 0.05;
        let patch = self.model().patches.get(from.patch as usize)?;
        let shape = if patch.sides() == 3 { Shape::Triangle } else { Shape::Square };
        let chart = Chart::whole(shape);
        let form = Form::of(patch, &chart);
        let descent = Descent {
            wide: Plain,
            form: &form,
            shape,
            scale: 1.0 + 2.0 * EXTENSION,
            w: p - form.centre,
            min_curvature: [0.0; 2],
            limit: f64::INFINITY,
        };
        let found = descent.run(chart.inverse(&Vec2::new(from.eta, from.zeta)))?;
        if !shape.holds(&(found.at / (1.0 + 1.6 * EXTENSION))) {
            return None;
        }
        let at = chart.at(&found.at);
        let d = patch.derivs(at.x, at.y);
        let normal = unit_normal(&d)?;
        Some(Projection {
            patch: from.patch,
            eta: at.x,
            zeta: at.y,
            location: Location::Inside,
            past_border: false,
            point: d.s,
            normal,
            gap: (p - d.s).dot(&normal),
            curvature: weingarten(&d, &normal),
            outcome: Outcome::Local,
        })
    }

    #[inline(always)]
    fn finish(&self, p: &Vec3, best: &Best, outcome: Outcome) -> Projection {
        let Some(patch) = self.model().patches.get(best.patch as usize) else {
            return Projection { outcome, ..Projection::nowhere() };
        };
        let (location, at) = locate(patch.sides(), best.at);
        let d = patch.derivs(at.x, at.y);
        let normal = unit_normal(&d).or_else(|| d.normal(at.x, at.y)).unwrap_or_else(|| {
            // A collapsed corner: use the limit from inside the patch.
            let centre = Vec2::new(0.6, 0.4);
            let inner = at + 1e-6 * (centre - at);
            patch.normal(inner.x, inner.y).unwrap_or_else(Vec3::z)
        });
        let q = p - d.s;
        let gap = q.dot(&normal);
        let on_border = self.borders.is_free(best.patch, location);
        let past = || (q - normal * gap).norm() > 1e-6 * self.bounds().diagonal();
        Projection {
            patch: best.patch,
            eta: at.x,
            zeta: at.y,
            location,
            past_border: on_border && past(),
            point: d.s,
            normal,
            gap,
            curvature: weingarten(&d, &normal),
            outcome,
        }
    }
}

impl ContactSearch for ToolSurface {
    fn find(&self, p: &Vec3, last: Option<&Projection>) -> Projection {
        match last {
            Some(last) => self.from_last(p, last, f64::INFINITY),
            None => self.closest(p, None),
        }
    }
}

/// One query, compiled for the widest vector instructions of the machine.
struct Query<'a> {
    surface: &'a ToolSurface,
    p: &'a Vec3,
    /// The piece to search first, and the starting parameters.
    first: Option<(usize, Option<Vec2>)>,
    reach: f64,
}

impl Query<'_> {
    #[inline(always)]
    fn answer(self, wide: impl Wide) -> Projection {
        let mut search = Search::new(wide, self.surface, self.p, self.reach);
        search.run(self.first);
        search.select_at_joints(self.reach);
        self.surface.finish(self.p, &search.best, search.outcome())
    }

    fn run(self) -> Projection {
        #[cfg(target_arch = "x86_64")]
        if let Some(v3) = pulp::x86::V3::try_new() {
            return pulp::Simd::vectorize(v3, OnV3(self, v3));
        }
        self.answer(Plain)
    }
}

#[cfg(target_arch = "x86_64")]
struct OnV3<'a>(Query<'a>, pulp::x86::V3);

#[cfg(target_arch = "x86_64")]
impl pulp::WithSimd for OnV3<'_> {
    type Output = Projection;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Projection {
        self.0.answer(self.1)
    }
}
