//! Messages of the lab's topics and of recordings, in the layout of ROS 2.
//!
//! `biotac_sensors` (kth-ros-pkg/biotac_driver, BSD) and `sr_robot_msgs` (shadow-robot/sr_common,
//! BSD-3) are packages of ROS 1; in ROS 2 they keep their fields, with that system's header.

use super::definition::{Definition, Described, messages};
use nalgebra::Point3;
use serde::{Deserialize, Serialize};

messages! {
    /// A moment since 1970, or since a simulation's start.
    #[derive(Copy, Eq)]
    builtin_interfaces/Time {
        /// Whole seconds.
        int32 sec,
        /// The rest, in nanoseconds.
        uint32 nanosec,
    }

    /// A span of time; both parts count.
    #[derive(Copy, Eq)]
    builtin_interfaces/Duration {
        /// Whole seconds.
        int32 sec,
        /// The rest, in nanoseconds.
        uint32 nanosec,
    }

    /// When and in which frame: the beginning of most messages.
    std_msgs/Header {
        /// When it was measured, by the sender's clock.
        builtin_interfaces/Time stamp,
        /// The frame of what follows.
        string frame_id,
    }

    /// Joints by name.
    sensor_msgs/JointState {
        /// When the joints stood so.
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
        /// rad/s or m/s, in the order of the names.
        float64[] velocities,
        /// Empty in a velocity command.
        float64[] accelerations,
        /// Empty in a velocity command.
        float64[] effort,
        /// In a velocity command: how long it is valid from its stamp on.
        builtin_interfaces/Duration time_from_start,
    }

    /// A trajectory; one point with velocities is a velocity command.
    trajectory_msgs/JointTrajectory {
        /// When it was given.
        std_msgs/Header header,
        /// Names.
        string[] joint_names,
        /// Points.
        trajectory_msgs/JointTrajectoryPoint[] points,
    }

    /// A dimension of a list of numbers.
    std_msgs/MultiArrayDimension {
        /// Its name.
        string label,
        /// Its size.
        uint32 size,
        /// Entries from one to the next.
        uint32 stride,
    }

    /// The layout of a list of numbers.
    std_msgs/MultiArrayLayout {
        /// Its dimensions; may be empty.
        std_msgs/MultiArrayDimension[] dim,
        /// Entries before the first.
        uint32 data_offset,
    }

    /// A velocity command of `ros_control`, without stamp or names.
    std_msgs/Float64MultiArray {
        /// How the numbers are laid out; a list without dimensions.
        std_msgs/MultiArrayLayout layout,
        /// Velocities in the controller's own order of joints.
        float64[] data,
    }

    /// One finger, in counts.
    biotac_sensors/BioTacData {
        /// Serial number.
        string bt_serial,
        /// Which finger of the hand.
        uint16 bt_position,
        /// TDC, temperature.
        uint16 tdc_data,
        /// TAC, change of temperature.
        uint16 tac_data,
        /// PDC, static pressure.
        uint16 pdc_data,
        /// PAC, vibration, oldest first.
        uint16[22] pac_data,
        /// E1 to E19.
        uint16[19] electrode_data,
    }

    /// When the frame was taken, and its channels after that.
    biotac_sensors/BioTacTime {
        /// First channel.
        builtin_interfaces/Time frame_start_time,
        /// Last channel.
        builtin_interfaces/Time frame_end_time,
        /// Offset of TDC; the driver's own arithmetic of offsets is wrong, and they are not used.
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
        /// Which hand.
        string hand_id,
        /// One entry per finger.
        biotac_sensors/BioTacData[] bt_data,
        /// When.
        biotac_sensors/BioTacTime bt_time,
    }

    /// One finger of a Shadow hand. Its channels come one after another over EtherCAT, so that
    /// those of one message are of different ages.
    sr_robot_msgs/Biotac {
        /// Vibration, the newest two.
        int16 pac0,
        /// Vibration.
        int16 pac1,
        /// Vibration, as many as came.
        int16[] pac,
        /// Static pressure.
        int16 pdc,
        /// Change of temperature.
        int16 tac,
        /// Temperature.
        int16 tdc,
        /// Electrodes, 19 or 24 by model.
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
        /// Its name.
        string key,
        /// As text.
        string value,
    }

    /// The state of a device.
    diagnostic_msgs/DiagnosticStatus {
        "byte OK=0\nbyte WARN=1\nbyte ERROR=2\nbyte STALE=3\n"
        /// 0 ok, 1 warn, 2 error, 3 stale.
        byte level,
        /// Name of the device.
        string name,
        /// In words.
        string message,
        /// Number of the device.
        string hardware_id,
        /// In detail.
        diagnostic_msgs/KeyValue[] values,
    }

    /// The state of an arm.
    diagnostic_msgs/DiagnosticArray {
        /// When.
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
        /// N.
        geometry_msgs/Vector3 force,
        /// N·m.
        geometry_msgs/Vector3 torque,
    }

    /// The reading of a force/torque sensor, in its own frame, its bias not taken off.
    geometry_msgs/WrenchStamped {
        /// When it was measured, in which frame.
        std_msgs/Header header,
        /// Force and torque.
        geometry_msgs/Wrench wrench,
    }

    /// A place, m.
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

    /// A place and a rotation.
    #[derive(Copy)]
    geometry_msgs/Pose {
        /// Where.
        geometry_msgs/Point position,
        /// How it is turned.
        geometry_msgs/Quaternion orientation,
    }

    /// A colour, each part 0 to 1.
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

    /// A texture; a marker without one has an empty one.
    sensor_msgs/CompressedImage {
        /// When.
        std_msgs/Header header,
        /// Empty.
        string format,
        /// Empty.
        uint8[] data,
    }

    /// A place in a texture.
    #[derive(Copy)]
    visualization_msgs/UVCoordinate {
        /// Across.
        float32 u,
        /// Down.
        float32 v,
    }

    /// A mesh; a marker of points has an empty one.
    visualization_msgs/MeshFile {
        /// Empty.
        string filename,
        /// Empty.
        uint8[] data,
    }

    /// A shape that viewers draw, as of ROS 2 Humble.
    visualization_msgs/Marker {
        /// When, and in which frame.
        std_msgs/Header header,
        /// Its name; with `id`, one that is sent again takes the place of the last.
        string ns,
        /// Tells it from others of its `ns`.
        int32 id,
        /// The number of a [`Shape`].
        int32 r#type,
        /// 0: it is shown.
        int32 action,
        /// Of the points' frame in that of the header.
        geometry_msgs/Pose pose,
        /// Size of what stands at each point, m.
        geometry_msgs/Vector3 scale,
        /// Of all points, unless they have their own.
        std_msgs/ColorRGBA color,
        /// Zero: for ever.
        builtin_interfaces/Duration lifetime,
        /// Whether it moves with its frame.
        bool frame_locked,
        /// Its points.
        geometry_msgs/Point[] points,
        /// One for each point, or none.
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
        /// Whether a mesh brings its own colours.
        bool mesh_use_embedded_materials,
    }

    /// The request of a service without arguments. ROS 2 has no empty message: one byte stands in
    /// it.
    std_srvs/TriggerRequest {
        /// Unused.
        uint8 structure_needs_at_least_one_member,
    }

    /// The answer of a service without arguments.
    #[derive(Eq)]
    std_srvs/TriggerResponse {
        /// Whether it was done.
        bool success,
        /// What was, or why not.
        string message,
    }
}

const NANO: f64 = 1e9;

/// Conversions from and to seconds.
macro_rules! seconds {
    ($($name:ident),*) => {$(
        impl $name {
            /// Of seconds, rounded to nanoseconds.
            pub fn from_s(time_s: f64) -> Self {
                let whole_s = time_s.floor();
                let nanosec = ((time_s - whole_s) * NANO).round();
                match nanosec < NANO {
                    true => Self { sec: whole_s as i32, nanosec: nanosec as u32 },
                    false => Self { sec: whole_s as i32 + 1, nanosec: 0 },
                }
            }

            /// In seconds.
            pub fn s(self) -> f64 {
                f64::from(self.sec) + f64::from(self.nanosec) / NANO
            }
        }
    )*};
}

seconds!(Time, Duration);

impl Header {
    /// Of a moment, in seconds, in a frame.
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

/// What a marker's points are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// Joined by a line.
    LineStrip = 4,
    /// The centre of a ball each.
    SphereList = 7,
    /// Three each are the corners of a triangle.
    TriangleList = 11,
}

impl Marker {
    /// Named `ns`, of no points yet, to be drawn as `shape` of size `scale_m` in the frame `W`.
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
