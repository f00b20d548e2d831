//! The `palpate` program.

use std::process::ExitCode;

fn main() -> ExitCode {
    #[cfg(feature = "ros1")]
    palpate_ros::disable_tls_certificates();
    // Set by `make`; a commit alone compiles nothing else again.
    palpate::cli::main(option_env!("PALPATE_COMMIT").unwrap_or("unknown"))
}
