//! Guards against commands that overwrite their inputs or write two outputs to one file.

use std::path::{Path, PathBuf};

use super::exit::Failure;
use super::terminal::keep_stdout_for_a_file;
use crate::files::standard::{is_stdin, is_stdout};

/// Refuses outputs (with the names of their options) that are inputs of the command or the same file, and two inputs from
/// standard input. Call it before anything is written. Files are compared by their canonical paths. If an output is
/// standard output, the summary goes to standard error.
///
/// # Errors
/// Exit code 2 for the first output that is an input or an earlier output.
pub fn refuse_clashes(inputs: &[&Path], outputs: &[(&str, Option<&Path>)]) -> Result<(), Failure> {
    let given: Vec<(&str, &Path)> =
        outputs.iter().filter_map(|&(option, path)| Some((option, path?))).collect();
    if inputs.iter().filter(|path| is_stdin(path)).count() > 1 {
        return Err(Failure::input(
            "`-` for two files; allowed: standard input for one of them; give the other one by its name",
        ));
    }
    if given.iter().any(|(_, path)| is_stdout(path)) {
        keep_stdout_for_a_file();
    }
    for (k, &(option, output)) in given.iter().enumerate() {
        let at = place(output);
        let shown = output.display();
        if let Some(input) = inputs.iter().find(|input| place(input) == at) {
            return Err(Failure::input(format!(
                "{option} {shown} is the file {} that this command reads, which would be lost; allowed: any other file; give {option} \
                 another name",
                input.display()
            )));
        }
        if let Some((before, _)) = given[..k].iter().find(|(_, before)| place(before) == at) {
            return Err(Failure::input(format!(
                "{before} and {option} would both write {shown}; allowed: a file of its own for each; give {option} another name"
            )));
        }
    }
    Ok(())
}

/// Canonical path of a file, or of its folder if the file does not exist.
fn place(file: &Path) -> PathBuf {
    let would = || {
        let folder = file.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Some(folder.canonicalize().ok()?.join(file.file_name()?))
    };
    file.canonicalize().ok().or_else(would).unwrap_or_else(|| file.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_input_is_no_output_by_any_name() {
        let folder = tempfile::tempdir().unwrap();
        let input = folder.path().join("die.step");
        std::fs::write(&input, "die").unwrap();
        let missing = folder.path().join("other.step");
        let dotted = folder.path().join(".").join("die.step");
        let other = folder.path().join("die.json");
        let asked = |output: &Path| {
            refuse_clashes(&[&missing, &input], &[("--html", None), ("--json", Some(output))])
        };
        for output in [&input, &dotted] {
            let message = asked(output).unwrap_err().error.to_string();
            assert!(message.contains("--json") && message.contains("any other file"), "{message}");
        }
        assert!(asked(&other).is_ok());
    }

    #[test]
    fn two_outputs_are_two_files() {
        let folder = tempfile::tempdir().unwrap();
        let page = folder.path().join("audit.html");
        let same = folder.path().join(".").join("audit.html");
        let asked =
            |map: &Path| refuse_clashes(&[], &[("--map", Some(map)), ("--html", Some(&page))]);
        let message = asked(&same).unwrap_err().error.to_string();
        assert!(message.contains("--map and --html would both write"), "{message}");
        assert!(asked(&folder.path().join("map.html")).is_ok());
    }
}
