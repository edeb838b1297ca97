//! The records of a run folder: `history.csv`, a line an increment, `iterations.csv`, and `run.json`.

mod origin;
mod sheet;
mod warnings;

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::files::{WriteError, write_atomic};

pub use origin::{LeftOutRecord, Process};
pub use sheet::{
    OverEdgeRecord, PlasticRecord, ShearedRecord, SpringbackRecord, StrainRecord, ThicknessRecord,
    ThroughItselfRecord, ZigzagRecord,
};

/// One increment, as a line of `history.csv`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HistoryRow {
    /// Increment, from 1.
    pub increment: usize,
    /// Stage name.
    pub stage: String,
    /// Process time: stages done plus the share of the one under way.
    pub time: f64,
    /// Travel of each tool from its starting place along its direction [mm].
    pub travel_mm: Vec<f64>,
    /// Force of each tool on the sheet along its direction, of the whole process [N]; of one that is let go what it has left
    /// behind, which falls to nothing over the stage.
    pub force_n: Vec<f64>,
    /// Newton iterations of the increment.
    pub iterations: usize,
    /// Nodes in contact, and those of them that slip.
    pub contacts: [usize; 2],
    /// Energies since the start, of the whole process.
    pub energy: Energies,
}

/// Energies since the start of the run [N mm].
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Energies {
    /// Work of the tools on the sheet.
    pub external: f64,
    /// Work of the internal forces: elastic, plastic, and what hardening stores.
    pub internal: f64,
    /// Heat of friction.
    pub friction: f64,
}

/// A history in memory: tool names and rows.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct History {
    /// Tools, in the scene's order.
    pub tools: Vec<String>,
    /// Increments in order.
    pub rows: Vec<HistoryRow>,
}

impl History {
    /// Writes `history.csv` whole.
    ///
    /// # Errors
    /// [`WriteError`] when the folder is missing or full.
    pub fn write(&self, path: &Path) -> Result<(), WriteError> {
        write_atomic(path, |w| self.write_to(w))
    }

    /// Reads what [`Self::write`] has written.
    ///
    /// # Errors
    /// What was found, and in which line.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut lines = text.lines();
        let head: Vec<&str> = lines.next().unwrap_or("").split(',').collect();
        let tools: Vec<String> =
            head.iter().filter_map(|c| c.strip_suffix("_travel_mm")).map(str::to_owned).collect();
        let behind = 2 * tools.len() + 7;
        if head.len() != behind + 2 || head[0] != "increment" {
            return Err(format!("a first line of {} columns", head.len()));
        }
        let mut rows = Vec::new();
        for (k, text) in lines.enumerate() {
            let row = parse_row(text, behind);
            rows.push(row.ok_or_else(|| format!("line {} that is no increment", k + 2))?);
        }
        Ok(Self { tools, rows })
    }

    fn write_to(&self, w: &mut dyn Write) -> io::Result<()> {
        write!(w, "increment,stage,time")?;
        for tool in &self.tools {
            write!(w, ",{tool}_travel_mm,{tool}_force_n")?;
        }
        writeln!(
            w,
            ",iterations,contact_nodes,slipping_nodes,external_work_nmm,internal_work_nmm,friction_work_nmm"
        )?;
        for row in &self.rows {
            write!(w, "{},{},{}", row.increment, row.stage, row.time)?;
            for (travel, force) in row.travel_mm.iter().zip(&row.force_n) {
                write!(w, ",{travel},{force}")?;
            }
            let [contacts, slips] = row.contacts;
            let e = &row.energy;
            writeln!(
                w,
                ",{},{contacts},{slips},{},{},{}",
                row.iterations, e.external, e.internal, e.friction
            )?;
        }
        Ok(())
    }
}

/// A line of `history.csv` with `behind` columns behind the stage, whose name may have commas.
fn parse_row(text: &str, behind: usize) -> Option<HistoryRow> {
    let (increment, rest) = text.split_once(',')?;
    let mut columns: Vec<&str> = rest.rsplitn(behind + 1, ',').collect();
    columns.reverse();
    let [stage, time, pairs @ .., iterations, contacts, slips, external, internal, friction] =
        &columns[..]
    else {
        return None;
    };
    let number = |word: &&str| word.parse::<f64>().ok();
    let numbers: Vec<f64> = pairs.iter().map(number).collect::<Option<_>>()?;
    if numbers.len() + 7 != behind {
        return None;
    }
    Some(HistoryRow {
        increment: increment.parse().ok()?,
        stage: (*stage).to_owned(),
        time: number(time)?,
        travel_mm: numbers.iter().step_by(2).copied().collect(),
        force_n: numbers.iter().skip(1).step_by(2).copied().collect(),
        iterations: iterations.parse().ok()?,
        contacts: [contacts.parse().ok()?, slips.parse().ok()?],
        energy: Energies {
            external: number(external)?,
            internal: number(internal)?,
            friction: number(friction)?,
        },
    })
}

/// One Newton iteration, as a line of `iterations.csv`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct IterationRow {
    /// Increment, from 1.
    pub increment: usize,
    /// Iteration, from 0: the predictor.
    pub iteration: usize,
    /// Unbalanced force over the contact forces.
    pub residual: f64,
    /// Largest violation of a contact condition [mm].
    pub gap_mm: f64,
    /// Norm of the correction that led here [mm].
    pub correction_mm: f64,
    /// Nodes in contact, those of them that slip, and contact states changed.
    pub contacts: [usize; 3],
}

/// Writes `iterations.csv` whole: the convergence of every increment.
///
/// # Errors
/// [`WriteError`] when the folder is missing or full.
pub fn write_iterations(path: &Path, rows: &[IterationRow]) -> Result<(), WriteError> {
    write_atomic(path, |w| {
        writeln!(
            w,
            "increment,iteration,residual,gap_mm,correction_mm,contact_nodes,slipping_nodes,changes"
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

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Still going, or killed.
    Running,
    /// All stages done.
    Completed,
    /// The solver gave up; the last good state is on disk.
    NoConvergence,
    /// Stopped from outside; it can go on from its checkpoint.
    Stopped,
}

/// `run.json`: what went in, what it cost, how it ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RunRecord {
    /// `kanagata-run`.
    pub format: String,
    /// File version: 1.
    pub version: u32,
    /// Program version that wrote it.
    pub program: String,
    /// Scene name.
    pub name: String,
    /// How it ended.
    pub verdict: Verdict,
    /// What the solver said when it gave up.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub message: Option<String>,
    /// Increments done.
    pub increments: usize,
    /// Newton iterations in them, those of cut increments included.
    pub iterations: usize,
    /// Increments that were cut and tried again.
    pub cuts: usize,
    /// Times the sheet was followed to a balance that is not near the last one: a snap, or its release where no balance lasted.
    #[serde(default)]
    pub snaps: usize,
    /// Energy set free in that [N mm].
    #[serde(default)]
    pub snap_work_nmm: f64,
    /// Increments in which contact states came round in a circle and dampers, taken away again, led to a balance.
    #[serde(default)]
    pub steadied: usize,
    /// Increments that ended in a balance that does not last: the slightest push would take the sheet away from it (it would
    /// wrinkle or buckle), and shorter steps found no other.
    #[serde(default)]
    pub unstable: usize,
    /// The first of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_unstable: Option<usize>,
    /// Times the sheet buckled: it was pushed out of a balance that does not last along the motion in which it gives way, and
    /// came to one that does.
    #[serde(default)]
    pub buckles: usize,
    /// The increment of the first of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_buckle: Option<usize>,
    /// Factorisations of the matrix.
    #[serde(default)]
    pub factorisations: usize,
    /// Times the factors were brought up to date for a changed active set instead.
    #[serde(default)]
    pub updates: usize,
    /// Times blocks of contact states went back and forth, so that only a part of them was changed.
    #[serde(default)]
    pub cycling: usize,
    /// Wall time [s].
    pub wall_s: f64,
    /// Processor time of all threads [s].
    pub cpu_s: f64,
    /// Largest memory of the process [MB].
    pub peak_mb: f64,
    /// Wall time by phase [s]: `search` (global search of the tools and projection on their patches, which alternate node by
    /// node), `contact` (its conditions), `elements` (element loop and assembly of the matrix), `factor`, `update` (factors
    /// brought up to date), `solve` (substitution), `stability` (a factorisation for every balance, to see whether it lasts).
    pub timings_s: BTreeMap<String, f64>,
    /// Threads used.
    pub threads: usize,
    /// Unknowns of the model.
    pub unknowns: usize,
    /// Largest out-of-balance of tool forces against nodal contact forces, as a share of the force.
    pub force_balance: f64,
    /// Energy that does not close, as a share of `work_nmm`, or of what rounding makes of nothing where that is more.
    pub energy_balance: f64,
    /// Work of the inner forces by the trapezoidal rule that is neither elastic energy nor plastic work, as the same share: it
    /// falls with the increments' length.
    #[serde(default)]
    pub stored_balance: f64,
    /// Work that forces have done on the sheet which tools that were let go had left behind [N mm]: below 0 where it springs back
    /// against them.
    #[serde(default)]
    pub left_behind_nmm: f64,
    /// Work against what keeps fibres of the elements from tilting by turns under pressure through the thickness, as no sheet
    /// does [N mm]: what the mesh is too coarse for.
    #[serde(default)]
    pub artificial_nmm: f64,
    /// The most work that had been done on the sheet, or by its inner forces, at any increment [N mm].
    #[serde(default)]
    pub work_nmm: f64,
    /// Volume of the sheet that does not balance, as a share of it, largest over the increments: volumes of the elements
    /// against what the elastic strains of their points leave of the undeformed ones, summed without regard to sign.
    /// None for a material without plasticity.
    #[serde(default)]
    pub volume_balance: Option<f64>,
    /// Deepest penetration of a node at the end of an increment [mm].
    pub penetration_mm: f64,
    /// Thickness of the sheet at the last balance; none in what an older program wrote.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thickness: Option<ThicknessRecord>,
    /// What `check` says of the scene that makes its results doubtful.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub doubts: Vec<String>,
    /// What makes the results doubtful, those of the scene among them: what the terminal warns of.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// Where the sheet passes through itself: nothing keeps it from that.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub through_itself: Option<ThroughItselfRecord>,
    /// Where columns of the mesh lean to opposite sides by turns: forces are far too low there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub zigzag: Option<ZigzagRecord>,
    /// Where friction shears a pressed sheet as far as it bears, and its elements or layers do not follow: forces are wrong by
    /// factors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sheared: Option<ShearedRecord>,
    /// Where the sheet bends over the free border of a tool: forces there are of the mesh.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub over_edge: Option<OverEdgeRecord>,
    /// Strains of the sheet at the last balance; none in what an older program wrote.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub strain: Option<StrainRecord>,
    /// From the last balance with tools to the present one without; none while tools are there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub springback: Option<SpringbackRecord>,
    /// Order of convergence of the Newton iteration: median over the increments that show one (a quadratic
    /// iteration has 2).
    pub convergence_order: Option<f64>,
    /// SHA-256 of the scene and of every file it names (tools, a mesh of the blank, a history), by path as the scene has it.
    pub inputs: BTreeMap<String, String>,
    /// The scene file, as a whole path.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene: Option<String>,
    /// Stages of the scene; 0 when an older program wrote this.
    #[serde(default)]
    pub stages: usize,
    /// What `--auto` left out: patches that the sheet did not come near.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<LeftOutRecord>,
    /// The process that wrote this, where the system names it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub process: Option<Process>,
}

impl RunRecord {
    /// Writes `run.json` whole.
    ///
    /// # Errors
    /// [`WriteError`] when the folder is missing or full.
    pub fn write(&self, path: &Path) -> Result<(), WriteError> {
        write_atomic(path, |w| {
            serde_json::to_writer_pretty(&mut *w, self)?;
            writeln!(w)
        })
    }
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
        let commas = text.replace("clamp", "clamp, and draw");
        assert_eq!(History::parse(&commas).unwrap().rows[0].stage, "clamp, and draw");
        let cut = text.trim_end().trim_end_matches(|c| c != ',').trim_end_matches(',');
        assert!(History::parse(cut).unwrap_err().contains("line 2"));
        assert!(History::parse("").unwrap_err().contains("first line"));
    }
}
