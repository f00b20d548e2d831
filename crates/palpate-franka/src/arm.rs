//! Connection to the control box of an FR3, and the backend over it.

use franka::error::FrankaError;
use franka::lowpass_filter::DEFAULT_CUTOFF_FREQUENCY;
use franka::{
    ControllerMode, JointVelocities, RealtimeConfig, Robot, RobotMode, RobotOptions, RobotState,
};
use nalgebra::{Isometry3, Matrix4, Vector3};
use palpate_explore::backend::arm::Arm;
use palpate_explore::backend::interlock::{StartCheckSettings, check_start};
use palpate_explore::backend::{Backend, Capabilities, Command, Fault, LinkFault, Reading, Wrench};
use palpate_explore::robot::arm::Chain;
use palpate_input::error::InputError;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Number of joints of the arm.
const JOINTS: usize = 7;

/// Control period, s, on the robot's clock; a heuristic: as for an arm over ROS.
const PERIOD_S: f64 = 0.004;

/// Time without a command after which the arm comes to rest.
// heuristic: five ticks.
const COMMAND_TIMEOUT: Duration = Duration::from_millis(20);

/// Longest time between states of the robot, beyond the control period.
// heuristic: twice that after which the control box stops the arm, 20 lost packets.
const STATE_TIMEOUT: Duration = Duration::from_millis(40);

/// Time within which the first state arrives, a motion begins or ends, and a reflex is cleared.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);

/// State shared with the thread that answers the robot.
#[derive(Default)]
struct Shared {
    /// Commanded velocities, rad/s, with their time.
    command: Mutex<Option<([f64; JOINTS], Instant)>>,
    /// Newest state of the robot.
    state: Mutex<Option<RobotState>>,
    /// Signals a new state.
    arrival: Condvar,
    /// Whether the motion is to end as soon as the arm is at rest.
    is_ending: AtomicBool,
    /// Reason why the motion ended early.
    ended: Mutex<Option<LinkFault>>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Connection to the control box of an FR3; several backends may use it, one after another.
pub struct FrankaArm {
    chain: Chain,
    robot: Arc<Robot>,
    shared: Arc<Shared>,
    motion: Mutex<Option<JoinHandle<()>>>,
}

impl FrankaArm {
    /// Connects to the control box at `address`, whose arm is `chain`. With `realtime` the kernel
    /// must be a real-time one.
    ///
    /// # Errors
    /// If the arm has not seven joints, or the control box cannot be reached.
    pub fn connect(address: &str, realtime: bool, chain: &Chain) -> Result<Arc<Self>, LinkFault> {
        if chain.joints.len() != JOINTS {
            let found = chain.joints.len();
            let words = format!("the arm's model has {found} joints; a Franka arm has {JOINTS}");
            return Err(InputError::new(words).into());
        }
        let realtime = if realtime { RealtimeConfig::Enforce } else { RealtimeConfig::Ignore };
        let robot = Robot::with_options(address, RobotOptions::new(realtime)).map_err(|error| {
            InputError::new(format!("cannot connect to the control box at {address}: {error}"))
                .remedy(
                    "check backend.franka.address, the cable, and that FCI is activated in Desk",
                )
        })?;
        let arm = Self {
            chain: chain.clone(),
            robot: Arc::new(robot),
            shared: Arc::default(),
            motion: Mutex::default(),
        };
        arm.robot.read_once().map_err(fault)?;
        Ok(Arc::new(arm))
    }

    /// Returns a backend on this arm; use one at a time.
    pub fn backend(self: &Arc<Self>) -> FrankaBackend {
        let capabilities = Capabilities::simulated(&self.chain, PERIOD_S);
        FrankaBackend {
            arm: Arc::clone(self),
            capabilities: Capabilities {
                resettable: false,
                real_time: true,
                tactile: false,
                ..capabilities
            },
            reading: Reading::default(),
            since_s: 0.0,
        }
    }

    /// Commands the arm to rest, and checks joints and force.
    ///
    /// # Errors
    /// The first check that fails.
    pub fn check_start(self: &Arc<Self>, settings: &StartCheckSettings) -> Result<(), Fault> {
        check_start(&mut self.backend(), &self.chain, settings, 0)
    }

    /// Recovers from a reflex; only an operator may request it.
    ///
    /// # Errors
    /// If the robot refuses.
    pub fn clear_fault(&self) -> Result<(), LinkFault> {
        self.end_motion();
        self.robot.automatic_error_recovery().map_err(fault)?;
        // States sent before the answer may arrive after it.
        let since = Instant::now();
        while self.robot.read_once().map_err(fault)?.robot_mode == RobotMode::Reflex
            && since.elapsed() < CONNECT_TIMEOUT
        {}
        *lock(&self.shared.ended) = None;
        Ok(())
    }

    /// Begins to answer the robot's states, unless that is done already.
    fn begin_motion(&self) -> Result<(), LinkFault> {
        let mut motion = lock(&self.motion);
        if motion.as_ref().is_some_and(|thread| !thread.is_finished()) {
            return Ok(());
        }
        let mode = self.robot.read_once().map_err(fault)?.robot_mode;
        if mode != RobotMode::Idle && mode != RobotMode::Move {
            return Err(LinkFault::Arm(format!(
                "the robot's mode is {mode:?}; allowed is Idle: release the user stop, unlock the \
                 brakes in Desk, or recover from a reflex with --clear-fault"
            )));
        }
        let (robot, shared) = (Arc::clone(&self.robot), Arc::clone(&self.shared));
        let limits = self.chain.joints.iter().map(|joint| joint.qddot_limit);
        let mut qddot_limits = [0.0; JOINTS];
        qddot_limits.iter_mut().zip(limits).for_each(|(to, limit)| *to = limit);
        shared.is_ending.store(false, Ordering::Relaxed);
        (*lock(&shared.command), *lock(&shared.state)) = (None, None);
        *motion = Some(std::thread::spawn(move || answer(&robot, &shared, &qddot_limits)));
        Ok(())
    }

    /// Lets the arm come to rest and ends the motion.
    fn end_motion(&self) {
        self.shared.is_ending.store(true, Ordering::Relaxed);
        if let Some(thread) = lock(&self.motion).take() {
            let _ = thread.join();
        }
    }
}

impl Arm for FrankaArm {
    fn backend(self: Arc<Self>) -> Box<dyn Backend> {
        Box::new(FrankaArm::backend(&self))
    }

    fn check_start(self: Arc<Self>, settings: &StartCheckSettings) -> Result<(), Fault> {
        FrankaArm::check_start(&self, settings)
    }

    fn clear_fault(&self) -> Result<(), LinkFault> {
        FrankaArm::clear_fault(self)
    }
}

impl Drop for FrankaArm {
    fn drop(&mut self) {
        self.end_motion();
    }
}

/// Answers the robot's states with joint velocities until the motion ends.
fn answer(robot: &Robot, shared: &Shared, qddot_limits: &[f64; JOINTS]) {
    let mut qdot = [0.0; JOINTS];
    let step = |state: &RobotState, period: franka::Duration| {
        *lock(&shared.state) = Some(*state);
        shared.arrival.notify_all();
        let is_ending = shared.is_ending.load(Ordering::Relaxed);
        let command = lock(&shared.command).filter(|(_, at)| at.elapsed() < COMMAND_TIMEOUT);
        let wanted = command.filter(|_| !is_ending).map_or([0.0; JOINTS], |(wanted, _)| wanted);
        // The first period is zero; lost packets make it longer than a millisecond.
        let passed_s = period.as_secs_f64().clamp(0.0, 0.01);
        for ((qdot, wanted), limit) in qdot.iter_mut().zip(wanted).zip(qddot_limits) {
            *qdot += (wanted - *qdot).clamp(-limit * passed_s, limit * passed_s);
        }
        let mut velocities = JointVelocities::new(qdot);
        velocities.motion_finished = is_ending && qdot == [0.0; JOINTS];
        velocities
    };
    let mode = ControllerMode::JointImpedance;
    let ended = robot.control_joint_velocities(step, mode, true, DEFAULT_CUTOFF_FREQUENCY);
    if let Err(error) = ended {
        lock(&shared.ended).get_or_insert(fault(error));
        shared.arrival.notify_all();
    }
}

/// Returns the fault of an error of the interface: a reflex stops the arm until an operator
/// recovers from it.
fn fault(error: FrankaError) -> LinkFault {
    match error {
        FrankaError::Control(exception) => LinkFault::Arm(exception.message),
        other => InputError::new(other.to_string()).into(),
    }
}

/// Backend of an FR3.
pub struct FrankaBackend {
    arm: Arc<FrankaArm>,
    capabilities: Capabilities,
    reading: Reading,
    /// Robot's time at the reset, s.
    since_s: f64,
}

impl FrankaBackend {
    fn fault(&self, cause: LinkFault) -> Fault {
        Fault::Link { time_s: self.reading.time_s, cause }
    }

    /// Returns the newest state if it is at or after `time_s` on the robot's clock; otherwise waits
    /// for such a state, at most `timeout` for each new one.
    fn state_at(&self, time_s: f64, timeout: Duration) -> Result<RobotState, Fault> {
        let shared = &self.arm.shared;
        let mut state = lock(&shared.state);
        loop {
            if let Some(cause) = lock(&shared.ended).clone() {
                return Err(self.fault(cause));
            }
            if let Some(found) = state.as_ref().filter(|it| it.time.as_secs_f64() >= time_s) {
                return Ok(*found);
            }
            let (next, waited) =
                shared.arrival.wait_timeout(state, timeout).unwrap_or_else(PoisonError::into_inner);
            state = next;
            if waited.timed_out() {
                let words = format!("no state of the robot for {} ms", timeout.as_millis());
                return Err(self.fault(InputError::new(words).into()));
            }
        }
    }

    /// Copies a state into the reading.
    fn read(&mut self, state: &RobotState) -> &Reading {
        let reading = &mut self.reading;
        reading.time_s = state.time.as_secs_f64() - self.since_s;
        reading.q.clear();
        reading.q.extend(state.q);
        reading.qdot.clear();
        reading.qdot.extend(state.dq);
        reading.wrench = Some(tip_wrench(state, &self.arm.chain.tool));
        reading
    }
}

/// Returns the estimated external wrench in `T`, whose pose in the flange's frame is `x_ft`.
fn tip_wrench(state: &RobotState, x_ft: &Isometry3<f64>) -> Wrench {
    let pose = |columns: &[f64; 16]| {
        let matrix = Matrix4::from_column_slice(columns);
        let turn = nalgebra::Rotation3::from_matrix(&matrix.fixed_view::<3, 3>(0, 0).into_owned());
        let at = Vector3::new(columns[12], columns[13], columns[14]);
        Isometry3::from_parts(at.into(), nalgebra::UnitQuaternion::from_rotation_matrix(&turn))
    };
    // The wrench acts on the stiffness frame K, whose pose is set in Desk or by the client.
    let x_fk = pose(&state.F_T_EE) * pose(&state.EE_T_K);
    // It is that of the arm on its environment (libfranka, `robot_state.h`).
    let [fx, fy, fz, tx, ty, tz] = state.K_F_ext_hat_K.map(|part| -part);
    let wrench = Wrench { force_n: Vector3::new(fx, fy, fz), torque_nm: Vector3::new(tx, ty, tz) };
    wrench.moved(&(x_ft.inverse() * x_fk))
}

impl Backend for FrankaBackend {
    fn capabilities(&self) -> &Capabilities {
        &self.capabilities
    }

    /// Begins the motion at rest, without moving the arm.
    fn reset(&mut self, _seed: u64) -> Result<&Reading, Fault> {
        if let Some(cause) = lock(&self.arm.shared.ended).clone() {
            return Err(self.fault(cause));
        }
        self.arm.begin_motion().map_err(|cause| self.fault(cause))?;
        let state = self.state_at(0.0, CONNECT_TIMEOUT)?;
        self.since_s = state.time.as_secs_f64();
        self.reading.applied.qdot = vec![0.0; JOINTS];
        Ok(self.read(&state))
    }

    fn step(&mut self, command: &Command) -> Result<&Reading, Fault> {
        self.capabilities.accept(command)?;
        let mut qdot = [0.0; JOINTS];
        qdot.copy_from_slice(&command.qdot);
        *lock(&self.arm.shared.command) = Some((qdot, Instant::now()));
        // The robot counts milliseconds; half of one allows for rounding.
        let due_s = self.since_s + self.reading.time_s + PERIOD_S - 0.5e-3;
        let state = self.state_at(due_s, STATE_TIMEOUT)?;
        self.reading.applied.clone_from(command);
        Ok(self.read(&state))
    }

    /// Stops the motion.
    fn brake(&mut self) {
        // The reason of the stop is reported; an arm that cannot be reached stops by itself.
        let _ = self.arm.robot.stop();
    }
}
