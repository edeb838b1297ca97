//! Motions of the solver from the drives of a scene. Each stage continues from the end of the previous one.

use super::types::{Course, Drive, Scene, Spring};
use kanagata_solver::{Curve, Motion};

/// State of a tool at the end of a stage.
#[derive(Debug, Clone, Default, PartialEq)]
struct StageEnd {
    /// Travel [mm], if it follows from the scene alone.
    travel: Option<f64>,
    state: State,
}

/// Control of a tool at the end of a stage.
#[derive(Debug, Clone, Default, PartialEq)]
enum State {
    /// Constant travel.
    #[default]
    Fixed,
    /// Constant force [N].
    Force(f64),
    /// Spring with this stiffness [N/mm] and force at zero travel [N].
    Spring { stiffness: f64, force: f64 },
    /// Absent.
    Absent,
}

/// Motions of all stages, in the order of the scene's tools.
pub(super) fn motions(scene: &Scene) -> Vec<Vec<Motion>> {
    let mut last = vec![StageEnd { travel: Some(0.0), state: State::Fixed }; scene.tools.len()];
    let of = |stage: &super::types::Stage, last: &mut Vec<StageEnd>| {
        let tools = scene.tools.iter().zip(last);
        tools.map(|(tool, last)| motion(stage.drive.get(&tool.name), last)).collect()
    };
    scene.stages.iter().map(|stage| of(stage, &mut last)).collect()
}

/// The first curve that does not start from the end of the previous stage, as far as the scene determines that. Returns
/// place, what was found, what is allowed.
pub(super) fn discontinuity(scene: &Scene) -> Option<[String; 3]> {
    for tool in &scene.tools {
        let mut last = StageEnd { travel: Some(0.0), state: State::Fixed };
        for (k, stage) in scene.stages.iter().enumerate() {
            let drive = stage.drive.get(&tool.name);
            if let Some((key, found, expected, unit)) =
                drive.and_then(|d| discontinuity_of(d, &last))
            {
                return Some([
                    format!("stages[{k}].drive.{}.{key}[0]", tool.name),
                    format!("{found} {unit} at fraction 0"),
                    format!(
                        "{expected} {unit}, where it is when the stage begins, or no pair at fraction 0: the curve then starts from there"
                    ),
                ]);
            }
            motion(drive, &mut last);
        }
    }
    None
}

/// Key of a curve, its first value, the expected first value, their unit; `None` if they agree or the value is not
/// known.
fn discontinuity_of(
    drive: &Drive,
    last: &StageEnd,
) -> Option<(&'static str, f64, f64, &'static str)> {
    let (key, course, known, unit) = match (drive, &last.state) {
        (Drive::AdvanceMm(by), _) => ("advance_mm", by, Some(0.0), "mm"),
        // An absent tool may be placed anywhere.
        (Drive::TravelMm(to), state) if *state != State::Absent => {
            ("travel_mm", to, last.travel, "mm")
        }
        (Drive::ForceN(to), State::Force(from)) => ("force_n", to, Some(*from), "N"),
        (Drive::Spring(spring), State::Spring { stiffness, force })
            if *stiffness == spring.stiffness_n_per_mm =>
        {
            ("spring.force_n", &spring.force_n, Some(*force), "N")
        }
        _ => return None,
    };
    let (found, expected) = (course.start()?, known?);
    (found != expected).then_some((key, found, expected, unit))
}

fn motion(drive: Option<&Drive>, last: &mut StageEnd) -> Motion {
    match drive {
        None => continued_motion(last),
        Some(Drive::TravelMm(to)) => {
            *last = StageEnd { travel: Some(to.end()), state: State::Fixed };
            Motion::Travel(curve(to, None))
        }
        Some(Drive::AdvanceMm(by)) => {
            let travel = last.travel.map(|from| from + by.end());
            *last = StageEnd { travel, state: State::Fixed };
            Motion::Advance(curve(by, Some(0.0)))
        }
        Some(Drive::ForceN(to)) => {
            let from = if let State::Force(from) = last.state { Some(from) } else { None };
            *last = StageEnd { travel: None, state: State::Force(to.end()) };
            Motion::Force(curve(to, from))
        }
        Some(Drive::Spring(Spring { stiffness_n_per_mm: stiffness, force_n })) => {
            let (stiffness, force) = (*stiffness, force_n.end());
            let from = match last.state {
                State::Spring { stiffness: before, force } if before == stiffness => Some(force),
                _ => None,
            };
            *last = StageEnd { travel: None, state: State::Spring { stiffness, force } };
            Motion::Spring { force: curve(force_n, from), stiffness }
        }
        // An absent tool has no force to release.
        Some(Drive::Release(_)) if last.state != State::Absent => {
            last.state = State::Absent;
            Motion::Release
        }
        Some(Drive::Absent(_) | Drive::Release(_)) => {
            last.state = State::Absent;
            Motion::Absent
        }
    }
}

/// Motion of a tool that a stage does not name.
fn continued_motion(last: &StageEnd) -> Motion {
    match last.state {
        State::Force(force) => Motion::Force(Curve::constant(force)),
        State::Spring { stiffness, force } => {
            Motion::Spring { force: Curve::constant(force), stiffness }
        }
        State::Absent => Motion::Absent,
        State::Fixed => Motion::Hold,
    }
}

/// The curve of a course. Without a value at fraction 0 it starts from `from`, or from the solver's value.
fn curve(course: &Course, from: Option<f64>) -> Curve {
    let pairs = course.pairs().into_iter().map(|[fraction, value]| (fraction, value));
    let start = from.filter(|_| course.start().is_none()).map(|from| (0.0, from));
    Curve::new(start.into_iter().chain(pairs).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn force(to: f64) -> Drive {
        Drive::ForceN(Course::End(to))
    }

    fn travel(to: f64) -> Drive {
        Drive::TravelMm(Course::End(to))
    }

    fn spring(stiffness_n_per_mm: f64, to: f64) -> Drive {
        Drive::Spring(Spring { stiffness_n_per_mm, force_n: Course::End(to) })
    }

    fn first() -> StageEnd {
        StageEnd { travel: Some(0.0), state: State::Fixed }
    }

    #[test]
    fn a_tool_that_is_not_named_keeps_its_motion() {
        let mut last = first();
        assert_eq!(motion(None, &mut last), Motion::Hold);
        motion(Some(&force(5.0)), &mut last);
        assert_eq!(motion(None, &mut last), Motion::Force(Curve::constant(5.0)));
        assert_eq!(motion(Some(&force(9.0)), &mut last), Motion::Force(Curve::ramp(5.0, 9.0)));
        assert_eq!(motion(Some(&Drive::Release(true)), &mut last), Motion::Release);
        assert_eq!(motion(None, &mut last), Motion::Absent);
        assert_eq!(motion(Some(&Drive::Release(true)), &mut last), Motion::Absent);
        let of = |force: Curve| Motion::Spring { force, stiffness: 7.0 };
        let mut last = first();
        assert_eq!(motion(Some(&spring(7.0, 50.0)), &mut last), of(Curve::to(50.0)));
        assert_eq!(motion(None, &mut last), of(Curve::constant(50.0)));
        assert_eq!(motion(Some(&spring(7.0, 60.0)), &mut last), of(Curve::ramp(50.0, 60.0)));
    }

    #[test]
    fn a_tool_comes_from_where_it_is() {
        // Travel, and force built up by other drives than a force, are known only during the run.
        let mut last = first();
        motion(Some(&Drive::AdvanceMm(Course::End(2.0))), &mut last);
        assert_eq!(last.travel, Some(2.0));
        assert_eq!(motion(Some(&travel(3.0)), &mut last), Motion::Travel(Curve::to(3.0)));
        assert_eq!(motion(Some(&force(12.0)), &mut last), Motion::Force(Curve::to(12.0)));
        assert_eq!(motion(Some(&travel(4.0)), &mut last), Motion::Travel(Curve::to(4.0)));
        motion(Some(&force(12.0)), &mut last);
        let stiff = |force: Curve| Motion::Spring { force, stiffness: 7.0 };
        assert_eq!(motion(Some(&spring(7.0, 50.0)), &mut last), stiff(Curve::to(50.0)));
        let soft = Motion::Spring { force: Curve::to(20.0), stiffness: 3.0 };
        assert_eq!(motion(Some(&spring(3.0, 20.0)), &mut last), soft);
        assert_eq!(motion(Some(&force(12.0)), &mut last), Motion::Force(Curve::to(12.0)));
    }

    #[test]
    fn a_discontinuous_curve_is_found() {
        let begins = |value: f64| Course::Curve(vec![[0.0, value], [1.0, 9.0]]);
        let later = || Course::Curve(vec![[0.5, 4.0], [1.0, 9.0]]);
        let after = |first_drive: Option<Drive>, drive: &Drive| {
            let mut last = first();
            motion(first_drive.as_ref(), &mut last);
            discontinuity_of(drive, &last).map(|(_, found, expected, _)| [found, expected])
        };
        let to = |course: Course| Drive::TravelMm(course);
        assert_eq!(after(None, &to(begins(0.0))), None);
        assert_eq!(after(Some(travel(2.0)), &to(begins(0.0))), Some([0.0, 2.0]));
        assert_eq!(after(Some(travel(2.0)), &to(begins(2.0))), None);
        assert_eq!(after(Some(travel(2.0)), &to(later())), None);
        assert_eq!(after(Some(force(2.0)), &to(begins(0.0))), None);
        assert_eq!(after(Some(Drive::Absent(true)), &to(begins(3.0))), None);
        assert_eq!(after(None, &Drive::AdvanceMm(begins(1.0))), Some([1.0, 0.0]));
        assert_eq!(after(Some(force(5.0)), &Drive::ForceN(begins(0.0))), Some([0.0, 5.0]));
        assert_eq!(after(Some(travel(5.0)), &Drive::ForceN(begins(0.0))), None);
    }
}
