//! Check of the views that an experiment reads from files.

use crate::experiment::Experiment;
use palpate_gp::math::seed;
use palpate_input::error::InputError;
use palpate_sim::Environment;
use palpate_sim::camera_probe::seen;

/// Checks the views that an experiment reads from files.
///
/// # Errors
/// If a file cannot be read, or shows nothing of the region.
pub(crate) fn check(experiment: &Experiment, environment: &Environment) -> Result<(), InputError> {
    let scene = environment.scene();
    let Some(camera) = &scene.camera else { return Ok(()) };
    let places = match experiment.further_views {
        0 => experiment.views,
        _ => u32::MAX,
    };
    let places = places.min(1 + camera.further.len() as u32);
    for number in (0..places).filter(|number| camera.at(*number as usize).file.is_some()) {
        let mut random = seed::stream(experiment.seed, 0, "check of a view");
        seen(environment, number, &mut random)?;
    }
    Ok(())
}
