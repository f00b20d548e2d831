//! One touch by a body that moves and feels: travel, tare, approach, settle, read, retract.

mod arm_reach;
mod contact_monitor;
mod line;
mod pace;
mod round;
mod trajectory;
mod travel;
mod tryout;
mod way;

use super::{Contact, Probe, Swept, Touch, refuse_unless_finite};
use crate::backend::{Backend, Command, Fault, Reading};
use crate::explore::control::{Controller, Goal, posture};
use crate::robot::Robot;
use crate::robot::arm::{ArmError, Joints};
use crate::robot::finger::frame::FRAME_S;
use crate::robot::sensor::{SensedContact, Sensor};
use crate::task::Approach;
use crate::task::touch::TouchSettings;
use contact_monitor::{ApproachEnd, ContactMonitor};
use nalgebra::Isometry3;
use trajectory::Path;

pub use crate::task::approach::BEYOND_M;
pub use arm_reach::ArmReach;
pub use way::{OutOfReach, check_reach};
pub(super) use way::{standoff, turning_point};

/// A movement has arrived when the tip is this near to its end; chosen: below what a touch
/// resolves.
const ARRIVED_M: f64 = 5e-5;

/// A finger that is no farther beyond the stand-off goes there at once; chosen: less than any
/// object is high.
const DEEPER_M: f64 = 5e-3;

/// Drives any [`Backend`] through touches. The same code drives simulators, recordings and the
/// real arm: it knows the robot, how to touch, and what it is told of each touch.
pub struct Servo {
    robot: Robot,
    body: Box<dyn Backend>,
    control: Controller,
    settings: TouchSettings,
    monitor: ContactMonitor,
    command: Command,
    state: State,
    swept: Option<Swept>,
    /// Where the last contact was read.
    tip: Option<Isometry3<f64>>,
    /// Of an arm, which tries a way around an object out before it goes.
    reach: Option<ArmReach>,
}

/// What is kept of the last reading.
#[derive(Default)]
struct State {
    time_s: f64,
    q: Vec<f64>,
}

impl Servo {
    /// Brings `body`, which moves the robot's chain, to its start.
    ///
    /// # Errors
    /// If the body cannot be brought there, or is another arm.
    pub fn new(
        robot: Robot,
        settings: TouchSettings,
        mut body: Box<dyn Backend>,
        seed: u64,
    ) -> Result<Self, Fault> {
        body.capabilities().fit(&robot.chain)?;
        let control = Controller::new(robot.chain.clone(), body.capabilities().period_s)
            .map_err(|cause| Fault::no_command(0.0, cause))?;
        let mut state = State::default();
        state.take(body.reset(seed)?)?;
        let reach = ArmReach::new(&robot, &settings);
        Ok(Self {
            monitor: ContactMonitor::new(&settings, &robot.finger),
            command: Command { qdot: vec![0.0; robot.chain.joints.len()] },
            robot,
            body,
            control,
            settings,
            state,
            swept: None,
            tip: None,
            reach,
        })
    }

    /// Asks `sensor` before those that Palpate knows.
    pub fn with_sensor(mut self, sensor: Box<dyn Sensor>) -> Self {
        self.monitor.add(sensor);
        self
    }

    /// Pose of the fingertip by forward kinematics.
    fn x_wt(&mut self) -> Isometry3<f64> {
        let x_wt = self.control.x_wt(&self.state.q);
        x_wt.unwrap_or(self.control.chain().base)
    }

    fn period_s(&self) -> f64 {
        self.body.capabilities().period_s
    }

    /// One tick towards `goal`.
    fn tick(&mut self, goal: &Goal) -> Result<(), Fault> {
        let State { time_s, q } = &self.state;
        let no_command = |cause| Fault::no_command(*time_s, cause);
        let motion = self.control.step(q, goal).map_err(no_command)?;
        self.carry_out(&motion.qdot)
    }

    /// One tick in which the joints move at `qdot`.
    fn carry_out(&mut self, qdot: &Joints) -> Result<(), Fault> {
        self.command.qdot.iter_mut().zip(qdot.iter()).for_each(|(to, from)| *to = *from);
        let reading = self.body.step(&self.command)?;
        self.state.take(reading)?;
        self.monitor.take(reading);
        match self.monitor.last_sample_s() {
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
        let from = self.x_wt().translation.vector;
        self.follow(phase, Path::straight(from, to, speed_m_s), alert)
    }

    /// Moves along `path`, until at its end or, if `alert`, until something is felt.
    fn follow(
        &mut self,
        phase: &'static str,
        mut path: Path,
        alert: bool,
    ) -> Result<Option<ApproachEnd>, Fault> {
        let to = path.to();
        // From the first reading on: the clock of a real arm goes on while the next touch is
        // thought about.
        let mut deadline_s = None;
        let period_s = self.period_s();
        loop {
            let goal = path.advance(period_s);
            self.tick(&goal)?;
            let time_s = self.state.time_s;
            let deadline_s = *deadline_s.get_or_insert(time_s + path.patience_s());
            if let Some(end) = self.monitor.approach_end().filter(|_| alert) {
                return Ok(Some(end));
            }
            let here = self.x_wt();
            let away = here.translation.vector - to.translation.vector;
            if path.is_done() && away.norm() < ARRIVED_M && path.has_turned(&here) {
                return Ok(None);
            }
            if time_s > deadline_s {
                return Err(self.overdue(phase, &to));
            }
        }
    }

    /// Goes straight back to the level of the stand-off `above` where the finger is beyond it:
    /// after a touch that was broken off there may be something beside it.
    fn withdraw(&mut self, approach: &Approach, above: &Isometry3<f64>) -> Result<(), Fault> {
        let here = self.x_wt();
        let from_w = here.translation.vector;
        let back_w = approach.level_with(&from_w, &above.translation.vector);
        if (back_w - from_w).dot(&approach.direction_w()) > -DEEPER_M {
            return Ok(());
        }
        let back = Isometry3::from_parts(back_w.into(), here.rotation);
        self.go("the way back", back, self.settings.approach_m_s, false).map(|_| ())
    }

    /// Why a movement to `to` has not ended in its time.
    fn overdue(&self, phase: &'static str, to: &Isometry3<f64>) -> Fault {
        let State { time_s, q } = &self.state;
        let time_s = *time_s;
        match posture(&self.robot.chain, to) {
            Err(ArmError::OutOfReach { distance_m, angle_rad }) => {
                Fault::OutOfReach { phase, time_s, distance_m, angle_rad }
            }
            _ => Fault::Late { phase, time_s, q: q.clone() },
        }
    }

    /// Stands still at `x_wt` until `count` more frames have arrived, or their time has passed in a
    /// body without sensor.
    fn rest(&mut self, x_wt: Isometry3<f64>, count: usize) -> Result<Option<ApproachEnd>, Fault> {
        self.monitor.forget();
        let here = Goal::still(x_wt);
        let until_s = self.state.time_s + count as f64 * FRAME_S;
        while self.monitor.collected() < count {
            if self.monitor.last_sample_s().is_none() && self.state.time_s >= until_s {
                break;
            }
            self.tick(&here)?;
            if self.monitor.approach_end() == Some(ApproachEnd::Overload) {
                return Ok(Some(ApproachEnd::Overload));
            }
        }
        Ok(None)
    }

    /// Stops, settles where contact was told, and reads it: what the finger overran while its
    /// servos stopped it is taken back, so that the depth does not depend on them.
    fn read(&mut self, approach: &Approach) -> Result<Option<Contact>, Fault> {
        let until_s = self.state.time_s + self.settings.settle_s;
        let mut held = self.x_wt();
        let press_m = if self.robot.is_soft { self.settings.press_m } else { 0.0 };
        held.translation.vector += approach.direction_w().scale(press_m);
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
        self.tip = Some(x_wt);
        Ok(self.monitor.contact(&self.robot.finger).map(|SensedContact { p_tc, normal_t }| {
            Contact { p_wc: x_wt * p_tc, normal_w: x_wt.rotation * normal_t }
        }))
    }
}

/// Depth to which the object may be in the skin before the finger stops; chosen: the fluid's gap.
const GIVES_WAY_M: f64 = 1.5e-3;

/// Silence of a sensor after which it counts as lost; chosen: three batches of five frames, in
/// which an approach goes 3 mm.
const SILENCE_S: f64 = 0.15;

impl Probe for Servo {
    /// The centre of the fingertip's hemisphere travels to the stand-off and goes the approach's
    /// way.
    fn touch(&mut self, approach: &Approach) -> Result<Touch, Fault> {
        refuse_unless_finite(approach)?;
        let TouchSettings { travel_m_s, approach_m_s, .. } = self.settings;
        let above = standoff(&self.robot, self.settings.standoff_m, approach);
        match &approach.around {
            Some(around) => self.travel_around(around, approach, above)?,
            None => {
                self.withdraw(approach, &above)?;
                self.go("the stand-off", above, travel_m_s, false)?;
            }
        }
        self.rest(above, self.monitor.samples_of_tare())?;
        self.monitor.tare();
        let below = turning_point(&self.robot, approach);
        let end = self.go("the object", below, approach_m_s, true)?;
        let ahead_w = approach.direction_w();
        let reached_w = self.x_wt().translation.vector - ahead_w.scale(GIVES_WAY_M);
        let finger = self.robot.finger.clone();
        self.swept = Some(Swept { finger, p_wt: reached_w.into() });
        let touch = match end {
            None => Touch::Miss,
            Some(ApproachEnd::Overload) => Touch::Overload,
            Some(ApproachEnd::Contact) => {
                self.read(approach)?.map_or(Touch::Overload, Touch::Contact)
            }
        };
        let here_w = self.x_wt().translation.vector;
        let back_w = approach.level_with(&here_w, &above.translation.vector);
        let back = Isometry3::from_parts(back_w.into(), above.rotation);
        self.go("the way back", back, travel_m_s, false)?;
        Ok(touch)
    }

    fn swept(&self) -> Option<Swept> {
        self.swept.clone()
    }

    fn tip(&self) -> Option<Isometry3<f64>> {
        self.tip
    }

    fn time_s(&self) -> Option<f64> {
        Some(self.state.time_s)
    }
}

impl State {
    /// # Errors
    /// [`Fault::BadReading`] if a number that is acted on is none.
    fn take(&mut self, reading: &Reading) -> Result<(), Fault> {
        reading.check()?;
        self.time_s = reading.time_s;
        self.q.clone_from(&reading.q);
        Ok(())
    }
}
