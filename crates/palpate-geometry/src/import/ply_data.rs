//! Data of a PLY file after its header, text or binary.

use std::str::{Lines, SplitWhitespace};

use ply_rs_bw::ply::{ElementDef, Encoding, PropertyType, ScalarType};

use super::source::bad_line;
use palpate_input::error::InputError;

/// Data that are read element by element.
pub(super) enum Data<'a> {
    Text { lines: Lines<'a>, number: usize, line: &'a str, words: SplitWhitespace<'a> },
    Binary { bytes: &'a [u8], is_little: bool },
}

impl<'a> Data<'a> {
    /// Creates data from a text that follows `lines_before` lines.
    pub fn text(text: &'a str, lines_before: usize) -> Self {
        let words = "".split_whitespace();
        Self::Text { lines: text.lines(), number: lines_before, line: "", words }
    }

    /// Creates binary data.
    pub fn binary(bytes: &'a [u8], encoding: Encoding) -> Self {
        Self::Binary { bytes, is_little: encoding == Encoding::BinaryLittleEndian }
    }

    /// Reads all elements of one kind. `take` gets the numbers of every property of an element,
    /// one or those of a list; it returns `None` if they are not as `expected`.
    ///
    /// # Errors
    /// If the data end, or a word is no number, or `take` returns `None`.
    pub fn read(
        &mut self,
        element: &ElementDef,
        expected: &str,
        mut take: impl FnMut(&[Vec<f64>]) -> Option<()>,
    ) -> Result<(), InputError> {
        let kinds: Vec<_> = element.properties.values().map(|it| it.data_type.clone()).collect();
        let mut properties = vec![Vec::new(); kinds.len()];
        for number in 0..element.count {
            self.begin();
            let mut pairs = kinds.iter().zip(&mut properties);
            let is_whole = pairs.all(|(kind, numbers)| self.numbers(kind, numbers).is_some());
            if !(is_whole && take(&properties).is_some()) {
                return Err(self.fault(element, number, is_whole.then_some(expected)));
            }
        }
        Ok(())
    }

    /// Returns the number of bytes that have not been read, without blanks at their ends.
    pub fn bytes_left(&self) -> usize {
        match self {
            Self::Text { lines, .. } => lines.clone().map(|line| line.trim().len()).sum(),
            Self::Binary { bytes, .. } => bytes.trim_ascii().len(),
        }
    }

    /// Goes to the next line of a text that is not blank.
    fn begin(&mut self) {
        let Self::Text { lines, number, line, words } = self else { return };
        *line = loop {
            *number += 1;
            match lines.next() {
                Some(blank) if blank.trim().is_empty() => {}
                Some(next) => break next,
                None => break "",
            }
        };
        *words = line.split_whitespace();
    }

    /// Reads the numbers of a property.
    fn numbers(&mut self, kind: &PropertyType, numbers: &mut Vec<f64>) -> Option<()> {
        numbers.clear();
        let (count, kind) = match kind {
            PropertyType::Scalar(kind) => (1, kind),
            PropertyType::List(count, kind) => (index(self.number(count)?)?, kind),
        };
        for _ in 0..count {
            numbers.push(self.number(kind)?);
        }
        Some(())
    }

    fn number(&mut self, kind: &ScalarType) -> Option<f64> {
        let (bytes, is_little) = match self {
            Self::Text { words, .. } => {
                let word = words.next()?;
                return match kind {
                    ScalarType::Float => word.parse::<f32>().ok().map(f64::from),
                    _ => word.parse().ok(),
                };
            }
            Self::Binary { bytes, is_little } => (bytes, is_little),
        };
        let size = match kind {
            ScalarType::Char | ScalarType::UChar => 1,
            ScalarType::Short | ScalarType::UShort => 2,
            ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
            ScalarType::Double => 8,
        };
        let mut number = [0; 8];
        number[..size].copy_from_slice(bytes.split_off(..size)?);
        if !*is_little {
            number[..size].reverse();
        }
        let bits = u64::from_le_bytes(number);
        Some(match kind {
            ScalarType::Char => (bits as i8).into(),
            ScalarType::Short => (bits as i16).into(),
            ScalarType::Int => (bits as i32).into(),
            ScalarType::UChar | ScalarType::UShort | ScalarType::UInt => (bits as u32).into(),
            ScalarType::Float => f32::from_bits(bits as u32).into(),
            ScalarType::Double => f64::from_bits(bits),
        })
    }

    /// Returns the error of an element: it is not as `expected`, or not as the header declares.
    fn fault(&self, element: &ElementDef, place: usize, expected: Option<&str>) -> InputError {
        let (name, count) = (&element.name, element.count);
        match (self, expected) {
            (Self::Text { number, line, .. }, _) => {
                let found = if line.is_empty() { "the end of the file" } else { line };
                bad_line(*number, expected.unwrap_or("data as declared in the PLY header"), found)
            }
            (_, Some(expected)) => {
                InputError::new(format!("PLY: element '{name}' {place} does not hold {expected}"))
            }
            (_, None) => InputError::new(format!(
                "PLY: the file ends within element '{name}', after {place} of {count}"
            )),
        }
    }
}

/// Returns a number as an index or a count; `None` if it is none.
pub(super) fn index(number: f64) -> Option<u32> {
    let index = number as u32;
    (f64::from(index) == number).then_some(index)
}
