//! What pages are made of: one file that needs nothing beside it.

use super::canvas::escape;
use super::style::ON_DARK;
use super::tables::{Cell, Table, Verdict};

/// A page of this kind about something called `name`; `question` may be empty.
pub(super) fn page(kind: &str, name: &str, question: &str, body: &str) -> String {
    let name = escape(name);
    let question = match question.trim() {
        "" => String::new(),
        question => format!("<p class=\"question\">{}</p>\n", escape(question)),
    };
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{name} – Palpate</title>\n<style>{STYLE}{}</style>\n</head>\n<body>\n\
         <p class=\"kind\">{kind}</p>\n<h1>{name}</h1>\n{question}{body}</body>\n</html>\n",
        figures_on_dark(),
    )
}

/// A table whose words stand in its first column (`named`), its second (`counted`) or its first
/// four (`told`).
pub(super) fn table_body(table: &Table, class: &str) -> String {
    let head: String =
        table.header.iter().map(|words| format!("<th>{}</th>", escape(words))).collect();
    let lines: String = (table.lines.iter())
        .map(|line| line.iter().enumerate().map(|(i, it)| cell(i, it)).collect::<String>())
        .map(|cells| format!("<tr>{cells}</tr>\n"))
        .collect();
    wide(
        &format!(
            "<table class=\"{class}\">\n<thead><tr>{head}</tr></thead>\n\
             <tbody>\n{lines}</tbody>\n</table>"
        ),
        "table",
    )
}

/// A cell; the first one is the head of its line.
fn cell(index: usize, Cell { words, verdict }: &Cell) -> String {
    let words = escape(words);
    match verdict.map(Verdict::word) {
        _ if index == 0 => format!("<th scope=\"row\">{words}</th>"),
        Some(verdict) => format!("<td class=\"{verdict}\">{words}: {verdict}</td>"),
        None => format!("<td>{words}</td>"),
    }
}

/// What scrolls in its own box where the page is narrower, by keyboard too.
pub(super) fn wide(content: &str, what: &str) -> String {
    format!(
        "<div class=\"wide\" role=\"region\" aria-label=\"{what}\" tabindex=\"0\">{content}</div>\n"
    )
}

/// A section of the page: its head, its body, and what is to be known of that.
pub(super) fn section(title: &str, body: &str, note: &str) -> String {
    format!("<section>\n{title}{body}<p class=\"note\">{}</p>\n</section>\n", escape(note))
}

/// Drawings keep their colours for light paper; on dark paper the page gives them others. Touches
/// on a relief stay, because the relief does.
fn figures_on_dark() -> String {
    let rules = ON_DARK.iter().flat_map(|(light, dark)| {
        ["fill", "stroke"].map(|property| {
            format!(
                "figure svg :not(.relief circle)[{property}=\"{light}\"] {{ {property}: {dark}; }}\n"
            )
        })
    });
    format!("@media (prefers-color-scheme: dark) {{\n{}}}\n", rules.collect::<String>())
}

const STYLE: &str = include_str!("page.css");
