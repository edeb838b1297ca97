//! Keyword lines of an Abaqus deck: the section they open, and unsupported keywords.

use std::collections::HashMap;

use super::{Deck, Kind, Section};
use crate::MeshError;

/// Unsupported keywords that create or move nodes and elements.
const REFUSED: [&str; 9] = [
    "INCLUDE",
    "NGEN",
    "NFILL",
    "NCOPY",
    "NMAP",
    "ELGEN",
    "ELCOPY",
    "SYSTEM",
    "SYMMETRICMODELGENERATION",
];

/// Prefixes of the names of four-node surface elements.
const SURFACES: [&str; 5] = ["S4", "M3D4", "CPS4", "CPE4", "CAX4"];

impl Deck<'_> {
    /// Processes a keyword line without its asterisk.
    pub(super) fn keyword(&mut self, text: &str) -> Result<(), MeshError> {
        let (name, parameters) = split_keyword(text);
        self.section = Section::Other;
        match name.as_str() {
            "NODE" => {
                self.check_rectangular(&parameters)?;
                self.only_here(&parameters)?;
                self.section = Section::Nodes;
            }
            "INITIALCONDITIONS" => {
                self.note_results(parameters.get("TYPE").map_or("", String::as_str));
            }
            "ELEMENT" => {
                self.only_here(&parameters)?;
                let kind = parameters.get("TYPE").map_or("", String::as_str);
                self.section = self.element_section(kind)?;
            }
            "PART" => {
                self.parts += 1;
                if self.parts > 1 && !self.elements.is_empty() {
                    return Err(self.error("a second *PART", "a deck of one part, the sheet"));
                }
            }
            "INSTANCE" => self.section = Section::Instance,
            name if REFUSED.contains(&name) => {
                let allowed = "nodes and elements written out in one file";
                return Err(self.error(format!("*{name}"), allowed));
            }
            name if is_misspelt(name) => {
                return Err(self.error(
                    format!("*{name}, a keyword that Abaqus does not have"),
                    "*NODE and *ELEMENT for nodes and elements",
                ));
            }
            _ => {}
        }
        Ok(())
    }

    /// Rejects nodes in a non-rectangular coordinate system.
    fn check_rectangular(&self, parameters: &HashMap<String, String>) -> Result<(), MeshError> {
        match parameters.get("SYSTEM").filter(|s| *s != "R") {
            Some(system) => {
                let found = format!("*NODE in the coordinate system '{system}'");
                Err(self.error(found, "rectangular coordinates"))
            }
            None => Ok(()),
        }
    }

    /// Records initial conditions of a formed sheet.
    fn note_results(&mut self, kind: &str) {
        if ["STRESS", "HARDENING", "PLASTICSTRAIN"].contains(&kind.replace(' ', "").as_str()) {
            self.results.push(format!("*INITIAL CONDITIONS, TYPE={kind}"));
        }
    }

    fn only_here(&self, parameters: &HashMap<String, String>) -> Result<(), MeshError> {
        match parameters.get("INPUT") {
            Some(file) => Err(self.error(format!("INPUT={file}"), "data in the deck itself")),
            None => Ok(()),
        }
    }

    fn element_section(&self, kind: &str) -> Result<Section, MeshError> {
        let of = |stem: &str| kind.strip_prefix(stem).is_some_and(letters);
        if of("C3D8") {
            Ok(Section::Elements(Kind::Solid))
        } else if of("SC8") || of("CSS8") {
            Ok(Section::Elements(Kind::ContinuumShell))
        } else if SURFACES.into_iter().any(of) {
            Ok(Section::Elements(Kind::Shell))
        } else if kind.starts_with("R3D") || kind.starts_with("MASS") || kind.starts_with("ROTARYI")
        {
            Ok(Section::Other)
        } else {
            Err(self.error(
                format!("element type '{kind}'"),
                "C3D8*, SC8R*, CSS8*, S4*, M3D4*, CPS4*, CPE4*, CAX4* (and rigid R3D*)",
            ))
        }
    }
}

/// Splits a keyword line into its name, without blanks, and its parameters, in upper case.
fn split_keyword(text: &str) -> (String, HashMap<String, String>) {
    let upper = text.to_uppercase();
    let mut words = upper.split(',');
    let name: String = words.next().unwrap_or("").split_whitespace().collect();
    let parameters = words
        .map(|w| {
            let (key, value) = w.split_once('=').unwrap_or((w, ""));
            (key.trim().to_owned(), value.trim().trim_matches('"').to_owned())
        })
        .collect();
    (name, parameters)
}

/// True when a keyword is one edit (insertion, deletion, substitution or transposition) from *NODE or *ELEMENT, whose
/// data would be ignored silently. No Abaqus keyword is.
fn is_misspelt(name: &str) -> bool {
    ["NODE", "ELEMENT"].into_iter().any(|known| one_edit(name.as_bytes(), known.as_bytes()))
}

fn one_edit(a: &[u8], b: &[u8]) -> bool {
    let start = a.iter().zip(b).take_while(|(x, y)| x == y).count();
    let (a, b) = (&a[start..], &b[start..]);
    let end = a.iter().rev().zip(b.iter().rev()).take_while(|(x, y)| x == y).count();
    match (&a[..a.len() - end], &b[..b.len() - end]) {
        ([_], []) | ([], [_]) | ([_], [_]) => true,
        ([p, q], [r, s]) => (p, q) == (s, r),
        _ => false,
    }
}

fn letters(rest: &str) -> bool {
    rest.chars().all(|c| c.is_ascii_alphabetic())
}
