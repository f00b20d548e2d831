//! The messages as ROS 1 has them: those of ROS 2 but for the header, which counts too.

use super::definitions::*;
use crate::backend::ros::message::{
    BioTacHand, BiotacAll, DiagnosticArray, Float64MultiArray, Header, JointState, JointTrajectory,
    Time, WrenchStamped,
};
use crate::backend::ros::packet::Packet;
use roslibrust::{MessageDescriptor, RosMessageType, RosServiceType};
use serde::{Deserialize, Serialize};

/// A header as ROS 1 sends it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Counted {
    /// Consecutive number.
    seq: u32,
    /// When.
    stamp: Time,
    /// In which frame.
    frame_id: String,
}

impl From<Header> for Counted {
    fn from(Header { stamp, frame_id }: Header) -> Self {
        Self { seq: 0, stamp, frame_id }
    }
}

impl From<Counted> for Header {
    fn from(Counted { stamp, frame_id, .. }: Counted) -> Self {
        Self { stamp, frame_id }
    }
}

/// The type of a message in ROS 1, with its definition and the MD5 sum of that (genmsg 0.6).
macro_rules! ros1 {
    ($type:ty, $name:literal, $definition:expr, $md5:literal) => {
        impl RosMessageType for $type {
            const DESCRIPTION: MessageDescriptor =
                MessageDescriptor::new::<Self>($name, $md5, $definition, "", &[0; 32]);
        }
    };
}

ros1!(
    JointState<Counted>,
    "sensor_msgs/JointState",
    JOINT_STATE,
    "3066dcd76a6cfaef579bd0f34173e9fd"
);
ros1!(
    WrenchStamped<Counted>,
    "geometry_msgs/WrenchStamped",
    WRENCH_STAMPED,
    "d78d3cb249ce23087ade7e7d0c40cfa7"
);
ros1!(
    BioTacHand<Counted>,
    "biotac_sensors/BioTacHand",
    BIOTAC_HAND,
    "d96f900cbfb096d61de125081e11dcab"
);
ros1!(
    BiotacAll<Counted>,
    "sr_robot_msgs/BiotacAll",
    BIOTAC_ALL,
    "0022d8afb0897596a0c41f523836ee37"
);
ros1!(
    DiagnosticArray<Counted>,
    "diagnostic_msgs/DiagnosticArray",
    DIAGNOSTIC_ARRAY,
    "60810da900de1dd6ddd437c3503511da"
);
ros1!(
    JointTrajectory<Counted>,
    "trajectory_msgs/JointTrajectory",
    JOINT_TRAJECTORY,
    "65b4f94a94d1ed67169da35a02f33d3f"
);
ros1!(
    Float64MultiArray,
    "std_msgs/Float64MultiArray",
    FLOAT64_MULTI_ARRAY,
    "4b7d974086d4060e7db4613a7e6c3ba4"
);

/// `std_srvs/Trigger`.
pub struct Trigger;

/// Its request, which is empty.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Request {}

/// Its response.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Response {
    /// Whether it was done.
    pub success: bool,
    /// What was, or why not.
    pub message: String,
}

/// MD5 sum of `std_srvs/Trigger` (genmsg).
const TRIGGER_MD5: &str = "937c9679a518e3a18d831e57125ea522";

impl RosMessageType for Request {
    const DESCRIPTION: MessageDescriptor =
        MessageDescriptor::new::<Self>("std_srvs/TriggerRequest", TRIGGER_MD5, "", "", &[0; 32]);
}

impl RosMessageType for Response {
    const DESCRIPTION: MessageDescriptor =
        MessageDescriptor::new::<Self>("std_srvs/TriggerResponse", TRIGGER_MD5, "", "", &[0; 32]);
}

impl RosServiceType for Trigger {
    const ROS_SERVICE_NAME: &'static str = "std_srvs/Trigger";
    const MD5SUM: &'static str = TRIGGER_MD5;
    type Request = Request;
    type Response = Response;
}

/// A message with the header of the one system and of the other.
macro_rules! headed {
    ($in:ident, $out:ident, $type:ident, $packet:ident, { $($field:ident),* }) => {
        pub fn $in(message: $type<Counted>) -> Packet {
            let $type { header, $($field),* } = message;
            Packet::$packet($type { header: header.into(), $($field),* }.into())
        }

        pub fn $out(message: $type) -> $type<Counted> {
            let $type { header, $($field),* } = message;
            $type { header: header.into(), $($field),* }
        }
    };
}

headed!(joints_in, joints_out, JointState, Joints, { name, position, velocity, effort });
headed!(wrench_in, wrench_out, WrenchStamped, Wrench, { wrench });
headed!(hand_in, hand_out, BioTacHand, Hand, { hand_id, bt_data, bt_time });
headed!(fingers_in, fingers_out, BiotacAll, Fingers, { tactiles });
headed!(status_in, status_out, DiagnosticArray, Status, { status });
headed!(command_in, command_out, JointTrajectory, Command, { joint_names, points });
