use std::fs;
use std::path::Path;
use std::sync::Mutex;

use serde_json::json;

use super::*;
use crate::study::case_file::SCENE;
use crate::study::inputs::folder_of;
use crate::study::prepare::prepare;
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
    let (mut runner, stop) = (Stalled::default(), Cancel::default());
    let how = Execution {
        folder: study,
        runner: &mut runner,
        max_tries: 2,
        task_s: 0.0,
        stall: Duration::from_millis(20),
        again: false,
        renew: false,
        lock: &own,
        before: &before,
        detach: false,
        stop: &stop,
    };
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
        folder: study,
        runner: &mut runner,
        max_tries: 2,
        task_s: 0.0,
        stall: Duration::from_millis(20),
        again: false,
        renew: false,
        lock: &own,
        before: &before,
        detach: true,
        stop: &stop,
    };
    execute(&cases, how, &say).unwrap();
    assert_eq!(runner.submitted, 0);
}
