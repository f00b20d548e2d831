//! Settings that a real robot needs and that a simulation takes from the mesh.

use crate::experiment::experiment::Experiment;
use palpate_explore::robot::sensor::SensorKind;
use palpate_input::error::InputError;
use palpate_ros::settings::BackendKind;
use palpate_ros::topics::{TactileMessage, Topic};

/// Checks that `experiment` has the settings that a real robot needs; a simulation needs none. With
/// `is_known` the touched body is known, so the depths are not needed.
///
/// # Errors
/// The missing settings, with an example of each.
pub fn check(experiment: &Experiment, is_known: bool) -> Result<(), InputError> {
    let (kind, interlocks) = (experiment.backend.kind, &experiment.backend.interlocks);
    let scene = &experiment.scene;
    check_samples(experiment)?;
    let mut needed = match &scene.whole_object {
        _ if is_known => Vec::new(),
        Some(around) => vec![
            ("scene.whole_object.centre_m", "[0.0, -0.65, 0.5]", around.centre_m.is_some()),
            ("scene.whole_object.radius_m", "0.1", around.radius_m.is_some()),
        ],
        None => vec![(
            "scene.zone.depth_m",
            "[0.55, 0.72]    # nearest, farthest along -y",
            scene.zone.as_ref().is_some_and(|zone| zone.depth_m.is_some()),
        )],
    };
    needed.push((
        "backend.interlocks.lowest_m",
        "0.02    # height of the table",
        interlocks.lowest_m.is_some(),
    ));
    needed.push((
        "backend.interlocks.workspace_m",
        "[[-0.6, 0.6], [-1.0, 0.3], [0.05, 1.5]]    # x, y, z of the cell",
        interlocks.workspace_m.is_some(),
    ));
    let has_view = scene.camera.as_ref().is_none_or(|camera| {
        let asked = if experiment.further_views > 0 { camera.further.len() + 1 } else { 0 };
        let views = asked.max(experiment.views as usize);
        (0..views).all(|number| camera.at(number).file.is_some())
    });
    needed.push(("scene.camera.file", "\"view.ply\"    # of the real camera", has_view));
    needed.retain(|(_, _, is_given)| !is_given);
    if kind == BackendKind::Simulated || needed.is_empty() {
        return Ok(());
    }
    let names: Vec<&str> = needed.iter().map(|(key, ..)| *key).collect();
    let line = |(key, example, _): &(&str, &str, bool)| format!("    {key} = {example}");
    let lines: Vec<String> = needed.iter().map(line).collect();
    Err(InputError::new(format!(
        "backend.kind = \"{}\" moves a real robot, which needs {}: only a simulation takes depths from \
         the mesh. Give the values of your cell by --set, or in the files of the scene and the \
         experiment (experiments/real_arm.toml), in metres in the frame of the robot's base, as \
         in\n{}",
        kind.name(),
        names.join(", "),
        lines.join("\n")
    )))
}

/// Checks that the tactile topic of a robot on ROS has the samples of the scene's sensor.
fn check_samples(experiment: &Experiment) -> Result<(), InputError> {
    let topics = &experiment.backend.topics;
    if !matches!(experiment.backend.kind, BackendKind::Ros1 | BackendKind::Ros2) {
        return Ok(());
    }
    let (sensor, message) = (experiment.scene.sensor.kind, topics.tactile.message);
    let allowed = match sensor {
        SensorKind::DepthPatch => "\"sensor_msgs/msg/Image\"",
        SensorKind::Contact => "\"std_msgs/msg/Bool\", or \"none\" for contact by force",
        SensorKind::ForceTorqueTip => "\"none\", or the type of a sensor that detects contact",
        SensorKind::Automatic => "a BioTac's, or \"none\" for the force/torque sensor alone",
    };
    let fits = match sensor {
        SensorKind::DepthPatch => message == TactileMessage::Depth,
        SensorKind::Contact => matches!(message, TactileMessage::Flag | TactileMessage::None),
        SensorKind::ForceTorqueTip => true,
        SensorKind::Automatic => message.is_of_biotac() || message == TactileMessage::None,
    };
    let name = topics.type_name(Topic::Tactile);
    let place = "backend.topics.tactile.type";
    let problem = || {
        format!(
            "{place} = \"{name}\"; with sensor.kind = \"{}\" allowed is {allowed}",
            sensor.name()
        )
    };
    if fits { Ok(()) } else { Err(InputError::new(problem())) }
}
