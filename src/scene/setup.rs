//! From a plan to what the solver runs: blank mesh, constraints, tool motions.

use super::read::{Plan, SceneError};
use super::types::{Drive, Place, Side, Tool};
use crate::geometry::Vec3;
use crate::solver::assembly::Body;
use crate::solver::blank::{HexMesh, rectangle};
use crate::solver::{
    Constraints, Curve, Limits, Motion, Placement, SheetSide, SimulationSetup, Stage, ToolSetup,
};

/// First and largest increment of a stage when the scene says nothing, as shares of the stage.
const FIRST_INCREMENT: f64 = 0.05;
const LARGEST_INCREMENT: f64 = 0.1;

impl Plan {
    /// The blank's mesh before forming.
    #[must_use]
    pub fn blank_mesh(&self) -> HexMesh {
        let blank = &self.scene.blank;
        let [nx, ny, nz] = blank.elements;
        let mut mesh =
            rectangle(blank.size_mm[0], blank.size_mm[1], blank.thickness_mm, nx, ny, nz);
        let corner = Vec3::new(blank.corner_mm[0], blank.corner_mm[1], blank.z_mm);
        mesh.nodes.iter_mut().for_each(|x| *x += corner);
        mesh
    }

    /// Everything the solver needs.
    ///
    /// # Errors
    /// [`SceneError::Value`] when a symmetry plane touches no node or the blank makes no body.
    pub fn simulation_setup(&self, path: &std::path::Path) -> Result<SimulationSetup, SceneError> {
        let value = |place: String, found: String, allowed: &str| SceneError::Value {
            path: path.to_path_buf(),
            place,
            found,
            allowed: allowed.to_owned(),
        };
        let mesh = self.blank_mesh();
        let mut constraints = Constraints::none(mesh.nodes.len());
        let tolerance = 1e-9 * self.scene.blank.size_mm[0].max(self.scene.blank.size_mm[1]);
        for (k, plane) in self.scene.symmetry.iter().enumerate() {
            let axis = plane.normal.index();
            if constraints.symmetry_plane(&mesh.nodes, axis, plane.at_mm, tolerance) == 0 {
                let found = format!("{} mm, where the blank has no node", plane.at_mm);
                return Err(value(format!("symmetry[{k}].at_mm"), found, "a side of the blank"));
            }
        }
        let body = Body::new(mesh, self.scene.blank.element, self.material.clone())
            .map_err(|e| value("blank".into(), e.to_string(), "a sound mesh"))?;
        let tools = self.scene.tools.iter().zip(&self.tools);
        Ok(SimulationSetup {
            body,
            constraints,
            tools: tools.map(|(tool, loaded)| tool_setup(tool, loaded.surface.clone())).collect(),
            stages: self.stages(),
            limits: self.limits(),
            share: self.share(),
        })
    }

    fn limits(&self) -> Limits {
        let given = &self.scene.solver;
        Limits {
            iterations: given.iterations,
            wanted_iterations: given.wanted_iterations,
            force_tolerance: given.force_tolerance,
            smallest_step: given.smallest_increment,
            increments: given.increments,
            friction_transition: given.friction_transition,
            ..Limits::default()
        }
    }

    fn stages(&self) -> Vec<Stage> {
        let mut last = vec![Last::Nothing; self.scene.tools.len()];
        let mut stages = Vec::with_capacity(self.scene.stages.len());
        for stage in &self.scene.stages {
            let tools = self.scene.tools.iter().zip(&mut last);
            let motions = tools.map(|(tool, last)| motion(stage.drive.get(&tool.name), last));
            stages.push(Stage {
                name: stage.name.clone(),
                duration: 1.0,
                motions: motions.collect(),
                first_step: stage.first_increment.unwrap_or(FIRST_INCREMENT),
                largest_step: stage.largest_increment.unwrap_or(LARGEST_INCREMENT),
            });
        }
        stages
    }
}

/// How the stage before left a tool.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Last {
    /// Standing, at a travel that only the run knows.
    Nothing,
    /// Standing at this travel [mm].
    Travel(f64),
    /// Pushed by this force [N].
    Force(f64),
    /// Gone.
    Gone,
}

fn motion(drive: Option<&Drive>, last: &mut Last) -> Motion {
    let before = *last;
    match drive {
        None => match before {
            Last::Force(force) => Motion::Force(Curve::constant(force)),
            Last::Gone => Motion::Absent,
            _ => Motion::Hold,
        },
        Some(&Drive::TravelMm(to)) => {
            *last = Last::Travel(to);
            let from = if let Last::Travel(from) = before { from } else { 0.0 };
            Motion::Travel(Curve::ramp(from, to))
        }
        Some(&Drive::AdvanceMm(by)) => {
            *last = match before {
                Last::Travel(from) => Last::Travel(from + by),
                _ => Last::Nothing,
            };
            Motion::Advance(Curve::ramp(0.0, by))
        }
        Some(&Drive::ForceN(to)) => {
            *last = Last::Force(to);
            let from = if let Last::Force(from) = before { from } else { 0.0 };
            Motion::Force(Curve::ramp(from, to))
        }
        Some(Drive::Release(true)) => {
            *last = Last::Gone;
            Motion::Release
        }
        Some(Drive::Absent(true)) => {
            *last = Last::Gone;
            Motion::Absent
        }
        Some(Drive::Release(false) | Drive::Absent(false)) => motion(None, last),
    }
}

fn tool_setup(tool: &Tool, surface: std::sync::Arc<crate::contact::ToolSurface>) -> ToolSetup {
    let direction = Vec3::from(tool.direction).normalize();
    let (placement, offset) = match tool.place {
        Place::Touch => (Placement::Touch, Vec3::zeros()),
        Place::Shift(by) => (Placement::AsGiven, Vec3::from(by)),
    };
    let side = match tool.side {
        Some(Side::Top) => SheetSide::Top,
        Some(Side::Bottom) => SheetSide::Bottom,
        Some(Side::Both) => SheetSide::Both,
        None if direction.z < 0.0 => SheetSide::Top,
        None => SheetSide::Bottom,
    };
    ToolSetup {
        name: tool.name.clone(),
        surface,
        offset,
        direction,
        placement,
        friction: tool.friction,
        side,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tool_that_is_not_named_goes_on_as_it_was() {
        let mut last = Last::Nothing;
        assert_eq!(motion(None, &mut last), Motion::Hold);
        motion(Some(&Drive::ForceN(5.0)), &mut last);
        assert_eq!(motion(None, &mut last), Motion::Force(Curve::constant(5.0)));
        assert_eq!(
            motion(Some(&Drive::ForceN(9.0)), &mut last),
            Motion::Force(Curve::ramp(5.0, 9.0))
        );
        assert_eq!(motion(Some(&Drive::Release(true)), &mut last), Motion::Release);
        assert_eq!(motion(None, &mut last), Motion::Absent);
        let mut last = Last::Travel(20.0);
        assert_eq!(
            motion(Some(&Drive::TravelMm(60.0)), &mut last),
            Motion::Travel(Curve::ramp(20.0, 60.0))
        );
    }
}
