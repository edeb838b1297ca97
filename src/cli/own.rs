//! No command writes over what it reads.

use std::path::Path;

use super::exit::Failure;

/// Refuses outputs, each with the name of its option, that are files the command reads; to be asked before anything is
/// written. Files are compared by where they really are, whatever links and dots lead to them.
///
/// # Errors
/// Exit code 2 for the first output that is an input.
pub fn refuse_own_inputs(
    inputs: &[&Path],
    outputs: &[(&str, Option<&Path>)],
) -> Result<(), Failure> {
    let given = outputs.iter().filter_map(|&(option, path)| Some((option, path?)));
    for (option, output) in given {
        let Ok(place) = output.canonicalize() else { continue };
        let is_same = |input: &&Path| input.canonicalize().is_ok_and(|p| p == place);
        if let Some(input) = inputs.iter().copied().find(is_same) {
            return Err(Failure::input(format!(
                "{option} {} is the file {} that this command reads, which would be lost; allowed: any other file; give {option} \
                 another name",
                output.display(),
                input.display()
            )));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_input_is_no_output_by_any_name() {
        let folder = tempfile::tempdir().unwrap();
        let input = folder.path().join("die.step");
        std::fs::write(&input, "die").unwrap();
        let dotted = folder.path().join(".").join("die.step");
        let other = folder.path().join("die.json");
        let asked = |output: &Path| {
            refuse_own_inputs(&[&other, &input], &[("--html", None), ("--json", Some(output))])
        };
        for output in [&input, &dotted] {
            let said = asked(output).unwrap_err().error.to_string();
            assert!(said.contains("--json") && said.contains("any other file"), "{said}");
        }
        assert!(asked(&other).is_ok());
    }
}
