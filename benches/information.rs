//! Information in a touch besides its height: contact normals and swept free space. Each is
//! compared with the same trials without it, with the body's own contacts (exact, or located by
//! electrodes) and with the errors of an estimate added.
//!
//! `cargo bench --bench information -- toy container bird` prints a table of each experiment; a
//! number after a name is its number of trials, and `own` or `estimated`, `active` or `slope`
//! selects these alone.

use nalgebra::{Rotation3, Unit, Vector3};
use palpate::backend::Fault;
use palpate::experiment::measure::RMSE;
use palpate::experiment::metrics::Metrics;
use palpate::experiment::row::TrialRow;
use palpate::experiment::statistics::equal_error::{IntervalEstimate, equal_error};
use palpate::experiment::statistics::{PairedDifference, median};
use palpate::experiment::{Experiment, Simulation};
use palpate::explore::evidence::{Contact, Evidence, Outcome};
use palpate::explore::planner;
use palpate::explore::probe::Probe;
use palpate::math::seed;
use palpate::task::Action;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::path::Path;
use std::time::Instant;

/// Standard deviation of the tilt about either tangent. With two tangents the median angle is 1.177
/// times this, 17°, the middle of the range of a real BioTac's estimate on a flat plate
/// (MiaoLi/syntouchcontact recordings).
const TILT_RAD: f64 = 0.252;
// heuristic: error of each coordinate of the contact.
const PLACE_SD_M: f64 = 1e-3;

/// Probe whose contacts are estimates.
struct Estimating {
    exact: Box<dyn Probe>,
    rng: ChaCha8Rng,
}

impl Estimating {
    /// Draws a standard normal number (Box–Muller).
    fn normal(&mut self) -> f64 {
        let [a, b]: [f64; 2] = [self.rng.random(), self.rng.random()];
        (-2.0 * (1.0 - a).ln()).sqrt() * (std::f64::consts::TAU * b).cos()
    }

    fn normals(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.normal())
    }
}

impl Probe for Estimating {
    fn execute(&mut self, action: &Action) -> Result<Outcome, Fault> {
        let mut outcome = self.exact.execute(action)?;
        let (moved, turned) = (PLACE_SD_M * self.normals(), TILT_RAD * self.normals());
        for evidence in &mut outcome.evidence {
            let Evidence::Points(points) = evidence else { continue };
            let Some(Contact { p_wc, normal_w, .. }) = points.points.first() else { continue };
            let tangent = turned - normal_w * turned.dot(normal_w);
            let (axis, angle) = Unit::new_and_get(tangent);
            let normal_w = Rotation3::from_axis_angle(&axis, angle) * normal_w;
            *points = Contact::new(p_wc + moved, normal_w).into();
        }
        Ok(outcome)
    }

    fn time_s(&self) -> Option<f64> {
        self.exact.time_s()
    }
}

/// Name and settings of each belief; the first is the reference of the others.
const BELIEFS: [(&str, &[&str]); 4] = [
    ("heights", &[]),
    ("normals", &["gp.normals=true"]),
    ("free space", &["gp.free_space=true"]),
    ("both", &["gp.normals=true", "gp.free_space=true"]),
];

/// Arguments that are not experiments: source of the contacts, and planner; if one is missing, both
/// of its values are run.
const WORDS: [&str; 4] = ["own", "estimated", "active", "slope"];

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|word| word != "--bench").collect();
    for (i, name) in words.iter().enumerate() {
        if name.parse::<u32>().is_ok() || WORDS.contains(&name.as_str()) {
            continue;
        }
        let trials = words.get(i + 1).and_then(|word| word.parse().ok()).unwrap_or(4);
        println!(
            "\n| {name} | contacts | belief | final RMSE | outer tenth | against heights | touches | covered | s |"
        );
        println!("|---|---|---|---|---|---|---|---|---|");
        let is_asked = |group: &[&str], word: &str| {
            let is_said = |word: &str| words.iter().any(|said| said == word);
            is_said(word) || !group.iter().any(|word| is_said(word))
        };
        let [own, estimated, active, slope] = WORDS;
        for contacts in [own, estimated].iter().filter(|word| is_asked(&[own, estimated], word)) {
            for planner in [active, slope].iter().filter(|word| is_asked(&[active, slope], word)) {
                compare(name, trials, *contacts == own, planner);
            }
        }
    }
}

fn compare(name: &str, trials: u32, is_own: bool, planner: &str) {
    let mut baseline: Option<Vec<TrialRow>> = None;
    for (belief, settings) in BELIEFS {
        let mut sets: Vec<String> = settings.iter().map(|set| set.to_string()).collect();
        // A millimetre is more than the default hundredth of the relief.
        if !is_own {
            sets.push("gp.noise=[1e-4, 0.3]".into());
        }
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("experiments/{name}.toml"));
        let Ok(experiment) = Experiment::load(&path, &sets) else { return eprintln!("no {name}") };
        if experiment.scene.object.is_none() && settings.contains(&"gp.free_space=true") {
            continue;
        }
        let Ok(simulation) = Simulation::new(experiment) else { return };
        let experiment = simulation.experiment();
        let Some(entry) = planner::by_name(planner) else { return };
        let begun = Instant::now();
        let rows: Vec<TrialRow> = (0..trials)
            .map(|number| {
                let mut row = if is_own {
                    simulation.trial(entry, number)
                } else {
                    let rng = seed::stream(experiment.seed, number.into(), "estimates");
                    let exact = simulation.simulator().probe(number.into()).unwrap();
                    let mut probe = Estimating { exact, rng };
                    simulation.trial_with(&mut probe, entry, number, &mut |_| Ok(None))
                };
                row.planner = belief.into();
                row
            })
            .collect();
        let seconds = begun.elapsed().as_secs_f64() / f64::from(trials);
        let failed = rows.iter().filter(|row| row.failure.is_some()).count();
        let unit = if experiment.scene.object.is_some() { 1e3 } else { 1.0 };
        let heights = baseline.get_or_insert_with(|| rows.clone());
        let rmse = |metrics: &Metrics| unit * metrics.rmse_m;
        let both: Vec<TrialRow> = heights.iter().chain(&rows).cloned().collect();
        let equal = equal_error(experiment, &both, [belief, BELIEFS[0].0], &RMSE);
        let equal = equal.filter(|_| belief != BELIEFS[0].0).map_or(String::new(), |equal| {
            format!("{} × {}", shown(&equal.touches, 0), shown(&equal.ratio, 2))
        });
        let finals = after(&rows, experiment.touches, rmse);
        let edges = after(&rows, experiment.touches, |m| unit * m.edge_rmse_m.unwrap_or(f64::NAN));
        let covered = after(&rows, experiment.touches, |m| m.coverage.unwrap_or(f64::NAN));
        let pairs: Vec<(f64, f64)> =
            finals.iter().copied().zip(after(heights, experiment.touches, rmse)).collect();
        let against =
            PairedDifference::new(&pairs, experiment.seed).map_or(String::new(), |paired| {
                let [low, high] = paired.interval.unwrap_or([f64::NAN; 2]);
                format!("{:+.3} [{low:+.3}, {high:+.3}]", paired.mean)
            });
        println!(
            "| {planner} | {} | {belief} | {:.3} | {:.3} | {against} | {equal} | {:.2} | {seconds:.2} |{}",
            match (is_own, experiment.scene.effects.electrodes.is_some()) {
                (true, true) => "electrodes",
                (true, false) => "exact",
                (false, _) => "estimated",
            },
            median(&finals).unwrap_or(f64::NAN),
            median(&edges).unwrap_or(f64::NAN),
            median(&covered).unwrap_or(f64::NAN),
            if failed > 0 { format!(" {failed} failed") } else { String::new() },
        );
    }
}

/// Formats an estimate with its interval; a dash if the error is not reached.
fn shown(estimate: &IntervalEstimate, decimals: usize) -> String {
    let number = |value: f64| match value.is_finite() {
        true => format!("{value:.decimals$}"),
        false => "–".into(),
    };
    let [low, high] = estimate.interval.unwrap_or([f64::NAN; 2]);
    format!("{} [{}, {}]", number(estimate.value), number(low), number(high))
}

/// Returns a measure of every trial after `count` touches.
fn after(rows: &[TrialRow], count: u32, measure: impl Fn(&Metrics) -> f64) -> Vec<f64> {
    let touches = rows.iter().filter_map(|row| row.touches.get(count as usize - 1));
    touches.filter_map(|touch| touch.metrics.as_ref().map(&measure)).collect()
}
