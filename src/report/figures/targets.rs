//! Figure of targets and contacts, seen along the approach.

use super::ReportFigure;
use crate::experiment::row::TouchRow;
use crate::experiment::statistics::summary::median_shift_m;
use crate::experiment::store::Run;
use crate::report::axes::{Axis, Length, Panel};
use crate::report::canvas::Area;
use crate::report::legend::{FigureLayout, Swatch, miss_entry, stroke_entry};
use crate::report::replay;
use crate::report::style::{self, FAINT_INK, INITIAL, PLANNED, dot};
use crate::report::table::digits;

pub(crate) const FIGURE: ReportFigure = ReportFigure { name: "targets", caption, draw };

fn caption(run: &Run) -> String {
    let zone = run.experiment.scene.zone.as_ref();
    let shift = match zone.and_then(|zone| median_shift_m(zone, &run.rows)) {
        Some(shift_m) => format!(
            " Over all trials, the median lateral distance from target to contact is {} mm.",
            digits(1e3 * shift_m)
        ),
        None => String::new(),
    };
    format!(
        "Targets (rings) and contacts (points) of trial {}, seen along the approach. Because \
         of its width, the finger touches a slope beside its tip.{shift}",
        run.experiment.report.trial
    )
}

/// Largest size of a panel with equal axes.
const PANEL_PX: (f64, f64) = (300.0, 380.0);
const LEFT_PX: f64 = 66.0;
const TOP_PX: f64 = 66.0;
/// Room around a panel for its title and the numbers of its axes.
const ROOM: [f64; 4] = [62.0, 28.0, 16.0, 42.0];
/// Smallest width, for the labels of a legend.
const WIDTH_MIN_PX: f64 = 420.0;
/// Margin around the zone as a fraction of its side, because contacts may lie outside.
const MARGIN: f64 = 0.12;

fn draw(run: &Run) -> anyhow::Result<Option<String>> {
    let Some(zone) = &run.experiment.scene.zone else { return Ok(None) };
    let Some(z_m) = zone.z_m else { return Ok(None) };
    let rows: Vec<_> = (run.experiment.drawn_planners().into_iter())
        .filter_map(|planner| replay::row(run, planner))
        .collect();
    if rows.is_empty() {
        return Ok(None);
    }
    let unit = Length::of(zone);
    let axis = |[low, high]: [f64; 2]| {
        let margin = MARGIN * (high - low);
        Axis::linear((low - margin) * unit.per_m, (high + margin) * unit.per_m, 5.0)
    };
    let mut entries = vec![
        (Swatch::Circle(ring(PLANNED)), "target"),
        (Swatch::Circle(dot(INITIAL)), "contact of an initial touch"),
        (Swatch::Circle(dot(PLANNED)), "contact of a later touch"),
    ];
    if rows.iter().flat_map(|row| &row.touches).any(TouchRow::is_stroke) {
        entries.push(stroke_entry());
    }
    entries.extend(miss_entry(run));
    let most = Area { left: LEFT_PX, top: TOP_PX, width: PANEL_PX.0, height: PANEL_PX.1 };
    let shape = Panel::equal(most, axis(zone.x_m), axis(z_m));
    let step_px = shape.area.width + 84.0;
    let width = (LEFT_PX + rows.len() as f64 * step_px).max(WIDTH_MIN_PX);
    let size = [width, TOP_PX + shape.area.height + 60.0];
    let (first, step) = (shape.area, [step_px, 0.0]);
    let mut sheet = FigureLayout::new(size, first, step, width - LEFT_PX, "", entries);
    for (column, row) in rows.iter().enumerate() {
        let panel = Panel { area: sheet.panel(column, 0.0, ROOM), ..shape.clone() };
        let canvas = &mut sheet.canvas;
        let z = if column == 0 { unit.named("z") } else { String::new() };
        panel.titled_frame(canvas, &row.planner, &unit.named("x"), &z);
        let at = |place: &[f64]| panel.at(place[0] * unit.per_m, place[1] * unit.per_m);
        canvas.clipped(panel.area, |canvas| {
            for (count, touch) in row.touches.iter().enumerate() {
                let colour = style::touch(count < run.experiment.initial_touches as usize);
                let target = at(&touch.target.numbers());
                match replay::contact(zone, touch) {
                    Some((place, _)) => {
                        if let Some(slid_w) = touch.slid_w() {
                            let line = slid_w.iter().map(|p_w| at(&zone.place(p_w)));
                            canvas.line(line, &style::slide(colour));
                        }
                        canvas.line([target, at(&place)], &style::stroke(FAINT_INK, 0.9));
                        canvas.circle(target, 2.6, &ring(colour));
                        canvas.circle(at(&place), 2.6, &dot(colour));
                    }
                    None => canvas.diamond(target, &style::stroke(colour, 1.3)),
                }
            }
        });
    }
    Ok(Some(sheet.canvas.finish()))
}

fn ring(colour: &str) -> String {
    style::stroke(colour, 1.1)
}
