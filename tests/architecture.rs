//! The shape of the house: an import always points down, and the two wings meet only on the ground floor.

#[path = "architecture/imports.rs"]
mod imports;
#[path = "architecture/listing.rs"]
mod listing;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use imports::{Imports, Module};

/// Floors from the top; modules on one floor do not see each other.
const FLOORS: [&[&str]; 9] = [
    &["cli"],
    &["prelude"],
    &["study", "accuracy", "reach"],
    &["run", "convert"],
    &["scene", "audit"],
    &["solver", "mesh"],
    &["report", "contact"],
    &["cad", "tool"],
    &["geometry", "files", "cancel", "progress"],
];

/// Rooms of the solver from the top: an import points down this list.
const ROOMS: [&str; 22] = [
    "reach",
    "simulation",
    "observe",
    "snapshot",
    "penetration",
    "increment",
    "remedy",
    "stage",
    "error",
    "report",
    "newton",
    "active_set",
    "system",
    "limits",
    "contact",
    "tools",
    "assembly",
    "sheet",
    "element",
    "material",
    "linear",
    "numbers",
];

/// Modules that a module may never use although it stands above them.
const FORBIDDEN: [(&str, &[&str]); 3] = [
    ("contact", &["cad", "mesh", "convert", "audit"]),
    ("solver", &["cad", "mesh", "convert", "audit"]),
    ("report", &["cad", "solver"]),
];

fn rust_files(folder: &Path, into: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            rust_files(&path, into);
        } else if path.extension().is_some_and(|e| e == "rs") {
            into.push(path);
        }
    }
}

fn floor(module: &str) -> Option<usize> {
    FLOORS.iter().position(|f| f.contains(&module))
}

fn modules_of_the_library() -> Vec<(String, Vec<PathBuf>)> {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut modules = Vec::new();
    for entry in fs::read_dir(&src).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        if name == "lib" || name == "bin" {
            continue;
        }
        let mut files = Vec::new();
        if path.is_dir() {
            rust_files(&path, &mut files);
        } else {
            files.push(path);
        }
        modules.push((name, files));
    }
    modules
}

/// What a file has before its tests.
fn without_tests(text: &str) -> &str {
    text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default()
}

#[test]
fn files_are_opened_and_written_by_the_routines_of_one_module_only() {
    const OPENS: [&str; 8] = [
        "File::open(",
        "File::create(",
        "fs::read(",
        "fs::write(",
        "fs::copy(",
        "OpenOptions",
        "fs::read_to_string(",
        "File::options(",
    ];
    let mut found = Vec::new();
    for (module, files) in modules_of_the_library() {
        // A build script is no part of the library.
        let of_library = |file: &&PathBuf| module != "files" && !file.ends_with("run/identity.rs");
        for file in files.iter().filter(of_library) {
            let of_tests = file.components().any(|part| part.as_os_str() == "tests")
                || file.file_stem().is_some_and(|name| name.to_string_lossy().ends_with("tests"));
            let text = fs::read_to_string(file).unwrap();
            let lines = without_tests(&text).lines().filter(|_| !of_tests);
            for (line, words) in lines.enumerate() {
                // Readers of our own may be called so: `cad::File::open` takes bytes.
                let opens = OPENS.iter().any(|open| words.contains(open));
                if opens && !words.contains("iges::File") && !words.contains("File::open(bytes)") {
                    found.push(format!("{}:{}: {}", file.display(), line + 1, words.trim()));
                }
            }
        }
    }
    assert!(found.is_empty(), "{found:#?}");
}

fn top(module: &Module) -> &str {
    module.first().map_or("lib", String::as_str)
}

#[test]
fn imports_point_down() {
    let found = Imports::with_tests(&sources());
    let mut faults = Vec::new();
    for (module, uses) in found.uses.iter().filter(|(module, _)| !module.is_empty()) {
        let own = floor(top(module)).unwrap_or_else(|| panic!("no floor has {module:?}"));
        let upwards = |other: &&Module| {
            top(other) != top(module) && floor(top(other)).is_some_and(|other| other <= own)
        };
        let named = |other: &Module| format!("{} uses {}", module.join("::"), other.join("::"));
        faults.extend(uses.iter().filter(upwards).map(named));
    }
    assert!(faults.is_empty(), "imports that do not point down: {faults:#?}");
}

fn sources() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

#[test]
fn no_files_import_each_other() {
    let found = Imports::of(&sources());
    assert!(found.files.len() > 400, "{} files", found.files.len());
    let circles = found.circles();
    let of = |circle: &Vec<Module>, module: &Module| -> Vec<String> {
        let inside = found.uses[module].iter().filter(|other| circle.contains(other));
        inside.map(|other| format!("{} uses {}", module.join("::"), other.join("::"))).collect()
    };
    let edges: Vec<String> =
        circles.iter().flat_map(|c| c.iter().flat_map(|module| of(c, module))).collect();
    assert!(circles.is_empty(), "{} circles, of these imports: {edges:#?}", circles.len());
}

#[test]
fn rooms_of_the_solver_import_downwards() {
    let found = Imports::of(&sources());
    let room = |module: &Module| -> Option<usize> {
        if module.first()? != "solver" {
            return None;
        }
        let name = module.get(1)?;
        let at = ROOMS.iter().position(|room| room == name);
        Some(at.unwrap_or_else(|| panic!("room {name} is not on the list")))
    };
    let mut faults = Vec::new();
    for (module, uses) in &found.uses {
        for other in uses {
            if let (Some(own), Some(below)) = (room(module), room(other))
                && below < own
            {
                faults.push(format!("{} uses {}", module.join("::"), other.join("::")));
            }
        }
    }
    assert!(faults.is_empty(), "{faults:#?}");
}

/// The identity of a build is a digest of what a run is made of.
#[test]
fn the_identity_of_a_build_has_all_crates_that_runs_depend_on() {
    let depends = |name: &str| -> Vec<String> {
        let text = fs::read_to_string(sources().join(name).join("Cargo.toml")).unwrap();
        let text = text.split("[dev-dependencies]").next().unwrap();
        let names = text.lines().filter_map(|line| line.strip_prefix("kanagata-"));
        names.filter_map(|line| Some(line.split(['.', ' ']).next()?.to_owned())).collect()
    };
    let (mut all, mut open) = (BTreeSet::new(), vec!["run".to_owned()]);
    while let Some(name) = open.pop() {
        if all.insert(format!("src/{name}")) {
            open.extend(depends(&name));
        }
    }
    let script = fs::read_to_string(sources().join("run/identity.rs")).unwrap();
    let list = script.split("const SOURCES").nth(1).unwrap().split("];").next().unwrap();
    let listed: BTreeSet<String> =
        list.split('"').filter(|part| part.starts_with("src/")).map(str::to_owned).collect();
    assert!(all.len() > 8 && listed == all, "{listed:?}, {all:?}");
}

/// `KANAGATA_BLESS=1` writes it.
#[test]
fn the_listing_of_rooms_is_that_of_the_sources() {
    const MARKS: [&str; 2] = ["<!-- rooms -->\n", "<!-- end of rooms -->"];
    let of_solver = ROOMS.iter().map(|room| format!("solver/{room}"));
    let modules = FLOORS.iter().flat_map(|floor| floor.iter());
    let rooms: Vec<String> = modules
        .flat_map(|module| match *module {
            "solver" => of_solver.clone().collect(),
            other => vec![other.to_owned()],
        })
        .collect();
    let rows = listing::rows(&Imports::of(&sources()), &rooms);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/architecture.md");
    let text = fs::read_to_string(&path).unwrap();
    let [first, last] = MARKS.map(|mark| text.find(mark).unwrap());
    let first = first + MARKS[0].len();
    if std::env::var_os("KANAGATA_BLESS").is_some() {
        let listing = listing::written(&rows);
        fs::write(&path, format!("{}{listing}{}", &text[..first], &text[last..])).unwrap();
        return;
    }
    let faults = listing::faults(&text[first..last], &rows);
    assert!(faults.is_empty(), "KANAGATA_BLESS=1 cargo test --test architecture: {faults:#?}");
}

#[test]
fn a_listing_with_other_rooms_uses_or_sizes_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("lib.rs", "mod a;\nmod b;\n");
    write("a.rs", "pub struct One;\n");
    write("b.rs", "use crate::a::One;\nfn f(_: One) {}\n");
    let rows = listing::rows(&Imports::of(folder.path()), &["b".to_owned(), "a".to_owned()]);
    let written = listing::written(&rows);
    let of = |listing: &str| listing::faults(listing, &rows).len();
    assert_eq!((of(&written), of(&written.replace("| b | 1 ", "| b | 2 "))), (0, 0));
    assert_eq!(of(&written.replace("| 100 | a |", "| 100 | |")), 1);
    assert_eq!(of(&written.replace("| a | 1 | 100 |", "| a | 1 | 400 |")), 1);
    assert_eq!(of(&written.replace("| a | 1", "| c | 1")), 1);
}

/// Three files: `b` uses `a` by a name that the root passes on, `a` uses `b` in a macro, and the tests of `c` use all.
#[test]
fn circles_are_seen_through_what_is_passed_on_and_in_macros() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("lib.rs", "mod a;\nmod b;\nmod c;\npub use a::{One, Two as Second};\n");
    write("a.rs", "pub struct One; pub struct Two;\nfn f() { println!(\"{}\", crate::b::N); }\n");
    write("b.rs", "use crate::{\n    Second,\n};\npub const N: u8 = 0;\nfn f(_: Second) {}\n");
    write("c.rs", "#[cfg(test)]\nmod tests { use crate::b::N; }\nfn f() -> u8 { super::b::N }\n");
    let circles = Imports::of(folder.path()).circles();
    let named: Vec<Vec<String>> = circles
        .into_iter()
        .map(|circle| circle.into_iter().map(|m| m.join("::")).collect())
        .collect();
    assert_eq!(named, [["a", "b"]]);
}

/// `b` is a crate of its own: it uses the crate `a`, which its paths name, and a module of its own by `crate`.
#[test]
fn paths_lead_through_crates() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    };
    write("lib.rs", "pub use kanagata_a as a;\npub use kanagata_b as b;\n");
    write("a/mod.rs", "mod one;\npub use one::One;\n");
    write("a/one.rs", "pub struct One;\n");
    write("b/mod.rs", "mod two;\npub const N: u8 = 0;\n");
    write("b/two.rs", "use kanagata_a::One;\nfn f(_: One) -> u8 { crate::N }\n");
    let found = Imports::of(folder.path());
    let of = |path: &str| -> Module { path.split("::").map(str::to_owned).collect() };
    let uses: Vec<Module> = found.uses[&of("b::two")].iter().cloned().collect();
    assert_eq!(uses, [of("a::one"), of("b")]);
}

#[test]
fn contact_and_solver_never_see_cad_or_meshes() {
    let found = Imports::with_tests(&sources());
    let mut faults = Vec::new();
    for (module, never) in FORBIDDEN {
        let own = found.uses.iter().filter(|(of, _)| top(of) == module);
        for (of, uses) in own {
            let seen = uses.iter().filter(|other| never.contains(&top(other)));
            faults.extend(seen.map(|other| format!("{} uses {}", of.join("::"), other.join("::"))));
        }
    }
    assert!(faults.is_empty(), "{faults:#?}");
}
