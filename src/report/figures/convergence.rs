//! Errors against touches, Fig. 4 of Yi et al. 2016.

use super::figure::Figure;
use crate::experiment::measure::{Aggregate, MEASURES, Measure, R, Scale};
use crate::experiment::metrics;
use crate::experiment::store::Run;
use crate::experiment::summary;
use crate::experiment::summary::CurvePoint;
use crate::report::axes::{Axis, Panel, Swatch, legend};
use crate::report::canvas::{Anchor, Area, Canvas};
use crate::report::style;
use crate::report::style::{FAINT_INK, SMALL_PX};

pub(super) const FIGURE: Figure = Figure { name: "convergence", caption, draw };

/// Eq. 5 of any positive constant.
fn constant_r(run: &Run) -> Option<f64> {
    metrics::constant_r(run.truth.heights_m.iter().flatten())
}

fn caption(run: &Run) -> String {
    let score = constant_r(run).map_or(String::new(), |score| {
        format!(
            " R is not centred: a positive constant, however high, scores {score:.3} here (dashed), \
             so the centred correlation stands beside it."
        )
    });
    format!(
        "Agreement with the true surface against touches, over {} trials of each planner; bands \
         are one standard error of the mean, the vertical line ends the {} initial touches that \
         all planners share.{score} Corresponds to Fig. 4 of the paper.",
        run.experiment.trials, run.experiment.initial_touches
    )
}

const WIDTH: f64 = 1100.0;
const PANEL: (f64, f64) = (446.0, 262.0);

/// What is drawn over touches: a number of each point.
type Value<'a> = &'a dyn Fn(&CurvePoint) -> Option<f64>;

/// A planner's colour and curve.
type Curve = (&'static str, Vec<CurvePoint>);

fn draw(run: &Run) -> anyhow::Result<Option<String>> {
    let planners = &run.experiment.planners;
    let curves: Vec<Curve> = planners
        .iter()
        .map(|planner| (style::planner(planners, planner), planner))
        .map(|(colour, planner)| (colour, summary::curve(&run.experiment, &run.rows, planner)))
        .collect();
    if curves.iter().all(|(_, points)| points.is_empty()) {
        return Ok(None);
    }
    let points = || curves.iter().flat_map(|(_, points)| points);
    let shown: Vec<&Measure> = MEASURES
        .iter()
        .filter(|measure| match measure.scale {
            Scale::Undrawn => false,
            Scale::LogBeside(other) => points().any(|point| point.of(other).is_some()),
            Scale::Linear | Scale::UpToOne | Scale::Log => true,
        })
        .filter(|measure| points().any(|point| point.of(measure).is_some()))
        .collect();
    let rows = shown.len().div_ceil(2) as f64;
    let mut canvas = Canvas::new(WIDTH, 54.0 + rows * (PANEL.1 + 78.0));
    let entries: Vec<(Swatch, &str)> = curves
        .iter()
        .zip(planners)
        .map(|((colour, _), name)| (Swatch::Line(style::stroke(colour, 2.4)), name.as_str()))
        .collect();
    legend(&mut canvas, [70.0, 20.0], &entries);
    for (i, measure) in shown.into_iter().enumerate() {
        let (column, row) = ((i % 2) as f64, (i / 2) as f64);
        let area = Area {
            left: 70.0 + column * (PANEL.0 + 96.0),
            top: 66.0 + row * (PANEL.1 + 78.0),
            width: PANEL.0,
            height: PANEL.1,
        };
        draw_measure(&mut canvas, area, run, measure, &curves);
    }
    Ok(Some(canvas.finish()))
}

fn draw_measure(canvas: &mut Canvas, area: Area, run: &Run, measure: &Measure, curves: &[Curve]) {
    let per_si = measure.unit.per_si;
    let has_median = measure.aggregate.has_median();
    let mean = |point: &CurvePoint| Some(per_si * point.of(measure)?.mean);
    let median = |point: &CurvePoint| Some(per_si * point.of(measure)?.median);
    // A band needs a standard error, which a median has not.
    let error = |point: &CurvePoint| {
        point.of(measure)?.error.filter(|_| !has_median).map(|error| per_si * error)
    };
    let beside = |point: &CurvePoint| match measure.scale {
        Scale::LogBeside(other) => Some(other.unit.per_si * point.of(other)?.median),
        _ if measure.aggregate == Aggregate::Both => mean(point),
        _ => None,
    };
    let value: Value = if has_median { &median } else { &mean };
    let constant = constant_r(run).filter(|_| measure.id == R.id);

    let points = || curves.iter().flat_map(|(_, points)| points);
    let end = |sign: f64| {
        move |point: &CurvePoint| Some(value(point)? + sign * error(point).unwrap_or(0.0))
    };
    let values = points().filter_map(end(-1.0)).chain(points().filter_map(value)).chain(constant);
    let y = match measure.scale {
        Scale::Log | Scale::LogBeside(_) => Axis::log(values.chain(points().filter_map(beside))),
        Scale::UpToOne => Axis::around(values.chain([1.0]), 0.04, 5.0),
        Scale::Linear | Scale::Undrawn => {
            Axis::around(values.chain(points().filter_map(end(1.0))), 0.04, 5.0)
        }
    };
    let Some(y) = y else { return };
    let experiment = &run.experiment;
    let panel = Panel { area, x: Axis::linear(0.0, experiment.touches.into(), 6.0), y };
    panel.frame(canvas);
    panel.label(canvas, &title(measure), "touches", "");
    let end_of_initial = panel.at(experiment.initial_touches.into(), 0.0)[0];
    let line = [[end_of_initial, area.top], [end_of_initial, area.bottom()]];
    canvas.line(line, &style::stroke(FAINT_INK, 0.8));
    if let Some(score) = constant {
        draw_constant(canvas, &panel, experiment.touches, score);
    }
    for (colour, points) in curves {
        draw_curve(canvas, &panel, points, [value, &error, &beside], colour);
    }
}

/// What is drawn, and what dotted beside it.
fn title(measure: &Measure) -> String {
    let unit = match measure.unit.symbol {
        "" => String::new(),
        symbol => format!(" ({symbol})"),
    };
    let told = match (measure.scale, measure.aggregate) {
        (Scale::LogBeside(other), _) => format!("median; dotted: {}", other.title),
        (_, Aggregate::Both) => "median, and mean (dotted)".into(),
        (_, Aggregate::Median) => "median".into(),
        (_, Aggregate::Mean) => "mean".into(),
    };
    format!("{}{unit}: {told}", measure.title)
}

/// A dashed line at what any constant scores.
fn draw_constant(canvas: &mut Canvas, panel: &Panel, touches: u32, score: f64) {
    let at = panel.at(touches.into(), score);
    canvas.line([[panel.area.left, at[1]], at], &style::dashed(FAINT_INK, 1.0, "5 4"));
    let words = format!("any constant: {score:.3}");
    // Below the line, where curves that beat it are not, unless the frame is there.
    let y = if panel.area.bottom() - at[1] > 20.0 { at[1] + 14.0 } else { at[1] - 6.0 };
    canvas.coloured_text([at[0] - 6.0, y], &words, SMALL_PX, Anchor::End, FAINT_INK);
}

/// A curve with the band of its errors, and a dotted one beside it.
fn draw_curve(
    canvas: &mut Canvas,
    panel: &Panel,
    points: &[CurvePoint],
    [value, error, beside]: [Value; 3],
    colour: &str,
) {
    let over = |value: Value| -> Vec<(f64, f64)> {
        points.iter().filter_map(|point| Some((point.touches.into(), value(point)?))).collect()
    };
    let band: Vec<(f64, f64, f64)> = points
        .iter()
        .filter_map(|point| {
            let (value, error) = (value(point)?, error(point)?);
            Some((point.touches.into(), value - error, value + error))
        })
        .collect();
    if !band.is_empty() {
        panel.band(canvas, &band, colour);
    }
    let dotted = over(beside);
    if !dotted.is_empty() {
        panel.curve(canvas, &dotted, &style::dashed(colour, 1.3, "1.5 3"));
    }
    panel.curve(canvas, &over(value), &style::stroke(colour, 2.0));
}
