//! `kanagata material fit FILE`: a hardening law for a measured curve.

use std::path::Path;

use serde_json::Value;

use super::exit::{Exit, Failure};
use super::terminal::{err, out};
use crate::solver::material::fit::{Fitted, fit};
use crate::solver::material::hardening::Hardening;

/// A hardening law that can be fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Law {
    /// `K (eps0 + p)^n`
    Swift,
    /// `sigma0 + Q (1 - exp(-b p))`
    Voce,
    /// A weighted sum of both, each with its own best parameters
    SwiftVoce,
}

impl Law {
    fn of(law: &Hardening) -> Option<Self> {
        match law {
            Hardening::Swift { .. } => Some(Self::Swift),
            Hardening::Voce { .. } => Some(Self::Voce),
            Hardening::SwiftVoce { .. } => Some(Self::SwiftVoce),
            Hardening::Ludwik { .. } | Hardening::Table { .. } => None,
        }
    }
}

/// Fits hardening laws to the curve of a file. Prints the requested law, or the best one, as JSON, and the errors of all
/// laws on standard error.
///
/// # Errors
/// Exit code 2 when the file has no curve, 4 when it cannot be read.
pub(super) fn run(path: &Path, asked: Option<Law>) -> Result<Exit, Failure> {
    let refused = |what: String| Failure::input(format!("{}: {what}", path.display()));
    let text = crate::files::read_text(path, crate::files::Input::Description)
        .map_err(|error| Failure::new(Exit::Io, format!("{}: {error}", path.display())))?;
    let (strain, stress) = curve(&text).map_err(refused)?;
    let fitted = fit(&strain, &stress).map_err(|error| refused(error.to_string()))?;
    for one in &fitted {
        err!("{}", errors_of(one));
    }
    let wanted = |one: &&Fitted| asked.is_none_or(|law| Law::of(&one.law) == Some(law));
    let Some(best) = fitted.iter().find(wanted) else {
        return Err(refused("no such law that hardens fits the curve; leave --law out".into()));
    };
    let text = serde_json::to_string(&best.law).map_err(|error| refused(error.to_string()))?;
    out!("{{\"hardening\": {text}}}");
    Ok(Exit::Done)
}

fn errors_of(one: &Fitted) -> String {
    let name = match Law::of(&one.law) {
        Some(Law::Swift) => "Swift",
        Some(Law::Voce) => "Voce",
        _ => "Swift-Voce",
    };
    format!(
        "{name:<10} root mean square error {:.3} MPa, largest {:.3} MPa at a strain of {:.4}",
        one.rms_mpa, one.largest_mpa, one.at
    )
}

/// Plastic strains and true stresses [MPa] of a table in a card or a scene, or of two columns of text.
fn curve(text: &str) -> Result<(Vec<f64>, Vec<f64>), String> {
    if text.trim_start().starts_with('{') {
        let value: Value = serde_json::from_str(text).map_err(|error| error.to_string())?;
        let table = value.pointer("/hardening").or(value.pointer("/material/hardening"));
        return of_table(table.ok_or("no `hardening` of a card or of a scene's material")?);
    }
    let (mut strain, mut stress) = (Vec::new(), Vec::new());
    for (k, line) in text.lines().enumerate() {
        let cells = line.split([',', ';', ' ', '\t']).map(str::trim).filter(|c| !c.is_empty());
        let numbers: Option<Vec<f64>> = cells.map(|c| c.parse().ok()).collect();
        match numbers.as_deref() {
            Some([]) => {}
            Some(&[p, s, ..]) => {
                strain.push(p);
                stress.push(s);
            }
            // Column names and comments precede the first point.
            _ if strain.is_empty() => {}
            _ => {
                return Err(format!(
                    "line {}: allowed: a plastic strain and a true stress [MPa]",
                    k + 1
                ));
            }
        }
    }
    Ok((strain, stress))
}

fn of_table(table: &Value) -> Result<(Vec<f64>, Vec<f64>), String> {
    let column = |key: &str| -> Result<Vec<f64>, String> {
        let list = table.get(key).and_then(Value::as_array);
        let numbers = list.and_then(|l| l.iter().map(Value::as_f64).collect());
        numbers.ok_or(format!("hardening.{key}: allowed: a list of numbers (a law `table`)"))
    };
    Ok((column("strain")?, column("stress")?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_are_read_from_cards_scenes_and_columns() {
        let table = r#"{"law": "table", "strain": [0, 0.1], "stress": [100, 200.5]}"#;
        let expected = (vec![0.0, 0.1], vec![100.0, 200.5]);
        for text in [
            format!("{{\"hardening\": {table}}}"),
            format!("{{\"material\": {{\"hardening\": {table}}}}}"),
            "plastic strain; stress\n# measured\n\n0;100\n0.1;200.5;3\n".into(),
            "0 100\r\n0.1\t200.5".into(),
        ] {
            assert_eq!(curve(&text).unwrap(), expected, "{text}");
        }
        for (text, word) in [
            ("{", "EOF"),
            ("{\"hardening\": {\"law\": \"swift\"}}", "hardening.strain"),
            ("{}", "no `hardening`"),
            ("0 1\n0.1 x", "line 2"),
        ] {
            assert!(curve(text).unwrap_err().contains(word), "{text}");
        }
    }
}
