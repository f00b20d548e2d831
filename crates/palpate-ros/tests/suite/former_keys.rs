//! Tests of keys of `[backend]` in files of version 0.1 that are no longer settings.

use palpate_input::config::{ConfigError, Loader, Rules, Validate};
use palpate_ros::settings::{BackendKind, BackendSettings, take_former_keys};
use schemars::JsonSchema;
use serde::Deserialize;
use std::path::Path;

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct File {
    backend: BackendSettings,
}

impl Validate for File {
    fn check(&self, rules: &mut Rules) {
        rules.table("backend", &self.backend);
    }
}

fn read(text: &str) -> Result<File, ConfigError> {
    let mut loader = Loader::from_text(Path::new("old.toml"), text.into())?;
    take_former_keys(&mut loader)?;
    loader.finish()
}

/// File as written by version 0.1, with every default; some keys had no effect on a run.
const OLD: &str = r#"
[backend]
kind = "ros2"
clock_ahead_s = 0.005
[backend.gates]
hold_s = 2
still = 0.002
near = 0.5
drift_n = 0.25
[backend.interlocks]
force_rate_n_s = 2000.0
tracking_error_s = 0.2
retract_m_s = 0.02
retract_rise_n = 2.0
[backend.topics.joints]
type = "sensor_msgs/msg/JointState"
rate_hz = 125.0
[backend.topics.wrench]
type = "geometry_msgs/msg/WrenchStamped"
rate_hz = 500.0
[backend.topics.status]
type = "diagnostic_msgs/msg/DiagnosticArray"
rate_hz = 50.0
[backend.topics.tactile]
type = "sr_robot_msgs/msg/BiotacAll"
rate_hz = 100.0
[backend.topics.command]
type = "std_msgs/msg/Float64MultiArray"
rate_hz = 250.0
"#;

#[test]
fn a_file_of_version_0_1_is_read() {
    let backend = read(OLD).unwrap().backend;
    assert_eq!(backend.kind, BackendKind::Ros2);
    assert_eq!(backend.start_checks.drift_n, 0.25);
}

/// A limit of an arm does not change without notice.
#[test]
fn another_value_than_the_constant_is_an_error_with_its_line() {
    for (now, other) in [
        ("clock_ahead_s = 0.005", "clock_ahead_s = 0.05"),
        ("hold_s = 2", "hold_s = 3"),
        ("retract_m_s = 0.02", "retract_m_s = 0.01"),
        ("sensor_msgs/msg/JointState", "sensor_msgs/msg/JointStates"),
    ] {
        assert!(OLD.contains(now));
        let error = read(&OLD.replace(now, other)).unwrap_err().to_string();
        assert!(error.starts_with("old.toml:") && error.contains("remove the key"), "{error}");
    }
}
