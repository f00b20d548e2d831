//! Servo: carries out a touch with a backend: travel, tare, approach, settle, read, retract.

mod compliance;
mod contact_monitor;
mod home;
mod reach;
mod rehearsal;
mod relief;
mod slide;
mod trajectory;
mod zone_reach;

use super::{Probe, checked_approach};
use crate::backend::{Backend, Command, Fault};
use crate::control::{Controller, Goal, posture};
use crate::evidence::{End, Evidence, FreeVolume, Outcome, SurfacePoints};
use crate::robot::Robot;
use crate::robot::arm::{ArmError, Joints};
use crate::robot::finger::frame::FRAME_S;
use crate::robot::sensor::{Doubt, SensedContact, Sensor, TipRadius};
use crate::task::touch::TouchSettings;
use crate::task::{Action, Approach, Ball};
use compliance::Compliance;
use contact_monitor::{ApproachEnd, ContactMonitor};
use nalgebra::{Isometry3, UnitVector3, Vector3};
use reach::PathSegment;
use trajectory::{ARRIVED_M, Path, paths_around};

pub use crate::task::approach::BEYOND_M;
pub use home::find_home;
pub use reach::ArmReach;
pub(super) use reach::{standoff, turning_point};
pub use zone_reach::{check_directions, check_reach};

/// Distance beyond the stand-off up to which a finger moves there directly; a heuristic: smaller
/// than the height of any object.
const DEEPER_M: f64 = 5e-3;

/// Speed of a press as a fraction of the approach's; a heuristic: on a hard object the force rises
/// with every micrometre while the arm slows down.
const PRESS_SPEED: f64 = 0.25;

/// Tolerance of each joint at home, rad; a heuristic: equal to the attitude tolerance of a path.
const HOME_RAD: f64 = 2e-3;

/// Carries out touches with any [`Backend`]. The same code drives simulators, recordings and the
/// real arm; its inputs are the robot, the touch settings, and one approach per touch.
pub struct Servo {
    robot: Robot,
    body: Box<dyn Backend>,
    control: Controller,
    settings: TouchSettings,
    monitor: ContactMonitor,
    command: Command,
    /// Time of the last reading.
    time_s: f64,
    /// Time that the backend does not know of.
    rested_s: f64,
    /// Part of the last command that a real robot applied.
    applied_ratio: f64,
    q: Vec<f64>,
    /// Reach of an arm, which checks each path around an object before moving.
    reach: Option<ArmReach>,
    /// Compliance of a rigid tip in the last touch that measured it.
    compliance: Option<Compliance>,
    tip_radius: TipRadius,
    /// Mean place of a rigid tip in `W` during the last rest, m.
    rested_w: Option<Vector3<f64>>,
}

impl Servo {
    /// Creates a servo and resets `body`, which moves the robot's chain.
    ///
    /// # Errors
    /// If the reset fails, or the backend drives a different arm.
    pub fn new(
        robot: Robot,
        settings: TouchSettings,
        mut body: Box<dyn Backend>,
        seed: u64,
    ) -> Result<Self, Fault> {
        body.capabilities().fit(&robot.chain)?;
        let control = Controller::new(robot.chain.clone(), body.capabilities().period_s)
            .map_err(|cause| Fault::no_command(0.0, cause))?;
        let reading = body.reset(seed)?;
        reading.check()?;
        let (time_s, q) = (reading.time_s, reading.q.clone());
        let reach = ArmReach::new(&robot, &settings);
        Ok(Self {
            monitor: ContactMonitor::new(&settings, &robot),
            command: Command { qdot: vec![0.0; robot.chain.joints.len()] },
            robot,
            body,
            control,
            settings,
            time_s,
            rested_s: 0.0,
            applied_ratio: 1.0,
            q,
            reach,
            compliance: None,
            tip_radius: TipRadius::default(),
            rested_w: None,
        })
    }

    /// Adds `sensor` with priority over the built-in ones.
    pub fn with_sensor(mut self, sensor: Box<dyn Sensor>) -> Self {
        self.monitor.add(sensor);
        self
    }

    /// Returns the pose of the fingertip by forward kinematics.
    fn x_wt(&mut self) -> Isometry3<f64> {
        let x_wt = self.control.x_wt(&self.q);
        x_wt.unwrap_or(self.control.chain().base)
    }

    /// Returns the joint positions of the last reading, rad or m.
    pub fn joints(&self) -> Option<Joints> {
        self.robot.chain.joints_from(&self.q)
    }

    fn period_s(&self) -> f64 {
        self.body.capabilities().period_s
    }

    /// Returns the time by which a path advances in a tick, s: less than a period if a real robot
    /// applied less than the last command, at a reduced speed or a limit, or else it would fall
    /// behind.
    fn passed_s(&self) -> f64 {
        let is_real = self.body.capabilities().real_time;
        self.period_s() * if is_real { self.applied_ratio } else { 1.0 }
    }

    /// Runs one tick towards `goal`.
    fn tick(&mut self, goal: &Goal) -> Result<(), Fault> {
        let motion = self.control.step(&self.q, goal);
        let motion = motion.map_err(|cause| Fault::no_command(self.time_s, cause))?;
        self.carry_out(&motion.qdot)
    }

    /// Runs one tick with the joint velocities `qdot`.
    fn carry_out(&mut self, qdot: &Joints) -> Result<(), Fault> {
        self.command.qdot.iter_mut().zip(qdot.iter()).for_each(|(to, from)| *to = *from);
        let reading = self.body.step(&self.command)?;
        reading.check()?;
        self.time_s = reading.time_s;
        self.q.clone_from(&reading.q);
        self.applied_ratio = applied_ratio(&self.command, &reading.applied);
        self.monitor.push(reading);
        match self.monitor.last_sample_s() {
            Some(heard_s) if self.time_s - heard_s > SILENCE_S => {
                Err(Fault::NoResponse { time_s: heard_s })
            }
            _ => Ok(()),
        }
    }

    /// Moves in a straight line to `to`; if `alert`, stops at contact or overload.
    fn move_straight(
        &mut self,
        phase: &'static str,
        to: Isometry3<f64>,
        speed_m_s: f64,
        alert: bool,
    ) -> Result<Option<ApproachEnd>, Fault> {
        let from = self.x_wt().translation.vector;
        self.follow(phase, Path::straight(from, to, speed_m_s), alert)
    }

    /// Moves along `path` to its end; if `alert`, stops at contact or overload.
    fn follow(
        &mut self,
        phase: &'static str,
        path: Path,
        alert: bool,
    ) -> Result<Option<ApproachEnd>, Fault> {
        let to = path.to;
        match self.move_along(path, |monitor| alert && monitor.approach_end().is_some())? {
            PathEnd::Arrived => Ok(None),
            PathEnd::Stopped => Ok(self.monitor.approach_end()),
            PathEnd::Late => Err(self.timeout_fault(phase, &to)),
        }
    }

    /// Moves along `path` until it has arrived, is late, or what is felt `stops` it.
    fn move_along(
        &mut self,
        mut path: Path,
        mut stops: impl FnMut(&ContactMonitor) -> bool,
    ) -> Result<PathEnd, Fault> {
        let to = path.to;
        let mut deadline = Deadline::default();
        loop {
            let passed_s = self.passed_s();
            let goal = path.advance(passed_s);
            self.tick(&goal)?;
            let is_late = deadline.is_over(self, path.pace.timeout_s(), passed_s);
            if stops(&self.monitor) {
                return Ok(PathEnd::Stopped);
            }
            let here = self.x_wt();
            let away = here.translation.vector - to.translation.vector;
            if path.pace.is_done() && away.norm() < ARRIVED_M && path.has_turned(&here) {
                return Ok(PathEnd::Arrived);
            }
            if is_late {
                return Ok(PathEnd::Late);
            }
        }
    }

    /// Moves straight back to the level of the stand-off `above` if the finger is beyond it: after
    /// an interrupted touch the finger may be beside the object.
    fn retract_to(&mut self, approach: &Approach, above: &Isometry3<f64>) -> Result<(), Fault> {
        let here = self.x_wt();
        let from_w = here.translation.vector;
        let back_w = approach.project_to_level(&from_w, &above.translation.vector);
        if (back_w - from_w).dot(&approach.direction_w()) > -DEEPER_M {
            return Ok(());
        }
        let back = Isometry3::from_parts(back_w.into(), here.rotation);
        self.move_straight("the retract position", back, self.settings.approach_m_s, false)
            .map(|_| ())
    }

    /// Travels around the object to the stand-off `above`; an arm follows a path that was checked
    /// beforehand.
    fn travel_around(
        &mut self,
        around: &Ball,
        approach: &Approach,
        above: Isometry3<f64>,
    ) -> Result<(), Fault> {
        let ahead_t = approach.r_at.inverse() * -Vector3::y_axis();
        self.leave(around, &ahead_t)?;
        let legs = match &self.reach {
            None => vec![PathSegment::Around(above)],
            Some(reach) => {
                let q = self.joints();
                q.and_then(|q| reach.plan(&q, approach)).ok_or_else(|| self.no_way())?
            }
        };
        for leg in legs {
            match leg {
                PathSegment::Around(to) => self.go_around(around, approach, to)?,
                PathSegment::Home => self.go_home(around)?,
            }
        }
        Ok(())
    }

    fn go_around(
        &mut self,
        around: &Ball,
        approach: &Approach,
        to: Isometry3<f64>,
    ) -> Result<(), Fault> {
        let here = self.x_wt();
        for round in paths_around(around, here, to, &self.robot.finger, &approach.r_at) {
            let path = Path::round(round, self.settings.travel_m_s);
            self.follow("the stand-off", path, false)?;
        }
        Ok(())
    }

    /// Moves all joints home along a straight line in joint space, from where an arm reaches every
    /// approach. The line is checked from the measured joint positions.
    fn go_home(&mut self, around: &Ball) -> Result<(), Fault> {
        let q = self.joints();
        let line = self.reach.as_ref().zip(q).and_then(|(reach, q)| reach.line_home(&q, around));
        let mut line = line.ok_or_else(|| self.no_way())?;
        let mut deadline = Deadline::default();
        loop {
            let passed_s = self.passed_s();
            let posture = line.advance(passed_s);
            let qdot = self.control.step_posture(&self.q, &posture);
            let qdot = qdot.map_err(|cause| Fault::no_command(self.time_s, cause))?;
            self.carry_out(&qdot)?;
            let (time_s, q) = (self.time_s, &self.q);
            let is_late = deadline.is_over(self, line.pace.timeout_s(), passed_s);
            let home = self.robot.chain.start();
            let is_home = q.iter().zip(home).all(|(q, home)| (q - home).abs() < HOME_RAD);
            if line.pace.is_done() && is_home {
                return Ok(());
            }
            if is_late {
                return Err(Fault::Timeout { goal: "home", time_s, q: q.clone() });
            }
        }
    }

    /// Moves straight out of the ball, opposite to the finger's direction, if the tip is in it:
    /// after an interrupted touch the finger may be beside the object.
    fn leave(&mut self, around: &Ball, ahead_t: &UnitVector3<f64>) -> Result<(), Fault> {
        let here = self.x_wt();
        let p_wt = here.translation.vector.into();
        if around.depth_m(&p_wt) < DEEPER_M {
            return Ok(());
        }
        let out_w = around.entrance_w(&p_wt, &(here.rotation * ahead_t));
        let out = Isometry3::from_parts(out_w.coords.into(), here.rotation);
        let speed_m_s = self.settings.approach_m_s;
        if let Some(reach) = &self.reach {
            let path = Path::straight(here.translation.vector, out, speed_m_s);
            let q = self.joints();
            if !q.is_some_and(|q| reach.leaves(&q, path, around)) {
                return Err(self.no_way());
            }
        }
        self.move_straight("the retract position", out, speed_m_s, false).map(|_| ())
    }

    fn no_way(&self) -> Fault {
        Fault::NoPath { time_s: self.time_s, q: self.q.clone() }
    }

    /// Returns the fault of a movement to `to` that exceeded its timeout.
    fn timeout_fault(&self, phase: &'static str, to: &Isometry3<f64>) -> Fault {
        let time_s = self.time_s;
        match posture(&self.robot.chain, to) {
            Err(ArmError::OutOfReach { distance_m, angle_rad }) => {
                Fault::OutOfReach { goal: phase, time_s, distance_m, angle_rad }
            }
            _ => Fault::Timeout { goal: phase, time_s, q: self.q.clone() },
        }
    }

    /// Rests at `x_wt` until `count` more frames have arrived; without a tactile sensor, for the
    /// same duration.
    fn rest(&mut self, x_wt: Isometry3<f64>, count: usize) -> Result<Option<ApproachEnd>, Fault> {
        self.monitor.clear_samples();
        let here = Goal::at_rest(x_wt);
        let until_s = self.time_s + count as f64 * FRAME_S;
        let is_on_hull = self.monitor.locates_on_hull();
        let (mut sum_w, mut ticks) = (Vector3::zeros(), 0.0);
        while self.monitor.collected() < count {
            if self.monitor.last_sample_s().is_none() && self.time_s >= until_s {
                break;
            }
            self.tick(&here)?;
            if is_on_hull {
                sum_w += self.x_wt().translation.vector;
                ticks += 1.0;
            }
            if self.monitor.approach_end() == Some(ApproachEnd::Overload) {
                return Ok(Some(ApproachEnd::Overload));
            }
        }
        self.rested_w = (ticks > 0.0).then(|| sum_w / ticks);
        Ok(None)
    }

    /// Rests at `x_wt` until impact and overrun have died down. Returns the overload that ends it.
    fn settle(&mut self, x_wt: Isometry3<f64>) -> Result<Option<ApproachEnd>, Fault> {
        let until_s = self.time_s + self.settings.settle_s;
        while self.time_s < until_s {
            self.tick(&Goal::at_rest(x_wt))?;
            if self.monitor.approach_end() == Some(ApproachEnd::Overload) {
                return Ok(Some(ApproachEnd::Overload));
            }
        }
        Ok(None)
    }

    /// Moves slowly from `here` to the depth of the press, or short of there on an object so hard
    /// that the force is enough. Returns the pose to hold; `None` at overload.
    fn press(
        &mut self,
        approach: &Approach,
        here: Isometry3<f64>,
    ) -> Result<Option<Isometry3<f64>>, Fault> {
        let mut to = here;
        to.translation.vector += approach.direction_w().scale(self.settings.press_m);
        let speed_m_s = PRESS_SPEED * self.settings.approach_m_s;
        let path = Path::straight(here.translation.vector, to, speed_m_s);
        match self.move_along(path, ContactMonitor::is_pressed)? {
            PathEnd::Arrived => Ok(Some(to)),
            _ if self.monitor.approach_end() == Some(ApproachEnd::Overload) => Ok(None),
            PathEnd::Stopped | PathEnd::Late => Ok(Some(self.x_wt())),
        }
    }

    /// Stops at the point of detection, settles and reads the contact. The overrun while the servos
    /// stop the finger is reversed, so that the depth does not depend on them.
    fn read(&mut self, approach: &Approach, tared: &Isometry3<f64>) -> Result<Located, Fault> {
        let mut held = self.x_wt();
        // A force that locates the contact must remain while it is read.
        let is_pressed = self.robot.yields() || !self.body.capabilities().tactile;
        if is_pressed && self.settings.press_m > 0.0 {
            if self.settle(held)?.is_some() {
                return Ok(Located::default());
            }
            let Some(pressed) = self.press(approach, held)? else {
                return Ok(Located::default());
            };
            held = pressed;
        }
        if self.settle(held)?.is_some() || self.rest(held, self.settings.frames)?.is_some() {
            return Ok(Located::default());
        }
        let x_wt = self.x_wt();
        let moved_m = (x_wt.translation.vector - tared.translation.vector).norm();
        let mut located = self.monitor.contact(&self.robot.finger, moved_m);
        if let Ok(sensed) = &mut located {
            self.relieve(sensed, moved_m)?;
            self.robot.sensor.pose_sds.iter().for_each(|sds| sensed.misplace(*sds));
            sensed.doubt = self.tip_radius.doubt(&self.robot.finger).or(sensed.doubt);
        }
        let doubt = located.as_ref().map_or_else(|doubt| Some(*doubt), |sensed| sensed.doubt);
        Ok(Located { sensed: located.ok().map(|sensed| (x_wt, sensed)), doubt })
    }
}

/// Contact that the sensor located, with the pose of the tip at its reading, and its doubt; neither
/// at an overload.
#[derive(Default)]
struct Located {
    sensed: Option<(Isometry3<f64>, SensedContact)>,
    doubt: Option<Doubt>,
}

/// End of a movement along a path.
enum PathEnd {
    /// The tip is at the path's end.
    Arrived,
    /// Stopped by what was felt.
    Stopped,
    /// The movement's timeout is over.
    Late,
}

/// Deadline of a movement. It counts from the first reading, because the clock of a real arm runs
/// on while the next touch is planned.
#[derive(Default)]
struct Deadline(Option<f64>);

impl Deadline {
    /// Whether the servo's last reading is after the deadline, which is `timeout_s` after the first
    /// reading. A tick in which the path advanced by less than a period, by `passed_s`, postpones
    /// it by the difference.
    fn is_over(&mut self, servo: &Servo, timeout_s: f64, passed_s: f64) -> bool {
        let deadline_s = self.0.get_or_insert(servo.time_s + timeout_s);
        *deadline_s += servo.period_s() - passed_s;
        servo.time_s > *deadline_s
    }
}

/// Returns the part of `command` that was applied, from 0 to 1.
fn applied_ratio(command: &Command, applied: &Command) -> f64 {
    let norm = |command: &Command| command.qdot.iter().map(|v| v * v).sum::<f64>().sqrt();
    let (wanted, found) = (norm(command), norm(applied));
    if found >= wanted || applied.qdot.is_empty() { 1.0 } else { found / wanted }
}

/// Indentation of a skin during which the finger can still stop, and way into an object at an
/// overload; a heuristic: the fluid's gap.
const GIVES_WAY_M: f64 = 1.5e-3;

/// Time without samples after which a sensor counts as lost; a heuristic: three batches of five
/// frames, in which an approach travels 3 mm.
const SILENCE_S: f64 = 0.15;

impl Probe for Servo {
    /// Moves the centre of the fingertip's hemisphere to the stand-off and along the approach.
    fn execute(&mut self, action: &Action) -> Result<Outcome, Fault> {
        let approach = checked_approach(action)?;
        let TouchSettings { travel_m_s, approach_m_s, .. } = self.settings;
        let above = standoff(&self.robot, self.settings.standoff_m, approach);
        match &approach.obstacle {
            Some(around) => self.travel_around(around, approach, above)?,
            None => {
                self.retract_to(approach, &above)?;
                self.move_straight("the stand-off", above, travel_m_s, false)?;
            }
        }
        self.rest(above, self.monitor.samples_of_tare())?;
        self.monitor.tare();
        let below = turning_point(&self.robot, approach);
        let stop = self.move_straight("the object", below, approach_m_s, true)?;
        let ahead_w = approach.direction_w();
        let stopped_w = self.x_wt().translation.vector;
        let located = match stop {
            Some(ApproachEnd::Contact) => self.read(approach, &above)?,
            None | Some(ApproachEnd::Overload) => Located::default(),
        };
        let mut points = located.sensed.as_ref().map(|(x_wt, it)| SurfacePoints::sensed(x_wt, it));
        let trail = match &mut points {
            Some(points) => self.slide(approach, points, &above)?,
            None => None,
        };
        let has_left = match &trail {
            Some(trail) => self.leave_stroke(approach, trail, &above)?,
            None => false,
        };
        if !has_left {
            let here_w = self.x_wt().translation.vector;
            let back_w = approach.project_to_level(&here_w, &above.translation.vector);
            let back = Isometry3::from_parts(back_w.into(), above.rotation);
            self.move_straight("the retract position", back, travel_m_s, false)?;
        }
        let end = match (stop, &points) {
            (None, _) => End::Miss,
            (Some(_), Some(_)) => End::Contact,
            (Some(_), None) => End::Overload,
        };
        let finger = self.robot.finger.with_attitude(&approach.r_at);
        // Beside a contact of unknown normal an exact bound pulls the belief below flat faces.
        let is_exact = !self.robot.yields()
            && points.as_ref().is_none_or(|points| points.points.iter().all(|it| it.has_normal));
        let gives_way_m = match (end, &self.compliance) {
            (End::Miss, _) if is_exact => 0.0,
            (End::Contact, compliance) if is_exact => {
                compliance.map_or(0.0, |it| it.m_per_n * self.settings.detection_n)
            }
            _ => GIVES_WAY_M,
        };
        let reached_w = stopped_w - ahead_w.scale(gives_way_m);
        let free = FreeVolume::new(finger, approach, reached_w.into(), end);
        let evidence = points.map(Evidence::Points).into_iter().chain([Evidence::Free(free)]);
        let Located { sensed, doubt } = located;
        let outcome = Outcome::new(end, evidence.collect());
        Ok(Outcome { time_s: self.time_s(), doubt, sensed, ..outcome })
    }

    fn time_s(&self) -> Option<f64> {
        Some(self.time_s + self.rested_s)
    }

    fn rest(&mut self, time_s: f64) {
        self.rested_s += time_s;
    }
}
