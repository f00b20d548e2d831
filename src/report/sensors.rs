//! Comparison of fingertip sensors, as a table, a figure and a page.

use super::axes::{Axis, Panel};
use super::canvas::Area;
use super::html::{figure, page, tables};
use super::legend::{FigureLayout, Swatch};
use super::style;
use super::table::{Cell, Column, Table};
use crate::experiment::measure::{COVERAGE, ROBOT_TIME};
use crate::experiment::statistics::curve_table::uncertainty;
use crate::experiment::statistics::equal_error::IntervalEstimate;
use crate::experiment::statistics::summary::CurvePoint;
use crate::study::sensors::SensorResults;

/// Returns a table with a row for every object and sensor.
pub fn table(results: &[SensorResults]) -> Table {
    let mut table = Table::new([
        Column::new("object"),
        Column::new("sensor"),
        Column::new("error_m").title("error after the last touch").unit("mm", 1e3, 2).interval(),
        Column::new("equal_touches")
            .title("touches to the first sensor's error")
            .unit("", 1.0, 0)
            .interval(),
        Column::new("ratio").title("of the first sensor's touches").unit("", 1.0, 2).interval(),
        Column::new("coverage").title("in the 95 % band").unit("%", 100.0, 0),
        Column::new("touch_s").title("robot time of a touch").unit("s", 1.0, 1),
        Column::new("simulated_s").title("simulation of a touch").unit("ms", 1e3, 1),
        Column::new("missed").title("without contact"),
        Column::new("doubtful").title("doubtful"),
        Column::new("failed").title("failed trials"),
    ]);
    for result in results {
        for (kit, cost_s) in result.kits().iter().zip(&result.costs_s) {
            let curve = result.curve(kit);
            let last = curve.last();
            let equal = result.equal_error(kit);
            let events = result.events(kit);
            table.rows.push(vec![
                result.object().into(),
                kit.as_str().into(),
                Cell::estimate(last.and_then(|point| error(result, point))),
                Cell::estimate(equal.as_ref().map(|equal| equal.touches)),
                Cell::estimate(equal.as_ref().map(|equal| equal.ratio)),
                last.and_then(|it| Some(it.of(&COVERAGE)?.mean)).into(),
                result.touch_time_s(kit).into(),
                (*cost_s).into(),
                (events.misses + events.overloads).into(),
                events.doubts.values().sum::<usize>().into(),
                events.failures.into(),
            ]);
        }
    }
    table.without_empty()
}

fn error(result: &SensorResults, point: &CurvePoint) -> Option<IntervalEstimate> {
    let measure = result.measure();
    let interval = uncertainty(&result.experiment, &result.rows, point, measure);
    Some(IntervalEstimate { value: point.of(measure)?.median, interval })
}

/// Returns the note that explains the table.
pub fn note(results: &[SensorResults]) -> String {
    let first = results.first().and_then(|result| result.kits().first());
    let first = first.map_or("the first sensor", String::as_str);
    format!(
        "Error: median over the trials, with the 95 % interval of a bootstrap. Touches to equal error: \
         touches after which a sensor's median error stays below that of {first} after the last \
         touch, from the same initial touches; - if it does not. Robot time: of the simulated stage, \
         travel included. Simulation: wall time of all trials over their touches, belief and planner \
         included. Doubtful: touches that the sensor located, or not, with a doubt."
    )
}

const PANEL: (f64, f64) = (420.0, 220.0);
const GAP: (f64, f64) = (90.0, 80.0);

/// Draws the errors over touches and over robot time, a row for each object.
pub fn draw(results: &[SensorResults]) -> Option<String> {
    let names = results.first()?.kits();
    let strokes = || names.iter().map(|name| style::stroke(style::planner(names, name), 2.0));
    let entries = strokes().map(Swatch::Line).zip(names.iter().map(String::as_str));
    let first = Area { left: 70.0, top: 66.0, width: PANEL.0, height: PANEL.1 };
    let step = [PANEL.0 + GAP.0, PANEL.1 + GAP.1];
    let width = 70.0 + 2.0 * step[0];
    let size = [width, 66.0 + results.len() as f64 * step[1]];
    let mut sheet = FigureLayout::new(size, first, step, width - 140.0, "", entries);
    for (row, result) in results.iter().enumerate() {
        let measure = result.measure();
        let in_mm = |point: &CurvePoint| Some(measure.unit.per_si * point.of(measure)?.median);
        let curves = |by: &dyn Fn(&CurvePoint) -> Option<f64>| -> Vec<Vec<(f64, f64)>> {
            let of = |name: &String| {
                let points = result.curve(name);
                points.iter().filter_map(|point| Some((by(point)?, in_mm(point)?))).collect()
            };
            names.iter().map(of).collect()
        };
        let by_touches = curves(&|point| Some(f64::from(point.touches)));
        let by_time = curves(&|point| Some(point.of(&ROBOT_TIME)?.mean));
        for (column, (x_name, curves)) in
            [("touches", by_touches), ("robot time (s)", by_time)].into_iter().enumerate()
        {
            let all = || curves.iter().flatten();
            let x = Axis::around(all().map(|(x, _)| *x), 0.0, 6.0);
            let Some((x, y)) = x.zip(Axis::log(all().map(|(_, y)| *y))) else { continue };
            let panel = Panel { area: sheet.area(column, row as f64), x, y };
            let y_name = format!("{} ({})", measure.title, measure.unit.symbol);
            panel.titled_frame(&mut sheet.canvas, result.object(), x_name, &y_name);
            for (curve, stroke) in curves.iter().zip(strokes()) {
                panel.curve(&mut sheet.canvas, curve, &stroke);
            }
        }
    }
    Some(sheet.canvas.finish())
}

/// Returns the page.
pub fn html(results: &[SensorResults]) -> String {
    let names: Vec<&str> = results.iter().map(SensorResults::object).collect();
    let drawing = draw(results).map(|svg| {
        let caption = "Median error over touches, and over the robot's time.";
        figure("sensors", &svg, caption)
    });
    let body =
        drawing.unwrap_or_default() + &tables("", &[table(results)], "named", &note(results));
    page("Palpate sensors", &names.join(", "), "What does a sensor buy?", &body)
}
