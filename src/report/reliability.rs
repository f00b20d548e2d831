//! Reliability diagram of a band, the share of the truth below each quantile, and the table of its
//! coverage.

use super::axes::{Axis, Panel};
use super::canvas::Area;
use super::columns::{aligned_rows, cell};
use super::legend::{FigureLayout, Swatch};
use super::style::{self, FAINT_INK};
use crate::study::band::{BandCoverage, COUNTS, LEVELS};

/// Colours of the touch counts, few to many (viridis, van der Walt and Smith 2015).
const COLOURS: [&str; 7] =
    ["#fde725", "#a0da39", "#4ac16d", "#1fa187", "#277f8e", "#365c8d", "#46327e"];

const SIDE_PX: f64 = 360.0;
const LEFT_PX: f64 = 74.0;
const TOP_PX: f64 = 66.0;

/// Draws the shares of the truth below the quantiles at [`LEVELS`] after counts of touches; the
/// dashed diagonal is that of a calibrated belief.
pub fn draw(counts: &[(u32, [f64; LEVELS.len()])]) -> String {
    let names: Vec<String> = counts.iter().map(|(count, _)| format!("{count} touches")).collect();
    let colour = |i: usize| COLOURS[i % COLOURS.len()];
    let entries = names.iter().enumerate();
    let entries =
        entries.map(|(i, name)| (Swatch::Line(style::stroke(colour(i), 1.8)), name.as_str()));
    let size = [LEFT_PX + SIDE_PX + 30.0, TOP_PX + SIDE_PX + 60.0];
    let first = Area { left: LEFT_PX, top: TOP_PX, width: SIDE_PX, height: SIDE_PX };
    let mut sheet = FigureLayout::new(size, first, [0.0; 2], SIDE_PX, "", entries);
    let area = sheet.area(0, 0.0);
    let axis = || Axis::linear(0.0, 1.0, 5.0);
    let panel = Panel { area, x: axis(), y: axis() };
    panel.titled_frame(
        &mut sheet.canvas,
        "",
        "probability of the quantile",
        "share of the truth below it",
    );
    panel.curve(
        &mut sheet.canvas,
        &[(0.0, 0.0), (1.0, 1.0)],
        &style::dashed(FAINT_INK, 1.3, "5 3"),
    );
    for (i, (_, shares)) in counts.iter().enumerate() {
        let line: Vec<(f64, f64)> = LEVELS.into_iter().zip(*shares).collect();
        panel.curve(&mut sheet.canvas, &line, &style::stroke(colour(i), 1.8));
    }
    sheet.canvas.finish()
}

/// Returns the coverage of each object and of their mean after each count.
pub fn table(covered: &[BandCoverage]) -> String {
    let mut names: Vec<&str> = Vec::new();
    for it in covered {
        if !names.contains(&it.object.as_str()) {
            names.push(&it.object);
        }
    }
    let counts: Vec<u32> =
        COUNTS.into_iter().filter(|n| covered.iter().any(|it| it.touches == *n)).collect();
    type Value = fn(&BandCoverage) -> Option<f64>;
    let values: [Value; 2] = [|it| Some(it.coverage), |it| it.reachable_coverage];
    let row = |name: &str, holds: &dyn Fn(&BandCoverage) -> bool| {
        let mut cells = vec![name.to_string()];
        for value in values {
            for &count in &counts {
                let at = covered.iter().filter(|it| it.touches == count && holds(it));
                let at: Vec<f64> = at.filter_map(value).collect();
                let mean = at.iter().sum::<f64>() / at.len() as f64;
                cells.push(cell(Some(mean).filter(|mean| mean.is_finite()), 3));
            }
        }
        cells
    };
    let mut lines = vec![vec!["coverage of the 95 % band".to_string()]];
    for what in ["", "reach. "] {
        lines[0].extend(counts.iter().map(|count| format!("{what}{count}")));
    }
    lines.extend(names.iter().map(|name| row(name, &|it| it.object == *name)));
    lines.push(row("mean", &|_| true));
    aligned_rows(&lines)
}
