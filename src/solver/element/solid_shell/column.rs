//! The points of a solid-shell above one point of its mid surface.

use super::generalised::{GENERALISED, add_curvature, derivatives, products};
use super::in_plane::InPlane;
use super::pairs::{PLANE, Pairs, Plane, SHAPES, THICKNESS_MODES, blend};
use super::shape::{Moved, Shape, Sums};
use super::stretch::{STRETCHES, Stretch};
use crate::geometry::{Mat3, Vec3};
use crate::solver::element::kernels::{self, Row};
use crate::solver::element::{
    DOFS, ElementInput, ElementMatrices, FailureReason, PointFailure, Want, compatible,
};
use crate::solver::numbers::tensor::{self, Mandel, Mandel66};

/// Directions in which modes strain a point: through the thickness, one for each shape as all modes go one way, and the
/// stretches.
pub(super) const DIRECTIONS: usize = SHAPES + STRETCHES;

/// A point of the mid surface.
pub(super) struct Column<'a> {
    pub input: &'a ElementInput<'a>,
    pub shape: &'a Shape<'a>,
    pub moved: &'a Moved,
    pub in_plane: InPlane,
    pub index: usize,
    pub xi: f64,
    pub eta: f64,
}

/// What all points of a column share.
pub(super) struct Frame<'a> {
    /// Base vectors along the mid surface before anything moved; they change by `tilt` with `ζ`.
    pub along: [Vec3; 2],
    pub tilt: [Vec3; 2],
    /// That through the thickness.
    pub across: Vec3,
    /// Generalised strain of the nodes.
    pub strain: [f64; GENERALISED],
    /// Stretch `U`.
    pub gradient: Mat3,
    /// Strain through the thickness at the element's centre and `1`, with the stretch over them.
    pub through: Mandel,
    pub unit: Mandel,
    /// det J at the centre.
    pub share: f64,
    /// Values of the modes through the thickness over the mid surface, added up by shape.
    pub thickening: [f64; SHAPES],
    /// Stretches, if the element has such modes.
    pub stretch: Option<Stretch<'a>>,
}

/// Generalised stress and stiffness of one column of points.
#[derive(Clone, Copy)]
pub(super) struct Totals {
    pub stress: [f64; GENERALISED],
    pub stiffness: [[f64; GENERALISED]; GENERALISED],
    /// What modes of value one in each direction feel, their stiffness, and their coupling to the generalised strains.
    pub residual: [f64; DIRECTIONS],
    pub modes: [[f64; DIRECTIONS]; DIRECTIONS],
    pub left: [[f64; GENERALISED]; DIRECTIONS],
    pub right: [[f64; GENERALISED]; DIRECTIONS],
    pub elastic_energy: f64,
    pub plastic_work: f64,
}

impl Totals {
    pub const ZERO: Self = Self {
        stress: [0.0; GENERALISED],
        stiffness: [[0.0; GENERALISED]; GENERALISED],
        residual: [0.0; DIRECTIONS],
        modes: [[0.0; DIRECTIONS]; DIRECTIONS],
        left: [[0.0; GENERALISED]; DIRECTIONS],
        right: [[0.0; GENERALISED]; DIRECTIONS],
        elastic_energy: 0.0,
        plastic_work: 0.0,
    };
}

impl<'a> Column<'a> {
    /// What its points share, the modes having the values `alpha`.
    ///
    /// # Errors
    /// [`PointFailure`] where a stretch turns the column inside out.
    pub(super) fn frame(&self, alpha: &[f64]) -> Result<Frame<'a>, PointFailure> {
        let place = (self.xi, self.eta);
        let at = |pairs: &Pairs, turned| products(pairs, &self.in_plane, turned, place);
        let before = at(self.shape.pairs, &[0.0; 2]);
        let now = at(&self.moved.pairs, &self.moved.fibres.value);
        let plane = Plane::at(self.xi, self.eta);
        let both = |of: &[Vec3; 4]| [blend(&plane.by_xi, of), blend(&plane.by_eta, of)];
        let (along, tilt) = (both(&self.shape.pairs.mean), both(&self.shape.pairs.half));
        let across = blend(&plane.value, &self.shape.pairs.half);
        let volume = |along: &[Vec3; 2]| along[0].cross(&along[1]).dot(&across);
        // det J is quadratic in ζ.
        let stretch = self.stretch(alpha, volume(&along) + volume(&tilt) / 3.0)?;
        let gradient = stretch.as_ref().map_or_else(Mat3::identity, |stretch| stretch.gradient);
        let (through, unit) = over(&gradient, &self.shape.centre.0);
        let own = self.over_plane();
        let sum =
            |shape: usize| own.iter().zip(&alpha[shape * PLANE.len()..]).map(|(v, a)| v * a).sum();
        Ok(Frame {
            along,
            tilt,
            across,
            strain: std::array::from_fn(|i| now[i] - before[i]),
            gradient,
            through,
            unit,
            share: self.shape.centre.1,
            thickening: std::array::from_fn(sum),
            stretch,
        })
    }

    /// Values of the modes through the thickness here, without their shapes.
    fn over_plane(&self) -> [f64; PLANE.len()] {
        PLANE.map(|mode| mode.value([self.xi, self.eta, 1.0]))
    }

    /// Stretches of the column, if it has such modes: the same at all its points, so weighted by the mean of det J.
    fn stretch(&self, alpha: &[f64], mean: f64) -> Result<Option<Stretch<'a>>, PointFailure> {
        let [along, across] = match alpha[THICKNESS_MODES..] {
            [along, across] => [along, across],
            _ => return Ok(None),
        };
        let share = self.shape.centre.1 / mean;
        let stretch =
            self.shape.axes.stretched([self.xi * share, self.eta * share], [along, across]);
        stretch.map(Some).map_err(|ratio| PointFailure {
            point: self.index * self.shape.rule.len(),
            reason: FailureReason::Inverted { ratio },
        })
    }

    /// Adds what the points gave to the element.
    pub(super) fn add<const M: usize>(
        &self,
        totals: &Totals,
        sums: &mut Sums<M>,
        out: &mut ElementMatrices,
    ) {
        let at = (self.xi, self.eta);
        out.elastic_energy += totals.elastic_energy;
        out.plastic_work += totals.plastic_work;
        out.through += totals.stress[9];
        let b = derivatives(self.moved, &self.in_plane, at);
        for (row, value) in b.iter().zip(&totals.stress) {
            out.force.iter_mut().zip(row).for_each(|(sum, rate)| *sum += rate * value);
        }
        self.add_modes(&b, totals, sums);
        if self.input.want == Want::ResidualAndTangent {
            compatible::add_congruence(&b, &totals.stiffness, &mut out.tangent);
            let curvature = (&mut sums.curvature, &mut sums.turning);
            add_curvature(&totals.stress, &self.in_plane, at, curvature);
        }
    }

    /// Adds what the modes feel: those through the thickness by their values here, the stretches as they are.
    fn add_modes<const M: usize>(
        &self,
        b: &[Row; GENERALISED],
        totals: &Totals,
        sums: &mut Sums<M>,
    ) {
        let own = self.over_plane();
        let share = |k: usize| match k.checked_sub(THICKNESS_MODES) {
            None => (k / own.len(), own[k % own.len()]),
            Some(stretch) => (SHAPES + stretch, 1.0),
        };
        let (mut left, mut right) = ([[0.0; DOFS]; DIRECTIONS], [[0.0; DOFS]; DIRECTIONS]);
        let count = SHAPES + M - THICKNESS_MODES;
        kernels::combine(&totals.left[..count], b, &mut left[..count]);
        kernels::combine(&totals.right[..count], b, &mut right[..count]);
        let modes = &mut sums.modes;
        for k in 0..M {
            let (from, value) = share(k);
            modes.residual[k] += value * totals.residual[from];
            for l in 0..M {
                let (other, factor) = share(l);
                modes.stiffness[k][l] += value * factor * totals.modes[from][other];
            }
            modes.left[k].iter_mut().zip(&left[from]).for_each(|(sum, x)| *sum += value * x);
            modes.right[k].iter_mut().zip(&right[from]).for_each(|(sum, x)| *sum += value * x);
        }
    }
}

/// The strain through the thickness, and `1`, with the stretch `U` over them: `Uᵀ e U` and `Uᵀ U`.
fn over(gradient: &Mat3, centre: &Mandel66) -> (Mandel, Mandel) {
    let rows = std::array::from_fn(|i| std::array::from_fn(|j| gradient[(j, i)]));
    let through = centre.map(|row| row[2]);
    (
        tensor::apply(&tensor::congruence(&rows), &through),
        tensor::from_matrix(&(gradient.transpose() * gradient)),
    )
}
