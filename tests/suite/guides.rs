//! Tests of the guides' text; python/tests/test_commands.py runs their command lines.

use std::fs;
use std::path::Path;

/// A page that lists planners lists all of them.
#[test]
fn every_planner_is_in_the_guide() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/your-planner.md");
    let page = fs::read_to_string(page).unwrap();
    for entry in palpate::explore::planner::PLANNERS {
        assert!(page.contains(&format!("`{}`", entry.name)), "{}", entry.name);
    }
}
