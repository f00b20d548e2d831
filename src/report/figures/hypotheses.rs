//! Figure of the hypotheses about the object: how their probabilities change in one trial, and
//! which objects are recognised as which in all trials.

use super::ReportFigure;
use crate::experiment::metrics::recognition::{NONE, RecognitionMetrics};
use crate::experiment::row::{TrialRow, planner_rows};
use crate::experiment::store::Run;
use crate::report::canvas::{Anchor, Area, Canvas, PartKind};
use crate::report::recognition::title;
use crate::report::replay;
use crate::report::style::{
    FAINT_INK, FRAME, GRID, INK, PLANNED, SMALL_PX, TEXT_PX, TRUTH, fill, stroke,
};
use std::collections::BTreeMap;

pub(crate) const FIGURE: ReportFigure = ReportFigure { name: "hypotheses", caption, draw };

fn caption(run: &Run) -> String {
    format!(
        "Hypotheses about the object. Bars: their probabilities after each touch of trial {}; green: \
         the true object. Confusion matrices: the trials by true and recognised object after the last \
         touch; green: right, red: wrong.",
        run.experiment.report.trial
    )
}

/// Largest number of hypotheses of a trial that are drawn, and the smallest largest probability of
/// one.
const LISTED: usize = 16;
const LEAST: f64 = 0.02;

/// Room for names, above for a title, on the right, and below for an axis.
const ROOM_PX: [f64; 4] = [120.0, 34.0, 12.0, 40.0];

/// Widths of all touches together, and of a confusion matrix, and their height for each object.
// heuristic: a panel with its names is as wide as a phone.
const WIDTH_PX: f64 = 250.0;
const ROW_PX: f64 = 18.0;

/// Smallest height of a row of the matrix that has room for a name.
const NAMED_PX: f64 = 11.0;

/// Smallest width of a cell of the matrix that has room for its count.
const COUNTED_PX: f64 = 13.0;

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
    let matrices: Vec<ConfusionMatrix> = (traces.iter())
        .map(|(planner, _)| ConfusionMatrix::new(planner_rows(&run.rows, planner)))
        .collect();
    let most = listed.iter().map(Vec::len).max().unwrap_or(0) as f64;
    // Names of the recognised objects are upright below a matrix.
    let names = matrices.iter().flat_map(|matrix| &matrix.names);
    let names_px = names.map(|name| name_px(name)).fold(0.0, f64::max);
    let [left, above, right, below] = ROOM_PX;
    let step = left + WIDTH_PX + right;
    let matrix_top = 2.0 * above + most * ROW_PX + below;
    let size = [step * traces.len() as f64, matrix_top + WIDTH_PX + names_px + below];
    let mut canvas = Canvas::new(size[0], size[1]);
    let panel = |canvas: &mut Canvas, column: usize, area: Area, below: f64| {
        let part = Area {
            left: column as f64 * step,
            top: area.top - above,
            width: step,
            height: above + area.height + below,
        };
        canvas.part(PartKind::Panel, part);
    };
    for (column, ((planner, trace), names)) in traces.iter().zip(&listed).enumerate() {
        let at = column as f64 * step + left;
        let height = names.len() as f64 * ROW_PX;
        let area = Area { left: at, top: above, width: WIDTH_PX, height };
        panel(&mut canvas, column, area, below);
        canvas.title([area.centre()[0], area.top - 14.0], planner);
        draw_trace(&mut canvas, area, trace, names);
    }
    for (column, ((planner, _), matrix)) in traces.iter().zip(&matrices).enumerate() {
        let at = column as f64 * step + left;
        let area = Area { left: at, top: matrix_top, width: WIDTH_PX, height: WIDTH_PX };
        panel(&mut canvas, column, area, names_px + below);
        canvas.title([area.centre()[0], area.top - 14.0], &format!("{planner}, all trials"));
        matrix.draw(&mut canvas, area, names_px);
    }
    Ok(Some(canvas.finish()))
}

/// Estimates the length of a name, without font metrics.
fn name_px(name: &str) -> f64 {
    0.6 * SMALL_PX * title(name).chars().count() as f64
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
        canvas.line([[area.left, top + ROW_PX], [area.right(), top + ROW_PX]], &stroke(GRID, 1.0));
        for (touch, found) in trace.iter().enumerate() {
            let share = found.probabilities.get(name).copied().unwrap_or(0.0);
            let left = area.left + touch as f64 * width + 0.1 * width;
            let height = share * (ROW_PX - 2.0);
            let bar = Area { left, top: top + ROW_PX - height, width: 0.8 * width, height };
            canvas.rect(bar, &fill(colour, 1.0));
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

/// Numbers of trials by true and by recognised object.
struct ConfusionMatrix {
    /// Names of the objects: the true ones, then others that were recognised.
    names: Vec<String>,
    /// Trials by the numbers of the true and the recognised object, and whether they agree.
    counts: BTreeMap<(usize, usize), (usize, bool)>,
}

impl ConfusionMatrix {
    /// Counts the trials whose object is known, after their last touch.
    fn new<'a>(rows: impl Iterator<Item = &'a TrialRow>) -> Self {
        let found = rows.filter_map(|row| {
            let found = row.touches.last()?.recognition.as_ref()?;
            let error = found.error.as_ref()?;
            let is_unknown = error.hypothesis == NONE;
            let truth = if is_unknown { &error.object } else { &error.hypothesis };
            Some((truth, &found.object, found.object == error.hypothesis))
        });
        let found: Vec<(&String, &String, bool)> = found.collect();
        let mut names: Vec<String> = found.iter().map(|(truth, ..)| (*truth).clone()).collect();
        names.sort();
        names.dedup();
        let mut number = |name: &String| {
            let known = names.iter().position(|known| known == name);
            known.unwrap_or_else(|| {
                names.push(name.clone());
                names.len() - 1
            })
        };
        let mut counts = BTreeMap::new();
        for (truth, object, is_right) in found {
            let cell = counts.entry((number(truth), number(object))).or_insert((0, is_right));
            cell.0 += 1;
        }
        Self { names, counts }
    }

    /// Draws the matrix, with the names of the recognised objects in `names_px` below it.
    fn draw(&self, canvas: &mut Canvas, area: Area, names_px: f64) {
        let place = area.width / self.names.len().max(1) as f64;
        let row =
            |number: usize| self.counts.iter().filter(move |((truth, _), _)| *truth == number);
        for ((truth, object), (count, is_right)) in &self.counts {
            let all: usize = row(*truth).map(|(_, (count, _))| count).sum();
            let colour = if *is_right { TRUTH } else { PLANNED };
            let [left, top] =
                [area.left + *object as f64 * place, area.top + *truth as f64 * place];
            let cell = Area { left, top, width: place, height: place };
            let share = *count as f64 / all as f64;
            // Pale enough for the number on it.
            canvas.rect(cell, &fill(colour, if place < COUNTED_PX { share } else { 0.4 * share }));
            if place >= COUNTED_PX {
                let at = [cell.centre()[0], cell.centre()[1] + 4.0];
                canvas.text(at, &count.to_string(), SMALL_PX, Anchor::Middle);
            }
        }
        canvas.rect(area, &stroke(FRAME, 1.0));
        let every = (NAMED_PX / place).ceil().max(1.0) as usize;
        for (i, name) in self.names.iter().enumerate().step_by(every) {
            let middle = (i as f64 + 0.5) * place + 4.0;
            let at = [area.left - 6.0, area.top + middle];
            canvas.text(at, title(name), SMALL_PX, Anchor::End);
            let half = 0.5 * name_px(name);
            let below = [area.left + middle, area.bottom() + 6.0 + half];
            canvas.upward_text(below, title(name), SMALL_PX, INK);
        }
        let at = [area.centre()[0], area.bottom() + names_px + 26.0];
        canvas.text(at, "recognised object; rows: true one", TEXT_PX, Anchor::Middle);
    }
}
