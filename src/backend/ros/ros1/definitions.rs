//! Definitions of the messages in ROS 1, whole, as who records a topic keeps them.

/// Definitions one after another; each but the first begins with its name.
macro_rules! whole {
    ($first:expr $(, $name:literal: $part:expr)*) => {
        concat!($first $(, "\n", rule!(), "\nMSG: ", $name, "\n", $part)*)
    };
}

macro_rules! rule {
    () => {
        "================================================================================"
    };
}

macro_rules! header {
    () => {
        "uint32 seq\ntime stamp\nstring frame_id\n"
    };
}

/// `sensor_msgs/JointState`.
pub const JOINT_STATE: &str = whole!(
    "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n",
    "std_msgs/Header": header!()
);

/// `geometry_msgs/WrenchStamped`.
pub const WRENCH_STAMPED: &str = whole!(
    "std_msgs/Header header\ngeometry_msgs/Wrench wrench\n",
    "std_msgs/Header": header!(),
    "geometry_msgs/Wrench": "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n",
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z\n"
);

/// `biotac_sensors/BioTacHand`.
pub const BIOTAC_HAND: &str = whole!(
    "std_msgs/Header header\nstring hand_id\nbiotac_sensors/BioTacData[] bt_data\n\
     biotac_sensors/BioTacTime bt_time\n",
    "std_msgs/Header": header!(),
    "biotac_sensors/BioTacData": "string bt_serial\nuint16 bt_position\nuint16 tdc_data\nuint16 tac_data\n\
     uint16 pdc_data\nuint16[22] pac_data\nuint16[19] electrode_data\n",
    "biotac_sensors/BioTacTime": "time frame_start_time\ntime frame_end_time\nuint32 tdc_ns_offset\n\
     uint32 tac_ns_offset\nuint32 pdc_ns_offset\nuint32[22] pac_ns_offset\nuint32[19] electrode_ns_offset\n"
);

/// `sr_robot_msgs/BiotacAll`.
pub const BIOTAC_ALL: &str = whole!(
    "std_msgs/Header header\nsr_robot_msgs/Biotac[5] tactiles\n",
    "std_msgs/Header": header!(),
    "sr_robot_msgs/Biotac": "int16 pac0\nint16 pac1\nint16[] pac\nint16 pdc\nint16 tac\nint16 tdc\n\
     int16[] electrodes\n"
);

/// `diagnostic_msgs/DiagnosticArray`.
pub const DIAGNOSTIC_ARRAY: &str = whole!(
    "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status\n",
    "std_msgs/Header": header!(),
    "diagnostic_msgs/DiagnosticStatus": "byte OK=0\nbyte WARN=1\nbyte ERROR=2\nbyte STALE=3\nbyte level\n\
     string name\nstring message\nstring hardware_id\ndiagnostic_msgs/KeyValue[] values\n",
    "diagnostic_msgs/KeyValue": "string key\nstring value\n"
);

/// `trajectory_msgs/JointTrajectory`.
pub const JOINT_TRAJECTORY: &str = whole!(
    "std_msgs/Header header\nstring[] joint_names\ntrajectory_msgs/JointTrajectoryPoint[] points\n",
    "std_msgs/Header": header!(),
    "trajectory_msgs/JointTrajectoryPoint": "float64[] positions\nfloat64[] velocities\n\
     float64[] accelerations\nfloat64[] effort\nduration time_from_start\n"
);

/// `std_msgs/Float64MultiArray`.
pub const FLOAT64_MULTI_ARRAY: &str = whole!(
    "std_msgs/MultiArrayLayout layout\nfloat64[] data\n",
    "std_msgs/MultiArrayLayout": "std_msgs/MultiArrayDimension[] dim\nuint32 data_offset\n",
    "std_msgs/MultiArrayDimension": "string label\nuint32 size\nuint32 stride\n"
);
