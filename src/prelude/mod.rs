//! What other programs build on: CAD, tools, scenes, runs and materials, an object each.
//!
//! The modules below the facade serve the two programs, and their items change with them. What stands here is kept.
//!
//! ```no_run
//! use kanagata::prelude::*;
//!
//! # fn main() -> Result<(), Error> {
//! let cad = Cad::read("die.igs")?;
//! let settings = ConvertSettings { sheet_side: Some([0.0, 0.0, 1.0]), ..ConvertSettings::within(0.01) };
//! let die = cad.convert(&settings)?;
//! let audit = die.audit(&cad, &AuditOptions::default())?;
//! println!("{} patches, shape error {:.4} mm", die.patches(), audit.report.worst_mm());
//! die.write("die.tool.json")?;
//!
//! let scene = Scene::read("cup.scene.json")?;
//! for finding in scene.check()?.findings {
//!     println!("{} {finding}", finding.level);
//! }
//! let run = scene.run("out", &RunOptions::default(), &mut |progress| {
//!     println!("{:3.0} %", 100.0 * progress.done);
//! })?;
//! println!("{:?}, {} doubts, thickness {:?}", run.verdict(), run.doubts().len(), run.record().thickness);
//! # Ok(())
//! # }
//! ```

mod audit;
mod cad;
mod convert;
mod error;
mod make;
mod make_tools;
mod material;
mod run;
mod scene;
mod sequence;
mod tool;

pub use self::cad::Cad;
pub use self::convert::ConvertSettings;
pub use self::error::{Error, ErrorKind};
pub use self::make_tools::{MadeTool, make_tools, make_tools_watched, make_tools_with};
pub use self::material::Material;
pub use self::run::{Run, RunProgress};
pub use self::scene::{Check, Scene};
pub use self::sequence::SequenceProgress;
pub use self::tool::Tool;
pub use crate::accuracy::{Limits as SequenceLimits, SequenceStatus, sequence_status};
pub use crate::audit::{Audit, AuditOptions, AuditReport};
pub use crate::cancel::Cancel;
pub use crate::contact::Projection;
pub use crate::convert::offset::{OffsetRequest, SheetReference};
pub use crate::convert::tolerance::Borders;
pub use crate::progress::Progress;
pub use crate::report::doubt::Doubt;
pub use crate::report::record::{
    AccuracyRecord, History, HistoryRow, QuantityRecord, RunRecord, SequenceEnd, Verdict,
};
pub use crate::run::advice::{Finding, Level};
pub use crate::run::{RunOptions, WriteReport};
pub use crate::scene::accuracy::Accuracy;
pub use crate::tool::ToolKind;
pub use crate::tool::selection::FaceSelection;
