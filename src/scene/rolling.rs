//! Rolling direction of a blank: an angle about z for a sheet normal to z, otherwise a vector projected on each element.

use super::error::Fault;
use super::plan::Plan;
use super::types::Blank;
use kanagata_geometry::Vec3;
use kanagata_solver::assembly::AlongNormal;
use kanagata_solver::assembly::Body;
use kanagata_solver::sheet::hex_mesh::HexMesh;

/// Sine of the angle to z up to which a normal counts as along z: the precision of files with seven digits for fine
/// elements.
const ALONG_Z_SIN_MAX: f64 = 1e-3;

/// Checks the rolling direction of a blank.
pub(super) fn check(blank: &Blank) -> Result<(), Fault> {
    let Some(vector) = blank.rolling_direction else { return Ok(()) };
    let fault = |found: String, allowed: &str| {
        Err(("blank.rolling_direction".to_owned(), found, allowed.to_owned()))
    };
    let length = Vec3::from(vector).norm();
    if !(length > 0.0 && length.is_finite()) {
        return fault(format!("{vector:?}"), "a vector [x, y, z] that is not zero");
    }
    let degrees = blank.rolling_direction_deg;
    if degrees != 0.0 {
        let found = format!("{vector:?} beside blank.rolling_direction_deg {degrees}");
        return fault(found, "one of the two: leave the angle out");
    }
    Ok(())
}

/// Sets the rolling direction of a body if it is given as a vector. An isotropic material needs none; an angle about z
/// is part of the material law.
pub(super) fn orient(plan: &Plan, body: &mut Body) -> Result<(), Fault> {
    let isotropic = plan.card.is_isotropic();
    if isotropic.map_err(|e| ("material".into(), e.to_string(), "a sound card".into()))? {
        return Ok(());
    }
    let place = "blank.rolling_direction".to_owned();
    let Some(rolling) = plan.scene.blank.rolling_direction else {
        return match inclined_element(body.mesh()) {
            None => Ok(()),
            Some(element) => Err((
                place,
                format!(
                    "none, where material '{}' is anisotropic and the blank does not lie across z: {}",
                    plan.card.name,
                    element_text(body.mesh(), element)
                ),
                "the rolling direction as a vector [x, y, z], of which what lies in each element counts (`rolling_direction_deg`, an angle about z, is for blanks across z); or an isotropic material".into(),
            )),
        };
    };
    body.set_rolling_direction(&Vec3::from(rolling)).map_err(|AlongNormal { element, degrees }| {
        (
            place,
            format!(
                "{rolling:?}, {degrees:.1} degrees from the sheet's normal, where material '{}' is anisotropic: {}",
                plan.card.name,
                element_text(body.mesh(), element)
            ),
            format!(
                "a vector at least {} degrees from the normals of all elements, as what of it lies in the sheet is the rolling direction (along a tube: its axis); or an isotropic material",
                Body::ROLLING_ANGLE_MIN
            ),
        )
    })
}

/// The element whose normal deviates most from z; `None` if all are along z.
fn inclined_element(mesh: &HexMesh) -> Option<usize> {
    let inclination = mesh.normals().into_iter().map(|normal| normal.xy().norm()).enumerate();
    let farthest = inclination.max_by(|a, b| a.1.total_cmp(&b.1))?;
    (farthest.1 > ALONG_Z_SIN_MAX).then_some(farthest.0)
}

/// An element with its position and normal, in words.
fn element_text(mesh: &HexMesh, element: usize) -> String {
    let nodes = mesh.elements[element].map(|n| mesh.nodes[n as usize]);
    let (at, normal) = (nodes.iter().sum::<Vec3>() / 8.0, mesh.normals()[element]);
    let of =
        |x: &Vec3, digits: usize| format!("({:.digits$}, {:.digits$}, {:.digits$})", x.x, x.y, x.z);
    format!("element {element} at {} mm has the normal {}", of(&at, 3), of(&normal, 3))
}
