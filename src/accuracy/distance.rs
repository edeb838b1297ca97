//! Values of the quantities, and distances between two runs.

use super::quantities::{BorderCurve, ForceCurve, Results};
use kanagata_geometry::Vec2;
use kanagata_scene::accuracy::Accuracy;

/// A compared quantity.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Quantity {
    /// Force of a tool whose travel is prescribed.
    Force(String),
    /// Thickness at the end.
    Thickness,
    /// Displacement of the border in plan.
    DrawIn,
    /// Displacement in springback.
    Springback,
}

/// Points at which two force curves are compared in each stage: more than its increments, so that sawteeth of nodes that pass
/// radii are seen. Twice as many compare the same straight pieces again.
const FORCE_POINTS: usize = 400;

/// Displacement over the thickness below which it is judged as if it were as large: a clamped border moves by rounding only.
const NEGLIGIBLE_REL: f64 = 0.01;

impl Quantity {
    /// The quantities of a run.
    pub(super) fn of(results: &Results) -> Vec<Self> {
        let forces = results.forces.iter().map(|curve| Self::Force(curve.tool.clone()));
        let border = (!results.border.is_empty()).then_some(Self::DrawIn);
        let springback = results.springback.map(|_| Self::Springback);
        forces.chain([Self::Thickness]).chain(border).chain(springback).collect()
    }

    /// Name in records.
    pub(super) fn name(&self) -> String {
        match self {
            Self::Force(tool) => format!("force.{tool}"),
            Self::Thickness => "thickness".into(),
            Self::DrawIn => "draw_in".into(),
            Self::Springback => "springback".into(),
        }
    }

    /// Unit of value and distance.
    pub(super) fn unit(&self) -> &'static str {
        if matches!(self, Self::Force(_)) { "N" } else { "mm" }
    }

    /// Largest force in the stages that prescribe the travel, minimum thickness, largest displacement of the border,
    /// largest displacement in springback.
    pub(super) fn value(&self, results: &Results) -> Option<f64> {
        match self {
            Self::Force(tool) => Some(curve(results, tool)?.largest()),
            Self::Thickness => results.thickness.smallest(),
            Self::DrawIn => results.border.iter().map(|p| p.1.norm()).reduce(f64::max),
            Self::Springback => results.springback.map(|s| s[0]),
        }
    }

    /// What the process makes of the quantity: its value, of the thickness its change.
    pub(super) fn effect(&self, results: &Results) -> Option<f64> {
        let value = self.value(results)?;
        let initial = if *self == Self::Thickness { results.initial_mm } else { 0.0 };
        Some((value - initial).abs())
    }

    /// Error that is allowed for results of this size; `None` if none is asked for.
    pub(super) fn allowed(&self, accuracy: &Accuracy, results: &Results) -> Option<f64> {
        let value = self.value(results)?.abs();
        let size = value.max(NEGLIGIBLE_REL * results.initial_mm);
        let of = |fraction: Option<f64>, length: Option<f64>| {
            let relative = fraction.map(|f| f * size);
            relative.into_iter().chain(length).reduce(f64::min)
        };
        match self {
            Self::Force(_) => accuracy.force.map(|f| f * value),
            Self::Thickness => accuracy.thickness.map(|f| f * results.initial_mm),
            Self::DrawIn => of(accuracy.draw_in, accuracy.draw_in_mm),
            Self::Springback => of(accuracy.springback, accuracy.springback_mm),
        }
    }

    /// Distance of two runs: root mean square of the difference of the force curves; the larger of the difference of the
    /// minimum thickness and the root mean square over the sheet; largest difference of the displacements of the border;
    /// larger difference of both values of springback. `None` where one of them lacks the quantity.
    pub(super) fn distance(&self, one: &Results, other: &Results) -> Option<f64> {
        match self {
            Self::Force(tool) => curve(one, tool)?.rms_difference(curve(other, tool)?),
            Self::Thickness => {
                let least = one.thickness.smallest()? - other.thickness.smallest()?;
                Some(least.abs().max(one.thickness.rms_difference(&other.thickness)?))
            }
            Self::DrawIn => border_difference(&one.border, &other.border),
            Self::Springback => {
                let (a, b) = (one.springback?, other.springback?);
                Some((a[0] - b[0]).abs().max((a[1] - b[1]).abs()))
            }
        }
    }
}

fn curve<'a>(results: &'a Results, tool: &str) -> Option<&'a ForceCurve> {
    results.forces.iter().find(|curve| curve.tool == tool)
}

impl ForceCurve {
    /// Force at a process time [N], linear between increments.
    fn at(&self, time: f64) -> f64 {
        let after =
            self.points.partition_point(|p| p[0] < time).clamp(1, self.points.len().max(2) - 1);
        let (Some([t0, f0]), Some([t1, f1])) = (self.points.get(after - 1), self.points.get(after))
        else {
            return self.points.first().map_or(0.0, |p| p[1]);
        };
        let share = if t1 > t0 { ((time - t0) / (t1 - t0)).clamp(0.0, 1.0) } else { 1.0 };
        f0 + share * (f1 - f0)
    }

    /// The force of largest magnitude in its stages [N].
    fn largest(&self) -> f64 {
        let inside = |t: f64| self.stages.iter().any(|[from, to]| t > *from && t <= *to);
        let forces = self.points.iter().filter(|p| inside(p[0])).map(|p| p[1]);
        forces.max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0)
    }

    /// Root mean square over its stages of the difference to another curve [N].
    fn rms_difference(&self, other: &Self) -> Option<f64> {
        let times = self.stages.iter().flat_map(|[from, to]| {
            (1..=FORCE_POINTS).map(move |k| from + (to - from) * k as f64 / FORCE_POINTS as f64)
        });
        let (mut sum, mut count) = (0.0, 0);
        for time in times {
            sum += (self.at(time) - other.at(time)).powi(2);
            count += 1;
        }
        (count > 0).then(|| (sum / f64::from(count)).sqrt())
    }
}

/// Largest difference of the displacements of two borders, at the points of the coarser one [mm].
fn border_difference(one: &BorderCurve, other: &BorderCurve) -> Option<f64> {
    let (coarse, fine) = if one.len() <= other.len() { (one, other) } else { (other, one) };
    let at = |share: f64| -> Option<Vec2> {
        let after = fine.partition_point(|p| p.0 < share).clamp(1, fine.len().max(2) - 1);
        let (a, b) = (fine.get(after - 1)?, fine.get(after)?);
        let along = if b.0 > a.0 { ((share - a.0) / (b.0 - a.0)).clamp(0.0, 1.0) } else { 1.0 };
        Some(a.1 + (b.1 - a.1) * along)
    };
    let differences = coarse.iter().filter_map(|(share, u)| Some((u - at(*share)?).norm()));
    differences.reduce(f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn force(points: &[[f64; 2]]) -> ForceCurve {
        ForceCurve { tool: "punch".into(), stages: vec![[1.0, 2.0]], points: points.to_vec() }
    }

    #[test]
    fn force_curves_are_compared_in_the_stages_that_prescribe_the_travel() {
        // 5 N in the first stage do not count; a triangle of height 3 has the root mean square 3 / sqrt(3).
        let one = force(&[[0.0, 0.0], [1.0, 5.0], [2.0, 10.0]]);
        let other = force(&[[0.0, 0.0], [1.0, 5.0], [2.0, 13.0]]);
        let distance = one.rms_difference(&other).unwrap();
        assert!((distance - 3.0_f64.sqrt()).abs() < 0.01, "{distance}");
        assert_eq!((one.largest(), other.largest()), (10.0, 13.0));
        let pushed_back = force(&[[0.0, 0.0], [1.5, -20.0], [2.0, 13.0]]);
        assert_eq!(pushed_back.largest(), -20.0);
    }

    #[test]
    fn borders_are_compared_as_vectors_at_the_coarser_points() {
        let border = |n: usize| -> BorderCurve {
            (0..=n).map(|k| k as f64 / n as f64).map(|s| (s, Vec2::new(s, -1.0))).collect()
        };
        assert!(border_difference(&border(3), &border(8)).unwrap() < 1e-12);
        let turned: BorderCurve =
            border(8).iter().map(|(s, u)| (*s, Vec2::new(u.x, 2.0))).collect();
        assert!((border_difference(&border(3), &turned).unwrap() - 3.0).abs() < 1e-12);
        assert_eq!(border_difference(&border(3), &Vec::new()), None);
    }

    #[test]
    fn allowed_errors_follow_the_size_of_the_quantity() {
        let results = Results {
            forces: vec![force(&[[0.0, 0.0], [2.0, 200.0]])],
            initial_mm: 0.8,
            border: vec![(0.0, Vec2::new(3.0, 4.0))],
            springback: Some([2.0, 1.0]),
            ..Results::default()
        };
        let accuracy = Accuracy { draw_in_mm: Some(0.02), ..Accuracy::of_all(0.01) };
        let allowed: Vec<f64> =
            Quantity::of(&results).iter().filter_map(|q| q.allowed(&accuracy, &results)).collect();
        // Thickness has no value in an empty field.
        assert_eq!(allowed, [2.0, 0.02, 0.02]);
        let none = Accuracy { force: Some(0.01), ..Accuracy::default() };
        assert_eq!(Quantity::Springback.allowed(&none, &results), None);
    }
}
