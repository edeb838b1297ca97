//! Command templates: words with `{NAME}` in them.

use std::collections::BTreeMap;

/// A command that runs a case somewhere: words as a shell splits them, but run without one. `{case}` is the command of the
/// case; as a word of its own it stands for all its words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Template {
    words: Vec<String>,
}

/// Values for the names in a template.
pub type Values<'a> = BTreeMap<&'static str, String>;

impl std::str::FromStr for Template {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let words = split(text).filter(|words| !words.is_empty());
        let words = words
            .ok_or_else(|| format!("found {text:?}; allowed: a command with closed quotes"))?;
        Ok(Self { words })
    }
}

impl Template {
    /// The first `{NAME}` that is not one of `names`.
    #[must_use]
    pub fn unknown(&self, names: &[&str]) -> Option<String> {
        let marks = self.words.iter().flat_map(|word| {
            word.match_indices('{').filter_map(|(at, _)| {
                let inner = &word[at + 1..];
                inner.find('}').map(|end| inner[..end].to_owned())
            })
        });
        let is_name = |mark: &String| {
            !mark.is_empty() && mark.chars().all(|c| c.is_ascii_lowercase() || c == '_')
        };
        marks.filter(is_name).find(|mark| !names.contains(&mark.as_str()))
    }

    /// Whether the template has `{name}`.
    #[must_use]
    pub fn uses(&self, name: &str) -> bool {
        self.words.iter().any(|word| word.contains(&format!("{{{name}}}")))
    }

    /// The words of the command for the words of a case's command and other values.
    #[must_use]
    pub fn words(&self, case: &[String], values: &Values<'_>) -> Vec<String> {
        let put = |word: &String| -> Vec<String> {
            if word == "{case}" {
                return case.to_vec();
            }
            let mut word = word.replace("{case}", &joined(case));
            for (name, value) in values {
                word = word.replace(&format!("{{{name}}}"), value);
            }
            vec![word]
        };
        self.words.iter().flat_map(put).collect()
    }
}

/// Words of a line, as a shell splits it; `None` where a quote is not closed.
#[must_use]
pub fn split(line: &str) -> Option<Vec<String>> {
    shlex::split(line)
}

/// Words as a line for a shell.
#[must_use]
pub fn joined(words: &[String]) -> String {
    // A word with a zero byte is no argument of any program.
    let quoted = words.iter().filter_map(|word| shlex::try_quote(word).ok());
    quoted.collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_is_put_in_as_words_or_as_text() {
        let case: Vec<String> = ["solve", "case", "cases/a b"].map(String::from).to_vec();
        let values = Values::from([("host", "n1".to_owned()), ("dir", "/x".to_owned())]);
        let words = |text: &str| text.parse::<Template>().unwrap().words(&case, &values).join("|");
        assert_eq!(words("ssh {host} cd {dir} && {case}"), "ssh|n1|cd|/x|&&|solve|case|cases/a b");
        assert_eq!(words("sh -c 'cd {dir} && {case}'"), "sh|-c|cd /x && solve case 'cases/a b'");
        let template: Template = "run {host} {nosuch} ${HOME}".parse().unwrap();
        assert_eq!(template.unknown(&["host", "case"]).as_deref(), Some("nosuch"));
        assert!(template.uses("host") && !template.uses("case"));
        assert!("run 'open".parse::<Template>().is_err() && "".parse::<Template>().is_err());
    }
}
