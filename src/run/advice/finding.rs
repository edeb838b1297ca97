//! A finding about a scene: level, description, remedy.

use std::fmt;

use serde::Serialize;

use kanagata_report::doubt::{Doubt, DoubtCode};

/// Severity of a finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// `run` refuses the scene.
    Error,
    /// The run ends, but its result must not be trusted as it is.
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

/// How to convert a tool again.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Conversion {
    /// Without the faces that the sheet of the scene cannot touch.
    Reachable,
    /// To this tolerance of the shape error [mm].
    Within(f64),
}

/// A finding about a scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// Severity.
    pub level: Level,
    /// Code of a doubt.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub code: Option<DoubtCode>,
    /// Where: a tool, a stage or a key; empty if none applies.
    #[serde(rename = "where", skip_serializing_if = "String::is_empty")]
    pub place: String,
    /// The value of the quantity, in the unit named in `what`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// The limit that `value` exceeds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limit: Option<f64>,
    /// What was found, where, and how bad it is.
    pub what: String,
    /// What to change, or the cost of the choice.
    pub remedy: String,
    /// `run --auto` applies the remedy.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub auto: bool,
    /// The conversion of the tool that `remedy` recommends.
    #[serde(skip)]
    pub conversion: Option<Conversion>,
    /// Estimated effect, for sorting within a level: relative error of the results. For a note that costs time only:
    /// fraction of the run time divided by 1000.
    pub effect: f64,
}

/// Effect of a note without estimate: sorted last.
const EFFECT_UNKNOWN: f64 = 0.0;

impl Finding {
    /// A finding of level note.
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

    /// A finding of level doubt.
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

    /// A finding of level error: `run` refuses the scene.
    #[must_use]
    pub fn error(place: String, what: String, remedy: String) -> Self {
        Self { level: Level::Error, place, effect: 1.0, ..Self::note(what, remedy) }
    }

    /// Sets the value and the limit that it exceeds. Infinite numbers are omitted.
    #[must_use]
    pub fn exceeds(self, [value, limit]: [f64; 2]) -> Self {
        let finite = |x: f64| x.is_finite().then_some(x);
        Self { value: finite(value), limit: finite(limit), ..self }
    }

    /// Sets the conversion that `remedy` recommends.
    #[must_use]
    pub fn conversion(self, conversion: Conversion) -> Self {
        Self { conversion: Some(conversion), ..self }
    }

    /// Sets the estimated effect.
    #[must_use]
    pub fn effect(self, effect: f64) -> Self {
        Self { effect, ..self }
    }

    /// The doubt; `None` for other levels.
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

/// Sorts by level, then by descending effect. The sort is stable.
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
