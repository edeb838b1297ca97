//! Element formulations by name, as a scene gives them.

use std::ops::RangeInclusive;

use serde::de::{self, Deserialize, Deserializer, MapAccess, Visitor};

use super::{hex8_enhanced, modes, shape, solid_shell, tilt};

/// Which element formulation a body uses. A formulation with options may be named alone: `"solid-shell"`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
#[schemars(transform = allow_bare_name)]
pub enum ElementKind {
    /// Trilinear with mean dilatation, 2 x 2 x 2 points. Free of volumetric locking; locks in bending.
    Hex8,
    /// Trilinear with twelve condensed strain modes, 2 x 2 x 2 points. Bends without locking at moderate
    /// proportions; several layers through a sheet.
    Hex8Enhanced,
    /// Solid-shell with 2 x 2 x `points` points: bends a thin sheet with one layer of elements.
    SolidShell {
        /// Points through the thickness, 3 to 10. Even numbers are in two halves of the thickness with equal weights, within 2 % of the bending moment; odd ones are Gauss-Legendre points, 1 to 14 % low.
        #[schemars(default = "six", range(min = 3, max = 10))]
        points: u8,
        /// Whether the in-plane strains are assumed too, which a sheet that is drawn in needs. Without them a coarse mesh is too
        /// stiff (a fifth in the force of a deep corner), and the rim of an expanded hole thins too much (0.63 instead of 0.75
        /// with 18 elements a quarter).
        #[schemars(default = "yes")]
        membrane: bool,
    },
}

fn six() -> u8 {
    6
}

fn yes() -> bool {
    true
}

/// Names of the formulations, as they are written.
const NAMES: [&str; 3] = ["hex8", "hex8-enhanced", "solid-shell"];

/// Options of a solid-shell.
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct SolidShellOptions {
    #[serde(default = "six")]
    points: u8,
    #[serde(default = "yes")]
    membrane: bool,
}

impl Default for ElementKind {
    fn default() -> Self {
        Self::SolidShell { points: six(), membrane: yes() }
    }
}

impl<'de> Deserialize<'de> for ElementKind {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(KindVisitor)
    }
}

/// Deserialises a formulation: its name, or an object with its name and options.
struct KindVisitor;

impl<'de> Visitor<'de> for KindVisitor {
    type Value = ElementKind;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "an element: one of {}", NAMES.join(", "))
    }

    fn visit_str<E: de::Error>(self, name: &str) -> Result<ElementKind, E> {
        match name {
            "hex8" => Ok(ElementKind::Hex8),
            "hex8-enhanced" => Ok(ElementKind::Hex8Enhanced),
            "solid-shell" => Ok(ElementKind::default()),
            _ => Err(E::unknown_variant(name, &NAMES)),
        }
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<ElementKind, A::Error> {
        let Some(name) = map.next_key::<String>()? else {
            return Err(de::Error::invalid_length(0, &"the name of one element"));
        };
        if name != "solid-shell" {
            KindVisitor.visit_str::<A::Error>(&name)?;
            return Err(de::Error::custom(format!(
                "`{name}` has no options; write \"{name}\" alone"
            )));
        }
        let SolidShellOptions { points, membrane } = map.next_value()?;
        if map.next_key::<String>()?.is_some() {
            return Err(de::Error::custom("one element is allowed, not several"));
        }
        Ok(ElementKind::SolidShell { points, membrane })
    }
}

/// Adds to the schema that a solid-shell may be named without its options.
fn allow_bare_name(schema: &mut schemars::Schema) {
    let bare = schemars::json_schema!({
        "description": "Solid-shell with 6 points through the thickness; the default.",
        "type": "string",
        "const": "solid-shell"
    });
    if let Some(serde_json::Value::Array(choices)) = schema.get_mut("oneOf") {
        choices.push(bare.to_value());
    }
}

impl ElementKind {
    /// Numbers of points through the thickness that a solid-shell takes.
    pub const POINTS: RangeInclusive<u8> = 3..=solid_shell::COLUMN_POINTS_MAX as u8;

    /// Number of material points of an element.
    #[must_use]
    pub fn point_count(self) -> usize {
        match self {
            Self::Hex8 | Self::Hex8Enhanced => 8,
            Self::SolidShell { points, .. } => 4 * usize::from(points),
        }
    }

    /// Points and weights through the thickness on [-1, 1]; empty for hexahedra.
    #[must_use]
    pub fn thickness_rule(self) -> Vec<(f64, f64)> {
        match self {
            Self::Hex8 | Self::Hex8Enhanced => Vec::new(),
            Self::SolidShell { points, .. } => shape::thickness_rule(usize::from(points)),
        }
    }

    /// Number of state variables of an element besides the histories of its points.
    #[must_use]
    pub(crate) fn record_len(self) -> usize {
        match self.mode_count() {
            0 => 0,
            modes => modes::record_len(modes) + tilt::RECORD_LEN,
        }
    }

    /// Number of internal (condensed) unknowns of an element.
    #[must_use]
    pub fn mode_count(self) -> usize {
        match self {
            Self::Hex8 => 0,
            Self::Hex8Enhanced => hex8_enhanced::MODE_COUNT,
            Self::SolidShell { membrane: false, .. } => solid_shell::pairs::THICKNESS_MODES,
            Self::SolidShell { membrane: true, .. } => solid_shell::pairs::MEMBRANE_MODES,
        }
    }
}
