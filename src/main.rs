//! The `palpate` program.

mod embedded;

use palpate_input::shipped::HOME;
use std::path::Path;
use std::process::ExitCode;

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    let files = ["experiments/toy.toml", "scenes/toy.toml", "models/bird.glb"];
    let is_here = files.iter().all(|it| Path::new(it).is_file());
    if std::env::var_os(HOME).is_none()
        && !is_here
        && let Some(folder) = embedded::folder()
    {
        // SAFETY: the process has one thread.
        unsafe { std::env::set_var(HOME, folder) };
    }
    // Set by `make`; a commit alone compiles nothing else again.
    palpate::cli::main(option_env!("PALPATE_COMMIT").unwrap_or("unknown"))
}
