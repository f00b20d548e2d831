//! What accuracy costs: errors over wall time, and how they fall with the resolution.

use super::axes::{Axis, Panel};
use super::canvas::{Area, Canvas};
use super::legend::{Legend, Swatch};
use super::style;
use super::style::{FAINT_INK, INK, PAPER};
use crate::study::fidelity::comparison::LadderComparison;
use crate::study::fidelity::ladder::is_reference;
use crate::study::fidelity::order::Order;
use crate::study::fidelity::rung::{Rung, Senses};
use crate::study::fidelity::rung_result::RungResult;
use crate::study::fidelity::spread::Spread;
use crate::study::fidelity::step_in_contact;

/// Whether a rung simulates this, its colour, as of Okabe and Ito, and its name.
type RungFamily = (fn(&Rung) -> bool, &'static str, &'static str);

/// The first that fits counts.
const FAMILIES: [RungFamily; 5] = [
    (|rung| rung.senses == Senses::None, "#000000", "rigid"),
    (|rung| rung.senses == Senses::Dry, "#e69f00", "soft skin"),
    (|rung| rung.senses == Senses::Fluid, "#56b4e9", "and fluid"),
    (|rung| rung.shell.is_some(), "#009e73", "the same, a thin shell"),
    (|_| true, "#0072b2", "and electrodes"),
];

/// An error that is drawn over the time of a touch.
type RungError = fn(&RungResult) -> Option<Spread>;

const PANEL_PX: (f64, f64) = (350.0, 270.0);
const LEFT_PX: f64 = 74.0;
const STEP_PX: f64 = 446.0;
const TOPS_PX: [f64; 2] = [66.0, 420.0];

/// The figure; none without a row that differs from the reference.
pub fn draw(ladder: &LadderComparison) -> Option<String> {
    let mut canvas = Canvas::new(LEFT_PX + 3.0 * STEP_PX - 60.0, TOPS_PX[1] + PANEL_PX.1 + 54.0);
    let entries: Vec<_> = (FAMILIES.iter())
        .map(|(_, colour, words)| (Swatch::Circle(point(colour)), *words))
        .chain([
            (Swatch::Line(style::dashed(INK, 1.3, "5 3")), "front"),
            (Swatch::Line(reference_line()), "time of the reference"),
        ])
        .collect();
    Legend::new(LEFT_PX + 2.0 * STEP_PX + PANEL_PX.0, entries).draw(&mut canvas, [LEFT_PX, 20.0]);
    let measures: [(RungError, f64, &str); 3] = [
        (|row| row.off_reference_m, 1e-3, "contact off the reference's (mm)"),
        (|row| row.force_n, 1.0, "force off the reference's (N)"),
        (|row| row.off_truth_m, 1e-3, "contact off the true surface (mm)"),
    ];
    for (column, (measure, unit, words)) in measures.into_iter().enumerate() {
        let panel_area = area(column, 0);
        cost(&mut canvas, ladder, panel_area, (measure, unit), words)?;
    }
    for (column, order) in ladder.orders.iter().enumerate() {
        convergence(&mut canvas, order, area(column, 1));
    }
    Some(canvas.finish())
}

fn area(column: usize, row: usize) -> Area {
    let left = LEFT_PX + column as f64 * STEP_PX;
    Area { left, top: TOPS_PX[row], width: PANEL_PX.0, height: PANEL_PX.1 }
}

fn cost(
    canvas: &mut Canvas,
    ladder: &LadderComparison,
    area: Area,
    (measure, unit): (RungError, f64),
    words: &str,
) -> Option<()> {
    let error = |row: &RungResult| measure(row).filter(|_| !is_reference(&row.rung));
    let rows: Vec<(&RungResult, Spread)> =
        ladder.rows.iter().filter_map(|row| Some((row, error(row)?))).collect();
    let ends = rows.iter().flat_map(|(_, spread)| {
        let [low, high] = spread.interval;
        [low.max(0.3 * spread.mean), high, spread.mean].map(|value| value / unit)
    });
    let panel = Panel {
        area,
        x: Axis::log(ladder.rows.iter().map(|row| 1e3 * row.wall_s))?,
        y: Axis::log(ends)?,
    };
    panel.frame(canvas);
    panel.label(canvas, "", "wall time of a touch (ms)", words);
    let at = |row: &RungResult, value: f64| panel.at(1e3 * row.wall_s, value / unit);
    canvas.clipped(area, |canvas| {
        let front = ladder.front(|row| error(row).map(|spread| spread.mean));
        let corners = front.iter().filter_map(|row| Some(at(row, error(row)?.mean)));
        canvas.line(corners, &style::dashed(INK, 1.3, "5 3"));
        for (row, spread) in &rows {
            let family = FAMILIES.iter().find(|(fits, ..)| fits(&row.rung));
            let colour = family.map_or(INK, |(_, colour, _)| colour);
            let [low, high] = spread.interval.map(|value| at(row, value.max(1e-9 * unit)));
            canvas.line([low, high], &style::stroke(colour, 1.2));
            canvas.circle(at(row, spread.mean), 3.6, &point(colour));
        }
        for row in ladder.rows.iter().filter(|row| is_reference(&row.rung)) {
            let x = at(row, unit)[0];
            canvas.line([[x, area.top], [x, area.bottom()]], &reference_line());
        }
    });
    Some(())
}

fn convergence(canvas: &mut Canvas, order: &Order, area: Area) {
    let (x, y): (Vec<f64>, Vec<f64>) = order.errors.iter().copied().unzip();
    let (Some(x_axis), Some(y_axis)) = (Axis::log(x), Axis::log(y)) else { return };
    let panel = Panel { area, x: x_axis, y: y_axis };
    panel.frame(canvas);
    let across = match order.name {
        "time step" => "ticks per second",
        step_in_contact::NAME => "steps per second",
        name => name,
    };
    let words = format!("order {:.2}; dashed: {}", order.observed, order.expected);
    panel.label(canvas, &words, across, "mean error of the force (N)");
    // The line of the expected order through the middle of the measured points.
    let logs: Vec<f64> = (order.errors.iter())
        .map(|(at, error)| error.ln() + order.expected * at.ln())
        .filter(|log| log.is_finite())
        .collect();
    let middle = crate::experiment::statistics::mean(&logs);
    let line: Vec<(f64, f64)> = (order.errors.iter())
        .map(|(at, _)| (*at, (middle - order.expected * at.ln()).exp()))
        .collect();
    panel.curve(canvas, &line, &style::dashed(FAINT_INK, 1.3, "5 3"));
    for (at, error) in &order.errors {
        canvas.circle(panel.at(*at, *error), 3.6, &point(FAMILIES[3].1));
    }
}

fn reference_line() -> String {
    style::dashed(FAINT_INK, 1.0, "2 3")
}

fn point(colour: &str) -> String {
    format!(r#"fill="{colour}" stroke="{PAPER}" stroke-width=".7""#)
}
