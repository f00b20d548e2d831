//! Errors against touches, Fig. 4 of Yi et al. 2016.

use super::Figure;
use crate::experiment::store::Run;
use crate::experiment::summary;
use crate::experiment::summary::CurvePoint;
use crate::report::axes::{Axis, MM, Panel, Sample, legend};
use crate::report::canvas::{Anchor, Area, Canvas};
use crate::report::findings::constant_score;
use crate::report::style;
use crate::report::style::{FAINT_INK, SMALL_PX};

pub(super) const FIGURE: Figure = Figure { name: "convergence", caption, draw };

/// A panel: one measure against touches.
struct Measure {
    title: &'static str,
    is_log: bool,
    /// The line.
    value: fn(&CurvePoint) -> Option<f64>,
    /// Its standard error, for a band.
    error: fn(&CurvePoint) -> Option<f64>,
    /// A second, thin line.
    other: Option<fn(&CurvePoint) -> Option<f64>>,
}

const MEASURES: [Measure; 7] = [
    Measure {
        title: "correlation R (Eq. 5), mean",
        is_log: false,
        value: |point| Some(point.r_mean),
        error: |point| point.r_se,
        other: None,
    },
    Measure {
        title: "centred correlation, mean",
        is_log: false,
        value: |point| Some(point.centred_r_mean),
        error: |point| point.centred_r_se,
        other: None,
    },
    Measure {
        title: "RMSE (mm): median, and mean (dotted)",
        is_log: true,
        value: |point| Some(MM.per_m * point.rmse_median_m),
        error: |_| None,
        other: Some(|point| Some(MM.per_m * point.rmse_mean_m)),
    },
    Measure {
        title: "RMSE in the outer tenth of the zone (mm): median",
        is_log: true,
        value: |point| Some(MM.per_m * point.edge_rmse_median_m?),
        error: |_| None,
        other: None,
    },
    Measure {
        title: "median RMSE (mm) where the finger reaches, and where not (dotted)",
        is_log: true,
        value: |point| {
            point.unreachable_rmse_median_m.and(point.reachable_rmse_median_m).map(|m| MM.per_m * m)
        },
        error: |_| None,
        other: Some(|point| point.unreachable_rmse_median_m.map(|m| MM.per_m * m)),
    },
    Measure {
        title: "share of the truth in the 95 % band, mean",
        is_log: false,
        value: |point| point.coverage_mean,
        error: |_| None,
        other: None,
    },
    Measure {
        title: "lateral travel (m), mean",
        is_log: false,
        value: |point| Some(point.path_mean_m),
        error: |_| None,
        other: None,
    },
];

fn caption(run: &Run) -> String {
    let score = constant_score(run).map_or(String::new(), |score| {
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

fn draw(run: &Run) -> anyhow::Result<Option<String>> {
    let planners = &run.experiment.planners;
    let curves: Vec<(&str, Vec<CurvePoint>)> = planners
        .iter()
        .map(|planner| (style::planner(planners, planner), planner))
        .map(|(colour, planner)| (colour, summary::curve(&run.experiment, &run.rows, planner)))
        .collect();
    if curves.iter().all(|(_, points)| points.is_empty()) {
        return Ok(None);
    }
    let shown: Vec<&Measure> = MEASURES
        .iter()
        .filter(|measure| {
            curves.iter().flat_map(|(_, points)| points).any(|p| (measure.value)(p).is_some())
        })
        .collect();
    let rows = shown.len().div_ceil(2) as f64;
    let mut canvas = Canvas::new(WIDTH, 54.0 + rows * (PANEL.1 + 78.0));
    let entries: Vec<(Sample, &str)> = curves
        .iter()
        .zip(planners)
        .map(|((colour, _), name)| (Sample::Line(style::stroke(colour, 2.4)), name.as_str()))
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
        let constant = constant_score(run).filter(|_| i == 0);
        draw_measure(&mut canvas, area, run, measure, &curves, constant);
    }
    Ok(Some(canvas.finish()))
}

fn draw_measure(
    canvas: &mut Canvas,
    area: Area,
    run: &Run,
    measure: &Measure,
    curves: &[(&str, Vec<CurvePoint>)],
    constant: Option<f64>,
) {
    let points = || curves.iter().flat_map(|(_, points)| points);
    let lowest =
        |point: &CurvePoint| Some((measure.value)(point)? - (measure.error)(point).unwrap_or(0.0));
    let values = points().filter_map(lowest).chain(points().filter_map(measure.value));
    let values = values.chain(constant);
    let y = match (measure.is_log, measure.other) {
        (true, Some(other)) => Axis::log(values.chain(points().filter_map(other))),
        (true, None) => Axis::log(values),
        (false, _) => Axis::around(values.chain([1.0]), 0.04, 5.0),
    };
    let Some(y) = y else { return };
    let experiment = &run.experiment;
    let panel = Panel { area, x: Axis::linear(0.0, experiment.touches.into(), 6.0), y };
    panel.frame(canvas);
    panel.label(canvas, measure.title, "touches", "");
    let end_of_initial = panel.at(experiment.initial_touches.into(), 0.0)[0];
    let line = [[end_of_initial, area.top], [end_of_initial, area.bottom()]];
    canvas.line(line, &style::stroke(FAINT_INK, 0.8));
    if let Some(score) = constant {
        let at = panel.at(experiment.touches.into(), score);
        canvas.line([[area.left, at[1]], at], &style::dashed(FAINT_INK, 1.0, "5 4"));
        let words = format!("any constant: {score:.3}");
        // Below the line, where curves that beat it are not, unless the frame is there.
        let y = if area.bottom() - at[1] > 20.0 { at[1] + 14.0 } else { at[1] - 6.0 };
        canvas.coloured_text([at[0] - 6.0, y], &words, SMALL_PX, Anchor::End, FAINT_INK);
    }
    for (colour, points) in curves {
        draw_curve(canvas, &panel, measure, colour, points);
    }
}

fn draw_curve(
    canvas: &mut Canvas,
    panel: &Panel,
    measure: &Measure,
    colour: &str,
    points: &[CurvePoint],
) {
    let over = |value: &dyn Fn(&CurvePoint) -> Option<f64>| -> Vec<(f64, f64)> {
        points.iter().filter_map(|point| Some((point.touches.into(), value(point)?))).collect()
    };
    let band: Vec<(f64, f64, f64)> = points
        .iter()
        .filter_map(|point| {
            let (value, error) = ((measure.value)(point)?, (measure.error)(point)?);
            Some((point.touches.into(), value - error, value + error))
        })
        .collect();
    if !band.is_empty() {
        panel.band(canvas, &band, colour);
    }
    if let Some(other) = measure.other {
        let attributes = style::dashed(colour, 1.3, "1.5 3");
        panel.curve(canvas, &over(&other), &attributes);
    }
    panel.curve(canvas, &over(&measure.value), &style::stroke(colour, 2.0));
}
