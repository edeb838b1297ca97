//! Rolling direction of a blank: an angle about z where the sheet lies across z, else a vector projected on each element.

use super::error::Fault;
use super::plan::Plan;
use super::types::Blank;
use crate::geometry::Vec3;
use crate::solver::assembly::AlongNormal;
use crate::solver::assembly::Body;
use crate::solver::sheet::hex_mesh::HexMesh;

/// Sine of the angle to z up to which a normal is along it: what files written with seven digits leave over fine elements.
const ALONG_Z: f64 = 1e-3;

/// What is out of range in a blank's rolling direction.
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

/// Lets the axes of the material follow the sheet, where that has a rolling direction as a vector. A material without axes needs
/// none; an angle about z is the law's own.
pub(super) fn orient(plan: &Plan, body: &mut Body) -> Result<(), Fault> {
    let isotropic = plan.card.is_isotropic();
    if isotropic.map_err(|e| ("material".into(), e.to_string(), "a sound card".into()))? {
        return Ok(());
    }
    let place = "blank.rolling_direction".to_owned();
    let Some(rolling) = plan.scene.blank.rolling_direction else {
        return match leaning(body.mesh()) {
            None => Ok(()),
            Some(element) => Err((
                place,
                format!(
                    "none, where material '{}' is anisotropic and the blank does not lie across z: {}",
                    plan.card.name,
                    told(body.mesh(), element)
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
                told(body.mesh(), element)
            ),
            format!(
                "a vector at least {} degrees from the normals of all elements, as what of it lies in the sheet is the rolling direction (along a tube: its axis); or an isotropic material",
                Body::ROLLING_ANGLE_MIN
            ),
        )
    })
}

/// The element whose normal is farthest from z; `None` where all are along it.
fn leaning(mesh: &HexMesh) -> Option<usize> {
    let lean = mesh.normals().into_iter().map(|normal| normal.xy().norm()).enumerate();
    let farthest = lean.max_by(|a, b| a.1.total_cmp(&b.1))?;
    (farthest.1 > ALONG_Z).then_some(farthest.0)
}

/// An element, its place and its normal in words.
fn told(mesh: &HexMesh, element: usize) -> String {
    let nodes = mesh.elements[element].map(|n| mesh.nodes[n as usize]);
    let (at, normal) = (nodes.iter().sum::<Vec3>() / 8.0, mesh.normals()[element]);
    let of =
        |x: &Vec3, digits: usize| format!("({:.digits$}, {:.digits$}, {:.digits$})", x.x, x.y, x.z);
    format!("element {element} at {} mm has the normal {}", of(&at, 3), of(&normal, 3))
}
