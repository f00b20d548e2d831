//! Tests that shipped and written files are TOML 1.0, which other programs read: the parser of this
//! program also accepts later versions.

use crate::common::program::{folder, succeeds};
use std::fs;
use std::path::{Path, PathBuf};

/// Files below `folder` with the extension `toml`.
fn toml_files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries
        .flat_map(|path| match path.is_dir() && !path.is_symlink() {
            true => toml_files(&path),
            false => vec![path],
        })
        .filter(|path| path.extension().is_some_and(|is| is == "toml"))
        .collect()
}

/// Returns the line of the first part that TOML 1.0 lacks: a line break or a comma at the end in an
/// inline table, and the escapes `\e` and `\x`.
fn later_than_1_0(text: &str) -> Option<usize> {
    let marks: Vec<char> = text.chars().collect();
    let line = |at: usize| Some(1 + marks[..at].iter().filter(|mark| **mark == '\n').count());
    let (mut open, mut at, mut last) = (Vec::new(), 0, ' ');
    while at < marks.len() {
        let mark = marks[at];
        match mark {
            '#' => {
                while marks.get(at + 1).is_some_and(|next| *next != '\n') {
                    at += 1
                }
            }
            '"' | '\'' => {
                let is_long = marks[at..].starts_with(&[mark; 3]);
                let end = vec![mark; if is_long { 3 } else { 1 }];
                at += end.len();
                while at < marks.len() && !marks[at..].starts_with(&end) {
                    if mark == '"' && marks[at] == '\\' {
                        at += 1;
                        if matches!(marks.get(at), Some('e' | 'x')) {
                            return line(at);
                        }
                    }
                    at += 1;
                }
                at += end.len() - 1;
            }
            '[' | '{' => open.push(mark),
            '}' if last == ',' => return line(at),
            ']' | '}' => drop(open.pop()),
            '\n' if open.last() == Some(&'{') => return line(at),
            _ => {}
        }
        if !mark.is_whitespace() {
            last = mark;
        }
        at += 1;
    }
    None
}

#[test]
fn later_parts_are_found() {
    for (text, found) in [
        ("a = { b = 1 }\nc = [\n  { d = 2 },\n]\n", None),
        ("a = \"{\"  # {\nb = '''\n{'''\n", None),
        ("a = 1\nb = { c = 1,\n d = 2 }\n", Some(2)),
        ("a = [\n { b = [1,\n 2] } ]\n", None),
        ("a = { b = 1, }\n", Some(1)),
        ("a = \"\\e\"\n", Some(1)),
    ] {
        assert_eq!(later_than_1_0(text), found, "{text}");
    }
}

#[test]
fn shipped_files_are_toml_1_0() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let files: Vec<PathBuf> = ["models", "scenes", "experiments"]
        .iter()
        .flat_map(|it| toml_files(&root.join(it)))
        .collect();
    assert!(files.len() > 50, "{}", files.len());
    for file in files {
        let found = later_than_1_0(&fs::read_to_string(&file).unwrap());
        assert_eq!(found, None, "{}", file.display());
    }
}

#[test]
fn written_files_are_toml_1_0() {
    let folder = folder();
    succeeds(folder.path(), &["new", "mesh.obj", "--out", "new"]);
    succeeds(folder.path(), &["run", "small.toml", "--out", "run", "--no-report"]);
    let files = toml_files(folder.path());
    assert!(files.iter().any(|file| file.ends_with("run/resolved.toml")), "{files:?}");
    for file in files {
        let found = later_than_1_0(&fs::read_to_string(&file).unwrap());
        assert_eq!(found, None, "{}", file.display());
    }
}
