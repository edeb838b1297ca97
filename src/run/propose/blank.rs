//! Outline and elements of the blank.

use super::GivenTool;
use super::roles::bounds;
use super::symmetry::Cut;
use crate::advice::radii::{sharpest_of, wanted_length};
use kanagata_geometry::Aabb;

/// Smallest and largest number of elements along the longer side. More take minutes in a first run.
const ELEMENTS: [f64; 2] = [20.0, 80.0];
/// Part of the travel by which the blank extends beyond the punch: the wall, its radii and a flange.
const BEYOND_PUNCH: f64 = 1.3;

/// Outline in plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Outline {
    /// Corner and size [mm], elements along x and y.
    Rectangle { corner: [f64; 2], size: [f64; 2], elements: [usize; 2] },
    /// Quarter of a disc about the origin.
    QuarterDisc { radius: f64, core: usize, rings: usize },
    /// Disc about the origin.
    Disc { radius: f64, core: usize, rings: usize },
}

impl Outline {
    /// Area of the whole blank [mm^2]; `parts`: number of its symmetric parts.
    pub(super) fn area(&self, parts: usize) -> f64 {
        use std::f64::consts::PI;
        match self {
            Self::Rectangle { size, .. } => size[0] * size[1] * parts as f64,
            Self::QuarterDisc { radius, .. } | Self::Disc { radius, .. } => PI * radius * radius,
        }
    }
}

/// A rectangle that reaches beyond the punch by the wall and a flange, and no farther than the die and the tool that carries
/// it. Of a strip the elements along x follow from its length along x alone.
pub(super) fn rectangle(
    [die, punch, carrier]: [&GivenTool; 3],
    cuts: &[Cut],
    travel: f64,
    (length, strip): (Option<f64>, bool),
) -> Outline {
    let (inner, die, carrier) = (bounds(punch), bounds(die), bounds(carrier));
    let outer = Aabb { min: die.min.sup(&carrier.min), max: die.max.inf(&carrier.max) };
    let (mut corner, mut size) = ([0.0; 2], [0.0; 2]);
    for axis in 0..2 {
        let cut = cuts.iter().find(|cut| cut.axis == axis);
        let beyond = BEYOND_PUNCH * travel;
        let low = (inner.min[axis] - beyond).max(outer.min[axis]);
        let high = (inner.max[axis] + beyond).min(outer.max[axis]);
        let (low, high) = match cut {
            Some(Cut { at, side, .. }) if *side > 0.0 => (*at, high),
            Some(Cut { at, .. }) => (low, *at),
            None => (low, high),
        };
        (corner[axis], size[axis]) = (low, rounded(high - low, 0.5));
    }
    let longer = if strip { size[0] } else { size[0].max(size[1]) };
    let length = length.unwrap_or(longer / 40.0).clamp(longer / ELEMENTS[1], longer / ELEMENTS[0]);
    let elements = size.map(|size| (size / length).ceil().max(1.0) as usize);
    Outline::Rectangle { corner, size, elements }
}

/// A disc whose area is that of the bottom and the wall of a cup of the punch's radius r and the travel h:
/// `sqrt(r^2 + 2 r h)`, and no farther than the die and the tool that carries it.
pub(super) fn disc(
    [die, punch, carrier]: [&GivenTool; 3],
    quarter: bool,
    travel: f64,
    length: Option<f64>,
) -> Outline {
    let radius = |tool: &GivenTool| {
        let Aabb { min, max } = bounds(tool);
        min.x.abs().max(max.x.abs())
    };
    let r = radius(punch);
    let whole =
        (r * r + 2.0 * BEYOND_PUNCH * r * travel).sqrt().min(radius(carrier)).min(radius(die));
    let radius = rounded(whole, 0.5);
    let length = length.unwrap_or(radius / 25.0).clamp(2.0 * radius / ELEMENTS[1], radius / 10.0);
    let count = |part: f64| (part * radius / length).ceil().max(2.0) as usize;
    let (core, rings) = (count(0.35), count(0.65));
    if quarter {
        Outline::QuarterDisc { radius, core, rings }
    } else {
        Outline::Disc { radius, core, rings }
    }
}

/// Element length that represents the smallest radius of the tools well [mm], as the check of a scene asks for; `None` if
/// all are flat.
pub(super) fn element_length(tools: &[GivenTool], thickness: f64) -> Option<f64> {
    let radius = tools.iter().map(|tool| sharpest_of(&tool.surface)).fold(f64::INFINITY, f64::min);
    radius.is_finite().then(|| wanted_length(radius, thickness))
}

/// A number rounded down to a multiple of a step, at least one step.
pub(super) fn rounded(value: f64, step: f64) -> f64 {
    let steps = (value / step * (1.0 + 1e-9)).floor().max(1.0);
    steps * step
}

/// Two significant digits.
pub(super) fn two_digits(value: f64) -> f64 {
    let unit = 10_f64.powf(value.log10().floor() - 1.0);
    (value / unit).round() * unit
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_rounded_as_written() {
        assert_eq!((rounded(84.99, 0.5), rounded(0.1, 0.5), rounded(85.0, 0.5)), (84.5, 0.5, 85.0));
        assert_eq!((two_digits(72_512.0), two_digits(1_049.0)), (73_000.0, 1000.0));
    }
}
