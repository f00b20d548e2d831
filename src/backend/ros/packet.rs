//! A message of any topic of the table.

use super::message::{
    BioTacHand, BiotacAll, DiagnosticArray, Float64MultiArray, Header, JointState, JointTrajectory,
    WrenchStamped,
};
use super::topics::Topic;

/// A message of any topic of the table, in the layout of ROS 2.
#[derive(Clone, Debug, PartialEq)]
pub enum Packet {
    /// The arm's joints.
    Joints(JointState),
    /// Force and torque.
    Wrench(WrenchStamped),
    /// A tactile frame of the BioTac's own driver.
    Hand(Box<BioTacHand>),
    /// The same of a Shadow hand.
    Fingers(Box<BiotacAll>),
    /// The arm's state.
    Status(DiagnosticArray),
    /// Joint velocities with names and validity.
    Command(JointTrajectory),
    /// Joint velocities as `ros_control` takes them.
    Velocities(Float64MultiArray),
}

impl Packet {
    /// Its header, where the message type has one.
    pub fn header(&self) -> Option<&Header> {
        match self {
            Self::Joints(message) => Some(&message.header),
            Self::Wrench(message) => Some(&message.header),
            Self::Hand(message) => Some(&message.header),
            Self::Fingers(message) => Some(&message.header),
            Self::Status(message) => Some(&message.header),
            Self::Command(message) => Some(&message.header),
            Self::Velocities(_) => None,
        }
    }

    /// The same, to be changed.
    pub fn header_mut(&mut self) -> Option<&mut Header> {
        match self {
            Self::Joints(message) => Some(&mut message.header),
            Self::Wrench(message) => Some(&mut message.header),
            Self::Hand(message) => Some(&mut message.header),
            Self::Fingers(message) => Some(&mut message.header),
            Self::Status(message) => Some(&mut message.header),
            Self::Command(message) => Some(&mut message.header),
            Self::Velocities(_) => None,
        }
    }

    /// Over which topic it goes.
    pub fn topic(&self) -> Topic {
        match self {
            Self::Joints(_) => Topic::Joints,
            Self::Wrench(_) => Topic::Wrench,
            Self::Hand(_) | Self::Fingers(_) => Topic::Tactile,
            Self::Status(_) => Topic::Status,
            Self::Command(_) | Self::Velocities(_) => Topic::Command,
        }
    }
}
