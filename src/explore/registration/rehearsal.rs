//! Touches tried out on the arm's kinematics alone: which of them it can make one after the other
//! within its limits, by the same servo that will make them.

use crate::backend::{Backend, Capabilities, Command, Fault, Reading};
use crate::explore::probe::Probe;
use crate::explore::probe::servo::Servo;
use crate::robot::Robot;
use crate::robot::arm::{Chain, Joints, Kind};
use crate::task::Approach;
use crate::task::touch::TouchSettings;

/// An arm in empty space: no mass, no object, no sensor.
struct Rehearsal {
    chain: Chain,
    capabilities: Capabilities,
    q: Joints,
    reading: Reading,
}

/// Its tick; chosen: what a resolved-rate controller needs, not what a servo does.
const PERIOD_S: f64 = 0.01;

impl Rehearsal {
    fn new(chain: &Chain) -> Self {
        let capabilities = Capabilities::of(chain, PERIOD_S);
        let (chain, q, reading) = (chain.clone(), chain.home, Reading::default());
        Self { chain, capabilities, q, reading }
    }

    fn report(&mut self, qdot: &Joints) {
        let joints = self.chain.joints.len();
        let told = [(&mut self.reading.q, &self.q), (&mut self.reading.qdot, qdot)];
        for (to, from) in told {
            to.clear();
            to.extend(from.iter().take(joints));
        }
    }
}

impl Backend for Rehearsal {
    fn capabilities(&self) -> &Capabilities {
        &self.capabilities
    }

    fn reset(&mut self, _seed: u64) -> Result<&Reading, Fault> {
        self.q = self.chain.home;
        self.reading.time_s = 0.0;
        self.report(&Joints::zeros());
        Ok(&self.reading)
    }

    fn step(&mut self, command: &Command) -> Result<&Reading, Fault> {
        let qdot = self.capabilities.accept(command)?;
        self.q = self.chain.clamp(&(self.q + qdot * PERIOD_S));
        self.reading.time_s += PERIOD_S;
        self.report(&qdot);
        Ok(&self.reading)
    }
}

/// How far the rehearsed joints keep from their limits, because touches do not end exactly where
/// they are rehearsed; chosen.
const SLACK_RAD: f64 = 0.25;

/// Those of `approaches` that `robot` can go one after the other from home, by number.
///
/// # Errors
/// If the robot cannot be driven at all.
pub fn rehearsed(
    robot: &Robot,
    touch: &TouchSettings,
    approaches: &[Approach],
) -> Result<Vec<usize>, Fault> {
    let mut robot = robot.clone();
    for joint in robot.chain.joints.iter_mut().filter(|joint| joint.kind == Kind::Revolute) {
        joint.q_limits = [joint.q_limits[0] + SLACK_RAD, joint.q_limits[1] - SLACK_RAD];
    }
    let mut left: Vec<usize> = (0..approaches.len()).collect();
    'again: loop {
        let body = Box::new(Rehearsal::new(&robot.chain));
        let mut servo = Servo::new(robot.clone(), touch.clone(), body, 0)?;
        for at in 0..left.len() {
            if servo.touch(&approaches[left[at]]).is_err() {
                left.remove(at);
                continue 'again;
            }
        }
        return Ok(left);
    }
}
