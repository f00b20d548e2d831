//! One touch by a body that moves and feels: travel, tare, approach, settle, read, retract.

mod contact_monitor;
mod trajectory;

use super::{Contact, Probe, Swept, Touch, refuse_unless_finite};
use crate::backend::backend::{Backend, Command, Fault, Reading};
use crate::explore::control::{ControlError, Controller, Goal};
use crate::robot::finger::frame::FRAME_S;
use crate::sim::Environment;
use crate::sim::environment::CLEARANCE_M;
use crate::task::touch::TouchSettings;
use contact_monitor::{ApproachEnd, ContactMonitor};
use nalgebra::{Isometry3, Vector3};
use std::sync::Arc;
use trajectory::StraightPath;

/// A movement has arrived when the tip is this near to its end; chosen: below what a touch
/// resolves.
const ARRIVED_M: f64 = 5e-5;

/// Drives any [`Backend`] through touches. The same code drives simulators, recordings and the
/// real arm.
pub struct Servo {
    environment: Arc<Environment>,
    body: Box<dyn Backend>,
    control: Controller,
    settings: TouchSettings,
    monitor: ContactMonitor,
    command: Command,
    state: State,
    swept: Option<Swept>,
}

/// What is kept of the last reading.
#[derive(Default)]
struct State {
    time_s: f64,
    q: Vec<f64>,
}

impl Servo {
    /// Brings `body`, which moves the world's chain, to its start.
    ///
    /// # Errors
    /// If the body cannot be brought there.
    pub fn new(
        environment: Arc<Environment>,
        mut body: Box<dyn Backend>,
        seed: u64,
    ) -> Result<Self, Fault> {
        let chain = environment.chain().ok_or(Fault::Refused { values: Vec::new() })?;
        let settings = environment.scene().touch.clone();
        let joints = chain.joints.len();
        let control = Controller::new(chain, body.capabilities().period_s).map_err(refused)?;
        let mut state = State::default();
        state.take(body.reset(seed)?);
        Ok(Self {
            monitor: ContactMonitor::new(&settings),
            command: Command { qdot: vec![0.0; joints] },
            environment,
            body,
            control,
            settings,
            state,
            swept: None,
        })
    }

    /// Pose of the fingertip by forward kinematics.
    fn x_wt(&self) -> Isometry3<f64> {
        let chain = self.control.chain();
        chain.joints_from(&self.state.q).map_or(chain.base, |q| chain.forward(&q))
    }

    fn period_s(&self) -> f64 {
        self.body.capabilities().period_s
    }

    /// One tick towards `goal`.
    fn tick(&mut self, goal: &Goal) -> Result<(), Fault> {
        let motion = self.control.step(&self.state.q, goal).map_err(refused)?;
        self.command.qdot.iter_mut().zip(motion.qdot.iter()).for_each(|(to, from)| *to = *from);
        let reading = self.body.step(&self.command)?;
        self.monitor.take(reading);
        self.state.take(reading);
        match self.monitor.heard_s() {
            Some(heard_s) if self.state.time_s - heard_s > SILENCE_S => {
                Err(Fault::Lost { time_s: heard_s })
            }
            _ => Ok(()),
        }
    }

    /// Moves straight to `to`, until there or, if `alert`, until something is felt.
    fn go(
        &mut self,
        phase: &'static str,
        to: Isometry3<f64>,
        speed_m_s: f64,
        alert: bool,
    ) -> Result<Option<ApproachEnd>, Fault> {
        let mut path = StraightPath::new(self.x_wt().translation.vector, to, speed_m_s);
        let deadline_s = self.state.time_s + path.patience_s();
        let period_s = self.period_s();
        loop {
            let goal = path.advance(period_s);
            self.tick(&goal)?;
            if let Some(end) = self.monitor.approach_end().filter(|_| alert) {
                return Ok(Some(end));
            }
            let away = self.x_wt().translation.vector - to.translation.vector;
            if path.is_done() && away.norm() < ARRIVED_M {
                return Ok(None);
            }
            if self.state.time_s > deadline_s {
                let State { time_s, q } = &self.state;
                return Err(Fault::Late { phase, time_s: *time_s, q: q.clone() });
            }
        }
    }

    /// Stands still at `x_wt` until `count` more frames have arrived, or their time has passed in a
    /// body without sensor.
    fn rest(&mut self, x_wt: Isometry3<f64>, count: usize) -> Result<Option<ApproachEnd>, Fault> {
        self.monitor.forget();
        let here = Goal::still(x_wt);
        let until_s = self.state.time_s + count as f64 * FRAME_S;
        while self.monitor.frames().len() < count {
            if self.monitor.heard_s().is_none() && self.state.time_s >= until_s {
                break;
            }
            self.tick(&here)?;
            if self.monitor.approach_end() == Some(ApproachEnd::Overload) {
                return Ok(Some(ApproachEnd::Overload));
            }
        }
        Ok(None)
    }

    /// The tip in front of the object, over `target`.
    fn standoff(&self, target: &[f64]) -> Isometry3<f64> {
        let scene = self.environment.scene();
        let mut p_wt = scene.zone.point(target, 0.0);
        p_wt.y = self.extent_y().1 + scene.finger.bulge_m() + self.settings.standoff_m;
        Isometry3::from_parts(p_wt.into(), scene.finger.attitude_w())
    }

    /// Smallest and largest y of the object.
    fn extent_y(&self) -> (f64, f64) {
        self.environment.mesh().map_or((0.0, 0.0), |mesh| {
            let (low, high) = mesh.bounds();
            (low.y, high.y)
        })
    }

    /// Stops, settles where contact was told, and reads it: what the finger overran while its
    /// servos stopped it is taken back, so that the depth does not depend on them.
    fn read(&mut self) -> Result<Option<Contact>, Fault> {
        let until_s = self.state.time_s + self.settings.settle_s;
        let mut held = self.x_wt();
        held.translation.y -= self.environment.fingertip().map_or(0.0, |_| self.settings.press_m);
        while self.state.time_s < until_s {
            self.tick(&Goal::still(held))?;
            if self.monitor.approach_end() == Some(ApproachEnd::Overload) {
                return Ok(None);
            }
        }
        if self.rest(held, self.settings.frames)?.is_some() {
            return Ok(None);
        }
        let x_wt = self.x_wt();
        Ok(self.monitor.contact(self.settings.point).map(|(p_tc, normal_t)| Contact {
            p_wc: x_wt * p_tc,
            normal_w: x_wt.rotation * normal_t,
        }))
    }
}

/// Depth to which the object may be in the skin before the finger stops; chosen: the fluid's gap.
const GIVES_WAY_M: f64 = 1.5e-3;

/// Silence of a sensor after which it counts as lost; chosen: three batches of five frames, in
/// which an approach goes 3 mm.
const SILENCE_S: f64 = 0.15;

impl Probe for Servo {
    /// The centre of the fingertip's hemisphere travels over the target and approaches along −y.
    fn touch(&mut self, target: &[f64]) -> Result<Touch, Fault> {
        refuse_unless_finite(target)?;
        let TouchSettings { travel_m_s, approach_m_s, frames, .. } = self.settings;
        let above = self.standoff(target);
        self.go("the stand-off", above, travel_m_s, false)?;
        self.rest(above, frames)?;
        self.monitor.tare();
        let mut below = above;
        below.translation.y =
            self.extent_y().0 - self.environment.scene().finger.radius_m - CLEARANCE_M;
        let end = self.go("the object", below, approach_m_s, true)?;
        let reached = self.x_wt().translation.vector + Vector3::y() * GIVES_WAY_M;
        let finger = self.environment.scene().finger.clone();
        self.swept = Some(Swept { finger, p_wt: reached.into() });
        let touch = match end {
            None => Touch::Miss,
            Some(ApproachEnd::Overload) => Touch::Overload,
            Some(ApproachEnd::Contact) => self.read()?.map_or(Touch::Overload, Touch::Contact),
        };
        let here = self.x_wt().translation.vector;
        let back = Isometry3::from_parts(
            Vector3::new(here.x, above.translation.y, here.z).into(),
            above.rotation,
        );
        self.go("the way back", back, travel_m_s, false)?;
        Ok(touch)
    }

    fn swept(&self) -> Option<Swept> {
        self.swept.clone()
    }

    fn time_s(&self) -> Option<f64> {
        Some(self.state.time_s)
    }
}

impl State {
    fn take(&mut self, reading: &Reading) {
        self.time_s = reading.time_s;
        self.q.clone_from(&reading.q);
    }
}

fn refused(error: ControlError) -> Fault {
    let values = match error {
        ControlError::NotFinite => vec![f64::NAN],
        ControlError::Joints { expected, found } => vec![expected as f64, found as f64],
        ControlError::OutOfReach { distance_m, angle_rad } => vec![distance_m, angle_rad],
    };
    Fault::Refused { values }
}
