//! Figures and page of made-up runs, so that no trial has to be run.

use palpate::faces::report::axes::Axis;
use palpate::faces::report::{self, png};
use palpate::ground::gp::fit::Fit;
use palpate::ground::gp::kernel::Hyperparameters;
use palpate::ground::optimize::Stop;
use palpate::trials::experiment::Experiment;
use palpate::trials::metrics::Metrics;
use palpate::trials::row::{TouchRow, TrialRow};
use palpate::trials::store::Run;
use palpate::trials::truth::Truth;
use resvg::tiny_skia::Pixmap;
use resvg::usvg::{Options, Tree};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

const CURVE: &str = r#"
name = "curve"
question = "Is <script>alert('1')</script> & \"this\" safe?"
planners = ["active", "random", "sobol"]
trials = 2
initial_touches = 3
touches = 12
grid = 41
[scene]
body = "function"
function = "toy"
zone = { x_m = [-2.0, 2.0] }
"#;

const SURFACE: &str = r#"
name = "surface"
planners = ["random", "active"]
trials = 2
initial_touches = 5
touches = 20
grid = 21
report = { touch_counts = [5, 12, 20] }
[scene]
body = "cast"
zone = { x_m = [-0.05, 0.05], z_m = [-0.07, 0.07], datum_y_m = -0.6 }
object = { mesh = "none.obj" }
"#;

/// An elliptic cylinder with a bump, and nothing beyond its sides; in 1-D a wave.
fn height_m(place: &[f64]) -> Option<f64> {
    match place {
        [x, z] => {
            let bump = 0.01 * (-((x - 0.01).powi(2) + z * z) / 2e-4).exp();
            (x.abs() < 0.046).then(|| 0.04 * (1.0 - (x / 0.05).powi(2)).sqrt() + bump)
        }
        _ => Some(1.0 + (5.0 * place[0]).sin()),
    }
}

fn run(text: &str) -> Run {
    let experiment: Experiment = toml::from_str(text).unwrap();
    let zone = &experiment.scene.zone;
    let places = zone.grid(experiment.grid as usize);
    let heights_m = places.iter().map(|place| height_m(place)).collect();
    let is_reachable = vec![true; places.len()];
    let truth = Truth::new(zone, places, heights_m, is_reachable);
    let rows = (0..experiment.trials)
        .flat_map(|trial| experiment.planners.iter().map(move |planner| (trial, planner)))
        .map(|(trial, planner)| row(&experiment, trial, planner))
        .collect();
    Run { experiment, truth, rows }
}

fn row(experiment: &Experiment, trial: u32, planner: &str) -> TrialRow {
    let touches = (1..=experiment.touches).map(|count| touch(experiment, trial, count)).collect();
    TrialRow { trial, planner: planner.into(), failure: None, touches }
}

fn touch(experiment: &Experiment, trial: u32, count: u32) -> TouchRow {
    let zone = &experiment.scene.zone;
    // Multiples of two irrational numbers spread evenly over the zone.
    let step = f64::from(count + 100 * trial);
    let target = zone.at(&[(0.618 * step).fract(), (0.755 * step).fract()]);
    let fit = Fit {
        hyperparameters: Hyperparameters {
            signal_sd: 0.05,
            length_scales: zone.extents_m().iter().map(|side| 0.3 * side).collect(),
            noise_sd: 1e-4,
            mean: 0.0,
        },
        log_likelihood: 0.0,
        factorisations: 1,
        scanned_at: 0,
        stop: Stop::Converged,
    };
    let error_m = 0.02 / f64::from(count);
    let metrics = Metrics {
        r: 1.0 - error_m,
        centred_r: 1.0 - 10.0 * error_m,
        rmse_m: error_m,
        max_error_m: error_m,
        edge_rmse_m: Some(2.0 * error_m),
        reachable_rmse_m: Some(error_m),
        unreachable_rmse_m: None,
        coverage: Some(0.9),
        nlpd: Some(-3.0),
    };
    let is_fitted = count >= experiment.initial_touches;
    TouchRow {
        contact: height_m(&target).map(|height_m| zone.point(&target, height_m).coords.into()),
        target,
        planned_sd_m: (count > experiment.initial_touches).then_some(1e-3),
        stall: None,
        fit: is_fitted.then_some(fit),
        overload: false,
        jitter: 0.0,
        metrics: is_fitted.then_some(metrics),
    }
}

/// Every file of a folder's report by name.
fn written(run: &Run, folder: &Path) -> BTreeMap<String, Vec<u8>> {
    report::write(run, folder).unwrap();
    [folder.to_owned(), folder.join("figures")]
        .iter()
        .flat_map(|folder| fs::read_dir(folder).unwrap())
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.is_file())
        .map(|path| (path.file_name().unwrap().to_string_lossy().into(), fs::read(path).unwrap()))
        .collect()
}

fn drawn(run: &Run) -> BTreeMap<String, Vec<u8>> {
    written(run, tempfile::tempdir().unwrap().path())
}

fn text<'a>(files: &'a BTreeMap<String, Vec<u8>>, name: &str) -> &'a str {
    std::str::from_utf8(&files[name]).unwrap()
}

#[test]
fn figures_are_whole() {
    for (settings, names) in [
        (CURVE, &["acquisition", "convergence", "curves"][..]),
        (SURFACE, &["acquisition", "convergence", "surfaces", "targets"]),
    ] {
        let files = drawn(&run(settings));
        let svgs: Vec<&str> = files.keys().filter_map(|name| name.strip_suffix(".svg")).collect();
        assert_eq!(svgs, names);
        for name in names {
            let svg = text(&files, &format!("{name}.svg"));
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{name}");
            assert!(svg.len() < 2_000_000, "{name}: {} bytes", svg.len());
            let size = Tree::from_str(svg, &Options::default()).unwrap().size();
            let pixels = Pixmap::decode_png(&files[&format!("{name}.png")]).unwrap();
            let expected = [size.width(), size.height()].map(|side| (png::SCALE * side) as u32);
            assert_eq!([pixels.width(), pixels.height()], expected, "{name}");
        }
    }
}

#[test]
fn page_needs_nothing_and_trusts_nothing() {
    let files = drawn(&run(CURVE));
    let page = text(&files, "report.html").replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
    for resource in ["http:", "https:", "src=", "<link", "@import", "url(", "<script"] {
        assert!(!page.contains(resource), "{resource}");
    }
    assert!(page.contains("&lt;script&gt;alert(&#39;1&#39;)&lt;/script&gt; &amp; &quot;this"));
    assert!(page.contains("After 12 touches"));
    assert_eq!(page.matches("<figure").count(), 3);
}

#[test]
fn drawing_again_gives_the_same_bytes() {
    for settings in [CURVE, SURFACE] {
        assert!(drawn(&run(settings)) == drawn(&run(settings)));
    }
}

#[test]
fn partial_runs_are_drawn() {
    for settings in [CURVE, SURFACE] {
        let with = |change: &dyn Fn(&mut Run)| {
            let mut run = run(settings);
            change(&mut run);
            drawn(&run)
        };
        let none = with(&|run| run.rows.clear());
        assert_eq!(none.keys().collect::<Vec<_>>(), ["report.html"]);
        assert!(text(&none, "report.html").contains("nothing to say yet"));
        let one = with(&|run| run.rows.truncate(1));
        assert!(text(&one, "report.html").contains("Only 1 of"));
        let later = with(&|run| run.rows.retain(|row| row.trial == 1));
        assert!(later.contains_key("convergence.svg"));
        for touches in [0, 2, 8] {
            let failed = with(&|run| {
                for row in &mut run.rows {
                    row.touches.truncate(touches);
                    row.failure = Some("arm <lost>".into());
                }
            });
            assert!(text(&failed, "report.html").contains("arm &lt;lost&gt;"));
        }
    }
}

#[test]
fn a_surface_that_is_nowhere_is_drawn() {
    for settings in [CURVE, SURFACE] {
        let mut run = run(settings);
        run.truth.heights_m.fill(None);
        run.rows.iter_mut().flat_map(|row| &mut row.touches).for_each(|touch| touch.contact = None);
        for (name, bytes) in drawn(&run) {
            let text = String::from_utf8_lossy(&bytes);
            assert!(name.ends_with("png") || !text.contains("NaN"), "{name}");
        }
    }
}

#[test]
fn figures_of_an_earlier_run_do_not_stay() {
    let folder = tempfile::tempdir().unwrap();
    assert!(written(&run(CURVE), folder.path()).contains_key("curves.png"));
    let files = written(&run(SURFACE), folder.path());
    assert!(!files.contains_key("curves.png") && !files.contains_key("curves.svg"));
}

#[test]
fn rows_of_another_zone_are_refused() {
    let mut run = run(SURFACE);
    run.rows[0].touches[0].target.pop();
    let folder = tempfile::tempdir().unwrap();
    let error = format!("{:#}", report::write(&run, folder.path()).unwrap_err());
    assert!(error.contains("surfaces: trial 0 of random, touch 5: a target of 1"), "{error}");
}

#[test]
fn ticks_are_round() {
    let labels = |axis: Axis| axis.ticks().into_iter().map(|(_, label)| label).collect::<Vec<_>>();
    assert_eq!(labels(Axis::linear(-0.1, 0.32, 4.0)), ["0.0", "0.2"]);
    assert_eq!(labels(Axis::linear(-50.0, 50.0, 5.0)), ["−40", "−20", "0", "20", "40"]);
    assert_eq!(labels(Axis::log([0.03, 40.0]).unwrap()), ["0.1", "1", "10"]);
    assert_eq!(labels(Axis::log([2.0, 12.0]).unwrap()), ["2", "3", "5", "7", "10"]);
    assert!(Axis::log([0.0, f64::NAN]).is_none());
    // No range, or hardly one, must not make endless labels.
    assert!(labels(Axis::linear(1.0, 1.0, 5.0)).len() < 10);
    assert!(labels(Axis::linear(0.0, 1e-320, 5.0)).len() < 10);
}
