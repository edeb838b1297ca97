use super::*;

fn slurm() -> Slurm {
    let options = vec!["--account=forming".to_owned()];
    let study = PathBuf::from("/shared/out of steel");
    Slurm::new(Setup { study, program: "/opt/kanagata-solve".into(), options, again: false })
}

fn group(cases: &[&str], memory_mb: Option<f64>, seconds: Option<f64>) -> Group {
    let cases = cases.iter().map(|case| (*case).to_owned()).collect();
    Group { cases, threads: 4, memory_mb, seconds }
}

#[test]
fn a_script_asks_for_what_its_largest_task_needs() {
    let groups =
        [group(&["a", "b"], Some(100.0), Some(3600.0)), group(&["c"], Some(401.0), Some(60.0))];
    let text = slurm().script("kanagata-1", &groups);
    for line in [
        "#SBATCH --job-name=kanagata-1",
        "#SBATCH --array=0-1",
        "#SBATCH --cpus-per-task=4",
        "#SBATCH --mem=522M",
        "#SBATCH --time=120",
        "#SBATCH --account=forming",
        "cd '/shared/out of steel' || exit 4",
        "cases/a cases/b",
        "exec /opt/kanagata-solve --threads 4 case \"$@\"",
    ] {
        assert!(text.lines().any(|l| l == line), "{line}: {text}");
    }
    let unknown = slurm().script("kanagata-1", &[group(&["a"], None, None)]);
    assert!(!unknown.contains("--mem") && !unknown.contains("--time"), "{unknown}");
    let short = slurm().script("kanagata-1", &[group(&["a"], Some(1.0), Some(1.0))]);
    assert!(short.contains("--time=5\n"), "{short}");
}

#[test]
fn states_of_tasks_are_waiting_running_or_ended() {
    assert_eq!(state_of("PENDING", "Priority"), TicketState::Waiting(None));
    let never = TicketState::Waiting(Some("BadConstraints".into()));
    assert_eq!(state_of("PENDING", "BadConstraints"), never);
    assert_eq!(state_of("COMPLETING", "None"), TicketState::Running);
    let retry = |state| matches!(state_of(state, "None"), TicketState::Ended { retry: true, .. });
    assert!(retry("COMPLETED") && retry("TIMEOUT") && retry("OUT_OF_MEMORY") && retry("NODE_FAIL"));
    assert!(!retry("CANCELLED") && !retry("CANCELLED by 0"));
}

#[test]
fn tasks_of_similar_memory_are_an_array() {
    let of = |memory: &[Option<f64>]| -> Vec<usize> {
        let mut groups: Vec<Group> =
            memory.iter().map(|mb| group(&["a"], *mb, Some(1.0))).collect();
        slurm().arrange(&mut groups);
        arrays(&groups).iter().map(|array| array.len()).collect()
    };
    let some = |list: &[f64]| list.iter().copied().map(Some).collect::<Vec<_>>();
    assert_eq!(of(&some(&[300.0, 100.0, 200.0, 900.0, 450.0])), [2, 2, 1]);
    assert_eq!(of(&[Some(1.0), None, Some(2.0), None]), [2, 2]);
    assert_eq!(of(&vec![None; 2 * TASKS_MAX + 1]), [TASKS_MAX, TASKS_MAX, 1]);
    assert_eq!(of(&[]), [0; 0]);
    let text =
        slurm().emit(&[group(&["big"], Some(1000.0), None), group(&["small"], Some(10.0), None)]);
    let asked: Vec<&str> = text.lines().filter(|line| line.contains("--mem=")).collect();
    assert_eq!(asked, ["#SBATCH --mem=13M", "#SBATCH --mem=1300M"]);
}
