//! Backend wrapper that enforces the interlocks before commands reach the robot.

use super::INTERLOCKS;
use super::force::{FORCE, RETRACT_M_S, RETRACT_RISE_N};
use super::interlock::{Interlock, InterlockEntry, RobotState, SafetyContext};
use super::limits::limited;
use super::settings::InterlockSettings;
use super::tracking;
use crate::backend::{Backend, Capabilities, Command, Fault, Reading, Trip, Wrench};
use crate::robot::arm::{Jacobian, Joints};
use nalgebra::Isometry3;
use palpate_input::error::InputError;
use std::collections::VecDeque;

/// A backend that stops the robot on a fault, independently of the commands.
///
/// The controller keeps limits along the tip's direction; this backend enforces them joint by
/// joint, and passes a command within all of them unchanged. A limit that cannot be kept by scaling
/// a command trips an interlock: the robot is braked within its joints' accelerations and does not
/// move again. A reset clears the fault of a simulated robot; for a real one, only
/// [`InterlockedBackend::clear_fault`] does.
pub struct InterlockedBackend {
    inner: Box<dyn Backend>,
    interlocks: Vec<Box<dyn Interlock>>,
    site: SafetyContext,
    settings: InterlockSettings,
    now: RobotState,
    way_back: RetractPath,
    /// Wrench at the reset.
    rest: Option<Wrench>,
    reading: Reading,
    command: Command,
    fault: Option<Fault>,
    /// Whether the next reset clears the fault of a real robot.
    is_cleared: bool,
}

impl InterlockedBackend {
    /// Wraps `inner`, which moves the joints of the robot in `site`.
    ///
    /// # Errors
    /// If their numbers of joints differ.
    pub fn new(
        inner: Box<dyn Backend>,
        site: &SafetyContext,
        settings: &InterlockSettings,
    ) -> Result<Self, Fault> {
        let (chain, capabilities) = (site.robot.chain.clone(), inner.capabilities());
        capabilities.fit(&chain)?;
        let (q, x_wt) = (chain.home, Isometry3::identity());
        let mut body = Self {
            interlocks: Vec::new(),
            site: site.clone(),
            settings: settings.clone(),
            way_back: RetractPath::new(capabilities.period_s),
            command: Command { qdot: vec![0.0; chain.joints.len()] },
            now: RobotState {
                reaches_m: chain.reaches_m(site.robot.finger.radius_m),
                period_s: capabilities.period_s,
                chain,
                tick: 0,
                time_s: 0.0,
                q,
                qdot: Joints::zeros(),
                sent: Joints::zeros(),
                unconfirmed_motion: Joints::zeros(),
                x_wt,
                jacobian: Jacobian::zeros(),
                load: None,
            },
            rest: None,
            reading: Reading::default(),
            fault: None,
            is_cleared: false,
            inner,
        };
        body.make_interlocks();
        Ok(body)
    }

    fn make_interlocks(&mut self) {
        let Self { site, settings, inner, .. } = self;
        let make = |entry: &InterlockEntry| (entry.make)(site, settings, inner.capabilities());
        self.interlocks = INTERLOCKS.iter().filter_map(make).collect();
    }

    /// Lets the next reset clear a fault of a real robot, after an operator has checked it.
    pub fn clear_fault(&mut self) {
        self.is_cleared = true;
    }

    /// Applies `qdot` for a tick and updates the state from the reading.
    fn advance(&mut self, qdot: &Joints) -> Result<(), Fault> {
        self.command.qdot.iter_mut().zip(qdot.iter()).for_each(|(to, from)| *to = *from);
        self.now.sent = *qdot;
        self.now.tick += 1;
        match self.inner.step(&self.command) {
            Ok(reading) => self.reading.copy_from(reading),
            Err(fault) => {
                // The backend reported the stop itself; the last command must not persist.
                if self.inner.capabilities().real_time {
                    self.command.qdot.fill(0.0);
                    let _ = self.inner.step(&self.command);
                }
                return Err(fault);
            }
        }
        self.take()
    }

    /// Updates the state from the last reading.
    fn take(&mut self) -> Result<(), Fault> {
        let Self { now, reading, .. } = self;
        reading.check()?;
        let joints = |values: &[f64]| {
            let (expected, found) = (now.chain.joints.len(), values.len());
            now.chain.joints_from(values).ok_or_else(|| Fault::joints(expected, found))
        };
        let (before, passed_s) = (now.q, reading.time_s - now.time_s);
        (now.q, now.qdot) = (joints(&reading.q)?, joints(&reading.qdot)?);
        now.time_s = reading.time_s;
        // The robot rests during a pause between two ticks.
        let moved_s = passed_s.clamp(0.0, HELD_TICKS * now.period_s);
        // An arm that runs at a fraction of its speed moves less than it was sent.
        let sent = now.chain.joints_from(&reading.applied.qdot).unwrap_or(now.sent);
        let unseen = (now.unconfirmed_motion + sent * moved_s)
            .zip_map(&(now.q - before), |unseen, by| if by == 0.0 { unseen } else { 0.0 });
        now.unconfirmed_motion = unseen;
        (now.x_wt, now.jacobian) = now.chain.jacobian(&now.q);
        now.load = reading.wrench.map(|Wrench { force_n, torque_nm }| {
            let rest = *self.rest.get_or_insert(Wrench { force_n, torque_nm });
            [(force_n - rest.force_n).norm(), (torque_nm - rest.torque_nm).norm()]
        });
        Ok(())
    }

    /// Limits `qdot`, or returns the trip that forbids it.
    fn shorten(&mut self, qdot: &mut Joints) -> Result<(), Trip> {
        self.interlocks.iter_mut().try_for_each(|one| one.command(&self.now, qdot))
    }

    /// Returns the trip that forbids the current position even at rest.
    fn trip_at_rest(&mut self) -> Option<Trip> {
        let is_at_rest = self.now.sent == Joints::zeros();
        is_at_rest.then(|| self.shorten(&mut Joints::zeros()).err()).flatten()
    }

    /// Returns the fault of a robot that an operator must jog.
    fn blocked_start_fault(&self, trip: &Trip) -> Fault {
        let joints = self.now.chain.joints.iter().zip(self.now.chain.home.iter());
        let home: Vec<_> = joints.map(|(joint, q)| format!("{} {q:.3}", joint.name)).collect();
        let p_wt = self.now.x_wt.translation.vector;
        InputError::new(format!(
            "the arm cannot start with its tip at [{:.3}, {:.3}, {:.3}] m: {trip}; jog it close to its \
             home posture: {}",
            p_wt.x, p_wt.y, p_wt.z, home.join(", ")
        ))
        .into()
    }

    /// Checks the last reading and returns the first trip; excessive force is reported only if
    /// there is no other trip.
    fn judge(&mut self) -> Result<(), Trip> {
        let Self { interlocks, now, reading, .. } = self;
        let mut trips = interlocks.iter_mut().filter_map(|one| one.reading(now, reading).err());
        let Some(first) = trips.next() else { return Ok(()) };
        let other = trips.find(|_| first.interlock == FORCE.name);
        Err(other.unwrap_or(first))
    }

    /// Latches a fault: brakes and rejects all further commands.
    fn latch(&mut self, fault: Fault) -> Fault {
        self.fault = Some(fault.clone());
        fault
    }

    fn trip(&mut self, trip: Trip) -> Fault {
        let is_force = trip.interlock == FORCE.name;
        let fault = Fault::Interlock { time_s: self.now.time_s, trip };
        let is_sound = self.brake();
        if is_force && is_sound {
            self.retract();
        }
        self.latch(fault)
    }

    /// Brakes all joints to rest together, along a straight line in joint space. Returns whether
    /// excessive force was the only trip meanwhile.
    fn brake(&mut self) -> bool {
        let mut is_sound = true;
        let ticks =
            (self.now.chain.stopping_s(&self.now.sent) / self.now.period_s).ceil() as usize + 1;
        for _ in 0..ticks {
            let sent = self.now.sent;
            let left_s = self.now.chain.stopping_s(&sent);
            if left_s <= 0.0 {
                break;
            }
            let slower = sent * (1.0 - self.now.period_s / left_s).max(0.0);
            let slower = limited(&self.now, &slower);
            if self.advance(&slower).is_err() {
                return false;
            }
            is_sound &= self.judge().map_or_else(|trip| trip.interlock == FORCE.name, |()| true);
        }
        is_sound
    }

    /// Retracts the finger from the object.
    fn retract(&mut self) {
        let retract_m = self.settings.retract_m;
        let from = self.now.x_wt.translation.vector;
        let Some([begun_n, _]) = self.now.load else { return };
        let ticks =
            (2.0 * retract_m / (RETRACT_M_S * self.now.period_s)) as usize + RETRACT_TIMEOUT_TICKS;
        for _ in 0..ticks {
            if (self.now.x_wt.translation.vector - from).norm() >= retract_m {
                break;
            }
            let Some(mut qdot) = self.way_back.velocity(&self.now, RETRACT_M_S) else { break };
            if self.shorten(&mut qdot).is_err() || self.advance(&qdot).is_err() {
                break;
            }
            let is_worse =
                self.now.load.is_none_or(|[force_n, _]| force_n > begun_n + RETRACT_RISE_N);
            let is_other = self.judge().is_err_and(|trip| trip.interlock != FORCE.name);
            if is_worse || is_other {
                break;
            }
        }
        self.brake();
    }
}

/// Interlocks that trip if the robot does not follow its commands.
const NOT_FOLLOWING: [&str; 3] =
    [tracking::STUCK_JOINT.name, tracking::VELOCITY.name, tracking::POSITION.name];

/// Largest number of ticks for which a command moves the robot if no other follows: the arm treats
/// a stale command as a stop.
// heuristic: 30 ms at 250 Hz.
const HELD_TICKS: f64 = 8.0;

/// Ticks added to the retract timeout of twice a retraction at full speed, to start and to stop.
const RETRACT_TIMEOUT_TICKS: usize = 100;

impl Backend for InterlockedBackend {
    fn capabilities(&self) -> &Capabilities {
        self.inner.capabilities()
    }

    fn reset(&mut self, seed: u64) -> Result<&Reading, Fault> {
        let is_cleared = std::mem::take(&mut self.is_cleared);
        if let Some(fault) = &self.fault
            && self.inner.capabilities().real_time
            && !is_cleared
        {
            return Err(fault.clone());
        }
        self.reading.copy_from(self.inner.reset(seed)?);
        self.make_interlocks();
        self.way_back.postures.clear();
        (self.fault, self.rest) = (None, None);
        (self.now.tick, self.now.sent) = (0, Joints::zeros());
        (self.now.unconfirmed_motion, self.now.time_s) = (Joints::zeros(), self.reading.time_s);
        self.take().map_err(|fault| self.latch(fault))?;
        Ok(&self.reading)
    }

    fn step(&mut self, command: &Command) -> Result<&Reading, Fault> {
        if let Some(fault) = &self.fault {
            return Err(fault.clone());
        }
        let mut qdot = match self.inner.capabilities().accept(command) {
            Ok(qdot) => qdot,
            Err(refused) => {
                self.brake();
                return Err(refused);
            }
        };
        if let Err(trip) = self.shorten(&mut qdot) {
            return Err(match self.trip_at_rest() {
                Some(trip) => self.latch(self.blocked_start_fault(&trip)),
                None => self.trip(trip),
            });
        }
        self.way_back.push(&self.now.q);
        if let Err(fault) = self.advance(&qdot) {
            // Invalid readings carry no information about braking; the robot brakes nevertheless.
            if matches!(fault, Fault::BadReading { .. }) {
                self.brake();
            }
            return Err(self.latch(fault));
        }
        match self.judge() {
            Ok(()) => Ok(&self.reading),
            Err(trip) => {
                // If readings are unreliable, braking by the servos cannot be monitored.
                if trip.interlock != FORCE.name && self.inner.capabilities().real_time {
                    if NOT_FOLLOWING.contains(&trip.interlock)
                        && let Some(fault) = self.inner.reason()
                    {
                        return Err(self.latch(fault));
                    }
                    self.inner.brake();
                }
                Err(self.trip(trip))
            }
        }
    }
}

/// Duration of the stored path; a heuristic: 10 mm at 5 mm/s, the slowest contact.
const KEPT_S: f64 = 2.0;

/// Largest number of stored postures.
const MOST: usize = 4096;

/// Retract path: the postures of the last ticks, oldest first, within a fixed capacity.
struct RetractPath {
    postures: VecDeque<Joints>,
    most: usize,
}

impl RetractPath {
    /// Creates the path for a backend with ticks of `period_s`.
    fn new(period_s: f64) -> Self {
        let most = ((KEPT_S / period_s) as usize).clamp(1, MOST);
        Self { postures: VecDeque::with_capacity(most), most }
    }

    /// Adds the current posture.
    fn push(&mut self, q: &Joints) {
        if self.postures.len() >= self.most {
            self.postures.pop_front();
        }
        self.postures.push_back(*q);
    }

    /// Returns joint velocities that move back along the path with the tip at `speed_m_s`, dropping
    /// the postures passed; `None` at the end of the path.
    fn velocity(&mut self, now: &RobotState, speed_m_s: f64) -> Option<Joints> {
        while let Some(q) = self.postures.back() {
            let by = q - now.q;
            let travel_s = now.tip_speed_m_s(&by) / speed_m_s;
            if travel_s >= now.period_s {
                return Some(by / travel_s);
            }
            self.postures.pop_back();
        }
        None
    }
}
