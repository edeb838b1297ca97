//! Values of a scene that are set from outside, as by an optimiser or a shell script.
//!
//! `tools.die.friction=0.08` sets one value before the scene is checked. Steps of a path are keys; an element of a list
//! is selected by its `name` or by its index from 0, after a dot or in brackets (for names with dots). Objects that are
//! missing on the way are created, so that keys with defaults can be set. The value is JSON, or else a text.

use std::fmt;
use std::str::FromStr;

use serde_json::{Map, Value};

use super::error::Fault;

/// Steps of a path; schemas have far fewer.
const STEPS_MAX: usize = 32;

/// An assignment `PATH=VALUE`.
#[derive(Debug, Clone, PartialEq)]
pub struct SetValue {
    text: String,
    path: Vec<String>,
    value: Value,
}

impl fmt::Display for SetValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl FromStr for SetValue {
    type Err = String;

    /// # Errors
    /// What is missing.
    fn from_str(text: &str) -> Result<Self, String> {
        let (path, value) = split(text).ok_or_else(|| {
            format!("found {text:?}; allowed: PATH=VALUE, such as tools.die.friction=0.08")
        })?;
        Self::new(path, value)
    }
}

/// Path and value: the first `=` outside brackets separates them.
fn split(text: &str) -> Option<(&str, &str)> {
    let mut depth = 0_usize;
    let at = text.char_indices().find(|&(_, c)| {
        match c {
            '[' => depth += 1,
            ']' => depth = depth.saturating_sub(1),
            _ => {}
        }
        c == '=' && depth == 0
    })?;
    Some((&text[..at.0], &text[at.0 + 1..]))
}

/// Steps of a path.
fn steps(path: &str) -> Result<Vec<String>, String> {
    let mut out = Vec::new();
    let mut rest = path;
    loop {
        let end = rest.find(['.', '[']).unwrap_or(rest.len());
        out.push(rest[..end].to_owned());
        rest = &rest[end..];
        while let Some(inner) = rest.strip_prefix('[') {
            let end = inner.find(']').ok_or_else(|| format!("{path}: a bracket is not closed"))?;
            out.push(inner[..end].to_owned());
            rest = &inner[end + 1..];
        }
        match rest.strip_prefix('.') {
            Some(more) => rest = more,
            None if rest.is_empty() => break,
            None => return Err(format!("{path}: found {rest:?} after a bracket; allowed: a dot")),
        }
    }
    if out.len() > STEPS_MAX || out.iter().any(String::is_empty) {
        return Err(format!("{path}: found an empty key, or more than {STEPS_MAX} keys"));
    }
    Ok(out)
}

impl SetValue {
    /// The assignment of a value, which is JSON or else a text.
    ///
    /// # Errors
    /// What is wrong with the path.
    pub fn new(path: &str, value: &str) -> Result<Self, String> {
        let json = serde_json::from_str(value).unwrap_or_else(|_| Value::String(value.into()));
        Ok(Self { text: format!("{path}={value}"), path: steps(path)?, value: json })
    }

    /// The value.
    #[must_use]
    pub fn value(&self) -> &Value {
        &self.value
    }

    /// Sets the value in a scene.
    ///
    /// # Errors
    /// The place up to which the path exists, what was found there, and what is allowed.
    pub fn apply(&self, scene: &mut Value) -> Result<(), Fault> {
        let mut place = String::new();
        let mut at = scene;
        for step in &self.path {
            at = enter(at, step).map_err(|(found, allowed)| (place.clone(), found, allowed))?;
            if !place.is_empty() {
                place.push('.');
            }
            place += step;
        }
        *at = self.value.clone();
        Ok(())
    }
}

/// The member of an object (created if missing) or the element of a list. The error: what was found, what is allowed.
fn enter<'v>(value: &'v mut Value, step: &str) -> Result<&'v mut Value, (String, String)> {
    if value.is_null() {
        *value = Value::Object(Map::new());
    }
    match value {
        Value::Object(object) => Ok(object.entry(step).or_insert(Value::Null)),
        Value::Array(list) => {
            let named = |v: &Value| v.get("name").and_then(Value::as_str) == Some(step);
            let index = step.parse().ok().filter(|&k: &usize| k < list.len());
            match list.iter().position(named).or(index) {
                Some(k) => Ok(&mut list[k]),
                None => Err((format!("no element {step:?}"), elements(list))),
            }
        }
        other => Err((
            format!("{} where {step:?} is set", beginning(other)),
            "an object or a list".into(),
        )),
    }
}

/// What selects the elements of a list: their names, or a range of indices.
fn elements(list: &[Value]) -> String {
    let names: Vec<&str> =
        list.iter().filter_map(|v| v.get("name").and_then(Value::as_str)).collect();
    match (names.is_empty(), list.len()) {
        (false, _) => names.join(", "),
        (true, 0) => "none, as the list is empty".into(),
        (true, count) => format!("0 to {}", count - 1),
    }
}

/// A value for a message: its start.
fn beginning(value: &Value) -> String {
    value.to_string().chars().take(40).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn set(text: &str, scene: &mut Value) -> Result<(), Fault> {
        text.parse::<SetValue>().unwrap().apply(scene)
    }

    #[test]
    fn keys_names_and_indices_lead_to_a_value() {
        let mut scene = json!({
            "tools": [{"name": "die", "friction": 0.1}, {"name": "punch 1.5"}],
            "symmetry": [{"at_mm": 0.0}],
        });
        set("tools.die.friction=0.08", &mut scene).unwrap();
        set("tools[punch 1.5].file=a=b.json", &mut scene).unwrap();
        set("symmetry[0].at_mm=-2e1", &mut scene).unwrap();
        set("symmetry.0.normal=x", &mut scene).unwrap();
        set("solver.steps={\"a\": [1]}", &mut scene).unwrap();
        assert_eq!(
            scene,
            json!({
                "tools": [{"name": "die", "friction": 0.08}, {"name": "punch 1.5", "file": "a=b.json"}],
                "symmetry": [{"at_mm": -20.0, "normal": "x"}],
                "solver": {"steps": {"a": [1]}},
            })
        );
    }

    #[test]
    fn a_path_that_leads_nowhere_is_named_with_what_is_there() {
        let mut scene = json!({"tools": [{"name": "die"}, {"name": "punch"}], "material": "steel"});
        let fault = set("tools.dye.friction=0.1", &mut scene).unwrap_err();
        assert_eq!(fault, ("tools".into(), "no element \"dye\"".into(), "die, punch".into()));
        let fault = set("material.hardening.k=500", &mut scene).unwrap_err();
        assert_eq!((fault.0.as_str(), fault.2.as_str()), ("material", "an object or a list"));
        for wrong in ["friction", "=3", "tools..x=1", "tools[0=1", "tools[0]x=1", "[0]=1"] {
            assert!(wrong.parse::<SetValue>().is_err(), "{wrong}");
        }
        assert!(format!("{}=1", vec!["a"; 33].join(".")).parse::<SetValue>().is_err());
    }
}
