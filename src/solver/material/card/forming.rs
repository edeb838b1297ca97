//! Formability of a card: uniform strain, strain-hardening exponent, forming limit diagram.

use super::{CardError, MaterialCard};
use crate::material::forming_limit::{Diagram, LimitCurve};

/// Engineering strains between which ISO 10275 determines the strain-hardening exponent, if the sheet strains uniformly
/// so far.
const EXPONENT_STRAINS: [f64; 2] = [0.1, 0.2];
/// Points of the regression for the exponent: half a per cent of strain apart. A power law has its exponent with any number
/// of points.
const EXPONENT_POINTS: usize = 21;

impl MaterialCard {
    /// Uniform plastic strain in tension along the rolling direction (Considère): the slope of the tension curve equals
    /// its stress. `None` for an elastic card, and if the strain is 0 or above 2.
    #[must_use]
    pub fn uniform_strain(&self) -> Option<f64> {
        let excess = |p: f64| self.tension(p).map_or(0.0, |(stress, slope)| slope - stress);
        let (mut low, mut high) = (0.0, 2.0);
        if !(excess(low) > 0.0 && excess(high) < 0.0) {
            return None;
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if excess(middle) > 0.0 { low = middle } else { high = middle }
        }
        Some(low)
    }

    /// Strain-hardening exponent n of the hardening law: slope of the logarithm of the stress over that of the plastic
    /// strain in tension (ISO 10275).
    ///
    /// The regression is over engineering strains from 10 to 20 %, at most up to the uniform strain; if that is shorter
    /// than 10 %, over its second half. `None` for a card that does not harden.
    #[must_use]
    pub fn strain_hardening_exponent(&self) -> Option<f64> {
        let uniform = self.uniform_strain().unwrap_or(2.0);
        let [first, last] = EXPONENT_STRAINS.map(f64::ln_1p);
        let last = last.min(uniform);
        let first = if first < last { first } else { 0.5 * last };
        let step = (last - first) / (EXPONENT_POINTS - 1) as f64;
        let (mut xs, mut ys, mut xx, mut xy) = (0.0, 0.0, 0.0, 0.0);
        for k in 0..EXPONENT_POINTS {
            let strain = first + step * k as f64;
            let (x, y) = (strain.ln(), self.tension(strain)?.0.ln());
            (xs, ys, xx, xy) = (xs + x, ys + y, xx + x * x, xy + x * y);
        }
        let count = EXPONENT_POINTS as f64;
        Some((count * xy - xs * ys) / (count * xx - xs * xs)).filter(|n| *n > 0.0)
    }

    /// The forming limit curve of a sheet of initial `thickness` [mm], if the card has one.
    ///
    /// # Errors
    /// [`CardError::FormingLimit`] for a value out of range.
    pub fn limit_curve(&self, thickness: f64) -> Result<Option<LimitCurve>, CardError> {
        let Some(limit) = &self.forming_limit else { return Ok(None) };
        let curve = limit.curve(thickness, self.strain_hardening_exponent());
        curve.map(Some).map_err(|cause| CardError::FormingLimit { name: self.name.clone(), cause })
    }

    /// The forming limit diagram of a sheet of initial `thickness` [mm], with the mean r value of the yield function (1
    /// for an elastic card).
    ///
    /// # Errors
    /// [`CardError`] for a value out of range.
    pub fn diagram(&self, thickness: f64) -> Result<Diagram, CardError> {
        let r = self.yield_function()?.map_or(1.0, |function| {
            let at = |degrees: f64| function.r_value(degrees.to_radians());
            0.25 * (at(0.0) + 2.0 * at(45.0) + at(90.0))
        });
        // A convex yield surface may have negative r values; no sheet has.
        Ok(Diagram::new(self.limit_curve(thickness)?, r.max(0.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::card::find;
    use crate::material::forming_limit::{FormingLimit, Zone};
    use crate::material::hardening::Hardening;

    #[test]
    fn the_exponent_of_a_power_law_is_its_own() {
        let steel = find("sheet-ssnv501").unwrap();
        let with = |law| MaterialCard { hardening: Some(law), ..steel.clone() };
        let power = with(Hardening::Swift { k: 500.0, eps0: 1e-9, n: 0.21 });
        assert!((power.strain_hardening_exponent().unwrap() - 0.21).abs() < 1e-7);
        // Swift's shift lowers it: n = N p / (eps0 + p).
        let shifted = with(Hardening::Swift { k: 529.5, eps0: 0.00439, n: 0.268 });
        let n = shifted.strain_hardening_exponent().unwrap();
        assert!((n - 0.268 * 0.138 / 0.1424).abs() < 1e-3, "{n}");
        // Uniform strain of 5 %: regression between 2.5 and 5 %.
        let short = with(Hardening::Swift { k: 900.0, eps0: 1e-9, n: 0.05 });
        assert!((short.strain_hardening_exponent().unwrap() - 0.05).abs() < 1e-6);
        let flat = with(Hardening::Voce { sigma0: 200.0, q: 0.0, b: 0.0 });
        assert_eq!(flat.strain_hardening_exponent(), None);
    }

    #[test]
    fn a_card_has_its_curve_and_the_tension_path_of_its_r_values() {
        let mut steel = find("mild-steel-numisheet93").unwrap();
        steel.forming_limit = Some(FormingLimit::KeelerBrazier { n: None });
        let n = steel.strain_hardening_exponent().unwrap();
        assert!((0.21..0.26).contains(&n), "{n}");
        let curve = steel.limit_curve(0.78).unwrap().unwrap();
        let plane = (0.233 + 0.1413 * 0.78_f64).ln_1p();
        assert!((curve.major_at(0.0) - plane).abs() < 1e-14);
        // r = (1.79 + 2 * 1.51 + 2.27) / 4 = 1.77: tension at minor = -0.639 major.
        let diagram = steel.diagram(0.78).unwrap();
        assert_eq!(diagram.zone(-0.125, 0.2), Zone::Safe);
        assert_eq!(diagram.zone(-0.130, 0.2), Zone::WrinklingTendency);
        steel.forming_limit = None;
        assert_eq!(steel.limit_curve(0.78).unwrap(), None);
    }

    #[test]
    fn a_limit_out_of_range_is_refused_when_the_card_is_built() {
        let mut steel = find("mild-steel-numisheet93").unwrap();
        steel.forming_limit = Some(FormingLimit::KeelerBrazier { n: Some(2.0) });
        let error = steel.build(0.0).unwrap_err().to_string();
        let expected = "material 'mild-steel-numisheet93', forming_limit.n: found 2; allowed";
        assert!(error.starts_with(expected), "{error}");
        (steel.criterion, steel.hardening) = (None, None);
        assert_eq!(steel.build(0.0).unwrap_err().to_string(), error);
        steel.forming_limit = Some(FormingLimit::KeelerBrazier { n: None });
        assert!(steel.build(0.0).unwrap_err().to_string().contains("n: found none"));
    }
}
