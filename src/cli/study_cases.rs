//! The cases of a forming study: prepared, run where they are to run, compared.

use std::collections::BTreeSet;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::Instant;

use super::doubts::print_doubts;
use super::exit::{Exit, Failure};
use super::stop;
use super::study_args::StudyArgs;
use super::study_error::{folder, io, value};
use super::terminal::{err, out, put};
use crate::run::lock::Lock;
use crate::study::case::Case;
use crate::study::cases::{Roots, cases, chosen, from_case, ids};
use crate::study::checks::Outcome;
use crate::study::collect::{Findings, collect};
use crate::study::file::Study;
use crate::study::follow::with_leaders;
use crate::study::prepare::{Order, prepare};
use crate::study::runner::Runner;
use crate::study::runner::tickets::{Ticket, Tickets};
use crate::study::schedule::{self, Execution, Left, execute};
use crate::study::states::{State, States, refuse_other_runs, states};

/// Prepares, runs and compares the cases of a study.
///
/// # Errors
/// As `kanagata study`.
pub(super) fn forming(args: &StudyArgs, study: &Study) -> Result<Exit, Failure> {
    let output = args.folder();
    let (all, open) = all_and_open(args, study)?;
    if args.collect {
        return compared(args, study, &all, &[], &states(&all, output));
    }
    let lock = schedule::lock(output, args.break_lock)?;
    let before = states(&open, output);
    if !args.renew {
        refuse_other_runs(&before, output)?;
    }
    // Options that are wrong are refused before anything is written.
    let mut runner = runner(args, study)?;
    prepare(&open, &all, output, threads(args), &|line| err!("note: {line}"))?;
    if args.prepare {
        let (count, folder) = (open.len(), output.display());
        out!("{count} cases prepared; `kanagata-solve case {folder}/cases/NAME` runs one");
        return Ok(Exit::Done);
    }
    if args.runner.emit {
        for text in schedule::emit(&open, &before, output, &*runner, args.runner.task_s()) {
            put(text.trim_end());
        }
        return Ok(Exit::Done);
    }
    let (left, stopped) = run(args, &open, &mut *runner, &lock, &before)?;
    if stopped {
        return Ok(after_stop(&*runner));
    }
    if args.runner.detach {
        return Ok(after_submission(left, output));
    }
    schedule::check_lock(&lock, output)?;
    // Where nothing had to be run, nothing has changed.
    let known = before.len() == all.len() && before.values().all(|e| e.state == State::Done);
    let after = if known { before } else { states(&all, output) };
    compared(args, study, &all, &open, &after)
}

/// All cases of a study in its folder, which is made if it is missing, and those that are to be run.
fn all_and_open(args: &StudyArgs, study: &Study) -> Result<(Vec<Case>, Vec<Case>), Failure> {
    let output = args.folder();
    let [own, tools] = folders(args)?;
    let chosen = chosen_cases(args, study)?;
    std::fs::create_dir_all(output).map_err(folder(output))?;
    let base = output.canonicalize().map_err(io(output))?;
    let [tools, own] = [&tools, &own].map(|folder| from_case(&base, folder));
    let all = cases(study, &Roots { tools: &tools, own: &own }, args.quick);
    let open = with_leaders(&all, |id| chosen.contains(id));
    Ok((all, open))
}

/// Where the cases of a study run.
fn runner(args: &StudyArgs, study: &Study) -> Result<Box<dyn Runner>, Failure> {
    let jobs = args.jobs.map_or(1, NonZeroUsize::get);
    args.runner.runner(args.folder(), Some(study), jobs, args.again)
}

/// Runs the cases that are not done. Returns what is left, and whether a stop was requested.
fn run(
    args: &StudyArgs,
    open: &[Case],
    runner: &mut dyn Runner,
    lock: &Lock,
    before: &States,
) -> Result<(Left, bool), Failure> {
    let stop = stop::request();
    // Until the end of the function a stop request is handled by the schedule.
    let _section = stop.section();
    let how = Execution {
        folder: args.folder(),
        max_tries: args.runner.max_tries(),
        task_s: args.runner.task_s(),
        stall: schedule::STALL,
        now: &Instant::now,
        pause: &std::thread::sleep,
        again: args.again,
        renew: args.renew,
        before,
        lock,
        detach: args.runner.detach,
        stop,
        runner,
    };
    let left = execute(open, how, &|line| out!("{line}"))?;
    Ok((left, stop.is_requested()))
}

/// Prints how to continue after a stop request.
fn after_stop(runner: &dyn Runner) -> Exit {
    if runner.outlives() {
        out!(
            "stopped; submitted cases keep running; the same command continues, --cancel ends them"
        );
    } else {
        out!("stopped; the same command continues from the checkpoints");
    }
    Exit::Stopped
}

/// Prints what was submitted without waiting for it.
fn after_submission(Left { submitted, waiting, not_done }: Left, output: &Path) -> Exit {
    out!(
        "{submitted} cases submitted, {waiting} wait for a later command, {not_done} of the others not done"
    );
    out!("the same command continues; state: kanagata study {} --status", output.display());
    if not_done == 0 { Exit::Done } else { Exit::NoConvergence }
}

/// Asks all submitted cases to end.
///
/// # Errors
/// Exit code 2 with another runner than that of the tickets or where these are damaged, 4 when the folder holds no study or
/// the engine does not answer.
pub(super) fn cancel(args: &StudyArgs) -> Result<Exit, Failure> {
    let output = args.folder();
    Order::read(output)?;
    let tickets = Tickets::read(output)?;
    let mut runner = args.runner.of(&tickets.runner).runner(output, None, 1, false)?;
    let open: Vec<Ticket> = tickets.cases.values().filter_map(|s| s.ticket.clone()).collect();
    let asked = if open.is_empty() {
        0
    } else {
        schedule::cancel(output, &tickets.runner, &open, &mut *runner)?
    };
    out!(
        "{asked} submitted cases asked to end; the study's command continues from their checkpoints"
    );
    if asked < open.len() {
        let (others, name) = (open.len() - asked, &tickets.runner);
        out!("{others} others have ended, or {name} does not know them: nothing to end");
    }
    Ok(Exit::Done)
}

/// Threads of each case: those asked for; else here the processors by the cases at a time, elsewhere one.
fn threads(args: &StudyArgs) -> usize {
    let all = rayon::current_num_threads();
    let jobs = args.jobs.map_or(1, NonZeroUsize::get);
    if args.runner.is_local() {
        (all / jobs).max(1)
    } else if super::threads::is_asked() {
        all
    } else {
        1
    }
}

/// Absolute paths of the folder of the study and of that of its tools.
fn folders(args: &StudyArgs) -> Result<[PathBuf; 2], Failure> {
    let own = args.file.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let own = own.canonicalize().map_err(io(own))?;
    let tools = match &args.tools {
        None => own.clone(),
        Some(given) => given.canonicalize().map_err(|e| {
            let found = format!("{}: {e}", given.display());
            let allowed =
                "a folder with tool files (`tools/models DIR` makes those of the studies here)";
            value(&args.file, "--tools", found, allowed.into())
        })?,
    };
    Ok([own, tools])
}

/// Names of the selected cases.
fn chosen_cases(args: &StudyArgs, study: &Study) -> Result<BTreeSet<String>, Failure> {
    let ids = ids(study);
    chosen(&ids, &args.only).map_err(|name| {
        let allowed = format!("a case, or a part of its name: {}", ids.join(", "));
        value(&args.file, "--only", format!("'{name}'"), allowed)
    })
}

/// Compares all cases in their `states`; `run` are those that were to be run.
fn compared(
    args: &StudyArgs,
    study: &Study,
    all: &[Case],
    run: &[Case],
    states: &States,
) -> Result<Exit, Failure> {
    let output = args.folder();
    let Findings { checks, doubts, notes } = collect(study, all, states, output)?;
    let failed = not_done(run, states);
    if run.iter().any(|case| states.get(&case.id).is_some_and(|e| e.lacks_files)) {
        err!(
            "  try: `tools/models DIR` or `kanagata convert` makes tool files; --tools gives their folder"
        );
    }
    for note in &notes {
        err!("note: {note}");
    }
    out!("{} cases, {failed} of those run not done", all.len());
    for (check, outcome) in &checks {
        let [state, value] = outcome.texts();
        out!("  {state:13} {}: {value}, {} expected", check.says, check.allowed());
    }
    out!("  {}", output.join("study.html").display());
    print_doubts(&doubts, args.accept_doubts);
    let broken = checks.iter().any(|(_, outcome)| matches!(outcome, Outcome::Fails { .. }));
    Ok(match (failed, broken) {
        (1.., _) => Exit::NoConvergence,
        (0, true) => Exit::Limit,
        (0, false) => Exit::of_doubts(&doubts, args.accept_doubts),
    })
}

fn not_done(cases: &[Case], states: &States) -> usize {
    let done = |c: &&Case| states.get(&c.id).is_some_and(|e| e.state == State::Done);
    cases.len() - cases.iter().filter(done).count()
}
