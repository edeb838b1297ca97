use std::cell::Cell;
use std::fs;
use std::path::Path;
use std::sync::Mutex;

use serde_json::json;

use super::*;
use crate::case_file::SCENE;
use crate::inputs::folder_of;
use crate::prepare::prepare;
use crate::runner::process::{Processes, Setup};
use crate::runner::{Group, Record, TicketState};
use crate::states::states;

/// An engine that lists every task as running and runs nothing.
#[derive(Default)]
struct Stalled {
    submitted: usize,
    cancelled: Vec<Ticket>,
}

impl Runner for Stalled {
    fn name(&self) -> &'static str {
        "stalled"
    }

    fn orders_dependents(&self) -> bool {
        true
    }

    fn submit(
        &mut self,
        groups: &[Group],
        _: &[Ticket],
        record: Record<'_>,
    ) -> Result<Vec<Ticket>, EngineError> {
        let tickets: Vec<Ticket> = (0..groups.len())
            .map(|task| Ticket { task, ..Ticket::new(format!("job {}", self.submitted)) })
            .collect();
        self.submitted += 1;
        record(&tickets)?;
        Ok(tickets)
    }

    fn poll(&mut self, tickets: &[Ticket]) -> Result<Vec<TicketState>, EngineError> {
        Ok(vec![TicketState::Running; tickets.len()])
    }

    fn cancel(&mut self, tickets: &[Ticket]) -> Result<(), EngineError> {
        self.cancelled.extend(tickets.iter().cloned());
        Ok(())
    }
}

fn case(id: &str) -> Case {
    Case { id: id.into(), options: vec![id.into()], follows: None, scene: json!({"name": id}) }
}

#[test]
fn a_task_that_is_listed_as_running_for_ever_is_cancelled_and_submitted_again() {
    let folder = tempfile::tempdir().unwrap();
    let study: &Path = folder.path();
    let cases = [case("a"), case("b")];
    let said = Mutex::new(String::new());
    let say = |line: &str| said.lock().unwrap().push_str(&format!("{line}\n"));
    prepare(&cases, &cases, study, 1, &say).unwrap();
    assert!(folder_of(study, "a").join(SCENE).exists());
    let (before, own) = (states(&cases, study), lock(study, false).unwrap());
    let mut runner = Stalled::default();
    let stall = Duration::from_millis(20);
    let how = Execution { max_tries: 2, stall, ..execution(study, &mut runner, &own, &before) };
    execute(&cases, how, &say).unwrap();
    assert_eq!((runner.submitted, runner.cancelled.len()), (2, 4));
    let said = said.lock().unwrap().clone();
    assert!(said.contains("a: listed as running"), "{said}");
    assert!(said.contains("b: listed as running") && said.contains("submitted 2 times"), "{said}");
    let text = fs::read_to_string(study.join("runner.json")).unwrap();
    assert!(!text.contains("job 1"), "no ticket is left: {text}");
    // It remains failed until it is asked for again.
    let (mut runner, before) = (Stalled::default(), states(&cases, study));
    let how = Execution {
        max_tries: 2,
        stall,
        detach: true,
        ..execution(study, &mut runner, &own, &before)
    };
    execute(&cases, how, &say).unwrap();
    assert_eq!(runner.submitted, 0);
}

/// An engine of which an exit code is all that is known: it knows its ticket or not, by turns. Each question takes 20 s.
struct Silent<'a> {
    knows: &'a [bool],
    polls: usize,
    clock: &'a Cell<Instant>,
}

impl Runner for Silent<'_> {
    fn name(&self) -> &'static str {
        "silent"
    }

    fn may_be_silent(&self) -> bool {
        true
    }

    fn submit(
        &mut self,
        _: &[Group],
        _: &[Ticket],
        record: Record<'_>,
    ) -> Result<Vec<Ticket>, EngineError> {
        let tickets = vec![Ticket::new("job".into())];
        record(&tickets)?;
        Ok(tickets)
    }

    fn poll(&mut self, tickets: &[Ticket]) -> Result<Vec<TicketState>, EngineError> {
        let knows = self.knows.get(self.polls).copied().unwrap_or(false);
        self.polls += 1;
        self.clock.set(self.clock.get() + Duration::from_secs(20));
        let state = if knows { TicketState::Waiting(None) } else { TicketState::Gone };
        Ok(vec![state; tickets.len()])
    }
}

#[test]
fn a_ticket_that_is_not_known_counts_as_gone_after_a_minute() {
    // Without an answer that knows it: missing at 20 s, lost at 80 s. With one, the minute begins again.
    for (knows, polls) in [(&[][..], 4), (&[false, false, true], 7)] {
        let folder = tempfile::tempdir().unwrap();
        let study: &Path = folder.path();
        let cases = [case("a")];
        prepare(&cases, &cases, study, 1, &|_| {}).unwrap();
        let (before, own) = (states(&cases, study), lock(study, false).unwrap());
        let clock = Cell::new(Instant::now());
        let mut runner = Silent { knows, polls: 0, clock: &clock };
        let how = Execution {
            now: &|| clock.get(),
            max_tries: 1,
            stall: Duration::from_secs(3600),
            ..execution(study, &mut runner, &own, &before)
        };
        let left = execute(&cases, how, &|_| {}).unwrap();
        assert_eq!((left.not_done, runner.polls), (1, polls));
    }
}

/// An execution without special options.
fn execution<'a>(
    folder: &'a Path,
    runner: &'a mut dyn Runner,
    lock: &'a Lock,
    before: &'a States,
) -> Execution<'a> {
    static NOT_REQUESTED: std::sync::OnceLock<Cancel> = std::sync::OnceLock::new();
    Execution {
        folder,
        runner,
        max_tries: 3,
        task_s: 0.0,
        stall: STALL,
        now: &Instant::now,
        pause: &|_| {},
        again: false,
        renew: false,
        lock,
        before,
        detach: false,
        stop: NOT_REQUESTED.get_or_init(Cancel::default),
    }
}

/// An engine of a template whose queue is closed to the case `b`; it counts in the file `asked` how often it is asked.
#[cfg(unix)]
fn closed_to_b(study: &Path) -> Processes {
    let submit = "sh -c 'echo {name} >> asked; test {name} != b || { echo queue is closed >&2; exit 1; }; echo job-{name}' {case}";
    Processes::new(Setup {
        study: study.into(),
        program: "kanagata-solve".into(),
        submit: Some(submit.parse().unwrap()),
        poll: Some("true {ticket}".parse().unwrap()),
        cancel: None,
        places: vec!["localhost".into()],
        tied: false,
        again: false,
    })
}

#[cfg(unix)]
#[test]
fn ten_submissions_that_fail_end_the_study_with_the_words_of_the_engine() {
    let folder = tempfile::tempdir().unwrap();
    let study: &Path = folder.path();
    let cases = [case("a"), case("b"), case("c")];
    prepare(&cases, &cases, study, 1, &|_| {}).unwrap();
    let (before, own) = (states(&cases, study), lock(study, false).unwrap());
    let mut runner = closed_to_b(study);
    let how = execution(study, &mut runner, &own, &before);
    let said = Mutex::new(String::new());
    let say = |line: &str| said.lock().unwrap().push_str(&format!("{line}\n"));
    let error = execute(&cases, how, &say).unwrap_err();
    assert!(matches!(error, StudyError::Refused { .. }), "{error}");
    assert!(error.to_string().contains("queue is closed"), "{error}");
    let said = said.lock().unwrap().clone();
    assert_eq!(said.matches("does not answer").count(), 1, "said once: {said}");
    assert!(!said.contains("answers again"), "its lists do not open its queue: {said}");
    let asked = fs::read_to_string(study.join("asked")).unwrap();
    let count = |name: &str| asked.lines().filter(|line| *line == name).count();
    // What was accepted is not submitted twice, and what was not costs no try.
    assert_eq!((count("a"), count("b"), count("c")), (1, 10, 0), "{asked}");
    let tickets = Tickets::read(study).unwrap();
    let ticket = |name: &str| tickets.cases.get(name).and_then(|own| own.ticket.clone());
    assert_eq!(ticket("a").map(|ticket| ticket.id), Some("job-a".into()));
    assert!(!tickets.cases.contains_key("b") && !tickets.cases.contains_key("c"), "{tickets:?}");
}

/// An engine that reports an error when it is asked to end tickets; the states that it lists, question by question.
struct Failing {
    lists: Vec<Vec<TicketState>>,
    asked: Vec<Ticket>,
}

impl Runner for Failing {
    fn name(&self) -> &'static str {
        "failing"
    }

    fn submit(
        &mut self,
        _: &[Group],
        _: &[Ticket],
        _: Record<'_>,
    ) -> Result<Vec<Ticket>, EngineError> {
        Err(EngineError::Refused("it takes nothing".into()))
    }

    fn poll(&mut self, tickets: &[Ticket]) -> Result<Vec<TicketState>, EngineError> {
        if self.lists.is_empty() {
            return Err(EngineError::NoAnswer("closed".into()));
        }
        let states = self.lists.remove(0);
        Ok(tickets.iter().map(|ticket| states[ticket.task].clone()).collect())
    }

    fn cancel(&mut self, tickets: &[Ticket]) -> Result<(), EngineError> {
        self.asked.extend(tickets.iter().cloned());
        Err(EngineError::NoAnswer("one of them is not known".into()))
    }
}

#[test]
fn tickets_that_end_before_they_are_cancelled_do_not_count() {
    use TicketState::{Gone, Running};
    let tickets: Vec<Ticket> =
        (0..3).map(|task| Ticket { task, ..Ticket::new("job".into()) }).collect();
    let waiting = || TicketState::Waiting(None);
    let ended = |retry| TicketState::Ended { reason: "ended".into(), retry };
    let cancel = |lists: Vec<Vec<TicketState>>| {
        let mut runner = Failing { lists, asked: Vec::new() };
        let count = cancel(Path::new("."), "failing", &tickets, &mut runner);
        (count.map_err(|error| error.to_string()), runner.asked.len())
    };
    let open = || vec![Running, waiting(), Running];
    // One has ended by itself; one is ended at once, one saves its checkpoint.
    assert_eq!(cancel(vec![open(), vec![ended(true), ended(false), Running]]), (Ok(2), 3));
    assert_eq!(cancel(vec![open(), vec![Gone, Gone, Running]]), (Ok(1), 3));
    assert_eq!(cancel(vec![open(), vec![Gone, ended(true), Gone]]), (Ok(0), 3));
    assert_eq!(cancel(vec![open(), vec![ended(false), ended(false), ended(false)]]), (Ok(3), 3));
    // What has ended before is not asked.
    assert_eq!(cancel(vec![vec![Gone, waiting(), ended(true)], vec![Gone; 3]]), (Ok(0), 1));
    assert_eq!(cancel(vec![vec![Gone, ended(false), ended(true)]]), (Ok(0), 0));
    // Nothing explains the error, or the engine is silent.
    let (count, asked) = cancel(vec![open(), open()]);
    assert!(count.unwrap_err().contains("one of them is not known") && asked == 3);
    let (count, asked) = cancel(vec![open(), vec![Running, ended(false), Running]]);
    assert!(count.unwrap_err().contains("one of them is not known") && asked == 3);
    assert!(cancel(vec![open()]).0.unwrap_err().contains("closed"));
}
