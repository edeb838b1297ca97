//! Which file of the library uses which: imports and paths in code.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use syn::visit::{self, Visit};

/// A module by the names that lead to it from the crate.
pub type Module = Vec<String>;

/// The modules of the library: the file of each, and the modules that it uses. What a module passes on by `pub use` is used where it is
/// defined, and `mod x;` is no use.
pub struct Imports {
    pub files: BTreeMap<Module, PathBuf>,
    pub uses: BTreeMap<Module, BTreeSet<Module>>,
}

impl Imports {
    /// Of the sources in a folder, as they are built without tests.
    pub fn of(src: &Path) -> Self {
        Self::read(src, false)
    }

    /// The same with their tests.
    pub fn with_tests(src: &Path) -> Self {
        Self::read(src, true)
    }

    fn read(src: &Path, tests: bool) -> Self {
        let mut all = BTreeMap::new();
        walk(&mut Module::new(), src, &src.join("lib.rs"), tests, &mut all);
        let passed_on: BTreeMap<&Module, BTreeMap<String, Module>> =
            all.iter().map(|(module, found)| (module, passed_on(module, found, &all))).collect();
        let mut uses = BTreeMap::new();
        for (module, found) in &all {
            let mut to = BTreeSet::new();
            for path in &found.paths {
                if let Some(path) = absolute(module, path, &all)
                    && let Some(used) = defined_in(&path, &all, &passed_on, 0)
                    && used != *module
                {
                    to.insert(used);
                }
            }
            uses.insert(module.clone(), to);
        }
        Self { files: all.into_iter().map(|(module, found)| (module, found.file)).collect(), uses }
    }

    /// Groups of modules that use each other, directly or over others (Tarjan 1972).
    pub fn circles(&self) -> Vec<Vec<Module>> {
        let mut search = Search::of(&self.uses);
        for module in self.uses.keys() {
            search.visit(module);
        }
        search.circles
    }
}

/// What a file holds.
struct Found {
    file: PathBuf,
    /// Paths of imports and of code, as they are written.
    paths: Vec<Module>,
    /// Paths that are passed on, and under which name.
    passed_on: Vec<(Module, String)>,
    children: BTreeSet<String>,
    /// Children that are crates of their own, passed on as `pub use kanagata_x as x;`.
    crates: BTreeSet<String>,
}

/// The module that a crate of the workspace is, by the name of the crate.
fn crate_module(name: &str) -> Option<&str> {
    name.strip_prefix("kanagata_")
}

fn parsed(file: &Path) -> syn::File {
    let text = fs::read_to_string(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    syn::parse_file(&text).unwrap_or_else(|e| panic!("{}: {e}", file.display()))
}

/// Reads a module's file and those of its children, which are in `folder`.
fn walk(
    module: &mut Module,
    folder: &Path,
    file: &Path,
    tests: bool,
    all: &mut BTreeMap<Module, Found>,
) {
    let mut collected = Collected { tests, ..Collected::default() };
    collected.visit_file(&parsed(file));
    let passed_whole = collected.passed_on.iter().filter(|(path, _)| path.len() == 1);
    let crates: BTreeSet<String> =
        passed_whole.filter_map(|(path, _)| crate_module(&path[0]).map(str::to_owned)).collect();
    for child in collected.children.iter().chain(&crates) {
        let of_folder = folder.join(child).join("mod.rs");
        let file = if of_folder.exists() { of_folder } else { folder.join(format!("{child}.rs")) };
        module.push(child.clone());
        walk(module, &folder.join(child), &file, tests, all);
        module.pop();
    }
    let Collected { paths, passed_on, children, .. } = collected;
    let found = Found { file: file.to_path_buf(), paths, passed_on, children, crates };
    all.insert(module.clone(), found);
}

/// What is seen in a file.
#[derive(Default)]
struct Collected {
    /// Items of tests are looked at.
    tests: bool,
    paths: Vec<Module>,
    passed_on: Vec<(Module, String)>,
    children: BTreeSet<String>,
}

fn is_of_tests(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("cfg")
            && attribute.parse_args::<syn::Ident>().is_ok_and(|what| what == "test")
    })
}

impl<'a> Visit<'a> for Collected {
    fn visit_item(&mut self, item: &'a syn::Item) {
        let attributes = match item {
            syn::Item::Mod(item) => &item.attrs,
            syn::Item::Fn(item) => &item.attrs,
            syn::Item::Use(item) => &item.attrs,
            syn::Item::Impl(item) => &item.attrs,
            syn::Item::Struct(item) => &item.attrs,
            syn::Item::Const(item) => &item.attrs,
            _ => return visit::visit_item(self, item),
        };
        if self.tests || !is_of_tests(attributes) {
            visit::visit_item(self, item);
        }
    }

    fn visit_impl_item_fn(&mut self, item: &'a syn::ImplItemFn) {
        if self.tests || !is_of_tests(&item.attrs) {
            visit::visit_impl_item_fn(self, item);
        }
    }

    fn visit_item_mod(&mut self, item: &'a syn::ItemMod) {
        // A file of the tests' own folder stands outside the library.
        if item.attrs.iter().any(|attribute| attribute.path().is_ident("path")) {
            return;
        }
        if item.content.is_none() {
            self.children.insert(item.ident.to_string());
        } else {
            visit::visit_item_mod(self, item);
        }
    }

    fn visit_item_use(&mut self, item: &'a syn::ItemUse) {
        let mut all = Vec::new();
        leaves(&item.tree, &mut Module::new(), &mut all);
        if matches!(item.vis, syn::Visibility::Inherited) {
            self.paths.extend(all.into_iter().map(|(path, _)| path));
        } else {
            self.passed_on.extend(all);
        }
    }

    /// `pub(in crate::solver)` uses nothing.
    fn visit_visibility(&mut self, _: &'a syn::Visibility) {}

    fn visit_path(&mut self, path: &'a syn::Path) {
        self.paths.push(path.segments.iter().map(|part| part.ident.to_string()).collect());
        visit::visit_path(self, path);
    }

    /// The tokens of a macro are no syntax: words joined by `::` are taken for paths.
    fn visit_macro(&mut self, item: &'a syn::Macro) {
        visit::visit_macro(self, item);
        let text = item.tokens.to_string().replace(" :: ", "::");
        let is_part = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
        for word in text.split(|c| !is_part(c)).filter(|word| word.contains("::")) {
            self.paths.push(word.split("::").map(str::to_owned).collect());
        }
    }
}

/// The paths of an import, each with the name that it has afterwards.
fn leaves(tree: &syn::UseTree, path: &mut Module, all: &mut Vec<(Module, String)>) {
    let mut leaf = |name: &syn::Ident, as_name: String| {
        let mut whole = path.clone();
        if name != "self" {
            whole.push(name.to_string());
        }
        all.push((whole, as_name));
    };
    match tree {
        syn::UseTree::Name(name) => leaf(&name.ident, name.ident.to_string()),
        syn::UseTree::Rename(name) => leaf(&name.ident, name.rename.to_string()),
        syn::UseTree::Glob(_) => all.push((path.clone(), "*".into())),
        syn::UseTree::Path(part) => {
            path.push(part.ident.to_string());
            leaves(&part.tree, path, all);
            path.pop();
        }
        syn::UseTree::Group(group) => {
            group.items.iter().for_each(|tree| leaves(tree, path, all));
        }
    }
}

/// The path from the crate of a path that a module writes; `None` where it leads out of the crate or to the module's own items.
fn absolute(module: &Module, path: &Module, all: &BTreeMap<Module, Found>) -> Option<Module> {
    let mut base = module.clone();
    let mut rest = &path[..];
    let is_crate = |name: &str| all[&Module::new()].crates.contains(name);
    match rest.first()?.as_str() {
        "crate" => {
            base.truncate(usize::from(base.first().is_some_and(|top| is_crate(top))));
            rest = &rest[1..];
        }
        other if crate_module(other).is_some_and(is_crate) => {
            base = vec![crate_module(other)?.to_owned()];
            rest = &rest[1..];
        }
        "self" => rest = &rest[1..],
        "super" => {
            while rest.first().is_some_and(|part| part == "super") {
                base.pop()?;
                rest = &rest[1..];
            }
        }
        first if all[module].children.contains(first) && path.len() > 1 => {}
        _ => return None,
    }
    base.extend(rest.iter().cloned());
    Some(base)
}

/// Names that a module passes on, with the paths that they stand for.
fn passed_on(
    module: &Module,
    found: &Found,
    all: &BTreeMap<Module, Found>,
) -> BTreeMap<String, Module> {
    let pairs = found.passed_on.iter();
    pairs.filter_map(|(path, name)| Some((name.clone(), absolute(module, path, all)?))).collect()
}

/// The module in which what a path leads to is defined.
fn defined_in(
    path: &[String],
    all: &BTreeMap<Module, Found>,
    passed_on: &BTreeMap<&Module, BTreeMap<String, Module>>,
    depth: usize,
) -> Option<Module> {
    let length = (0..=path.len()).rev().find(|&n| all.contains_key(&path[..n]))?;
    let (module, rest) = path.split_at(length);
    let module = module.to_vec();
    let next = rest.first().and_then(|name| passed_on[&module].get(name));
    match next {
        Some(next) if depth < 10 => {
            let next: Module = next.iter().chain(&rest[1..]).cloned().collect();
            defined_in(&next, all, passed_on, depth + 1)
        }
        _ => Some(module),
    }
}

/// Tarjan's search for strongly connected parts.
struct Search<'a> {
    uses: &'a BTreeMap<Module, BTreeSet<Module>>,
    number: BTreeMap<&'a Module, usize>,
    lowest: BTreeMap<&'a Module, usize>,
    open: Vec<&'a Module>,
    circles: Vec<Vec<Module>>,
}

impl<'a> Search<'a> {
    fn of(uses: &'a BTreeMap<Module, BTreeSet<Module>>) -> Self {
        let (number, lowest) = (BTreeMap::new(), BTreeMap::new());
        Self { uses, number, lowest, open: Vec::new(), circles: Vec::new() }
    }

    fn visit(&mut self, module: &'a Module) {
        if self.number.contains_key(module) {
            return;
        }
        let number = self.number.len();
        self.number.insert(module, number);
        self.lowest.insert(module, number);
        self.open.push(module);
        for other in &self.uses[module] {
            let seen = self.number.get(other).copied();
            let reached = match seen {
                None => {
                    self.visit(other);
                    self.lowest[other]
                }
                Some(seen) if self.open.contains(&other) => seen,
                Some(_) => continue,
            };
            let lowest = self.lowest[module].min(reached);
            self.lowest.insert(module, lowest);
        }
        if self.lowest[module] == number {
            let first = self.open.iter().position(|open| *open == module).unwrap();
            let part = self.open.split_off(first);
            if part.len() > 1 {
                self.circles.push(part.into_iter().cloned().collect());
            }
        }
    }
}
