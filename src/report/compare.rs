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
    let names: Vec<String> = compared.contenders.iter().map(|it| it.name.clone()).collect();
    let colours: Vec<_> = names.iter().map(|name| style::planner(&names, name)).collect();
    let swatch = |colour: &&'static str| Swatch::Line(style::stroke(colour, 2.0));
    let entries = names.iter().zip(&colours).map(|(name, colour)| (swatch(colour), name.as_str()));
    let legend = Legend::new(PANEL_PX.width, entries);
    let area = Area { top: PANEL_PX.top + legend.more_px(), ..PANEL_PX };
    let mut canvas = Canvas::new(area.right() + 20.0, area.bottom() + 50.0);
    legend.draw(&mut canvas, [area.left, 22.0]);
    let scores = compared.contenders.iter().flat_map(|it| it.scores.iter().flatten().copied());
    let x = Axis::log(scores.chain([1.0]))?;
    let (low, high) = x.range();
    let panel = Panel { area, x, y: Axis::linear(0.0, 1.0, 6.0) };
    panel.frame(&mut canvas);
    canvas.line([panel.at(1.0, 0.0), panel.at(1.0, 1.0)], &style::dashed(FAINT_INK, 1.0, "4 3"));
    for (contender, colour) in compared.contenders.iter().zip(&colours) {
        let at = |i: u32| low * (high / low).powf(f64::from(i) / f64::from(STEPS));
        let curve: Vec<(f64, f64)> =
            (0..=STEPS).map(|i| (at(i), profile(contender, at(i)))).collect();
        panel.curve(&mut canvas, &curve, &style::stroke(colour, 2.0));
    }
    panel.name_axes(
        &mut canvas,
        &format!("error over the touches, in units of {against}'s"),
        "share of the trials",
    );
    Some(canvas.finish())
}
