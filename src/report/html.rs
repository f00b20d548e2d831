//! HTML building blocks of the pages; each page is one self-contained file.

use super::canvas::{PartKind, escape};
use super::glossary::explained;
use super::style::{FONT, ON_DARK};
use super::table::{Table, wide};
use std::fmt::Display;

/// Returns a page of a kind, titled `name`; `question` may be empty.
pub(super) fn page(kind: &str, name: &str, question: &str, body: &str) -> String {
    page_with(kind, name, question, body, "")
}

/// Returns a page of a kind, titled `name`, with further elements of its head; `question` may be
/// empty.
pub fn page_with(kind: &str, name: &str, question: &str, body: &str, head: &str) -> String {
    let name = escape(name);
    let question = match question.trim() {
        "" => String::new(),
        question => format!("<p class=\"question\">{}</p>\n", escape(question)),
    };
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{name} – Palpate</title>\n<style>{STYLE}{}</style>\n{head}</head>\n<body>\n<main>\n\
         <p class=\"kind\">{kind}</p>\n<h1>{name}</h1>\n{question}{body}</main>\n</body>\n</html>\n",
        figures_on_dark(),
    )
}

/// Returns a section with a title, unless that is empty; empty without a body.
pub(super) fn section(title: &str, body: &str) -> String {
    let title = if title.is_empty() { String::new() } else { format!("<h2>{title}</h2>\n") };
    if body.is_empty() { String::new() } else { format!("<section>\n{title}{body}</section>\n") }
}

/// Returns a section with the tables that are not empty, and a note below them.
pub(super) fn tables(title: &str, tables: &[Table], class: &str, note: &str) -> String {
    let tables = tables.iter().filter(|table| !table.rows.is_empty());
    match tables.map(|table| table.html(class)).collect::<String>() {
        body if body.is_empty() => body,
        body => section(title, &format!("{body}{}", paragraph(note))),
    }
}

/// Returns a note with tooltips; empty without words.
fn paragraph(note: &str) -> String {
    match note {
        "" => String::new(),
        note => format!("<p class=\"note\">{}</p>\n", explained(note)),
    }
}

/// Returns a part of a page that opens on a click on `summary`; empty without a body.
pub(super) fn fold(summary: &str, body: &str) -> String {
    match body {
        "" => String::new(),
        body => format!("<details>\n<summary>{summary}</summary>\n{body}</details>\n"),
    }
}

/// Returns a drawing with its caption; one of panels is cut into its parts, which a narrow page
/// shows below each other.
pub(super) fn figure(id: &str, svg: &str, caption: impl Display) -> String {
    let svg = parts(svg).unwrap_or_else(|| wide(svg, "figure"));
    format!("<figure id=\"{id}\">\n{svg}<figcaption>{caption}</figcaption>\n</figure>\n")
}

/// Returns the marked parts of a drawing, each as a drawing of its own, in a block for neighbours
/// of one kind; `None` without panels.
fn parts(svg: &str) -> Option<String> {
    let [key, panel] = [PartKind::Key, PartKind::Panel].map(PartKind::word);
    let mark = |text: &str| {
        let kind = [key, panel].into_iter().find(|kind| text.starts_with(*kind))?;
        let (area, body) = text[kind.len()..].split_once(" -->\n")?;
        Some((kind, area.trim().to_owned(), body.to_owned()))
    };
    let svg = svg.trim_end().strip_suffix("</svg>")?;
    let marked: Vec<_> = svg.split("<!-- ").filter_map(mark).collect();
    if !marked.iter().any(|(kind, ..)| *kind == panel) {
        return None;
    }
    let part = |(_, area, body): &(&str, String, String)| {
        let size: Vec<&str> = area.split(' ').skip(2).collect();
        let size = format!("width=\"{}\" height=\"{}\"", size.first()?, size.get(1)?);
        Some(format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" {size} viewBox=\"{area}\" \
             font-family=\"{FONT}\">\n{body}</svg>\n"
        ))
    };
    let block = |parts: &[(&str, String, String)]| {
        let drawn: String = parts.iter().filter_map(part).collect();
        // As many panels are side by side as in the drawing.
        let ends = parts.iter().filter_map(|(_, area, _)| {
            let numbers: Vec<f64> = area.split(' ').filter_map(|it| it.parse().ok()).collect();
            Some([*numbers.first()?, numbers.first()? + numbers.get(2)?])
        });
        let [left, right] = ends.fold([f64::INFINITY, 0.0], |[left, right], end| {
            [f64::min(left, end[0]), f64::max(right, end[1])]
        });
        let (kind, most) = (parts[0].0, (right - left).ceil());
        format!("<div class=\"parts {kind}\" style=\"max-width:{most}px\">\n{drawn}</div>\n")
    };
    Some(marked.chunk_by(|a, b| a.0 == b.0).map(block).collect())
}

/// Returns a list of sentences; empty without any.
pub(super) fn list(class: &str, items: &[String]) -> String {
    let items: String = items.iter().map(|it| format!("<li>{}</li>\n", escape(it))).collect();
    if items.is_empty() { items } else { format!("<ul{class}>\n{items}</ul>\n") }
}

/// Returns the style that replaces the colours of drawings on a dark page. Touches on a relief keep
/// theirs, because the relief does.
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
