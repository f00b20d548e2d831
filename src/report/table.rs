//! Table with its writers: text for a terminal, CSV, HTML, JSON and Markdown.
//!
//! Terminal, page and Markdown have rounded numbers in the column's unit; files have every digit,
//! in SI units.

use crate::experiment::measure::{Direction, Measure};
use crate::experiment::statistics::equal_error::IntervalEstimate;
use crate::experiment::store::write_whole;
use crate::report::canvas::escape;
use crate::report::glossary::tooltip;
use anyhow::Context;
use serde_json::{Map, Value};
use std::path::Path;

/// Table of columns, and rows with a cell for each column.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// Columns, from the left.
    pub columns: Vec<Column>,
    /// Rows, from the top.
    pub rows: Vec<Vec<Cell>>,
}

/// Column: its heads, and the format of its numbers.
#[derive(Clone, Debug, Default)]
pub struct Column {
    name: String,
    title: Option<String>,
    note: &'static str,
    symbol: &'static str,
    /// Number of display units in one SI unit, and decimals; default: three significant digits in
    /// the SI unit.
    scale: Option<(f64, usize)>,
    has_interval: bool,
}

/// Cell of a table; empty by default.
#[derive(Clone, Debug, Default)]
pub struct Cell {
    /// Text, a count, or a number in SI units, as in files.
    value: Value,
    /// Standard error of a mean.
    error: Option<f64>,
    interval: Option<[f64; 2]>,
    /// Verdict: "better" or "worse".
    verdict: Option<&'static str>,
}

impl Column {
    /// Creates a column of text, counts, or numbers with three significant digits; `name` is its
    /// head on a terminal and in files.
    pub fn new(name: impl Into<String>) -> Self {
        Self { name: name.into(), ..Self::default() }
    }

    /// Sets a longer head for the page and for Markdown.
    pub fn title(self, title: impl Into<String>) -> Self {
        Self { title: Some(title.into()), ..self }
    }

    /// Sets a sentence for the reference that describes the column.
    pub fn note(self, note: &'static str) -> Self {
        Self { note, ..self }
    }

    /// Sets the display unit, of which `per_si` make one SI unit, and the decimals.
    pub fn unit(self, symbol: &'static str, per_si: f64, decimals: usize) -> Self {
        Self { symbol, scale: Some((per_si, decimals)), ..self }
    }

    /// Adds the ends of an interval in files, as `NAME_low` and `NAME_high`.
    pub fn interval(self) -> Self {
        Self { has_interval: true, ..self }
    }

    fn format_measure(&self, value: f64) -> String {
        match self.scale {
            Some((per_si, decimals)) if value.is_finite() => {
                format!("{:.decimals$}", per_si * value)
            }
            _ => digits(value),
        }
    }

    /// Returns the head with its unit: the title if there is room, the name on a terminal.
    fn head(&self, has_room: bool) -> String {
        let (head, before) = match (&self.title, has_room) {
            (Some(title), true) => (title, ", "),
            (None, true) => (&self.name, ", "),
            (_, false) => (&self.name, " "),
        };
        if self.symbol.is_empty() { head.clone() } else { format!("{head}{before}{}", self.symbol) }
    }
}

impl Cell {
    /// Creates a cell with an estimate and its interval.
    pub fn estimate(estimate: impl Into<Option<IntervalEstimate>>) -> Self {
        let estimate = estimate.into();
        let interval = estimate.and_then(|estimate| estimate.interval);
        Self { interval, ..Self::from(estimate.map(|estimate| estimate.value)) }
    }

    /// Creates a cell with a mean and its standard error.
    pub fn mean(mean: f64, error: Option<f64>) -> Self {
        Self { error, ..Self::from(mean) }
    }

    /// Sets the verdict that the interval of an estimate establishes; `direction` is better, and
    /// both are equal at `even`.
    pub fn with_verdict(self, interval: Option<[f64; 2]>, even: f64, direction: Direction) -> Self {
        Self { verdict: verdict(interval, even, direction), ..self }
    }

    fn words(&self, column: &Column) -> String {
        let shown = |value| column.format_measure(value);
        match (&self.value, self.error) {
            (Value::Null, _) => "-".into(),
            (Value::String(words), _) => words.clone(),
            (Value::Number(number), error) if number.is_f64() => {
                let value = number.as_f64().unwrap_or(f64::NAN);
                let error = error.map_or(String::new(), |error| format!(" ± {}", shown(error)));
                with_interval(value, self.interval, &shown) + &error
            }
            (count, _) => count.to_string(),
        }
    }
}

impl<T: Into<Value>> From<T> for Cell {
    fn from(value: T) -> Self {
        Self { value: value.into(), ..Self::default() }
    }
}

impl Table {
    /// Creates a table without rows.
    pub fn new(columns: impl IntoIterator<Item = Column>) -> Self {
        Self { columns: columns.into_iter().collect(), rows: Vec::new() }
    }

    /// Creates a table with a cell for every row and column, after a column of the rows' names;
    /// empty rows and columns are left out.
    pub fn cross<R, C>(
        corner: impl Into<String>,
        rows: impl IntoIterator<Item = (String, R)>,
        columns: Vec<(Column, C)>,
        cell: impl Fn(&R, &C) -> Option<Cell>,
    ) -> Self {
        let (heads, keys): (Vec<Column>, Vec<C>) = columns.into_iter().unzip();
        let mut table = Self::new([Column::new(corner)].into_iter().chain(heads));
        for (name, row) in rows {
            let cells: Vec<Option<Cell>> = keys.iter().map(|column| cell(&row, column)).collect();
            if cells.iter().any(Option::is_some) {
                let cells = cells.into_iter().map(Option::unwrap_or_default);
                table.rows.push([name.into()].into_iter().chain(cells).collect());
            }
        }
        table.without_empty()
    }

    /// Returns the table without the columns that have no value in any row.
    pub fn without_empty(mut self) -> Self {
        for column in (0..self.columns.len()).rev() {
            if self.rows.iter().all(|row| row[column].value.is_null()) {
                self.columns.remove(column);
                self.rows.iter_mut().for_each(|row| drop(row.remove(column)));
            }
        }
        self
    }

    /// Returns the texts of the cells, each with its verdict.
    fn words(&self) -> impl Iterator<Item = Vec<(String, Option<&'static str>)>> {
        let words = |(cell, column): (&Cell, &Column)| (cell.words(column), cell.verdict);
        self.rows.iter().map(move |row| row.iter().zip(&self.columns).map(words).collect())
    }

    fn heads(&self, has_room: bool) -> Vec<String> {
        self.columns.iter().map(|column| column.head(has_room)).collect()
    }

    /// Formats aligned columns for a terminal, each verdict after its value; empty without rows.
    pub fn text(&self) -> String {
        if self.rows.is_empty() {
            return String::new();
        }
        let judged = |(words, verdict): (String, Option<&str>)| match verdict {
            Some(verdict) => format!("{words} {verdict}"),
            None => words,
        };
        let lines = self.words().map(|row| row.into_iter().map(judged).collect());
        aligned(&[self.heads(false)].into_iter().chain(lines).collect::<Vec<_>>())
    }

    /// Returns the columns in files, each with its note.
    pub fn file_columns(&self) -> Vec<(String, &'static str)> {
        let columns = |Column { name, note, has_interval, .. }: &Column| {
            let low = (format!("{name}_low"), "Lower end of its 95 % bootstrap interval.");
            let high = (format!("{name}_high"), "Upper end.");
            let ends = has_interval.then_some([low, high]);
            [(name.clone(), *note)].into_iter().chain(ends.into_iter().flatten())
        };
        self.columns.iter().flat_map(columns).collect()
    }

    fn file_rows(&self) -> impl Iterator<Item = Vec<Value>> {
        let values = |(cell, column): (&Cell, &Column)| {
            let ends = cell.interval.map_or([Value::Null, Value::Null], |it| it.map(Value::from));
            let ends = column.has_interval.then_some(ends);
            [cell.value.clone()].into_iter().chain(ends.into_iter().flatten())
        };
        self.rows.iter().map(move |row| row.iter().zip(&self.columns).flat_map(values).collect())
    }

    /// Writes the table as CSV.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write_csv(&self, path: &Path) -> anyhow::Result<()> {
        let place = || path.display().to_string();
        let mut writer = csv::WriterBuilder::new().has_headers(false).from_writer(Vec::new());
        let columns = self.file_columns().into_iter().map(|(name, _)| name);
        writer.write_record(columns).with_context(place)?;
        for row in self.file_rows() {
            writer.serialize(row).with_context(place)?;
        }
        Ok(write_whole(path, writer.into_inner().with_context(place)?)?)
    }

    /// Returns the rows as JSON, with the column names used in files.
    pub fn json(&self) -> Vec<Map<String, Value>> {
        let columns = self.file_columns();
        let names = || columns.iter().map(|(name, _)| name.clone());
        self.file_rows().map(|row| names().zip(row).collect()).collect()
    }

    /// Formats the table as HTML in a scrollable box; `class` is its CSS class.
    pub fn html(&self, class: &str) -> String {
        let title = |explanation: Option<&str>| {
            explanation.map_or(String::new(), |it| format!(" title=\"{}\"", escape(it)))
        };
        let head = |(head, column): (&String, &Column)| {
            let own = (!column.note.is_empty()).then_some(column.note);
            format!("<th{}>{}</th>", title(own.or_else(|| tooltip(head))), escape(head))
        };
        let heads: String = self.heads(true).iter().zip(&self.columns).map(head).collect();
        let cell = |(i, (words, verdict)): (usize, (String, Option<&str>))| {
            let title = if i == 0 { title(tooltip(&words)) } else { String::new() };
            let words = escape(&words);
            match verdict {
                // A row that continues the one above has no head.
                _ if i == 0 && !words.is_empty() => {
                    format!("<th scope=\"row\"{title}>{words}</th>")
                }
                Some(word) => format!("<td class=\"{word}\">{words}: {word}</td>"),
                None => format!("<td>{words}</td>"),
            }
        };
        let row = |row: Vec<(String, Option<&str>)>| {
            let cells: String = row.into_iter().enumerate().map(cell).collect();
            format!("<tr>{cells}</tr>\n")
        };
        let rows: String = self.words().map(row).collect();
        let table = format!(
            "<table class=\"{class}\">\n<thead><tr>{heads}</tr></thead>\n<tbody>\n{rows}</tbody>\n</table>"
        );
        wide(&table, "table")
    }

    /// Formats the table as Markdown.
    pub fn markdown(&self) -> String {
        let line = |cells: Vec<String>| {
            let cells = cells.iter().map(|words| words.replace('|', "\\|").replace('\n', " "));
            format!("| {} |\n", cells.collect::<Vec<_>>().join(" | "))
        };
        let words = self.words().map(|row| row.into_iter().map(|(words, _)| words).collect());
        let rule = "|---".repeat(self.columns.len());
        line(self.heads(true)) + &rule + "|\n" + &words.map(line).collect::<String>()
    }
}

/// Returns the verdict of an interval that excludes `even`, the value of equality; `direction` is
/// better.
pub fn verdict(
    interval: Option<[f64; 2]>,
    even: f64,
    direction: Direction,
) -> Option<&'static str> {
    let [low, high] = interval?;
    let [is_less, is_more] = [high < even, low > even];
    match direction {
        Direction::Undirected => None,
        Direction::Minimise if is_less => Some("better"),
        Direction::Maximise if is_more => Some("better"),
        _ => (is_less || is_more).then_some("worse"),
    }
}

/// Formats cells in aligned columns, the first to the left, the others to the right; every line has
/// as many cells as the first.
pub fn aligned(lines: &[impl AsRef<[String]>]) -> String {
    let columns = lines.first().map_or(0, |line| line.as_ref().len());
    let width = |column| {
        let cells = lines.iter().filter_map(|line| line.as_ref().get(column));
        cells.map(|cell: &String| cell.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut text = String::new();
    for line in lines {
        let mut row = String::new();
        for (column, (cell, width)) in line.as_ref().iter().zip(&widths).enumerate() {
            row += &match column {
                0 => format!("{cell:<width$}"),
                _ => format!("  {cell:>width$}"),
            };
        }
        text += row.trim_end();
        text.push('\n');
    }
    text
}

/// Returns a box that scrolls if the page is narrower than its content, also by keyboard.
pub(super) fn wide(content: &str, what: &str) -> String {
    format!(
        "<div class=\"wide\" role=\"group\" aria-label=\"{what}\" tabindex=\"0\">{content}</div>\n"
    )
}

/// Formats a number with three significant digits.
pub fn digits(value: f64) -> String {
    if !value.is_finite() {
        return "–".into();
    }
    // Rounding of six decimals, as below.
    if value.abs() < 5e-7 {
        return "0".into();
    }
    let power = value.abs().max(1e-9).log10().floor();
    let decimals = (2.0 - power).clamp(0.0, 6.0) as usize;
    format!("{value:.decimals$}")
}

/// Formats a value of a measure in its display unit.
pub fn shown(measure: &Measure, value: f64) -> String {
    format!("{:.*}", measure.unit.decimals, measure.unit.per_si * value)
}

/// Formats a number and its interval, if it has one.
pub fn with_interval(
    value: f64,
    interval: Option<[f64; 2]>,
    shown: &dyn Fn(f64) -> String,
) -> String {
    let interval =
        interval.map_or(String::new(), |[low, high]| format!(" [{}, {}]", shown(low), shown(high)));
    format!("{}{interval}", shown(value))
}

/// Returns the title of a measure with its display unit.
pub fn title_with_unit(measure: &Measure) -> String {
    match measure.unit.symbol {
        "" => measure.title.into(),
        unit => format!("{}, {unit}", measure.title),
    }
}
