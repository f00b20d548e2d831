//! Hard cases of the skin's stiffness relative to the time step. A body with masses presses its
//! finger on a wall along a given path, and its force is compared with that of a run with shorter
//! steps.

use super::case::{Case, Outcome, all, case, require};
use super::checked_touch::environment_of;
use super::dynamic::{APPROACH_M_S, with_masses};
use super::finger_on_wall::{FingerOnWall, stiffen};
use super::solids::{mesh, wall};
use nalgebra::{Isometry3, Vector6};
use palpate::backend::{Backend, Command, Fault, Reading};
use palpate::explore::control::{Controller, Goal};
use palpate::robot::arm::ArmSettings;
use palpate::sim::Environment;
use palpate::sim::mujoco::{CompiledModels, DynamicBackend};
use palpate::task::Zone;
use std::sync::Arc;

pub const CASES: &[Case] = &[
    case(
        "stiff skin on a stage, at rest",
        "an explicit force diverges in steps above 2·sqrt(mass/stiffness)",
        "times stiffer",
        STIFF,
        |times, step_s| at_rest(times, step_s, false),
    )
    .stepped(),
    case(
        "stiff skin on an arm, at rest",
        "the same, with a mass that depends on the posture",
        "times stiffer",
        STIFF,
        |times, step_s| at_rest(times, step_s, true),
    )
    .stepped(),
    case(
        "stiff skin on a stage, at its peak",
        "servos and skin together decide the overshoot",
        "times stiffer",
        (STIFF.0, 3),
        |times, step_s| at_peak(times, step_s, false),
    )
    .known("a stable step need not be an accurate one")
    .stepped(),
    case(
        "stiff skin on an arm, at its peak",
        "the same, with servo time constants near the step and joint friction",
        "times stiffer",
        STIFF,
        |times, step_s| at_peak(times, step_s, true),
    )
    .known("a stable step need not be an accurate one")
    .stepped(),
    case(
        "long rest on a wall",
        "a velocity servo creeps, and errors of a million ticks accumulate",
        "ticks",
        (&[1e3, 1e4, 1e5, 1e6], 3),
        |ticks, _| long(ticks),
    ),
];

/// Steps are divided as the skin needs, so stiffness has no effect until no step is short enough.
const STIFF: (&[f64], usize) = (&[1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 1e6], 7);

/// Force of the press.
// heuristic: that of a typical touch.
const FORCE_N: f64 = 3.0;

/// Allowed relative deviation of a force from that of a refined run.
pub const TOLERANCE: f64 = 0.05;

/// Steps of the refined run per step.
// heuristic: an oscillation at the limit of [`StepLimit`](palpate::sim::mujoco::StepLimit) is then
// within a percent of the exact one.
const FINER: f64 = 8.0;

/// Time of the press until the force is at rest, and the evaluated part at its end.
// heuristic: four times 0.2 s, in which the controller removes two thirds of an error.
const REST_S: f64 = 0.8;
const LOOK_S: f64 = 0.1;

/// Time of the press that contains the peak: five times the 0.04 s in which the arm's servos stop.
const PEAK_S: f64 = 0.2;

/// A finger at home in front of a wall, and its goal.
struct WallPress {
    environment: Arc<Environment>,
    start: Isometry3<f64>,
    /// Distance until the skin is pressed with [`FORCE_N`].
    way_m: f64,
}

/// Force of the wall on the finger.
#[derive(Clone, Copy, Debug)]
struct PressForce {
    /// Peak force.
    peak_n: f64,
    /// Mean at the end, and the range there.
    rest_n: f64,
    ripple_n: f64,
}

impl WallPress {
    /// Creates the press with a skin `times` stiffer; `None` if it cannot be built.
    fn new(times: f64, step_s: f64, arm: bool) -> Option<Self> {
        let mut scene = with_masses(step_s);
        stiffen(&mut scene.effects, times);
        let mut face_w = [0.0; 3];
        if arm {
            let chain = ArmSettings::default().chain().ok()?;
            let tip = chain.forward(&chain.home).translation.vector;
            // The same distance as in front of a stage.
            face_w = [tip.x, tip.y - 0.01 - scene.finger.radius_m, tip.z];
            scene.arm = Some(ArmSettings::default());
        }
        let [x, y, z] = face_w;
        let zone = Zone::new([x - 0.03, x + 0.03], Some([z - 0.03, z + 0.03]));
        scene.zone = Some(Zone { datum_y_m: Some(y), ..zone });
        let setup = FingerOnWall::new(&scene.effects, 1.0)?;
        let depth_m = depth_m(&setup)?;
        let pressed_y_m = y + setup.at(depth_m, 0.0).x_wt.translation.y;
        let environment = environment_of(scene, mesh(wall(0.05), face_w)?).ok()?;
        let chain = environment.chain()?;
        let start = chain.forward(&chain.home);
        Some(Self { environment, start, way_m: start.translation.y - pressed_y_m })
    }

    /// The goal `time_s` after the start.
    fn goal(&self, time_s: f64) -> Goal {
        let gone_m = (APPROACH_M_S * time_s).min(self.way_m);
        let mut x_wt = self.start;
        x_wt.translation.y -= gone_m;
        let speed_m_s = if gone_m < self.way_m { APPROACH_M_S } else { 0.0 };
        Goal { x_wt, twist: Vector6::new(0.0, -speed_m_s, 0.0, 0.0, 0.0, 0.0) }
    }

    /// Follows the path to its end and stays there for `pressed_s`; passes every reading to a
    /// callback.
    fn press(
        &self,
        body: &mut dyn Backend,
        pressed_s: f64,
        see: &mut dyn FnMut(&Reading),
    ) -> Result<(), Fault> {
        let until_s = self.way_m / APPROACH_M_S + pressed_s;
        let chain = self.environment.chain().ok_or(Fault::NoResponse { time_s: 0.0 })?;
        let period_s = body.capabilities().period_s;
        let unusable = |_| Fault::Refused { values: Vec::new() };
        let mut control = Controller::new(chain, period_s).map_err(unusable)?;
        let mut reading = body.reset(0)?.clone();
        while reading.time_s < until_s {
            let motion = control
                .step(&reading.q, &self.goal(reading.time_s + period_s))
                .map_err(unusable)?;
            let qdot = motion.qdot.iter().copied().take(reading.q.len()).collect();
            reading.clone_from(body.step(&Command { qdot })?);
            see(&reading);
        }
        Ok(())
    }

    /// Force with steps of `step_s`, pressed for `pressed_s`.
    fn force(&self, step_s: f64, pressed_s: f64) -> Result<PressForce, String> {
        let models = CompiledModels::with_step(&self.environment, step_s)
            .map_err(|error| error.to_string())?;
        let mut body = DynamicBackend::new(&self.environment, &models).map_err(|_| "no body")?;
        let resting_s = self.way_m / APPROACH_M_S + pressed_s - LOOK_S;
        let (mut peak_n, mut resting) = (0.0_f64, Vec::new());
        self.press(&mut body, pressed_s, &mut |reading| {
            peak_n = peak_n.max(force_n(reading));
            if reading.time_s > resting_s {
                resting.push(force_n(reading));
            }
        })
        .map_err(|fault| fault.to_string())?;
        let rest_n = resting.iter().sum::<f64>() / resting.len() as f64;
        let most_n = resting.iter().copied().fold(f64::MIN, f64::max);
        let least_n = resting.iter().copied().fold(f64::MAX, f64::min);
        Ok(PressForce { peak_n, rest_n, ripple_n: most_n - least_n })
    }
}

fn force_n(reading: &Reading) -> f64 {
    reading.ideal_contact().map_or(0.0, |ideal| ideal.force_n)
}

/// Depth at which the skin bears [`FORCE_N`].
fn depth_m(setup: &FingerOnWall) -> Option<f64> {
    let (mut low_m, mut high_m) = (0.0, setup.finger.radius_m / 2.0);
    for _ in 0..50 {
        let middle_m = 0.5 * (low_m + high_m);
        match setup.force_n(middle_m) {
            Ok(force_n) if force_n < FORCE_N => low_m = middle_m,
            _ => high_m = middle_m,
        }
    }
    (setup.force_n(low_m).ok()? > 0.5 * FORCE_N).then_some(low_m)
}

/// Deviation of the force from that of a refined run, as shares of the latter.
#[derive(Clone, Copy, Debug)]
struct ForceDeviation {
    /// Deviation of the peak.
    peak: f64,
    /// Deviation at rest.
    rest: f64,
    /// Ripple at rest beyond that of the refined run.
    ripple: f64,
}

/// Presses the finger of a stage or an arm for `pressed_s` with a skin `times` stiffer. With
/// `divided` the time step is divided as in a scene; otherwise it is used unchanged.
///
/// # Errors
/// The reason of a rejection, or the fault with time and state.
fn force_deviation(
    times: f64,
    (step_s, divided): (f64, bool),
    arm: bool,
    pressed_s: f64,
) -> Result<ForceDeviation, String> {
    let press = WallPress::new(times, step_s, arm).ok_or("nothing to press")?;
    let models = CompiledModels::new(&press.environment).map_err(|error| error.to_string())?;
    let limited_s = models.plant.opt().timestep;
    let run = press.force(if divided { limited_s } else { step_s }, pressed_s)?;
    let exact = press.force(limited_s / FINER, pressed_s)?;
    let deviation = ForceDeviation {
        peak: run.peak_n / exact.peak_n - 1.0,
        rest: run.rest_n / exact.rest_n - 1.0,
        ripple: (run.ripple_n - exact.ripple_n) / exact.rest_n,
    };
    match [deviation.peak, deviation.rest, deviation.ripple].iter().all(|part| part.is_finite()) {
        true => Ok(deviation),
        false => Err(format!("{run:?} beside {exact:?}")),
    }
}

impl ForceDeviation {
    fn is_at_rest(&self) -> bool {
        self.rest.abs() <= TOLERANCE && self.ripple.abs() <= TOLERANCE
    }

    fn words(&self) -> String {
        let [peak, rest, ripple] = [self.peak, self.rest, self.ripple].map(|part| 100.0 * part);
        format!(
            "force off by {peak:+.1} % at its peak, {rest:+.1} % at rest, {ripple:+.1} % up and down"
        )
    }
}

/// Stiffness factors at which a margin is searched.
const TIMES: [f64; 15] =
    [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1e3, 2e3, 5e3, 1e4, 1e5, 1e6];

/// Returns the largest stiffness factor of a PA-10's skin, relative to a BioTac's, with steps of
/// `step_s`, `divided` as in a scene or unchanged. It is the largest of [`TIMES`] up to which the
/// force at rest is within [`TOLERANCE`] of a refined run's, or 0; the second value is the next
/// factor with its result.
pub fn stiffness_margin(step_s: f64, divided: bool) -> (f64, Option<(f64, String)>) {
    let mut margin = 0.0;
    for times in TIMES {
        let why = match force_deviation(times, (step_s, divided), true, REST_S) {
            Ok(deviation) if deviation.is_at_rest() => {
                margin = times;
                continue;
            }
            Ok(deviation) => deviation.words(),
            Err(words) => words,
        };
        return (margin, Some((times, why)));
    }
    (margin, None)
}

/// Requires finite numbers, and force and ripple at rest within [`TOLERANCE`] of a refined run.
fn at_rest(times: f64, step_s: f64, arm: bool) -> Outcome {
    match force_deviation(times, (step_s, true), arm, REST_S) {
        Ok(deviation) => require(deviation.is_at_rest(), || deviation.words()),
        Err(words) => Outcome::Faulted(words),
    }
}

/// The same requirement for the peak force.
fn at_peak(times: f64, step_s: f64, arm: bool) -> Outcome {
    match force_deviation(times, (step_s, true), arm, PEAK_S) {
        Ok(deviation) => require(deviation.peak.abs() <= TOLERANCE, || deviation.words()),
        Err(words) => Outcome::Faulted(words),
    }
}

/// Presses, then commands rest: the final position is that after a second within a hundredth of the
/// depth, and no joint moves faster than that implies.
fn long(ticks: f64) -> Outcome {
    let Some(press) = WallPress::new(1.0, 0.002, true) else {
        return Outcome::Wrong("nothing to press".into());
    };
    let run = || -> Result<Outcome, Fault> {
        let lost = Fault::NoResponse { time_s: 0.0 };
        let models =
            CompiledModels::with_step(&press.environment, 0.002).map_err(|_| lost.clone())?;
        let mut body = DynamicBackend::new(&press.environment, &models)?;
        let chain = press.environment.chain().ok_or(lost)?;
        let mut last = Reading::default();
        press.press(&mut body, REST_S, &mut |reading| last.clone_from(reading))?;
        let still = Command { qdot: vec![0.0; last.q.len()] };
        let mut after = |ticks: u32| -> Result<Reading, Fault> {
            (1..ticks).try_for_each(|_| body.step(&still).map(drop))?;
            body.step(&still).cloned()
        };
        let (first, last) = (after(500)?, after(ticks as u32)?);
        let tip = |reading: &Reading| {
            let q = chain.joints_from(&reading.q).unwrap_or(chain.home);
            chain.forward(&q).translation.vector
        };
        let moved_m = (tip(&last) - tip(&first)).norm();
        let change = (force_n(&last) - force_n(&first)).abs() / force_n(&first);
        let fastest = last.qdot.iter().fold(0.0_f64, |most, qdot| most.max(qdot.abs()));
        Ok(all([
            require(moved_m <= CREEP_M, || format!("crept by {:.4} mm", 1e3 * moved_m)),
            require(change <= 0.01, || format!("force changed by {:.2} %", 100.0 * change)),
            require(fastest <= STILL, || format!("{fastest:.1e} rad/s at rest")),
        ]))
    };
    run().unwrap_or_else(|fault| Outcome::Faulted(fault.to_string()))
}

/// A hundredth of the depth at which a skin bears 3 N.
const CREEP_M: f64 = 1e-5;

/// Joint speed below which a joint counts as at rest, rad/s.
// heuristic: the tip, a metre away, moves a micrometre in a second.
const STILL: f64 = 1e-6;
