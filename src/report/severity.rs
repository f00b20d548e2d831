//! The map of hard cases: what held at which severity and time step.

use super::canvas::{Anchor, Area, Canvas};
use super::legend::{Legend, Swatch};
use super::style;
use super::style::{FAINT_INK, INK, PAPER, SMALL_PX};
use crate::study::stress::{Case, Outcome, Verdict};

/// A case with its verdicts.
pub type CaseVerdicts = (&'static Case, Vec<Verdict>);

const LEFT_PX: f64 = 232.0;
/// The first note's baseline below a legend of one row.
const TOP_PX: f64 = 45.0;
const NOTE_PX: f64 = 16.0;
/// Room for the notes.
const CELLS_MIN_PX: f64 = 230.0;
const CELL_PX: (f64, f64) = (66.0, 17.0);
const GAP_PX: f64 = 3.0;

/// Stable, faulted, wrong as known, unexplained: colours of Okabe and Ito.
const COLOURS: [(&str, &str); 4] = [
    ("stable", "#7fc8a9"),
    ("faulted, as it should", "#e69f00"),
    ("wrong, known", "#cc79a7"),
    ("unexplained", "#d00000"),
];

const NOTES: [&str; 2] = [
    "severity rises to the right; six stripes in a cell: control periods 0.25, 1, 2, 5, 10, 20 ms;",
    "four: time steps 0.25, 0.5, 1, 2 ms",
];

/// One line per case, one cell per severity, one stripe per control period or time step where that
/// matters.
pub fn draw(ran: &[CaseVerdicts]) -> String {
    let columns = ran.iter().map(|(case, _)| case.severities.len()).max().unwrap_or(1);
    let width = LEFT_PX + (columns as f64 * CELL_PX.0).max(CELLS_MIN_PX) + 20.0;
    let entries = COLOURS.map(|(words, colour)| (Swatch::Box(colour), words));
    let legend = Legend::new(width - 40.0, entries);
    let lines_top = TOP_PX + legend.more_px() + NOTES.len() as f64 * NOTE_PX;
    let mut canvas = Canvas::new(width, lines_top + ran.len() as f64 * (CELL_PX.1 + GAP_PX) + 14.0);
    legend.draw(&mut canvas, [20.0, 18.0]);
    for (line, note) in NOTES.iter().enumerate() {
        let bottom = TOP_PX + legend.more_px() + line as f64 * NOTE_PX;
        canvas.text([20.0, bottom], note, SMALL_PX, Anchor::Start);
    }
    for (line, (case, verdicts)) in ran.iter().enumerate() {
        let top = lines_top + line as f64 * (CELL_PX.1 + GAP_PX);
        canvas.text([LEFT_PX - 8.0, top + 12.5], case.name, SMALL_PX, Anchor::End);
        let stripes = case.axis.values_s().len() as f64;
        for verdict in verdicts {
            let stripe = case.axis.values_s().iter().position(|&value_s| value_s == verdict.axis_s);
            let left = LEFT_PX + verdict.rank as f64 * CELL_PX.0;
            let wide = (CELL_PX.0 - 2.0) / stripes;
            let left = left + stripe.unwrap_or(0) as f64 * wide;
            let area = Area { left, top, width: wide, height: CELL_PX.1 };
            canvas.rect(area, &style::fill(colour(verdict), 1.0));
            if stripes > 1.0 {
                canvas.rect(area, &style::stroke(PAPER, 0.5));
            }
        }
        for (rank, severity) in case.severities.iter().enumerate() {
            let at = [LEFT_PX + (rank as f64 + 0.5) * CELL_PX.0 - 1.0, top + 12.5];
            let ink = if rank < case.holds { INK } else { FAINT_INK };
            canvas.coloured_text(at, &short(*severity), SMALL_PX, Anchor::Middle, ink);
        }
    }
    canvas.finish()
}

fn colour(verdict: &Verdict) -> &'static str {
    let index = match (verdict.explained, &verdict.outcome) {
        (false, _) => 3,
        (true, Outcome::Stable) => 0,
        (true, Outcome::Faulted(_)) => 1,
        (true, Outcome::Wrong(_)) => 2,
    };
    COLOURS[index].1
}

/// A severity in few letters.
pub fn short(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        size if (1e-3..1e5).contains(&size) => value.to_string(),
        _ => format!("{value:e}"),
    }
}
