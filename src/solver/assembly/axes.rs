//! Material axes that follow the sheet: the third along its normal, the first along the rolling direction.

use super::body::Body;
use kanagata_geometry::frame::Frame;
use kanagata_geometry::{Mat3, Vec3};

/// A rolling direction so close to the normal of an element that its in-plane projection is undefined.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("the rolling direction is {degrees:.1} degrees from the normal of element {element}")]
pub struct AlongNormal {
    /// Element number.
    pub element: usize,
    /// Angle between rolling direction and normal [degrees].
    pub degrees: f64,
}

impl Body {
    /// Minimum angle between the rolling direction and the normal of an element [degrees].
    pub const ROLLING_ANGLE_MIN: f64 = 10.0;

    /// Sets the material axes of each element: the third along the normal of its undeformed mid-surface, the first
    /// along the in-plane projection of `rolling`. Total and plastic strains in the histories are then in these axes
    /// ([`Body::material_axes`]). Their traces and the scalar history variables do not depend on the axes.
    ///
    /// # Errors
    /// [`AlongNormal`] for the element whose normal is closest to `rolling`, if the angle is below
    /// [`Body::ROLLING_ANGLE_MIN`].
    pub fn set_rolling_direction(&mut self, rolling: &Vec3) -> Result<(), AlongNormal> {
        let normals = self.mesh.normals();
        let angle = |normal: &Vec3| {
            normal.cross(rolling).norm().atan2(normal.dot(rolling).abs()).to_degrees()
        };
        let nearest = normals.iter().map(angle).enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((element, degrees)) =
            nearest.filter(|(_, degrees)| *degrees < Self::ROLLING_ANGLE_MIN)
        {
            return Err(AlongNormal { element, degrees });
        }
        let axes = |normal: &Vec3| {
            let frame = Frame::from_z_x(Vec3::zeros(), *normal, *rolling);
            frame.map_or_else(Mat3::identity, |f| Mat3::from_columns(&[f.x, f.y, f.z]))
        };
        self.axes = Some(normals.iter().map(axes).collect());
        Ok(())
    }

    /// Material axes of each element if they differ between elements; columns are the rolling, transverse and
    /// thickness direction. The histories are in these axes.
    #[must_use]
    pub fn material_axes(&self) -> Option<&[Mat3]> {
        self.axes.as_deref()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use nalgebra::Rotation3;

    use super::*;
    use crate::assembly::evaluation::Evaluation;
    use crate::element::{ElementKind, Want};
    use crate::material::card;
    use crate::sheet::hex_mesh::{HexMesh, rectangle};

    const SHELL: ElementKind = ElementKind::SolidShell { points: 3, membrane: true };

    /// A sheet bent about y in which no two elements have the same normal.
    fn bent() -> HexMesh {
        let mut mesh = rectangle(6.0, 4.0, 0.6, 4, 2, 1);
        for x in &mut mesh.nodes {
            let (s, c) = (x.x / 5.0).sin_cos();
            *x = Vec3::new((5.0 + x.z) * s, x.y + 0.1 * x.x, (5.0 + x.z) * c);
        }
        mesh
    }

    fn body(mesh: HexMesh, kind: ElementKind, rolling: &Vec3) -> Body {
        let steel = card::find("mild-steel-neto2012").unwrap().build(0.0).unwrap();
        let mut body = Body::new(mesh, kind, Arc::clone(&steel)).unwrap();
        body.set_rolling_direction(rolling).unwrap();
        body
    }

    /// Forces of two steps, and the product of the second tangent with a vector.
    fn formed(turn: &Mat3, kind: ElementKind) -> [Vec<Vec3>; 2] {
        let mut mesh = bent();
        let own = mesh.nodes.clone();
        mesh.nodes.iter_mut().for_each(|x| *x = turn * *x);
        let mut body = body(mesh, kind, &(turn * Vec3::new(0.2, 1.0, 0.1)));
        let mut out = Evaluation::default();
        for step in [0.5, 1.0] {
            let u = |x: &Vec3| {
                let own = Vec3::new(0.03 * x.x * x.y, -0.02 * x.y, 0.01 * x.x * x.z) * step;
                <[f64; 3]>::from(turn * own)
            };
            let u: Vec<f64> = own.iter().flat_map(u).collect();
            // Enough evaluations for the internal modes to converge.
            (0..8).for_each(|_| body.evaluate(&u, Want::ResidualAndTangent, &mut out).unwrap());
            body.commit();
        }
        let states = body.element_states().unwrap();
        assert!(states.iter().all(|state| state.mean.plastic_strain > 1e-3));
        let v: Vec<f64> = own.iter().flat_map(|x| <[f64; 3]>::from(turn * x)).collect();
        let mut product = vec![0.0; v.len()];
        let pattern = body.pattern();
        for (row, sum) in product.iter_mut().enumerate() {
            for at in pattern.row_ptr[row]..pattern.row_ptr[row + 1] {
                *sum += out.tangent[at] * v[pattern.col_idx[at]];
            }
        }
        let back = |all: &[f64]| -> Vec<Vec3> {
            let each = all.chunks_exact(3).map(|f| turn.transpose() * Vec3::from_column_slice(f));
            each.collect()
        };
        [back(&out.internal_force), back(&product)]
    }

    #[test]
    fn a_turned_sheet_answers_with_turned_forces() {
        let turn = Rotation3::from_euler_angles(0.7, -1.9, 2.4).into_inner();
        for kind in [ElementKind::Hex8, ElementKind::Hex8Enhanced, SHELL] {
            let pairs = formed(&Mat3::identity(), kind).into_iter().zip(formed(&turn, kind));
            for (straight, turned) in pairs {
                let largest = straight.iter().fold(0.0_f64, |m, f| m.max(f.norm()));
                let off = straight.iter().zip(&turned).map(|(a, b)| (a - b).norm());
                let off = off.fold(0.0, f64::max);
                assert!(off < 1e-9 * largest, "{kind:?}: {off:e} of {largest:e}");
            }
        }
    }

    #[test]
    fn axes_are_the_normal_and_what_lies_in_the_element() {
        let mesh = bent();
        let (normals, rolling) = (mesh.normals(), Vec3::new(0.2, 1.0, 0.1));
        let body = body(mesh, SHELL, &rolling);
        for (axes, normal) in body.material_axes().unwrap().iter().zip(&normals) {
            assert!((axes.transpose() * axes - Mat3::identity()).norm() < 1e-14);
            assert!((axes.column(2) - normal).norm() < 1e-14 && axes.determinant() > 0.0);
            assert!(normal.x > 0.0 && normal.z > 0.0, "{normal}");
            assert!(
                axes.column(1).dot(&rolling).abs() < 1e-14 && axes.column(0).dot(&rolling) > 0.0
            );
        }
    }

    #[test]
    fn a_rolling_direction_along_a_normal_is_refused() {
        let steel = card::find("mild-steel-neto2012").unwrap().build(0.0).unwrap();
        let mut body = Body::new(bent(), SHELL, steel).unwrap();
        let normals = body.mesh().normals();
        let found = body.set_rolling_direction(&(-3.0 * normals[4])).unwrap_err();
        assert!(found.element == 4 || found.element == 5, "{found}");
        assert!(found.degrees < 1e-6 && body.material_axes().is_none());
        let [first, last] = [normals[0], normals[7]];
        assert!(first.angle(&last).to_degrees() > 40.0);
        body.set_rolling_direction(&(first.cross(&last) + 0.1 * first)).unwrap();
    }
}
