//! Wire format of ROS 1 messages: as in ROS 2, except that the header has a sequence number.

use crate::definition::{HasDefinition, Text};
use crate::message::{
    BioTacHand, BiotacAll, DiagnosticArray, Float64MultiArray, Image, JointState, JointTrajectory,
    Touching, TriggerResponse, WrenchStamped,
};
use crate::view::{CameraInfo, PointCloud2};
use roslibrust::{MessageDescriptor, RosMessageType, RosServiceType};
use serde::{Deserialize, Serialize};

/// A message with a header as sent by ROS 1: the header's sequence number comes before its other
/// fields, which are the first of the message.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SequencedMessage<M> {
    /// Sequence number.
    pub seq: u32,
    /// The message.
    pub message: M,
}

/// Implements message types with their ROS 1 names and the MD5 sums of their definitions (genmsg
/// 0.6).
macro_rules! ros1 {
    ($($type:ty: $message:ident = $name:literal, $md5:literal;)*) => {$(
        impl RosMessageType for $type {
            const DESCRIPTION: MessageDescriptor = {
                const TEXT: &Text = &$message::DEFINITION.ros1();
                MessageDescriptor::new::<Self>($name, $md5, TEXT.as_str(), "", &[0; 32])
            };
        }
    )*};
}

ros1! {
    SequencedMessage<JointState>: JointState =
        "sensor_msgs/JointState", "3066dcd76a6cfaef579bd0f34173e9fd";
    SequencedMessage<WrenchStamped>: WrenchStamped =
        "geometry_msgs/WrenchStamped", "d78d3cb249ce23087ade7e7d0c40cfa7";
    SequencedMessage<BioTacHand>: BioTacHand =
        "biotac_sensors/BioTacHand", "d96f900cbfb096d61de125081e11dcab";
    SequencedMessage<BiotacAll>: BiotacAll =
        "sr_robot_msgs/BiotacAll", "0022d8afb0897596a0c41f523836ee37";
    SequencedMessage<Image>: Image =
        "sensor_msgs/Image", "060021388200f6f0f447d0fcd9c64743";
    SequencedMessage<PointCloud2>: PointCloud2 =
        "sensor_msgs/PointCloud2", "1158d486dd51d683ce2f1be655c3c181";
    SequencedMessage<CameraInfo>: CameraInfo =
        "sensor_msgs/CameraInfo", "c9a58c1b0b154e0e6da7578cb991d214";
    Touching: Touching = "std_msgs/Bool", "8b94c1b53db61fb6aed406028ad6332a";
    SequencedMessage<DiagnosticArray>: DiagnosticArray =
        "diagnostic_msgs/DiagnosticArray", "60810da900de1dd6ddd437c3503511da";
    SequencedMessage<JointTrajectory>: JointTrajectory =
        "trajectory_msgs/JointTrajectory", "65b4f94a94d1ed67169da35a02f33d3f";
    Float64MultiArray: Float64MultiArray =
        "std_msgs/Float64MultiArray", "4b7d974086d4060e7db4613a7e6c3ba4";
}

/// The service `std_srvs/Trigger`.
pub struct Trigger;

/// Empty request.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Request {}

/// MD5 sum of `std_srvs/Trigger` (genmsg).
const TRIGGER_MD5: &str = "937c9679a518e3a18d831e57125ea522";

impl RosMessageType for Request {
    const DESCRIPTION: MessageDescriptor =
        MessageDescriptor::new::<Self>("std_srvs/TriggerRequest", TRIGGER_MD5, "", "", &[0; 32]);
}

impl RosMessageType for TriggerResponse {
    const DESCRIPTION: MessageDescriptor =
        MessageDescriptor::new::<Self>("std_srvs/TriggerResponse", TRIGGER_MD5, "", "", &[0; 32]);
}

impl RosServiceType for Trigger {
    const ROS_SERVICE_NAME: &'static str = "std_srvs/Trigger";
    const MD5SUM: &'static str = TRIGGER_MD5;
    type Request = Request;
    type Response = TriggerResponse;
}
