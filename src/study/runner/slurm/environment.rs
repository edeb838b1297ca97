//! Variables of the environment from which programs of Slurm take options. What would hide tasks, or would replace what a
//! script asks for, is removed; what a user sets for all own jobs (account, partition, quality of service) is inherited.

use super::options::Options;

/// Variables that name clusters; the second counts for `sbatch` only, and more.
pub(super) const CLUSTERS: [&str; 2] = ["SLURM_CLUSTERS", "SBATCH_CLUSTERS"];

/// Variables that hide tasks from `squeue` or `scancel`, change their output, or make them ask.
pub(super) fn hiding() -> Vec<String> {
    let names = std::env::vars_os().filter_map(|(name, _)| name.into_string().ok());
    names.filter(|name| hides(name)).collect()
}

/// Whether a variable filters or formats what `squeue` lists, or restricts what `scancel` ends.
fn hides(variable: &str) -> bool {
    // Lists the tasks of all clusters of a federation: more, in the same columns.
    let lists_more = variable == "SQUEUE_FEDERATION";
    !lists_more && (variable.starts_with("SQUEUE_") || variable.starts_with("SCANCEL_"))
}

/// What a script asks for.
struct Request {
    /// The option of a script, without dashes.
    option: &'static str,
    /// Options that ask for the same in other words; `sbatch` refuses several of them, or the last one counts.
    alternatives: &'static [&'static str],
    /// Variables that count more than a script, or that `sbatch` refuses beside it.
    variables: &'static [&'static str],
}

const REQUESTS: [Request; 6] = [
    Request {
        option: "mem",
        alternatives: &["mem-per-cpu", "mem-per-gpu"],
        variables: &["SBATCH_MEM_PER_NODE", "SBATCH_MEM_PER_CPU", "SBATCH_MEM_PER_GPU"],
    },
    Request { option: "time", alternatives: &["t"], variables: &["SBATCH_TIMELIMIT"] },
    Request {
        option: "cpus-per-task",
        alternatives: &["c", "cpus-per-gpu"],
        variables: &["SBATCH_CPUS_PER_GPU", "SBATCH_TRES_PER_TASK"],
    },
    Request { option: "signal", alternatives: &[], variables: &["SBATCH_SIGNAL"] },
    Request {
        option: "output",
        alternatives: &["o"],
        // Without an option for errors they are in the file for the output.
        variables: &["SBATCH_OUTPUT", "SBATCH_ERROR"],
    },
    Request { option: "open-mode", alternatives: &[], variables: &["SBATCH_OPEN_MODE"] },
];

/// Whether a user's `options` ask for what the option `name` of a script asks for.
pub(super) fn is_given(name: &str, options: &Options) -> bool {
    let request = REQUESTS.iter().find(|request| request.option == name);
    let same = |given: &str| {
        given == name || request.is_some_and(|request| request.alternatives.contains(&given))
    };
    options.names().any(same)
}

/// Variables that `sbatch` must not inherit beside a script with the options `asks`: those of the same requests, and that
/// which would make it wait for the end of the tasks.
pub(super) fn replacing(asks: &[String]) -> Vec<&'static str> {
    let has = |name: &str| asks.iter().any(|asked| asked == name);
    let asked = REQUESTS
        .iter()
        .filter(|request| has(request.option) || request.alternatives.iter().any(|name| has(name)));
    asked.flat_map(|request| request.variables.iter().copied()).chain(["SBATCH_WAIT"]).collect()
}

/// Clusters that `sbatch` submits to with these options and variables: `a`, `a,b` or `all`; `None` for that of the
/// configuration.
pub(super) fn clusters(
    options: &Options,
    variable: impl Fn(&str) -> Option<String>,
) -> Option<String> {
    let set = |name: &&str| variable(name).filter(|value| !value.is_empty());
    options.clusters().map(str::to_owned).or_else(|| CLUSTERS.iter().rev().find_map(set))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn options(text: &str) -> Options {
        let mut options = Options::default();
        options.add(text).unwrap();
        options
    }

    #[test]
    fn what_hides_tickets_is_removed_and_what_a_user_sets_is_kept() {
        for variable in ["SQUEUE_FORMAT", "SQUEUE_FORMAT2", "SQUEUE_STATES", "SCANCEL_INTERACTIVE"]
        {
            assert!(hides(variable), "{variable}");
        }
        for variable in ["SQUEUE_FEDERATION", "SBATCH_ACCOUNT", "SLURM_CONF", "SLURM_CLUSTERS"] {
            assert!(!hides(variable), "{variable}");
        }
    }

    #[test]
    fn variables_of_what_a_script_asks_for_are_removed() {
        let removed =
            |asks: &[&str]| replacing(&asks.iter().map(|a| (*a).into()).collect::<Vec<_>>());
        assert_eq!(removed(&["qos", "mem-bind"]), ["SBATCH_WAIT"]);
        assert_eq!(
            removed(&["time", "signal"]),
            ["SBATCH_TIMELIMIT", "SBATCH_SIGNAL", "SBATCH_WAIT"]
        );
        assert_eq!(removed(&["output"]), ["SBATCH_OUTPUT", "SBATCH_ERROR", "SBATCH_WAIT"]);
        for name in ["mem", "mem-per-cpu", "mem-per-gpu"] {
            assert_eq!(removed(&[name]).len(), 4, "{name}");
        }
    }

    #[test]
    fn options_ask_for_the_same_in_other_words() {
        assert!(
            is_given("mem", &options("--mem-per-cpu=2G")) && is_given("time", &options("-t 5"))
        );
        assert!(!is_given("mem", &options("--mem-bind=local --qos=low")));
        assert!(is_given("open-mode", &options("--open-mode=append")));
    }

    #[test]
    fn clusters_are_those_of_options_then_those_of_variables() {
        let both = |name: &str| Some(if name == CLUSTERS[0] { "c" } else { "s" }.to_owned());
        assert_eq!(clusters(&options("-M a"), both).as_deref(), Some("a"));
        assert_eq!(clusters(&options("--qos=low"), both).as_deref(), Some("s"));
        let only = |name: &str| (name == CLUSTERS[0]).then(|| "c".to_owned());
        assert_eq!(clusters(&Options::default(), only).as_deref(), Some("c"));
        assert_eq!(clusters(&Options::default(), |_| Some(String::new())), None);
    }
}
