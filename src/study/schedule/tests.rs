use std::cell::Cell;
use std::fs;
use std::path::Path;
use std::sync::Mutex;

use serde_json::json;

use super::*;
use crate::study::case_file::SCENE;
use crate::study::inputs::folder_of;
use crate::study::prepare::prepare;
use crate::study::runner::process::{Processes, Setup};
use crate::study::runner::{Group, Record, TicketState};
use crate::study::states::states;

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

    fn free(&self) -> usize {
        usize::MAX
    }

    fn orders_dependents(&self) -> bool {
        true
    }

    fn outlives(&self) -> bool {
        true
    }

    fn interval(&self) -> Duration {
        Duration::from_millis(1)
    }

    fn submit(
        &mut self,
        groups: &[Group],
        _: &[Ticket],
        record: Record<'_>,
    ) -> Result<Vec<Ticket>, EngineError> {
        let tickets: Vec<Ticket> = (0..groups.len())
            .map(|task| Ticket { id: format!("job {}", self.submitted), task })
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

    fn emit(&self, _: &[Group]) -> String {
        String::new()
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

    fn free(&self) -> usize {
        usize::MAX
    }

    fn orders_dependents(&self) -> bool {
        false
    }

    fn outlives(&self) -> bool {
        true
    }

    fn may_be_silent(&self) -> bool {
        true
    }

    fn interval(&self) -> Duration {
        Duration::ZERO
    }

    fn submit(
        &mut self,
        _: &[Group],
        _: &[Ticket],
        record: Record<'_>,
    ) -> Result<Vec<Ticket>, EngineError> {
        let tickets = vec![Ticket { id: "job".into(), task: 0 }];
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

    fn cancel(&mut self, _: &[Ticket]) -> Result<(), EngineError> {
        Ok(())
    }

    fn emit(&self, _: &[Group]) -> String {
        String::new()
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
        again: false,
        renew: false,
        lock,
        before,
        detach: false,
        stop: NOT_REQUESTED.get_or_init(Cancel::default),
    }
}

/// Processes that are asked without waiting between.
struct AtOnce(Processes);

impl Runner for AtOnce {
    fn name(&self) -> &'static str {
        self.0.name()
    }

    fn free(&self) -> usize {
        self.0.free()
    }

    fn orders_dependents(&self) -> bool {
        self.0.orders_dependents()
    }

    fn outlives(&self) -> bool {
        self.0.outlives()
    }

    fn may_be_silent(&self) -> bool {
        self.0.may_be_silent()
    }

    fn interval(&self) -> Duration {
        Duration::ZERO
    }

    fn submit(
        &mut self,
        groups: &[Group],
        after: &[Ticket],
        record: Record<'_>,
    ) -> Result<Vec<Ticket>, EngineError> {
        self.0.submit(groups, after, record)
    }

    fn poll(&mut self, tickets: &[Ticket]) -> Result<Vec<TicketState>, EngineError> {
        self.0.poll(tickets)
    }

    fn cancel(&mut self, tickets: &[Ticket]) -> Result<(), EngineError> {
        self.0.cancel(tickets)
    }

    fn emit(&self, groups: &[Group]) -> String {
        self.0.emit(groups)
    }
}

/// An engine of a template whose queue is closed to the case `b`; it counts in the file `asked` how often it is asked.
#[cfg(unix)]
fn closed_to_b(study: &Path) -> AtOnce {
    let submit = "sh -c 'echo {name} >> asked; test {name} != b || { echo queue is closed >&2; exit 1; }; echo job-{name}' {case}";
    AtOnce(Processes::new(Setup {
        study: study.into(),
        program: "kanagata-solve".into(),
        submit: Some(submit.parse().unwrap()),
        poll: Some("true {ticket}".parse().unwrap()),
        cancel: None,
        places: vec!["localhost".into()],
        tied: false,
        again: false,
    }))
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
    let tickets = Tickets::read(study);
    let ticket = |name: &str| tickets.cases.get(name).and_then(|own| own.ticket.clone());
    assert_eq!(ticket("a").map(|ticket| ticket.id), Some("job-a".into()));
    assert!(!tickets.cases.contains_key("b") && !tickets.cases.contains_key("c"), "{tickets:?}");
}
