//! Curves over a number, usually of touches: timed, printed with their exponents, and drawn with the
//! expected laws.

use palpate::report::axes::{Axis, Panel};
use palpate::report::canvas::{Area, Canvas};
use palpate::report::files::write_as;
use palpate::report::legend::{Legend, Swatch};
use palpate::report::style;
use std::path::Path;
use std::time::Instant;

/// Measured quantity over the counts.
pub struct Curve {
    pub name: &'static str,
    pub colour: &'static str,
    /// Expected exponent of n in its operations or numbers.
    pub expected: f64,
    pub values: Vec<(f64, f64)>,
}

/// Returns the seconds of one call: the minimum of three rounds of about ten milliseconds, or of
/// one call that takes longer than a second.
pub fn seconds(mut work: impl FnMut()) -> f64 {
    let begun = Instant::now();
    work();
    let once = begun.elapsed().as_secs_f64();
    if once > 1.0 {
        return once;
    }
    let repeats = (0.01 / once).clamp(1.0, 1e5) as u32;
    let round = |_| {
        let begun = Instant::now();
        (0..repeats).for_each(|_| work());
        begun.elapsed().as_secs_f64() / f64::from(repeats)
    };
    (0..3).map(round).fold(once, f64::min)
}

/// Returns the exponent between the last two counts.
fn exponent(curve: &Curve) -> f64 {
    match curve.values.as_slice() {
        [.., (n, before), (m, after)] => (after / before).ln() / (m / n).ln(),
        _ => f64::NAN,
    }
}

/// Draws panels below each other over the number `of`.
fn drawn(of: &str, panels: &[(&str, &[Curve])]) -> Option<String> {
    let stroke = |curve: &Curve| style::stroke(curve.colour, 2.0);
    // All panels use the same colours, and the first has them all.
    let entries = panels[0].1.iter().map(|curve| (Swatch::Line(stroke(curve)), curve.name));
    let legend = Legend::new(640.0, entries);
    let first = Area { left: 80.0, top: 50.0 + legend.more_px(), width: 640.0, height: 340.0 };
    let second = Area { top: first.bottom() + 70.0, height: 220.0, ..first };
    let areas = [first, second];
    let last = areas.get(panels.len().checked_sub(1)?)?;
    let mut canvas = Canvas::new(760.0, last.bottom() + 60.0);
    legend.draw(&mut canvas, [80.0, 24.0], "");
    for ((unit, curves), area) in panels.iter().zip(areas) {
        let points = || curves.iter().flat_map(|curve| &curve.values);
        let x = Axis::log(points().map(|(n, _)| *n))?;
        let y = Axis::log(points().map(|(_, value)| *value))?;
        let panel = Panel { area, x, y };
        panel.titled_frame(&mut canvas, "", of, unit);
        for curve in *curves {
            panel.curve(&mut canvas, &curve.values, &stroke(curve));
            if let Some((last, value)) = curve.values.last() {
                let law = |(n, _): &(f64, f64)| (*n, value * (n / last).powf(curve.expected));
                let upper = curve.values.iter().filter(|(n, _)| *n >= last / 10.0);
                let law: Vec<(f64, f64)> = upper.map(law).collect();
                panel.curve(&mut canvas, &law, &style::dashed(style::FAINT_INK, 1.0, "4 4"));
            }
        }
    }
    Some(canvas.finish())
}

pub fn print(unit: &str, curves: &[Curve]) {
    let mut counts: Vec<f64> =
        curves.iter().flat_map(|curve| &curve.values).map(|at| at.0).collect();
    counts.sort_by(f64::total_cmp);
    counts.dedup();
    let header: String = counts.iter().map(|n| format!("{n:>10}")).collect();
    println!("{:<34}{header}", format!("{unit} at n ="));
    for curve in curves {
        let cell = |n: &f64| match curve.values.iter().find(|at| at.0 == *n) {
            Some((_, value)) => format!("{value:>10.2e}"),
            None => format!("{:>10}", "-"),
        };
        let cells: String = counts.iter().map(cell).collect();
        let (measured, expected) = (exponent(curve), curve.expected);
        println!("{:<34}{cells}   n^{measured:.2}, expected n^{expected}", curve.name);
    }
}

/// Draws up to two panels over the number of touches as `docs/NAME.svg` and `.png`.
pub fn draw(name: &str, panels: &[(&str, &[Curve])]) -> anyhow::Result<()> {
    draw_over("touches n", name, panels)
}

/// Draws up to two panels over the number `of` as `docs/NAME.svg` and `.png`.
pub fn draw_over(of: &str, name: &str, panels: &[(&str, &[Curve])]) -> anyhow::Result<()> {
    if let Some(svg) = drawn(of, panels) {
        let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
        ["svg", "png"]
            .iter()
            .try_for_each(|format| write_as(&docs.join(name).with_extension(format), &svg))?;
    }
    Ok(())
}
