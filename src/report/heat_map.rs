//! Heat map over a zone with two sides.

use super::canvas::{Area, Canvas, number};
use super::style;
use palpate_explore::task::Zone;

/// Approximate size of a cell in pixels.
const CELL_PX: f64 = 4.0;
/// Number of colours; adjacent cells of a row with the same colour become one rectangle.
const LEVELS: usize = 64;

/// Place, the value there, and whether it is drawn.
pub type MapValue = (Vec<f64>, f64, bool);

/// Values over a zone, x varying fastest.
pub struct HeatMap {
    columns: usize,
    rows: usize,
    /// Values at the centres of the cells.
    pub readings: Vec<MapValue>,
}

impl HeatMap {
    /// Creates a map of the size of `area`; `read` returns the values at the centres of its cells.
    pub fn new(zone: &Zone, area: Area, read: impl FnOnce(Vec<Vec<f64>>) -> Vec<MapValue>) -> Self {
        let cells = |side_px: f64| (side_px / CELL_PX).round().max(1.0) as usize;
        let (columns, rows) = (cells(area.width), cells(area.height));
        let middle = |i: usize, count: usize| (i as f64 + 0.5) / count as f64;
        let at = |k| zone.at(&[middle(k % columns, columns), middle(k / columns, rows)]);
        Self { columns, rows, readings: read((0..columns * rows).map(at).collect()) }
    }

    /// Returns the largest value drawn, or 0 if no value is drawn.
    pub fn largest(&self) -> f64 {
        let drawn = self.readings.iter().filter(|(.., is_drawn)| *is_drawn);
        drawn.map(|(_, value, _)| *value).fold(0.0, f64::max)
    }

    /// Fills `area`, z upwards.
    pub fn draw(&self, canvas: &mut Canvas, area: Area, colour: impl Fn(f64) -> String) {
        let largest = self.largest();
        let level = |(_, value, is_drawn): &MapValue| {
            let share = if largest > 0.0 { value / largest } else { 0.0 };
            is_drawn.then(|| ((share * LEVELS as f64) as usize).min(LEVELS - 1))
        };
        let levels: Vec<Option<usize>> = self.readings.iter().map(level).collect();
        // Ends of cells are rounded alike, so that neighbours meet without a gap.
        let left =
            |column: usize| number(area.left + column as f64 * area.width / self.columns as f64);
        let top = |row: usize| number(area.bottom() - row as f64 * area.height / self.rows as f64);
        let mut outlines = vec![String::new(); LEVELS];
        for (row, levels) in levels.chunks(self.columns).enumerate() {
            let mut begin = 0;
            for run in levels.chunk_by(|a, b| a == b) {
                let end = begin + run.len();
                if let Some(level) = run[0] {
                    let (x0, x1, y0, y1) = (left(begin), left(end), top(row + 1), top(row));
                    outlines[level] += &format!("M{x0} {y0}H{x1}V{y1}H{x0}z");
                }
                begin = end;
            }
        }
        for (level, outline) in outlines.iter().enumerate().filter(|(_, data)| !data.is_empty()) {
            let value = largest * (level as f64 + 0.5) / LEVELS as f64;
            let attributes = style::fill(&colour(value), 1.0) + r#" shape-rendering="crispEdges""#;
            canvas.outline(outline, &attributes);
        }
    }
}
