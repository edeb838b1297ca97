//! Options of `sbatch` that a user gives.

use crate::runner::template::{joined, split};

/// Options that the study sets for every array, by their names without dashes: an array with others is not found again, and
/// a submission that waits for its tasks does not return.
const RESERVED: [&str; 7] = ["array", "a", "job-name", "J", "wait", "W", "wrap"];
/// Options that name clusters.
const CLUSTERS: [&str; 3] = ["clusters", "cluster", "M"];

/// Options of `sbatch`. A later option counts more than an earlier one of the same name.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Options {
    given: Vec<Given>,
}

/// An option: one argument (`--qos=low`, `-plong`, `--requeue`), or an argument and its value (`-p long`).
#[derive(Debug, Clone, PartialEq, Eq)]
struct Given {
    word: String,
    value: Option<String>,
}

impl Options {
    /// Sets an option to a value, which may have spaces.
    ///
    /// # Errors
    /// What is wrong with the value, in words.
    pub fn set(&mut self, name: &str, value: &str) -> Result<(), String> {
        printable(value)?;
        self.given.push(Given { word: format!("--{name}={value}"), value: None });
        Ok(())
    }

    /// Adds the options in a text, which is split into words as by a shell: `--comment="two words" -p long`.
    ///
    /// # Errors
    /// What in the text is no option, in words.
    pub fn add(&mut self, text: &str) -> Result<(), String> {
        printable(text)?;
        let words = split(text).ok_or("with a quote that is not closed")?;
        let mut added: Vec<Given> = Vec::new();
        for word in words {
            if word.starts_with('-') && word != "-" && word != "--" {
                added.push(Given { word, value: None });
                continue;
            }
            let last = added.last_mut().filter(|last| last.takes_value());
            let last = last.ok_or_else(|| format!("where {word:?} belongs to no option"))?;
            last.value = Some(word);
        }
        if added.is_empty() {
            return Err("without an option".into());
        }
        match added.iter().find(|option| RESERVED.contains(&option.name())) {
            Some(option) => Err(format!("where {} is set by the study", option.word)),
            None => {
                self.given.append(&mut added);
                Ok(())
            }
        }
    }

    /// Options that do not name clusters.
    fn others(&self) -> impl Iterator<Item = &Given> {
        self.given.iter().filter(|option| !CLUSTERS.contains(&option.name()))
    }

    /// Arguments of `sbatch`, without those that name clusters.
    pub(super) fn arguments(&self) -> Vec<String> {
        let words = |option: &Given| [Some(option.word.clone()), option.value.clone()];
        self.others().flat_map(words).flatten().collect()
    }

    /// Options as a script has them, quoted, without those that name clusters.
    pub(super) fn lines(&self) -> Vec<String> {
        self.others().map(Given::line).collect()
    }

    /// Names without dashes.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.given.iter().map(Given::name)
    }

    /// The clusters that the last option for them names: `a`, `a,b` or `all`.
    pub(super) fn clusters(&self) -> Option<&str> {
        let last = self.given.iter().rev().find(|option| CLUSTERS.contains(&option.name()));
        last.and_then(Given::value)
    }
}

impl Given {
    /// Whether the option begins with two dashes.
    fn is_long(&self) -> bool {
        self.word.starts_with("--")
    }

    /// Whether the next word may be the value.
    fn takes_value(&self) -> bool {
        let has_value = if self.is_long() { self.word.contains('=') } else { self.word.len() > 2 };
        !has_value && self.value.is_none()
    }

    /// Name without dashes.
    fn name(&self) -> &str {
        match self.word.strip_prefix("--") {
            Some(long) => long.split('=').next().unwrap_or(long),
            None => {
                let letters = &self.word[1..];
                letters.char_indices().nth(1).map_or(letters, |(end, _)| &letters[..end])
            }
        }
    }

    /// The value, if there is one.
    fn value(&self) -> Option<&str> {
        let attached = match self.word.split_once('=') {
            Some((_, value)) if self.is_long() => Some(value),
            _ if self.is_long() => None,
            _ => Some(&self.word[1 + self.name().len()..]).filter(|value| !value.is_empty()),
        };
        attached.or(self.value.as_deref())
    }

    /// The option as a script has it.
    fn line(&self) -> String {
        let quoted = |word: &str| joined(&[word.to_owned()]);
        let option = match self.word.split_once('=') {
            Some((name, value)) if self.is_long() => format!("{name}={}", quoted(value)),
            _ => quoted(&self.word),
        };
        self.value.as_ref().map_or(option.clone(), |value| format!("{option} {}", quoted(value)))
    }
}

/// Refuses characters that end a line of a script.
fn printable(text: &str) -> Result<(), String> {
    if text.contains(char::is_control) {
        return Err("with a line break or another control character".into());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn options(texts: &[&str]) -> Options {
        let mut options = Options::default();
        texts.iter().for_each(|text| options.add(text).unwrap());
        options
    }

    #[test]
    fn a_value_with_spaces_is_one_argument() {
        let mut own = options(&["--comment \"two words\" --qos=low", "--comment='of three words'"]);
        own.set("account", "metal forming").unwrap();
        let arguments = own.arguments();
        let expected = ["--comment", "two words", "--qos=low", "--comment=of three words"];
        assert_eq!(arguments[..4], expected);
        assert_eq!(arguments[4..], ["--account=metal forming"]);
        let lines = own.lines();
        assert_eq!(lines[0], "--comment 'two words'");
        assert_eq!(lines[2..], ["--comment='of three words'", "--account='metal forming'"]);
        // A script is read again as the same options.
        let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
        assert_eq!(options(&lines), own);
    }

    #[test]
    fn what_is_no_option_or_is_set_by_the_study_is_refused() {
        for (text, why) in [
            ("long", "\"long\" belongs to no option"),
            ("--comment=two words", "\"words\" belongs to no option"),
            ("-plong words", "\"words\" belongs to no option"),
            ("-p long words", "\"words\" belongs to no option"),
            ("--qos=low -- x", "\"--\" belongs to no option"),
            ("-", "\"-\" belongs to no option"),
            ("", "without an option"),
            ("--comment='open", "not closed"),
            ("--qos=low\nrm", "line break"),
            ("--array=0-3", "--array=0-3 is set by the study"),
            ("--qos=low -W", "-W is set by the study"),
            ("-Jmine", "-Jmine is set by the study"),
        ] {
            let found = Options::default().add(text).unwrap_err();
            assert!(found.contains(why), "{text}: {found}");
        }
        assert!(Options::default().set("account", "a\nb").is_err());
    }

    #[test]
    fn clusters_are_those_of_the_last_option() {
        for text in ["-M a", "-Ma", "--clusters=a", "--clusters a", "-M b --cluster=a --qos=low"] {
            let options = options(&[text]);
            assert_eq!(options.clusters(), Some("a"), "{text}");
            assert!(options.arguments().iter().all(|word| word == "--qos=low"), "{text}");
        }
        assert_eq!(options(&["-M", "--qos=a"]).clusters(), None);
        assert_eq!(options(&["-M a,b"]).clusters(), Some("a,b"));
        let names: Vec<String> =
            options(&["--mem-per-cpu=2G -t 5"]).names().map(str::to_owned).collect();
        assert_eq!(names, ["mem-per-cpu", "t"]);
    }
}
