//! Tests of layers: a module imports only from lower layers of its package, and neither files nor
//! modules have circular imports. The compiler checks both between packages.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Layers of a package's modules, lowest first; modules of one layer do not import each other.
/// Unnamed modules form one layer above the named ones.
const LAYERS: [(&str, &[&[&str]]); 8] = [
    ("palpate_input", &[&["files", "format"], &["error"]]),
    ("palpate_gp", &[&["math"]]),
    ("palpate_geometry", &[]),
    (
        "palpate_explore",
        &[
            &["robot", "band"],
            &["task", "backend", "contact", "control", "gp_settings"],
            &["view"],
            &["evidence"],
            &["surface_evidence", "recognition", "probe"],
            &["free_space", "surface_belief", "registration"],
            &["whole_object"],
            &["belief"],
            &["planner"],
            &["episode"],
        ],
    ),
    ("palpate_ros", &[]),
    ("palpate_sim", &[]),
    (
        "palpate_experiment",
        &[
            &["metrics", "planner_names", "backend_settings"],
            &["row", "stop"],
            &["measure"],
            &["report_settings"],
            &["experiment"],
            &["statistics", "trial", "real_robot", "sweep"],
            &["notice"],
            &["simulation"],
            &["store"],
            &["recording", "analysis"],
            &["runner"],
        ],
    ),
    ("palpate", &[&["study"], &["report"], &["live"], &["cli"]]),
];

/// Path of a module: its package, then the modules below.
type Module = Vec<String>;

/// Folder of a package's sources.
fn folder(package: &str) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    match package {
        "palpate" => root.join("src"),
        _ => root.join("crates").join(package.replace('_', "-")).join("src"),
    }
}

fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(sources(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    files.sort();
    files
}

/// Sources without comments and unit tests.
struct Tree {
    texts: BTreeMap<Module, String>,
    /// Origin of re-exported names.
    passed_on: BTreeMap<Module, Module>,
}

impl Tree {
    fn read() -> Self {
        let mut texts = BTreeMap::new();
        for (package, _) in LAYERS {
            let root = folder(package);
            for path in sources(&root) {
                let below = path.strip_prefix(&root).unwrap().with_extension("");
                let mut module: Module = vec![package.to_owned()];
                module.extend(below.iter().map(|part| part.to_str().unwrap().to_owned()));
                match module.last().map(String::as_str) {
                    Some("main") => continue,
                    Some("mod" | "lib") => drop(module.pop()),
                    _ => {}
                }
                let text = fs::read_to_string(&path).unwrap();
                let text = text.split("#[cfg(test)]\nmod tests").next().unwrap();
                let code = |line: &str| line.split("//").next().unwrap().to_owned() + "\n";
                texts.insert(module, text.lines().map(code).collect());
            }
        }
        let mut tree = Self { texts, passed_on: BTreeMap::new() };
        for module in tree.texts.keys().cloned().collect::<Vec<_>>() {
            for (is_passed_on, path) in tree.imports(&module) {
                if is_passed_on {
                    let mut name = module.clone();
                    name.extend(path.last().cloned());
                    tree.passed_on.insert(name, path);
                }
            }
        }
        tree
    }

    /// Returns the paths of workspace packages that a module names, and whether it re-exports each.
    fn imports(&self, module: &Module) -> Vec<(bool, Module)> {
        let mut found = Vec::new();
        let mut rest = String::new();
        for statement in self.texts[module].split_inclusive(';') {
            let line = statement.rsplit('\n').find(|line| line.contains("use "));
            let start = statement.find("use ").filter(|_| line.is_some_and(is_import));
            let Some(start) = start.filter(|_| statement.ends_with(';')) else {
                rest += statement;
                continue;
            };
            let (before, tree) = statement.split_at(start);
            let is_passed_on = before.trim_end().lines().last().is_some_and(|l| l.contains("pub"));
            let flat = tree[4..tree.len() - 1].split_whitespace().collect::<Vec<_>>().join(" ");
            for path in expanded(&flat) {
                found.extend(self.absolute(module, &path).map(|path| (is_passed_on, path)));
            }
        }
        let is_path = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
        for path in rest.split(|c| !is_path(c)).filter(|path| path.contains("::")) {
            found.extend(self.absolute(module, path).map(|path| (false, path)));
        }
        found
    }

    fn absolute(&self, module: &Module, path: &str) -> Option<Module> {
        let path = path.split(" as ").next().unwrap();
        let parts: Vec<&str> = path.split("::").filter(|part| !part.is_empty()).collect();
        let mut from = match parts.first() {
            Some(&"crate") => module[..1].to_vec(),
            Some(package) if LAYERS.iter().any(|(known, _)| known == package) => Module::new(),
            Some(&"super") => module.clone(),
            Some(&"self") => module.clone(),
            Some(first) => {
                let mut child = module.clone();
                child.push((*first).to_owned());
                return self.texts.contains_key(&child).then(|| {
                    child.extend(parts[1..].iter().map(|&part| part.to_owned()));
                    child
                });
            }
            None => return None,
        };
        for part in parts {
            match part {
                "crate" | "self" => {}
                "super" => drop(from.pop()),
                name => from.push(name.to_owned()),
            }
        }
        Some(from)
    }

    /// Returns the file that defines the item at `path`.
    fn file(&self, path: &Module) -> Module {
        let mut path = path.clone();
        for _ in 0..8 {
            let passed = (1..=path.len()).rev().find_map(|end| {
                let head = path[..end].to_vec();
                let is_file = self.texts.contains_key(&head);
                let to = self.passed_on.get(&head).filter(|_| !is_file)?;
                Some(to.iter().chain(&path[end..]).cloned().collect())
            });
            match passed {
                Some(next) => path = next,
                None => break,
            }
        }
        let known = (0..=path.len()).rev().map(|end| path[..end].to_vec());
        known.into_iter().find(|head| self.texts.contains_key(head)).unwrap()
    }

    /// Returns the files that each file imports; re-exports do not count.
    fn edges(&self) -> Edges {
        let to = |module: &Module| {
            let used = self.imports(module).into_iter().filter(|(is_passed_on, _)| !is_passed_on);
            let files = used.map(|(_, path)| self.file(&path));
            files.filter(|file| file != module && !file.is_empty()).collect()
        };
        self.texts.keys().map(|module| (module.clone(), to(module))).collect()
    }

    /// Returns the modules of its package that each module imports or re-exports; a module has all
    /// files of its folder. The root of a package, which only lists its modules, does not count.
    fn module_edges(&self) -> Edges {
        let mut edges = Edges::new();
        for file in self.texts.keys().filter(|file| file.len() > 1) {
            let to = edges.entry(file[..2].to_vec()).or_default();
            let paths = self.imports(file).into_iter().map(|(_, path)| self.file(&path));
            let is_other = |to: &Module| to.len() > 1 && to[0] == file[0] && to[1] != file[1];
            to.extend(paths.filter(is_other).map(|to| to[..2].to_vec()));
        }
        edges
    }
}

/// Files or modules with those that each of them imports.
type Edges = BTreeMap<Module, BTreeSet<Module>>;

fn is_import(line: &str) -> bool {
    let words: Vec<&str> = line.split_whitespace().collect();
    match words.first() {
        // A path in `palpate::`; otherwise it is prose in a text of several lines.
        Some(&"use") => line.contains("::") || line.trim_end().ends_with(';'),
        Some(first) => first.starts_with("pub") && words.get(1) == Some(&"use"),
        None => false,
    }
}

/// Expands an import with braces to all paths.
fn expanded(tree: &str) -> Vec<String> {
    let Some(open) = tree.find('{') else { return vec![tree.trim().to_owned()] };
    let (head, body) = (tree[..open].trim(), &tree[open + 1..tree.rfind('}').unwrap()]);
    let (mut parts, mut depth) = (vec![String::new()], 0);
    for c in body.chars() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(String::new());
                continue;
            }
            _ => {}
        }
        parts.last_mut().unwrap().push(c);
    }
    let parts = parts.iter().filter(|part| !part.trim().is_empty());
    parts.flat_map(|part| expanded(part)).map(|part| format!("{head}{part}")).collect()
}

/// Layer of a module in its package.
fn layer(module: &Module) -> usize {
    let (_, layers) = LAYERS.iter().find(|(package, _)| *package == module[0]).unwrap();
    let holds = |names: &&&[&str]| module.get(1).is_some_and(|name| names.contains(&name.as_str()));
    layers.iter().position(|names| holds(&names)).unwrap_or(layers.len())
}

#[test]
fn imports_point_down() {
    let tree = Tree::read();
    let mut seen = 0;
    for (module, imports) in tree.edges() {
        for import in imports.iter().filter(|import| import[0] == module[0] && import.len() > 1) {
            let is_same = module.get(1) == import.get(1);
            let are_above = layer(&module) == layer(import) && layer(import) == unnamed(&module[0]);
            let is_allowed = is_same || are_above || layer(import) < layer(&module);
            assert!(is_allowed, "{} imports {}", module.join("/"), import.join("/"));
            seen += 1;
        }
    }
    assert!(seen > 400, "the test found only {seen} imports");
}

/// Layer of all modules of a package that [`LAYERS`] does not name.
fn unnamed(package: &str) -> usize {
    LAYERS.iter().find(|(known, _)| *known == package).unwrap().1.len()
}

/// Returns a circle of imports, if there is one.
fn circle(mut edges: Edges) -> Option<String> {
    // A file without imports is in no circle; such files are removed until none is left.
    loop {
        let ends: Vec<Module> =
            edges.iter().filter(|(_, to)| to.is_empty()).map(|(from, _)| from.clone()).collect();
        if ends.is_empty() {
            break;
        }
        for end in &ends {
            edges.remove(end);
        }
        edges.values_mut().for_each(|to| to.retain(|file| !ends.contains(file)));
    }
    let mut walk = vec![edges.keys().next()?.clone()];
    loop {
        let next = edges[walk.last()?].iter().next()?.clone();
        if let Some(from) = walk.iter().position(|module| *module == next) {
            let circle: Vec<String> = walk[from..].iter().map(|module| module.join("/")).collect();
            return Some(circle.join(" -> "));
        }
        walk.push(next);
    }
}

#[test]
fn no_files_import_each_other_in_a_circle() {
    let edges = Tree::read().edges();
    assert!(edges.len() > 150);
    assert_eq!(circle(edges), None);
}

#[test]
fn no_modules_import_each_other_in_a_circle() {
    let edges = Tree::read().module_edges();
    assert!(edges.len() > 100 && edges.values().map(BTreeSet::len).sum::<usize>() > 200);
    assert_eq!(circle(edges), None);
}

/// Tests that a circle of three is found, and that a diamond is none.
#[test]
fn circles_are_found() {
    let edges = |of: &[(&str, &[&str])]| -> Edges {
        let module = |name: &&str| vec![(*name).to_owned()];
        of.iter().map(|(from, to)| (module(from), to.iter().map(module).collect())).collect()
    };
    let (low, d): (&[&str], (&str, &[&str])) = (&["d"], ("d", &[]));
    assert_eq!(circle(edges(&[("a", &["b", "c"]), ("b", low), ("c", low), d])), None);
    let found = circle(edges(&[("a", &["b", "d"]), ("b", &["c"]), ("c", &["a"]), d]));
    assert_eq!(found.as_deref(), Some("a -> b -> c"));
}

/// Modules of palpate-explore that planners import.
const PLANNERS_IMPORT: [&str; 7] =
    ["planner", "belief", "surface_belief", "whole_object", "recognition", "task", "view"];

/// Planners see beliefs and the looks that a camera offers. They cannot access the object,
/// so they cannot use the ground truth.
#[test]
fn planners_see_the_belief_and_nothing_else() {
    let tree = Tree::read();
    let mut seen = 0;
    for (module, imports) in tree.edges() {
        let module_path = module.join("/");
        if !module_path.starts_with("palpate_explore/planner") {
            continue;
        }
        let beliefs = PLANNERS_IMPORT;
        let beliefs = beliefs.map(|module| format!("palpate_explore/{module}"));
        let below = ["palpate_gp", "palpate_input"].map(String::from);
        let allowed = beliefs.iter().chain(&below);
        for import in imports {
            let path = import.join("/");
            let is_allowed = allowed.clone().any(|room| path.starts_with(room.as_str()));
            assert!(is_allowed, "{module_path} imports {path}");
            seen += 1;
        }
    }
    assert!(seen > 20, "the test found only {seen} imports");
    let rule = format!("planners import {}, `palpate-gp`", PLANNERS_IMPORT.join(", "));
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("ARCHITECTURE.md");
    assert!(fs::read_to_string(page).unwrap().contains(&rule), "ARCHITECTURE.md: no \"{rule}\"");
}

/// A report is generated from a run's folder and builds no scene.
#[test]
fn reports_know_nothing_of_the_simulator() {
    let mut seen = 0;
    for (module, imports) in Tree::read().edges() {
        if module.join("/").starts_with("palpate/report") {
            for import in imports {
                let path = import.join("/");
                let is_body = path.starts_with("palpate_explore/backend");
                assert!(
                    !is_body
                        && !path.starts_with("palpate/sim")
                        && !path.starts_with("palpate_sim"),
                    "{module:?} imports {path}"
                );
                seen += 1;
            }
        }
    }
    assert!(seen > 100, "the test found only {seen} imports");
}

/// A path in settings is an `InputPath`: only this type is made absolute, and hashed for a run.
#[test]
fn paths_in_settings_have_their_type() {
    let mut seen = 0;
    for path in LAYERS.iter().flat_map(|(package, _)| sources(&folder(package))) {
        let text = fs::read_to_string(&path).unwrap();
        for settings in text.split("#[derive(").skip(1).filter(|part| {
            part.split(")]").next().is_some_and(|derived| derived.contains("JsonSchema"))
        }) {
            let fields = settings.split("\n}").next().unwrap();
            assert!(!fields.contains("PathBuf"), "{}: {fields}", path.display());
            seen += 1;
        }
    }
    assert!(seen > 50, "the test found only {seen} types");
}

#[test]
fn a_file_is_one_idea() {
    for path in LAYERS.iter().flat_map(|(package, _)| sources(&folder(package))) {
        let text = fs::read_to_string(&path).unwrap();
        let lines = text.lines().count();
        assert!(lines <= 600, "{} has {lines} lines", path.display());
        for (i, line) in text.lines().enumerate() {
            let is_comment = line.trim_start().starts_with("//");
            let length = line.chars().count();
            let is_short = !is_comment || length <= 100;
            assert!(is_short, "{}:{}: {length} columns", path.display(), i + 1);
        }
    }
}

/// Every folder of the program has a layer, and every module of the explorer.
#[test]
fn modules_have_layers() {
    for package in ["palpate", "palpate_explore"] {
        for entry in fs::read_dir(folder(package)).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
            let is_layer = layer(&vec![package.to_owned(), name]) < unnamed(package);
            let is_root = path.ends_with("lib.rs") || package == "palpate" && !path.is_dir();
            assert!(is_layer || is_root, "{}", path.display());
        }
    }
}

/// No package below the program depends on it, so the explorer cannot access the ground truth.
#[test]
fn no_package_below_depends_on_the_program() {
    let is_below =
        |package: &&str| !["palpate", "palpate_experiment", "palpate_sim"].contains(package);
    for package in LAYERS.iter().map(|(package, _)| *package).filter(is_below) {
        let manifest = fs::read_to_string(folder(package).join("../Cargo.toml")).unwrap();
        for line in manifest.lines() {
            let names = ["palpate", "palpate-experiment", "palpate-sim"];
            let is_program = |name: &&str| line.split([' ', '.']).next() == Some(name);
            let is_above = names.iter().any(is_program);
            assert!(!is_above && !line.contains("mujoco"), "{package}: {line}");
        }
    }
}

/// Tests the parser of imports on all required forms.
#[test]
fn imports_are_read_whole() {
    assert_eq!(expanded("a::{b, c::{d, e as f}}"), ["a::b", "a::c::d", "a::c::e as f"]);
    let edges = Tree::read().edges();
    let path = |text: &str| -> Module { text.split('/').map(str::to_owned).collect() };
    // Through a re-exported name, and in the middle of an expression.
    assert!(
        edges[&path("palpate_explore/belief/height_field")]
            .contains(&path("palpate_explore/task/zone"))
    );
    assert!(edges[&path("palpate_experiment/trial")].contains(&path("palpate_explore/belief")));
}
