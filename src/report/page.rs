//! The page of a run: one file that needs nothing beside it.

use super::canvas::escape;
use super::figures::Figure;
use super::files::FORMATS;
use super::findings;
use super::html::{self, list, section, tables};
use super::tables::{comparison, summary};
use crate::experiment::statistics::analysis::Analysis;
use crate::experiment::store::Run;

/// Files of a run folder that the page points to.
const RAW: &[(&str, &str)] = &[
    ("trials.jsonl", "a row per trial with every touch"),
    ("summary.csv", "the curves as a table"),
    ("comparison.csv", "the planners against each other, every measure"),
    ("equal_error.csv", "touches to equal error"),
    ("surface.csv", "the true surface on the test grid"),
    ("resolved.toml", "every setting; can be run again"),
    ("manifest.json", "what ran it"),
];

/// Failures listed one by one; more are only counted.
const FAILURES_TOLD: usize = 10;

/// The page as HTML; `explorer` is its moving part, `settings` and `manifest` are the texts of the
/// files of that name, if they are there.
pub fn html(
    run: &Run,
    analysis: &Analysis,
    drawings: &[(&Figure, String)],
    explorer: &str,
    [settings, manifest]: [Option<&str>; 2],
) -> String {
    let equal = comparison::equal_errors(run, &analysis.equal_errors);
    let against = comparison::comparisons(run, &analysis.comparisons);
    let parts = [
        list(" class=\"notices\"", &findings::notices(run)),
        explorer.into(),
        found(run, analysis),
        tables("The paper, and here", &[summary::claims(run)], "told", summary::CLAIMS_NOTE),
        tables("", &[summary::table(run)], "counted", &summary::note(run)),
        tables("Touches to equal error", &equal, "named", &comparison::equal_errors_note(run)),
        tables("Planner against planner", &against, "named", &comparison::comparisons_note(run)),
        events(run),
        drawings.iter().map(|(it, svg)| figure(run, it, svg)).collect(),
        details("Every setting, defaults written out", settings),
        details("What ran it", manifest),
        raw_files(drawings),
    ];
    html::page("Palpate run", &run.experiment.name, &run.experiment.question, &parts.concat())
}

/// The verdict in words, then its numbers.
fn found(run: &Run, analysis: &Analysis) -> String {
    let verdict = match findings::verdicts(run, analysis).join(" ") {
        words if words.is_empty() => words,
        words => format!("<p class=\"verdict\">{}</p>\n", escape(&words)),
    };
    let numbers = findings::sentences(run);
    let numbers: String = numbers.iter().map(|it| format!("<p>{}</p>\n", escape(it))).collect();
    format!("<section>\n<h2>Found</h2>\n{verdict}{numbers}</section>\n")
}

fn events(run: &Run) -> String {
    let mut items = summary::happened(run);
    let failures = run.rows.iter().filter_map(|row| {
        Some(format!("{}, trial {}: {}", row.planner, row.trial, row.failure.as_ref()?))
    });
    items.extend(failures.take(FAILURES_TOLD));
    section("What else happened", &list("", &items))
}

fn figure(run: &Run, figure: &Figure, svg: &str) -> String {
    let name = figure.name;
    let links = FORMATS
        .map(|format| format!("<a href=\"figures/{name}.{format}\">{}</a>", format.to_uppercase()));
    let caption = escape(&(figure.caption)(run));
    let caption = format!("{caption} <span class=\"files\">{}</span>", links.join(" "));
    html::figure(name, svg, caption)
}

fn details(summary: &str, text: Option<&str>) -> String {
    text.map_or(String::new(), |text| {
        let text = escape(text);
        format!("<details>\n<summary>{summary}</summary>\n<pre>{text}</pre>\n</details>\n")
    })
}

fn raw_files(drawings: &[(&Figure, String)]) -> String {
    let mut items: String = RAW
        .iter()
        .map(|(file, what)| format!("<li><a href=\"{file}\">{file}</a>: {what}</li>\n"))
        .collect();
    if !drawings.is_empty() {
        items += "<li><a href=\"figures/\">figures</a>: each figure as SVG, PNG and PDF</li>\n";
    }
    section("Files beside this page", &format!("<ul>\n{items}</ul>\n"))
}
