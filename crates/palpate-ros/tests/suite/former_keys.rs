//! Tests of keys in files of version 0.1 that are no longer settings of an arm behind topics, and of
//! keys of the other version of ROS.

use palpate_explore::backend::arm::Connector;
use palpate_input::config::{ConfigError, Loader, Rules, Validate};
use palpate_ros::settings::{RosSettings, ros1, ros2};
use schemars::JsonSchema;
use serde::Deserialize;
use std::path::Path;

#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
struct File {
    #[serde(deserialize_with = "ros2")]
    ros2: Option<RosSettings>,
    #[serde(deserialize_with = "ros1")]
    ros1: Option<RosSettings>,
}

impl Validate for File {
    fn check(&self, rules: &mut Rules) {
        self.ros2.iter().for_each(|table| rules.table("ros2", table));
        self.ros1.iter().for_each(|table| rules.table("ros1", table));
    }
}

fn read(text: &str) -> Result<File, ConfigError> {
    let mut loader = Loader::from_text(Path::new("old.toml"), text.into())?;
    RosSettings::prepare(&mut loader, "ros2")?;
    loader.finish()
}

/// Table as written by version 0.1, with every default; some keys had no effect on a run.
const OLD: &str = r#"
[ros2]
clock_ahead_s = 0.005
patience_s = 7.0
[ros2.topics.joints]
type = "sensor_msgs/msg/JointState"
rate_hz = 125.0
[ros2.topics.wrench]
type = "geometry_msgs/msg/WrenchStamped"
rate_hz = 500.0
[ros2.topics.status]
type = "diagnostic_msgs/msg/DiagnosticArray"
rate_hz = 50.0
[ros2.topics.tactile]
type = "sr_robot_msgs/msg/BiotacAll"
rate_hz = 100.0
[ros2.topics.command]
type = "std_msgs/msg/Float64MultiArray"
rate_hz = 250.0
"#;

#[test]
fn a_file_of_version_0_1_is_read() {
    let settings = read(OLD).unwrap().ros2.unwrap();
    assert_eq!(settings.version.map(|version| version.name()), Some("ros2"));
    assert_eq!(settings.connect_timeout_s, 7.0);
}

/// A limit of an arm does not change without notice.
#[test]
fn another_value_than_the_constant_is_an_error_with_its_line() {
    for (now, other) in [
        ("clock_ahead_s = 0.005", "clock_ahead_s = 0.05"),
        ("sensor_msgs/msg/JointState", "sensor_msgs/msg/JointStates"),
    ] {
        assert!(OLD.contains(now));
        let error = read(&OLD.replace(now, other)).unwrap_err().to_string();
        assert!(error.starts_with("old.toml:") && error.contains("remove the key"), "{error}");
    }
}

#[test]
fn a_key_of_the_other_version_of_ros_is_an_error_with_its_table() {
    let master = "[ros2]\nmaster = \"http://10.0.0.1:11311\"";
    for (text, key, table) in [
        (master, "`ros2.master`", "[backend.ros1]"),
        ("[ros1]\ndomain = 3", "`ros1.domain`", "[backend.ros2]"),
        ("[ros1]\nprofile = \"ur\"", "`ros1.profile`", "[backend.ros2]"),
    ] {
        let error = read(text).unwrap_err().to_string();
        assert!(error.contains(key) && error.contains(table), "{error}");
    }
    assert!(read("[ros1]\nmaster = \"http://10.0.0.1:11311\"").is_ok());
}
