//! A map of colours over a zone with two sides.

use super::canvas::{Area, Canvas, number, pair};
use super::style;
use crate::task::Zone;

/// Size of a cell in pixels; an area of whole cells shows no gaps between them.
pub const CELL_PX: f64 = 4.0;
/// Colours told apart; neighbours in a row that share one become one rectangle.
const LEVELS: usize = 64;

/// Values over a zone, x varying fastest.
pub struct HeatMap {
    columns: usize,
    rows: usize,
    values: Vec<f64>,
}

impl HeatMap {
    /// Reads `value` at the middle of every cell of a map of the size of `area`.
    pub fn read(zone: &Zone, area: Area, mut value: impl FnMut(&[f64]) -> f64) -> Self {
        let cells = |side_px: f64| (side_px / CELL_PX).round().max(1.0) as usize;
        let mut map =
            Self { columns: cells(area.width), rows: cells(area.height), values: Vec::new() };
        map.values = map.middles(zone).map(|place| value(&place)).collect();
        map
    }

    /// The largest value; 0 of none.
    pub fn largest(&self) -> f64 {
        self.values.iter().copied().fold(0.0, f64::max)
    }

    /// The middles of the cells with their values.
    pub fn places<'a>(&'a self, zone: &'a Zone) -> impl Iterator<Item = (Vec<f64>, f64)> + 'a {
        self.middles(zone).zip(self.values.iter().copied())
    }

    fn middles<'a>(&self, zone: &'a Zone) -> impl Iterator<Item = Vec<f64>> + use<'a> {
        let (columns, rows) = (self.columns, self.rows);
        let middle = |i: usize, count: usize| (i as f64 + 0.5) / count as f64;
        (0..columns * rows)
            .map(move |k| zone.at(&[middle(k % columns, columns), middle(k / columns, rows)]))
    }

    /// Fills `area`, z upwards.
    pub fn draw(&self, canvas: &mut Canvas, area: Area, colour: impl Fn(f64) -> String) {
        let largest = self.largest();
        let level = |value: f64| match largest > 0.0 {
            true => ((value / largest * LEVELS as f64) as usize).min(LEVELS - 1),
            false => 0,
        };
        let cell = [area.width / self.columns as f64, area.height / self.rows as f64];
        let mut outlines = vec![String::new(); LEVELS];
        for (row, values) in self.values.chunks(self.columns).enumerate() {
            let top = area.bottom() - (row + 1) as f64 * cell[1];
            let mut begin = 0;
            for run in values.chunk_by(|a, b| level(*a) == level(*b)) {
                let start = pair([area.left + begin as f64 * cell[0], top]);
                let (width, height) = (number(run.len() as f64 * cell[0]), number(cell[1]));
                outlines[level(run[0])] += &format!("M{start}h{width}v{height}h-{width}z");
                begin += run.len();
            }
        }
        for (level, outline) in outlines.iter().enumerate().filter(|(_, data)| !data.is_empty()) {
            let value = largest * (level as f64 + 0.5) / LEVELS as f64;
            let attributes = style::fill(&colour(value), 1.0) + r#" shape-rendering="crispEdges""#;
            canvas.outline(outline, &attributes);
        }
    }
}
