//! The shape of the house: an import always points down, and the two wings meet only on the ground floor.

use std::fs;
use std::path::{Path, PathBuf};

/// Floors from the top; modules on one floor do not see each other.
const FLOORS: [&[&str]; 8] = [
    &["cli"],
    &["study"],
    &["run", "convert"],
    &["scene", "audit"],
    &["solver", "mesh"],
    &["report", "contact"],
    &["cad", "tool"],
    &["geometry", "files", "cancel"],
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

/// Top-level modules named after `crate::` in a text, comments left out.
fn imports(text: &str) -> Vec<String> {
    let name = |s: &str| -> String {
        s.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
    };
    let mut found = Vec::new();
    for line in text.lines().filter(|l| !l.trim_start().starts_with("//")) {
        for (at, _) in line.match_indices("crate::") {
            let rest = &line[at + "crate::".len()..];
            if let Some(list) = rest.strip_prefix('{') {
                found.extend(list.split(',').map(|part| name(part.trim())));
            } else {
                found.push(name(rest));
            }
        }
    }
    found
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
        for file in files.iter().filter(|_| module != "files") {
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

#[test]
fn imports_point_down() {
    let mut faults = Vec::new();
    for (module, files) in modules_of_the_library() {
        let own = floor(&module).unwrap_or_else(|| panic!("module {module} stands on no floor"));
        for file in files {
            for name in imports(&fs::read_to_string(&file).unwrap()) {
                let Some(other) = floor(&name) else { continue };
                if name != module && other <= own {
                    faults.push(format!("{} ({module}) uses {name}", file.display()));
                }
            }
        }
    }
    assert!(faults.is_empty(), "imports that do not point down:\n{}", faults.join("\n"));
}

#[test]
fn contact_and_solver_never_see_cad_or_meshes() {
    let mut faults = Vec::new();
    for (module, files) in modules_of_the_library() {
        let Some((_, never)) = FORBIDDEN.iter().find(|(m, _)| *m == module) else { continue };
        for file in files {
            for name in imports(&fs::read_to_string(&file).unwrap()) {
                if never.contains(&name.as_str()) {
                    faults.push(format!("{} uses {name}", file.display()));
                }
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn the_scan_sees_imports() {
    let text = "use crate::cad::Model;\n// crate::mesh\nuse crate::{tool, geometry::Vec3};\n";
    assert_eq!(imports(text), ["cad", "tool", "geometry"]);
}
