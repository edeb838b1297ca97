//! Accuracy that a scene asks for: a sequence of runs refines its model until the estimated errors are as small.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Largest error that can be asked for as a fraction: a larger one is no statement about the process.
pub const FRACTION_MAX: f64 = 0.5;
/// Smallest error that can be asked for as a fraction. Residual forces, contact and increments are solved to 1e-6; a tenth
/// of the value would ask for less than they give on curved tools.
pub const FRACTION_MIN: f64 = 1e-4;

/// Errors allowed in the results: `kanagata-solve run` refines mesh, layers, points and increments until the estimated
/// errors are below them. At least one is given; other quantities are reported with their estimates.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Accuracy {
    /// Error of the force of every tool whose travel is prescribed: root mean square over these stages, over the largest
    /// force; 0.0001 to 0.5.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force: Option<f64>,
    /// Error of the thickness over the initial thickness: of the minimum, and in the root mean square over the sheet; 0.0001
    /// to 0.5.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub thickness: Option<f64>,
    /// Largest error of the displacement of the border in plan over its largest displacement, 0.0001 to 0.5.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub draw_in: Option<f64>,
    /// As `draw_in` [mm], above 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub draw_in_mm: Option<f64>,
    /// Error of the springback (largest and root mean square of the displacements) over the largest displacement, 0.0001 to
    /// 0.5. A stage must release all tools.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub springback: Option<f64>,
    /// As `springback` [mm], above 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub springback_mm: Option<f64>,
}

impl Accuracy {
    /// The same fraction for force, thickness, draw-in and springback.
    #[must_use]
    pub fn of_all(fraction: f64) -> Self {
        let all = Some(fraction);
        Self { force: all, thickness: all, draw_in: all, springback: all, ..Self::default() }
    }

    /// The first value out of range, or the absence of all: key, what was found, what is allowed.
    ///
    /// # Errors
    /// That value.
    pub fn check(&self) -> Result<(), (String, String, String)> {
        let fractions = [
            ("force", self.force),
            ("thickness", self.thickness),
            ("draw_in", self.draw_in),
            ("springback", self.springback),
        ];
        let lengths = [("draw_in_mm", self.draw_in_mm), ("springback_mm", self.springback_mm)];
        let fits = |x: f64| (FRACTION_MIN..=FRACTION_MAX).contains(&x);
        let bad = fractions.iter().find(|(_, x)| x.is_some_and(|x| !fits(x)));
        if let Some(&(key, Some(x))) = bad {
            let allowed = format!("{FRACTION_MIN} to {FRACTION_MAX}: 0.01 is 1 %");
            return Err((format!("accuracy.{key}"), x.to_string(), allowed));
        }
        let positive = |x: f64| x > 0.0 && x.is_finite();
        let bad = lengths.iter().find(|(_, x)| x.is_some_and(|x| !positive(x)));
        if let Some(&(key, Some(x))) = bad {
            return Err((format!("accuracy.{key}"), x.to_string(), "above 0".into()));
        }
        if fractions.iter().chain(&lengths).all(|(_, x)| x.is_none()) {
            let allowed = "at least one of force, thickness, draw_in, draw_in_mm, springback and springback_mm";
            return Err(("accuracy".into(), "no quantity".into(), allowed.into()));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fractions_and_lengths_have_ranges_and_one_is_needed() {
        assert!(Accuracy::of_all(0.01).check().is_ok());
        assert!(Accuracy { draw_in_mm: Some(0.1), ..Accuracy::default() }.check().is_ok());
        let key = |accuracy: Accuracy| accuracy.check().unwrap_err().0;
        assert_eq!(key(Accuracy::default()), "accuracy");
        for fraction in [0.0, -0.01, 1e-5, 0.6, f64::NAN] {
            assert_eq!(key(Accuracy::of_all(fraction)), "accuracy.force", "{fraction}");
        }
        let negative = Accuracy { springback_mm: Some(-0.1), ..Accuracy::default() };
        assert_eq!(key(negative), "accuracy.springback_mm");
    }
}
