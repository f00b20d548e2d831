//! Messages of the arm's topics and of recordings, in the layout of ROS 2.
//!
//! `biotac_sensors` (kth-ros-pkg/biotac_driver, BSD) and `sr_robot_msgs` (shadow-robot/sr_common,
//! BSD-3) are packages of ROS 1; for ROS 2 they keep their fields, with the ROS 2 header.

use super::definition::{Definition, HasDefinition, messages};
use nalgebra::Point3;
use serde::{Deserialize, Serialize};

messages! {
    /// A time since 1970, or since the start of a simulation.
    #[derive(Copy, Eq)]
    builtin_interfaces/Time {
        /// Whole seconds.
        int32 sec,
        /// Remainder, ns.
        uint32 nanosec,
    }

    /// A duration, the sum of both parts.
    #[derive(Copy, Eq)]
    builtin_interfaces/Duration {
        /// Whole seconds.
        int32 sec,
        /// Remainder, ns.
        uint32 nanosec,
    }

    /// Time and frame: the first field of most messages.
    std_msgs/Header {
        /// Time of measurement, by the sender's clock.
        builtin_interfaces/Time stamp,
        /// Frame of the following data.
        string frame_id,
    }

    /// State of named joints.
    sensor_msgs/JointState {
        /// Time of the state.
        std_msgs/Header header,
        /// Names.
        string[] name,
        /// Positions in the order of the names, rad or m.
        float64[] position,
        /// Velocities, rad/s or m/s; may be empty.
        float64[] velocity,
        /// Torques or forces, N·m or N; may be empty.
        float64[] effort,
    }

    /// A point of a trajectory.
    trajectory_msgs/JointTrajectoryPoint {
        /// Empty in a velocity command.
        float64[] positions,
        /// Velocities, rad/s or m/s, in the order of the names.
        float64[] velocities,
        /// Empty in a velocity command.
        float64[] accelerations,
        /// Empty in a velocity command.
        float64[] effort,
        /// Validity of a velocity command from its stamp on.
        builtin_interfaces/Duration time_from_start,
    }

    /// A trajectory; one point with velocities is a velocity command.
    trajectory_msgs/JointTrajectory {
        /// Time of the command.
        std_msgs/Header header,
        /// Names.
        string[] joint_names,
        /// Points.
        trajectory_msgs/JointTrajectoryPoint[] points,
    }

    /// A dimension of an array.
    std_msgs/MultiArrayDimension {
        /// Name.
        string label,
        /// Size.
        uint32 size,
        /// Stride between entries.
        uint32 stride,
    }

    /// Layout of an array.
    std_msgs/MultiArrayLayout {
        /// Dimensions; may be empty.
        std_msgs/MultiArrayDimension[] dim,
        /// Offset of the first entry.
        uint32 data_offset,
    }

    /// A velocity command of `ros_control`, without stamp or names.
    std_msgs/Float64MultiArray {
        /// Layout; an array without dimensions.
        std_msgs/MultiArrayLayout layout,
        /// Velocities in the controller's order of joints.
        float64[] data,
    }

    /// A boolean.
    #[derive(Copy)]
    std_msgs/Bool {
        /// Value.
        bool data,
    }

    /// An image.
    sensor_msgs/Image {
        /// Time and frame.
        std_msgs/Header header,
        /// Number of rows.
        uint32 height,
        /// Number of columns.
        uint32 width,
        /// Encoding of a pixel.
        string encoding,
        /// Whether numbers are big-endian.
        uint8 is_bigendian,
        /// Length of a row, bytes.
        uint32 step,
        /// Pixels, row by row.
        uint8[] data,
    }

    /// A number.
    #[derive(Copy)]
    std_msgs/Float64 {
        /// Value.
        float64 data,
    }

    /// Mode of a Universal Robots arm, by its number.
    #[derive(Copy)]
    ur_dashboard_msgs/RobotMode {
        "int8 NO_CONTROLLER=-1\nint8 DISCONNECTED=0\nint8 CONFIRM_SAFETY=1\nint8 BOOTING=2\nint8 POWER_OFF=3\nint8 POWER_ON=4\nint8 IDLE=5\nint8 BACKDRIVE=6\nint8 RUNNING=7\nint8 UPDATING_FIRMWARE=8\n"
        /// Number; 7: running.
        int8 mode,
    }

    /// Safety mode of a Universal Robots arm, by its number.
    #[derive(Copy)]
    ur_dashboard_msgs/SafetyMode {
        "uint8 NORMAL=1\nuint8 REDUCED=2\nuint8 PROTECTIVE_STOP=3\nuint8 RECOVERY=4\nuint8 SAFEGUARD_STOP=5\nuint8 SYSTEM_EMERGENCY_STOP=6\nuint8 ROBOT_EMERGENCY_STOP=7\nuint8 VIOLATION=8\nuint8 FAULT=9\nuint8 VALIDATE_JOINT_ID=10\nuint8 UNDEFINED_SAFETY_MODE=11\nuint8 AUTOMATIC_MODE_SAFEGUARD_STOP=12\nuint8 SYSTEM_THREE_POSITION_ENABLING_STOP=13\n"
        /// Number; 1: normal.
        uint8 mode,
    }

    /// Data of one finger, in counts.
    biotac_sensors/BioTacData {
        /// Serial number.
        string bt_serial,
        /// Number of the finger.
        uint16 bt_position,
        /// Temperature (TDC).
        uint16 tdc_data,
        /// Change of temperature (TAC).
        uint16 tac_data,
        /// Static pressure (PDC).
        uint16 pdc_data,
        /// Vibration (PAC), oldest first.
        uint16[22] pac_data,
        /// Electrodes E1 to E19.
        uint16[19] electrode_data,
    }

    /// Time of a frame and of its channels.
    biotac_sensors/BioTacTime {
        /// Time of the first channel.
        builtin_interfaces/Time frame_start_time,
        /// Time of the last channel.
        builtin_interfaces/Time frame_end_time,
        /// Offset of TDC; unused, like all offsets, since the driver computes them incorrectly.
        uint32 tdc_ns_offset,
        /// Offset of TAC.
        uint32 tac_ns_offset,
        /// Offset of PDC.
        uint32 pdc_ns_offset,
        /// Offsets of PAC.
        uint32[22] pac_ns_offset,
        /// Offsets of the electrodes.
        uint32[19] electrode_ns_offset,
    }

    /// One frame of all fingers.
    biotac_sensors/BioTacHand {
        /// Host's time at the frame's end.
        std_msgs/Header header,
        /// Identifier of the hand.
        string hand_id,
        /// One entry per finger.
        biotac_sensors/BioTacData[] bt_data,
        /// Times of the channels.
        biotac_sensors/BioTacTime bt_time,
    }

    /// Data of one finger of a Shadow hand. Its channels are transmitted one after another over
    /// EtherCAT, so that those of one message have different ages.
    sr_robot_msgs/Biotac {
        /// Vibration, newest two samples.
        int16 pac0,
        /// Vibration.
        int16 pac1,
        /// Vibration, all received samples.
        int16[] pac,
        /// Static pressure.
        int16 pdc,
        /// Change of temperature.
        int16 tac,
        /// Temperature.
        int16 tdc,
        /// Electrodes, 19 or 24 depending on the model.
        int16[] electrodes,
    }

    /// The five fingers of a hand.
    sr_robot_msgs/BiotacAll {
        /// Host's time.
        std_msgs/Header header,
        /// First finger to thumb.
        sr_robot_msgs/Biotac[5] tactiles,
    }

    /// A property of a device.
    diagnostic_msgs/KeyValue {
        /// Name of the property.
        string key,
        /// Value as text.
        string value,
    }

    /// The state of a device.
    diagnostic_msgs/DiagnosticStatus {
        "byte OK=0\nbyte WARN=1\nbyte ERROR=2\nbyte STALE=3\n"
        /// Level of the status: 0 ok, 1 warn, 2 error, 3 stale.
        byte level,
        /// Name of the device.
        string name,
        /// Description.
        string message,
        /// Identifier of the device.
        string hardware_id,
        /// Detailed values.
        diagnostic_msgs/KeyValue[] values,
    }

    /// The state of an arm.
    diagnostic_msgs/DiagnosticArray {
        /// Time.
        std_msgs/Header header,
        /// One entry per device.
        diagnostic_msgs/DiagnosticStatus[] status,
    }

    /// A vector.
    #[derive(Copy)]
    geometry_msgs/Vector3 {
        /// Along x.
        float64 x,
        /// Along y.
        float64 y,
        /// Along z.
        float64 z,
    }

    /// Force and torque.
    #[derive(Copy)]
    geometry_msgs/Wrench {
        /// Force, N.
        geometry_msgs/Vector3 force,
        /// Torque, N·m.
        geometry_msgs/Vector3 torque,
    }

    /// Reading of a force/torque sensor, in its own frame, without bias compensation.
    geometry_msgs/WrenchStamped {
        /// Time and frame of the measurement.
        std_msgs/Header header,
        /// Force and torque.
        geometry_msgs/Wrench wrench,
    }

    /// A position, m.
    #[derive(Copy)]
    geometry_msgs/Point {
        /// Along x.
        float64 x,
        /// Along y.
        float64 y,
        /// Along z.
        float64 z,
    }

    /// A rotation.
    #[derive(Copy)]
    geometry_msgs/Quaternion {
        /// Imaginary, along x.
        float64 x 0,
        /// Imaginary, along y.
        float64 y 0,
        /// Imaginary, along z.
        float64 z 0,
        /// Real.
        float64 w 1,
    }

    /// A position and a rotation.
    #[derive(Copy)]
    geometry_msgs/Pose {
        /// Position.
        geometry_msgs/Point position,
        /// Rotation.
        geometry_msgs/Quaternion orientation,
    }

    /// A colour, with components from 0 to 1.
    #[derive(Copy)]
    std_msgs/ColorRGBA {
        /// Red.
        float32 r,
        /// Green.
        float32 g,
        /// Blue.
        float32 b,
        /// Opacity.
        float32 a,
    }

    /// A texture; empty in a marker without one.
    sensor_msgs/CompressedImage {
        /// Time.
        std_msgs/Header header,
        /// Empty.
        string format,
        /// Empty.
        uint8[] data,
    }

    /// A position in a texture.
    #[derive(Copy)]
    visualization_msgs/UVCoordinate {
        /// Horizontal coordinate.
        float32 u,
        /// Vertical coordinate.
        float32 v,
    }

    /// A mesh; empty in a marker of points.
    visualization_msgs/MeshFile {
        /// Empty.
        string filename,
        /// Empty.
        uint8[] data,
    }

    /// A shape for visualisation, as of ROS 2 Humble.
    visualization_msgs/Marker {
        /// Time and frame.
        std_msgs/Header header,
        /// Namespace; a marker with the same `ns` and `id` replaces the earlier one.
        string ns,
        /// Identifier within its `ns`.
        int32 id,
        /// Number of the [`Shape`] of the marker.
        int32 r#type,
        /// Action; 0: add or replace the marker.
        int32 action,
        /// Pose of the points' frame in the header's frame.
        geometry_msgs/Pose pose,
        /// Size of the element at each point, m.
        geometry_msgs/Vector3 scale,
        /// Colour of all points without their own.
        std_msgs/ColorRGBA color,
        /// Lifetime; zero: forever.
        builtin_interfaces/Duration lifetime,
        /// Whether the marker moves with its frame.
        bool frame_locked,
        /// Points.
        geometry_msgs/Point[] points,
        /// Colours, one per point, or empty.
        std_msgs/ColorRGBA[] colors,
        /// Empty.
        string texture_resource,
        /// Empty.
        sensor_msgs/CompressedImage texture,
        /// Empty.
        visualization_msgs/UVCoordinate[] uv_coordinates,
        /// Empty.
        string text,
        /// Empty.
        string mesh_resource,
        /// Empty.
        visualization_msgs/MeshFile mesh_file,
        /// Whether a mesh contains its own colours.
        bool mesh_use_embedded_materials,
    }

    /// Request of a service without arguments. ROS 2 has no empty message, so it contains one byte.
    std_srvs/TriggerRequest {
        /// Placeholder byte, always 0.
        uint8 structure_needs_at_least_one_member,
    }

    /// Response of a service without arguments.
    #[derive(Eq)]
    std_srvs/TriggerResponse {
        /// Whether the request succeeded.
        bool success,
        /// Description of the result or the error.
        string message,
    }
}

/// `std_msgs/Bool`: whether a switch at the tip is closed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Touching {
    /// Value.
    pub data: bool,
}

impl HasDefinition for Touching {
    const DEFINITION: Definition = Bool::DEFINITION;
}

const NANO: f64 = 1e9;

/// Implements conversions from and to seconds.
macro_rules! seconds {
    ($($name:ident),*) => {$(
        impl $name {
            /// Creates a time from seconds, rounded to nanoseconds.
            pub fn from_s(time_s: f64) -> Self {
                let whole_s = time_s.floor();
                let nanosec = ((time_s - whole_s) * NANO).round();
                match nanosec < NANO {
                    true => Self { sec: whole_s as i32, nanosec: nanosec as u32 },
                    false => Self { sec: whole_s as i32 + 1, nanosec: 0 },
                }
            }

            /// Returns the time in seconds.
            pub fn s(self) -> f64 {
                f64::from(self.sec) + f64::from(self.nanosec) / NANO
            }
        }
    )*};
}

seconds!(Time, Duration);

impl Header {
    /// Creates a header with a time in seconds and a frame.
    pub fn new(stamp_s: f64, frame_id: &str) -> Self {
        Self { stamp: Time::from_s(stamp_s), frame_id: frame_id.into() }
    }
}

impl From<nalgebra::Vector3<f64>> for Vector3 {
    fn from(v: nalgebra::Vector3<f64>) -> Self {
        Self { x: v.x, y: v.y, z: v.z }
    }
}

impl From<Vector3> for nalgebra::Vector3<f64> {
    fn from(v: Vector3) -> Self {
        Self::new(v.x, v.y, v.z)
    }
}

impl From<Point3<f64>> for Point {
    fn from(p: Point3<f64>) -> Self {
        Self { x: p.x, y: p.y, z: p.z }
    }
}

/// Shape of a marker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// An arrow from the first to the second point; its size is the diameter of the shaft.
    Arrow = 0,
    /// Points joined by a line.
    LineStrip = 4,
    /// A line per two points.
    LineList = 5,
    /// One ball per point.
    SphereList = 7,
    /// One triangle per three points.
    TriangleList = 11,
}

impl Marker {
    /// Creates a marker named `ns` without points, to be drawn as `shape` of size `scale_m` in the
    /// frame `W`.
    pub fn new(ns: &str, shape: Shape, scale_m: f64, color: ColorRGBA) -> Self {
        Self {
            header: Header::new(0.0, "W"),
            ns: ns.into(),
            r#type: shape as i32,
            scale: Vector3 { x: scale_m, y: scale_m, z: scale_m },
            color,
            ..Self::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_rounded_to_nanoseconds_and_carry() {
        assert_eq!(Time::from_s(1.25), Time { sec: 1, nanosec: 250_000_000 });
        assert_eq!(Time::from_s(0.999_999_999_9), Time { sec: 1, nanosec: 0 });
        assert_eq!(Time::from_s(-0.25), Time { sec: -1, nanosec: 750_000_000 });
        assert!((Time::from_s(1.7e9 + 0.125).s() - 1.7e9 - 0.125).abs() < 1e-6);
    }

    #[test]
    fn a_definition_names_every_part_once() {
        let text = BioTacHand::DEFINITION.text();
        for part in ["std_msgs/Header", "biotac_sensors/BioTacData", "builtin_interfaces/Time"] {
            assert_eq!(text.matches(&format!("MSG: {part}\n")).count(), 1, "{part} in {text}");
        }
    }
}
