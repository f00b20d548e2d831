//! Lets every built binary find MuJoCo's shared library without environment variables, and tells
//! it which commit it was built from.

use std::env;
use std::path::Path;
use std::process::Command;

/// Changes with every commit and checkout.
const HEAD_LOG: &str = ".git/logs/HEAD";

fn main() {
    println!("cargo::rerun-if-env-changed=MUJOCO_DYNAMIC_LINK_DIR");
    println!("cargo::rerun-if-changed=build.rs");
    if Path::new(HEAD_LOG).exists() {
        println!("cargo::rerun-if-changed={HEAD_LOG}");
    }
    println!("cargo::rustc-env=PALPATE_COMMIT={}", commit().unwrap_or("unknown".into()));
    if env::var_os("CARGO_FEATURE_MUJOCO").is_none() {
        return;
    }
    // An installed program has the library beside it, or in the lib beside its bin.
    for beside in ["", "/../lib"] {
        println!("cargo::rustc-link-arg-bin=palpate=-Wl,-rpath,$ORIGIN{beside}");
    }
    // Relative first, so that a folder that was moved whole still runs: binaries lie in
    // target/PROFILE, tests and examples one level deeper. The absolute one is where `cargo install`
    // leaves the library.
    for up in ["../..", "../../.."] {
        println!("cargo::rustc-link-arg=-Wl,-rpath,$ORIGIN/{up}/.deps/lib");
    }
    if let Ok(dir) = env::var("MUJOCO_DYNAMIC_LINK_DIR") {
        println!("cargo::rustc-link-arg=-Wl,-rpath,{dir}");
    }
}

fn commit() -> Option<String> {
    let output = Command::new("git").args(["rev-parse", "--short=12", "HEAD"]).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().into())
}
