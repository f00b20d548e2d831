//! A table and its writers: text for a terminal, CSV, HTML, JSON and Markdown.
//!
//! Readers are shown rounded numbers in the column's unit; files hold every digit, in SI units.

use crate::experiment::measure::Direction;
use crate::experiment::statistics::equal_error::Estimate;
use crate::experiment::store::write_whole;
use crate::report::canvas::escape;
use crate::report::html::wide;
use crate::report::number::{digits, with_interval};
use anyhow::Context;
use serde_json::{Map, Value};
use std::path::Path;

/// Columns, and rows with a cell for each of them.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// The columns, from the left.
    pub columns: Vec<Column>,
    /// The rows, from the top.
    pub rows: Vec<Vec<Cell>>,
}

/// A column: its heads, and how its numbers are shown.
#[derive(Clone, Debug, Default)]
pub struct Column {
    name: String,
    title: Option<String>,
    note: &'static str,
    symbol: &'static str,
    per_si: Option<f64>,
    decimals: Option<usize>,
    has_interval: bool,
}

/// A value in a table.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Cell {
    /// No value.
    #[default]
    Empty,
    /// Words, or a number that is shown in its own way.
    Text(String),
    /// A count.
    Count(usize),
    /// A number, in SI units.
    Number(f64),
    /// A mean with its standard error.
    Mean(f64, Option<f64>),
    /// A number with its interval.
    Interval(Estimate),
    /// A value and what it establishes: "better" or "worse".
    Verdict(Box<Cell>, &'static str),
}

impl Column {
    /// A column of words, counts, or numbers with three significant digits; `name` is its head on a
    /// terminal and in files.
    pub fn new(name: impl Into<String>) -> Self {
        Self { name: name.into(), ..Self::default() }
    }

    /// With another head where there is room: on the page and in Markdown.
    pub fn title(self, title: impl Into<String>) -> Self {
        Self { title: Some(title.into()), ..self }
    }

    /// With a sentence for the reference that says what it holds.
    pub fn note(self, note: &'static str) -> Self {
        Self { note, ..self }
    }

    /// With the unit in which its numbers are shown, of which `per_si` make one of the SI unit.
    pub fn unit(self, symbol: &'static str, per_si: f64) -> Self {
        Self { symbol, per_si: Some(per_si), ..self }
    }

    /// With as many decimals of its numbers.
    pub fn decimals(self, decimals: usize) -> Self {
        Self { decimals: Some(decimals), ..self }
    }

    /// With the ends of an interval behind it in files, as `NAME_low` and `NAME_high`.
    pub fn interval(self) -> Self {
        Self { has_interval: true, ..self }
    }

    fn shown(&self, value: f64) -> String {
        let value = value * self.per_si.unwrap_or(1.0);
        match self.decimals {
            Some(decimals) if value.is_finite() => format!("{value:.decimals$}"),
            _ => digits(value),
        }
    }

    /// The head, with `before` between it and the unit.
    fn head(&self, head: &str, before: &str) -> String {
        let before = if self.symbol.is_empty() { "" } else { before };
        format!("{head}{before}{}", self.symbol)
    }

    /// The head on a terminal.
    fn short(&self) -> String {
        self.head(&self.name, " ")
    }

    /// The head on a page.
    fn long(&self) -> String {
        self.head(self.title.as_ref().unwrap_or(&self.name), ", ")
    }

    /// Its columns in files, each with its note.
    fn in_files(&self) -> Vec<(String, &'static str)> {
        let mut columns = vec![(self.name.clone(), self.note)];
        if self.has_interval {
            columns
                .push((format!("{}_low", self.name), "Lower end of its 95 % bootstrap interval."));
            columns.push((format!("{}_high", self.name), "Upper end."));
        }
        columns
    }
}

impl Cell {
    /// With what the interval of an estimate establishes in which `direction` is better and both
    /// are as good at `even`.
    pub fn judged(self, interval: Option<[f64; 2]>, even: f64, direction: Direction) -> Self {
        match verdict(interval, even, direction) {
            Some(word) => Self::Verdict(Box::new(self), word),
            None => self,
        }
    }

    fn words(&self, column: &Column) -> String {
        match self {
            Self::Empty => "-".into(),
            Self::Text(words) => words.clone(),
            Self::Count(count) => count.to_string(),
            Self::Number(value) | Self::Mean(value, None) => column.shown(*value),
            Self::Mean(value, Some(error)) => {
                format!("{} ± {}", column.shown(*value), column.shown(*error))
            }
            Self::Interval(Estimate { value, interval }) => {
                with_interval(*value, *interval, &|value| column.shown(value))
            }
            Self::Verdict(cell, _) => cell.words(column),
        }
    }

    /// Its values in the columns that its column has in files.
    fn in_files(&self, column: &Column) -> Vec<Value> {
        let mut values = vec![match self {
            Self::Empty => Value::Null,
            Self::Text(words) => words.as_str().into(),
            Self::Count(count) => (*count).into(),
            Self::Number(value) | Self::Mean(value, _) => (*value).into(),
            Self::Interval(estimate) => estimate.value.into(),
            Self::Verdict(cell, _) => return cell.in_files(column),
        }];
        if column.has_interval {
            let ends = match self {
                Self::Interval(Estimate { interval: Some(ends), .. }) => ends.map(Value::from),
                _ => [Value::Null, Value::Null],
            };
            values.extend(ends);
        }
        values
    }
}

impl From<&str> for Cell {
    fn from(words: &str) -> Self {
        Self::Text(words.into())
    }
}

impl From<String> for Cell {
    fn from(words: String) -> Self {
        Self::Text(words)
    }
}

impl From<usize> for Cell {
    fn from(count: usize) -> Self {
        Self::Count(count)
    }
}

impl From<f64> for Cell {
    fn from(value: f64) -> Self {
        Self::Number(value)
    }
}

impl From<Estimate> for Cell {
    fn from(estimate: Estimate) -> Self {
        Self::Interval(estimate)
    }
}

impl<T: Into<Cell>> From<Option<T>> for Cell {
    fn from(value: Option<T>) -> Self {
        value.map_or(Self::Empty, T::into)
    }
}

impl Table {
    /// A table without rows.
    pub fn new(columns: impl IntoIterator<Item = Column>) -> Self {
        Self { columns: columns.into_iter().collect(), rows: Vec::new() }
    }

    /// A cell for every row and column, behind a column of the rows' names; rows and columns
    /// without any are left out.
    pub fn cross<R, C>(
        corner: impl Into<String>,
        rows: impl IntoIterator<Item = (String, R)>,
        columns: Vec<(Column, C)>,
        cell: impl Fn(&R, &C) -> Option<Cell>,
    ) -> Self {
        let mut table = Self::default();
        let (heads, keys): (Vec<Column>, Vec<C>) = columns.into_iter().unzip();
        table.columns = [Column::new(corner)].into_iter().chain(heads).collect();
        for (name, row) in rows {
            let cells: Vec<Option<Cell>> = keys.iter().map(|column| cell(&row, column)).collect();
            if cells.iter().any(Option::is_some) {
                let cells = cells.into_iter().map(Cell::from);
                table.rows.push([Cell::Text(name)].into_iter().chain(cells).collect());
            }
        }
        table.without_empty()
    }

    /// The same without the columns that have no value in any row.
    pub fn without_empty(mut self) -> Self {
        let is_empty = |column: usize| self.rows.iter().all(|row| row[column] == Cell::Empty);
        for column in
            (0..self.columns.len()).rev().filter(|&column| is_empty(column)).collect::<Vec<_>>()
        {
            self.columns.remove(column);
            self.rows.iter_mut().for_each(|row| drop(row.remove(column)));
        }
        self
    }

    /// Aligned columns for a terminal, a verdict behind its value; empty without rows.
    pub fn text(&self) -> String {
        if self.rows.is_empty() {
            return String::new();
        }
        let line = |row: &Vec<Cell>| -> Vec<String> {
            let words = |(cell, column): (&Cell, &Column)| match cell {
                Cell::Verdict(cell, word) => format!("{} {word}", cell.words(column)),
                cell => cell.words(column),
            };
            row.iter().zip(&self.columns).map(words).collect()
        };
        let head = self.columns.iter().map(Column::short).collect();
        aligned(&[head].into_iter().chain(self.rows.iter().map(line)).collect::<Vec<_>>())
    }

    /// The columns in files, each with its note.
    pub fn file_columns(&self) -> Vec<(String, &'static str)> {
        self.columns.iter().flat_map(Column::in_files).collect()
    }

    fn file_rows(&self) -> impl Iterator<Item = Vec<Value>> {
        let values = |(cell, column): (&Cell, &Column)| cell.in_files(column);
        self.rows.iter().map(move |row| row.iter().zip(&self.columns).flat_map(values).collect())
    }

    /// Writes it as CSV.
    ///
    /// # Errors
    /// If it cannot be written.
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

    /// Its rows as JSON, by the names that columns have in files.
    pub fn json(&self) -> Vec<Map<String, Value>> {
        let columns = self.file_columns();
        let names = || columns.iter().map(|(name, _)| name.clone());
        self.file_rows().map(|row| names().zip(row).collect()).collect()
    }

    /// A table of a page, in a box of its own; `class` is its class there.
    pub fn html(&self, class: &str) -> String {
        let head = |column: &Column| format!("<th>{}</th>", escape(&column.long()));
        let heads: String = self.columns.iter().map(head).collect();
        let cell = |(i, (cell, column)): (usize, (&Cell, &Column))| {
            let words = escape(&cell.words(column));
            match cell {
                _ if i == 0 => format!("<th scope=\"row\">{words}</th>"),
                Cell::Verdict(_, word) => format!("<td class=\"{word}\">{words}: {word}</td>"),
                _ => format!("<td>{words}</td>"),
            }
        };
        let row = |row: &Vec<Cell>| {
            let cells: String = row.iter().zip(&self.columns).enumerate().map(cell).collect();
            format!("<tr>{cells}</tr>\n")
        };
        let rows: String = self.rows.iter().map(row).collect();
        let table = format!(
            "<table class=\"{class}\">\n<thead><tr>{heads}</tr></thead>\n<tbody>\n{rows}</tbody>\n</table>"
        );
        wide(&table, "table")
    }

    /// A table in Markdown.
    pub fn markdown(&self) -> String {
        let line = |cells: Vec<String>| {
            let cells = cells.iter().map(|words| words.replace('|', "\\|").replace('\n', " "));
            format!("| {} |\n", cells.collect::<Vec<_>>().join(" | "))
        };
        let words = |row: &Vec<Cell>| -> Vec<String> {
            row.iter().zip(&self.columns).map(|(cell, column)| cell.words(column)).collect()
        };
        let rows: String = self.rows.iter().map(|row| line(words(row))).collect();
        let rule = "|---".repeat(self.columns.len());
        line(self.columns.iter().map(Column::long).collect()) + &rule + "|\n" + &rows
    }
}

/// What an interval establishes that does not hold `even`, where both are as good; `direction` is
/// better.
pub fn verdict(
    interval: Option<[f64; 2]>,
    even: f64,
    direction: Direction,
) -> Option<&'static str> {
    let [low, high] = interval?;
    let [is_less, is_more] = [high < even, low > even];
    match direction {
        Direction::Neither => None,
        Direction::Less if is_less => Some("better"),
        Direction::More if is_more => Some("better"),
        _ => (is_less || is_more).then_some("worse"),
    }
}

/// Cells in aligned columns, the first to the left, the others to the right; every line has as many
/// cells as the first.
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
