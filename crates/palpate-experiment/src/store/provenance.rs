//! `content.json`: hashes of inputs that decide a run's rows and are not in its `resolved.toml`.
//! `manifest.json`: the programs that wrote the run.

use super::io::{RunError, io_error, write_changed, write_whole};
use crate::simulation::Simulation;
use palpate_input::files;
use palpate_input::format::hex;
use palpate_sim::environment::ObjectShape;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

/// File with the hashes of a run's input files and external planners.
pub(super) const CONTENT: &str = "content.json";

/// File that lists the programs that wrote a run.
pub const MANIFEST: &str = "manifest.json";

/// Maximum size of a file that is hashed.
const FILE_MAX: u64 = 1 << 30;

/// Prefix of the keys of planners; the name follows.
const PLANNER: &str = "planner ";

/// SHA-256 of a run's input files and external planners, by the key of each path in the settings,
/// such as `scene.object.mesh`, and by `planner MODULE:NAME`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct InputHashes {
    hashes: BTreeMap<String, String>,
    /// Files of the keys that have one, named as in the experiment.
    files: BTreeMap<String, String>,
}

impl InputHashes {
    /// Hashes the inputs of `simulation`.
    ///
    /// # Errors
    /// If a file cannot be read.
    pub(super) fn of(simulation: &Simulation) -> Result<Self, RunError> {
        let mut content = Self::default();
        let experiment = simulation.experiment();
        let contents = parsed_contents(simulation)?;
        for (key, path) in experiment.paths() {
            let hash = match contents.iter().find(|(read, _)| *read == path) {
                Some((_, content)) => content.clone(),
                None => sha256(&files::bytes(&path, FILE_MAX).map_err(io_error(&path))?),
            };
            content.add(&key, hash, Some(&path));
        }
        for name in &experiment.planners {
            if let Some(source) = simulation.planner(name).and_then(|planner| planner.source()) {
                content.add(&format!("{PLANNER}{name}"), sha256(source.as_bytes()), None);
            }
        }
        Ok(content)
    }

    /// SHA-256 by key.
    pub(super) fn into_hashes(self) -> BTreeMap<String, String> {
        self.hashes
    }

    fn add(&mut self, key: &str, hash: String, file: Option<&Path>) {
        self.hashes.insert(key.into(), hash);
        if let Some(file) = file {
            self.files.insert(key.into(), file.display().to_string());
        }
    }

    /// Reads the hashes of the run in `folder`; empty if it has none.
    pub(super) fn read(folder: &Path) -> Result<Self, RunError> {
        let path = folder.join(CONTENT);
        let text = match files::text(&path, files::TEXT_MAX) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Self::default()),
            text => text.map_err(io_error(&path))?,
        };
        let hashes = serde_json::from_str(&text)
            .map_err(|error| RunError::bad_row(&path, error.line(), error))?;
        Ok(Self { hashes, files: BTreeMap::new() })
    }

    /// Writes the hashes to the run in `folder`.
    pub(super) fn write(&self, folder: &Path) -> Result<(), RunError> {
        let path = folder.join(CONTENT);
        let text = serde_json::to_string_pretty(&self.hashes).map_err(io_error(&path))?;
        write_changed(&path, &(text + "\n"))
    }

    /// Adds the entries of `other` that `self` lacks.
    pub(super) fn extend(&mut self, other: Self) {
        for (key, hash) in other.hashes {
            self.hashes.entry(key).or_insert(hash);
        }
    }

    /// Checks that common entries are equal; planners without a row, by `has_row`, may differ.
    pub(super) fn check_equal(
        &self,
        before: &Self,
        folder: &Path,
        has_row: impl Fn(&str) -> bool,
    ) -> Result<(), RunError> {
        let counts = |key: &str| key.strip_prefix(PLANNER).is_none_or(&has_row);
        let differs = |(key, hash): &(&String, &String)| {
            counts(key) && before.hashes.get(*key).is_some_and(|before| before != *hash)
        };
        let Some((key, _)) = self.hashes.iter().find(differs) else { return Ok(()) };
        let file = self.files.get(key).map_or(String::new(), |file| format!(" = \"{file}\""));
        let problem = format!(
            "{key}{file} has changed since the run began; its trials used the earlier version; use --out \
             for another folder, or --fresh to start again"
        );
        Err(RunError::at(folder, problem))
    }
}

/// Returns the paths of inputs that refer to other files or contain them, each with the SHA-256 of
/// what was read.
fn parsed_contents(simulation: &Simulation) -> Result<Vec<(PathBuf, String)>, RunError> {
    let (scene, environment) = (&simulation.experiment().scene, simulation.environment());
    let mut contents = Vec::new();
    if let (ObjectShape::Mesh { report, .. }, Some(object)) = (environment.shape(), &scene.object) {
        contents.push((object.mesh.to_path_buf(), report.sha256.clone()));
    }
    if let (Some(library), Some(settings)) = (simulation.loaded_library(), &scene.library) {
        contents.push((settings.folder.to_path_buf(), library.sha256().to_owned()));
    }
    if let Some(arm) = scene.arm.as_ref().filter(|arm| arm.is_file()) {
        let path = PathBuf::from(&arm.model);
        let mut bytes = files::bytes(&path, files::TEXT_MAX).map_err(io_error(&path))?;
        // Both have the capsules that were fitted to the meshes of its file.
        let capsules = || format!("{:?}", environment.robot().map(|robot| robot.capsules()));
        let model = environment.arm_mjcf().map_or_else(capsules, str::to_owned);
        bytes.extend(model.as_bytes());
        contents.push((path, sha256(&bytes)));
    }
    Ok(contents)
}

fn sha256(bytes: &[u8]) -> String {
    hex(Sha256::digest(bytes))
}

/// Returns a description of this program, built from `commit`, and of this machine, for an
/// experiment with `seed`: versions, platform, and the processor's vector extensions, which affect
/// the last bits of a factorisation.
pub(super) fn manifest(commit: &str, seed: u64) -> Value {
    #[cfg(target_arch = "x86_64")]
    let vectors = [
        ("avx2", is_x86_feature_detected!("avx2")),
        ("fma", is_x86_feature_detected!("fma")),
        ("avx512f", is_x86_feature_detected!("avx512f")),
    ];
    #[cfg(not(target_arch = "x86_64"))]
    let vectors: [(&str, bool); 0] = [];
    let vectors: Vec<&str> =
        vectors.iter().filter(|(_, is_there)| *is_there).map(|(name, _)| *name).collect();
    #[cfg(feature = "mujoco")]
    let mujoco = Some(palpate_sim::mujoco::version());
    #[cfg(not(feature = "mujoco"))]
    let mujoco: Option<&str> = None;
    json!({
        "version": env!("CARGO_PKG_VERSION"),
        "commit": commit,
        "mujoco": mujoco,
        "platform": format!("{}-{}", std::env::consts::ARCH, std::env::consts::OS),
        "cpu_features": vectors,
        "seed": seed,
    })
}

/// Appends `manifest` to the list of programs that wrote a run, unless the last entry is equal.
pub(super) fn add_manifest(folder: &Path, manifest: Value) -> Result<(), RunError> {
    let path = folder.join(MANIFEST);
    let to_value = |text: String| serde_json::from_str::<Vec<Value>>(&text).ok();
    let mut signed =
        files::text(&path, files::TEXT_MAX).ok().and_then(to_value).unwrap_or_default();
    if signed.last() != Some(&manifest) {
        signed.push(manifest);
        let text = serde_json::to_string_pretty(&signed).map_err(io_error(&path))?;
        write_whole(&path, &text)?;
    }
    Ok(())
}
