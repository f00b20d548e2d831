//! Legend of a drawing: swatches with their labels, in as many rows as they need.

use super::canvas::{Anchor, Area, Canvas, PartKind, PointPx};
use super::style::{self, INITIAL, PLANNED, TEXT_PX};
use crate::experiment::store::Run;

/// Height of a row.
const ROW_PX: f64 = 20.0;
/// Distance from a swatch to its label, and from a label to the next swatch.
const GAPS_PX: [f64; 2] = [28.0, 18.0];
/// Width of a letter of the widest common sans-serif font, as there are no font metrics here.
const LETTER_PX: f64 = 7.4;

/// Legend entries with their positions.
pub struct Legend<'a> {
    /// Entries with their positions, from the left and from the first row.
    entries: Vec<(PointPx, Swatch, &'a str)>,
}

impl<'a> Legend<'a> {
    /// Arranges the entries in rows of width `width_px`; a wider entry gets its own row.
    pub fn new(width_px: f64, entries: impl IntoIterator<Item = (Swatch, &'a str)>) -> Self {
        let [mut x, mut y] = [0.0; 2];
        let mut placed = Vec::new();
        for (swatch, words) in entries {
            let entry_px = entry_px(words);
            if x > 0.0 && x + entry_px > width_px {
                [x, y] = [0.0, y + ROW_PX];
            }
            placed.push(([x, y], swatch, words));
            x += entry_px + GAPS_PX[1];
        }
        Self { entries: placed }
    }

    /// Returns the height of the rows below the first.
    pub fn more_px(&self) -> f64 {
        self.entries.last().map_or(0.0, |([_, y], ..)| *y)
    }

    /// Draws the legend in a group of `attributes` for each entry, with the middle of its first
    /// row's left end at `at`.
    pub fn draw(&self, canvas: &mut Canvas, at: PointPx, attributes: &str) {
        for ([x, y], swatch, words) in &self.entries {
            let [left, middle] = [at[0] + x, at[1] + y];
            let width = entry_px(words) + GAPS_PX[1];
            let top = middle - 0.5 * ROW_PX;
            canvas.part(PartKind::Key, Area { left, top, width, height: ROW_PX });
            let at = [left + 11.0, middle];
            match attributes {
                "" => swatch.draw(canvas, at),
                attributes => canvas.grouped(attributes, |canvas| swatch.draw(canvas, at)),
            }
            canvas.text([left + GAPS_PX[0], middle + 4.5], words, TEXT_PX, Anchor::Start);
        }
    }
}

/// Returns the width of an entry.
fn entry_px(words: &str) -> f64 {
    GAPS_PX[0] + LETTER_PX * words.chars().count() as f64
}

/// Drawing with a legend above panels of one size in columns and rows.
pub struct FigureLayout {
    /// Drawing with the legend.
    pub canvas: Canvas,
    first: Area,
    step: [f64; 2],
    /// Bottom edge of the drawing.
    pub bottom: f64,
}

impl FigureLayout {
    /// Creates a drawing of `size` with a legend of `legend_px`, drawn in a group of `attributes`,
    /// and a distance of `step` between panels. The drawing grows, and `first` moves down, by the
    /// legend's additional rows.
    pub fn new<'a>(
        [width, height]: [f64; 2],
        first: Area,
        step: [f64; 2],
        legend_px: f64,
        attributes: &str,
        entries: impl IntoIterator<Item = (Swatch, &'a str)>,
    ) -> Self {
        let legend = Legend::new(legend_px, entries);
        let bottom = height + legend.more_px();
        let mut canvas = Canvas::new(width, bottom);
        legend.draw(&mut canvas, [first.left, 20.0], attributes);
        let first = Area { top: first.top + legend.more_px(), ..first };
        Self { canvas, first, step, bottom }
    }

    /// Begins a panel, with `room` to the left, above, to the right and below for what is written
    /// around it; returns its rectangle.
    pub fn panel(&mut self, column: usize, row: f64, room: [f64; 4]) -> Area {
        let area = self.area(column, row);
        let [left, above, right, below] = room;
        let part = Area {
            left: area.left - left,
            top: area.top - above,
            width: area.width + left + right,
            height: area.height + above + below,
        };
        self.canvas.part(PartKind::Panel, part);
        area
    }

    /// Returns the rectangle of a panel.
    pub fn area(&self, column: usize, row: f64) -> Area {
        let left = self.first.left + column as f64 * self.step[0];
        Area { left, top: self.first.top + row * self.step[1], ..self.first }
    }
}

/// Returns the legend entry of missed touches, if there are any.
pub fn miss_entry(run: &Run) -> Option<(Swatch, &'static str)> {
    let mut touches = run.rows.iter().flat_map(|row| &row.touches);
    let is_missed = touches.any(|touch| touch.contact().is_none());
    is_missed.then_some(MISS)
}

/// Legend entry of missed touches.
pub const MISS: (Swatch, &str) = (Swatch::Diamond(PLANNED), "touch without contact");

/// Returns the legend entry of what cameras have seen, if they have.
pub fn seen_entry(run: &Run) -> Option<(Swatch, &'static str)> {
    run.rows.iter().any(|row| !row.views.is_empty()).then_some(SEEN)
}

/// Returns the legend entry of strokes.
pub fn stroke_entry() -> (Swatch, &'static str) {
    (Swatch::Line(style::slide(PLANNED)), "stroke")
}

/// Legend entry of what cameras have seen.
pub const SEEN: (Swatch, &str) = (Swatch::Dot, "seen by the camera");

/// Returns the legend entries of touches that a surface may hide.
pub fn touch_entries() -> [(Swatch, &'static str); 3] {
    [
        (Swatch::Circle(style::visible_touch(INITIAL)), "initial touch"),
        (Swatch::Circle(style::visible_touch(PLANNED)), "later touch"),
        (Swatch::Circle(style::hidden_touch(PLANNED)), "behind the surface"),
    ]
}

/// Swatch of a legend.
pub enum Swatch {
    /// Line with these attributes.
    Line(String),
    /// Band in this colour.
    Band(&'static str),
    /// Cross in this colour.
    Cross(&'static str),
    /// Circle with these attributes.
    Circle(String),
    /// Point that a camera has seen.
    Dot,
    /// Hollow diamond in this colour.
    Diamond(&'static str),
    /// Filled box in this colour.
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
            Self::Dot => canvas.circle([x, y], style::SEEN_PX, &style::seen()),
            Self::Diamond(colour) => canvas.diamond([x, y], &style::stroke(colour, 1.3)),
            Self::Box(colour) => canvas.rect(area, &style::fill(colour, 1.0)),
        }
    }
}
