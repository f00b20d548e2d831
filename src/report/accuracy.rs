//! Figures on the cost of accuracy: errors of the levels over wall time, convergence with the
//! resolution, and the effects one by one.

use super::axes::{Axis, Panel};
use super::canvas::{Anchor, Area, Canvas};
use super::legend::{FigureLayout, Swatch};
use super::style::{self, FAINT_INK, INK, SMALL_PX, dot};
use crate::experiment::statistics::mean;
use crate::study::accuracy::comparison::AccuracyComparison;
use crate::study::accuracy::convergence::ConvergenceOrder;
use crate::study::accuracy::deviation::ErrorStatistics;
use crate::study::accuracy::level::FidelityLevel;
use crate::study::accuracy::variant::Variant;

/// Colours (Okabe and Ito 2008) and names of the sensing levels of a model, and of a thin shell.
const FAMILIES: [(&str, &str); 5] = [
    ("#000000", "rigid"),
    ("#e69f00", "soft skin"),
    ("#56b4e9", "and fluid"),
    ("#0072b2", "and electrodes"),
    ("#009e73", "electrodes, thin shell"),
];

/// Value of a variant with its interval.
type Bar = (f64, [f64; 2]);

const PANEL_PX: (f64, f64) = (350.0, 270.0);
const LEFT_PX: f64 = 74.0;
const STEP_PX: f64 = 446.0;
const ROW_PX: f64 = 354.0;
const TOP_PX: f64 = 66.0;
/// Height of the row of an effect, and width of its name.
const LINE_PX: f64 = 18.0;
const NAME_PX: f64 = 140.0;

/// Error of a variant, with its unit and name.
type Measure = (fn(&Variant) -> Option<ErrorStatistics>, f64, &'static str);

const ERRORS: [Measure; 3] = [
    (|it| it.contact_m, 1e-3, "contact error against reference (mm)"),
    (|it| it.force_n, 1.0, "force error against reference (N)"),
    (|it| it.off_truth_m, 1e-3, "contact error against true surface (mm)"),
];

/// Draws the levels and effects that were compared; `None` if no variant differs from its
/// reference.
pub fn draw(
    levels: Option<&AccuracyComparison>,
    orders: &[ConvergenceOrder],
    effects: Option<&AccuracyComparison>,
) -> Option<String> {
    let top_px = if levels.is_some() { TOP_PX + 2.0 * ROW_PX } else { TOP_PX };
    let lines_px = effects.map_or(0.0, |effects| effects.variants.len() as f64 * LINE_PX);
    let bottom_px = if effects.is_some() { 54.0 } else { -30.0 };
    let size = [LEFT_PX + 3.0 * STEP_PX - 60.0, top_px + lines_px + bottom_px];
    let families = FAMILIES.iter().map(|(colour, words)| (Swatch::Circle(dot(colour)), *words));
    let entries = families.chain([
        (Swatch::Diamond(INK), "the scene"),
        (Swatch::Line(style::dashed(INK, 1.3, "5 3")), "Pareto front"),
        (Swatch::Line(reference_line()), "time of the reference"),
    ]);
    let first = Area { left: LEFT_PX, top: TOP_PX, width: PANEL_PX.0, height: PANEL_PX.1 };
    let entries = entries.filter(|_| levels.is_some());
    let mut sheet = FigureLayout::new(size, first, [STEP_PX, ROW_PX], size[0], "", entries);
    if let Some(levels) = levels {
        for (column, error) in ERRORS.into_iter().enumerate() {
            let area = sheet.area(column, 0.0);
            draw_cost(&mut sheet.canvas, area, levels, error)?;
        }
    }
    for (column, order) in orders.iter().enumerate() {
        let area = sheet.area(column, 1.0);
        draw_order(&mut sheet.canvas, order, area);
    }
    if let Some(effects) = effects {
        let first = Area { top: top_px, height: lines_px, ..first };
        draw_effects(&mut sheet.canvas, &effects.variants, first)?;
    }
    Some(sheet.canvas.finish())
}

fn colour(level: &FidelityLevel) -> &'static str {
    let family = if level.shell.is_some() { 4 } else { level.senses as usize };
    FAMILIES[family].0
}

/// Draws an error over the wall time of a touch.
fn draw_cost(
    canvas: &mut Canvas,
    area: Area,
    levels: &AccuracyComparison,
    (measure, unit, words): Measure,
) -> Option<()> {
    let mut points: Vec<(f64, Bar, &Variant)> = (levels.variants.iter())
        .filter_map(|variant| Some((1e3 * variant.wall_s?, bar(measure(variant)?, unit), variant)))
        .collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let ends =
        points.iter().flat_map(|(_, (mean, [low, high]), _)| [low.max(0.3 * mean), *high, *mean]);
    let reference_ms = 1e3 * levels.reference.wall_s?;
    let times_ms = points.iter().map(|(time_ms, ..)| *time_ms).chain([reference_ms]);
    let panel = Panel { area, x: Axis::log(times_ms)?, y: Axis::log(ends)? };
    panel.titled_frame(canvas, "", "wall time of a touch (ms)", words);
    canvas.clipped(area, |canvas| {
        let mut least = f64::INFINITY;
        let mut corners = Vec::new();
        for (time_ms, (error, interval), variant) in &points {
            if *error > 0.0 && *error < least {
                least = *error;
                corners.push(panel.at(*time_ms, least));
            }
            let colour = variant.level.as_ref().map_or(INK, colour);
            let ends = interval.map(|value| panel.at(*time_ms, value.max(1e-9)));
            canvas.line(ends, &style::stroke(colour, 1.2));
            match variant.level {
                Some(_) => canvas.circle(panel.at(*time_ms, *error), 3.6, &dot(colour)),
                None => canvas.diamond(panel.at(*time_ms, *error), &style::stroke(INK, 1.3)),
            }
        }
        canvas.line(corners, &style::dashed(INK, 1.3, "5 3"));
        let x = panel.at(reference_ms, 1.0)[0];
        canvas.line([[x, area.top], [x, area.bottom()]], &reference_line());
    });
    Some(())
}

fn draw_order(canvas: &mut Canvas, order: &ConvergenceOrder, area: Area) {
    let (x, y): (Vec<f64>, Vec<f64>) = order.errors.iter().copied().unzip();
    let (Some(x_axis), Some(y_axis)) = (Axis::log(x), Axis::log(y)) else { return };
    let panel = Panel { area, x: x_axis, y: y_axis };
    let words = format!("order {:.2}; dashed: {}", order.observed, order.expected);
    panel.titled_frame(canvas, &words, order.axis, "mean error of the force (N)");
    // Line of the expected order through the middle of the measured points.
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
        canvas.circle(panel.at(*at, *error), 3.6, &dot(FAMILIES[4].0));
    }
}

/// Value of a variant and the title of its panel.
type TitledBar<'a> = (&'a dyn Fn(&Variant) -> Option<Bar>, &'a str);

/// Draws a row for each effect: the shift of contacts, the time of a touch, and the change of the
/// verdict.
fn draw_effects(canvas: &mut Canvas, effects: &[Variant], first: Area) -> Option<()> {
    let time = |variant: &Variant| -> Option<Bar> {
        let ratio = variant.time_ratio?;
        let interval = variant.time_ratio_interval.unwrap_or([ratio; 2]);
        Some((100.0 * (ratio - 1.0), interval.map(|ratio| 100.0 * (ratio - 1.0))))
    };
    let verdict_mm = |variant: &Variant| -> Option<Bar> {
        let change = variant.verdict_change_m?;
        Some((1e3 * change.mean, change.interval.unwrap_or([change.mean; 2]).map(|m| 1e3 * m)))
    };
    let panels: [TitledBar; 3] = [
        (&|variant| Some(bar(variant.contact_m?, 1e-3)), "shift of the contact (mm)"),
        (&time, "change of the time of a touch (%)"),
        (&verdict_mm, "change of RMSE, active − random (mm)"),
    ];
    for (column, (measure, words)) in panels.into_iter().enumerate() {
        let inset = if column == 0 { NAME_PX } else { 0.0 };
        let left = first.left + column as f64 * STEP_PX + inset;
        let area = Area { left, width: first.width - inset, ..first };
        let bars = effects.iter().filter_map(measure);
        let ends = bars.flat_map(|(_, interval)| interval).chain([0.0]);
        // No ticks, because the rows have names.
        let y = Axis::linear(0.5, effects.len() as f64 + 0.5, 1e-6);
        let panel = Panel { area, x: Axis::around(ends, 0.05, 5.0)?, y };
        panel.titled_frame(canvas, "", words, "");
        for (line, variant) in effects.iter().enumerate() {
            let y = (effects.len() - line) as f64;
            if column == 0 {
                let at = [area.left - 7.0, panel.at(0.0, y)[1] + 4.0];
                canvas.text(at, &variant.name, SMALL_PX, Anchor::End);
            }
            if let Some((value, interval)) = measure(variant) {
                canvas.line(interval.map(|x| panel.at(x, y)), &style::stroke(INK, 1.2));
                canvas.circle(panel.at(value, y), 3.6, &dot(FAMILIES[3].0));
            }
        }
    }
    Some(())
}

fn bar(spread: ErrorStatistics, unit: f64) -> Bar {
    (spread.mean / unit, spread.interval.map(|value| value / unit))
}

fn reference_line() -> String {
    style::dashed(FAINT_INK, 1.0, "2 3")
}
