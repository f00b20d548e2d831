//! Page of a run: one self-contained HTML file.

use super::canvas::escape;
use super::figures::ReportFigure;
use super::files::FORMATS;
use super::findings;
use super::glossary::explained;
use super::html::{self, fold, list, section, tables};
use super::table::digits;
use super::tables::{comparison, summary};
use crate::experiment::analysis::Analysis;
use crate::experiment::store::Run;
use palpate_input::format::counted;

/// Files of a run folder that the page links to.
const RAW: &[(&str, &str)] = &[
    ("trials.jsonl", "a row per trial, with every touch"),
    ("summary.csv", "the curves as a table"),
    ("comparison.csv", "paired comparison of planners, every measure"),
    ("equal_error.csv", "touches to equal error"),
    ("surface.csv", "the true surface on the test grid"),
    ("resolved.toml", "all settings; this file can be run again"),
    ("manifest.json", "versions of the software, and the machine"),
];

/// Largest number of failures listed one by one; the others are only counted.
const FAILURES_LISTED: usize = 10;

/// Returns the page as HTML: final errors, verdict, error curves and interactive view, then
/// everything else folded. `explorer` is the interactive view; `settings` and `manifest` are the
/// texts of the files of that name, if they exist.
pub fn html(
    run: &Run,
    analysis: &Analysis,
    drawings: &[(&ReportFigure, String)],
    explorer: &str,
    [settings, manifest]: [Option<&str>; 2],
) -> String {
    let equal = comparison::equal_errors(run, &analysis.equal_errors);
    let against = comparison::comparisons(run, &analysis.comparisons);
    let figures = |is_here: &dyn Fn(&str) -> bool| -> String {
        let drawings = drawings.iter().filter(|(it, _)| is_here(it.name));
        drawings.map(|(it, svg)| figure(run, it, svg)).collect()
    };
    let claims = tables("", &[summary::claims(run)], "claims", summary::CLAIMS_NOTE);
    let summary = tables("", &[summary::table(run)], "counted", &summary::note(run));
    let equal = tables("", &equal, "named", &comparison::equal_errors_note(run));
    let against = tables("", &against, "named", &comparison::comparisons_note(run));
    let parts = [
        list(" class=\"notices\"", &findings::notices(run)),
        headline(run),
        verdict(run, analysis),
        figures(&|name| OPEN.contains(&name)),
        explorer.into(),
        fold("Results next to the paper", &claims),
        fold("Other measures", &(figures(&|name| name == OTHERS) + &summary)),
        fold("Touches to equal error", &equal),
        fold("Paired comparison of planners", &against),
        fold("Misses, aborted touches and failures", &events(run)),
        fold("Beliefs and targets", &figures(&|name| name != OTHERS && !OPEN.contains(&name))),
        fold("All settings, including defaults", &preformatted(settings)),
        fold("Software and machine", &preformatted(manifest)),
        fold("Files in this folder", &raw_files(drawings)),
        if FORMATS.contains(&"png") { String::new() } else { format!("<script>{SAVE}</script>\n") },
    ];
    html::page("Palpate run", &run.experiment.name, &run.experiment.question, &parts.concat())
}

/// Saves a figure as PNG.
const SAVE: &str = include_str!("save.js");

/// Names of the figures that stay open: errors against touches, and hypotheses.
const OPEN: [&str; 2] = ["convergence", "hypotheses"];

/// Name of the figure of the measures that do not decide.
const OTHERS: &str = "measures";

/// Returns the final value, in large type, of the measure that decides between the planners.
fn headline(run: &Run) -> String {
    let Some((measure, values)) = findings::final_values(run) else { return String::new() };
    // A share is shown in per cent.
    let (symbol, factor) = match measure.unit.symbol {
        "" => ("%", 100.0),
        symbol => (symbol, 1.0),
    };
    let value = |(planner, value, interval): &(&str, f64, Option<[f64; 2]>)| {
        let interval = interval.map_or(String::new(), |[low, high]| {
            format!(" <span>[{}, {}]</span>", digits(factor * low), digits(factor * high))
        });
        let (planner, value) = (escape(planner), digits(factor * value));
        format!("<div><dt>{planner}</dt> <dd><b>{value} {symbol}</b>{interval}</dd></div>\n")
    };
    let (statistic, band) = match measure.aggregate.has_median() {
        true => ("Median", "95 % interval"),
        false => ("Mean", "± one standard error"),
    };
    let name = measure.title.chars().take(1).flat_map(char::to_uppercase);
    let name: String = name.chain(measure.title.chars().skip(1)).collect();
    let title = format!("{name} after {}", counted(run.experiment.touches, "touch"));
    let band = match values.iter().any(|(.., interval)| interval.is_some()) {
        true => format!("; [{band}]"),
        false => String::new(),
    };
    let note = format!("{statistic} of {}{band}.", summary::finished(run));
    format!(
        "<section class=\"headline\">\n<h2>{}</h2>\n<dl>\n{}</dl>\n<p class=\"note\">{}</p>\n\
         </section>\n",
        explained(&title),
        values.iter().map(value).collect::<String>(),
        explained(&note),
    )
}

/// Returns the verdict: its first sentence alone, then the others, then the numbers folded.
fn verdict(run: &Run, analysis: &Analysis) -> String {
    let numbers = findings::sentences(run);
    let verdicts = findings::verdicts(run, analysis);
    // Without a comparison the first of the numbers is the result.
    let (first, others, numbers) = match (&verdicts[..], &numbers[..]) {
        ([first, others @ ..], numbers) => (first.as_str(), others, numbers),
        ([], [first, numbers @ ..]) => (first.as_str(), &[][..], numbers),
        ([], []) => return String::new(),
    };
    let paragraphs = |sentences: &[String]| -> String {
        sentences.iter().map(|it| format!("<p>{}</p>\n", explained(it))).collect()
    };
    let verdict = format!("<p class=\"verdict\">{}</p>\n", explained(first));
    let numbers = fold("Findings in numbers", &paragraphs(numbers));
    section("", &[verdict, paragraphs(others), numbers].concat())
}

fn events(run: &Run) -> String {
    let mut items = summary::event_lines(run);
    // The marks of a Python traceback need a font of fixed width.
    let is_marked = |line: &&str| line.trim().chars().all(|c| "^~".contains(c));
    let failures = run.rows.iter().filter_map(|row| {
        let reason: Vec<&str> =
            row.failure.as_ref()?.lines().filter(|line| !is_marked(line)).collect();
        Some(format!("{}, trial {}: {}", row.planner, row.trial, reason.join("\n")))
    });
    items.extend(failures.take(FAILURES_LISTED));
    list("", &items)
}

fn figure(run: &Run, figure: &ReportFigure, svg: &str) -> String {
    let name = figure.name;
    let link = |format: &&str| {
        format!("<a href=\"figures/{name}.{format}\">{}</a>", format.to_uppercase())
    };
    let mut links: Vec<String> = FORMATS.iter().map(link).collect();
    if !FORMATS.contains(&"png") {
        links.push(format!("<button type=\"button\" data-png=\"{name}\">PNG</button>"));
    }
    let caption = explained(&(figure.caption)(run));
    let caption = format!("{caption} <span class=\"files\">{}</span>", links.join(" "));
    html::figure(name, svg, caption)
}

fn preformatted(text: Option<&str>) -> String {
    text.map_or(String::new(), |text| format!("<pre tabindex=\"0\">{}</pre>\n", escape(text)))
}

fn raw_files(drawings: &[(&ReportFigure, String)]) -> String {
    let mut items: String = RAW
        .iter()
        .map(|(file, what)| format!("<li><a href=\"{file}\">{file}</a>: {what}</li>\n"))
        .collect();
    if !drawings.is_empty() {
        items +=
            "<li><a href=\"figures/\">figures</a>: each figure; print this page for a PDF</li>\n";
    }
    format!("<ul>\n{items}</ul>\n")
}
