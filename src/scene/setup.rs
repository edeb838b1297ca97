//! From a plan to what the solver runs: tools and their motions by stage.

use std::path::Path;

use super::blank::{blank_mesh, constraints, loads};
use super::read::{Plan, SceneError};
use super::types::{Drive, Place, Side, Spring, Tool};
use crate::geometry::Vec3;
use crate::solver::assembly::Body;
use crate::solver::{
    Curve, Limits, Motion, Placement, SheetSide, SimulationSetup, Stage, ToolSetup,
};

/// First and largest increment of a stage when the scene says nothing, as shares of the stage.
const FIRST_INCREMENT: f64 = 0.05;
const LARGEST_INCREMENT: f64 = 0.1;

impl Plan {
    /// Everything the solver needs.
    ///
    /// # Errors
    /// [`SceneError::Value`] when a plane or a region touches no node or the blank makes no body;
    /// [`SceneError::Blank`] when its mesh file cannot be used.
    pub fn simulation_setup(&self, path: &Path) -> Result<SimulationSetup, SceneError> {
        let value = |(place, found, allowed): (String, String, String)| SceneError::Value {
            path: path.to_path_buf(),
            place,
            found,
            allowed,
        };
        let mesh = blank_mesh(&self.scene.blank, path, &self.folder)?;
        let constraints = constraints(&self.scene, &mesh.nodes).map_err(value)?;
        let loads = loads(&self.scene, &mesh.nodes, self.share()).map_err(value)?;
        let body = Body::new(mesh, self.scene.blank.element, self.material.clone())
            .map_err(|e| value(("blank".into(), e.to_string(), "a sound mesh".into())))?;
        let tools = self.scene.tools.iter().zip(&self.tools);
        Ok(SimulationSetup {
            body,
            constraints,
            loads,
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
            contact: given.contact,
            ..Limits::default()
        }
    }

    fn stages(&self) -> Vec<Stage> {
        let mut last = vec![Last::Nothing; self.scene.tools.len()];
        let mut load = 0.0;
        let mut stages = Vec::with_capacity(self.scene.stages.len());
        for (k, stage) in self.scene.stages.iter().enumerate() {
            let tools = self.scene.tools.iter().zip(&mut last);
            let motions = tools.map(|(tool, last)| motion(stage.drive.get(&tool.name), last));
            let next = stage.load_share.unwrap_or(1.0);
            stages.push(Stage {
                name: stage.name.clone(),
                duration: 1.0,
                motions: motions.collect(),
                load: Curve::ramp(std::mem::replace(&mut load, next), next),
                first_step: stage.first_increment.unwrap_or(FIRST_INCREMENT),
                largest_step: stage.largest_increment.unwrap_or(LARGEST_INCREMENT),
                ends: self.followed.as_ref().map_or_else(Vec::new, |f| f.ends[k].clone()),
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
    /// Held by this spring.
    Spring(Spring),
    /// Gone.
    Gone,
}

fn motion(drive: Option<&Drive>, last: &mut Last) -> Motion {
    let before = *last;
    match drive {
        None => match before {
            Last::Force(force) => Motion::Force(Curve::constant(force)),
            Last::Spring(Spring { stiffness_n_per_mm, force_n }) => {
                let force = Curve::constant(force_n);
                Motion::Spring { force, stiffness: stiffness_n_per_mm }
            }
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
        Some(&Drive::Spring(spring)) => {
            *last = Last::Spring(spring);
            let from = match before {
                Last::Force(from) => from,
                Last::Spring(before) => before.force_n,
                _ => 0.0,
            };
            let force = Curve::ramp(from, spring.force_n);
            Motion::Spring { force, stiffness: spring.stiffness_n_per_mm }
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
        let spring = |stiffness_n_per_mm: f64, force_n: f64| Spring { stiffness_n_per_mm, force_n };
        let of = |force: Curve| Motion::Spring { force, stiffness: 7.0 };
        let mut last = Last::Nothing;
        let drive = Drive::Spring(spring(7.0, 50.0));
        assert_eq!(motion(Some(&drive), &mut last), of(Curve::ramp(0.0, 50.0)));
        assert_eq!(motion(None, &mut last), of(Curve::constant(50.0)));
        let mut last = Last::Travel(20.0);
        assert_eq!(
            motion(Some(&Drive::TravelMm(60.0)), &mut last),
            Motion::Travel(Curve::ramp(20.0, 60.0))
        );
    }
}
