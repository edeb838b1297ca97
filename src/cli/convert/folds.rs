//! Folded patches: refused or reported.

use std::collections::BTreeSet;

use super::args::{ConvertArgs, Edge};
use super::converted::Converted;
use super::print::print_report;
use crate::cli::exit::Failure;
use crate::cli::terminal::err;
use crate::mesh::io;

/// Prints and refuses a model with folded patches, unless they are allowed.
pub(super) fn refuse_folds(args: &ConvertArgs, made: &Converted) -> Result<(), Failure> {
    let count = made.report.folded.len();
    if count == 0 || args.how.allow_folds || args.edge() == Edge::Plain {
        return Ok(());
    }
    print_report(made);
    let file = args.file.display();
    let is_built_in = args.mesh.is_none() && args.how.mesher.is_built_in();
    let divided = is_built_in && !io::is_mesh(&args.file);
    let advice = if divided {
        "dividing these faces more finely was tried and did not unfold them; repair them in the CAD (`kanagata inspect FILE --health` \
         tells what is wrong there)"
    } else {
        "mesh finer there"
    };
    Err(Failure::input(format!(
        "{file}: {count} patches fold, on faces {}; allowed: none; {advice}, or write them with --allow-folds",
        face_list(made)
    )))
}

/// Indices of the first faces with folded patches.
fn face_list(made: &Converted) -> String {
    const LISTED_MAX: usize = 10;
    let of = |&patch: &u32| made.tool.faces[patch as usize];
    let faces: BTreeSet<u32> = made.report.folded.iter().map(of).collect();
    let listed: Vec<String> = faces.iter().take(LISTED_MAX).map(u32::to_string).collect();
    let more = if faces.len() > LISTED_MAX { ", ..." } else { "" };
    format!("{}{more}", listed.join(", "))
}

/// Warns about folded patches in a tool file, with a remedy.
pub(super) fn warn_of_folds(args: &ConvertArgs, made: &Converted) {
    let count = made.report.folded.len();
    if count == 0 {
        return;
    }
    let advice = if args.edge() == Edge::Plain {
        "--edge guarded or cad keeps edges from turning back"
    } else if args.mesh.is_none() && args.how.mesher.is_built_in() && !io::is_mesh(&args.file) {
        "without --allow-folds their faces are divided more finely, which may unfold them"
    } else {
        "a finer mesh may unfold them"
    };
    err!(
        "warning: {count} patches fold and are in the tool file, contact on them is not to be relied on; {advice}"
    );
}
