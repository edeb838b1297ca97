//! Evaluation of one patch, whatever its kind.

use crate::geometry::Vec3;

/// Point and derivatives of a patch at `(eta, zeta)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PatchDerivs {
    /// Point S [mm].
    pub s: Vec3,
    /// `S_eta`.
    pub d1: Vec3,
    /// `S_zeta`.
    pub d2: Vec3,
    /// `S_eta_eta`.
    pub d11: Vec3,
    /// `S_eta_zeta`.
    pub d12: Vec3,
    /// `S_zeta_zeta`.
    pub d22: Vec3,
}

/// A patch ready for evaluation. `S_eta x S_zeta` points out of the tool, to the sheet.
#[derive(Debug, Clone, PartialEq)]
pub enum Patch {
    /// Triangular Nagata patch: `c00 c10 c01 c11 c20 c02` of Eq. 9, on `0 <= zeta <= eta <= 1`.
    Triangle([Vec3; 6]),
    /// Quadrilateral Nagata patch: `c00 c10 c01 c11 c20 c02 c21 c12` of Eq. 11, on the unit square.
    Quad([Vec3; 8]),
    /// Bezier patch of Eq. 1: degrees along eta and zeta (1 to 6), control point (i, j) at
    /// `i * (degrees[1] + 1) + j`, on the unit square.
    Bezier {
        /// Degrees along eta and zeta.
        degrees: [usize; 2],
        /// Control points [mm].
        points: Vec<Vec3>,
    },
}

impl Patch {
    /// Point and derivatives; `(eta, zeta)` need not lie inside the domain.
    #[must_use]
    pub fn derivs(&self, eta: f64, zeta: f64) -> PatchDerivs {
        let _ = (eta, zeta);
        unimplemented!("tool: patch evaluation")
    }

    /// Unit normal `S_eta x S_zeta / |.|` (Eq. 23); `None` where the patch is degenerate.
    #[must_use]
    pub fn normal(&self, eta: f64, zeta: f64) -> Option<Vec3> {
        let d = self.derivs(eta, zeta);
        crate::geometry::frame::unit(d.d1.cross(&d.d2))
    }

    /// Number of sides: 3 or 4. Side k of a triangle runs from corner k to k + 1, corners at (0,0), (1,0),
    /// (1,1); of a quadrilateral, corners at (0,0), (1,0), (1,1), (0,1).
    #[must_use]
    pub fn sides(&self) -> usize {
        if matches!(self, Self::Triangle(_)) { 3 } else { 4 }
    }
}
