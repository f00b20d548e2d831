//! Reliability: of the places that are given a probability of a surface, how many have one.

use super::axes::{Axis, Panel};
use super::canvas::{Area, Canvas};
use super::legend::{Legend, Swatch};
use super::style;
use super::style::FAINT_INK;
use crate::experiment::outline::TENTHS;
use crate::study::compare::{Compared, Contender};

const PANEL_PX: Area = Area { left: 70.0, top: 60.0, width: 300.0, height: 300.0 };

/// Places that a point stands for at least, over all objects and trials; chosen.
const PLACES_MIN: u32 = 50;

/// Draws a curve for each planner, over all objects; none where every object fills its zone.
pub fn draw(compared: &Compared) -> Option<String> {
    let names: Vec<String> = compared.contenders.iter().map(|it| it.name.clone()).collect();
    let curves: Vec<Vec<(f64, f64)>> = compared.contenders.iter().map(curve).collect();
    if curves.iter().all(Vec::is_empty) {
        return None;
    }
    let colours: Vec<_> = names.iter().map(|name| style::planner(&names, name)).collect();
    let swatch = |colour: &&'static str| Swatch::Line(style::stroke(colour, 2.0));
    let entries = names.iter().zip(&colours).map(|(name, colour)| (swatch(colour), name.as_str()));
    let legend = Legend::new(PANEL_PX.width, entries);
    let area = Area { top: PANEL_PX.top + legend.more_px(), ..PANEL_PX };
    let mut canvas = Canvas::new(area.right() + 20.0, area.bottom() + 50.0);
    legend.draw(&mut canvas, [area.left, 22.0]);
    let axis = || Axis::linear(0.0, 1.0, 6.0);
    let panel = Panel { area, x: axis(), y: axis() };
    panel.frame(&mut canvas);
    canvas.line([panel.at(0.0, 0.0), panel.at(1.0, 1.0)], &style::dashed(FAINT_INK, 1.0, "4 3"));
    for (curve, colour) in curves.iter().zip(&colours) {
        panel.curve(&mut canvas, curve, &style::stroke(colour, 2.0));
    }
    panel.name_axes(&mut canvas, "probability of a surface, in tenths", "share that has one");
    Some(canvas.finish())
}

/// The middle of each tenth, and the share of its places that have a surface.
fn curve(contender: &Contender) -> Vec<(f64, f64)> {
    let counts = |tenth: usize| {
        let counts = contender.said.iter().map(|said| said.reliability[tenth]);
        counts.fold([0, 0], |[all, there], [more, of_them]| [all + more, there + of_them])
    };
    let told = (0..TENTHS).map(|tenth| (tenth, counts(tenth)));
    told.filter(|(_, [all, _])| *all >= PLACES_MIN)
        .map(|(tenth, [all, there])| {
            ((tenth as f64 + 0.5) / TENTHS as f64, f64::from(there) / f64::from(all))
        })
        .collect()
}
