//! `history.csv`, one line per increment, and `iterations.csv`, one line per iteration.

use std::io::{self, Write};
use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::csv;
use kanagata_files::{WriteError, write_atomic};

/// One increment: a line of `history.csv`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HistoryRow {
    /// Increment, from 1.
    pub increment: usize,
    /// Stage name.
    pub stage: String,
    /// Process time: number of completed stages plus the completed fraction of the current stage.
    pub time: f64,
    /// Travel of each tool from its initial position along its direction [mm].
    pub travel_mm: Vec<f64>,
    /// Force of each tool on the sheet along its direction, of the whole process [N]. For a released tool: its remaining
    /// force, which falls to zero over the stage.
    pub force_n: Vec<f64>,
    /// Mean contact pressure under each tool and the largest at a node [MPa]; zero without contact. Empty in histories of
    /// older programs.
    #[serde(default)]
    pub pressure_mpa: Vec<[f64; 2]>,
    /// Newton iterations of the increment.
    pub iterations: usize,
    /// Number of nodes in contact, and number of these that slip.
    pub contacts: [usize; 2],
    /// Energies since the start of the run, of the whole process.
    pub energy: Energies,
}

/// Energies since the start of the run [N mm].
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Energies {
    /// Work of the tools on the sheet.
    pub external: f64,
    /// Work of the internal forces: elastic, plastic, and stored by hardening.
    pub internal: f64,
    /// Frictional work.
    pub friction: f64,
}

/// A history: tool names and rows.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct History {
    /// Names of the tools, in the order of the scene.
    pub tools: Vec<String>,
    /// Increments in order.
    pub rows: Vec<HistoryRow>,
}

impl History {
    /// Writes the complete `history.csv`.
    ///
    /// # Errors
    /// [`WriteError`] when the folder is missing or full.
    pub fn write(&self, path: &Path) -> Result<(), WriteError> {
        write_atomic(path, |w| self.write_to(w))
    }

    /// Parses a file written by [`Self::write`].
    ///
    /// # Errors
    /// The line, and what was found there.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut lines = csv::rows(text).into_iter();
        let head = csv::cells(lines.next().unwrap_or(""));
        let tools: Vec<String> =
            head.iter().filter_map(|c| c.strip_suffix("_travel_mm")).map(str::to_owned).collect();
        // Histories of older programs have no pressures.
        let counts = [2 * tools.len(), 4 * tools.len()].map(|of_tools| of_tools + 9);
        if !counts.contains(&head.len()) || head[0] != "increment" {
            return Err(format!("the first line has {} columns", head.len()));
        }
        let mut rows = Vec::new();
        for (k, text) in lines.enumerate() {
            let row = parse_row(text, head.len() - 2, tools.len());
            rows.push(row.ok_or_else(|| format!("line {} is not an increment", k + 2))?);
        }
        Ok(Self { tools, rows })
    }

    /// Whether every increment has a travel and a force for each tool.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        let whole =
            |row: &HistoryRow| [row.travel_mm.len(), row.force_n.len()] == [self.tools.len(); 2];
        self.rows.iter().all(whole)
    }

    /// Names of tools that have travelled and had zero force in every increment.
    #[must_use]
    pub fn untouched(&self) -> Vec<String> {
        let never = |tool: &usize| {
            let travelled = self.rows.iter().any(|row| row.travel_mm[*tool] != 0.0);
            travelled && self.rows.iter().all(|row| row.force_n[*tool] == 0.0)
        };
        (0..self.tools.len()).filter(never).map(|tool| self.tools[tool].clone()).collect()
    }

    fn write_to(&self, w: &mut dyn Write) -> io::Result<()> {
        write!(w, "increment,stage,time")?;
        for tool in &self.tools {
            let head = |what: &str| csv::quoted(&format!("{tool}_{what}"));
            write!(w, ",{},{}", head("travel_mm"), head("force_n"))?;
        }
        writeln!(
            w,
            ",iterations,contact_nodes,slipping_nodes,external_work_nmm,internal_work_nmm,friction_work_nmm{}",
            self.pressure_heads()
        )?;
        let has_pressures = self.has_pressures();
        for row in &self.rows {
            write!(w, "{},{},{}", row.increment, csv::quoted(&row.stage), row.time)?;
            for (travel, force) in row.travel_mm.iter().zip(&row.force_n) {
                write!(w, ",{travel},{force}")?;
            }
            let [contacts, slips] = row.contacts;
            let e = &row.energy;
            write!(
                w,
                ",{},{contacts},{slips},{},{},{}",
                row.iterations, e.external, e.internal, e.friction
            )?;
            if has_pressures {
                row.pressure_mpa.iter().try_for_each(|[mean, max]| write!(w, ",{mean},{max}"))?;
            }
            writeln!(w)?;
        }
        Ok(())
    }

    /// Whether every increment has the contact pressure of each tool.
    #[must_use]
    pub fn has_pressures(&self) -> bool {
        self.rows.iter().all(|row| row.pressure_mpa.len() == self.tools.len())
    }

    /// Names of the columns of pressures, each with its comma.
    fn pressure_heads(&self) -> String {
        let tools: &[String] = if self.has_pressures() { &self.tools } else { &[] };
        let tools = tools.iter();
        let names =
            tools.flat_map(|tool| ["mean", "max"].map(|of| format!("{tool}_{of}_pressure_mpa")));
        names.map(|name| format!(",{}", csv::quoted(&name))).collect()
    }
}

/// Parses a row of `history.csv` with `behind` columns after the stage, whose name may contain commas, of so many tools.
fn parse_row(text: &str, behind: usize, tools: usize) -> Option<HistoryRow> {
    let (increment, rest) = text.split_once(',')?;
    let mut columns: Vec<&str> = rest.rsplitn(behind + 1, ',').collect();
    columns.reverse();
    if columns.len() != behind + 1 {
        return None;
    }
    let (columns, pressures) = columns.split_at_checked(2 * tools + 8)?;
    let [stage, time, pairs @ .., iterations, contacts, slips, external, internal, friction] =
        columns
    else {
        return None;
    };
    let number = |word: &&str| word.parse::<f64>().ok();
    let numbers = |words: &[&str]| words.iter().map(number).collect::<Option<Vec<f64>>>();
    let (pressures, numbers) = (numbers(pressures)?, numbers(pairs)?);
    Some(HistoryRow {
        increment: increment.parse().ok()?,
        stage: csv::unquoted(stage),
        time: number(time)?,
        travel_mm: numbers.iter().step_by(2).copied().collect(),
        force_n: numbers.iter().skip(1).step_by(2).copied().collect(),
        pressure_mpa: pressures.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect(),
        iterations: iterations.parse().ok()?,
        contacts: [contacts.parse().ok()?, slips.parse().ok()?],
        energy: Energies {
            external: number(external)?,
            internal: number(internal)?,
            friction: number(friction)?,
        },
    })
}

/// One Newton iteration: a line of `iterations.csv`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct IterationRow {
    /// Increment, from 1.
    pub increment: usize,
    /// Iteration, from 0, the predictor.
    pub iteration: usize,
    /// Norm of the residual over that of the contact forces.
    pub residual: f64,
    /// Largest violation of a contact condition [mm].
    pub gap_mm: f64,
    /// Norm of the last correction [mm].
    pub correction_mm: f64,
    /// Number of nodes in contact, of slipping nodes, and of changed contact states.
    pub contacts: [usize; 3],
}

/// Writes the complete `iterations.csv`: the convergence of every increment.
///
/// # Errors
/// [`WriteError`] when the folder is missing or full.
pub fn write_iterations(path: &Path, rows: &[IterationRow]) -> Result<(), WriteError> {
    write_atomic(path, |w| {
        writeln!(
            w,
            "increment,iteration,residual,gap_mm,correction_mm,contact_nodes,slipping_nodes,active_set_changes"
        )?;
        for r in rows {
            let [contacts, slips, changes] = r.contacts;
            writeln!(
                w,
                "{},{},{:e},{:e},{:e},{contacts},{slips},{changes}",
                r.increment, r.iteration, r.residual, r.gap_mm, r.correction_mm
            )?;
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn history_columns_are_as_documented() {
        let history = History {
            tools: vec!["die".into(), "punch".into()],
            rows: vec![HistoryRow {
                increment: 1,
                stage: "clamp".into(),
                time: 0.5,
                travel_mm: vec![0.0, 1.25],
                force_n: vec![-10.0, 10.0],
                pressure_mpa: Vec::new(),
                iterations: 4,
                contacts: [7, 2],
                energy: Energies::default(),
            }],
        };
        let mut text = Vec::new();
        history.write_to(&mut text).unwrap();
        let text = String::from_utf8(text).unwrap();
        assert!(text.starts_with(
            "increment,stage,time,die_travel_mm,die_force_n,punch_travel_mm,punch_force_n,iterations,"
        ));
        assert!(text.lines().nth(1).unwrap().starts_with("1,clamp,0.5,0,-10,1.25,10,4,7,2,"));
        let columns = |line: &str| line.split(',').count();
        assert_eq!(columns(text.lines().next().unwrap()), columns(text.lines().nth(1).unwrap()));
        assert_eq!(History::parse(&text), Ok(history.clone()));
        for name in ["clamp, and draw", "\"clamp\"", "two\nlines", "\"", "\r\n,\""] {
            let mut named = history.clone();
            named.rows[0].stage = name.into();
            let mut text = Vec::new();
            named.write_to(&mut text).unwrap();
            assert_eq!(History::parse(std::str::from_utf8(&text).unwrap()), Ok(named), "{name:?}");
        }
        // Stage and tool names without quotes.
        let commas = text.replace("clamp", "clamp, and draw");
        assert_eq!(History::parse(&commas).unwrap().rows[0].stage, "clamp, and draw");
        let cut = text.trim_end().trim_end_matches(|c| c != ',').trim_end_matches(',');
        assert!(History::parse(cut).unwrap_err().contains("line 2"));
        assert!(History::parse("").unwrap_err().contains("first line"));
    }

    #[test]
    fn a_row_without_the_force_or_travel_of_a_tool_is_not_whole() {
        let row = HistoryRow {
            increment: 1,
            stage: "draw".into(),
            time: 1.0,
            travel_mm: vec![1.0],
            force_n: vec![2.0],
            pressure_mpa: Vec::new(),
            iterations: 1,
            contacts: [0, 0],
            energy: Energies::default(),
        };
        let history = |row| History { tools: vec!["die".into()], rows: vec![row] };
        assert!(history(row.clone()).is_whole());
        assert!(!history(HistoryRow { force_n: vec![], ..row.clone() }).is_whole());
        assert!(!history(HistoryRow { travel_mm: vec![], ..row }).is_whole());
    }

    #[test]
    fn a_tool_that_travels_and_meets_nothing_is_found() {
        let row = |travel_mm: &[f64], force_n: &[f64]| HistoryRow {
            increment: 1,
            stage: "draw".into(),
            time: 1.0,
            travel_mm: travel_mm.to_vec(),
            force_n: force_n.to_vec(),
            pressure_mpa: Vec::new(),
            iterations: 1,
            contacts: [0, 0],
            energy: Energies::default(),
        };
        let tools = ["stands", "meets", "misses"].map(str::to_owned).to_vec();
        let rows =
            vec![row(&[0.0, 1.0, 1.0], &[0.0, -3.0, 0.0]), row(&[0.0, 0.0, 0.0], &[0.0, 0.0, 0.0])];
        assert_eq!(History { tools, rows }.untouched(), ["misses"]);
    }
}
