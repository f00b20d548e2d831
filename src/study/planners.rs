//! Planners that are added to those of an experiment.

use crate::experiment::Experiment;
use palpate_input::config::ConfigError;

/// Returns the `--set` assignment of an experiment's planners.
pub fn planners_setting<'a>(names: impl Iterator<Item = &'a String>) -> String {
    let names: Vec<String> = names.map(|name| format!("{name:?}")).collect();
    format!("planners=[{}]", names.join(","))
}

/// Loads the experiment with the settings of `--set` and adds the planners of `--planner`.
///
/// # Errors
/// See [`Experiment::load`].
pub fn with_planners(
    sets: &[String],
    planners: &[String],
    load: impl Fn(&[String]) -> Result<Experiment, ConfigError>,
) -> Result<Experiment, ConfigError> {
    let experiment = load(sets)?;
    if planners.is_empty() {
        return Ok(experiment);
    }
    let listed = |name: &&String| experiment.planners.contains(name);
    let too = planners.iter().filter(|name| !listed(name));
    let planners = planners_setting(experiment.planners.iter().chain(too));
    load(&[sets, &[planners]].concat())
}
