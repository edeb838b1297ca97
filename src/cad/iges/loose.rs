//! Curves that bound no face.

use super::curves::CURVES;
use super::file::Fault;
use super::reader::Reader;
use kanagata_geometry::nurbs::Curve3;
use kanagata_geometry::{Affine, Mat3, Vec3};

/// Curves of a file at most.
const CURVES_MAX: usize = 20_000;

impl Reader<'_, '_> {
    /// The displayed curves that no other entity uses, with lengths multiplied by `scale`; composites give their
    /// segments.
    ///
    /// # Errors
    /// For a curve that cannot be read, and for self-multiplying pointers.
    pub fn loose_curves(&self, scale: f64) -> Result<Vec<Curve3>, Fault> {
        let map = Affine { linear: Mat3::identity() * scale, shift: Vec3::zeros() };
        let owners = self.ownership()?;
        let mut found = Vec::new();
        for entity in 0..self.file.len() {
            let entry = self.file.entry(entity);
            let is_curve = CURVES.contains(&entry.kind)
                && (entry.kind != 106 || matches!(entry.form, 11 | 12 | 13 | 63));
            let drawn = entry.status[0] == 0 && !matches!(entry.status[2], 1 | 5);
            if is_curve && drawn && !owners.used[entity] && found.len() < CURVES_MAX {
                found.extend(self.pieces(entity, &map)?.into_iter().map(|p| p.curve));
            }
        }
        Ok(found)
    }
}
