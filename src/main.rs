//! The `palpate` program.

use std::process::ExitCode;

fn main() -> ExitCode {
    #[cfg(feature = "ros1")]
    palpate_ros::spare_certificates();
    palpate::cli::main(env!("PALPATE_COMMIT"))
}
