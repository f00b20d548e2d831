//! `resolved.toml`: the experiment of a run with all defaults.

use super::io::{RunError, check_equal, write_changed};
use crate::experiment::Experiment;
use palpate_input::error::InputError;
use palpate_input::paths::relative;
use palpate_input::{files, shipped, tables};
use std::path::Path;
use toml_edit::DocumentMut;

/// File of a run's settings with all defaults.
pub const RESOLVED: &str = "resolved.toml";

/// Returns the experiment with all defaults as TOML.
pub fn resolved(experiment: &Experiment) -> String {
    let mut text = tables::text(experiment).unwrap_or_default();
    // Around an object, `[gp]` is the table of that belief.
    if experiment.scene.whole_object.is_some()
        && let (Ok(mut whole), Ok(Ok(belief))) = (
            text.parse::<DocumentMut>(),
            tables::text(&experiment.space).map(|text| text.parse::<DocumentMut>()),
        )
    {
        whole.remove("space");
        whole.insert("gp", belief.as_item().clone());
        text = whole.to_string();
    }
    format!("{TITLE}\n{text}")
}

/// First line of every `resolved.toml`.
const TITLE: &str =
    "# Every setting of this run, defaults written out. It can be run again as it is.";

/// Whether a folder has a `resolved.toml` of this program.
pub(super) fn is_ours(folder: &Path) -> bool {
    let text = files::text(&folder.join(RESOLVED), files::TEXT_MAX);
    text.is_ok_and(|text| text.starts_with(TITLE))
}

/// Reads the experiment of a run's folder, after `--set` assignments.
pub(super) fn read(folder: &Path, sets: &[String]) -> Result<Experiment, RunError> {
    Ok(Experiment::load(&folder.join(RESOLVED), sets)?)
}

/// Writes the experiment to a run's folder, unless the file is unchanged.
pub(super) fn write(folder: &Path, experiment: &Experiment) -> Result<(), RunError> {
    write_changed(&folder.join(RESOLVED), &relative_resolved(experiment, folder))
}

/// Checks that the run in `folder` has the same identity as `experiment`. Paths do not count:
/// the contents of their files are compared by their hashes.
pub(super) fn check_identity(folder: &Path, experiment: &Experiment) -> Result<(), RunError> {
    let found = read(folder, &[])?;
    let identity = |it: &Experiment| resolved(&it.row_settings().without_paths());
    check_equal(folder, RESOLVED, [&identity(&found), &identity(experiment)])
}

/// Checks that a `--set` assignment changes only the report.
pub(super) fn check_report_setting(set: &str) -> Result<(), RunError> {
    let key = set.split_once('=').map(|(key, _)| key.trim());
    match key.is_none_or(|key| key == "question" || key.starts_with("report.")) {
        true => Ok(()),
        false => Err(InputError::new(format!(
            "--set {set}: palpate report changes only `report.…` and `question`; use palpate run for \
             other settings"
        ))
        .into()),
    }
}

/// Returns [`resolved`] text with all paths relative to the folder of the file `path`.
pub fn resolved_beside(experiment: &Experiment, path: &Path) -> String {
    relative_resolved(experiment, path.parent().unwrap_or(Path::new("")))
}

/// Returns [`resolved`] text with all paths relative to the run's folder, so that both can be moved
/// together; the path of a shipped file is the same on every machine.
fn relative_resolved(experiment: &Experiment, folder: &Path) -> String {
    let Ok(folder) = folder.canonicalize() else { return resolved(experiment) };
    let moved = |path: &str| {
        let path = Path::new(path);
        let path = path.canonicalize().unwrap_or_else(|_| path.into());
        shipped::portable(&path).unwrap_or_else(|| relative(&path, &folder))
    };
    let moved = experiment.with_paths(&mut |path| moved(path).to_string_lossy().into_owned());
    moved.as_ref().map_or_else(|| resolved(experiment), resolved)
}
