//! Materials: small-strain laws in logarithmic strain space, extended to finite strain by [`log_strain`].
//!
//! A law computes from the logarithmic strain `E = ½ ln C` (material axes, Mandel vector) and the history of a point
//! the conjugate stress `T` [MPa], the consistent tangent `dT/dE` [MPa] and the new history.

#![allow(
    clippy::needless_range_loop,
    reason = "loops over components and nodes follow the formulas' indices"
)]

pub mod at_yield;
pub mod card;
pub mod corotational;
mod eigen;
pub mod elastic;
mod error;
pub mod fit;
pub mod foreseen;
pub mod forming_limit;
pub mod hardening;
pub mod hill48;
mod law;
pub mod log_strain;
pub mod plastic;
mod turned;
pub mod yield_function;
pub mod yld2004;

pub use self::error::MaterialDataError;
pub use self::law::{
    HistoryLayout, LogResponse, LogResponses, LogState, Material, MaterialError, PointState,
};
pub(crate) use self::turned::RotatedLaw;
