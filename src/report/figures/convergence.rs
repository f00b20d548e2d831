//! Figures of measures against touches, Fig. 4 of Yi et al. 2016: those that decide between
//! planners, and the others.

use super::ReportFigure;
use crate::experiment::measure::{
    Aggregate, MEASURES, Measure, PanelAxis, R, RECOGNISED, RMSE, ROBOT_TIME, VERIFICATION_RMSE,
};
use crate::experiment::metrics;
use crate::experiment::statistics::curve_table;
use crate::experiment::statistics::summary::{self, CurvePoint};
use crate::experiment::store::Run;
use crate::report::axes::{Axis, Panel};
use crate::report::canvas::{Area, Canvas};
use crate::report::legend::{FigureLayout, Swatch};
use crate::report::replay::in_paper;
use crate::report::style::{self, FAINT_INK};
use crate::report::tables::summary::finished;
use palpate_input::format::counted;
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};

/// Figure of the measures that decide between planners.
pub(crate) const FIGURE: ReportFigure =
    ReportFigure { name: "convergence", caption, draw: |run| draw(run, true) };

/// Figure of the other measures.
pub(crate) const OTHERS: ReportFigure =
    ReportFigure { name: "measures", caption: others_caption, draw: |run| draw(run, false) };

/// Returns whether a measure decides between planners: the error that ranks them, the
/// RMSE, that at held-out touches, and the share of recognised objects.
fn decides(run: &Run, measure: &Measure) -> bool {
    [run.error_measure(), &RMSE, &VERIFICATION_RMSE, &RECOGNISED]
        .iter()
        .any(|it| it.id == measure.id)
}

/// Returns the score R (Eq. 5) of any positive constant.
fn constant_r(run: &Run) -> Option<f64> {
    metrics::constant_r(run.truth.heights_m.iter().flatten())
}

fn caption(run: &Run) -> String {
    format!(
        "What decides between planners, against the touches and, if the robot moves, its time; \
         n = {}; all planners share the {}. {BANDS}",
        finished(run),
        counted(run.experiment.initial_touches, "initial touch")
    )
}

/// Sentence on the bands of a panel.
const BANDS: &str = "Bands: one standard error of a mean, 95 % bootstrap interval of a median.";

fn others_caption(run: &Run) -> String {
    let score = constant_r(run).map_or(String::new(), |score| {
        format!(
            " R is not centred: any positive constant scores {score:.3} here (dashed), so the centred \
             correlation is shown too."
        )
    });
    format!(
        "Other measures of the belief against the number of touches. {BANDS}{score}{}",
        in_paper(run, "Fig. 4")
    )
}

/// Room around a panel for its title and the numbers of its axes.
const ROOM: [f64; 4] = [64.0, 28.0, 16.0, 44.0];
/// Size and number in a row of the panels of the measures that decide, and of the others.
// heuristic: a panel with its numbers is as wide as a phone.
const PANELS: [([f64; 2], usize); 2] = [([332.0, 242.0], 2), ([274.0, 190.0], 3)];

/// Height of the legend.
const LEGEND_PX: f64 = 38.0;

/// Colour and curve of a planner.
type Curve = (&'static str, Vec<CurvePoint>);

/// Measure after some touches, in its display unit: (touches, value, dotted value, band).
type Reading = (f64, f64, Option<f64>, Option<[f64; 2]>);

fn draw(run: &Run, is_first: bool) -> anyhow::Result<Option<String>> {
    let scene = &run.experiment.scene;
    if !run.truth.is_known() && scene.whole_object.is_none() && scene.library.is_none() {
        return Ok(None);
    }
    let curves = curves(run);
    let points = || curves.iter().flat_map(|(_, points)| points);
    let mut shown: Vec<&Measure> = MEASURES
        .iter()
        .filter(|measure| match measure.scale {
            PanelAxis::Undrawn => false,
            PanelAxis::LogBeside(other) => points().any(|point| point.of(other).is_some()),
            PanelAxis::Linear | PanelAxis::UpToOne | PanelAxis::Log => true,
        })
        .filter(|measure| points().any(|point| point.of(measure).is_some()))
        .filter(|measure| decides(run, measure) == is_first)
        .collect();
    let first = if scene.library.is_some() { &RECOGNISED } else { run.error_measure() };
    shown.sort_by_key(|measure| measure.id != first.id);
    let over_touches = shown.iter().map(|measure| (*measure, false));
    let is_over_time =
        |measure: &&&Measure| measure.is_error && measure.aggregate == Aggregate::Both;
    // Errors over the robot's time, where it moves.
    let times = Axis::around(points().filter_map(time_s), 0.02, 6.0);
    let over_time = shown.iter().filter(|_| times.is_some()).filter(is_over_time);
    let panels: Vec<(&Measure, bool)> =
        over_touches.chain(over_time.map(|measure| (*measure, true))).collect();
    let is_r = shown.iter().any(|measure| measure.id == R.id);
    let dashed = constant_r(run)
        .filter(|_| is_r)
        .map(|_| (Swatch::Line(constant_line()), "R of any constant"));
    let panel = PANELS[usize::from(!is_first)];
    Ok(draw_panels(run, &curves, panel, &panels, times.as_ref(), dashed))
}

/// Draws the error of the planners over touches alone; `None` without an error.
pub fn draw_error(run: &Run) -> Option<String> {
    let (curves, error) = (curves(run), run.error_measure());
    let mut points = curves.iter().flat_map(|(_, points)| points);
    points.any(|point| point.of(error).is_some()).then_some(())?;
    draw_panels(run, &curves, PANELS[0], &[(error, false)], None, None)
}

fn curves(run: &Run) -> Vec<Curve> {
    let planners = &run.experiment.planners;
    planners
        .iter()
        .map(|planner| (style::planner(planners, planner), planner))
        .map(|(colour, planner)| (colour, summary::curve(&run.experiment, &run.rows, planner)))
        .collect()
}

/// Draws panels of measures, each over touches or over `times`; `panel` is the size of one and the
/// largest number in a row. Returns `None` without a touch or a panel.
fn draw_panels(
    run: &Run,
    curves: &[Curve],
    panel: ([f64; 2], usize),
    panels: &[(&Measure, bool)],
    times: Option<&Axis>,
    more: Option<(Swatch, &str)>,
) -> Option<String> {
    let points = curves.iter().flat_map(|(_, points)| points);
    let first = points.map(|point| point.touches).min().filter(|_| !panels.is_empty())?;
    let x = Axis::counts(first.into(), run.experiment.touches.into(), 6.0);
    let swatches = curves
        .iter()
        .zip(&run.experiment.planners)
        .map(|((colour, _), name)| (Swatch::Line(style::stroke(colour, 2.4)), name.as_str()));
    let ([width, height], columns) = panel;
    let columns = columns.min(panels.len());
    let step = [ROOM[0] + width + ROOM[2], ROOM[1] + height + ROOM[3]];
    let legend_px = columns as f64 * step[0];
    let rows = panels.len().div_ceil(columns) as f64;
    let first = Area { left: ROOM[0], top: LEGEND_PX + ROOM[1], width, height };
    let size = [legend_px, LEGEND_PX + rows * step[1]];
    let entries = swatches.chain(more);
    let mut sheet = FigureLayout::new(size, first, step, legend_px - ROOM[0], "", entries);
    for (i, (measure, over_time)) in panels.iter().enumerate() {
        let area = sheet.panel(i % columns, (i / columns) as f64, ROOM);
        let time_axis = times.filter(|_| *over_time);
        draw_measure(&mut sheet.canvas, area, run, measure, &x, time_axis, curves);
    }
    Some(sheet.canvas.finish())
}

fn draw_measure(
    canvas: &mut Canvas,
    area: Area,
    run: &Run,
    measure: &Measure,
    touches: &Axis,
    times: Option<&Axis>,
    curves: &[Curve],
) {
    let read: Vec<(&str, Vec<Reading>)> = curves
        .iter()
        .map(|(colour, points)| {
            let of = |point: &CurvePoint| {
                let reading = reading(run, measure, point)?;
                match times {
                    Some(_) => Some((time_s(point)?, reading.1, reading.2, reading.3)),
                    None => Some(reading),
                }
            };
            (*colour, points.par_iter().filter_map(of).collect())
        })
        .collect();
    let constant = constant_r(run).filter(|_| measure.id == R.id);
    let readings = || read.iter().flat_map(|(_, readings)| readings);
    let values = readings().flat_map(|(_, value, beside, band)| {
        let ends = band.iter().flatten().copied();
        ends.chain([*value]).chain(*beside).collect::<Vec<_>>()
    });
    let y = match measure.scale {
        PanelAxis::Log | PanelAxis::LogBeside(_) => Axis::log(values),
        // A band may reach beyond the largest possible value.
        PanelAxis::UpToOne => {
            let up_to_one = values.chain(constant).map(|value| value.min(1.0));
            Axis::around(up_to_one.chain([1.0]), 0.04, 5.0)
        }
        PanelAxis::Linear | PanelAxis::Undrawn => Axis::around(values, 0.04, 5.0),
    };
    let Some(y) = y else { return };
    let panel = Panel { area, x: times.unwrap_or(touches).clone(), y };
    let along = if times.is_some() { "robot time (s), mean" } else { "touches" };
    panel.titled_frame(canvas, &statistics_label(measure), along, &named(measure));
    if let Some(score) = constant {
        let (low, high) = touches.range();
        panel.curve(canvas, &[(low, score), (high, score)], &constant_line());
    }
    for (colour, readings) in &read {
        let band = |it: &Reading| it.3.map(|[low, high]| (it.0, low, high));
        panel.band(canvas, &readings.iter().filter_map(band).collect::<Vec<_>>(), colour);
        let curve = |value: fn(&Reading) -> Option<f64>| -> Vec<(f64, f64)> {
            readings.iter().filter_map(|it| Some((it.0, value(it)?))).collect()
        };
        panel.curve(canvas, &curve(|it| it.2), &style::dashed(colour, 1.3, "1.5 3"));
        panel.curve(canvas, &curve(|it| Some(it.1)), &style::stroke(colour, 2.0));
    }
}

/// Returns the value of a measure after some touches: its median, or its mean if it has no median.
fn reading(run: &Run, measure: &Measure, point: &CurvePoint) -> Option<Reading> {
    let per_si = measure.unit.per_si;
    let summary = point.of(measure)?;
    let value = point.representative(measure)?;
    let beside = match measure.scale {
        PanelAxis::LogBeside(other) => point.of(other).map(|other| other.median),
        _ => (measure.aggregate == Aggregate::Both).then_some(summary.mean),
    };
    let band = curve_table::uncertainty(&run.experiment, &run.rows, point, measure);
    let in_unit = |value: f64| per_si * value;
    let touches = point.touches.into();
    Some((touches, in_unit(value), beside.map(in_unit), band.map(|ends| ends.map(in_unit))))
}

/// Returns the mean time of the robot, s.
fn time_s(point: &CurvePoint) -> Option<f64> {
    point.of(&ROBOT_TIME).map(|time_s| time_s.mean)
}

/// Returns the name of a measure with its display unit.
fn named(measure: &Measure) -> String {
    match measure.unit.symbol {
        "" => measure.title.into(),
        symbol => format!("{} ({symbol})", measure.title),
    }
}

/// Returns the statistics that the solid and the dotted line show.
fn statistics_label(measure: &Measure) -> String {
    match (measure.scale, measure.aggregate) {
        (PanelAxis::LogBeside(other), _) => format!("median; dotted: {}", other.title),
        (_, Aggregate::Both) => "median; dotted: mean".into(),
        (_, Aggregate::Median) => "median".into(),
        (_, Aggregate::Mean) => "mean".into(),
    }
}

/// Returns the attributes of the line at the score of any constant.
fn constant_line() -> String {
    style::dashed(FAINT_INK, 1.0, "5 4")
}
