//! What must hold before a body is moved for the first time.

use crate::backend::{Backend, Command, Fault, Reading, Wrench};
use crate::robot::arm::Chain;
use crate::robot::finger::Frame;
use crate::robot::finger::frame::{ELECTRODES, FULL_SCALE_COUNTS};
use nalgebra::Vector3;
use palpate_input::config::{Checked, Rules};
use palpate_input::error::Invalid;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How a body is looked at before it moves; figures without a source are chosen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct GateSettings {
    /// How long it is held still.
    pub hold_s: f64,
    /// By how much a joint may move meanwhile, rad or m.
    pub still: f64,
    /// By how much a joint may be away from where it is expected, rad or m.
    pub near: f64,
    /// By how much the force may drift, from the mean of the first to that of the last quarter.
    pub drift_n: f64,
    /// Largest standard deviation of an electrode: real ones have 3 to 11 counts.
    pub noise_counts: f64,
}

impl Default for GateSettings {
    fn default() -> Self {
        Self { hold_s: 2.0, still: 2e-3, near: 0.02, drift_n: 0.5, noise_counts: 30.0 }
    }
}

impl Checked for GateSettings {
    fn check(&self, rules: &mut Rules) {
        rules.number("hold_s", self.hold_s, 0.1..=60.0);
        rules.number("still", self.still, 1e-6..=1.0);
        rules.number("near", self.near, 1e-6..=10.0);
        rules.number("drift_n", self.drift_n, 1e-3..=100.0);
        rules.number("noise_counts", self.noise_counts, 0.1..=4095.0);
    }
}

/// A body at rest in free air.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Baseline {
    /// Joint positions at the end.
    pub q: Vec<f64>,
    /// Mean of the wrench: its bias and the finger's weight.
    pub wrench: Option<Wrench>,
    /// Tactile frames that came.
    pub frames: usize,
    /// Mean of each electrode.
    pub electrode_counts: Option<[f64; ELECTRODES]>,
}

/// Holds `body`, which moves `chain`, still after its reset, and looks at joints and sensors. Its
/// joints must stand near `expected_q`, if that is known, and tactile frames must come if it
/// `sends_frames`.
///
/// # Errors
/// The first thing that is not as it must be.
pub fn check_start(
    body: &mut dyn Backend,
    chain: &Chain,
    expected_q: Option<&[f64]>,
    sends_frames: bool,
    settings: &GateSettings,
    seed: u64,
) -> Result<Baseline, Fault> {
    body.capabilities().fit(chain)?;
    let still = Command { qdot: vec![0.0; chain.joints.len()] };
    let ticks = (settings.hold_s / body.capabilities().period_s).ceil() as usize;
    let mut readings: Vec<Reading> = Vec::with_capacity(ticks + 1);
    readings.push(body.reset(seed)?.clone());
    for _ in 0..ticks {
        readings.push(body.step(&still)?.clone());
    }
    readings.iter().try_for_each(Reading::check)?;
    check_joints(&readings, chain, expected_q, settings)?;
    let wrench = check_force(&readings, settings)?;
    let frames: Vec<&Frame> = readings.iter().flat_map(Reading::frames).collect();
    if frames.is_empty() && sends_frames {
        return Err(Invalid::new(format!("no tactile frame in {} s", settings.hold_s)).into());
    }
    let noisy = body.capabilities().real_time;
    let electrode_counts = check_electrodes(&frames, settings, noisy)?;
    let q = readings.last().map(|reading| reading.q.clone()).unwrap_or_default();
    Ok(Baseline { q, wrench, frames: frames.len(), electrode_counts })
}

fn check_joints(
    readings: &[Reading],
    chain: &Chain,
    expected: Option<&[f64]>,
    settings: &GateSettings,
) -> Result<(), Invalid> {
    for (i, joint) in chain.joints.iter().enumerate() {
        let places = || readings.iter().filter_map(|reading| reading.q.get(i).copied());
        let (name, [low, high]) = (&joint.name, joint.q_limits);
        let (least, most) =
            places().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), q| (a.min(q), b.max(q)));
        let Some(q) = places().next_back() else { continue };
        if let Some(q) = [least, most].into_iter().find(|q| !(low..=high).contains(q)) {
            return Err(Invalid::new(format!(
                "joint {name} stands at {q:.4}, outside its limits {low:.4} to {high:.4}"
            )));
        }
        if let Some(&expected) = expected.and_then(|expected| expected.get(i))
            && (q - expected).abs() > settings.near
        {
            let (away, allowed) = ((q - expected).abs(), settings.near);
            return Err(Invalid::new(format!(
                "joint {name} stands at {q:.4}, {away:.4} from where it is expected; allowed are {allowed}"
            )));
        }
        let (moved, allowed) = (most - least, settings.still);
        if moved > allowed {
            return Err(Invalid::new(format!(
                "joint {name} moved by {moved:.5} while told to stand still; allowed are {allowed}"
            )));
        }
    }
    Ok(())
}

/// The mean wrench; none without a sensor.
fn check_force(readings: &[Reading], settings: &GateSettings) -> Result<Option<Wrench>, Invalid> {
    let wrenches: Vec<Wrench> = readings.iter().filter_map(|reading| reading.wrench).collect();
    let quarter = wrenches.len() / 4;
    if quarter == 0 {
        return Ok(None);
    }
    let mean = |part: &[Wrench], of: fn(&Wrench) -> Vector3<f64>| {
        part.iter().map(of).sum::<Vector3<f64>>() / part.len() as f64
    };
    let force = |part: &[Wrench]| mean(part, |wrench| wrench.force_n);
    let drift_n =
        (force(&wrenches[wrenches.len() - quarter..]) - force(&wrenches[..quarter])).norm();
    let allowed_n = settings.drift_n;
    if drift_n > allowed_n {
        return Err(Invalid::new(format!(
            "the force at rest drifts by {drift_n:.3} N; allowed are {allowed_n} N"
        )));
    }
    let torque_nm = mean(&wrenches, |wrench| wrench.torque_nm);
    Ok(Some(Wrench { force_n: force(&wrenches), torque_nm }))
}

/// The mean of each electrode; one without noise is frozen, if the sensor is `noisy`.
fn check_electrodes(
    frames: &[&Frame],
    settings: &GateSettings,
    noisy: bool,
) -> Result<Option<[f64; ELECTRODES]>, Invalid> {
    let all: Vec<[f64; ELECTRODES]> =
        frames.iter().filter_map(|frame| frame.electrode_counts).collect();
    if all.len() < 2 {
        return Ok(None);
    }
    let count = all.len() as f64;
    let mut means = [0.0; ELECTRODES];
    for (i, mean) in means.iter_mut().enumerate() {
        *mean = all.iter().map(|counts| counts[i]).sum::<f64>() / count;
        let square = all.iter().map(|counts| (counts[i] - *mean).powi(2)).sum::<f64>();
        let sd_counts = (square / (count - 1.0)).sqrt();
        let is_inside = *mean > 0.0 && *mean < FULL_SCALE_COUNTS;
        let is_alive = sd_counts > 0.0 || !noisy;
        if !(is_inside && is_alive && sd_counts <= settings.noise_counts) {
            let (electrode, allowed_counts) = (i + 1, settings.noise_counts);
            return Err(Invalid::new(format!(
                "electrode E{electrode} at rest is {mean:.1} counts with a standard deviation of \
                 {sd_counts:.2}; allowed is a value inside 0 to 4095 with one above 0 and at most {allowed_counts}"
            )));
        }
    }
    Ok(Some(means))
}
