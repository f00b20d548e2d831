//! `manifest.json`: the programs that wrote a run.

use super::error::{StoreError, io_error};
use super::file::write_whole;
use crate::experiment::Experiment;
use crate::files;
use serde::Serialize;
use std::io;
use std::path::Path;

/// File that says what ran a run.
pub const MANIFEST: &str = "manifest.json";

/// What ran an experiment.
#[derive(Clone, Debug, Serialize)]
pub struct Manifest {
    /// Of this program.
    pub version: &'static str,
    /// Of this program's sources, if they were built from a repository.
    pub commit: &'static str,
    /// Of the physics engine this program is linked with, if any.
    pub mujoco: Option<String>,
    /// Processor architecture and operating system.
    pub platform: String,
    /// Vector extensions of this processor; the last bits of a factorisation depend on them.
    pub cpu_features: Vec<&'static str>,
    /// Root of all randomness.
    pub seed: u64,
}

impl Manifest {
    /// Of this program on this machine, which runs `experiment`.
    pub fn of(experiment: &Experiment) -> Self {
        #[cfg(feature = "mujoco")]
        let mujoco = Some(crate::sim::mujoco::version().to_owned());
        #[cfg(not(feature = "mujoco"))]
        let mujoco = None;
        Self {
            version: env!("CARGO_PKG_VERSION"),
            commit: env!("PALPATE_COMMIT"),
            mujoco,
            platform: format!("{}-{}", std::env::consts::ARCH, std::env::consts::OS),
            cpu_features: cpu_features(),
            seed: experiment.seed,
        }
    }
}

#[cfg(target_arch = "x86_64")]
fn cpu_features() -> Vec<&'static str> {
    let features = [
        ("avx2", is_x86_feature_detected!("avx2")),
        ("fma", is_x86_feature_detected!("fma")),
        ("avx512f", is_x86_feature_detected!("avx512f")),
    ];
    features.iter().filter(|(_, present)| *present).map(|(name, _)| *name).collect()
}

#[cfg(not(target_arch = "x86_64"))]
fn cpu_features() -> Vec<&'static str> {
    Vec::new()
}

/// Adds `manifest` to the list of programs that wrote a run, unless the last one was the same.
pub(super) fn sign(path: &Path, manifest: &Manifest) -> Result<(), StoreError> {
    let to_value = |text: String| serde_json::from_str::<Vec<serde_json::Value>>(&text).ok();
    let mut signed = files::text(path, files::TEXT_MAX).ok().and_then(to_value).unwrap_or_default();
    let new = serde_json::to_value(manifest).map_err(io::Error::from).map_err(io_error(path))?;
    if signed.last() != Some(&new) {
        signed.push(new);
        let text = serde_json::to_string_pretty(&signed).map_err(io::Error::from);
        write_whole(path, &text.map_err(io_error(path))?)?;
    }
    Ok(())
}
