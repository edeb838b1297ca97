//! Rational B-spline curves and surfaces: construction, evaluation, subdivision, point projection.

mod arc;
mod basis;
mod bezier;
mod curve;
mod derivs;
mod distance_form;
mod error;
mod fit;
mod foot;
mod isoline;
mod net;
pub mod newton;
mod normal;
mod prepared;
mod project;
mod projector;
mod search_budget;
mod spans;
mod surface;
mod sweep;

pub use curve::{Curve, Curve2, Curve3, CurveDerivs};
pub use derivs::SurfaceDerivs;
pub use error::NurbsError;
pub use foot::NearFoot;
pub use isoline::{FirstDerivs, Isoline};
pub use newton::newton_step;
pub use projector::{CurveProjector, SurfaceProjector};
pub use search_budget::SearchBudget;
pub use surface::Surface;

#[cfg(test)]
mod projection_tests;
#[cfg(test)]
mod tests;
