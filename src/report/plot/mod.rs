//! Plots on pages: lines, points and bars over linear or logarithmic axes, as SVG that needs no script. The page's script
//! adds values on hover.

mod chart;
mod svg;
pub(super) mod ticks;

pub use chart::{Axis, Plot, Series, Style};
pub(super) use svg::figure;
