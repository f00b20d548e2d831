//! Logs of other programs: rows of a CSV or Parquet file, with their places, and columns by name.

use palpate_input::error::InputError;
use palpate_input::files;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use std::path::Path;

/// Rows of text.
pub struct LogTable {
    /// Names of the columns.
    pub names: Vec<String>,
    /// Rows, in the order of the file.
    pub rows: Vec<LogRow>,
}

/// A row with its place in the file.
pub struct LogRow {
    /// File and line, or number of the row.
    pub place: String,
    /// Its values; an absent one is empty.
    pub values: Vec<String>,
}

/// A column of numbers.
pub struct LogColumn {
    /// Name in the file.
    pub name: String,
    /// Number among the columns.
    pub number: usize,
    /// SI units in one unit of its values.
    pub unit: f64,
}

/// Endings of names with the SI units in their unit: numbers without one, lengths, and squares of
/// lengths; the first that the file has counts.
pub const PLAIN: &[(&str, f64)] = &[("", 1.0)];
/// Endings of lengths.
pub const LENGTHS: &[(&str, f64)] = &[("_m", 1.0), ("_mm", 1e-3), ("_cm", 1e-2), ("", 1.0)];
/// Endings of squares of lengths.
pub const SQUARES: &[(&str, f64)] = &[("", 1.0), ("_m2", 1.0), ("_mm2", 1e-6)];

/// Columns of a file by name, and which of them were found.
pub struct LogColumns<'a> {
    names: &'a [String],
    is_read: Vec<bool>,
}

impl<'a> LogColumns<'a> {
    /// Creates them from the names in a file.
    pub fn new(names: &'a [String]) -> Self {
        Self { names, is_read: vec![false; names.len()] }
    }

    /// Returns the column `name` with one of `endings`, if there is one; capitals do not matter.
    pub fn find(&mut self, name: &str, endings: &[(&str, f64)]) -> Option<LogColumn> {
        endings.iter().find_map(|(ending, unit)| {
            let name = format!("{name}{ending}");
            let number = self.names.iter().position(|it| it.eq_ignore_ascii_case(&name))?;
            self.is_read[number] = true;
            Some(LogColumn { name: self.names[number].clone(), number, unit: *unit })
        })
    }

    /// Returns several columns; `None` if the file has none of them.
    ///
    /// # Errors
    /// If it has some of them only.
    pub fn optional<const N: usize>(
        &mut self,
        names: [&str; N],
        endings: &[(&str, f64)],
    ) -> Result<Option<[LogColumn; N]>, InputError> {
        let found = names.map(|name| self.find(name, endings));
        match found.iter().any(Option::is_some) {
            true => self.whole(names, found).map(Some),
            false => Ok(None),
        }
    }

    /// Returns several columns.
    ///
    /// # Errors
    /// If one is missing.
    pub fn needed<const N: usize>(
        &mut self,
        names: [&str; N],
        endings: &[(&str, f64)],
    ) -> Result<[LogColumn; N], InputError> {
        let found = names.map(|name| self.find(name, endings));
        self.whole(names, found)
    }

    fn whole<const N: usize>(
        &self,
        names: [&str; N],
        found: [Option<LogColumn>; N],
    ) -> Result<[LogColumn; N], InputError> {
        let missing = names.iter().zip(&found).find(|(_, column)| column.is_none());
        match missing {
            Some((name, _)) => Err(self.missing(name)),
            None => {
                let all: Vec<LogColumn> = found.into_iter().flatten().collect();
                all.try_into().map_err(|_| self.missing(names[0]))
            }
        }
    }

    /// Returns the error of a file without a column.
    pub fn missing(&self, name: &str) -> InputError {
        InputError::new(format!("no column {name}; the file has {}", self.names.join(", ")))
    }

    /// Returns the names of columns that were not found.
    pub fn unread(&self) -> Vec<String> {
        let each = self.names.iter().zip(&self.is_read);
        each.filter(|(_, is_read)| !**is_read).map(|(name, _)| name.clone()).collect()
    }
}

impl LogRow {
    /// Returns the text in a column.
    pub fn text(&self, column: &LogColumn) -> &str {
        &self.values[column.number]
    }

    /// Whether one of the columns has a value.
    pub fn has(&self, columns: &[LogColumn]) -> bool {
        columns.iter().any(|column| !self.text(column).is_empty())
    }

    /// Returns the number in a column, in SI units.
    ///
    /// # Errors
    /// If it is not a finite number.
    pub fn number(&self, column: &LogColumn) -> Result<f64, InputError> {
        let text = self.text(column);
        let number = text.parse::<f64>().ok().filter(|number| number.is_finite());
        let number = number.ok_or_else(|| {
            let shown = if text.is_empty() { "nothing".into() } else { format!("\"{text}\"") };
            InputError::new(format!("column {}", column.name)).value(shown).allowed("a number")
        })?;
        Ok(number * column.unit)
    }

    /// Returns the numbers in several columns, in SI units.
    ///
    /// # Errors
    /// If one is not a finite number.
    pub fn numbers<const N: usize>(
        &self,
        columns: &[LogColumn; N],
    ) -> Result<[f64; N], InputError> {
        let mut numbers = [0.0; N];
        for (number, column) in numbers.iter_mut().zip(columns) {
            *number = self.number(column)?;
        }
        Ok(numbers)
    }
}

/// First bytes of a Parquet file.
const PARQUET: &[u8] = b"PAR1";

/// Largest size of a log, bytes.
// heuristic: a day of contacts at 1 kHz is never one log.
const LOG_MAX: u64 = 256 << 20;

impl LogTable {
    /// Reads a CSV file with a line of names, in which lines from `#` on are comments, or a Parquet
    /// file.
    ///
    /// # Errors
    /// If it cannot be read, or a line has another number of values than the first.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        let bytes = files::bytes(path, LOG_MAX).map_err(|cause| InputError::io(path, cause))?;
        match bytes.starts_with(PARQUET) {
            true => Self::parquet(path, bytes),
            false => Self::csv(path, &bytes),
        }
    }

    fn csv(path: &Path, bytes: &[u8]) -> Result<Self, InputError> {
        let at_line = |line: Option<u64>| match line {
            Some(line) => format!("{}:{line}", path.display()),
            None => path.display().to_string(),
        };
        let wrong = |error: csv::Error| {
            let line = error.position().map(csv::Position::line);
            let problem = match error.kind() {
                csv::ErrorKind::Utf8 { .. } => "not UTF-8 text".to_owned(),
                csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
                    format!("{len} values in a table of {expected_len} columns")
                }
                _ => error.to_string(),
            };
            let allowed = "a CSV file with a line of names, or a Parquet file";
            InputError::new(problem).at(at_line(line)).allowed(allowed)
        };
        let mut reader = csv::ReaderBuilder::new()
            .comment(Some(b'#'))
            .trim(csv::Trim::All)
            .from_reader(files::without_bom(bytes));
        let names = reader.headers().map_err(wrong)?.iter().map(str::to_owned).collect();
        let rows = reader.records().map(|record| {
            let record = record.map_err(wrong)?;
            let line = record.position().map(csv::Position::line);
            let values = record.iter().map(str::to_owned).collect();
            Ok(LogRow { place: at_line(line), values })
        });
        Ok(Self { names, rows: rows.collect::<Result<_, InputError>>()? })
    }

    fn parquet(path: &Path, bytes: Vec<u8>) -> Result<Self, InputError> {
        let wrong = |error: parquet::errors::ParquetError| {
            InputError::new(format!("no Parquet file that can be read: {error}")).at(path.display())
        };
        let reader = SerializedFileReader::new(bytes::Bytes::from(bytes)).map_err(wrong)?;
        let schema = reader.metadata().file_metadata().schema_descr();
        let names = schema.columns().iter().map(|column| column.path().string()).collect();
        let rows = reader.get_row_iter(None).map_err(wrong)?.enumerate().map(|(i, row)| {
            let row = row.map_err(wrong)?;
            let values = row.get_column_iter().map(|(_, field)| text(field)).collect();
            Ok(LogRow { place: format!("{}, row {}", path.display(), i + 1), values })
        });
        Ok(Self { names, rows: rows.collect::<Result<_, InputError>>()? })
    }
}

/// Returns the text of a value, from which its number is read without loss.
fn text(field: &Field) -> String {
    match field {
        Field::Null => String::new(),
        Field::Str(text) => text.clone(),
        // Formats of the library round to some digits.
        Field::Double(value) => value.to_string(),
        Field::Float(value) => value.to_string(),
        other => other.to_string(),
    }
}
