//! A check in words and tables.

use crate::study::check::{Held, Judgement, Planner, Rules, Verdict};

/// What a verdict is called.
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

/// The head of the table of [`rows`].
pub const HEAD: [&str; 6] =
    ["planner", "measure", "change", "95 % interval, at any time", "verdict", "trials"];

/// A line of cells for each measure of each planner, or one for a planner of which there is no more
/// to say.
pub fn rows(held: &Held) -> Vec<[String; 6]> {
    let mut rows = Vec::new();
    for planner in &held.planners {
        let trials = planner.trials.to_string();
        if planner.judgements.is_empty() {
            let cells = [&planner.name, "", "", "", word(planner.verdict), &trials];
            rows.push(cells.map(String::from));
        }
        for judgement in &planner.judgements {
            let [low, high] = judgement.sequence.interval;
            let interval = format!("{} to {}", percent(judgement, low), percent(judgement, high));
            let change = percent(judgement, judgement.sequence.mean);
            let verdict = word(judgement.verdict);
            let title = judgement.judged.title;
            let cells = [&planner.name, title, &change, &interval, verdict, &trials];
            rows.push(cells.map(String::from));
        }
    }
    rows
}

fn percent(judgement: &Judgement, difference: f64) -> String {
    let percent = judgement.judged.percent(difference);
    if percent.is_finite() { format!("{percent:+.1} %") } else { "–".into() }
}

/// What else there is to say, a sentence each.
pub fn remarks(held: &Held, rules: &Rules, most: u32) -> Vec<String> {
    let mut remarks = Vec::new();
    if !held.same_settings {
        remarks.push("settings, or the object's file, are not those of the baseline".into());
    }
    for planner in &held.planners {
        remarks.extend(failed(planner));
        remarks.extend(wanted(planner, rules, most));
    }
    remarks
}

fn failed(planner: &Planner) -> Option<String> {
    let (count, reason) = planner.failed.as_ref()?;
    Some(format!(
        "{}: {count} trials failed that did not in the baseline; the first: {reason}",
        planner.name
    ))
}

fn wanted(planner: &Planner, rules: &Rules, most: u32) -> Option<String> {
    let first = planner.judgements.first()?;
    let percent = 100.0 * rules.tolerance;
    let wanted = first.wanted.map_or("more than 100000".into(), |count| count.to_string());
    let is_open = first.verdict == Verdict::Undecided;
    let then =
        if is_open { format!("; {most} were allowed (--max-trials)") } else { String::new() };
    Some(format!(
        "{}: a loss of {percent} % of {} takes {wanted} trials to tell{then}",
        planner.name, first.judged.title
    ))
}

/// The whole as Markdown.
pub fn markdown(name: &str, held: &Held, rules: &Rules, most: u32) -> String {
    let mut text = format!("### {name}: {}\n\n", word(held.verdict()));
    text += &format!("| {} |\n|---|---|---|---|---|---|\n", HEAD.join(" | "));
    for row in rows(held) {
        text += &format!("| {} |\n", row.join(" | "));
    }
    for remark in remarks(held, rules, most) {
        text += &format!("\n* {remark}");
    }
    text + "\n"
}
