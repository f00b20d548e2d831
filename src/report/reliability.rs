//! Reliability: of the places that are given a probability of a surface, how many have one.

use super::axes::{Axis, Panel};
use super::canvas::Area;
use super::compare::Sheet;
use super::style;
use super::style::FAINT_INK;
use crate::experiment::measure::outline::TENTHS;
use crate::study::compare::{Compared, Contender};

const PANEL_PX: Area = Area { left: 70.0, top: 60.0, width: 300.0, height: 300.0 };

/// Places that a point stands for at least, over all objects and trials; chosen.
const PLACES_MIN: u32 = 50;

/// Draws a curve for each planner, over all objects; none where every object fills its zone.
pub fn draw(compared: &Compared) -> Option<String> {
    let curves: Vec<Vec<(f64, f64)>> = compared.contenders.iter().map(curve).collect();
    if curves.iter().all(Vec::is_empty) {
        return None;
    }
    let Sheet { mut canvas, area, strokes } = Sheet::new(compared, PANEL_PX);
    let axis = || Axis::linear(0.0, 1.0, 6.0);
    let panel = Panel { area, x: axis(), y: axis() };
    panel.frame(&mut canvas);
    canvas.line([panel.at(0.0, 0.0), panel.at(1.0, 1.0)], &style::dashed(FAINT_INK, 1.0, "4 3"));
    for (curve, stroke) in curves.iter().zip(&strokes) {
        panel.curve(&mut canvas, curve, stroke);
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
