//! Records of `run.json` about sections of the sheet.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A section of the middle surface: the material line in which a plane cuts the undeformed sheet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SectionRecord {
    /// Normal of the plane: 0 for x, 1 for y.
    pub normal: usize,
    /// Coordinate of the plane [mm].
    pub at_mm: f64,
    /// Length along the line in the undeformed sheet [mm], from 0.
    pub arc_mm: Vec<f64>,
    /// Points in the last equilibrium with tools [mm]; in one that was not released, at the end.
    pub held_mm: Vec<[f64; 3]>,
    /// Points at the end [mm]; empty without a release of the tools.
    pub released_mm: Vec<[f64; 3]>,
    /// Its walls, in the direction of the line.
    pub walls: Vec<WallRecord>,
}

/// A wall of a section: where it is inclined to the bottom by more than half of its largest inclination. Angles are those of
/// chords from 20 to 80 % of the lengths of bottom, wall and flange.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct WallRecord {
    /// Begin and end of the wall along the line [mm].
    pub arc_mm: [f64; 2],
    /// Angle in the corner between bottom and wall in the last equilibrium with tools [degrees]: 90 for a vertical wall, more
    /// for a wall that opens.
    pub wall_deg: f64,
    /// The same at the end.
    pub released_wall_deg: Option<f64>,
    /// Angle in the corner between the wall and the flange beyond it in the last equilibrium with tools [degrees]; absent for a
    /// wall at the end of the line.
    pub flange_deg: Option<f64>,
    /// The same at the end.
    pub released_flange_deg: Option<f64>,
    /// Radius of the circle through the wall at the end, by least squares from 20 to 80 % of its length [mm]; absent for a
    /// wall that is straight to 1e-4 of its length. Sidewall curl.
    pub curl_radius_mm: Option<f64>,
}
