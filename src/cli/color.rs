//! Whether output is coloured, decided here for both programs.
//!
//! `--color` comes first; then a variable `NO_COLOR` that is not empty (no-color.org), `CLICOLOR_FORCE` that is neither empty
//! nor 0, and `TERM=dumb`; then whether the stream is a terminal.

use std::ffi::OsString;
use std::io::IsTerminal as _;

use clap::{ColorChoice, Parser};

/// Argument of both programs.
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct ColorArgs {
    /// Colour messages; `auto`: on a terminal, unless NO_COLOR is set, and with CLICOLOR_FORCE everywhere
    #[arg(long, global = true, value_name = "WHEN", value_enum, default_value_t = ColorChoice::Auto)]
    color: ColorChoice,
}

/// Parses the arguments of the process. Help and errors of arguments are coloured as all other output.
pub(super) fn parse<P: Parser>() -> P {
    let choice = requested(std::env::args_os());
    let [out, error] = [std::io::stdout().is_terminal(), std::io::stderr().is_terminal()]
        .map(|terminal| is_colored(choice, variable, terminal));
    super::terminal::set_colors(out, error);
    let choice = match (out, error) {
        (true, true) => ColorChoice::Always,
        (false, false) => ColorChoice::Never,
        _ => ColorChoice::Auto,
    };
    let matches = P::command().color(choice).get_matches();
    P::from_arg_matches(&matches).unwrap_or_else(|error| error.exit())
}

fn variable(name: &str) -> Option<String> {
    std::env::var(name).ok()
}

/// The value of `--color` in the arguments, which clap cannot know before it parses them; `auto` where it is not valid.
fn requested(arguments: impl Iterator<Item = OsString>) -> ColorChoice {
    let arguments: Vec<String> = arguments.map(|a| a.to_string_lossy().into_owned()).collect();
    let before = arguments.iter().take_while(|a| *a != "--");
    let values = before.zip(arguments.iter().skip(1).map(Some).chain([None]));
    let value = |(one, next): (&'_ String, Option<&String>)| match one.strip_prefix("--color") {
        Some("") => next.cloned(),
        Some(rest) => rest.strip_prefix('=').map(str::to_owned),
        None => None,
    };
    let last = values.filter_map(value).last();
    last.and_then(|value| value.parse().ok()).unwrap_or(ColorChoice::Auto)
}

/// Whether a stream is coloured.
fn is_colored(
    choice: ColorChoice,
    variable: impl Fn(&str) -> Option<String>,
    is_terminal: bool,
) -> bool {
    let is_set = |name: &str| variable(name).is_some_and(|value| !value.is_empty());
    match choice {
        ColorChoice::Always => true,
        ColorChoice::Never => false,
        ColorChoice::Auto if is_set("NO_COLOR") => false,
        ColorChoice::Auto if is_set("CLICOLOR_FORCE") => {
            variable("CLICOLOR_FORCE").is_none_or(|value| value != "0")
                || is_terminal && variable("TERM").is_none_or(|term| term != "dumb")
        }
        ColorChoice::Auto => is_terminal && variable("TERM").is_none_or(|term| term != "dumb"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decided(choice: ColorChoice, set: &[(&str, &str)], is_terminal: bool) -> bool {
        let variable = |name: &str| {
            set.iter().find(|(key, _)| *key == name).map(|(_, value)| (*value).to_owned())
        };
        is_colored(choice, variable, is_terminal)
    }

    #[test]
    fn the_argument_comes_before_variables_and_these_before_the_terminal() {
        use ColorChoice::{Always, Auto, Never};
        for (choice, set, is_terminal, expected) in [
            (Auto, &[][..], true, true),
            (Auto, &[], false, false),
            (Auto, &[("NO_COLOR", "1")], true, false),
            (Auto, &[("NO_COLOR", "")], true, true),
            (Auto, &[("TERM", "dumb")], true, false),
            (Auto, &[("CLICOLOR_FORCE", "1"), ("TERM", "dumb")], false, true),
            (Auto, &[("CLICOLOR_FORCE", "0")], false, false),
            (Auto, &[("CLICOLOR_FORCE", "0")], true, true),
            (Auto, &[("CLICOLOR_FORCE", "1"), ("NO_COLOR", "1")], true, false),
            (Always, &[("NO_COLOR", "1")], false, true),
            (Never, &[("CLICOLOR_FORCE", "1")], true, false),
        ] {
            assert_eq!(decided(choice, set, is_terminal), expected, "{choice} {set:?}");
        }
    }

    #[test]
    fn the_last_choice_before_a_double_hyphen_counts() {
        let asked = |line: &str| requested(line.split(' ').map(OsString::from));
        assert_eq!(asked("kanagata inspect --color never a.igs"), ColorChoice::Never);
        assert_eq!(asked("kanagata --color=never inspect --color=always"), ColorChoice::Always);
        assert_eq!(asked("kanagata inspect -- --color=always"), ColorChoice::Auto);
        assert_eq!(asked("kanagata --color sometimes"), ColorChoice::Auto);
        assert_eq!(asked("kanagata --color"), ColorChoice::Auto);
    }
}
