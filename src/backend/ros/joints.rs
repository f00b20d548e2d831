//! Joints by name: which number of a message is which joint's.

use super::message::JointTrajectoryPoint;
use super::message::{Duration, Float64MultiArray, Header, JointState, JointTrajectory};
use super::packet::Packet;
use thiserror::Error;

/// A message about joints that cannot be used.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum JointsError {
    /// A joint is not named.
    #[error("no joint \"{name}\" among {found:?}")]
    Missing {
        /// Which.
        name: String,
        /// Those that are named.
        found: Vec<String>,
    },
    /// A joint is named twice.
    #[error("joint \"{name}\" is named twice")]
    Twice {
        /// Which.
        name: String,
    },
    /// A name that is no joint's, in a command.
    #[error("\"{name}\" is no joint of this arm, which has {known:?}")]
    Unknown {
        /// Which.
        name: String,
        /// The arm's.
        known: Vec<String>,
    },
    /// As many numbers as names are wanted.
    #[error("{found} {what} for {expected} joints")]
    Length {
        /// Of what.
        what: &'static str,
        /// Numbers there are.
        found: usize,
        /// Names there are.
        expected: usize,
    },
    /// A number that is none.
    #[error("{what} of \"{name}\" is {value}")]
    NotFinite {
        /// What it should be.
        what: &'static str,
        /// Whose.
        name: String,
        /// What it is.
        value: f64,
    },
    /// A velocity command has one point.
    #[error("{found} points in a velocity command, allowed is one")]
    Points {
        /// How many it has.
        found: usize,
    },
}

/// The names of an arm's joints, in the order in which the arm counts them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JointNames(Vec<String>);

impl JointNames {
    /// In the arm's order.
    pub fn new(names: Vec<String>) -> Self {
        Self(names)
    }

    /// In the arm's order.
    pub fn names(&self) -> &[String] {
        &self.0
    }

    /// Whether any of `names` is one of the arm's joints.
    pub fn are_among(&self, names: &[String]) -> bool {
        self.0.iter().any(|name| names.contains(name))
    }

    /// Puts `values`, one for each of `names`, into `into`, in the arm's order.
    ///
    /// # Errors
    /// If one is missing, twice there or not finite, or their lengths differ.
    fn pick(
        &self,
        what: &'static str,
        names: &[String],
        values: &[f64],
        into: &mut Vec<f64>,
    ) -> Result<(), JointsError> {
        if values.len() != names.len() {
            return Err(JointsError::Length { what, found: values.len(), expected: names.len() });
        }
        into.clear();
        for name in &self.0 {
            let mut found = names.iter().zip(values).filter(|(other, _)| *other == name);
            let missing = || JointsError::Missing { name: name.clone(), found: names.to_vec() };
            let (_, &value) = found.next().ok_or_else(missing)?;
            if found.next().is_some() {
                return Err(JointsError::Twice { name: name.clone() });
            }
            if !value.is_finite() {
                return Err(JointsError::NotFinite { what, name: name.clone(), value });
            }
            into.push(value);
        }
        Ok(())
    }

    /// Reads positions and velocities of a message, which may name other joints too.
    ///
    /// # Errors
    /// If it does not say them of every joint of the arm.
    pub fn read(
        &self,
        message: &JointState,
        q: &mut Vec<f64>,
        qdot: &mut Vec<f64>,
    ) -> Result<(), JointsError> {
        self.pick("positions", &message.name, &message.position, q)?;
        self.pick("velocities", &message.name, &message.velocity, qdot)
    }

    /// What an arm says of itself.
    pub fn state(&self, stamp_s: f64, q: &[f64], qdot: &[f64]) -> JointState {
        JointState {
            header: Header::new(stamp_s, ""),
            name: self.0.clone(),
            position: q.into(),
            velocity: qdot.into(),
            effort: Vec::new(),
        }
    }

    /// A velocity command that is valid for `valid_s` from `stamp_s` on; without names and stamp
    /// where the lab wants it so.
    pub fn command(&self, stamp_s: f64, valid_s: f64, qdot: &[f64], is_bare: bool) -> Packet {
        if is_bare {
            return Packet::Velocities(Float64MultiArray {
                data: qdot.into(),
                ..Float64MultiArray::default()
            });
        }
        Packet::Command(JointTrajectory {
            header: Header::new(stamp_s, ""),
            joint_names: self.0.clone(),
            points: vec![JointTrajectoryPoint {
                velocities: qdot.into(),
                time_from_start: Duration::from_s(valid_s),
                ..JointTrajectoryPoint::default()
            }],
        })
    }

    /// Reads a velocity command: its stamp and for how long it is valid, in seconds. A bare one has
    /// neither.
    ///
    /// # Errors
    /// If it is not of this arm's joints, one finite velocity each.
    pub fn read_command(
        &self,
        packet: &Packet,
        qdot: &mut Vec<f64>,
    ) -> Result<Option<[f64; 2]>, JointsError> {
        match packet {
            Packet::Command(message) => {
                let [point] = message.points.as_slice() else {
                    return Err(JointsError::Points { found: message.points.len() });
                };
                let names = &message.joint_names;
                if let Some(name) = names.iter().find(|name| !self.0.contains(name)) {
                    return Err(JointsError::Unknown { name: name.clone(), known: self.0.clone() });
                }
                self.pick("velocities", names, &point.velocities, qdot)?;
                Ok(Some([message.header.stamp.s(), point.time_from_start.s()]))
            }
            Packet::Velocities(message) => {
                self.pick("velocities", &self.0, &message.data, qdot)?;
                Ok(None)
            }
            _ => Err(JointsError::Points { found: 0 }),
        }
    }
}
