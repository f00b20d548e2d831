//! How stiff a skin may be for the time step: a body with masses presses its finger on a wall along
//! a path given in time, and its force is held against that of a run with shorter steps.

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
use palpate::sim::mujoco::{Dynamic, Models};
use palpate::task::Zone;
use std::sync::Arc;

pub const CASES: &[Case] = &[
    case(
        "stiff skin on a stage, at rest",
        "an explicit force blows up in steps longer than twice the square root of mass over stiffness",
        "times stiffer",
        STIFF,
        |times, step_s| at_rest(times, step_s, false),
    )
    .stepped(),
    case(
        "stiff skin on an arm, at rest",
        "the same with a mass that depends on the posture",
        "times stiffer",
        STIFF,
        |times, step_s| at_rest(times, step_s, true),
    )
    .stepped(),
    case(
        "stiff skin on a stage, at its peak",
        "how far the finger goes on is decided by servos and skin together",
        "times stiffer",
        (STIFF.0, 3),
        |times, step_s| at_peak(times, step_s, false),
    )
    .known("a stable step need not be an accurate one")
    .stepped(),
    case(
        "stiff skin on an arm, at its peak",
        "the same with servos whose time constants are those of the step, and joints that rub",
        "times stiffer",
        STIFF,
        |times, step_s| at_peak(times, step_s, true),
    )
    .known("a stable step need not be an accurate one")
    .stepped(),
    case(
        "long rest on a wall",
        "a servo without position creeps, and errors of a million ticks add up",
        "ticks",
        (&[1e3, 1e4, 1e5, 1e6], 3),
        |ticks, _| long(ticks),
    ),
];

/// Steps are divided as the skin needs it, so stiffness must not matter until no step is short
/// enough.
const STIFF: (&[f64], usize) = (&[1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 1e6], 7);

/// Force that the finger is pressed with; chosen, that of a usual touch.
const FORCE_N: f64 = 3.0;

/// How far a force may be from that of a refined run.
pub const TOLERANCE: f64 = 0.05;

/// The refined run has this many steps in one; chosen: an oscillation at the limit of
/// [`StepLimit`](palpate::sim::mujoco::StepLimit) is then within a percent of the exact one.
const FINER: f64 = 8.0;

/// Time pressed until the force is at rest: four times 0.2 s, in which the controller takes back
/// all but a third of an error; and the end of it that is looked at (chosen).
const REST_S: f64 = 0.8;
const LOOK_S: f64 = 0.1;

/// Time pressed in which the peak has passed: five times the 0.04 s that the servos of the arm take
/// to stop.
const PEAK_S: f64 = 0.2;

/// A finger at home in front of a wall, and where to press it.
struct WallPress {
    environment: Arc<Environment>,
    start: Isometry3<f64>,
    /// Way until the skin is pressed with [`FORCE_N`].
    way_m: f64,
}

/// What the wall did to the finger.
#[derive(Clone, Copy, Debug)]
struct PressForce {
    /// Largest.
    peak_n: f64,
    /// Mean at the end, and the difference between largest and smallest there.
    rest_n: f64,
    ripple_n: f64,
}

impl WallPress {
    /// With a skin `times` stiffer; none if it cannot be built.
    fn new(times: f64, step_s: f64, arm: bool) -> Option<Self> {
        let mut scene = with_masses(step_s);
        stiffen(&mut scene.effects, times);
        let mut face_w = [0.0; 3];
        if arm {
            let chain = ArmSettings::default().chain().ok()?;
            let tip = chain.forward(&chain.home).translation.vector;
            // As far as a stage keeps from it.
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

    /// Follows the path to its end and stays there for `pressed_s`; shows every reading.
    fn press(
        &self,
        body: &mut dyn Backend,
        pressed_s: f64,
        see: &mut dyn FnMut(&Reading),
    ) -> Result<(), Fault> {
        let until_s = self.way_m / APPROACH_M_S + pressed_s;
        let chain = self.environment.chain().ok_or(Fault::Lost { time_s: 0.0 })?;
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

    /// The force in steps of `step_s`, pressed for `pressed_s`.
    fn force(&self, step_s: f64, pressed_s: f64) -> Result<PressForce, String> {
        let models = Models::at(&self.environment, step_s).map_err(|error| error.to_string())?;
        let mut body = Dynamic::new(&self.environment, &models).map_err(|_| "no body")?;
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
    reading.ideal().map_or(0.0, |ideal| ideal.force_n)
}

/// Where the skin bears [`FORCE_N`].
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

/// By how much the force is deviation that of a refined run, as shares of its own.
#[derive(Clone, Copy, Debug)]
struct ForceDeviation {
    /// The largest.
    peak: f64,
    /// At rest.
    rest: f64,
    /// Up and down at rest, beyond what the refined run has of it.
    ripple: f64,
}

/// Presses the finger of a stage or an arm for `pressed_s`, its skin `times` stiffer. `divided`
/// lets the time step be divided as a scene's is; else it is taken as given.
///
/// # Errors
/// Why it is refused, or the fault with time and state.
fn force_deviation(
    times: f64,
    (step_s, divided): (f64, bool),
    arm: bool,
    pressed_s: f64,
) -> Result<ForceDeviation, String> {
    let press = WallPress::new(times, step_s, arm).ok_or("nothing to press")?;
    let models = Models::new(&press.environment).map_err(|error| error.to_string())?;
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

/// Stiffnesses at which a margin is looked for.
const TIMES: [f64; 15] =
    [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1e3, 2e3, 5e3, 1e4, 1e5, 1e6];

/// How many times stiffer than a BioTac's the skin of a PA-10 may be in steps of `step_s`, `divided`
/// as a scene's are or as given: the largest of [`TIMES`] up to which the force at rest is within
/// [`TOLERANCE`] of a refined run's, 0 if there is none; and the next with its result.
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

/// Finite, and at rest within [`TOLERANCE`] of a refined run: force and what it goes up and down.
fn at_rest(times: f64, step_s: f64, arm: bool) -> Outcome {
    match force_deviation(times, (step_s, true), arm, REST_S) {
        Ok(deviation) => require(deviation.is_at_rest(), || deviation.words()),
        Err(words) => Outcome::Faulted(words),
    }
}

/// The same of the largest force on the way.
fn at_peak(times: f64, step_s: f64, arm: bool) -> Outcome {
    match force_deviation(times, (step_s, true), arm, PEAK_S) {
        Ok(deviation) => require(deviation.peak.abs() <= TOLERANCE, || deviation.words()),
        Err(words) => Outcome::Faulted(words),
    }
}

/// Pressed, then told to stand still: where it stood after a second it stands at the end, within a
/// hundredth of the depth, and nothing moves faster than the last of it would.
fn long(ticks: f64) -> Outcome {
    let Some(press) = WallPress::new(1.0, 0.002, true) else {
        return Outcome::Wrong("nothing to press".into());
    };
    let run = || -> Result<Outcome, Fault> {
        let lost = Fault::Lost { time_s: 0.0 };
        let models = Models::at(&press.environment, 0.002).map_err(|_| lost.clone())?;
        let mut body = Dynamic::new(&press.environment, &models)?;
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

/// Joints slower than this stand still, rad/s: the tip, a metre away, goes a micrometre in a second
/// (chosen).
const STILL: f64 = 1e-6;
