//! Tests that the installed program runs from any folder with MuJoCo's library beside it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use tempfile::TempDir;

/// Command without cargo's library search path.
fn command(program: &Path) -> Command {
    let mut command = Command::new(program);
    command.env_remove("LD_LIBRARY_PATH");
    command
}

/// Path at which the loader finds libmujoco for `program`.
fn library(program: &Path) -> Option<PathBuf> {
    let output = command(program).env("LD_TRACE_LOADED_OBJECTS", "1").output().unwrap();
    let found = String::from_utf8(output.stdout).unwrap();
    let line = found.lines().find(|line| line.trim().starts_with("libmujoco"))?;
    let path = line.split_once("=> ")?.1.split_once(" (")?.0;
    Some(fs::canonicalize(path).unwrap())
}

#[test]
fn a_copy_takes_the_library_beside_it_and_runs() {
    let program = Path::new(env!("CARGO_BIN_EXE_palpate"));
    let original = library(program).expect("the program is linked to MuJoCo");
    for (program_at, library_at) in [("palpate", ""), ("bin/palpate", "lib")] {
        // On the program's disk, because the program is large.
        let folder = TempDir::new_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
        let copy = folder.path().join(program_at);
        let beside = folder.path().join(library_at);
        fs::create_dir_all(copy.parent().unwrap()).unwrap();
        fs::create_dir_all(&beside).unwrap();
        fs::hard_link(program, &copy).unwrap();
        let beside = beside.join(original.file_name().unwrap());
        fs::copy(&original, &beside).unwrap();
        assert_eq!(library(&copy), Some(fs::canonicalize(beside).unwrap()), "{program_at}");

        fs::write(folder.path().join("mesh.obj"), "v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\n").unwrap();
        let shown =
            command(&copy).args(["show", "mesh.obj"]).current_dir(&folder).output().unwrap();
        assert!(shown.status.success(), "{}", String::from_utf8_lossy(&shown.stderr));
    }
}
