//! A 3-D view: surfaces, steps and symmetry.

use super::colors;
use super::surface::Surface;

/// A 3-D view.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct View {
    /// What it shows, for readers without pictures.
    pub title: String,
    /// The surfaces.
    pub surfaces: Vec<Surface>,
    /// Names of the steps in time; the last is that of the surfaces themselves, those before are their frames. Empty:
    /// nothing moves.
    pub steps: Vec<String>,
    /// Symmetry planes: axis (0, 1, 2) and coordinate on it [mm].
    pub symmetry: Vec<(usize, f64)>,
}

/// Distance over the size of a surface up to which it may reach over a symmetry plane and still counts as one side of it:
/// elements on the plane are moved by less. Doubled, a surface that reaches over by 0.2 % would be mirrored.
const SYMMETRY_TOLERANCE_REL: f64 = 1e-3;

impl View {
    /// Symmetry planes across which a surface is mirrored: those that have it on one side. A whole tool of a part model is
    /// not doubled.
    pub(super) fn mirrors(&self, surface: &Surface) -> Vec<(usize, f64)> {
        let Some([low, high]) = surface.bounds() else { return Vec::new() };
        let near = SYMMETRY_TOLERANCE_REL * (high - low).norm();
        let planes = self.symmetry.iter().filter(|(axis, _)| *axis < 3);
        planes
            .filter(|(axis, at)| low[*axis] >= at - near || high[*axis] <= at + near)
            .copied()
            .collect()
    }

    /// Names of the fields, in the order of the surfaces, each with whether it is signed.
    pub(super) fn fields(&self) -> Vec<(&str, bool)> {
        let mut names: Vec<(&str, bool)> = Vec::new();
        for field in self.surfaces.iter().flat_map(|surface| &surface.fields) {
            if names.iter().all(|(name, _)| *name != field.name) {
                names.push((&field.name, field.signed));
            }
        }
        names
    }

    /// Limits of the colour scale of a field over all surfaces and steps.
    pub(super) fn limits(&self, name: &str, signed: bool) -> Option<[f64; 2]> {
        let mut all = Vec::new();
        for surface in &self.surfaces {
            for (k, field) in surface.fields.iter().enumerate().filter(|(_, f)| f.name == name) {
                all.extend_from_slice(&field.values);
                let earlier = surface.frames.iter().filter_map(|frame| frame.values.get(k));
                earlier.for_each(|values| all.extend_from_slice(values));
            }
        }
        colors::limits(all.into_iter(), signed)
    }
}

#[cfg(test)]
mod tests {
    use super::super::surface::{Field, Frame};
    use super::*;
    use kanagata_geometry::Vec3;

    fn triangle(name: &str, x: f64) -> Surface {
        Surface {
            name: name.into(),
            points: [(0.0, 0.0), (2.0, 0.0), (0.0, 2.0)]
                .map(|(a, b)| Vec3::new(a + x, b, 0.0))
                .into(),
            triangles: vec![[0, 1, 2]],
            fields: vec![Field {
                name: "error [mm]".into(),
                signed: true,
                values: vec![-0.1, 0.02, 0.03],
                ..Field::default()
            }],
            ..Surface::default()
        }
    }

    #[test]
    fn surfaces_are_mirrored_across_the_planes_they_do_not_cross() {
        let symmetry = vec![(0, 0.0), (1, 0.0)];
        let view = View { symmetry, ..View::default() };
        assert_eq!(view.mirrors(&triangle("quarter", 0.0)), [(0, 0.0), (1, 0.0)]);
        assert_eq!(view.mirrors(&triangle("whole", -1.0)), [(1, 0.0)]);
        assert!(view.mirrors(&Surface::default()).is_empty());
    }

    #[test]
    fn limits_hold_all_surfaces_and_steps() {
        let mut one = triangle("one", 0.0);
        one.frames = vec![Frame { values: vec![vec![0.0, 0.3, 0.0]], ..Frame::default() }];
        let view = View { surfaces: vec![one, triangle("two", 0.0)], ..View::default() };
        assert_eq!(view.fields(), [("error [mm]", true)]);
        assert_eq!(view.limits("error [mm]", true), Some([-0.3, 0.3]));
    }
}
