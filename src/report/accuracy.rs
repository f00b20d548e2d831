//! The cost of accuracy: errors of the levels over wall time, their fall with the resolution, and
//! the effects one by one.

use super::axes::{Axis, Panel};
use super::canvas::{Anchor, Area, Canvas};
use super::legend::{Legend, Swatch};
use super::style;
use super::style::{FAINT_INK, INK, PAPER, SMALL_PX};
use crate::experiment::statistics::mean;
use crate::study::accuracy::convergence::Order;
use crate::study::accuracy::deviation::Spread;
use crate::study::accuracy::level::{Level, Senses};
use crate::study::accuracy::levels::Levels;
use crate::study::accuracy::variant::Variant;

/// The colour and name of a level, by Okabe and Ito; those of a shell are the fourth.
const FAMILIES: [(&str, &str); 5] = [
    ("#000000", "rigid"),
    ("#e69f00", "soft skin"),
    ("#56b4e9", "and fluid"),
    ("#0072b2", "and electrodes"),
    ("#009e73", "the same, a thin shell"),
];

/// A number of a variant with its interval.
type Bar = (f64, [f64; 2]);

const PANEL_PX: (f64, f64) = (350.0, 270.0);
const LEFT_PX: f64 = 74.0;
const STEP_PX: f64 = 446.0;
const ROW_PX: f64 = 354.0;
const TOP_PX: f64 = 66.0;
/// Height of an effect's line, and room for its name.
const LINE_PX: f64 = 18.0;
const NAME_PX: f64 = 140.0;

/// Draws the figure; `None` without a variant that differs from its reference.
pub fn draw(levels: &Levels, effects: &[Variant]) -> Option<String> {
    let rows = if levels.variants.is_empty() { 0.0 } else { 2.0 };
    let lines_px = effects.len() as f64 * LINE_PX;
    let effects_px = if effects.is_empty() { 0.0 } else { lines_px + 84.0 };
    let height_px = TOP_PX + rows * ROW_PX + effects_px - 30.0;
    let mut canvas = Canvas::new(LEFT_PX + 3.0 * STEP_PX - 60.0, height_px);
    if rows > 0.0 {
        draw_levels(&mut canvas, levels)?;
    }
    if !effects.is_empty() {
        let top = TOP_PX + rows * ROW_PX;
        draw_effects(&mut canvas, effects, Area { top, height: lines_px, ..area(0, 0) })?;
    }
    Some(canvas.finish())
}

fn draw_levels(canvas: &mut Canvas, levels: &Levels) -> Option<()> {
    let entries: Vec<_> = (FAMILIES.iter())
        .map(|(colour, words)| (Swatch::Circle(point(colour)), *words))
        .chain([
            (Swatch::Diamond(INK), "the scene as it is"),
            (Swatch::Line(style::dashed(INK, 1.3, "5 3")), "front"),
            (Swatch::Line(reference_line()), "time of the reference"),
        ])
        .collect();
    Legend::new(LEFT_PX + 2.0 * STEP_PX + PANEL_PX.0, entries).draw(canvas, [LEFT_PX, 20.0]);
    draw_cost(canvas, levels, (0, 1e-3, "contact off the reference's (mm)"), |it| it.contact_m)?;
    draw_cost(canvas, levels, (1, 1.0, "force off the reference's (N)"), |it| it.force_n)?;
    draw_cost(canvas, levels, (2, 1e-3, "contact off the true surface (mm)"), |it| it.off_truth_m)?;
    for (column, order) in levels.orders.iter().enumerate() {
        draw_order(canvas, order, area(column, 1));
    }
    Some(())
}

fn area(column: usize, row: usize) -> Area {
    let left = LEFT_PX + column as f64 * STEP_PX;
    let top = TOP_PX + row as f64 * ROW_PX;
    Area { left, top, width: PANEL_PX.0, height: PANEL_PX.1 }
}

fn colour(level: &Level) -> &'static str {
    match (level.senses, level.shell) {
        (_, Some(_)) => FAMILIES[4].0,
        (Senses::Rigid, _) => FAMILIES[0].0,
        (Senses::Dry, _) => FAMILIES[1].0,
        (Senses::Fluid, _) => FAMILIES[2].0,
        (Senses::Full, _) => FAMILIES[3].0,
    }
}

/// Draws an error over the wall time of a touch.
fn draw_cost(
    canvas: &mut Canvas,
    levels: &Levels,
    (column, unit, words): (usize, f64, &str),
    measure: fn(&Variant) -> Option<Spread>,
) -> Option<()> {
    let area = area(column, 0);
    let is_reference = |it: &Variant| it.level.is_some_and(|level| level.is_reference());
    let mut points: Vec<(f64, Bar, Option<Level>)> = (levels.variants.iter())
        .filter(|variant| !is_reference(variant))
        .filter_map(|variant| {
            let spread = measure(variant)?;
            let bar = (spread.mean / unit, spread.interval.map(|value| value / unit));
            Some((1e3 * variant.wall_s?, bar, variant.level))
        })
        .collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let ends =
        points.iter().flat_map(|(_, (mean, [low, high]), _)| [low.max(0.3 * mean), *high, *mean]);
    let times_ms = levels.variants.iter().filter_map(|variant| Some(1e3 * variant.wall_s?));
    let panel = Panel { area, x: Axis::log(times_ms)?, y: Axis::log(ends)? };
    panel.frame(canvas);
    panel.label(canvas, "", "wall time of a touch (ms)", words);
    canvas.clipped(area, |canvas| {
        let mut least = f64::INFINITY;
        let front = points.iter().filter(|(_, (error, _), _)| {
            let is_better = *error > 0.0 && *error < least;
            least = if is_better { *error } else { least };
            is_better
        });
        let corners: Vec<_> = front.map(|(time, (error, _), _)| panel.at(*time, *error)).collect();
        canvas.line(corners, &style::dashed(INK, 1.3, "5 3"));
        for (time_ms, (error, interval), level) in &points {
            let colour = level.as_ref().map_or(INK, colour);
            let ends = interval.map(|value| panel.at(*time_ms, value.max(1e-9)));
            canvas.line(ends, &style::stroke(colour, 1.2));
            match level {
                Some(_) => canvas.circle(panel.at(*time_ms, *error), 3.6, &point(colour)),
                None => canvas.diamond(panel.at(*time_ms, *error), &style::stroke(INK, 1.3)),
            }
        }
        for variant in levels.variants.iter().filter(|variant| is_reference(variant)) {
            let x = panel.at(1e3 * variant.wall_s.unwrap_or(f64::NAN), 1.0)[0];
            canvas.line([[x, area.top], [x, area.bottom()]], &reference_line());
        }
    });
    Some(())
}

fn draw_order(canvas: &mut Canvas, order: &Order, area: Area) {
    let (x, y): (Vec<f64>, Vec<f64>) = order.errors.iter().copied().unzip();
    let (Some(x_axis), Some(y_axis)) = (Axis::log(x), Axis::log(y)) else { return };
    let panel = Panel { area, x: x_axis, y: y_axis };
    panel.frame(canvas);
    let words = format!("order {:.2}; dashed: {}", order.observed, order.expected);
    panel.label(canvas, &words, order.axis, "mean error of the force (N)");
    // The line of the expected order through the middle of the measured points.
    let logs: Vec<f64> = (order.errors.iter())
        .map(|(at, error)| error.ln() + order.expected * at.ln())
        .filter(|log| log.is_finite())
        .collect();
    let middle = mean(&logs);
    let line: Vec<(f64, f64)> = (order.errors.iter())
        .map(|(at, _)| (*at, (middle - order.expected * at.ln()).exp()))
        .collect();
    panel.curve(canvas, &line, &style::dashed(FAINT_INK, 1.3, "5 3"));
    for (at, error) in &order.errors {
        canvas.circle(panel.at(*at, *error), 3.6, &point(FAMILIES[4].0));
    }
}

/// Draws each effect as a line: how far contacts move, the time of a touch, and the verdict's change.
fn draw_effects(canvas: &mut Canvas, effects: &[Variant], first: Area) -> Option<()> {
    let percent = |ratio: f64| 100.0 * (ratio - 1.0);
    let contact_mm = |variant: &Variant| -> Option<Bar> {
        let spread = variant.contact_m?;
        Some((1e3 * spread.mean, spread.interval.map(|m| 1e3 * m)))
    };
    let time = |variant: &Variant| -> Option<Bar> {
        let ratio = variant.time_ratio?;
        Some((percent(ratio), variant.time_ratio_interval.unwrap_or([ratio; 2]).map(percent)))
    };
    let verdict_mm = |variant: &Variant| -> Option<Bar> {
        let change = variant.verdict_change_m?;
        Some((1e3 * change.mean, change.interval.unwrap_or([change.mean; 2]).map(|m| 1e3 * m)))
    };
    let panels: [(&dyn Fn(&Variant) -> Option<Bar>, &str); 3] = [
        (&contact_mm, "contact moves (mm)"),
        (&time, "time of a touch changes (%)"),
        (&verdict_mm, "active − random RMSE changes (mm)"),
    ];
    for (column, (bar, words)) in panels.into_iter().enumerate() {
        let inset = if column == 0 { NAME_PX } else { 0.0 };
        let left = first.left + column as f64 * STEP_PX + inset;
        let area = Area { left, width: first.width - inset, ..first };
        let bars = effects.iter().filter_map(bar);
        let ends = bars.flat_map(|(_, interval)| interval).chain([0.0]);
        // So few ticks that there are none: the lines have names.
        let y = Axis::linear(0.5, effects.len() as f64 + 0.5, 1e-6);
        let panel = Panel { area, x: Axis::around(ends, 0.05, 5.0)?, y };
        panel.frame(canvas);
        panel.label(canvas, "", words, "");
        for (line, variant) in effects.iter().enumerate() {
            let y = (effects.len() - line) as f64;
            if column == 0 {
                let at = [area.left - 7.0, panel.at(0.0, y)[1] + 4.0];
                canvas.text(at, &variant.name, SMALL_PX, Anchor::End);
            }
            if let Some((value, interval)) = bar(variant) {
                canvas.line(interval.map(|x| panel.at(x, y)), &style::stroke(INK, 1.2));
                canvas.circle(panel.at(value, y), 3.6, &point(FAMILIES[3].0));
            }
        }
    }
    Some(())
}

fn reference_line() -> String {
    style::dashed(FAINT_INK, 1.0, "2 3")
}

fn point(colour: &str) -> String {
    format!(r#"fill="{colour}" stroke="{PAPER}" stroke-width=".7""#)
}
