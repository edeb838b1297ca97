//! A finding about a scene: its level, what it is, what to do.

use std::fmt;

use serde::Serialize;

use crate::report::doubt::{Doubt, DoubtCode};

/// How bad a finding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// `run` refuses the scene.
    Error,
    /// A run ends, and its result must not be trusted as it is.
    Doubt,
    /// A choice that costs accuracy or time.
    Note,
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Error => "error",
            Self::Doubt => "doubt",
            Self::Note => "note",
        })
    }
}

/// How the file of a tool is to be made again.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Conversion {
    /// Without the faces that the sheet of the scene cannot touch.
    Reachable,
    /// Within this shape error [mm].
    Within(f64),
}

/// A finding about a scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// How bad it is.
    pub level: Level,
    /// Code of a doubt.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub code: Option<DoubtCode>,
    /// Where, as far as it is a place: a tool, a stage, a key.
    #[serde(rename = "where", skip_serializing_if = "String::is_empty")]
    pub place: String,
    /// The quantity found, in the unit that `what` names.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// The limit that it exceeds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limit: Option<f64>,
    /// What was found, where, how bad.
    pub what: String,
    /// What to change, or what that costs.
    pub remedy: String,
    /// `run --auto` sees to it.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub auto: bool,
    /// Conversion of the tool that `remedy` asks for.
    #[serde(skip)]
    pub conversion: Option<Conversion>,
    /// Estimated effect, for the order within a level: relative error of the results, or, of what costs time only, the part of
    /// the run time over a thousand.
    pub effect: f64,
}

/// Effect of a note whose effect is not estimated: after all that are.
const EFFECT_UNKNOWN: f64 = 0.0;

impl Finding {
    /// A choice that costs accuracy or time.
    #[must_use]
    pub fn note(what: String, remedy: String) -> Self {
        Self {
            level: Level::Note,
            code: None,
            place: String::new(),
            value: None,
            limit: None,
            what,
            remedy,
            auto: false,
            conversion: None,
            effect: EFFECT_UNKNOWN,
        }
    }

    /// A reason to doubt the result.
    #[must_use]
    pub fn doubt(code: DoubtCode, place: String, what: String, remedy: String) -> Self {
        Self {
            level: Level::Doubt,
            code: Some(code),
            place,
            effect: 1.0,
            ..Self::note(what, remedy)
        }
    }

    /// What a run refuses.
    #[must_use]
    pub fn error(place: String, what: String, remedy: String) -> Self {
        Self { level: Level::Error, place, effect: 1.0, ..Self::note(what, remedy) }
    }

    /// With the quantity found and the limit that it exceeds.
    #[must_use]
    pub fn exceeds(self, [value, limit]: [f64; 2]) -> Self {
        let finite = |x: f64| x.is_finite().then_some(x);
        Self { value: finite(value), limit: finite(limit), ..self }
    }

    /// With the conversion that `remedy` asks for.
    #[must_use]
    pub fn conversion(self, conversion: Conversion) -> Self {
        Self { conversion: Some(conversion), ..self }
    }

    /// With an estimate of its effect.
    #[must_use]
    pub fn effect(self, effect: f64) -> Self {
        Self { effect, ..self }
    }

    /// The doubt, of a finding of that level.
    #[must_use]
    pub fn as_doubt(&self) -> Option<Doubt> {
        let code = self.code.filter(|_| self.level == Level::Doubt)?;
        Some(Doubt {
            code,
            place: self.place.clone(),
            value: self.value,
            limit: self.limit,
            text: format!("{} {}", self.what, self.remedy),
        })
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(code) = self.code {
            write!(f, "{code}: ")?;
        }
        let between = if self.level == Level::Note { ";" } else { "" };
        write!(f, "{}{between} {}", self.what, self.remedy)
    }
}

/// Sorts by level, then by effect, the largest first; findings of the same effect keep their order.
pub fn sort(findings: &mut [Finding]) {
    findings.sort_by(|a, b| a.level.cmp(&b.level).then(b.effect.total_cmp(&a.effect)));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn findings_are_sorted_by_level_and_effect() {
        let note =
            |what: &str, effect: f64| Finding::note(what.into(), String::new()).effect(effect);
        let doubt = Finding::doubt(DoubtCode::SceneUnits, String::new(), "d".into(), String::new());
        let error = Finding::error(String::new(), "e".into(), String::new());
        let mut all = vec![note("a", 0.01), note("b", 0.1), note("c", 0.1), doubt, error];
        sort(&mut all);
        let order: Vec<&str> = all.iter().map(|f| f.what.as_str()).collect();
        assert_eq!(order, ["e", "d", "b", "c", "a"]);
    }
}
