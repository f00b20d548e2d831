//! The page of a run: one file that needs nothing beside it.

use super::canvas::escape;
use super::figures::Drawing;
use super::files::FORMATS;
use super::findings;
use super::html;
use super::html::{section, table_body, wide};
use super::tables::{Table, claims, comparison, equal_error, summary};
use super::verdict;
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

/// Failures told one by one; more are only counted.
const FAILURES_TOLD: usize = 10;

/// The page as HTML; `explorer` is its moving part, `settings` and `manifest` are the texts of the
/// files of that name, if they are there.
pub fn html(
    run: &Run,
    analysis: &Analysis,
    drawings: &[Drawing],
    explorer: &str,
    [settings, manifest]: [Option<&str>; 2],
) -> String {
    let parts = [
        notices(&findings::notices(run)),
        explorer.into(),
        found(run, analysis),
        claims_table(run),
        summary_table(run),
        comparison_tables(run, analysis),
        events(run),
        drawings.iter().map(|drawing| figure(run, drawing)).collect(),
        details("Every setting, defaults written out", settings),
        details("What ran it", manifest),
        raw_files(drawings),
    ];
    html::page("Palpate run", &run.experiment.name, &run.experiment.question, &parts.concat())
}

/// What a reader should know before anything else, a sentence each.
fn notices(sentences: &[String]) -> String {
    let items: String = sentences.iter().map(|it| format!("<li>{}</li>\n", escape(it))).collect();
    match items.is_empty() {
        true => items,
        false => format!("<ul class=\"notices\">\n{items}</ul>\n"),
    }
}

/// The verdict in words, then its numbers.
fn found(run: &Run, analysis: &Analysis) -> String {
    let verdict = match verdict::sentences(run, analysis).join(" ") {
        words if words.is_empty() => words,
        words => format!("<p class=\"verdict\">{}</p>\n", escape(&words)),
    };
    let numbers = findings::sentences(run);
    let numbers: String = numbers.iter().map(|it| format!("<p>{}</p>\n", escape(it))).collect();
    format!("<section>\n<h2>Found</h2>\n{verdict}{numbers}</section>\n")
}

fn claims_table(run: &Run) -> String {
    let body = claims::table(run).map(|table| table_body(&table, "told"));
    body.map_or(String::new(), |body| {
        section("<h2>The paper, and here</h2>\n", &body, claims::NOTE)
    })
}

fn summary_table(run: &Run) -> String {
    let table = summary::table(run);
    match table.lines.is_empty() {
        true => String::new(),
        false => section("", &table_body(&table, "counted"), &summary::note(run)),
    }
}

fn comparison_tables(run: &Run, analysis: &Analysis) -> String {
    let Analysis { comparisons, equal_errors } = analysis;
    let against = comparison::tables(run, comparisons);
    let against = (against, comparison::note(run), "Planner against planner");
    let equal = equal_error::tables(run, equal_errors);
    let equal = (equal, equal_error::note(run), "Touches to equal error");
    let section = |(tables, note, title): (Vec<Table>, String, &str)| {
        let bodies: String = tables.iter().map(|table| table_body(table, "named")).collect();
        match bodies.is_empty() {
            true => String::new(),
            false => section(&format!("<h2>{title}</h2>\n"), &bodies, &note),
        }
    };
    section(equal) + &section(against)
}

fn events(run: &Run) -> String {
    let mut items = summary::happened(run);
    let failures = run.rows.iter().filter_map(|row| {
        Some(format!("{}, trial {}: {}", row.planner, row.trial, row.failure.as_ref()?))
    });
    items.extend(failures.take(FAILURES_TOLD));
    if items.is_empty() {
        return String::new();
    }
    let items: String = items.iter().map(|item| format!("<li>{}</li>\n", escape(item))).collect();
    format!("<section>\n<h2>What else happened</h2>\n<ul>\n{items}</ul>\n</section>\n")
}

fn figure(run: &Run, drawing: &Drawing) -> String {
    let name = drawing.figure.name;
    let links = FORMATS
        .map(|format| format!("<a href=\"figures/{name}.{format}\">{}</a>", format.to_uppercase()));
    format!(
        "<figure id=\"{name}\">\n{}<figcaption>{} <span class=\"files\">{}</span>\
         </figcaption>\n</figure>\n",
        wide(&drawing.svg, "figure"),
        escape(&(drawing.figure.caption)(run)),
        links.join(" "),
    )
}

fn details(summary: &str, text: Option<&str>) -> String {
    text.map_or(String::new(), |text| {
        let text = escape(text);
        format!("<details>\n<summary>{summary}</summary>\n<pre>{text}</pre>\n</details>\n")
    })
}

fn raw_files(drawings: &[Drawing]) -> String {
    let mut items: String = RAW
        .iter()
        .map(|(file, what)| format!("<li><a href=\"{file}\">{file}</a>: {what}</li>\n"))
        .collect();
    if !drawings.is_empty() {
        items += "<li><a href=\"figures/\">figures</a>: each figure as SVG, PNG and PDF</li>\n";
    }
    format!("<section>\n<h2>Files beside this page</h2>\n<ul>\n{items}</ul>\n</section>\n")
}
