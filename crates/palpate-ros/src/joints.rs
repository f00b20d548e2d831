//! Joints by name: mapping between messages and the arm's order.

use super::message::{
    Duration, Float64MultiArray, Header, JointState, JointTrajectory, JointTrajectoryPoint,
};
use super::topics::{CommandMessage, CommandTopic};
use super::transport::Packet;
use palpate_input::error::InputError;

/// Names of an arm's joints, in the arm's order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JointNames(Vec<String>);

impl JointNames {
    /// Creates the joint names from `names` in the arm's order.
    pub fn new(names: Vec<String>) -> Self {
        Self(names)
    }

    /// Returns the names in the arm's order.
    pub fn names(&self) -> &[String] {
        &self.0
    }

    /// Whether any of `names` is one of the arm's joints.
    pub fn are_among(&self, names: &[String]) -> bool {
        self.0.iter().any(|name| names.contains(name))
    }

    /// Writes `values`, one for each of `names`, to `into`, in the arm's order.
    ///
    /// # Errors
    /// If one is missing, repeated or not finite, or the lengths differ.
    fn pick(
        &self,
        what: &'static str,
        names: &[String],
        values: &[f64],
        into: &mut Vec<f64>,
    ) -> Result<(), InputError> {
        if values.len() != names.len() {
            let (found, expected) = (values.len(), names.len());
            return Err(InputError::new(format!("{found} {what} for {expected} joints")));
        }
        into.clear();
        for name in &self.0 {
            let mut found = names.iter().zip(values).filter(|(other, _)| *other == name);
            let missing = || InputError::new(format!("no joint \"{name}\" among {names:?}"));
            let (_, &value) = found.next().ok_or_else(missing)?;
            if found.next().is_some() {
                return Err(InputError::new(format!("joint \"{name}\" is named twice")));
            }
            if !value.is_finite() {
                return Err(InputError::new(format!("{what} of \"{name}\" is {value}")));
            }
            into.push(value);
        }
        Ok(())
    }

    /// Reads positions and velocities of a message, which may name other joints too.
    ///
    /// # Errors
    /// If a joint of the arm is missing.
    pub fn read(
        &self,
        message: &JointState,
        q: &mut Vec<f64>,
        qdot: &mut Vec<f64>,
    ) -> Result<(), InputError> {
        self.pick("positions", &message.name, &message.position, q)?;
        self.pick("velocities", &message.name, &message.velocity, qdot)
    }

    /// Returns a joint state message.
    pub fn state(&self, stamp_s: f64, q: &[f64], qdot: &[f64]) -> JointState {
        JointState {
            header: Header::new(stamp_s, ""),
            name: self.0.clone(),
            position: q.into(),
            velocity: qdot.into(),
            effort: Vec::new(),
        }
    }

    /// Returns a velocity command for `topic` with the stamp `stamp_s`.
    pub fn command(&self, stamp_s: f64, qdot: &[f64], topic: &CommandTopic) -> Packet {
        if topic.message == CommandMessage::Velocities {
            let data = qdot.into();
            return Packet::Velocities(Float64MultiArray { data, ..Float64MultiArray::default() });
        }
        Packet::Command(JointTrajectory {
            header: Header::new(stamp_s, ""),
            joint_names: self.0.clone(),
            points: vec![JointTrajectoryPoint {
                velocities: qdot.into(),
                time_from_start: Duration::from_s(topic.max_age_s),
                ..JointTrajectoryPoint::default()
            }],
        })
    }

    /// Reads a velocity command: returns its stamp and its validity, s. A command without names has
    /// neither.
    ///
    /// # Errors
    /// If it does not contain one finite velocity for each joint of this arm.
    pub fn read_command(
        &self,
        packet: &Packet,
        qdot: &mut Vec<f64>,
    ) -> Result<Option<[f64; 2]>, InputError> {
        let points = |found: usize| {
            Err(InputError::new(format!("{found} points in a velocity command; allowed is one")))
        };
        match packet {
            Packet::Command(message) => {
                let [point] = message.points.as_slice() else {
                    return points(message.points.len());
                };
                let names = &message.joint_names;
                if let Some(name) = names.iter().find(|name| !self.0.contains(name)) {
                    let known = &self.0;
                    let words =
                        format!("\"{name}\" is not a joint of this arm; its joints are {known:?}");
                    return Err(InputError::new(words));
                }
                self.pick("velocities", names, &point.velocities, qdot)?;
                Ok(Some([message.header.stamp.s(), point.time_from_start.s()]))
            }
            Packet::Velocities(message) => {
                self.pick("velocities", &self.0, &message.data, qdot)?;
                Ok(None)
            }
            _ => points(0),
        }
    }
}
