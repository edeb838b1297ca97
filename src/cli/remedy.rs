//! Remedies on the command line for errors of the library. Errors of the library do not mention options and commands;
//! this module is the only place that does.

use std::error::Error;
use std::path::Path;

use crate::audit::AuditError;
use crate::cad::offset::OffsetError;
use crate::cad::usable::Unusable;
use crate::convert::ConvertError;
use crate::convert::bezier::BezierError;
use crate::convert::select::SelectError;
use crate::convert::tolerance::ToleranceError;
use crate::files::{FileKind, WrongKind};
use crate::mesh::MeshError;
use crate::reach::ReachError;
use crate::run::lock::Holder;
use crate::run::report::ReportError;
use crate::run::restart::Restart;
use crate::run::status::StatusError;
use crate::run::{CheckpointError, RunError};
use crate::scene::SceneError;
use crate::solver::SimulationError;
use crate::study::StudyError;
use crate::study::run_case::CaseError;
use crate::tool::file::ToolFileError;

const CONVERT: &str = "make the tool file with `kanagata convert`";
const ANOTHER_FOLDER: &str = "another folder with -o";
const MATERIALS: &str = "a card that `kanagata material list` names; `kanagata material fit` gives a law for a measured curve";

/// The remedy for an error, or for its source.
pub(super) fn remedy(error: &(dyn Error + 'static)) -> Option<String> {
    of_one(error).or_else(|| remedy(error.source()?))
}

fn of_one(error: &(dyn Error + 'static)) -> Option<String> {
    let of_cad = || {
        let of_mesh = || error.downcast_ref().and_then(of_mesh);
        let of_tolerance = || error.downcast_ref().and_then(of_tolerance);
        let of_bezier = || error.downcast_ref().and_then(of_bezier);
        let of_reach = || error.downcast_ref().and_then(of_reach);
        let of_convert = || error.downcast_ref().and_then(of_convert);
        let of_select = || error.downcast_ref().map(of_select);
        let of_offset = || error.downcast_ref().and_then(of_offset);
        of_select()
            .or_else(of_offset)
            .or_else(of_mesh)
            .or_else(of_convert)
            .or_else(of_tolerance)
            .or_else(of_bezier)
            .or_else(of_reach)
            .or_else(|| error.downcast_ref().and_then(of_unusable))
    };
    let of_tool = || {
        let of_audit = || error.downcast_ref().and_then(of_audit);
        error.downcast_ref().and_then(of_tool_file).or_else(of_audit)
    };
    let of_run = || {
        let of_scene = || error.downcast_ref().and_then(of_scene);
        let of_solver = || error.downcast_ref().and_then(of_solver);
        let of_status = || error.downcast_ref().and_then(of_status);
        let of_study = || error.downcast_ref().and_then(of_study);
        let of_case = || error.downcast_ref().and_then(of_case);
        let of_report = || error.downcast_ref().and_then(of_report);
        let of_run = error.downcast_ref().and_then(of_run).or_else(of_case);
        of_run
            .or_else(of_scene)
            .or_else(of_solver)
            .or_else(of_status)
            .or_else(of_study)
            .or_else(of_report)
    };
    of_cad().or_else(of_tool).or_else(of_run)
}

fn of_select(_: &SelectError) -> String {
    "`kanagata inspect FILE --tree` lists bodies, layers and colours with the numbers of their faces".into()
}

fn of_unusable(error: &Unusable) -> Option<String> {
    match error {
        Unusable::Overlap { .. } => Some("`kanagata inspect --health` names the faces".into()),
        Unusable::LostFaces { .. } => Some("--skip-bad-faces to continue without them".into()),
        _ => None,
    }
}

fn of_offset(error: &OffsetError) -> Option<String> {
    let try_this = match error {
        OffsetError::Sharp { .. } => {
            "--faces, --facing or --within choose faces between the sharp edges; --smooth-deg allows a larger angle"
        }
        OffsetError::Folds { .. } | OffsetError::Overlaps { .. } => {
            "a smaller --offset, or --faces, --facing or --within for faces without these places"
        }
        _ => return None,
    };
    Some(try_this.into())
}

fn of_mesh(error: &MeshError) -> Option<String> {
    let try_this = match error {
        MeshError::NoFaces { .. } => "`kanagata inspect FILE` lists what the file holds",
        MeshError::Option { option, .. } => return of_option(option),
        MeshError::Faces { .. } => {
            "--arc-divisions, --max-size-mm or --mesher gmsh; --skip-bad-faces continues without these faces"
        }
        MeshError::Check { .. } => {
            "--arc-divisions or --max-size-mm for a finer mesh, another --mesher or --gmsh-algorithm; `kanagata inspect FILE --health` \
             examines the CAD file"
        }
        MeshError::GmshAbsent { .. } => {
            "tools/setup installs gmsh; name it with --gmsh PATH, or use --mesher mapped"
        }
        MeshError::GmshFailed { .. } => {
            "another --gmsh-algorithm, more time with --gmsh-limit SECONDS, another program with --gmsh PATH, or --mesher mapped"
        }
        _ => return None,
    };
    Some(try_this.into())
}

fn of_convert(error: &ConvertError) -> Option<String> {
    let try_this = "--arc-divisions or --max-size-mm for a finer mesh; --kind nagata needs fewer searches than bezier";
    matches!(error, ConvertError::Searches { .. }).then(|| try_this.into())
}

/// The command-line option of a field of mesher options or of a goal.
fn of_option(field: &str) -> Option<String> {
    let option = match field {
        "arc_divisions" => "--arc-divisions",
        "max_size" => "--max-size-mm",
        "chord_error" => "--chord-mm",
        "limit_s" => "--gmsh-limit",
        "tol_mm" => "--tol",
        "normal_deg" => "--normal-tol",
        _ => return None,
    };
    Some(format!("another value of {option}"))
}

fn of_tolerance(error: &ToleranceError) -> Option<String> {
    match error {
        ToleranceError::Goal { what, .. } => of_option(what),
        ToleranceError::NotReached { .. } => Some("a larger --tol or --normal-tol".into()),
        ToleranceError::NoPatches { .. } => {
            Some("--arc-divisions N with --allow-folds shows where they fold".into())
        }
        ToleranceError::Apart { .. } => Some("--borders conforming".into()),
        ToleranceError::TooFew { least } => Some(format!("--patches {least} or more, or --tol")),
        ToleranceError::Mesh(error) => of_mesh(error),
        _ => None,
    }
}

fn of_bezier(error: &BezierError) -> Option<String> {
    match error {
        BezierError::NotReached { divisions: None, .. } => {
            Some("a larger --tol, or --allow-folds".into())
        }
        BezierError::NotReached { .. } => Some(
            "--kind nagata, and that file with --to bezier; a larger --tol, or --allow-folds; `kanagata inspect FILE --health` says \
             whether these faces are faulty"
                .into(),
        ),
        BezierError::Mesh(error) => of_mesh(error),
        _ => None,
    }
}

fn of_reach(error: &ReachError) -> Option<String> {
    match error {
        ReachError::NoTool { .. } => Some("the name of the tool in the scene with --name".into()),
        ReachError::Nothing { .. } => Some("the command without --reach".into()),
        ReachError::Mesh(error) => of_mesh(error),
    }
}

fn of_audit(error: &AuditError) -> Option<String> {
    match error {
        AuditError::NoPatches => Some(CONVERT.into()),
        AuditError::Samples { .. } => Some("another value of --samples".into()),
        _ => None,
    }
}

fn of_tool_file(error: &ToolFileError) -> Option<String> {
    if let ToolFileError::Kind(wrong) = error { of_kind(wrong) } else { Some(CONVERT.into()) }
}

/// What to do with a file of another kind than expected.
fn of_kind(wrong: &WrongKind) -> Option<String> {
    let try_this = match (wrong.found, wrong.expected) {
        (FileKind::Step | FileKind::Iges | FileKind::Mesh, FileKind::Tool) => {
            "`kanagata convert FILE -o NAME.tool.json` makes a tool file of it"
        }
        (FileKind::Step | FileKind::Iges | FileKind::Mesh, _) => {
            "`kanagata convert FILE -o NAME.tool.json` makes a tool file of it, which a scene names as `file` of a tool"
        }
        (FileKind::Tool, _) => {
            "name it as `file` of a tool in a scene; `kanagata audit` measures its shape error"
        }
        (FileKind::Scene, _) => "`kanagata-solve check` and `kanagata-solve run` take scenes",
        (FileKind::Study, _) => "`kanagata study` takes studies",
        (FileKind::Run | FileKind::Case, _) => {
            "`kanagata-solve status` and `kanagata report` take the folder of this file"
        }
        _ => return None,
    };
    Some(try_this.into())
}

fn of_scene(error: &SceneError) -> Option<String> {
    match error {
        SceneError::Tool { has_cad: true, path, .. } => Some(format!(
            "`kanagata run {} -o DIR` makes the tool files from the CAD that the scene names, checks the scene and runs it",
            path.display()
        )),
        SceneError::Tool { cause, .. } => of_tool_file(cause),
        SceneError::Kind(wrong) => of_kind(wrong),
        SceneError::Value { place, .. } => of_key(place),
        SceneError::CardFile { .. } | SceneError::Material { .. } => Some(MATERIALS.into()),
        _ => None,
    }
}

/// The remedy for the value of a scene's key.
fn of_key(key: &str) -> Option<String> {
    if key.starts_with("material") {
        return Some(MATERIALS.into());
    }
    let is_tool_file = key.starts_with("tools[") && key.ends_with("].file");
    is_tool_file
        .then(|| format!("{CONVERT}; --flip or the other --sheet-side turns its normals round"))
}

fn of_run(error: &RunError) -> Option<String> {
    match error {
        RunError::Scene(error) => of_scene(error),
        RunError::Busy { holder, .. } => Some(of_busy(holder)),
        RunError::LockLost { .. } => Some(ANOTHER_FOLDER.into()),
        RunError::Unfinished { restart, .. } => Some(format!(
            "`{}` continues it, --overwrite discards it; or {ANOTHER_FOLDER}",
            restart_command(restart)
        )),
        RunError::Foreign { .. } => Some(format!("{ANOTHER_FOLDER}, or --overwrite")),
        RunError::Checkpoint(error) => Some(of_checkpoint(error)),
        RunError::ExcludedPatchReached { .. } => Some("the command without --auto".into()),
        RunError::Solver { cause, .. } => of_solver(cause),
        _ => None,
    }
}

fn of_checkpoint(error: &CheckpointError) -> String {
    let why = if matches!(error, CheckpointError::Completed { .. }) { " repeats them" } else { "" };
    format!("the command without --restart{why}")
}

fn of_solver(error: &SimulationError) -> Option<String> {
    match error {
        SimulationError::NoTouch { looks_back: true, .. } => Some(
            "`kanagata convert FILE --flip`, or the other --sheet-side, turns the normals of the tool round"
                .into(),
        ),
        SimulationError::GaveUp { .. } => Some("`kanagata-solve check` on the scene".into()),
        _ => None,
    }
}

/// Another folder, or the lock of a holder that may have ended.
fn of_busy(holder: &Holder) -> String {
    if holder.is_breakable() {
        format!("{ANOTHER_FOLDER}; --break-lock if that process has certainly ended")
    } else {
        ANOTHER_FOLDER.into()
    }
}

fn of_status(error: &StatusError) -> Option<String> {
    let is_absent = matches!(error, StatusError::Io { .. });
    is_absent.then(|| "the folder given to `kanagata-solve run` with -o".into())
}

fn of_report(error: &ReportError) -> Option<String> {
    match error {
        ReportError::NoRun { .. } => Some(
            "the folder given to `kanagata-solve run` with -o, or cases/NAME of a study".into(),
        ),
        ReportError::Running { .. } => {
            Some("`kanagata-solve status DIR` shows how far the run is".into())
        }
        _ => None,
    }
}

fn of_study(error: &StudyError) -> Option<String> {
    match error {
        StudyError::Kind(wrong) => of_kind(wrong),
        StudyError::Start { .. } => {
            Some("`kanagata-solve` beside `kanagata` (cargo build --release makes both)".into())
        }
        StudyError::Busy { holder, .. } => Some(of_busy(holder)),
        StudyError::LockLost { .. } => Some(ANOTHER_FOLDER.into()),
        StudyError::OtherRuns { .. } => {
            Some("--renew runs these cases again, another folder with -o keeps them".into())
        }
        StudyError::OtherRunner { runner, .. } => {
            Some(format!("--runner {runner}, or --cancel with it"))
        }
        StudyError::Refused { .. } => Some("--emit prints what is submitted".into()),
        StudyError::NotCancelled { refused: true, .. } => {
            Some("--poll with --end, which gives the command that ends a ticket".into())
        }
        StudyError::NoAnswer { .. } | StudyError::NotCancelled { .. } => {
            Some("the same command when it answers again".into())
        }
        // The key of the scene follows the name of its case.
        StudyError::Value { place, .. } => of_key(place.rsplit(": ").next()?),
        _ => None,
    }
}

fn of_case(error: &CaseError) -> Option<String> {
    let try_this = match error {
        CaseError::Differs { .. } => {
            "the files or the program as they were, or `kanagata study FILE -o DIR --renew`, which prepares the case again"
        }
        CaseError::NotConverged { .. } => "--again, or a change of the scene",
        CaseError::LeaderNotDone { .. } => "`kanagata-solve case` for the case that it follows",
        _ => return None,
    };
    Some(try_this.into())
}

/// The command that continues a run.
pub(super) fn restart_command(restart: &Restart) -> String {
    let quoted_word = |word: &str| {
        let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+=:,@".contains(c);
        if !word.is_empty() && word.chars().all(plain) {
            word.to_owned()
        } else {
            format!("'{}'", word.replace('\'', r"'\''"))
        }
    };
    let quoted = |path: &Path| quoted_word(&path.to_string_lossy());
    let (scene, folder) = (quoted(&restart.scene), quoted(&restart.folder));
    let set: String =
        restart.set.iter().map(|one| format!(" --set {}", quoted_word(one))).collect();
    let auto = if restart.auto { " --auto" } else { "" };
    format!("kanagata-solve run {scene} -o {folder}{set} --restart{auto}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::exit::Failure;

    #[test]
    fn errors_within_errors_and_of_files_have_their_remedies() {
        let option = || MeshError::Option { option: "limit_s", found: "0".into(), allowed: "more" };
        let expected = Some("another value of --gmsh-limit".to_owned());
        assert_eq!(remedy(&option()), expected);
        assert_eq!(remedy(&ToleranceError::Mesh(option())), expected);
        let failure = Failure::of_file("die.igs".as_ref(), ReachError::Mesh(option()));
        assert_eq!(failure.error.to_string(), "die.igs: limit_s is 0; allowed: more");
        assert_eq!(remedy(&*failure.error), expected);
        assert_eq!(remedy(&std::fmt::Error), None);
    }

    #[test]
    fn a_stopped_run_is_continued_by_its_command() {
        let (scene, folder) = ("/a b/x.json".into(), "out".into());
        let restart =
            Restart { scene, folder, set: vec!["tools.die.friction=0.1".into()], auto: true };
        let command =
            "kanagata-solve run '/a b/x.json' -o out --set tools.die.friction=0.1 --restart --auto";
        assert_eq!(restart_command(&restart), command);
        let error = RunError::Unfinished { folder: "out".into(), increment: 3, restart };
        assert!(remedy(&error).is_some_and(|text| text.contains(command)));
        assert!(!error.to_string().contains("--"), "{error}");
    }
}
