//! The page of a run: one file that needs nothing beside it.

use super::canvas::escape;
use super::figures::Drawing;
use super::findings;
use super::tables::{Table, claims, comparison, equal_error, summary};
use crate::experiment::analysis::Analysis;
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
    let name = escape(&run.experiment.name);
    let question = match run.experiment.question.trim() {
        "" => String::new(),
        question => format!("<p class=\"question\">{}</p>\n", escape(question)),
    };
    let figures: String = drawings.iter().map(|drawing| figure(run, drawing)).collect();
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{name} – Palpate</title>\n<style>{STYLE}</style>\n</head>\n<body>\n\
         <p class=\"kind\">Palpate run</p>\n<h1>{name}</h1>\n{question}\
         <section>\n<h2>Found</h2>\n{}</section>\n{}{}{}{}{explorer}{figures}{}{}</body>\n</html>\n",
        paragraph(&findings::sentences(run)),
        claims_table(run),
        summary_table(run),
        comparison_tables(run, analysis),
        events(run),
        details("Every setting, defaults written out", settings)
            + &details("What ran it", manifest),
        raw_files(drawings),
    )
}

fn paragraph(sentences: &[String]) -> String {
    format!("<p>{}</p>\n", escape(&sentences.join(" ")))
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

/// A table whose words stand in its first column (`named`), its second (`counted`) or its first
/// four (`told`).
fn table_body(table: &Table, class: &str) -> String {
    let cells = |kind: &str, cells: &[String]| -> String {
        cells.iter().map(|cell| format!("<{kind}>{}</{kind}>", escape(cell))).collect()
    };
    let lines: String =
        table.lines.iter().map(|line| format!("<tr>{}</tr>\n", cells("td", line))).collect();
    format!(
        "<div class=\"wide\"><table class=\"{class}\">\n<thead><tr>{}</tr></thead>\n\
         <tbody>\n{lines}</tbody>\n</table></div>\n",
        cells("th", &table.header)
    )
}

fn section(title: &str, body: &str, note: &str) -> String {
    format!("<section>\n{title}{body}<p class=\"note\">{}</p>\n</section>\n", escape(note))
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
    format!(
        "<figure id=\"{name}\">\n{}<figcaption>{} <span class=\"files\">\
         <a href=\"figures/{name}.svg\">SVG</a> <a href=\"figures/{name}.png\">PNG</a></span>\
         </figcaption>\n</figure>\n",
        drawing.svg,
        escape(&(drawing.figure.caption)(run)),
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
        items += "<li><a href=\"figures/\">figures</a>: each figure as SVG and PNG</li>\n";
    }
    format!("<section>\n<h2>Files beside this page</h2>\n<ul>\n{items}</ul>\n</section>\n")
}

const STYLE: &str = "
:root { color-scheme: light; }
* { box-sizing: border-box; }
body { max-width: 1120px; margin: 0 auto; padding: 2.2rem 1.4rem 4rem; color: #222;
  background: #fff; font: 16px/1.55 system-ui, 'Segoe UI', Helvetica, Arial, sans-serif; }
.kind { margin: 0; color: #666; font-size: .85rem; letter-spacing: .06em;
  text-transform: uppercase; }
h1 { margin: .1rem 0 .4rem; font-size: 2rem; line-height: 1.2; overflow-wrap: anywhere; }
h2 { margin: 2.2rem 0 .5rem; font-size: 1.15rem; }
p, li { max-width: 78ch; }
p { margin: .4rem 0; }
.question { color: #444; font-size: 1.15rem; }
.note, figcaption { color: #555; font-size: .9rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; margin: 1.4rem 0 .4rem; font-size: .92rem;
  font-variant-numeric: tabular-nums; white-space: nowrap; }
th { font-weight: 600; border-bottom: 1.5px solid #222; }
th, td { padding: .28rem .9rem; text-align: right; }
.counted :is(th, td):nth-child(2), .named :is(th, td):first-child,
  .told :is(th, td):nth-child(-n+4) { text-align: left; }
.told td:nth-child(2) { white-space: normal; min-width: 16rem; }
tbody tr + tr td { border-top: 1px solid #eee; }
figure { margin: 2.6rem 0 0; }
figure > svg { display: block; width: 100%; height: auto; }
figcaption { max-width: 92ch; margin-top: .5rem; }
.files a { margin-left: .3rem; }
a { color: #0b5394; }
summary { cursor: pointer; }
pre { overflow-x: auto; padding: .9rem 1rem; background: #f6f6f4; font-size: .85rem;
  line-height: 1.4; }
";
