//! Settings that a real robot needs and that a simulation takes from the mesh.

use crate::experiment::Experiment;
use palpate_input::error::InputError;

/// Checks that `experiment` has the settings that a real robot needs; a simulation needs none. With
/// `is_known` the touched body is known, so the depths are not needed.
///
/// # Errors
/// The missing settings, with an example of each.
pub fn check(experiment: &Experiment, is_known: bool) -> Result<(), InputError> {
    let (scene, interlocks) = (&experiment.scene, &experiment.backend.interlocks);
    let Some((table, arm)) = experiment.backend.arm() else { return Ok(()) };
    arm.check_sensor(&scene.sensor)?;
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
    if needed.is_empty() {
        return Ok(());
    }
    let names: Vec<&str> = needed.iter().map(|(key, ..)| *key).collect();
    let line = |(key, example, _): &(&str, &str, bool)| format!("    {key} = {example}");
    let lines: Vec<String> = needed.iter().map(line).collect();
    Err(InputError::new(format!(
        "[backend.{table}] moves a real robot, which needs {}: only a simulation takes depths from \
         the mesh. Give the values of your cell by --set, or in the files of the scene and the \
         experiment (experiments/real_arm.toml), in metres in the frame of the robot's base, as \
         in\n{}",
        names.join(", "),
        lines.join("\n")
    )))
}
