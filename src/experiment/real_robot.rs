//! Settings that a real robot needs and that a simulation takes from its mesh.

use crate::backend::ros::settings::BackendKind;
use crate::experiment::experiment::Experiment;
use thiserror::Error;

/// An experiment with a real robot lacks settings that protect it.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error(
    "backend.kind = \"{kind}\" moves a real robot, which needs {}; a simulation would take depths from the mesh, \
     the ground truth. Give what is true of the cell by --set, or in the files of the scene and the experiment \
     (experiments/real_arm.toml), in metres in the frame of the robot's base, as in\n{}",
    names(missing),
    lines(missing)
)]
pub struct MissingForRobot {
    kind: &'static str,
    missing: Vec<Needed>,
}

/// A setting with an example.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Needed {
    key: &'static str,
    example: &'static str,
}

const DEPTH: Needed =
    Needed { key: "scene.zone.depth_m", example: "[0.55, 0.72]    # nearest, farthest along -y" };
const CENTRE: Needed = Needed { key: "scene.around.centre_m", example: "[0.0, -0.65, 0.5]" };
const RADIUS: Needed = Needed { key: "scene.around.radius_m", example: "0.1" };
const LOWEST: Needed =
    Needed { key: "backend.interlocks.lowest_m", example: "0.02    # height of the table" };
const WORKSPACE: Needed = Needed {
    key: "backend.interlocks.workspace_m",
    example: "[[-0.6, 0.6], [-1.0, 0.3], [0.05, 1.5]]    # x, y, z of the cell",
};

fn names(missing: &[Needed]) -> String {
    missing.iter().map(|needed| needed.key).collect::<Vec<_>>().join(", ")
}

fn lines(missing: &[Needed]) -> String {
    let line = |needed: &Needed| format!("    {} = {}", needed.key, needed.example);
    missing.iter().map(line).collect::<Vec<_>>().join("\n")
}

/// Whether `experiment` says what a real robot needs; one that is simulated needs nothing.
///
/// # Errors
/// With the settings that are missing, and an example of each.
pub fn check(experiment: &Experiment) -> Result<(), MissingForRobot> {
    let kind = experiment.backend.kind;
    if kind == BackendKind::Simulated {
        return Ok(());
    }
    let scene = &experiment.scene;
    let region = match &scene.around {
        Some(around) => {
            [(CENTRE, around.centre_m.is_some()), (RADIUS, around.radius_m.is_some())].to_vec()
        }
        None => vec![(DEPTH, scene.zone.as_ref().is_some_and(|zone| zone.depth_m.is_some()))],
    };
    let interlocks = &experiment.backend.interlocks;
    let cell =
        [(LOWEST, interlocks.lowest_m.is_some()), (WORKSPACE, interlocks.workspace_m.is_some())];
    let all = region.into_iter().chain(cell);
    let missing: Vec<Needed> = all.filter(|(_, is_there)| !is_there).map(|(key, _)| key).collect();
    match missing.is_empty() {
        true => Ok(()),
        false => Err(MissingForRobot { kind: kind.name(), missing }),
    }
}

/// Checks the cell alone: an experiment that touches a known body has its depths from it.
///
/// # Errors
/// If the interlocks lack a setting, as [`check`] says it.
pub fn check_cell(experiment: &Experiment) -> Result<(), MissingForRobot> {
    let is_of_cell = |needed: &Needed| [LOWEST, WORKSPACE].contains(needed);
    check(experiment).or_else(|MissingForRobot { kind, missing }| {
        let missing: Vec<Needed> = missing.into_iter().filter(is_of_cell).collect();
        match missing.is_empty() {
            true => Ok(()),
            false => Err(MissingForRobot { kind, missing }),
        }
    })
}
