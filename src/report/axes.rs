//! Axes of a panel: conversion from data to pixels, with ticks at round numbers.

use super::canvas::{Anchor, Area, Canvas, PartKind, PointPx};
use super::style::{self, FAINT_INK, GRID, INK, SMALL_PX, TEXT_PX};
use palpate_explore::task::Zone;

/// Unit of length for labels.
#[derive(Clone, Copy, Debug)]
pub struct Length {
    /// Number of units in a metre.
    pub per_m: f64,
    /// Symbol of the unit.
    pub symbol: &'static str,
}

/// Millimetres.
pub const MM: Length = Length { per_m: 1e3, symbol: "mm" };

impl Length {
    /// Returns metres for a zone of a metre or more, millimetres for a smaller one.
    pub fn of(zone: &Zone) -> Self {
        match zone.extents_m().iter().any(|&side| side >= 1.0) {
            true => Self { per_m: 1.0, symbol: "m" },
            false => MM,
        }
    }

    /// Returns `name` with the unit's symbol in parentheses.
    pub fn named(&self, name: &str) -> String {
        format!("{name} ({})", self.symbol)
    }
}

/// Range of values along one side of a panel.
#[derive(Clone, Debug)]
pub struct Axis {
    low: f64,
    high: f64,
    is_log: bool,
    aim: f64,
    /// Smallest step from one tick to the next.
    step_min: f64,
}

impl Axis {
    /// Creates a linear axis from `low` to `high`, with about `aim` ticks.
    pub fn linear(low: f64, high: f64, aim: f64) -> Self {
        let (low, high) = if high > low { (low, high) } else { (low - 0.5, low + 0.5) };
        Self { low, high, is_log: false, aim, step_min: 0.0 }
    }

    /// Creates a linear axis of counts, whose ticks are whole numbers.
    pub fn counts(low: f64, high: f64, aim: f64) -> Self {
        Self { step_min: 1.0, ..Self::linear(low, high, aim) }
    }

    /// Creates a linear axis around all `values` with a margin, as a fraction of their range.
    pub fn around(values: impl IntoIterator<Item = f64>, margin: f64, aim: f64) -> Option<Self> {
        let (low, high) = range(values)?;
        let margin = margin * (high - low);
        Some(Self::linear(low - margin, high + margin, aim))
    }

    /// Creates a logarithmic axis around the positive `values`.
    pub fn log(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let (low, high) = range(values.into_iter().filter(|&value| value > 0.0))?;
        let [low, high] = [low / 1.25, high * 1.25];
        Some(Self { low, high, is_log: true, aim: 5.0, step_min: 0.0 })
    }

    /// Returns the smallest and largest value.
    pub fn range(&self) -> (f64, f64) {
        (self.low, self.high)
    }

    /// Returns the position of `value` along the axis, 0 to 1 between the ends.
    pub fn fraction(&self, value: f64) -> f64 {
        match self.is_log {
            true => (value / self.low).ln() / (self.high / self.low).ln(),
            false => (value - self.low) / (self.high - self.low),
        }
    }

    /// Returns the ticks with their labels.
    pub fn ticks(&self) -> Vec<(f64, String)> {
        if self.is_log { self.log_ticks() } else { self.linear_ticks() }
    }

    /// Returns the ticks that fit along a side of this length, if each needs `room_px`.
    fn ticks_along(&self, side_px: f64, room_px: impl Fn(&str) -> f64) -> Vec<(f64, String)> {
        const APART_PX: f64 = 5.0;
        let mut axis = self.clone();
        loop {
            let ticks = axis.ticks();
            let is_apart = ticks.windows(2).all(|pair| {
                let step_px = side_px * (self.fraction(pair[1].0) - self.fraction(pair[0].0));
                step_px >= 0.5 * (room_px(&pair[0].1) + room_px(&pair[1].1)) + APART_PX
            });
            if is_apart || axis.aim < 1.0 {
                return ticks;
            }
            axis.aim *= 0.7;
        }
    }

    fn linear_ticks(&self) -> Vec<(f64, String)> {
        let rough = ((self.high - self.low) / self.aim).max(self.step_min);
        let power = 10f64.powf(rough.log10().floor());
        let step =
            [1.0, 2.0, 5.0, 10.0].map(|digit| digit * power).into_iter().find(|&s| s >= rough);
        let step = step.unwrap_or(rough);
        let decimals = (-step.log10().floor()).clamp(0.0, 12.0) as usize;
        let slack = 1e-9 * step;
        let first = ((self.low - slack) / step).ceil() as i64;
        let last = ((self.high + slack) / step).floor() as i64;
        (first..=last)
            .map(|i| i as f64 * step)
            .map(|value| (value, format!("{value:.decimals$}").replace('-', "−")))
            .collect()
    }

    fn log_ticks(&self) -> Vec<(f64, String)> {
        let decades = (self.low.log10().floor() as i32)..=(self.high.log10().ceil() as i32);
        let digits: &[f64] = match (self.high / self.low).log10() {
            span if span < 1.0 => &[1.0, 2.0, 3.0, 5.0, 7.0],
            span if span < 2.0 => &[1.0, 2.0, 5.0],
            _ => &[1.0],
        };
        decades
            .flat_map(|power| digits.iter().map(move |digit| (digit, power)))
            .map(|(digit, power)| {
                let value = digit * 10f64.powi(power);
                let label = match power {
                    -3.. => format!("{value:.decimals$}", decimals = (-power).max(0) as usize),
                    _ => format!("{digit}e−{}", -power),
                };
                (value, label)
            })
            .filter(|(value, _)| (self.low..=self.high).contains(value))
            .collect()
    }
}

/// Returns the smallest and largest of the finite values.
pub fn range(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    values.into_iter().filter(|value| value.is_finite()).fold(None, |range, value| {
        let (low, high) = range.unwrap_or((value, value));
        Some((low.min(value), high.max(value)))
    })
}

/// Estimates the width of a tick's label, without font metrics.
fn label_px(words: &str) -> f64 {
    0.57 * SMALL_PX * words.chars().count() as f64
}

/// Formats a number for a label, rounded to at most three decimals.
pub fn rounded(value: f64) -> String {
    // Adding 0.0 turns −0 into 0.
    let value = (value * 1e3).round() / 1e3 + 0.0;
    value.to_string().replace('-', "−")
}

/// Rectangle with two axes.
#[derive(Clone)]
pub struct Panel {
    /// Rectangle of the data.
    pub area: Area,
    /// Horizontal axis, to the right.
    pub x: Axis,
    /// Vertical axis, upwards.
    pub y: Axis,
}

impl Panel {
    /// Creates a panel that fits into the top left of `most`, with the same scale on both axes. A
    /// side that would be too short for a label shows a larger range of its axis.
    pub fn equal(most: Area, x: Axis, y: Axis) -> Self {
        const LEAST_PX: f64 = 90.0;
        let lengths = [&x, &y].map(|axis| axis.high - axis.low);
        let px_per_unit = (most.width / lengths[0]).min(most.height / lengths[1]);
        let [width, height] = lengths.map(|length| (length * px_per_unit).max(LEAST_PX));
        let stretched = |axis: Axis, side_px: f64| {
            let length = axis.high - axis.low;
            let times = side_px / px_per_unit / length;
            let [middle, half] = [0.5 * (axis.low + axis.high), 0.5 * times * length];
            Axis { low: middle - half, high: middle + half, ..axis }
        };
        let (x, y) = (stretched(x, width), stretched(y, height));
        Self { area: Area { width, height, ..most }, x, y }
    }

    /// Returns the position of a value in the drawing.
    pub fn at(&self, x: f64, y: f64) -> PointPx {
        [
            self.area.left + self.x.fraction(x) * self.area.width,
            self.area.bottom() - self.y.fraction(y) * self.area.height,
        ]
    }

    /// Draws grid lines, ticks and frame.
    pub fn frame(&self, canvas: &mut Canvas) {
        let Area { left, top, .. } = self.area;
        let (right, bottom) = (self.area.right(), self.area.bottom());
        for (value, label) in self.x.ticks_along(self.area.width, label_px) {
            let x = self.at(value, 0.0)[0];
            canvas.line([[x, top], [x, bottom]], &style::stroke(GRID, 1.0));
            canvas.text([x, bottom + 16.0], &label, SMALL_PX, Anchor::Middle);
        }
        for (value, label) in self.y.ticks_along(self.area.height, |_| SMALL_PX) {
            let y = self.at(0.0, value)[1];
            canvas.line([[left, y], [right, y]], &style::stroke(GRID, 1.0));
            canvas.text([left - 7.0, y + 4.0], &label, SMALL_PX, Anchor::End);
        }
        canvas.rect(self.area, &style::stroke(FAINT_INK, 1.0));
    }

    /// Draws grid lines, ticks and frame with a title and the names of the axes, unless they are
    /// empty.
    pub fn titled_frame(&self, canvas: &mut Canvas, title: &str, x: &str, y: &str) {
        self.frame(canvas);
        canvas.title([self.area.centre()[0], self.area.top - 9.0], title);
        self.name_axes(canvas, x, y);
    }

    /// Draws the names of the axes.
    pub fn name_axes(&self, canvas: &mut Canvas, x: &str, y: &str) {
        let [centre_x, centre_y] = self.area.centre();
        canvas.text([centre_x, self.area.bottom() + 35.0], x, TEXT_PX, Anchor::Middle);
        canvas.upward_text([self.area.left - 46.0, centre_y], y, TEXT_PX, INK);
    }

    /// Draws a line through values, clipped to the frame. A value that is not finite starts a new
    /// line; a single value is a dot.
    pub fn curve(&self, canvas: &mut Canvas, values: &[(f64, f64)], attributes: &str) {
        canvas.clipped(self.area, |canvas| {
            for part in values.split(|(_, y)| !y.is_finite()) {
                match part {
                    [] => {}
                    &[(x, y)] => canvas.circle(self.at(x, y), 2.0, attributes),
                    part => canvas.line(part.iter().map(|&(x, y)| self.at(x, y)), attributes),
                }
            }
        });
    }

    /// Draws the area between two curves over the same places (x, low, high), clipped to the frame,
    /// with gaps where they are not finite. A single place is a bar.
    pub fn band(&self, canvas: &mut Canvas, values: &[(f64, f64, f64)], colour: &str) {
        canvas.clipped(self.area, |canvas| {
            for part in values.split(|(_, low, high)| !(low + high).is_finite()) {
                let upper = part.iter().map(|&(x, _, high)| self.at(x, high));
                let lower = part.iter().rev().map(|&(x, low, _)| self.at(x, low));
                let outline = upper.chain(lower);
                match part.len() {
                    0 => {}
                    1 => canvas.line(outline, &style::stroke(colour, 1.2)),
                    _ => canvas.polygon(outline, &style::fill(colour, style::BAND_OPACITY)),
                }
            }
        });
    }
}

/// Room beside a colour bar for half a number, and above it for its name.
const BAR_ROOM_PX: [f64; 2] = [18.0, 18.0];

/// Draws a [`colour_bar`] of heights above the datum, labelled in `unit`.
pub fn height_bar(canvas: &mut Canvas, area: Area, unit: Length, heights_m: [f64; 2]) {
    let [low, high] = heights_m.map(|height_m| height_m * unit.per_m);
    let (axis, words) = (Axis::linear(low, high, 6.0), unit.named("height above the datum"));
    colour_bar(canvas, area, &axis, &words, |t| style::height(t, 1.0));
}

/// Draws a horizontal bar of colours with its scale below and its name above.
pub fn colour_bar(
    canvas: &mut Canvas,
    area: Area,
    axis: &Axis,
    words: &str,
    colour: impl Fn(f64) -> String,
) {
    const STEPS: usize = 64;
    let [left, top] = [area.left - BAR_ROOM_PX[0], area.top - BAR_ROOM_PX[1]];
    let (width, height) = (area.width + 2.0 * BAR_ROOM_PX[0], area.height + 2.3 * BAR_ROOM_PX[1]);
    canvas.part(PartKind::Key, Area { left, top, width, height });
    for i in 0..STEPS {
        let width = area.width / STEPS as f64;
        let step = Area { left: area.left + i as f64 * width, width, ..area };
        let attributes = style::fill(&colour((i as f64 + 0.5) / STEPS as f64), 1.0);
        canvas.rect(step, &(attributes + r#" shape-rendering="crispEdges""#));
    }
    canvas.rect(area, &style::stroke(FAINT_INK, 0.8));
    for (value, label) in axis.ticks() {
        let x = area.left + axis.fraction(value) * area.width;
        canvas.line([[x, area.bottom()], [x, area.bottom() + 4.0]], &style::stroke(INK, 0.8));
        canvas.text([x, area.bottom() + 17.0], &label, SMALL_PX, Anchor::Middle);
    }
    canvas.text([area.centre()[0], area.top - 5.0], words, TEXT_PX, Anchor::Middle);
}
