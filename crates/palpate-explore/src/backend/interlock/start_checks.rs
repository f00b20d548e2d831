//! Start checks: conditions before a robot moves for the first time.

use crate::backend::{Backend, Command, Fault, Reading, Wrench};
use crate::robot::arm::Chain;
use crate::robot::finger::Frame;
use crate::robot::finger::frame::{ELECTRODES, FULL_SCALE_COUNTS};
use nalgebra::Vector3;
use palpate_input::config::{Rules, Validate};
use palpate_input::error::InputError;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Settings of the start checks; values without a source are heuristics.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct StartCheckSettings {
    /// Largest drift of the force at rest, N, between the means of the first and last quarter.
    pub drift_n: f64,
    /// Largest standard deviation of an electrode, counts; real ones have 3 to 11.
    pub noise_counts: f64,
    /// Largest distance of the fingertip by the driver's frames from that by the arm's model, m.
    pub model_m: f64,
}

impl Default for StartCheckSettings {
    fn default() -> Self {
        Self { drift_n: 0.5, noise_counts: 30.0, model_m: 5e-4 }
    }
}

impl Validate for StartCheckSettings {
    fn check(&self, rules: &mut Rules) {
        rules.number("drift_n", self.drift_n, 1e-3..=100.0);
        rules.number("noise_counts", self.noise_counts, 0.1..=4095.0);
        rules.number("model_m", self.model_m, 1e-6..=10.0);
    }
}

/// Duration of the check at rest.
// heuristic: 200 tactile frames, enough for a standard deviation to 5 %.
pub const HOLD_S: f64 = 2.0;

/// Largest movement of a joint during the check, rad or m.
// heuristic: 2 mm of the tip at a reach of 1 m.
pub const START_TOLERANCE: f64 = 2e-3;

/// Commands `body`, which moves `chain`, to rest after its reset, and checks joints and sensors.
///
/// # Errors
/// The first check that fails.
pub fn check_start(
    body: &mut dyn Backend,
    chain: &Chain,
    settings: &StartCheckSettings,
    seed: u64,
) -> Result<(), Fault> {
    body.capabilities().fit(chain)?;
    let still = Command { qdot: vec![0.0; chain.joints.len()] };
    let ticks = (HOLD_S / body.capabilities().period_s).ceil() as usize;
    let mut readings: Vec<Reading> = Vec::with_capacity(ticks + 1);
    readings.push(body.reset(seed)?.clone());
    for _ in 0..ticks {
        readings.push(body.step(&still)?.clone());
    }
    readings.iter().try_for_each(Reading::check)?;
    check_joints(&readings, chain)?;
    check_force(&readings, settings.drift_n)?;
    if body.capabilities().tactile {
        check_electrodes(&readings, settings.noise_counts, body.capabilities().real_time)?;
    }
    Ok(())
}

fn check_joints(readings: &[Reading], chain: &Chain) -> Result<(), InputError> {
    for (i, joint) in chain.joints.iter().enumerate() {
        let places = readings.iter().filter_map(|reading| reading.q.get(i).copied());
        let (name, [low, high]) = (&joint.name, joint.q_limits);
        let (least, most) =
            places.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), q| (a.min(q), b.max(q)));
        if let Some(q) = [least, most].into_iter().find(|q| !(low..=high).contains(q)) {
            return Err(InputError::new(format!(
                "the position {q:.4} of joint {name} is outside its limits {low:.4} to {high:.4}"
            )));
        }
        let moved = most - least;
        if moved > START_TOLERANCE {
            return Err(InputError::new(format!(
                "joint {name} moved by {moved:.5} while commanded to rest; allowed is {START_TOLERANCE}"
            )));
        }
    }
    Ok(())
}

fn check_force(readings: &[Reading], allowed_n: f64) -> Result<(), InputError> {
    let wrenches: Vec<Wrench> = readings.iter().filter_map(|reading| reading.wrench).collect();
    let quarter = wrenches.len() / 4;
    if quarter == 0 {
        return Ok(());
    }
    let mean_n = |part: &[Wrench]| {
        part.iter().map(|wrench| wrench.force_n).sum::<Vector3<f64>>() / part.len() as f64
    };
    let drift_n =
        (mean_n(&wrenches[wrenches.len() - quarter..]) - mean_n(&wrenches[..quarter])).norm();
    match drift_n > allowed_n {
        false => Ok(()),
        true => Err(InputError::new(format!(
            "the force at rest drifts by {drift_n:.3} N; allowed is {allowed_n} N"
        ))),
    }
}

/// Checks that frames arrive and that electrodes change, if the sensor is `noisy`.
fn check_electrodes(
    readings: &[Reading],
    allowed_counts: f64,
    noisy: bool,
) -> Result<(), InputError> {
    let frames: Vec<&Frame> = readings.iter().flat_map(Reading::frames).collect();
    if frames.is_empty() {
        return Err(InputError::new(format!("no tactile frame received in {HOLD_S} s")));
    }
    let all: Vec<[f64; ELECTRODES]> =
        frames.iter().filter_map(|frame| frame.electrode_counts).collect();
    if all.len() < 2 {
        return Ok(());
    }
    let count = all.len() as f64;
    for i in 0..ELECTRODES {
        let mean = all.iter().map(|counts| counts[i]).sum::<f64>() / count;
        let square = all.iter().map(|counts| (counts[i] - mean).powi(2)).sum::<f64>();
        let sd_counts = (square / (count - 1.0)).sqrt();
        let is_inside = mean > 0.0 && mean < FULL_SCALE_COUNTS;
        let is_alive = sd_counts > 0.0 || !noisy;
        if !(is_inside && is_alive && sd_counts <= allowed_counts) {
            let electrode = i + 1;
            return Err(InputError::new(format!(
                "electrode E{electrode} at rest is {mean:.1} counts with a standard deviation of \
                 {sd_counts:.2}; allowed are a mean between 0 and 4095 and a standard deviation above 0 and at most {allowed_counts}"
            )));
        }
    }
    Ok(())
}
