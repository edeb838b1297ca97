//! Numerical choices of a run as values of its scene.

use std::fmt;

use kanagata_scene::set_value::SetValue;
use kanagata_scene::types::{Blank, BlankShape};
use kanagata_solver::element::ElementKind;

/// Points through the thickness of a solid-shell in the first run, its default.
pub(super) const POINTS: u8 = 6;

/// Elements of a sheet in plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlanMesh {
    /// Elements along x and y of a rectangle.
    Rectangle([usize; 2]),
    /// Elements of the core and rings of a quarter disc.
    QuarterDisc([usize; 2]),
    /// Elements of the core and rings of a disc.
    Disc([usize; 2]),
}

impl PlanMesh {
    /// The mesh of a blank; `None` for a mesh file.
    pub(super) fn of(shape: &BlankShape) -> Option<Self> {
        match *shape {
            BlankShape::Rectangle { elements, .. } => Some(Self::Rectangle(elements)),
            BlankShape::QuarterDisc { core, rings, .. } => Some(Self::QuarterDisc([core, rings])),
            BlankShape::Disc { core, rings, .. } => Some(Self::Disc([core, rings])),
            BlankShape::Mesh { .. } => None,
        }
    }

    /// With `factor` times the elements along each direction, two at least; a single element across a strip remains single.
    /// A factor above 1.25 gives more elements.
    pub(super) fn scaled(self, factor: f64) -> Self {
        let more = |n: usize| (n as f64 * factor).round().max(2.0) as usize;
        match self {
            Self::Rectangle([n, 1]) if n > 1 => Self::Rectangle([more(n), 1]),
            Self::Rectangle([1, n]) if n > 1 => Self::Rectangle([1, more(n)]),
            Self::Rectangle(n) => Self::Rectangle(n.map(more)),
            Self::QuarterDisc(n) => Self::QuarterDisc(n.map(more)),
            Self::Disc(n) => Self::Disc(n.map(more)),
        }
    }

    /// Elements along both directions.
    pub(super) fn counts(self) -> [usize; 2] {
        let (Self::Rectangle(n) | Self::QuarterDisc(n) | Self::Disc(n)) = self;
        n
    }
}

impl fmt::Display for PlanMesh {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Rectangle([x, y]) => write!(f, "{x} x {y} elements"),
            Self::QuarterDisc([core, rings]) | Self::Disc([core, rings]) => {
                write!(f, "core of {core} x {core} elements, {rings} rings")
            }
        }
    }
}

/// Numerical choices of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// Elements in plan.
    pub mesh: PlanMesh,
    /// Level of refinement of every element in plan, as digits in their order; `None`: none is refined.
    pub levels: Option<String>,
    /// Layers of elements.
    pub layers: usize,
    /// Element formulation with its points through the thickness.
    pub element: ElementKind,
    /// Error of the forces from the length of the increments that is allowed (`solver.increment_error`).
    pub increment_error: f64,
}

impl Model {
    /// The model of a scene with an error of the increments; `None` for a blank from a mesh file.
    pub(super) fn of(blank: &Blank, increment_error: f64) -> Option<Self> {
        let mesh = PlanMesh::of(&blank.shape)?;
        Some(Self {
            mesh,
            levels: None,
            layers: blank.layers,
            element: blank.element,
            increment_error,
        })
    }

    /// Ratio of the lengths of the shortest elements of `other` to those of this model: the larger of both directions.
    pub(super) fn finer_than(&self, other: &Self) -> f64 {
        let shortest = |model: &Self| {
            let levels = model.levels.as_ref().and_then(|levels| levels.bytes().max());
            let splits = f64::from(1_u32 << levels.map_or(0, |digit| digit - b'0'));
            model.mesh.counts().map(|n| n as f64 * splits)
        };
        let pairs = shortest(self).into_iter().zip(shortest(other));
        pairs.map(|(a, b)| a / b.max(1.0)).fold(0.0, f64::max)
    }

    /// With the layers and points of a first run: solid-shells bend in one layer, hexahedra need those of the scene.
    pub(super) fn with_fewest(&self) -> Self {
        match self.points() {
            Some(points) => Self { layers: 1, ..self.with_points(points.min(POINTS)) },
            None => self.clone(),
        }
    }

    /// Points through the thickness of a layer, if the element has a choice.
    pub(super) fn points(&self) -> Option<u8> {
        match self.element {
            ElementKind::SolidShell { points, .. } => Some(points),
            _ => None,
        }
    }

    /// The same with `points` through the thickness of a layer of solid-shells.
    pub(super) fn with_points(&self, points: u8) -> Self {
        let element = match self.element {
            ElementKind::SolidShell { membrane, .. } => {
                ElementKind::SolidShell { points, membrane }
            }
            other => other,
        };
        Self { element, ..self.clone() }
    }

    /// The values of the scene that give this model, and the key `accuracy` removed.
    ///
    /// # Errors
    /// Never for a scene that has been read; the text of a path that is none.
    pub(super) fn set(&self) -> Result<Vec<SetValue>, String> {
        let mut out = Vec::new();
        let mut put = |path: &str, value: String| -> Result<(), String> {
            out.push(SetValue::new(path, &value)?);
            Ok(())
        };
        put("accuracy", "null".into())?;
        match self.mesh {
            PlanMesh::Rectangle([x, y]) => {
                put("blank.shape.rectangle.elements", format!("[{x},{y}]"))?;
            }
            PlanMesh::QuarterDisc([core, rings]) => {
                put("blank.shape.quarter_disc.core", core.to_string())?;
                put("blank.shape.quarter_disc.rings", rings.to_string())?;
            }
            PlanMesh::Disc([core, rings]) => {
                put("blank.shape.disc.core", core.to_string())?;
                put("blank.shape.disc.rings", rings.to_string())?;
            }
        }
        if let Some(levels) = &self.levels {
            put("blank.refine", format!("[{{\"levels\":\"{levels}\"}}]"))?;
        }
        put("blank.layers", self.layers.to_string())?;
        if let ElementKind::SolidShell { points, membrane } = self.element {
            let options =
                format!("{{\"solid-shell\":{{\"points\":{points},\"membrane\":{membrane}}}}}");
            put("blank.element", options)?;
        }
        put("solver.increment_error", self.increment_error.to_string())?;
        Ok(out)
    }

    /// A name for its folder.
    pub(super) fn name(&self) -> String {
        let [a, b] = self.mesh.counts();
        let points = self.points().map_or_else(String::new, |p| format!("-p{p}"));
        // The levels of a mesh follow from the runs before it.
        let refined = if self.levels.is_some() { "-refined" } else { "" };
        format!("{a}x{b}{refined}-l{}{points}", self.layers)
    }
}

impl fmt::Display for Model {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let layers = if self.layers == 1 { "layer" } else { "layers" };
        write!(f, "{}", self.mesh)?;
        if let Some(levels) = &self.levels {
            let refined = levels.chars().filter(|level| *level != '0').count();
            write!(f, " ({refined} of {} refined)", levels.len())?;
        }
        write!(f, ", {} {layers}", self.layers)?;
        if let Some(points) = self.points() {
            write!(f, " of {points} points")?;
        }
        write!(f, ", increments within {:.2} %", 100.0 * self.increment_error)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_scene::types::Scene;

    #[test]
    fn a_strip_remains_one_element_wide_and_others_have_at_least_two() {
        let scaled = |n, factor| PlanMesh::Rectangle(n).scaled(factor).counts();
        assert_eq!(scaled([70, 1], 0.5), [35, 1]);
        assert_eq!(scaled([70, 1], 2.0), [140, 1]);
        assert_eq!(scaled([9, 3], 0.1), [2, 2]);
        assert_eq!(scaled([1, 1], 1.4), [2, 2]);
        assert_eq!(PlanMesh::Disc([1, 2]).scaled(2.0).counts(), [2, 4]);
    }

    #[test]
    fn refined_models_are_as_fine_as_their_shortest_elements() {
        let of = |n, levels: Option<&str>| Model {
            mesh: PlanMesh::Rectangle(n),
            levels: levels.map(str::to_owned),
            layers: 1,
            element: ElementKind::default(),
            increment_error: 0.01,
        };
        assert_eq!(of([30, 20], None).finer_than(&of([10, 10], None)), 3.0);
        assert_eq!(of([2, 2], Some("0120")).finer_than(&of([4, 4], None)), 2.0);
        assert_eq!(of([6, 6], None).finer_than(&of([2, 2], Some("0120"))), 0.75);
    }

    #[test]
    fn a_model_sets_the_values_of_its_scene() {
        let text = r#"{"format": "kanagata-scene", "version": 1, "name": "a", "material": "DC04",
            "blank": {"shape": {"quarter_disc": {"radius_mm": 10, "core": 4, "rings": 6}}, "thickness_mm": 1},
            "tools": [{"name": "punch", "file": "punch.tool.json", "direction": [0, 0, -1]}],
            "solver": {"increment_error": 0.002},
            "stages": [{"name": "draw"}]}"#;
        let scene: Scene = serde_json::from_str(text).unwrap();
        let model = Model::of(&scene.blank, 0.003).unwrap();
        let finer = Model { mesh: model.mesh.scaled(2.0), layers: 2, ..model.with_points(9) };
        let mut value: serde_json::Value = serde_json::from_str(text).unwrap();
        for one in finer.set().unwrap() {
            one.apply(&mut value).unwrap();
        }
        let set: Scene = serde_json::from_value(value).unwrap();
        assert_eq!(Model::of(&set.blank, 0.003).unwrap(), finer);
        assert_eq!(set.solver.increment_error, Some(0.003));
        assert_eq!(finer.name(), "8x12-l2-p9");
    }
}
