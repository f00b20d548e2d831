//! The `palpate` program.

use std::process::ExitCode;

fn main() -> ExitCode {
    palpate::cli::main()
}
