//! A legend: swatches with their words, in as many rows as they need.

use super::canvas::{Anchor, Area, Canvas, PointPx};
use super::style::{self, INITIAL, LATER, TEXT_PX};
use crate::experiment::store::Run;

/// From one row to the next.
const ROW_PX: f64 = 20.0;
/// From an entry to its words, and from its words to the next entry.
const GAPS_PX: [f64; 2] = [28.0, 18.0];
/// Width of a letter: there are no font metrics here, so that of the widest common sans-serif.
const LETTER_PX: f64 = 7.4;

/// Swatches with their words, each in its place.
pub struct Legend<'a> {
    /// Each with where it begins, from the left and from the first row.
    entries: Vec<(PointPx, Swatch, &'a str)>,
}

impl<'a> Legend<'a> {
    /// Lays entries out in rows of a width; one that is wider has a row for itself.
    pub fn new(width_px: f64, entries: impl IntoIterator<Item = (Swatch, &'a str)>) -> Self {
        let [mut x, mut y] = [0.0; 2];
        let mut placed = Vec::new();
        for (swatch, words) in entries {
            let entry_px = GAPS_PX[0] + LETTER_PX * words.chars().count() as f64;
            if x > 0.0 && x + entry_px > width_px {
                [x, y] = [0.0, y + ROW_PX];
            }
            placed.push(([x, y], swatch, words));
            x += entry_px + GAPS_PX[1];
        }
        Self { entries: placed }
    }

    /// Room that the rows below the first need.
    pub fn more_px(&self) -> f64 {
        self.entries.last().map_or(0.0, |([_, y], ..)| *y)
    }

    /// Draws it, the middle of its first row's left end at `at`.
    pub fn draw(&self, canvas: &mut Canvas, at: PointPx) {
        for ([x, y], swatch, words) in &self.entries {
            let [left, middle] = [at[0] + x, at[1] + y];
            swatch.draw(canvas, [left + 11.0, middle]);
            canvas.text([left + GAPS_PX[0], middle + 4.5], words, TEXT_PX, Anchor::Start);
        }
    }
}

/// A drawing with a legend above panels of one size in columns and rows.
pub struct Sheet {
    /// The drawing, with the legend on it.
    pub canvas: Canvas,
    first: Area,
    step: [f64; 2],
    /// The bottom edge of the drawing.
    pub bottom: f64,
}

impl Sheet {
    /// A drawing of `size` with a legend of a width, drawn in a group of `attributes`, and `step`
    /// from one panel to the next. It grows, and `first` moves down, by the rows that the legend
    /// needs behind the first.
    pub fn new<'a>(
        [width, height]: [f64; 2],
        (first, step): (Area, [f64; 2]),
        (legend_px, attributes): (f64, &str),
        entries: impl IntoIterator<Item = (Swatch, &'a str)>,
    ) -> Self {
        let legend = Legend::new(legend_px, entries);
        let bottom = height + legend.more_px();
        let mut canvas = Canvas::new(width, bottom);
        let at = [first.left, 20.0];
        match attributes {
            "" => legend.draw(&mut canvas, at),
            attributes => canvas.grouped(attributes, |canvas| legend.draw(canvas, at)),
        }
        let first = Area { top: first.top + legend.more_px(), ..first };
        Self { canvas, first, step, bottom }
    }

    /// The rectangle of a panel.
    pub fn area(&self, column: usize, row: f64) -> Area {
        let left = self.first.left + column as f64 * self.step[0];
        Area { left, top: self.first.top + row * self.step[1], ..self.first }
    }
}

/// The entry of touches that met nothing, if there are any.
pub fn miss_entry(run: &Run) -> Option<(Swatch, &'static str)> {
    let mut touches = run.rows.iter().flat_map(|row| &row.touches);
    let is_missed = touches.any(|touch| touch.contact.is_none());
    is_missed.then_some(MISS)
}

/// The entry of touches that met nothing.
pub const MISS: (Swatch, &str) = (Swatch::Diamond(LATER), "touch that met nothing");

/// The entries of touches on a surface that may hide them.
pub fn touch_entries() -> [(Swatch, &'static str); 3] {
    [
        (Swatch::Circle(style::visible(INITIAL)), "initial touch"),
        (Swatch::Circle(style::visible(LATER)), "later touch"),
        (Swatch::Circle(style::hidden(LATER)), "behind the surface"),
    ]
}

/// A mark in a legend.
pub enum Swatch {
    /// A line with these attributes.
    Line(String),
    /// A band in this colour.
    Band(&'static str),
    /// A cross in this colour.
    Cross(&'static str),
    /// A circle with these attributes.
    Circle(String),
    /// A hollow diamond in this colour.
    Diamond(&'static str),
    /// A filled box in this colour.
    Box(&'static str),
}

impl Swatch {
    fn draw(&self, canvas: &mut Canvas, [x, y]: PointPx) {
        let area = Area { left: x - 11.0, top: y - 6.0, width: 22.0, height: 12.0 };
        match self {
            Self::Line(attributes) => canvas.line([[x - 11.0, y], [x + 11.0, y]], attributes),
            Self::Band(colour) => canvas.rect(area, &style::fill(colour, style::BAND_OPACITY)),
            Self::Cross(colour) => canvas.cross([x, y], colour),
            Self::Circle(attributes) => canvas.circle([x, y], 3.6, attributes),
            Self::Diamond(colour) => canvas.diamond([x, y], &style::stroke(colour, 1.3)),
            Self::Box(colour) => canvas.rect(area, &style::fill(colour, 1.0)),
        }
    }
}
