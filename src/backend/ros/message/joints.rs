//! What an arm says of its joints and is told.

use super::definition::{Definition, Described};
use super::header::{Duration, Header};
use serde::{Deserialize, Serialize};

/// `sensor_msgs/JointState`: joints by name.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JointState<H = Header> {
    /// When the joints stood so.
    pub header: H,
    /// Names.
    pub name: Vec<String>,
    /// Positions in the order of the names, rad or m.
    pub position: Vec<f64>,
    /// Velocities, rad/s or m/s; may be empty.
    pub velocity: Vec<f64>,
    /// Torques or forces, N·m or N; may be empty.
    pub effort: Vec<f64>,
}

impl<H> Described for JointState<H> {
    const DEFINITION: Definition = Definition {
        name: "sensor_msgs/msg/JointState",
        fields: "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n",
        parts: &[&Header::DEFINITION],
    };
}

/// `trajectory_msgs/JointTrajectoryPoint`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JointTrajectoryPoint {
    /// Empty in a velocity command.
    pub positions: Vec<f64>,
    /// rad/s or m/s, in the order of the names.
    pub velocities: Vec<f64>,
    /// Empty in a velocity command.
    pub accelerations: Vec<f64>,
    /// Empty in a velocity command.
    pub effort: Vec<f64>,
    /// In a velocity command: how long it is valid from its stamp on.
    pub time_from_start: Duration,
}

impl Described for JointTrajectoryPoint {
    const DEFINITION: Definition = Definition {
        name: "trajectory_msgs/msg/JointTrajectoryPoint",
        fields: "float64[] positions\nfloat64[] velocities\nfloat64[] accelerations\nfloat64[] effort\n\
                 builtin_interfaces/Duration time_from_start\n",
        parts: &[&Duration::DEFINITION],
    };
}

/// `trajectory_msgs/JointTrajectory`; one point with velocities is a velocity command.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JointTrajectory<H = Header> {
    /// When it was given.
    pub header: H,
    /// Names.
    pub joint_names: Vec<String>,
    /// Points.
    pub points: Vec<JointTrajectoryPoint>,
}

impl<H> Described for JointTrajectory<H> {
    const DEFINITION: Definition = Definition {
        name: "trajectory_msgs/msg/JointTrajectory",
        fields: "std_msgs/Header header\nstring[] joint_names\ntrajectory_msgs/JointTrajectoryPoint[] points\n",
        parts: &[&Header::DEFINITION, &JointTrajectoryPoint::DEFINITION],
    };
}

/// `std_msgs/MultiArrayDimension`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MultiArrayDimension {
    /// What it counts.
    pub label: String,
    /// How many.
    pub size: u32,
    /// Entries from one to the next.
    pub stride: u32,
}

impl Described for MultiArrayDimension {
    const DEFINITION: Definition = Definition {
        name: "std_msgs/msg/MultiArrayDimension",
        fields: "string label\nuint32 size\nuint32 stride\n",
        parts: &[],
    };
}

/// `std_msgs/MultiArrayLayout`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MultiArrayLayout {
    /// Its dimensions; may be empty.
    pub dim: Vec<MultiArrayDimension>,
    /// Entries before the first.
    pub data_offset: u32,
}

impl Described for MultiArrayLayout {
    const DEFINITION: Definition = Definition {
        name: "std_msgs/msg/MultiArrayLayout",
        fields: "std_msgs/MultiArrayDimension[] dim\nuint32 data_offset\n",
        parts: &[&MultiArrayDimension::DEFINITION],
    };
}

/// `std_msgs/Float64MultiArray`: a velocity command of `ros_control`, without stamp or names.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Float64MultiArray {
    /// How the numbers are laid out; a list without dimensions.
    pub layout: MultiArrayLayout,
    /// Velocities in the controller's own order of joints.
    pub data: Vec<f64>,
}

impl Described for Float64MultiArray {
    const DEFINITION: Definition = Definition {
        name: "std_msgs/msg/Float64MultiArray",
        fields: "std_msgs/MultiArrayLayout layout\nfloat64[] data\n",
        parts: &[&MultiArrayLayout::DEFINITION],
    };
}
