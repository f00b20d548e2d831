//! How the cost of the Gaussian process grows with the number of touches: `make growth`.
//!
//! Prints a table with measured exponents and the share of this machine's own matrix
//! multiplication, and draws `docs/growth.svg` and `.png`. One thread.

use palpate::gp::likelihood::Likelihood;
use palpate::gp::posterior::Scratch;
use palpate::gp::{Mean, Posterior};
use palpate::report::axes::{Axis, Panel};
use palpate::report::canvas::{Area, Canvas};
use palpate::report::legend::{Legend, Swatch};
use palpate::report::{png, style};
use palpate::study::bench::sample::{KERNEL, hyperparameters, search_box, touches};
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

const COUNTS: [usize; 9] = [10, 25, 50, 100, 200, 400, 1000, 2000, 4000];

/// One measured quantity over the counts.
struct Curve {
    name: &'static str,
    colour: &'static str,
    /// The power of n that its operations grow with.
    expected: f64,
    seconds: Vec<(f64, f64)>,
}

/// Seconds of one call: the least of three rounds that last some ten milliseconds each.
fn seconds(mut work: impl FnMut()) -> f64 {
    let begun = Instant::now();
    work();
    let once = begun.elapsed().as_secs_f64();
    let repeats = (0.01 / once).clamp(1.0, 1e5) as u32;
    let round = |_| {
        let begun = Instant::now();
        (0..repeats).for_each(|_| work());
        begun.elapsed().as_secs_f64() / f64::from(repeats)
    };
    (0..3).map(round).fold(once, f64::min)
}

fn measure() -> Vec<Curve> {
    let (at, bounds) = (hyperparameters(), search_box());
    let curve = |name, colour, expected| Curve { name, colour, expected, seconds: Vec::new() };
    let mut fit = curve("cold fit", "#0072b2", 3.0);
    let mut likelihood = curve("likelihood with gradient", "#d55e00", 3.0);
    let mut add = curve("adding a touch", "#cc79a7", 2.0);
    let mut query = curve("σ at a place, with gradient", style::TRUTH, 2.0);
    let mut grid = curve("mean and σ at one of 1000 places", "#e69f00", 2.0);
    let places: Vec<[f64; 2]> =
        (0..1000).map(|i| [f64::from(i % 32) / 31.0, f64::from(i / 32) / 31.0]).collect();
    for count in COUNTS {
        let n = count as f64;
        let touches = touches(count);
        fit.seconds.push((
            n,
            seconds(|| {
                black_box(bounds.fit(&KERNEL, &touches));
            }),
        ));
        let mut scorer = Likelihood::new(&KERNEL, Mean::Zero, &touches);
        let mut gradient = [0.0; 4];
        likelihood.seconds.push((
            n,
            seconds(|| {
                let _ = black_box(scorer.value_gradient(&at, &mut gradient));
            }),
        ));
        drop(scorer);
        let Ok(posterior) = Posterior::new(&KERNEL, at.clone(), touches) else { continue };
        let mut scratch = Scratch::default();
        let mut slope = [0.0; 2];
        query.seconds.push((
            n,
            seconds(|| {
                black_box(posterior.variance_gradient(&[0.31, 0.47], &mut slope, &mut scratch));
            }),
        ));
        let together = seconds(|| {
            black_box(posterior.predict(places.iter().map(|place| place.as_slice())));
        });
        grid.seconds.push((n, together / places.len() as f64));
        // A touch at a time on one growing posterior, so that no copy is measured.
        let mut growing = posterior.clone();
        let mut step = 0.0;
        add.seconds.push((
            n,
            seconds(|| {
                if growing.observations().len() > count + count / 10 + 3 {
                    growing.clone_from(&posterior);
                }
                step += 0.381_966;
                let _ = black_box(growing.add(&[step % 1.0, (step * 0.7) % 1.0], 1.0));
            }),
        ));
    }
    vec![fit, likelihood, add, query, grid]
}

/// Exponent between the last two counts.
fn exponent(curve: &Curve) -> f64 {
    match curve.seconds.as_slice() {
        [.., (n, before), (m, after)] => (after / before).ln() / (m / n).ln(),
        _ => f64::NAN,
    }
}

fn matmul_flops() -> f64 {
    let n = 1000;
    let a = faer::Mat::<f64>::from_fn(n, n, |i, j| ((i * 7 + j * 13) % 11) as f64);
    let mut c = faer::Mat::<f64>::zeros(n, n);
    let once = seconds(|| {
        let (replace, sequential) = (faer::Accum::Replace, faer::Par::Seq);
        faer::linalg::matmul::matmul(c.as_mut(), replace, &a, &a, 1.0, sequential);
    });
    2.0 * (n as f64).powi(3) / once
}

fn draw(curves: &[Curve]) -> Option<String> {
    let stroke = |curve: &Curve| style::stroke(curve.colour, 2.0);
    let entries = curves.iter().map(|curve| (Swatch::Line(stroke(curve)), curve.name));
    let legend = Legend::new(640.0, entries);
    let area = Area { left: 80.0, top: 50.0 + legend.more_px(), width: 640.0, height: 340.0 };
    let mut canvas = Canvas::new(760.0, area.bottom() + 60.0);
    legend.draw(&mut canvas, [80.0, 24.0]);
    let points = || curves.iter().flat_map(|curve| &curve.seconds);
    let x = Axis::log(points().map(|(n, _)| *n))?;
    let y = Axis::log(points().map(|(_, seconds)| *seconds))?;
    let panel = Panel { area, x, y };
    panel.frame(&mut canvas);
    panel.label(&mut canvas, "", "touches n", "seconds");
    for curve in curves {
        panel.curve(&mut canvas, &curve.seconds, &stroke(curve));
        if let Some((last, seconds)) = curve.seconds.last() {
            let law = |(n, _): &(f64, f64)| (*n, seconds * (n / last).powf(curve.expected));
            let upper = curve.seconds.iter().filter(|(n, _)| *n >= last / 10.0);
            let law: Vec<(f64, f64)> = upper.map(law).collect();
            panel.curve(&mut canvas, &law, &style::dashed(style::FAINT_INK, 1.0, "4 4"));
        }
    }
    Some(canvas.finish())
}

fn main() -> anyhow::Result<()> {
    if std::env::args().any(|argument| argument == "--test") {
        return Ok(());
    }
    let curves = measure();
    println!("{:<30}{}", "seconds at n =", COUNTS.map(|n| format!("{n:>10}")).concat());
    for curve in &curves {
        let cells: String = curve.seconds.iter().map(|(_, s)| format!("{s:>10.2e}")).collect();
        let (measured, expected) = (exponent(curve), curve.expected);
        println!("{:<30}{cells}   n^{measured:.2}, operations n^{expected}", curve.name);
    }
    let flops = matmul_flops();
    if let Some((n, seconds)) = curves[1].seconds.iter().find(|(n, _)| *n == 1000.0) {
        let share = n.powi(3) / seconds / flops;
        println!(
            "likelihood with gradient at n = 1000: {:.1} Gflop/s, {:.0} % of the {:.1} of a matrix product",
            n.powi(3) / seconds / 1e9,
            1e2 * share,
            flops / 1e9
        );
    }
    if let Some(svg) = draw(&curves) {
        let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
        std::fs::write(docs.join("growth.png"), png::render(&svg)?)?;
        std::fs::write(docs.join("growth.svg"), svg)?;
    }
    Ok(())
}
