//! The input of the solver from a plan: mesh, constraints, loads, tools and their motions by stage.

use std::path::Path;
use std::sync::Arc;

use super::blank::{blank_mesh, constraints};
use super::error::{Fault, SceneError};
use super::loads::loads;
use super::motions::motions;
use super::plan::Plan;
use super::rolling;
use super::symmetry_faces::Planes;
use super::types::{Drive, Place, Side, Tool};
use kanagata_contact::ToolSurface;
use kanagata_geometry::Vec3;
use kanagata_solver::assembly::Body;
use kanagata_solver::sheet::hex_mesh::HexMesh;
use kanagata_solver::{Curve, Limits, Placement, SheetSide, SimulationSetup, Stage, ToolSetup};
use kanagata_tool::ToolModel;

/// Default first and largest increment, as fractions of the stage.
const FIRST_INCREMENT: f64 = 0.05;
const LARGEST_INCREMENT: f64 = 0.1;

impl Plan {
    /// The set-up of the solver.
    ///
    /// # Errors
    /// [`SceneError::Value`] when a plane or a region contains no node, or the blank is not a valid mesh;
    /// [`SceneError::Blank`] when its mesh file cannot be used.
    pub fn simulation_setup(&self, path: &Path) -> Result<SimulationSetup, SceneError> {
        let value = |(place, found, allowed): Fault| SceneError::Value {
            path: path.to_path_buf(),
            place,
            found,
            allowed,
        };
        let read = self.files.iter().find_map(|file| file.sheet.as_deref());
        let mesh = blank_mesh(&self.scene.blank, path, &self.folder, read)?;
        let constraints = constraints(&self.scene, &mesh).map_err(value)?;
        let loads = loads(&self.scene, &mesh, self.symmetry_factor()).map_err(value)?;
        let mut body = Body::new(mesh, self.scene.blank.element, self.material.clone())
            .map_err(|e| value(("blank".into(), e.to_string(), "a sound mesh".into())))?;
        rolling::orient(self, &mut body).map_err(value)?;
        let tools = self.tools_for(body.mesh()).map_err(value)?;
        Ok(SimulationSetup {
            body,
            constraints,
            loads,
            tools,
            stages: self.stages(),
            limits: self.limits(),
            share: self.symmetry_factor(),
        })
    }

    /// The tools, each with the face of the sheet that it touches and without symmetry faces.
    fn tools_for(&self, mesh: &HexMesh) -> Result<Vec<ToolSetup>, Fault> {
        let up = thickness_direction(mesh);
        let planes = Planes::of(&self.scene, mesh);
        let tools = self.scene.tools.iter().zip(&self.tools).enumerate();
        let tools = tools.map(|(k, (tool, loaded))| {
            let side = side(tool, &up)
                .map_err(|(found, allowed)| (format!("tools[{k}].side"), found, allowed))?;
            // The sheet may have turned over before a tool appears that is absent at first.
            if !self.is_absent_at_first(tool) {
                check_orientation(tool, loaded.surface.model(), side, &up)
                    .map_err(|(found, allowed)| (format!("tools[{k}].file"), found, allowed))?;
            }
            let mut tool = tool_setup(tool, side, loaded.surface.clone());
            tool.surface = planes.without_symmetry_faces(&tool.surface, &tool.offset);
            Ok(tool)
        });
        tools.collect()
    }

    /// Whether a tool with a given `side` is absent in the first stage.
    fn is_absent_at_first(&self, tool: &Tool) -> bool {
        let first = self.scene.stages.first().and_then(|stage| stage.drive.get(&tool.name));
        tool.side.is_some() && matches!(first, Some(Drive::Absent(_)))
    }

    pub(super) fn limits(&self) -> Limits {
        let given = &self.scene.solver;
        Limits {
            iterations: given.iterations,
            wanted_iterations: given.wanted_iterations,
            force_tolerance: given.force_tolerance,
            smallest_step: given.smallest_increment,
            increments: given.increments,
            increment_error: given.increment_error,
            friction_transition: given.friction_transition,
            contact: given.contact,
            ..Limits::default()
        }
    }

    pub(super) fn stages(&self) -> Vec<Stage> {
        let motions = motions(&self.scene);
        let mut load = 0.0;
        let mut stages = Vec::with_capacity(self.scene.stages.len());
        for (k, (stage, motions)) in self.scene.stages.iter().zip(motions).enumerate() {
            let next = stage.load_share.unwrap_or(1.0);
            let first_step = stage.first_increment.unwrap_or(FIRST_INCREMENT);
            stages.push(Stage {
                name: stage.name.clone(),
                duration: 1.0,
                motions,
                load: Curve::ramp(std::mem::replace(&mut load, next), next),
                first_step,
                largest_step: stage
                    .largest_increment
                    .unwrap_or_else(|| LARGEST_INCREMENT.max(first_step)),
                ends: self.followed.as_ref().map_or_else(Vec::new, |f| f.ends[k].clone()),
            });
        }
        stages
    }
}

/// Mean unit vector of the columns from the lower face to the upper. It is short for a strongly bent sheet.
fn thickness_direction(mesh: &HexMesh) -> Vec3 {
    let ends = mesh.bottom_nodes().into_iter().zip(mesh.top_nodes());
    let column = |(low, high): (u32, u32)| mesh.nodes[high as usize] - mesh.nodes[low as usize];
    let units = ends.map(|ends| column(ends).try_normalize(0.0).unwrap_or_default());
    units.sum::<Vec3>() / mesh.column_count().max(1) as f64
}

/// Face of the sheet that a tool touches, from its direction. The error: what was found, what is allowed.
fn side(tool: &Tool, up: &Vec3) -> Result<SheetSide, (String, String)> {
    /// Smallest cosine between the two directions that determines the face.
    const SIDE_COS_MIN: f64 = 0.1;
    match tool.side {
        Some(Side::Top) => return Ok(SheetSide::Top),
        Some(Side::Bottom) => return Ok(SheetSide::Bottom),
        Some(Side::Both) => return Ok(SheetSide::Both),
        None => {}
    }
    let along = Vec3::from(tool.direction).normalize().dot(up);
    if along.abs() < SIDE_COS_MIN {
        let ([x, y, z], name) = (tool.direction, &tool.name);
        return Err((
            format!(
                "none, where the direction [{x}, {y}, {z}] of '{name}' is nearly square to the sheet's thickness direction [{:.3}, {:.3}, {:.3}]",
                up.x, up.y, up.z
            ),
            "\"side\": \"top\", \"bottom\" or \"both\", the face of the sheet that the tool touches (of a file of hexahedra narrower than thick, `blank.thickness_mm` says which direction is the thickness)".into(),
        ));
    }
    Ok(if along < 0.0 { SheetSide::Top } else { SheetSide::Bottom })
}

/// Checks that the faces of a tool point towards the face of the sheet that it touches; walls do not matter. The error:
/// what was found, what is allowed.
///
/// A tool that approaches along the sheet is not checked: it may touch a bent part.
fn check_orientation(
    tool: &Tool,
    model: &ToolModel,
    side: SheetSide,
    up: &Vec3,
) -> Result<(), (String, String)> {
    /// Facing ratio below which a tool is reversed: area that points towards the sheet less area that points away, over
    /// their sum.
    const FACING_RATIO_MIN: f64 = -0.5;
    /// Smallest cosine to the thickness direction of a tool that is checked.
    const CHECKED_COS_MIN: f64 = 0.5;
    let (face, at_sheet) = match side {
        SheetSide::Top => ("upper", -up),
        SheetSide::Bottom => ("lower", *up),
        SheetSide::Both => return Ok(()),
    };
    let Some(at_sheet) = at_sheet.try_normalize(0.0) else { return Ok(()) };
    if Vec3::from(tool.direction).normalize().dot(&at_sheet).abs() < CHECKED_COS_MIN {
        return Ok(());
    }
    let facing = model.facing(&at_sheet);
    if facing >= FACING_RATIO_MIN {
        return Ok(());
    }
    Err((
        format!(
            "{}, where {:.0} % of the faces of '{}' look away from the sheet's {face} face, which it is to touch",
            tool.file,
            50.0 * (1.0 - facing),
            tool.name
        ),
        "a tool whose faces look at the sheet: turn its normals round, or say which face of the sheet it touches by its `direction` or `side`".into(),
    ))
}

fn tool_setup(tool: &Tool, side: SheetSide, surface: Arc<ToolSurface>) -> ToolSetup {
    let direction = Vec3::from(tool.direction).normalize();
    let (placement, offset) = match tool.place {
        Place::Touch => (Placement::Touch, Vec3::zeros()),
        Place::Shift(by) => (Placement::AsGiven, Vec3::from(by)),
    };
    ToolSetup {
        name: tool.name.clone(),
        surface,
        offset,
        direction,
        placement,
        friction: tool.friction.unwrap_or(0.0),
        stop: tool.stop_mm,
        side,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_tools::plane;
    use kanagata_solver::sheet::hex_mesh::rectangle;

    fn tool(direction: [f64; 3], side: Option<Side>) -> Tool {
        let tool = serde_json::json!({"name": "t", "file": "t.json", "direction": direction});
        Tool { side, ..serde_json::from_value(tool).unwrap() }
    }

    /// A rectangle with permuted axes: its thickness is along x.
    #[test]
    fn the_side_of_a_tool_follows_from_the_sheet_and_not_from_z() {
        let mut mesh = rectangle(4.0, 2.0, 1.0, 4, 2, 2);
        assert_eq!(thickness_direction(&mesh), Vec3::z());
        mesh.nodes.iter_mut().for_each(|x| *x = Vec3::new(x.z, x.x, x.y));
        let up = thickness_direction(&mesh);
        assert_eq!(up, Vec3::x());
        let of = |direction| side(&tool(direction, None), &up);
        assert_eq!(of([-1.0, 0.0, 0.0]), Ok(SheetSide::Top));
        assert_eq!(of([3.0, 1.0, -2.0]), Ok(SheetSide::Bottom));
        let (found, allowed) = of([0.0, 0.0, -1.0]).unwrap_err();
        assert!(found.contains("[0, 0, -1]") && found.contains("[1.000, 0.000"), "{found}");
        assert!(allowed.contains(r#""side": "top""#), "{allowed}");
        let found = side(&tool([0.0, 0.0, -1.0], Some(Side::Both)), &up);
        assert_eq!(found, Ok(SheetSide::Both));
    }

    /// A flat face with a wall beside it, and both reversed.
    #[test]
    fn a_tool_that_looks_away_from_the_sheet_is_refused() {
        let flat = |normal: Vec3| {
            let (a, b) = (Vec3::x() * 3.0, Vec3::y() * 2.0);
            let mut model = plane("t", Vec3::zeros(), a, b, normal);
            model.patches.extend(plane("t", Vec3::zeros(), b, Vec3::z() * 9.0, Vec3::x()).patches);
            model
        };
        let tool = tool([0.0, 0.0, -1.0], None);
        let (up, top, bottom) = (Vec3::z(), SheetSide::Top, SheetSide::Bottom);
        for (normal, fits, not) in [(-Vec3::z(), top, bottom), (Vec3::z(), bottom, top)] {
            let model = flat(normal);
            assert_eq!(check_orientation(&tool, &model, fits, &up), Ok(()));
            assert_eq!(check_orientation(&tool, &model, SheetSide::Both, &up), Ok(()));
            let (found, allowed) = check_orientation(&tool, &model, not, &up).unwrap_err();
            assert!(found.contains("t.json, where 100 % of the faces of 't'"), "{found}");
            assert!(allowed.contains("normals round"), "{allowed}");
            let cam = Tool { direction: [1.0, 0.0, 0.2], ..tool.clone() };
            assert_eq!(check_orientation(&cam, &model, not, &up), Ok(()));
            // Seen edge-on, where rounding would decide.
            assert_eq!(check_orientation(&tool, &model, not, &Vec3::y()), Ok(()));
        }
    }
}
