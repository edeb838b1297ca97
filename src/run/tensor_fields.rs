//! Stress and strain tensors of the elements, and their principal values, as arrays of the VTU.

use kanagata_geometry::Mat3;
use kanagata_report::DataArray;
use kanagata_solver::assembly::{Body, ElementTensors, Tensors};

/// Tensors of a mean or a face.
type Place = fn(&ElementTensors) -> &Tensors;
/// Stress or strain.
type Component = fn(&Tensors) -> [f64; 6];

/// Names of a tensor and of its principal values, and the tensor.
const QUANTITIES: [(&str, &str, Component); 2] = [
    ("cauchy_stress_mpa", "principal_stress_mpa", |tensors| tensors.stress),
    ("logarithmic_strain", "principal_strain", |tensors| tensors.strain),
];

/// Tensors of every element at the last commit, whose displacements (three per node [mm]) are given: means, and those at
/// both faces. Empty for an elastic material.
#[must_use]
pub fn arrays(body: &Body, displacements: &[f64]) -> Vec<DataArray> {
    let Some(all) = body.element_tensors(displacements) else { return Vec::new() };
    let places: [(&str, Place); 3] =
        [("", |all| &all.mean), ("_lower", |all| &all.lower), ("_upper", |all| &all.upper)];
    let mut arrays = Vec::new();
    for (suffix, place) in places {
        for (tensor, principal, component) in QUANTITIES {
            let values = || all.iter().map(|element| component(place(element)));
            arrays.push(DataArray::symmetric(format!("{tensor}{suffix}"), values()));
            let principals = values().map(|tensor| principal_values(&tensor));
            arrays.push(DataArray::principal(format!("{principal}{suffix}"), principals));
        }
    }
    arrays
}

/// Eigenvalues of `xx, yy, zz, xy, yz, xz` in descending order.
#[must_use]
pub fn principal_values(&[xx, yy, zz, xy, yz, xz]: &[f64; 6]) -> [f64; 3] {
    let tensor = Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    if !tensor.iter().all(|x| x.is_finite()) {
        return [f64::NAN; 3];
    }
    let mut values: [f64; 3] = tensor.symmetric_eigenvalues().into();
    values.sort_by(|a, b| b.total_cmp(a));
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_geometry::Vec3;

    /// `R diag R'` has the values of the diagonal, for equal ones too, and the invariants of the tensor.
    #[test]
    fn principal_values_are_the_eigenvalues() {
        let turn = nalgebra::Rotation3::from_euler_angles(1.0, -0.4, 2.2).into_inner();
        for values in [[300.0, 20.0, -150.0], [5.0, 5.0, -1.0], [2.0, 2.0, 2.0], [0.0; 3]] {
            let m = turn * Mat3::from_diagonal(&Vec3::from(values)) * turn.transpose();
            let tensor = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)].map(|place| m[place]);
            let found = principal_values(&tensor);
            for (found, expected) in found.iter().zip(values) {
                assert!((found - expected).abs() < 1e-12 * values[0].abs().max(1.0), "{found}");
            }
        }
        let pure_shear = principal_values(&[0.0, 0.0, 0.0, 0.0, 0.0, 7.0]);
        assert!((pure_shear[0] - 7.0).abs() < 1e-14 && (pure_shear[2] + 7.0).abs() < 1e-14);
        assert!(principal_values(&[f64::NAN; 6]).iter().all(|x| x.is_nan()));
    }
}
