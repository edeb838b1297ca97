//! Checks the values of a scene before any file that it names is read.

use super::error::Fault;
use super::motions::discontinuity;
use super::refine;
use super::rolling;
use super::types::{Accuracy, Blank, BlankShape, Drive, Scene, SolverLimits};
use kanagata_solver::element::ElementKind;

/// Version of the scene format.
pub const VERSION: u32 = 1;

/// Largest length of a tool's name, which is part of file names.
const NAME_LENGTH_MAX: usize = 64;

/// Checks the ranges of all values. The error: key, what was found, what is allowed.
pub(super) fn check(scene: &Scene) -> Result<(), Fault> {
    need(scene.version == VERSION, "version".into(), scene.version.to_string(), "1")?;
    check_blank(scene)?;
    need(!scene.tools.is_empty(), "tools".into(), "none".into(), "at least one tool")?;
    (0..scene.tools.len()).try_for_each(|k| check_tool(scene, k))?;
    need(!scene.stages.is_empty(), "stages".into(), "none".into(), "at least one stage")?;
    (0..scene.stages.len()).try_for_each(|k| check_stage(scene, k))?;
    if let Some([place, found, allowed]) = discontinuity(scene) {
        return Err((place, found, allowed));
    }
    for (k, hold) in scene.holds.iter().enumerate() {
        let allowed = "at least one of \"x\", \"y\" and \"z\"";
        need(!hold.axes.is_empty(), format!("holds[{k}].axes"), "none".into(), allowed)?;
    }
    check_quality(scene)?;
    scene.accuracy.as_ref().map_or(Ok(()), Accuracy::check)?;
    scene.output.check()?;
    check_solver(&scene.solver)
}

/// Largest magnitude of a number in any unit of the scene. Sheets of kilometres in mm and meganewtons in N are below it.
/// Powers and differences of larger numbers lose all digits.
const NUMBER_MAX: f64 = 1e12;

/// Checks the magnitude of all numbers in the text of a scene.
pub(super) fn check_numbers(value: &serde_json::Value) -> Result<(), Fault> {
    let mut open = vec![(String::new(), value)];
    while let Some((place, value)) = open.pop() {
        match value {
            serde_json::Value::Number(number) => {
                let size = number.as_f64().map_or(f64::INFINITY, f64::abs);
                need(size <= NUMBER_MAX, place, number.to_string(), "numbers up to 1e12")?;
            }
            serde_json::Value::Array(all) => {
                open.extend(all.iter().enumerate().map(|(k, v)| (format!("{place}[{k}]"), v)));
            }
            serde_json::Value::Object(all) => {
                let dot = if place.is_empty() { "" } else { "." };
                open.extend(all.iter().map(|(key, v)| (format!("{place}{dot}{key}"), v)));
            }
            _ => {}
        }
    }
    Ok(())
}

fn need(ok: bool, place: String, found: String, allowed: &str) -> Result<(), Fault> {
    if ok { Ok(()) } else { Err((place, found, allowed.to_owned())) }
}

/// Checks limits of quality.
fn check_quality(scene: &Scene) -> Result<(), Fault> {
    let Some(quality) = &scene.quality else { return Ok(()) };
    let above_0 = |x: f64| x > 0.0 && x.is_finite();
    let fraction = |x: f64| x > 0.0 && x < 1.0;
    let check = |key: &str, value: Option<f64>, allows: &dyn Fn(f64) -> bool, allowed: &str| {
        let Some(x) = value else { return Ok(()) };
        need(allows(x), format!("quality.{key}"), x.to_string(), allowed)
    };
    check("max_thinning", quality.max_thinning, &fraction, "above 0, below 1: 0.2 is 20 %")?;
    check("max_thickening", quality.max_thickening, &above_0, "above 0: 0.1 is 10 %")?;
    check("min_thickness_mm", quality.min_thickness_mm, &above_0, "above 0")?;
    let margin = |x: f64| (0.0..1.0).contains(&x);
    check("flc_margin", quality.flc_margin, &margin, "0 to below 1")?;
    check("max_springback_mm", quality.max_springback_mm, &above_0, "above 0")
}

fn check_tool(scene: &Scene, k: usize) -> Result<(), Fault> {
    let tool = &scene.tools[k];
    let at = |key: &str| format!("tools[{k}].{key}");
    let word = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    let letters = tool.name.chars().count();
    let named = (1..=NAME_LENGTH_MAX).contains(&letters) && tool.name.chars().all(word);
    let name = match tool.name.char_indices().nth(NAME_LENGTH_MAX) {
        Some((end, _)) => format!("'{}...', {letters} letters", &tool.name[..end]),
        None => format!("'{}'", tool.name),
    };
    let allowed = format!("up to {NAME_LENGTH_MAX} letters, digits, '-' and '_'");
    need(named, at("name"), name.clone(), &allowed)?;
    let first = scene.tools.iter().position(|t| t.name == tool.name) == Some(k);
    need(first, at("name"), name, "a name of its own")?;
    let length = tool.direction.iter().map(|x| x * x).sum::<f64>().sqrt();
    let points = length > 0.0 && length.is_finite();
    let direction = format!("{:?}", tool.direction);
    need(points, at("direction"), direction, "a vector that is not zero")?;
    tool.cad.as_ref().map_or(Ok(()), |cad| cad.check(&at("cad")))?;
    let mu = tool.friction.unwrap_or(0.0);
    need((0.0..10.0).contains(&mu), at("friction"), mu.to_string(), "0 to 10")?;
    let stop = tool.stop_mm.unwrap_or(0.0);
    let ahead = "a travel of 0 mm or more: tools begin at 0";
    need(stop >= 0.0 && stop.is_finite(), at("stop_mm"), stop.to_string(), ahead)
}

fn check_stage(scene: &Scene, k: usize) -> Result<(), Fault> {
    let stage = &scene.stages[k];
    let unknown = stage.drive.keys().find(|n| !scene.tools.iter().any(|t| t.name == **n));
    if let Some(name) = unknown {
        let names: Vec<&str> = scene.tools.iter().map(|t| t.name.as_str()).collect();
        return Err((format!("stages[{k}].drive"), format!("tool '{name}'"), names.join(", ")));
    }
    for (name, drive) in &stage.drive {
        check_drive(&format!("stages[{k}].drive.{name}"), drive)?;
    }
    let increments = [
        ("first_increment", stage.first_increment),
        ("largest_increment", stage.largest_increment),
    ];
    for (key, value) in increments.into_iter().filter_map(|(key, value)| Some((key, value?))) {
        let fits = value > 0.0 && value <= 1.0;
        need(fits, format!("stages[{k}].{key}"), value.to_string(), "above 0, at most 1")?;
    }
    if let (Some(first), Some(largest)) = (stage.first_increment, stage.largest_increment) {
        let allowed = format!("at most the stage's largest_increment, {largest}");
        need(
            first <= largest,
            format!("stages[{k}].first_increment"),
            first.to_string(),
            &allowed,
        )?;
    }
    let named = scene.stages.iter().position(|s| s.name == stage.name) == Some(k);
    need(named, format!("stages[{k}].name"), format!("'{}'", stage.name), "a name of its own")
}

fn check_drive(place: &str, drive: &Drive) -> Result<(), Fault> {
    let (key, course) = match drive {
        Drive::TravelMm(course) => ("travel_mm", course),
        Drive::AdvanceMm(course) => ("advance_mm", course),
        Drive::ForceN(course) => ("force_n", course),
        Drive::Spring(spring) => ("spring.force_n", &spring.force_n),
        Drive::Release(_) | Drive::Absent(_) => return Ok(()),
    };
    if let Drive::Spring(spring) = drive {
        let stiffness = spring.stiffness_n_per_mm;
        if !(stiffness > 0.0 && stiffness.is_finite()) {
            let place = format!("{place}.spring.stiffness_n_per_mm");
            return Err((place, stiffness.to_string(), "above 0".into()));
        }
    }
    if let Some([at, found, allowed]) = course.fault() {
        return Err((format!("{place}.{key}{at}"), found, allowed));
    }
    let pulls = |pair: &[f64; 2]| pair[1] < 0.0;
    match (drive, course.pairs().into_iter().find(pulls)) {
        (Drive::ForceN(_), Some([_, force])) => Err((
            format!("{place}.force_n"),
            force.to_string(),
            "0 or more: a tool pushes along its direction and cannot pull; `travel_mm` draws it back"
                .into(),
        )),
        _ => Ok(()),
    }
}

fn check_solver(solver: &SolverLimits) -> Result<(), Fault> {
    const FORCE_TOLERANCE_MIN: f64 = 1e-13;
    let fault = |key: &str, found: &dyn std::fmt::Debug, allowed: &str| {
        Err((format!("solver.{key}"), format!("{found:?}"), allowed.to_owned()))
    };
    let tolerance = solver.force_tolerance;
    if !(FORCE_TOLERANCE_MIN..0.1).contains(&tolerance) {
        return fault("force_tolerance", &tolerance, "1e-13 to 0.1");
    }
    for (key, count) in
        [("iterations", solver.iterations), ("wanted_iterations", solver.wanted_iterations)]
    {
        if count == 0 {
            return fault(key, &count, "at least 1");
        }
    }
    let step = solver.smallest_increment;
    if !(step > 0.0 && step <= 1.0) {
        return fault("smallest_increment", &step, "above 0, at most 1");
    }
    if let Some(error) = solver.increment_error
        && !(1e-4..=0.5).contains(&error)
    {
        return fault("increment_error", &error, "1e-4 to 0.5");
    }
    let transition = solver.friction_transition;
    if !(0.0..1.0).contains(&transition) {
        return fault("friction_transition", &transition, "0 to 1");
    }
    match solver.contact.stiffness() {
        Some(stiffness) if !(stiffness > 0.0 && stiffness.is_finite()) => {
            fault("contact.stiffness", &stiffness, "above 0")
        }
        _ => Ok(()),
    }
}

/// Largest number of elements of a blank.
pub(super) const ELEMENTS_MAX: usize = 20_000_000;
/// Largest number of layers through the thickness; two to eight resolve bending. With twice as many, a scene at the
/// limit needs twice the memory and, for the fronts of the factorisation, eight times the time.
const LAYERS_MAX: usize = 100;

fn check_blank(scene: &Scene) -> Result<(), Fault> {
    let blank = &scene.blank;
    check_lengths(blank)?;
    check_counts(blank)?;
    refine::check(&blank.refine)?;
    if let ElementKind::SolidShell { points, .. } = blank.element {
        let place = "blank.element.solid-shell.points".into();
        need(ElementKind::POINTS.contains(&points), place, points.to_string(), "3 to 10")?;
    }
    rolling::check(blank)?;
    for (k, load) in scene.loads.iter().enumerate() {
        if load.force_n.iter().any(|f| !f.is_finite()) {
            let found = format!("{:?}", load.force_n);
            return Err((format!("loads[{k}].force_n"), found, "numbers".into()));
        }
    }
    Ok(())
}

/// Checks sizes and thickness of a blank.
fn check_lengths(blank: &Blank) -> Result<(), Fault> {
    let lengths = match &blank.shape {
        BlankShape::Rectangle { size_mm: [x, y], .. } => {
            vec![("shape.rectangle.size_mm[0]", *x), ("shape.rectangle.size_mm[1]", *y)]
        }
        BlankShape::QuarterDisc { radius_mm, .. } => {
            vec![("shape.quarter_disc.radius_mm", *radius_mm)]
        }
        BlankShape::Disc { radius_mm, .. } => vec![("shape.disc.radius_mm", *radius_mm)],
        BlankShape::Mesh { .. } => Vec::new(),
    };
    // Hexahedra of a file have their own thickness.
    let own = matches!(blank.shape, BlankShape::Mesh { .. }) && blank.thickness_mm == 0.0;
    for (key, value) in lengths.into_iter().chain([("thickness_mm", blank.thickness_mm)]) {
        if !(value > 0.0 && value.is_finite() || own) {
            return Err((format!("blank.{key}"), value.to_string(), "above 0".into()));
        }
    }
    Ok(())
}

/// Checks elements and layers of a blank.
fn check_counts(blank: &Blank) -> Result<(), Fault> {
    let counts = match blank.shape {
        BlankShape::Rectangle { elements: [nx, ny], .. } => [nx, ny, blank.layers],
        // Upper bound: core plus two sides of it to the rim.
        BlankShape::QuarterDisc { core, rings, .. } => {
            [core, core.saturating_add(rings.saturating_mul(2)), blank.layers]
        }
        BlankShape::Disc { core, rings, .. } => {
            let across = core.saturating_add(rings.saturating_mul(2)).saturating_mul(2);
            [core.saturating_mul(2), across, blank.layers]
        }
        BlankShape::Mesh { .. } => [1, 1, blank.layers],
    };
    let count = counts.iter().try_fold(1usize, |n, &k| n.checked_mul(k));
    let none = matches!(
        blank.shape,
        BlankShape::QuarterDisc { rings: 0, .. } | BlankShape::Disc { rings: 0, .. }
    );
    if none || !count.is_some_and(|n| (1..=ELEMENTS_MAX).contains(&n)) {
        let allowed = format!("at least 1 each, at most {ELEMENTS_MAX} in all");
        return Err(("blank".into(), format!("elements {counts:?}"), allowed));
    }
    if blank.layers > LAYERS_MAX {
        let (found, allowed) = (blank.layers.to_string(), format!("1 to {LAYERS_MAX}"));
        return Err(("blank.layers".into(), found, allowed));
    }
    Ok(())
}
