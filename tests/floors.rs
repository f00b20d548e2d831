//! The floor plan: a module imports only from its own floor and those below.

use std::fs;
use std::path::{Path, PathBuf};

/// Folders of `src`, lowest floor first.
const FLOORS: [&str; 7] = ["ground", "things", "world", "bodies", "conduct", "trials", "faces"];

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
    files
}

#[test]
fn imports_point_down() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut seen = 0;
    for (floor, name) in FLOORS.iter().enumerate() {
        for path in sources(&root.join(name)) {
            let text = fs::read_to_string(&path).unwrap();
            for (i, line) in text.lines().enumerate() {
                for import in line.split("crate::").skip(1) {
                    let target = import.split(|c: char| !c.is_alphanumeric()).next().unwrap();
                    let below = FLOORS.iter().position(|known| *known == target);
                    let below = below.unwrap_or_else(|| panic!("{}:{i}: {line}", path.display()));
                    assert!(below <= floor, "{}:{}: {line}", path.display(), i + 1);
                    seen += 1;
                }
            }
        }
    }
    assert!(seen > 50, "the test found only {seen} imports");
}

/// A planner that could see the world could peek at the truth.
#[test]
fn planners_see_the_belief_and_the_zone_and_nothing_else() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/conduct/planner");
    for path in sources(&folder) {
        let text = fs::read_to_string(&path).unwrap();
        for line in text.lines().filter(|line| line.contains("crate::") || line.contains("super::"))
        {
            let allowed = [
                "crate::ground::",
                "use crate::world::Zone;",
                "use super::belief::Belief;",
                "use super::{",
            ];
            assert!(
                allowed.iter().any(|import| line.contains(import)),
                "{}: {line}",
                path.display()
            );
        }
    }
}

#[test]
fn a_file_is_one_idea() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for path in sources(&root) {
        let lines = fs::read_to_string(&path).unwrap().lines().count();
        assert!(lines <= 400, "{} has {lines} lines", path.display());
    }
}

#[test]
fn every_folder_of_the_sources_is_a_floor() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for entry in fs::read_dir(root).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap();
        assert!(!path.is_dir() || FLOORS.contains(&name), "{name}");
    }
}
