//! Cells and columns of tables for the terminal.

pub use crate::report::table::aligned as aligned_rows;

/// Formats cells in aligned columns: the first column left-aligned, the others right-aligned.
pub fn aligned<const N: usize>(lines: &[[String; N]]) -> String {
    aligned_rows(lines)
}

/// Removes the columns that have no value in any line; the first line is the header.
pub fn without_empty(mut lines: Vec<Vec<String>>) -> Vec<Vec<String>> {
    for column in (0..lines.first().map_or(0, Vec::len)).rev() {
        if lines.len() > 1 && lines.iter().skip(1).all(|line| line[column] == EMPTY_CELL) {
            lines.iter_mut().for_each(|line| drop(line.remove(column)));
        }
    }
    lines
}

/// Text of a cell without a value.
pub const EMPTY_CELL: &str = "-";

/// Formats a number; a dash if there is none.
pub fn cell(value: Option<f64>, decimals: usize) -> String {
    value.map_or(EMPTY_CELL.into(), |value| format!("{value:.decimals$}"))
}

/// Formats a duration in us, ms or s.
pub fn duration(s: f64) -> String {
    match s {
        s if s < 1e-3 => format!("{:.1} us", 1e6 * s),
        s if s < 1.0 => format!("{:.2} ms", 1e3 * s),
        s => format!("{s:.2} s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_without_a_value_is_left_out() {
        let lines = |lines: &[&[&str]]| -> Vec<Vec<String>> {
            lines.iter().map(|line| line.iter().map(|&cell| cell.into()).collect()).collect()
        };
        let all = lines(&[&["effect", "runs", "time"], &["skin", "-", "-"], &["fluid", "-", "1"]]);
        let kept = lines(&[&["effect", "time"], &["skin", "-"], &["fluid", "1"]]);
        assert_eq!(without_empty(all), kept);
        assert_eq!(without_empty(lines(&[&["effect", "runs"]])), lines(&[&["effect", "runs"]]));
    }
}
