//! Patches that fold: refused, or said.

use std::collections::BTreeSet;

use super::args::{ConvertArgs, Edge};
use super::made::Converted;
use super::print::print_report;
use crate::cli::exit::Failure;
use crate::cli::say::err;
use crate::mesh::io;

/// Refuses a model with folded patches, which it prints, unless they were asked for.
pub(super) fn refuse_folds(args: &ConvertArgs, made: &Converted) -> Result<(), Failure> {
    let count = made.report.folded.len();
    if count == 0 || args.allow_folds || args.edge() == Edge::Plain {
        return Ok(());
    }
    print_report(made);
    let file = args.file.display();
    let is_built_in = args.mesh.is_none() && args.mesher.is_built_in();
    let divided = is_built_in && !io::is_mesh(&args.file);
    let advice = if divided {
        "dividing these faces more finely was tried and did not unfold them; repair them in the CAD (`kanagata inspect FILE --health` \
         tells what is wrong there)"
    } else {
        "mesh finer there"
    };
    Err(Failure::input(format!(
        "{file}: {count} patches fold, on faces {}; allowed: none; {advice}, or write them with --allow-folds",
        faces_said(made)
    )))
}

/// Numbers of the faces with folded patches, the first few of them.
fn faces_said(made: &Converted) -> String {
    const MOST: usize = 10;
    let of = |&patch: &u32| made.tool.faces[patch as usize];
    let faces: BTreeSet<u32> = made.report.folded.iter().map(of).collect();
    let listed: Vec<String> = faces.iter().take(MOST).map(u32::to_string).collect();
    let more = if faces.len() > MOST { ", ..." } else { "" };
    format!("{}{more}", listed.join(", "))
}

/// Says what to do about folds that were written all the same.
pub(super) fn say_of_folds(args: &ConvertArgs, made: &Converted) {
    let count = made.report.folded.len();
    if count == 0 {
        return;
    }
    let advice = if args.edge() == Edge::Plain {
        "--edge guarded or cad keeps edges from turning back"
    } else if args.mesh.is_none() && args.mesher.is_built_in() && !io::is_mesh(&args.file) {
        "without --allow-folds their faces are divided more finely, which may unfold them"
    } else {
        "a finer mesh may unfold them"
    };
    err!(
        "warning: {count} patches fold and are in the tool file, contact on them is not to be relied on; {advice}"
    );
}
