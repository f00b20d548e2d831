//! Report of a check: tables and sentences, Markdown, JUnit XML for continuous integration, and a
//! drawing.

use super::canvas::{Anchor, Area, Canvas, escape};
use super::style::{self, FAINT_INK, GRID, INK, SMALL_PX, TEXT_PX};
use super::table::{Cell, Column, Table};
use crate::study::check::{CheckOptions, CheckResult, MeasureResult, PlannerResult, Verdict};
use palpate_input::format::counted;

/// Returns the name of a verdict.
pub fn word(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Identical => "identical",
        Verdict::Better => "better",
        Verdict::Ok => "ok",
        Verdict::Undecided => "undecided",
        Verdict::Worse => "WORSE",
        Verdict::Missing => "MISSING",
    }
}

/// Returns a table with a row for each measure of each planner, or one row for a planner without
/// measures.
pub fn table(held: &CheckResult) -> Table {
    let heads = ["planner", "measure", "change", "95 % interval, any time", "verdict", "trials"];
    let mut table = Table::new(heads.map(Column::new));
    table.rows =
        (held.planners.iter().flat_map(rows)).map(|cells| cells.map(Cell::from).into()).collect();
    table
}

fn rows(planner: &PlannerResult) -> Vec<[String; 6]> {
    let trials = planner.trials.to_string();
    let row = |(title, change, verdict): (&str, Option<[f64; 3]>, Verdict)| {
        let [change, interval] = change.map_or_else(Default::default, |values| {
            let [change, low, high] = values.map(percent);
            [change, format!("{low} to {high}")]
        });
        [&planner.name, title, &change, &interval, word(verdict), &trials].map(String::from)
    };
    planner.lines().into_iter().map(row).collect()
}

fn percent(value: f64) -> String {
    if value.is_finite() { format!("{value:+.1} %") } else { "–".into() }
}

/// Returns remarks on a check, a sentence each.
pub fn remarks(held: &CheckResult, rules: &CheckOptions, most: u32) -> Vec<String> {
    let settings = "settings or the object's file differ from the baseline";
    let mut remarks: Vec<String> =
        (!held.same_settings).then(|| settings.into()).into_iter().collect();
    remarks.extend(held.unreachable_share.map(|share| {
        let percent = 100.0 * share;
        format!("{percent:.0} % of the surface is out of the finger's reach and left out")
    }));
    for planner in &held.planners {
        let name = &planner.name;
        remarks.extend(planner.remark.as_ref().map(|remark| format!("{name}: {remark}")));
        let is_missing = |first: &&MeasureResult| first.verdict == Verdict::Missing;
        let unexplained = planner.judgements.first().filter(|_| planner.remark.is_none());
        remarks.extend(unexplained.filter(is_missing).map(|first| {
            let title = first.judged.title;
            format!(
                "{name}: the baseline or these trials have no {title}; an earlier version left it out: \
                 write the baseline again with --accept REASON"
            )
        }));
        let is_open = |first: &&MeasureResult| first.verdict == Verdict::Undecided;
        remarks.extend(planner.judgements.first().filter(is_open).map(|first| {
            let percent = 100.0 * rules.tolerance;
            let wanted =
                first.trials_needed.map_or("more than 100000".into(), |count| count.to_string());
            let title = first.judged.title;
            format!(
                "{name}: detecting a loss of {percent} % in {title} needs {wanted} trials; the limit \
                 was {most} (--max-trials)"
            )
        }));
    }
    remarks
}

/// Returns a line for each thing that does not pass, the worst first: tests show one line only.
pub fn failures(held: &CheckResult) -> Vec<String> {
    let mut planners: Vec<&PlannerResult> =
        held.planners.iter().filter(|planner| problem(planner).is_some()).collect();
    planners.sort_by_key(|planner| std::cmp::Reverse(planner.verdict));
    planners.into_iter().flat_map(planner_failures).collect()
}

fn planner_failures(planner: &PlannerResult) -> Vec<String> {
    let PlannerResult { name, verdict, trials, .. } = planner;
    let spoken = |verdict| word(verdict).to_lowercase();
    let remark = planner.remark.as_ref().filter(|_| *verdict == Verdict::Missing);
    let mut lines: Vec<_> =
        remark.iter().map(|remark| format!("{}: {name}: {remark}", spoken(*verdict))).collect();
    let mut measures = planner.lines();
    measures.retain(|line| line.2 >= Verdict::Undecided);
    measures.sort_by_key(|line| std::cmp::Reverse(line.2));
    lines.extend(measures.into_iter().filter_map(|(title, change, verdict)| {
        let verdict = spoken(verdict);
        let trials = counted(*trials, "trial");
        match change {
            Some([change, low, high]) => Some(format!(
                "{verdict}: {name}: {title} {change:+.1} % (95 % interval {low:+.1} to {high:+.1} %), {trials}"
            )),
            None if remark.is_some() => None,
            None => Some(format!("{verdict}: {name}: {title}, {trials}")),
        }
    }));
    lines
}

/// Formats the whole check as Markdown.
pub fn markdown(name: &str, held: &CheckResult, rules: &CheckOptions, most: u32) -> String {
    let mut text =
        format!("### palpate check {name}: {}\n\n{}", word(held.verdict()), table(held).markdown());
    remarks(held, rules, most).iter().for_each(|remark| text += &format!("\n* {remark}"));
    text + "\n"
}

/// Returns the report in the format of JUnit, which CI systems read: a test case for each planner.
pub fn junit(name: &str, held: &CheckResult, rules: &CheckOptions, most: u32) -> String {
    let count = |tag| held.planners.iter().filter(|it| problem(it) == Some(tag)).count();
    let (tests, failures, errors) = (held.planners.len(), count("failure"), count("error"));
    let counts = format!("tests=\"{tests}\" failures=\"{failures}\" errors=\"{errors}\"");
    let name = escape(name);
    let output = |text: String| format!("<system-out>{}</system-out>", escape(&text));
    let case = |planner: &PlannerResult| {
        let reason = planner_failures(planner).into_iter().next().unwrap_or_default();
        let problem = problem(planner)
            .map_or(String::new(), |tag| format!("<{tag} message=\"{}\"/>", escape(&reason)));
        let lines: Vec<String> = rows(planner).iter().map(|row| row[1..].join("  ")).collect();
        format!(
            "    <testcase name=\"{}\" classname=\"palpate.{name}\">{problem}{}</testcase>\n",
            escape(&planner.name),
            output(lines.join("\n"))
        )
    };
    let cases: String = held.planners.iter().map(case).collect();
    let remarks = output(remarks(held, rules, most).join("\n"));
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"palpate check\" {counts}>\n  \
         <testsuite name=\"{name}\" {counts}>\n{cases}    {remarks}\n  </testsuite>\n</testsuites>\n"
    )
}

/// Returns the tag of a planner that does not pass.
fn problem(planner: &PlannerResult) -> Option<&'static str> {
    match planner.verdict {
        Verdict::Identical | Verdict::Better | Verdict::Ok => None,
        Verdict::Worse | Verdict::Missing => Some("failure"),
        Verdict::Undecided => Some("error"),
    }
}

const LEFT_PX: f64 = 300.0;
const WIDTH_PX: f64 = 360.0;
const RIGHT_PX: f64 = 90.0;
const TOP_PX: f64 = 46.0;
const LINE_PX: f64 = 22.0;

/// Range of the axis, in tolerances on each side; values beyond are clipped.
const REACH: f64 = 4.0;

/// Draws each measure's change with its interval, and the tolerance.
pub fn draw(name: &str, held: &CheckResult, rules: &CheckOptions) -> String {
    let lines: usize = held.planners.iter().map(|planner| planner.judgements.len().max(1)).sum();
    let bottom = TOP_PX + lines as f64 * LINE_PX + 6.0;
    let mut canvas = Canvas::new(LEFT_PX + WIDTH_PX + RIGHT_PX, bottom + 34.0);
    let at = |share: f64| LEFT_PX + WIDTH_PX * (0.5 + 0.5 * (share / REACH).clamp(-1.0, 1.0));
    let title = format!("{name}: {}", word(held.verdict()));
    canvas.text([LEFT_PX + 0.5 * WIDTH_PX, 20.0], &title, TEXT_PX, Anchor::Middle);
    let [left, top, right] = [at(-1.0), TOP_PX - 10.0, at(1.0)];
    let tolerated = Area { left, top, width: right - left, height: bottom - top };
    canvas.rect(tolerated, &style::fill(GRID, 0.6));
    canvas.line([[at(0.0), top], [at(0.0), bottom]], &style::stroke(FAINT_INK, 1.0));
    let lines = held.planners.iter().flat_map(|planner| {
        let bare = planner.judgements.is_empty().then_some((planner, None));
        let judged = planner.judgements.iter().map(move |judgement| (planner, Some(judgement)));
        bare.into_iter().chain(judged)
    });
    for (i, (planner, judgement)) in lines.enumerate() {
        let y = TOP_PX + 4.0 + i as f64 * LINE_PX;
        let mut text = |x: f64, words: &str, anchor, ink| {
            canvas.coloured_text([x, y + 4.0], words, SMALL_PX, anchor, ink);
        };
        let Some(judgement) = judgement else {
            text(LEFT_PX - 10.0, &planner.name, Anchor::End, INK);
            let trials = counted(planner.trials, "trial");
            let words = format!("{}, {trials}", word(planner.verdict));
            text(at(0.0) + 8.0, &words, Anchor::Start, INK);
            continue;
        };
        let words = format!("{}, {}", planner.name, judgement.judged.title);
        text(LEFT_PX - 10.0, &words, Anchor::End, INK);
        let ink = if judgement.verdict >= Verdict::Undecided { INK } else { FAINT_INK };
        text(LEFT_PX + WIDTH_PX + 8.0, word(judgement.verdict), Anchor::Start, ink);
        let (colour, sequence) = (style::planner(&[], &planner.name), &judgement.sequence);
        let at = |error: f64| [at(error / judgement.judged.allowed(rules.tolerance)), y];
        canvas.line(sequence.interval.map(at), &style::stroke(colour, 2.0));
        canvas.circle(at(sequence.mean), 4.0, &style::fill(colour, 1.0));
    }
    let percent = 100.0 * rules.tolerance;
    let ticks = [format!("−{percent} %"), "baseline".into(), format!("+{percent} %")];
    for (share, words) in [-1.0, 0.0, 1.0].into_iter().zip(ticks) {
        canvas.text([at(share), bottom + 14.0], &words, SMALL_PX, Anchor::Middle);
    }
    canvas.text([at(0.0), bottom + 29.0], "less is better", SMALL_PX, Anchor::Middle);
    canvas.finish()
}
