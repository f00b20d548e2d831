//! A check as the XML that continuous integration reads.

use super::lines::{remarks, rows, word};
use crate::study::check::{Held, Planner, Rules, Verdict};
use quick_junit::{NonSuccessKind, Report, SerializeError, TestCase, TestCaseStatus, TestSuite};

/// A test case for each planner: worse and missing are failures, undecided is an error, for it must
/// not pass.
///
/// # Errors
/// If a name cannot stand in XML.
pub fn text(name: &str, held: &Held, rules: &Rules, most: u32) -> Result<String, SerializeError> {
    let mut report = Report::new("palpate check");
    let mut suite = TestSuite::new(name);
    for planner in &held.planners {
        let mut case = TestCase::new(planner.name.clone(), status(planner));
        case.set_classname(format!("palpate.{name}"));
        let table: Vec<String> = rows(held)
            .into_iter()
            .filter(|row| row[0] == planner.name)
            .map(|row| row[1..].join("  "))
            .collect();
        case.set_system_out(table.join("\n"));
        suite.add_test_case(case);
    }
    suite.set_system_out(remarks(held, rules, most).join("\n"));
    report.add_test_suite(suite);
    report.to_string()
}

fn status(planner: &Planner) -> TestCaseStatus {
    let kind = match planner.verdict {
        Verdict::Identical | Verdict::Better | Verdict::Ok => return TestCaseStatus::success(),
        Verdict::Worse | Verdict::Missing => NonSuccessKind::Failure,
        Verdict::Undecided => NonSuccessKind::Error,
    };
    let mut status = TestCaseStatus::non_success(kind);
    status.set_message(word(planner.verdict));
    status
}
