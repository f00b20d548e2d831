//! Tests that need a program that may be missing.

use std::io::{self, Write};

/// Notes on stderr that tests of `file` are skipped; fails if `PALPATE_REQUIRE` is 1.
#[track_caller]
pub fn skip(file: &str, reason: &str) {
    let is_required = std::env::var_os("PALPATE_REQUIRE").is_some_and(|value| value == "1");
    assert!(!is_required, "{reason}");
    // A macro's output would be captured by the test harness.
    let _ = writeln!(io::stderr(), "{file}: SKIPPED, {reason}");
}
