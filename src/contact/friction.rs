//! Coulomb's law at one point: stick or slip, and the residual of the law with its derivatives.
//!
//! | symbol | meaning |
//! |---|---|
//! | `r_t` | tangential force on the sheet [N] |
//! | `lambda` | normal force, positive = compressive [N] |
//! | `s` | slip of the sheet on the tool since the last increment [mm], tangential |
//! | `c` | a stiffness that makes `c s` a force; the solution does not depend on it |
//! | `tau` | trial force `r_t - c s` (Alart & Curnier 1991) |
//! | `lambda*`, `r_t*` | forces about which the law is linearised: those predicted by the last correction |
//!
//! Stick while `|tau| <= mu lambda`: then `s = 0`. Otherwise slip: `r_t = mu lambda tau / |tau|`; at a solution `tau`
//! is parallel to `r_t` and thus to `-s`. This is the law without regularisation. With regularisation (default) the
//! force increases over a short slip and equals Coulomb's from there on ([`Coulomb::weight`]).

use kanagata_geometry::{Mat3, Vec3};

/// Coulomb's law with one coefficient.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coulomb {
    /// Friction coefficient, >= 0.
    pub mu: f64,
    /// Regularisation slip [mm]: the force equals Coulomb's from a slip of [`COULOMB_SLIP_RATIO`] times this value on.
    /// 0: stick and slip without regularisation.
    pub transition: f64,
}

/// Ratio of the slip to the regularisation slip from which on the force equals Coulomb's.
pub const COULOMB_SLIP_RATIO: f64 = 5.0;

/// State of one contact point; all vectors are tangential.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrictionPoint {
    /// Normal force [N].
    pub lambda: f64,
    /// Tangential force on the sheet [N].
    pub traction: Vec3,
    /// Slip since the last increment [mm].
    pub slip: Vec3,
    /// Scaling stiffness [N/mm], > 0.
    pub stiffness: f64,
    /// Normal and tangential force about which the regularised law is linearised [N]; without a tangential force, that
    /// of the law at this slip.
    pub about: (f64, Option<Vec3>),
}

/// Residual and derivatives at a slipping point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slip {
    /// Residual `r_t - mu lambda tau / |tau|` [N], which must vanish.
    pub residual: Vec3,
    /// Residual of the linearisation at this point [N]; equal to the residual for a linearisation about this point.
    pub linear: Vec3,
    /// Derivative with respect to the traction.
    pub by_traction: Mat3,
    /// Derivative with respect to the slip [N/mm].
    pub by_slip: Mat3,
    /// Derivative with respect to the normal force.
    pub by_lambda: Vec3,
}

impl Coulomb {
    /// Law in terms of the part of the normal force in the free directions, which is the fraction `normal_fraction`.
    #[must_use]
    pub fn with_normal_fraction(self, normal_fraction: f64) -> Self {
        Self { mu: self.mu / normal_fraction, ..self }
    }

    /// The law at a slipping point; `None` where it sticks, `s = 0`.
    ///
    /// Derivatives are exact while `0 <= lambda` and `mu lambda <= |tau|`. For a negative normal force (an intermediate
    /// iterate) only the bounded terms are kept.
    #[must_use]
    pub fn law(&self, at: &FrictionPoint) -> Option<Slip> {
        if self.transition > 0.0 {
            return Some(self.smoothed(at));
        }
        let tau = at.traction - at.slip * at.stiffness;
        let size = tau.norm();
        let bound = self.mu * at.lambda;
        if self.mu > 0.0 && size <= bound.max(0.0) {
            return None;
        }
        if self.mu == 0.0 || size == 0.0 {
            return Some(Slip {
                residual: at.traction,
                linear: at.traction,
                by_traction: Mat3::identity(),
                by_slip: Mat3::zeros(),
                by_lambda: Vec3::zeros(),
            });
        }
        let direction = tau / size;
        let turn = (Mat3::identity() - direction * direction.transpose()) * (bound / size).max(0.0);
        let residual = at.traction - direction * bound;
        Some(Slip {
            residual,
            linear: residual,
            by_traction: Mat3::identity() - turn,
            by_slip: turn * at.stiffness,
            by_lambda: -direction * self.mu,
        })
    }
}

impl Coulomb {
    /// Weight `w` [mm] of the regularised law, `r_t = -mu lambda s / w`, and its gradient with respect to the slip:
    /// `k sqrt(|s|^2 + transition^2)`, or `|s|` where that is larger, from [`COULOMB_SLIP_RATIO`] transitions on.
    #[must_use]
    pub fn weight(&self, slip: &Vec3) -> (f64, Vec3) {
        /// At the limit, to within rounding, the force counts as increasing.
        const LIMIT_TOLERANCE: f64 = 1.0 + 1e-6;
        let (size, k) = (slip.norm(), COULOMB_SLIP_RATIO / COULOMB_SLIP_RATIO.hypot(1.0));
        let rising = k * size.hypot(self.transition);
        let gradient = if size > LIMIT_TOLERANCE * rising {
            slip / size
        } else if rising > 0.0 {
            slip * (k * k / rising)
        } else {
            Vec3::zeros()
        };
        (size.max(rising), gradient)
    }

    /// The regularised law: no point sticks completely; small slip is resisted by a proportional force.
    ///
    /// The residual is `r_t + mu lambda s / w` ([`Self::weight`]). Its derivative with respect to the slip vanishes for
    /// `|s|` above the transition, and Newton's method then oscillates between slip directions. Therefore the
    /// derivatives are those of the equivalent form `w r_t + mu lambda s = 0`, divided by `w` (primal-dual method of
    /// Chan, Golub & Mulet 1999 for total variation). They are equal where the law is satisfied, and stiff where `r_t`
    /// indicates stick. `r_t` is limited to Coulomb's bound in them.
    ///
    /// The residual force of an iterate is inaccurate wherever the sheet is stiff. The derivatives therefore use
    /// `lambda*` and `r_t*`, which are independent dual unknowns.
    #[must_use]
    pub fn smoothed(&self, at: &FrictionPoint) -> Slip {
        let (weight, gradient) = self.weight(&at.slip);
        let direction = if weight > 0.0 { at.slip / weight } else { Vec3::zeros() };
        let (lambda, traction) = at.about;
        let bound = (self.mu * lambda).max(0.0);
        let traction = traction.unwrap_or(direction * -bound);
        let size = traction.norm();
        let held = if size > bound { traction * (bound / size) } else { traction };
        let by_lambda = if lambda >= 0.0 { direction * self.mu } else { Vec3::zeros() };
        Slip {
            residual: at.traction + direction * (self.mu * at.lambda).max(0.0),
            linear: at.traction + by_lambda * at.lambda,
            by_traction: Mat3::identity(),
            by_slip: (Mat3::identity() * bound + held * gradient.transpose()) / weight,
            by_lambda,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(traction: [f64; 2], slip: [f64; 2], lambda: f64) -> FrictionPoint {
        FrictionPoint {
            lambda,
            traction: Vec3::new(traction[0], traction[1], 0.0),
            slip: Vec3::new(slip[0], slip[1], 0.0),
            stiffness: 50.0,
            about: (lambda, Some(Vec3::new(traction[0], traction[1], 0.0))),
        }
    }

    fn residual(law: &Coulomb, at: &FrictionPoint) -> Vec3 {
        law.law(at).expect("the test point slips").residual
    }

    #[test]
    fn slip_opposes_motion_with_the_full_bound() {
        let law = Coulomb { mu: 0.2, transition: 0.0 };
        let slip = Vec3::new(0.3, -0.4, 0.0);
        let at = point([-0.2 * 10.0 * 0.6, 0.2 * 10.0 * 0.8], [slip.x, slip.y], 10.0);
        assert!(residual(&law, &at).norm() < 1e-15);
        assert_eq!(law.law(&point([1.0, 0.0], [0.0, 0.0], 10.0)), None);
        assert!(law.law(&point([2.1, 0.0], [0.0, 0.0], 10.0)).is_some());
    }

    /// Compares the derivatives of the law with central differences of `residual`.
    fn assert_derivatives(
        law: &Coulomb,
        at: FrictionPoint,
        residual: impl Fn(&FrictionPoint) -> Vec3,
    ) {
        let Slip { by_traction, by_slip, by_lambda, .. } = law.law(&at).unwrap();
        let h = 1e-6;
        let by = |change: &dyn Fn(&mut FrictionPoint, f64)| {
            let (mut plus, mut minus) = (at, at);
            change(&mut plus, h);
            change(&mut minus, -h);
            (residual(&plus) - residual(&minus)) / (2.0 * h)
        };
        for k in 0..2 {
            assert!((by(&|p, d| p.traction[k] += d) - by_traction.column(k)).norm() < 1e-8);
            assert!((by(&|p, d| p.slip[k] += d) - by_slip.column(k)).norm() < 1e-6);
            assert!((by(&|p, d| p.lambda += d) - by_lambda).norm() < 1e-8);
        }
    }

    #[test]
    fn derivatives_agree_with_differences() {
        let law = Coulomb { mu: 0.3, transition: 0.0 };
        assert_derivatives(&law, point([1.0, -2.0], [-0.08, 0.05], 11.0), |p| residual(&law, p));
    }

    #[test]
    fn derivatives_with_a_transition_are_those_of_the_weighted_law() {
        let law = Coulomb { mu: 0.3, transition: 0.02 };
        let weight = |p: &FrictionPoint| law.weight(&p.slip).0;
        let points =
            [([1.0, -2.0], [-0.08, 0.05]), ([-0.4, 0.3], [1e-3, 2e-3]), ([1.0, -2.0], [-0.8, 0.5])];
        for (traction, slip) in points {
            let at = point(traction, slip, 11.0);
            assert_derivatives(&law, at, |p| residual(&law, p) * weight(p) / weight(&at));
        }
    }

    #[test]
    fn a_point_that_an_iterate_pulls_keeps_the_friction_of_the_force_foretold() {
        let law = Coulomb { mu: 0.3, transition: 0.02 };
        let pulled = point([0.5, 0.1], [-0.08, 0.05], -2.0);
        let apart = law.law(&pulled).unwrap();
        assert_eq!((apart.linear, apart.by_slip.norm()), (pulled.traction, 0.0));
        let pressed = point([1.0, -0.6], [-0.08, 0.05], 11.0);
        let (kept, there) = (
            law.law(&FrictionPoint { about: pressed.about, ..pulled }).unwrap(),
            law.law(&pressed).unwrap(),
        );
        // The residual does not depend on the predicted force; the derivatives are those at the predicted force.
        assert_eq!(kept.residual, apart.residual);
        assert_eq!((kept.by_slip, kept.by_lambda), (there.by_slip, there.by_lambda));
        assert_eq!(kept.linear, pulled.traction + there.by_lambda * pulled.lambda);
        // Without a tangential force that of the law is used: no stiffness along the slip.
        let own = law.law(&FrictionPoint { about: (11.0, None), ..pressed }).unwrap();
        let along = pressed.slip.normalize();
        let held = along.dot(&(own.by_slip * along)) * pressed.slip.norm();
        assert!((0.0..0.1 * 0.3 * 11.0).contains(&held), "{held}");
    }

    #[test]
    fn the_force_is_coulombs_from_the_end_of_its_rise_on() {
        let law = Coulomb { mu: 0.3, transition: 0.02 };
        let fraction = |size: f64| size / law.weight(&Vec3::new(0.0, size, 0.0)).0;
        for over in [1.0, 1.001, 3.0, 1e6] {
            assert!(
                (fraction(COULOMB_SLIP_RATIO * law.transition * over) - 1.0).abs() < 1e-15,
                "{over}"
            );
        }
        let mut before = 0.0;
        for step in 1..=100 {
            let now = fraction(COULOMB_SLIP_RATIO * law.transition * f64::from(step) / 100.0);
            assert!(now > before, "{step}: {now}");
            before = now;
        }
    }

    #[test]
    fn a_point_that_sticks_is_found_from_far_away() {
        // A spring pulls the point with a force below Coulomb's bound, within the regularisation.
        let (stiffness, pull, bound) = (50.0, 2.0, 3.0);
        for transition in [1e-3, 1e-6, 1e-9] {
            let law = Coulomb { mu: 0.3, transition };
            for start in [0.3, -0.3, 0.02] {
                let mut slip = start;
                let mut iterations = 0;
                loop {
                    let at = point([stiffness * slip - pull, 0.0], [slip, 0.0], bound / law.mu);
                    let Slip { residual, linear, by_slip, .. } = law.law(&at).unwrap();
                    if residual.x.abs() < 1e-9 * bound {
                        break;
                    }
                    assert!(iterations < 20, "transition {transition}, from {start}: {slip}");
                    slip -= linear.x / (stiffness + by_slip[(0, 0)]);
                    iterations += 1;
                }
                let carried = bound * slip / law.weight(&Vec3::new(slip, 0.0, 0.0)).0;
                assert!((carried + stiffness * slip - pull).abs() < 1e-8);
            }
        }
    }
}
