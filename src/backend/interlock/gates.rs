//! What must hold before a body is moved for the first time.

use crate::backend::{Backend, Command, Fault, Reading, Wrench};
use crate::config::{Checked, Rules};
use crate::robot::arm::Chain;
use crate::robot::finger::Frame;
use crate::robot::finger::frame::{ELECTRODES, FULL_SCALE_COUNTS};
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use thiserror::Error;

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

/// Why a body must not be moved yet.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum GateError {
    /// It could not be held still at all.
    #[error(transparent)]
    Fault(#[from] Fault),
    /// A joint stands outside its limits.
    #[error("joint {joint} stands at {q:.4}, outside its limits {low:.4} to {high:.4}")]
    Outside {
        /// The joint.
        joint: Arc<str>,
        /// Where it stands, rad or m.
        q: f64,
        /// Its smallest position.
        low: f64,
        /// Its largest position.
        high: f64,
    },
    /// A joint does not stand where it is expected.
    #[error(
        "joint {joint} stands at {q:.4}, {:.4} from where it is expected; allowed are {allowed}",
        (q - expected).abs()
    )]
    Away {
        /// The joint.
        joint: Arc<str>,
        /// Where it stands, rad or m.
        q: f64,
        /// Where it is expected.
        expected: f64,
        /// Largest difference.
        allowed: f64,
    },
    /// A joint moves though it is told to stand still.
    #[error("joint {joint} moved by {moved:.5} while told to stand still; allowed are {allowed}")]
    Moves {
        /// The joint.
        joint: Arc<str>,
        /// By how much, rad or m.
        moved: f64,
        /// Largest allowed.
        allowed: f64,
    },
    /// The force/torque sensor drifts.
    #[error("the force at rest drifts by {drift_n:.3} N; allowed are {allowed_n} N")]
    Drifts {
        /// By how much.
        drift_n: f64,
        /// Largest allowed.
        allowed_n: f64,
    },
    /// No tactile frame came, though some are expected.
    #[error("no tactile frame in {hold_s} s")]
    NoFrames {
        /// For how long it was waited.
        hold_s: f64,
    },
    /// An electrode at rest shows what none can.
    #[error(
        "electrode E{electrode} at rest is {mean_counts:.1} counts with a standard deviation of \
         {sd_counts:.2}; allowed is a value inside 0 to 4095 with one above 0 and at most {allowed_counts}"
    )]
    Electrode {
        /// Its number, from 1.
        electrode: usize,
        /// Its mean.
        mean_counts: f64,
        /// Its standard deviation.
        sd_counts: f64,
        /// Largest deviation allowed.
        allowed_counts: f64,
    },
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

/// What is expected of a body at its start.
#[derive(Clone, Copy, Debug, Default)]
pub struct Expected<'a> {
    /// Joint positions, if they are known.
    pub q: Option<&'a [f64]>,
    /// Whether it has a tactile sensor that sends frames.
    pub sends_frames: bool,
}

/// Holds `body`, which moves `chain`, still after its reset, and looks at joints and sensors.
///
/// # Errors
/// The first thing that is not as it must be.
pub fn check_start(
    body: &mut dyn Backend,
    chain: &Chain,
    expected: Expected,
    settings: &GateSettings,
    seed: u64,
) -> Result<Baseline, GateError> {
    body.capabilities().fit(chain)?;
    let still = Command { qdot: vec![0.0; chain.joints.len()] };
    let ticks = (settings.hold_s / body.capabilities().period_s).ceil() as usize;
    let mut readings: Vec<Reading> = Vec::with_capacity(ticks + 1);
    readings.push(body.reset(seed)?.clone());
    for _ in 0..ticks {
        readings.push(body.step(&still)?.clone());
    }
    readings.iter().try_for_each(Reading::check)?;
    check_joints(&readings, chain, expected.q, settings)?;
    let wrench = check_force(&readings, settings)?;
    let frames: Vec<&Frame> = readings.iter().flat_map(Reading::frames).collect();
    if frames.is_empty() && expected.sends_frames {
        return Err(GateError::NoFrames { hold_s: settings.hold_s });
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
) -> Result<(), GateError> {
    for (i, joint) in chain.joints.iter().enumerate() {
        let places = || readings.iter().filter_map(|reading| reading.q.get(i).copied());
        let [low, high] = joint.q_limits;
        let (least, most) =
            places().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), q| (a.min(q), b.max(q)));
        let Some(q) = places().next_back() else { continue };
        if let Some(q) = [least, most].into_iter().find(|q| !(low..=high).contains(q)) {
            return Err(GateError::Outside { joint: joint.name.clone(), q, low, high });
        }
        if let Some(&expected) = expected.and_then(|expected| expected.get(i))
            && (q - expected).abs() > settings.near
        {
            return Err(GateError::Away {
                joint: joint.name.clone(),
                q,
                expected,
                allowed: settings.near,
            });
        }
        let moved = most - least;
        if moved > settings.still {
            return Err(GateError::Moves {
                joint: joint.name.clone(),
                moved,
                allowed: settings.still,
            });
        }
    }
    Ok(())
}

/// The mean wrench; none without a sensor.
fn check_force(readings: &[Reading], settings: &GateSettings) -> Result<Option<Wrench>, GateError> {
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
    if drift_n > settings.drift_n {
        return Err(GateError::Drifts { drift_n, allowed_n: settings.drift_n });
    }
    let torque_nm = mean(&wrenches, |wrench| wrench.torque_nm);
    Ok(Some(Wrench { force_n: force(&wrenches), torque_nm }))
}

/// The mean of each electrode; one without noise is frozen, if the sensor is `noisy`.
fn check_electrodes(
    frames: &[&Frame],
    settings: &GateSettings,
    noisy: bool,
) -> Result<Option<[f64; ELECTRODES]>, GateError> {
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
            let (electrode, mean_counts) = (i + 1, *mean);
            let allowed_counts = settings.noise_counts;
            return Err(GateError::Electrode { electrode, mean_counts, sd_counts, allowed_counts });
        }
    }
    Ok(Some(means))
}
