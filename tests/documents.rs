//! Language of documents, messages and `--help`: terms of the field, short sentences, links that lead somewhere.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use syn::visit::Visit;

/// Words of a private dialect, each with the term to use. They are looked for between words, whatever their case.
const FORBIDDEN: [(&str, &str); 24] = [
    ("gave up", "not converged; aborted"),
    ("given up", "not converged; aborted"),
    ("gives up", "ends; aborts"),
    ("let go", "released"),
    ("lets go", "releases"),
    ("goes on to the bit", "restarts bit-identically"),
    ("back and forth", "cycling"),
    ("steadied", "viscous stabilisation"),
    ("balance that does not last", "unstable equilibrium"),
    ("no balance", "no equilibrium; not converged"),
    ("moved on by itself", "snap-through"),
    ("set free", "released elastic energy"),
    ("tilt by turns", "hourglass mode"),
    ("lean by turns", "hourglass mode"),
    ("passes through itself", "self-penetration"),
    ("shears its faces through", "through-thickness shear at the friction limit"),
    ("over the border of a tool", "overhang at a tool edge"),
    ("stands in a tool", "penetration"),
    ("lies loose", "unconstrained sheet"),
    ("is told of", "is reported"),
    ("as it is told", "as reported"),
    ("blind user", "name the case by what it is"),
    ("blind tester", "name the case by what it is"),
    ("half off", "error; deviation"),
];

/// Longest sentence and paragraph [words].
const SENTENCE: usize = 35;
const PARAGRAPH: usize = 120;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Files under a path with this ending.
fn files(under: &Path, ending: &str, found: &mut Vec<PathBuf>) {
    if under.is_file() {
        found.push(under.to_path_buf());
        return;
    }
    for entry in fs::read_dir(under).unwrap_or_else(|e| panic!("{}: {e}", under.display())) {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(&path, ending, found);
        } else if path.extension().is_some_and(|e| e == ending) {
            found.push(path);
        }
    }
}

/// README, guide, reference, theory, architecture and changelog.
fn documents() -> Vec<PathBuf> {
    let mut found = Vec::new();
    for part in [
        "README.md",
        "CHANGELOG.md",
        "docs/architecture.md",
        "docs/guide",
        "docs/reference",
        "docs/theory",
    ] {
        files(&root().join(part), "md", &mut found);
    }
    found
}

fn dialect(text: &str) -> Vec<String> {
    let spaced: String = text.split_whitespace().collect::<Vec<_>>().join(" ").to_lowercase();
    let part = |at: Option<char>| at.is_none_or(|c| !c.is_alphanumeric());
    let has = |word: &str| {
        spaced.match_indices(word).any(|(at, _)| {
            part(spaced[..at].chars().next_back()) && part(spaced[at + word.len()..].chars().next())
        })
    };
    let bad = FORBIDDEN.iter().filter(|(word, _)| has(word));
    bad.map(|(word, term)| format!("'{word}': use '{term}'")).collect()
}

/// Paragraphs and items of lists, without headings, tables, pictures and code.
fn paragraphs(text: &str) -> Vec<String> {
    let (mut out, mut now, mut code) = (Vec::new(), String::new(), false);
    for line in text.lines() {
        let start = line.trim_start();
        code ^= start.starts_with("```");
        let item = start.starts_with("- ")
            || start.split_once(". ").is_some_and(|(n, _)| n.parse::<u32>().is_ok());
        let other = code
            || start.is_empty()
            || ["```", "#", "|", "!", "    "].iter().any(|mark| line.starts_with(mark))
            || line.starts_with("    ");
        if other || item {
            out.push(std::mem::take(&mut now));
        }
        if !other || (item && !code) {
            now += " ";
            now += start;
        }
    }
    out.push(now);
    out.retain(|paragraph| !paragraph.trim().is_empty());
    out
}

/// Words of each sentence.
fn sentences(paragraph: &str) -> Vec<usize> {
    let words: Vec<&str> = paragraph.split_whitespace().collect();
    let (mut out, mut count) = (Vec::new(), 0);
    for (k, word) in words.iter().enumerate() {
        count += usize::from(word.chars().any(char::is_alphanumeric));
        let ends =
            word.trim_end_matches(['"', '\'', ')', '*', '`']).ends_with(['.', '!', '?', ':', ';']);
        let begins = words.get(k + 1).is_none_or(|next| {
            next.chars().find(|c| c.is_alphanumeric()).is_none_or(|c| !c.is_lowercase())
        });
        if ends && (begins || word.ends_with([':', ';'])) {
            out.push(std::mem::take(&mut count));
        }
    }
    out.push(count);
    out
}

#[test]
fn documents_use_terms_of_the_field_in_short_sentences() {
    let mut faults = Vec::new();
    for path in documents() {
        let text = fs::read_to_string(&path).unwrap();
        let name = path.strip_prefix(root()).unwrap().display().to_string();
        faults.extend(dialect(&text).into_iter().map(|fault| format!("{name}: {fault}")));
        for paragraph in paragraphs(&text) {
            let begins: String = paragraph.trim().chars().take(60).collect();
            let all = sentences(&paragraph);
            if let Some(long) = all.iter().find(|words| **words > SENTENCE) {
                faults.push(format!("{name}: a sentence of {long} words: {begins}"));
            }
            let words: usize = all.iter().sum();
            if words > PARAGRAPH {
                faults.push(format!("{name}: a paragraph of {words} words: {begins}"));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn links_of_documents_lead_to_files() {
    let mut all = documents();
    files(&root().join("docs/results"), "md", &mut all);
    let mut faults = Vec::new();
    for path in all {
        let text = fs::read_to_string(&path).unwrap();
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let file = link.split('#').next().unwrap_or_default();
            let local = !file.is_empty() && !file.contains("://") && !file.contains(' ');
            if local && !path.parent().unwrap().join(file).exists() {
                faults.push(format!("{}: {link}", path.display()));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// String literals of a file, also in the arguments of macros, without those of tests.
#[derive(Default)]
struct Literals(Vec<String>);

impl Literals {
    fn of_tokens(&mut self, tokens: proc_macro2::TokenStream) {
        for token in tokens {
            match token {
                proc_macro2::TokenTree::Group(group) => self.of_tokens(group.stream()),
                proc_macro2::TokenTree::Literal(literal) => self.0.push(literal.to_string()),
                _ => {}
            }
        }
    }
}

impl Visit<'_> for Literals {
    fn visit_item_mod(&mut self, item: &syn::ItemMod) {
        if item.ident != "tests" {
            syn::visit::visit_item_mod(self, item);
        }
    }

    fn visit_lit_str(&mut self, literal: &syn::LitStr) {
        self.0.push(literal.value());
    }

    fn visit_macro(&mut self, item: &syn::Macro) {
        self.of_tokens(item.tokens.clone());
    }

    fn visit_attribute(&mut self, attribute: &syn::Attribute) {
        // Doc comments are no messages; texts of `thiserror` and `clap` are.
        if !attribute.path().is_ident("doc")
            && let syn::Meta::List(list) = &attribute.meta
        {
            self.of_tokens(list.tokens.clone());
        }
    }
}

/// String literals of the sources without tests, each with the file's path from the root.
fn messages() -> Vec<(String, String)> {
    let mut sources = Vec::new();
    files(&root().join("src"), "rs", &mut sources);
    let mut found = Vec::new();
    for path in sources.iter().filter(|path| !path.to_string_lossy().contains("tests")) {
        let file = syn::parse_file(&fs::read_to_string(path).unwrap()).unwrap();
        let mut literals = Literals::default();
        literals.visit_file(&file);
        let name = path.strip_prefix(root()).unwrap().to_string_lossy().replace('\\', "/");
        found.extend(literals.0.into_iter().map(|text| (name.clone(), text)));
    }
    found
}

#[test]
fn messages_use_terms_of_the_field() {
    let all = messages();
    let sentences = all.iter().filter(|(_, text)| text.contains(' '));
    let faults: Vec<String> = sentences
        .flat_map(|(name, text)| {
            dialect(text).into_iter().map(move |f| format!("{name}: {f}: {text}"))
        })
        .collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Whether a text names an option of the command line, `--word` behind a space or a mark, or a command of the programs.
fn names_the_command_line(text: &str) -> bool {
    let option = |(at, _): (usize, &str)| {
        let before = text[..at].chars().next_back();
        let is_word = text[at + 2..].starts_with(|c: char| c.is_ascii_lowercase());
        is_word && before.is_some_and(|c| c == ' ' || c == '`' || c == '(')
    };
    text.match_indices("--").any(option) || text.contains("`kanagata")
}

/// Whoever embeds the library has no command line: the programs add its remedies to messages (`src/cli/remedy.rs`).
#[test]
fn messages_of_the_library_name_no_options_of_the_command_line() {
    for (text, names) in [
        ("convert with --tol 0.1mm", true),
        ("`--tol`", true),
        ("see `kanagata inspect`", true),
        ("--restart", false),
        ("a -- b", false),
        ("kanagata-scene", false),
    ] {
        assert_eq!(names_the_command_line(text), names, "{text}");
    }
    let of_programs = |name: &str| ["src/cli/", "src/bin/"].iter().any(|at| name.starts_with(at));
    let all = messages();
    let faults: Vec<String> = all
        .iter()
        .filter(|(name, text)| !of_programs(name) && names_the_command_line(text))
        .map(|(name, text)| format!("{name}: {text}"))
        .collect();
    assert!(all.len() > 1000 && faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn help_uses_terms_of_the_field() {
    let mut faults = Vec::new();
    let programs = [env!("CARGO_BIN_EXE_kanagata"), env!("CARGO_BIN_EXE_kanagata-solve")];
    for program in programs {
        let help = |arguments: &[&str]| {
            let out = Command::new(program).args(arguments).arg("--help").output().unwrap();
            String::from_utf8(out.stdout).unwrap()
        };
        let all = help(&[]);
        let commands = all.lines().skip_while(|line| !line.starts_with("Commands:")).skip(1);
        let commands = commands.take_while(|line| line.starts_with("  "));
        let names: Vec<&str> = commands.filter_map(|line| line.split_whitespace().next()).collect();
        assert!(names.len() >= 3, "{all}");
        for text in names.iter().map(|name| help(&[name])).chain([all.clone()]) {
            faults.extend(dialect(&text));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn the_readme_is_two_screens_and_lines_of_the_changelog_are_short() {
    let readme = fs::read_to_string(root().join("README.md")).unwrap();
    assert!(readme.lines().count() <= 120, "{} lines", readme.lines().count());
    let changelog = fs::read_to_string(root().join("CHANGELOG.md")).unwrap();
    let long: Vec<&str> = changelog.lines().filter(|line| line.chars().count() > 100).collect();
    assert!(long.is_empty(), "{}", long.join("\n"));
}
