use std::os::unix::process::ExitStatusExt as _;
use std::process::ExitStatus;

use super::*;

fn slurm() -> Slurm {
    slurm_with(&[])
}

fn slurm_with(more: &[&str]) -> Slurm {
    let mut options = Options::default();
    options.set("account", "forming").unwrap();
    more.iter().for_each(|text| options.add(text).unwrap());
    let study = "/shared/out of steel".into();
    Slurm::new(Setup { study, program: "/opt/kanagata-solve".into(), options, again: false })
}

fn script(slurm: &Slurm, groups: &[Group]) -> String {
    Script::new(&slurm.setup, "kanagata-1", None, groups).text
}

fn group(cases: &[&str], memory_mb: Option<f64>, seconds: Option<f64>) -> Group {
    let cases = cases.iter().map(|case| (*case).to_owned()).collect();
    Group { cases, threads: 4, memory_mb, seconds }
}

#[test]
fn a_script_asks_for_what_its_largest_task_needs() {
    let groups =
        [group(&["a", "b"], Some(100.0), Some(3600.0)), group(&["c"], Some(401.0), Some(60.0))];
    let text = script(&slurm(), &groups);
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
    let unknown = script(&slurm(), &[group(&["a"], None, None)]);
    assert!(!unknown.contains("--mem") && !unknown.contains("--time"), "{unknown}");
    let short = script(&slurm(), &[group(&["a"], Some(1.0), Some(1.0))]);
    assert!(short.contains("--time=5\n"), "{short}");
}

#[test]
fn a_script_leaves_out_what_options_ask_for() {
    let groups = [group(&["a"], Some(100.0), Some(3600.0))];
    let own = |text: &str, option: &str| {
        text.lines().filter(|line| line.starts_with(&format!("#SBATCH --{option}"))).count()
    };
    // Slurm refuses two options for memory.
    for memory in ["--mem=5M", "--mem-per-cpu=2G", "--mem-per-gpu 2G"] {
        let text = script(&slurm_with(&[memory]), &groups);
        assert_eq!((own(&text, "mem"), own(&text, "time=120")), (1, 1), "{text}");
    }
    let text =
        script(&slurm_with(&["--mem-bind=local -t 7 -c 2 --comment=\"two words\""]), &groups);
    assert_eq!((own(&text, "mem=130M"), own(&text, "mem-bind")), (1, 1), "{text}");
    assert_eq!((own(&text, "time"), own(&text, "cpus-per-task")), (0, 0), "{text}");
    for line in ["#SBATCH -t 7", "#SBATCH -c 2", "#SBATCH --comment='two words'"] {
        assert!(text.lines().any(|l| l == line), "{line}: {text}");
    }
    // Clusters are those that are asked for, or the one of them that is chosen.
    let two = slurm_with(&["-M a,b"]);
    assert!(two.emit(&groups).contains("#SBATCH --clusters=a,b\n"));
    let chosen = Script::new(&two.setup, "kanagata-1", Some("b"), &groups).text;
    assert!(chosen.contains("#SBATCH --clusters=b\n") && !chosen.contains("a,b"), "{chosen}");
}

#[test]
fn a_submission_is_a_number_with_or_without_cluster() {
    let output = |code: i32, text: &str| Output {
        status: ExitStatus::from_raw(code << 8),
        stdout: text.into(),
        stderr: Vec::new(),
    };
    let job =
        |cluster: Option<&str>| Some(Job { id: "17".into(), cluster: cluster.map(str::to_owned) });
    assert_eq!(submitted(&output(0, "17\n")), job(None));
    assert_eq!(submitted(&output(0, "welcome\n17;b\n")), job(Some("b")));
    for (code, text) in [(1, "17\n"), (0, ""), (0, "slurm 22.05.8\n"), (0, ";b\n")] {
        assert_eq!(submitted(&output(code, text)), None, "{text}");
    }
}

#[test]
fn cases_that_follow_others_are_on_their_cluster() {
    let mut slurm = slurm_with(&["-M a,b"]);
    let ticket = |name: &str| Ticket::new(name.into());
    assert_eq!(slurm.clusters(&[]).unwrap().as_deref(), Some("a,b"));
    assert!(matches!(slurm.clusters(&[ticket("one")]), Err(EngineError::NoAnswer(_))));
    let mut accept = |name: &str, cluster: &str| {
        let job = Job { id: "17".into(), cluster: Some(cluster.into()) };
        slurm.jobs.insert(name.into(), job);
    };
    accept("one", "b");
    accept("of another study", "elsewhere");
    assert_eq!(slurm.clusters(&[]).unwrap().as_deref(), Some("b"));
    assert_eq!(slurm.clusters(&[ticket("one")]).unwrap().as_deref(), Some("b"));
    slurm.jobs.insert("two".into(), Job { id: "17".into(), cluster: Some("a".into()) });
    assert_eq!(slurm.clusters(&[]).unwrap().as_deref(), Some("a,b"));
    assert_eq!(slurm.clusters(&[ticket("two")]).unwrap().as_deref(), Some("a"));
    let error = slurm.clusters(&[ticket("one"), ticket("two")]).unwrap_err();
    assert!(matches!(&error, EngineError::Refused(why) if why.contains("(a, b)")), "{error:?}");
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
