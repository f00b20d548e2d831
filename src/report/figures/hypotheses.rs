//! Figure of the hypotheses about the object: how they fade in one trial, and which objects are
//! taken for which in all trials.

use super::ReportFigure;
use crate::experiment::metrics::recognition::{NONE, RecognitionMetrics};
use crate::experiment::row::{TrialRow, planner_rows};
use crate::experiment::store::Run;
use crate::report::canvas::{Anchor, Area, Canvas};
use crate::report::replay;
use crate::report::style::{
    FAINT_INK, FRAME, INK, PLANNED, SMALL_PX, TEXT_PX, TRUTH, fill, stroke,
};
use std::collections::BTreeMap;

pub(crate) const FIGURE: ReportFigure = ReportFigure { name: "hypotheses", caption, draw };

fn caption(run: &Run) -> String {
    format!(
        "Hypotheses about the object. Above: their probabilities after each touch of trial {}, the \
         darker the likelier; green: the true one. Below: all trials after their last touch, the \
         true object by the most likely one; red: wrong.",
        run.experiment.report.trial
    )
}

/// Largest number of hypotheses of a trial that are drawn, and the smallest largest probability of
/// one.
const LISTED: usize = 16;
const LEAST: f64 = 0.02;

/// Room for names, for titles, and between parts.
const LEFT_PX: f64 = 130.0;
const TOP_PX: f64 = 40.0;
const GAP_PX: f64 = 56.0;

/// Widths of all touches together, and of a confusion matrix; heights of a hypothesis.
const TOUCHES_PX: f64 = 260.0;
const MATRIX_PX: f64 = 260.0;
const ROW_PX: f64 = 17.0;

/// Smallest height of a row of the matrix that has room for a name.
const NAMED_PX: f64 = 10.0;

fn draw(run: &Run) -> anyhow::Result<Option<String>> {
    let planners = run.experiment.drawn_planners();
    let traces: Vec<(&str, Vec<&RecognitionMetrics>)> = (planners.iter())
        .filter_map(|planner| Some((*planner, trace(replay::row(run, planner)?))))
        .filter(|(_, trace)| !trace.is_empty())
        .collect();
    if traces.is_empty() {
        return Ok(None);
    }
    let listed: Vec<Vec<String>> = traces.iter().map(|(_, trace)| likely(trace)).collect();
    let most = listed.iter().map(Vec::len).max().unwrap_or(0) as f64;
    let step_px = LEFT_PX + TOUCHES_PX.max(MATRIX_PX) + 20.0;
    let below_px = TOP_PX + most * ROW_PX + GAP_PX;
    let size = [step_px * traces.len() as f64, below_px + MATRIX_PX + 40.0];
    let mut canvas = Canvas::new(size[0], size[1]);
    for (column, ((planner, trace), names)) in traces.iter().zip(&listed).enumerate() {
        let left = column as f64 * step_px + LEFT_PX;
        let height = names.len() as f64 * ROW_PX;
        let above = Area { left, top: TOP_PX, width: TOUCHES_PX, height };
        canvas.title([left, TOP_PX - 14.0], planner);
        draw_trace(&mut canvas, above, trace, names);
        let below = Area { left, top: below_px, width: MATRIX_PX, height: MATRIX_PX };
        draw_matrix(&mut canvas, below, planner_rows(&run.rows, planner));
    }
    Ok(Some(canvas.finish()))
}

/// Hypotheses after each touch of a trial.
fn trace(row: &TrialRow) -> Vec<&RecognitionMetrics> {
    row.touches.iter().filter_map(|touch| touch.recognition.as_ref()).collect()
}

/// Names of the hypotheses that are likely at some time, the likeliest at the end first.
fn likely(trace: &[&RecognitionMetrics]) -> Vec<String> {
    let mut largest: BTreeMap<&String, [f64; 2]> = BTreeMap::new();
    for found in trace {
        for (name, probability) in &found.probabilities {
            let [last, most] = largest.entry(name).or_default();
            (*last, *most) = (0.0, most.max(*probability));
        }
    }
    for (name, probability) in trace.last().iter().flat_map(|found| &found.probabilities) {
        if let Some([last, _]) = largest.get_mut(name) {
            *last = *probability;
        }
    }
    let mut names: Vec<_> = largest.into_iter().filter(|(_, [_, most])| *most >= LEAST).collect();
    names.sort_by(|a, b| b.1[0].total_cmp(&a.1[0]).then(b.1[1].total_cmp(&a.1[1])));
    names.into_iter().take(LISTED).map(|(name, _)| name.clone()).collect()
}

fn draw_trace(canvas: &mut Canvas, area: Area, trace: &[&RecognitionMetrics], names: &[String]) {
    let width = area.width / trace.len() as f64;
    let truth = trace.iter().find_map(|found| Some(&found.error.as_ref()?.hypothesis));
    for (row, name) in names.iter().enumerate() {
        let top = area.top + row as f64 * ROW_PX;
        let colour = if truth == Some(name) { TRUTH } else { INK };
        for (touch, found) in trace.iter().enumerate() {
            let share = found.probabilities.get(name).copied().unwrap_or(0.0);
            let left = area.left + touch as f64 * width;
            canvas.rect(Area { left, top, width, height: ROW_PX }, &fill(colour, share));
        }
        let at = [area.left - 6.0, top + 0.5 * ROW_PX + 4.0];
        canvas.coloured_text(at, title(name), SMALL_PX, Anchor::End, colour);
    }
    canvas.rect(area, &stroke(FRAME, 1.0));
    let every = trace.len().div_ceil(10).max(1);
    for touch in (0..trace.len()).step_by(every) {
        let at = [area.left + (touch as f64 + 0.5) * width, area.bottom() + 14.0];
        let number = (touch + 1).to_string();
        canvas.coloured_text(at, &number, SMALL_PX, Anchor::Middle, FAINT_INK);
    }
    let at = [area.centre()[0], area.bottom() + 30.0];
    canvas.text(at, "touches", TEXT_PX, Anchor::Middle);
}

fn title(name: &str) -> &str {
    if name == NONE { "none of these" } else { name }
}

fn draw_matrix<'a>(canvas: &mut Canvas, area: Area, rows: impl Iterator<Item = &'a TrialRow>) {
    // By the true object: trials by the most likely one.
    let mut counts: BTreeMap<String, BTreeMap<(String, bool), f64>> = BTreeMap::new();
    for found in rows.filter_map(|row| row.touches.last()?.recognition.as_ref()) {
        let Some(error) = &found.error else { continue };
        let is_unknown = error.hypothesis == NONE;
        let truth = if is_unknown { &error.object } else { &error.hypothesis };
        let found = (found.object.clone(), found.object == error.hypothesis);
        *counts.entry(truth.clone()).or_default().entry(found).or_default() += 1.0;
    }
    let mut names: Vec<String> = counts.keys().cloned().collect();
    for (name, _) in counts.values().flat_map(BTreeMap::keys) {
        if !names.contains(name) {
            names.push(name.clone());
        }
    }
    let Some(place) = (!names.is_empty()).then(|| area.width / names.len() as f64) else { return };
    let position = |of: &String| names.iter().position(|name| name == of).unwrap_or(0) as f64;
    for (truth, found) in &counts {
        let all: f64 = found.values().sum();
        for ((name, is_right), count) in found {
            let [left, top] =
                [area.left + position(name) * place, area.top + position(truth) * place];
            let colour = if *is_right { TRUTH } else { PLANNED };
            let cell = Area { left, top, width: place, height: place };
            canvas.rect(cell, &fill(colour, count / all));
        }
    }
    canvas.rect(area, &stroke(FRAME, 1.0));
    let size_px = place.clamp(6.5, SMALL_PX);
    let every = (NAMED_PX / place / 1.5).ceil().max(1.0) as usize;
    for (i, name) in names.iter().enumerate().step_by(every) {
        let at = [area.left - 6.0, area.top + (i as f64 + 0.5) * place + 3.0];
        canvas.text(at, title(name), size_px, Anchor::End);
    }
    let at = [area.centre()[0], area.bottom() + 18.0];
    canvas.text(at, "most likely object, in the order of the rows", TEXT_PX, Anchor::Middle);
}
