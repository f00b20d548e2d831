//! Performance profiles: which share of the trials has how small an error.

use super::axes::{Axis, Panel};
use super::canvas::{Area, Canvas};
use super::legend::{Legend, Swatch};
use super::style;
use super::style::FAINT_INK;
use crate::study::compare::{Compared, profile};

const PANEL_PX: Area = Area { left: 70.0, top: 60.0, width: 460.0, height: 300.0 };

/// Steps of a curve; chosen, finer than the eye.
const STEPS: u32 = 300;

/// Draws them; none without a score.
pub fn draw(compared: &Compared, against: &str) -> Option<String> {
    let Sheet { mut canvas, area, strokes } = Sheet::new(compared, PANEL_PX);
    let scores = compared.contenders.iter().flat_map(|it| it.scores.iter().flatten().copied());
    let x = Axis::log(scores.chain([1.0]))?;
    let (low, high) = x.range();
    let panel = Panel { area, x, y: Axis::linear(0.0, 1.0, 6.0) };
    panel.frame(&mut canvas);
    canvas.line([panel.at(1.0, 0.0), panel.at(1.0, 1.0)], &style::dashed(FAINT_INK, 1.0, "4 3"));
    for (contender, stroke) in compared.contenders.iter().zip(&strokes) {
        let at = |i: u32| low * (high / low).powf(f64::from(i) / f64::from(STEPS));
        let curve: Vec<(f64, f64)> =
            (0..=STEPS).map(|i| (at(i), profile(contender, at(i)))).collect();
        panel.curve(&mut canvas, &curve, stroke);
    }
    panel.name_axes(
        &mut canvas,
        &format!("error over the touches, in units of {against}'s"),
        "share of the trials",
    );
    Some(canvas.finish())
}

/// A drawing of one panel with a curve for each contender, whose names stand above it.
pub(super) struct Sheet {
    pub(super) canvas: Canvas,
    /// Of the panel, below the names.
    pub(super) area: Area,
    /// Of each contender's curve.
    pub(super) strokes: Vec<String>,
}

impl Sheet {
    /// With room for a panel of this size and its axes.
    pub(super) fn new(compared: &Compared, panel_px: Area) -> Self {
        let names: Vec<String> = compared.contenders.iter().map(|it| it.name.clone()).collect();
        let stroke = |name: &String| style::stroke(style::planner(&names, name), 2.0);
        let strokes: Vec<String> = names.iter().map(stroke).collect();
        let swatches = strokes.iter().cloned().map(Swatch::Line);
        let legend = Legend::new(panel_px.width, swatches.zip(names.iter().map(String::as_str)));
        let area = Area { top: panel_px.top + legend.more_px(), ..panel_px };
        let mut canvas = Canvas::new(area.right() + 20.0, area.bottom() + 50.0);
        legend.draw(&mut canvas, [area.left, 22.0]);
        Self { canvas, area, strokes }
    }
}
