//! Studies over many touches.
//!
//! * [`accuracy`]: accuracy against cost. Compares coarser, finer or switched variants of a scene
//!   with a reference: error, time, and the cheapest scene within a tolerance.
//! * [`band`]: learning of the 95 % band from objects, with its coverage.
//! * [`benchmark`]: fixed protocol of objects, planners and touches, with its results.
//! * [`check`]: regression test of planners against a stored baseline.
//! * [`compare`](mod@compare): comparison of planners over several runs.
//! * [`export`]: choice of the belief that is exported.
//! * [`identify`]: an object of a library, identified by touch.
//! * [`measure_means`]: means of measures over trials and objects.
//! * [`planners`]: planners that are added to those of an experiment.
//! * [`run`]: runs in folders, and the comparison of a sweep's runs.
//! * [`sensors`]: the same experiment with every kind of fingertip.
//! * [`setup`]: scene and experiment for a mesh.

pub mod accuracy;
pub mod band;
pub mod benchmark;
pub mod check;
pub mod compare;
pub mod export;
pub mod fit;
pub mod identify;
pub mod measure_means;
pub mod objects;
pub mod planners;
pub mod run;
pub mod sensors;
pub mod setup;

use crate::sim::Scene;
use anyhow::ensure;
use palpate_input::files;
use std::path::Path;

/// Whether the file is an experiment: experiments have `planners` or `scene`, scenes do not. An
/// unreadable file counts as a scene.
pub fn is_experiment(path: &Path) -> bool {
    files::text(path, files::TEXT_MAX)
        .ok()
        .and_then(|text| text.parse::<toml::Table>().ok())
        .is_some_and(|table| table.contains_key("planners") || table.contains_key("scene"))
}

/// Rejects a scene of a whole object for a study of a zone.
///
/// # Errors
/// If the scene has no zone.
pub fn needs_zone(scene: &Scene, path: &Path) -> anyhow::Result<()> {
    ensure!(
        scene.whole_object.is_none(),
        "{}: [whole_object] explores a whole object, but this command needs one side of it; allowed is a \
         scene with [zone]",
        path.display()
    );
    Ok(())
}
