//! `kanagata split FILE -o FOLDER`: a tool file for every body.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use super::args::{ConvertArgs, HowArgs};
use super::made::Made;
use super::make::make_tool;
use crate::cad::Model;
use crate::cad::attributes::Body;
use crate::cli::doubts::print_conversion_doubts;
use crate::cli::exit::{EXIT_HELP, Exit, Failure};
use crate::cli::output_clash::refuse_clashes;
use crate::cli::paths::{input_path, named_path};
use crate::cli::read::read_model;
use crate::cli::stages::{name_part, show};
use crate::cli::terminal::{err, out};
use crate::report::doubt::Doubt;

/// Largest number of bodies of one call.
const BODIES_MAX: usize = 500;
/// Characters of a file name before `.tool.json`.
const NAME_LENGTH_MAX: usize = 60;

/// Arguments of `split`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Examples:\n  kanagata split fixtures/bodies/press.stp -o tools\n  \
    kanagata split press.stp -o tools --bodies 'die,punch' --facing +z --tol 0.01mm\n\n{EXIT_HELP}"))]
pub struct SplitArgs {
    /// IGES or STEP file; - for standard input
    #[arg(value_parser = input_path)]
    file: PathBuf,
    /// Folder of the tool files; made if it is not there. A file is named after its body
    #[arg(short, long, value_name = "FOLDER", value_parser = named_path)]
    output: PathBuf,
    #[command(flatten)]
    how: HowArgs,
}

/// Converts every body, or every chosen one, with a line each.
///
/// # Errors
/// Exit code 1 for a tool with a doubt, 2 for a file that is not CAD, and when a body cannot be converted (after all others are written); 4 when
/// files cannot be read or written.
pub fn run(args: &SplitArgs) -> Result<Exit, Failure> {
    args.how.mesher.check()?;
    if let Some(scene) = &args.how.reach {
        crate::scene::read::scene_of(scene)?;
    }
    let _shown = show(args.how.quiet);
    let whole = read_model(&args.file, args.how.mesher.lost_faces())?;
    let bodies = bodies_of(args, &whole)?;
    std::fs::create_dir_all(&args.output).map_err(|e| {
        Failure::new(Exit::Io, format!("cannot make the folder {}: {e}", args.output.display()))
    })?;
    let mut failed: Vec<(String, Failure)> = Vec::new();
    let mut doubts: Vec<Doubt> = Vec::new();
    for (number, (body, name)) in bodies.iter().enumerate() {
        name_part(format!("{name}, body {} of {}: ", number + 1, bodies.len()));
        let output = args.output.join(format!("{name}.tool.json"));
        let one = one_body(args, &output, name, *body);
        match converted(&one, &whole) {
            Ok(made) => {
                out!("{}  body {}: {}", output.display(), body + 1, made.figures());
                let named = |d: Doubt| Doubt { text: format!("{name}: {}", d.text), ..d };
                doubts.extend(made.doubts().into_iter().map(named));
            }
            Err(failure) => {
                err!("error: body {} ({name}): {}", body + 1, failure.error);
                failed.push((name.clone(), failure));
            }
        }
    }
    print_conversion_doubts(&doubts, args.how.accept_doubts);
    let Some((_, first)) = failed.first() else {
        return Ok(Exit::of_doubts(&doubts, args.how.accept_doubts));
    };
    let names: Vec<&str> = failed.iter().map(|(name, _)| name.as_str()).collect();
    let (file, n, all, names) = (args.file.display(), failed.len(), bodies.len(), names.join(", "));
    let what = format!(
        "{file}: {n} of {all} bodies are not converted: {names}; the reasons are above; convert these one by one with --bodies"
    );
    Err(Failure::new(first.exit, what))
}

/// Converts one body.
fn converted(args: &ConvertArgs, whole: &Model) -> Result<Made, Failure> {
    args.check_borders()?;
    args.check_refinement()?;
    refuse_clashes(&args.inputs(), &[("--output", Some(&args.output))])?;
    make_tool(args, whole)
}

/// The arguments of `convert` for one body.
fn one_body(args: &SplitArgs, output: &Path, name: &str, body: usize) -> ConvertArgs {
    let select = args.how.select.of_body(body + 1);
    ConvertArgs {
        file: args.file.clone(),
        output: output.to_path_buf(),
        name: Some(name.to_owned()),
        to: None,
        crease_deg: None,
        mesh: None,
        how: HowArgs { select, ..args.how.clone() },
    }
}

/// The bodies with a chosen face, each with its file name.
fn bodies_of(args: &SplitArgs, whole: &Model) -> Result<Vec<(usize, String)>, Failure> {
    let chosen = args.how.select.choose(&args.file, whole)?;
    let model = chosen.as_ref().map_or(whole, |c| &c.model);
    let found: BTreeSet<usize> = model.faces.iter().map(|f| f.attributes.body).collect();
    if found.len() > BODIES_MAX {
        return Err(Failure::input(format!(
            "{}: {} bodies; allowed: at most {BODIES_MAX} at once; choose some with --bodies, --layers or --box, or join the faces \
             in the CAD",
            args.file.display(),
            found.len()
        )));
    }
    Ok(named_bodies(whole, found))
}

/// Bodies with the names of their tool files without `.tool.json`.
pub(in crate::cli) fn named_bodies(model: &Model, bodies: BTreeSet<usize>) -> Vec<(usize, String)> {
    let mut used = BTreeSet::new();
    bodies.into_iter().map(|b| (b, file_name(model.bodies.get(b), b, &mut used))).collect()
}

/// File name of a body, unique whatever the case of its letters: its own name, or its number.
fn file_name(body: Option<&Body>, number: usize, used: &mut BTreeSet<String>) -> String {
    let own = body.and_then(|b| b.path.last()).map_or("", |name| name);
    let plain = |c: char| if c.is_alphanumeric() || matches!(c, '-' | '_' | '.') { c } else { '-' };
    let clean: String = own.chars().take(NAME_LENGTH_MAX).map(plain).collect();
    let clean = clean.trim_matches(['-', '.']);
    let name = if clean.is_empty() { format!("body-{}", number + 1) } else { clean.to_owned() };
    let mut unique = name.clone();
    let mut count = 1;
    while !used.insert(unique.to_lowercase()) {
        count += 1;
        unique = format!("{name}-{count}");
    }
    unique
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cad::attributes::BodyKind;

    #[test]
    fn files_are_named_after_bodies_and_never_twice() {
        let mut used = BTreeSet::new();
        let mut named = |path: &[&str], number| {
            let path = path.iter().map(|p| (*p).into()).collect();
            let body = Body { path, kind: BodyKind::Solid, source: String::new() };
            file_name(Some(&body), number, &mut used)
        };
        assert_eq!(named(&["press", "die"], 0), "die");
        assert_eq!(named(&["Die"], 1), "Die-2");
        assert_eq!(named(&["die-2"], 2), "die-2-2");
        assert_eq!(named(&["../a b/ü"], 3), "a-b-ü");
        assert_eq!(named(&["///"], 4), "body-5");
        assert_eq!(named(&[], 5), "body-6");
        assert!(named(&["x".repeat(300).as_str()], 6).len() == 60);
    }
}
