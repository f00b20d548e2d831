//! Synthetic runs, so that no trial has to be run.

use super::outcomes::outcome;
use palpate::experiment::experiment::Experiment;
use palpate::experiment::metrics::Metrics;
use palpate::experiment::metrics::truth::Truth;
use palpate::experiment::row::{TouchRow, TrialRow};
use palpate::experiment::store::Run;
use palpate::explore::evidence::{Contact, Outcome};
use palpate::gp::fit::Fit;
use palpate::gp::kernel::Hyperparameters;
use palpate::math::optimize::Stop;
use palpate::robot::Finger;
use palpate::task::Zone;

pub const CURVE: &str = r#"
name = "curve"
question = "Is <script>alert('1')</script> & \"this\" safe?"
planners = ["active", "random", "sobol"]
trials = 2
initial_touches = 3
touches = 12
grid = 41
[scene]
simulator = "analytic"
function = "toy"
zone = { x_m = [-0.02, 0.02] }
"#;

pub const SURFACE: &str = r#"
name = "surface"
planners = ["random", "active"]
trials = 2
initial_touches = 5
touches = 20
grid = 21
report = { touch_counts = [5, 12, 20] }
[scene]
simulator = "swept"
zone = { x_m = [-0.05, 0.05], z_m = [-0.07, 0.07], datum_y_m = -0.6 }
object = { mesh = "none.obj" }
"#;

/// An elliptic cylinder with a bump, and nothing beyond its sides; a wave in 1-D.
fn height_m(place: &[f64]) -> Option<f64> {
    match place {
        [x, z] => {
            let bump = 0.01 * (-((x - 0.01).powi(2) + z * z) / 2e-4).exp();
            (x.abs() < 0.046).then(|| 0.04 * (1.0 - (x / 0.05).powi(2)).sqrt() + bump)
        }
        _ => Some(1.0 + (5.0 * place[0]).sin()),
    }
}

/// A run of an experiment with synthetic touches.
pub fn run(text: &str) -> Run {
    let experiment: Experiment = toml::from_str(text).unwrap();
    let zone = experiment.scene.zone.as_ref().unwrap();
    let places = zone.grid(experiment.grid as usize);
    let heights_m = places.iter().map(|place| height_m(place)).collect();
    let is_reachable = vec![true; places.len()];
    let truth = Truth::new(zone, places, heights_m, is_reachable);
    let rows = (0..experiment.trials)
        .flat_map(|trial| experiment.planners.iter().map(move |planner| (trial, planner)))
        .map(|(trial, planner)| row(&experiment, trial, planner))
        .collect();
    Run { experiment, truth, rows, unlisted: 0 }
}

fn row(experiment: &Experiment, trial: u32, planner: &str) -> TrialRow {
    let touches =
        (1..=experiment.touches).map(|count| touch(experiment, (trial, planner), count)).collect();
    let row = TrialRow::without_touches(trial, planner, None);
    TrialRow { touches, ..row }
}

/// Outcome of a miss at `target`, with the position at which the finger turns back.
pub fn miss(zone: &Zone, finger: &Finger, target: &[f64]) -> Outcome {
    outcome(zone, finger, zone.point(target, -0.1), None)
}

fn touch(experiment: &Experiment, (trial, planner): (u32, &str), count: u32) -> TouchRow {
    let zone = experiment.scene.zone.as_ref().unwrap();
    // Multiples of two irrational numbers spread evenly over the zone.
    let is_initial = count <= experiment.initial_touches;
    let shift = if is_initial { 0.0 } else { 0.37 * f64::from(planner.as_bytes()[0]) };
    let step = f64::from(count + 100 * trial) + shift;
    let target = zone.at(&[(0.618 * step).fract(), (0.755 * step).fract()]);
    let fit = Fit {
        kernel: None,
        hyperparameters: Hyperparameters {
            signal_sd: 0.05,
            length_scales: zone.extents_m().iter().map(|side| 0.3 * side).collect(),
            noise_sd: 1e-4,
            slope_noise_sd: 0.0,
            common_sd: None,
            mean: 0.0,
        },
        log_likelihood: 0.0,
        nystrom_residual_sd: None,
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
        reachable_coverage: Some(0.9),
        unreachable_coverage: None,
        interval_score_m: Some(error_m),
        nlpd: Some(-3.0),
    };
    let is_fitted = count >= experiment.initial_touches;
    TouchRow {
        likeness: None,
        silhouette: None,
        shape: None,
        recognition: None,
        outcome: match height_m(&target) {
            Some(height_m) => {
                let against_w = -zone.ahead_w().into_inner();
                let contact = Contact::new(zone.point(&target, height_m), against_w);
                Contact { has_normal: false, ..contact }.into()
            }
            None => miss(zone, &experiment.scene.finger, &target),
        },
        target: target.into(),
        planned_sd_m: (count > experiment.initial_touches).then_some(1e-3),
        fallback: None,
        fit: is_fitted.then_some(fit),
        rmse_bound_m: None,
        jitter: 0.0,
        metrics: is_fitted.then_some(metrics),
    }
}
