//! Integration points of a solid-shell along one thickness line.

use super::generalised::{GENERALISED, add_curvature, derivatives, products};
use super::in_plane::InPlane;
use super::pairs::{PLANE, Pairs, Plane, SHAPES, THICKNESS_MODES, blend};
use super::shape::{Moved, Shape, Sums};
use super::stretch::{STRETCHES, Stretch};
use crate::element::kernels::{self, Row};
use crate::element::{
    DOFS, ElementInput, ElementMatrices, FailureReason, PointFailure, Want, compatible,
};
use crate::numbers::tensor::{self, Mandel, Mandel66};
use kanagata_geometry::{Mat3, Vec3};

/// Strain directions of the modes at a point: thickness strain, one for each shape, and in-plane stretches.
pub(super) const DIRECTIONS: usize = SHAPES + STRETCHES;

/// Thickness line at one integration point of the mid-surface.
pub(super) struct Column<'a> {
    pub input: &'a ElementInput<'a>,
    pub shape: &'a Shape<'a>,
    pub moved: &'a Moved,
    pub in_plane: InPlane,
    pub index: usize,
    pub xi: f64,
    pub eta: f64,
}

/// Quantities common to all points of a column.
pub(super) struct Frame<'a> {
    /// Base vectors of the mid-surface in the reference configuration; they vary by `tilt` with `ζ`.
    pub along: [Vec3; 2],
    pub tilt: [Vec3; 2],
    /// Base vector through the thickness in the reference configuration.
    pub across: Vec3,
    /// Generalised strain due to the nodal displacements.
    pub strain: [f64; GENERALISED],
    /// Stretch `U`.
    pub gradient: Mat3,
    /// Thickness strain at the centre of the element and the unit tensor, both transformed by the stretch: `Uᵀ e U`,
    /// `Uᵀ U`.
    pub thickness_strain: Mandel,
    pub unit: Mandel,
    /// det J at the centre of the element.
    pub centre_det: f64,
    /// Values of the thickness modes at this point of the mid-surface, summed by shape.
    pub thickening: [f64; SHAPES],
    /// In-plane stretches, if the element has such modes.
    pub stretch: Option<Stretch<'a>>,
}

/// Generalised stress and stiffness of one column.
#[derive(Clone, Copy)]
pub(super) struct Totals {
    pub stress: [f64; GENERALISED],
    pub stiffness: [[f64; GENERALISED]; GENERALISED],
    /// Residual of each strain direction at unit value, their stiffness, and their coupling to the generalised
    /// strains.
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
    /// Quantities common to the points, for mode values `alpha`.
    ///
    /// # Errors
    /// [`PointFailure`] if a stretch is not positive.
    pub(super) fn frame(&self, alpha: &[f64]) -> Result<Frame<'a>, PointFailure> {
        let place = (self.xi, self.eta);
        let at = |pairs: &Pairs, correction| products(pairs, &self.in_plane, correction, place);
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
        let (thickness_strain, unit) = transformed_by_stretch(&gradient, &self.shape.centre.0);
        let own = self.plane_values();
        let sum =
            |shape: usize| own.iter().zip(&alpha[shape * PLANE.len()..]).map(|(v, a)| v * a).sum();
        Ok(Frame {
            along,
            tilt,
            across,
            strain: std::array::from_fn(|i| now[i] - before[i]),
            gradient,
            thickness_strain,
            unit,
            centre_det: self.shape.centre.1,
            thickening: std::array::from_fn(sum),
            stretch,
        })
    }

    /// Values of the thickness modes at this point of the mid-surface, without their shape in ζ.
    fn plane_values(&self) -> [f64; PLANE.len()] {
        PLANE.map(|mode| mode.value([self.xi, self.eta, 1.0]))
    }

    /// In-plane stretches of the column, if the element has such modes. They are constant through the thickness,
    /// hence scaled by the mean of det J.
    fn stretch(&self, alpha: &[f64], mean: f64) -> Result<Option<Stretch<'a>>, PointFailure> {
        let [along, across] = match alpha[THICKNESS_MODES..] {
            [along, across] => [along, across],
            _ => return Ok(None),
        };
        let det_ratio = self.shape.centre.1 / mean;
        let stretch =
            self.shape.axes.stretched([self.xi * det_ratio, self.eta * det_ratio], [along, across]);
        stretch.map(Some).map_err(|ratio| PointFailure {
            point: self.index * self.shape.rule.len(),
            reason: FailureReason::Inverted { ratio },
        })
    }

    /// Adds the stresses and stiffnesses of the points to the element.
    pub(super) fn add<const M: usize>(
        &self,
        totals: &Totals,
        sums: &mut Sums<M>,
        out: &mut ElementMatrices,
    ) {
        let at = (self.xi, self.eta);
        out.elastic_energy += totals.elastic_energy;
        out.plastic_work += totals.plastic_work;
        out.thickness_force += totals.stress[9];
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

    /// Adds residual and stiffness of the modes: thickness modes with their values at this point, stretches with
    /// factor 1.
    fn add_modes<const M: usize>(
        &self,
        b: &[Row; GENERALISED],
        totals: &Totals,
        sums: &mut Sums<M>,
    ) {
        let own = self.plane_values();
        let direction_and_factor = |k: usize| match k.checked_sub(THICKNESS_MODES) {
            None => (k / own.len(), own[k % own.len()]),
            Some(stretch) => (SHAPES + stretch, 1.0),
        };
        let (mut left, mut right) = ([[0.0; DOFS]; DIRECTIONS], [[0.0; DOFS]; DIRECTIONS]);
        let count = SHAPES + M - THICKNESS_MODES;
        kernels::combine(&totals.left[..count], b, &mut left[..count]);
        kernels::combine(&totals.right[..count], b, &mut right[..count]);
        let modes = &mut sums.modes;
        for k in 0..M {
            let (from, value) = direction_and_factor(k);
            modes.residual[k] += value * totals.residual[from];
            for l in 0..M {
                let (other, factor) = direction_and_factor(l);
                modes.stiffness[k][l] += value * factor * totals.modes[from][other];
            }
            modes.left[k].iter_mut().zip(&left[from]).for_each(|(sum, x)| *sum += value * x);
            modes.right[k].iter_mut().zip(&right[from]).for_each(|(sum, x)| *sum += value * x);
        }
    }
}

/// Thickness strain and unit tensor transformed by the stretch `U`: `Uᵀ e U` and `Uᵀ U`.
fn transformed_by_stretch(gradient: &Mat3, centre: &Mandel66) -> (Mandel, Mandel) {
    let rows = std::array::from_fn(|i| std::array::from_fn(|j| gradient[(j, i)]));
    let thickness_strain = centre.map(|row| row[2]);
    (
        tensor::apply(&tensor::congruence(&rows), &thickness_strain),
        tensor::from_matrix(&(gradient.transpose() * gradient)),
    )
}
