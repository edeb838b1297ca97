//! Variables of the environment from which programs of Slurm take options. What would hide tickets, or would replace what a
//! script asks for, is removed; what a user sets for all own jobs (account, partition, quality of service) is inherited.

/// Clusters that all programs of Slurm work with.
pub(super) const CLUSTERS: &str = "SLURM_CLUSTERS";
/// Clusters that only `sbatch` submits to.
pub(super) const SBATCH_CLUSTERS: &str = "SBATCH_CLUSTERS";

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

/// Options of a script, and the variables that would count more than them.
const OPTIONS: [(&str, &[&str]); 5] = [
    ("mem", &["SBATCH_MEM_PER_NODE", "SBATCH_MEM_PER_CPU", "SBATCH_MEM_PER_GPU"]),
    ("time", &["SBATCH_TIMELIMIT"]),
    ("signal", &["SBATCH_SIGNAL"]),
    ("output", &["SBATCH_OUTPUT"]),
    ("open-mode", &["SBATCH_OPEN_MODE"]),
];

/// Variables that `sbatch` must not inherit: those of the options that the script `text` has, and that which would make it
/// wait for the end of the tasks.
pub(super) fn of_script(text: &str) -> Vec<&'static str> {
    let has = |option: &str| {
        let directive = format!("#SBATCH --{option}=");
        text.lines().any(|line| line.starts_with(&directive))
    };
    let set = OPTIONS.iter().filter(|(option, _)| has(option));
    set.flat_map(|(_, variables)| variables.iter().copied()).chain(["SBATCH_WAIT"]).collect()
}

/// Clusters that `sbatch` submits to with these options and variables; `None` for that of the configuration. All programs
/// must work with the same.
pub(super) fn clusters(
    options: &[String],
    variable: impl Fn(&str) -> Option<String>,
) -> Option<String> {
    let mut found = None;
    for (k, word) in options.iter().enumerate() {
        let next = || options.get(k + 1).map(String::as_str);
        let named = match word.as_str() {
            "-M" | "--clusters" | "--cluster" => next(),
            word => ["--clusters=", "--cluster=", "-M"].iter().find_map(|p| word.strip_prefix(p)),
        };
        found = named.map(str::to_owned).or(found);
    }
    let set = |name| variable(name).filter(|value| !value.is_empty());
    found.or_else(|| set(SBATCH_CLUSTERS)).or_else(|| set(CLUSTERS))
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert_eq!(of_script("#SBATCH --mem-per-cpu=1G\n"), ["SBATCH_WAIT"]);
        let found = of_script("#SBATCH --time=5\n#SBATCH --signal=B:TERM@60\n");
        assert_eq!(found, ["SBATCH_TIMELIMIT", "SBATCH_SIGNAL", "SBATCH_WAIT"]);
        assert_eq!(of_script("#SBATCH --mem=5M\n").len(), 4);
    }

    #[test]
    fn all_programs_work_with_the_clusters_of_sbatch() {
        let options = |text: &str| text.split(' ').map(str::to_owned).collect::<Vec<_>>();
        let none = |_: &str| None;
        for text in ["-M a", "-Ma", "--clusters=a", "--clusters a", "-M b --cluster=a --qos=low"] {
            assert_eq!(clusters(&options(text), none).as_deref(), Some("a"), "{text}");
        }
        let both = |name: &str| Some(if name == CLUSTERS { "c" } else { "s" }.to_owned());
        assert_eq!(clusters(&options("-M a"), both).as_deref(), Some("a"));
        assert_eq!(clusters(&options("--qos=low"), both).as_deref(), Some("s"));
        let only = |name: &str| (name == CLUSTERS).then(|| "c".to_owned());
        assert_eq!(clusters(&[], only).as_deref(), Some("c"));
        assert_eq!(clusters(&[], |_| Some(String::new())), None);
    }
}
