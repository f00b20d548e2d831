//! Build script: lets every built binary find MuJoCo's shared library without environment
//! variables.

use std::env;

fn main() {
    println!("cargo::rerun-if-env-changed=MUJOCO_DYNAMIC_LINK_DIR");
    println!("cargo::rerun-if-changed=build.rs");
    if env::var_os("CARGO_FEATURE_MUJOCO").is_none() {
        return;
    }
    // An installed program has the library beside it, or in the lib beside its bin.
    let has_program = env::var_os("CARGO_PKG_NAME").is_some_and(|name| name == "palpate");
    for beside in ["", "/../lib"].iter().filter(|_| has_program) {
        println!("cargo::rustc-link-arg-bin=palpate=-Wl,-rpath,$ORIGIN{beside}");
    }
    // Relative first, so that a folder that was moved whole still runs: binaries lie in
    // target/PROFILE, tests and examples one level deeper. The absolute one is where `cargo
    // install` leaves the library.
    for up in ["../..", "../../.."] {
        println!("cargo::rustc-link-arg=-Wl,-rpath,$ORIGIN/{up}/.deps/lib");
    }
    if let Ok(dir) = env::var("MUJOCO_DYNAMIC_LINK_DIR") {
        println!("cargo::rustc-link-arg=-Wl,-rpath,{dir}");
    }
}
