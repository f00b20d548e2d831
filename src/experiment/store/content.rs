//! `content.json`: hashes of what decides the rows of a run and is not in its `resolved.toml`.

use super::error::{StoreError, io_error};
use super::file::write_changed;
use crate::experiment::simulation::Simulation;
use crate::experiment::trial::entrant::Entrant;
use crate::files;
use crate::sim::environment::Shape;
use crate::words::hex;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::io;
use std::path::Path;

/// File with the hashes of a run's files and of planners written outside of Palpate.
pub const CONTENT: &str = "content.json";

/// Largest scan that is hashed.
const SCAN_MAX: u64 = 1 << 30;

/// Keys of planners begin with this; their name follows.
const PLANNER: &str = "planner ";

/// SHA-256 of the files that a run reads and of the planners written outside of Palpate, by what
/// they are: `scene.object.mesh`, `scene.arm.model`, `truth.scan`, `planner MODULE:NAME`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Content {
    hashes: BTreeMap<String, String>,
    /// Files of the keys that have one, as the experiment names them.
    files: BTreeMap<String, String>,
}

impl Content {
    /// Hashes what `simulation` is made of.
    ///
    /// # Errors
    /// If a file cannot be read.
    pub fn of(simulation: &Simulation) -> Result<Self, StoreError> {
        let mut content = Self::default();
        let experiment = simulation.experiment();
        if let (Shape::Mesh { report, .. }, Some(object)) =
            (simulation.environment().shape(), &experiment.scene.object)
        {
            content.add("scene.object.mesh", report.sha256.clone(), Some(&object.mesh));
        }
        if let Some(truth) = &experiment.truth {
            let bytes = files::bytes(&truth.scan, SCAN_MAX).map_err(io_error(&truth.scan))?;
            content.add("truth.scan", sha256(&bytes), Some(&truth.scan));
        }
        if let Some(arm) = experiment.scene.arm.as_ref().filter(|arm| arm.is_file()) {
            let path = Path::new(&arm.model);
            let mut bytes = files::bytes(path, files::TEXT_MAX).map_err(io_error(path))?;
            bytes.extend(simulation.environment().arm_mjcf().unwrap_or_default().as_bytes());
            content.add("scene.arm.model", sha256(&bytes), Some(path));
        }
        for name in &experiment.planners {
            let source = match simulation.planner(name) {
                Some(Entrant::Planner(factory)) => factory.source(),
                _ => None,
            };
            if let Some(source) = source {
                content.add(&format!("{PLANNER}{name}"), sha256(source.as_bytes()), None);
            }
        }
        Ok(content)
    }

    fn add(&mut self, key: &str, hash: String, file: Option<&Path>) {
        self.hashes.insert(key.into(), hash);
        if let Some(file) = file {
            self.files.insert(key.into(), file.display().to_string());
        }
    }

    /// Reads that of the run in `folder`; empty if it has none.
    pub(super) fn read(folder: &Path) -> Result<Self, StoreError> {
        let path = folder.join(CONTENT);
        let text = match files::text(&path, files::TEXT_MAX) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Self::default()),
            text => text.map_err(io_error(&path))?,
        };
        let hashes = serde_json::from_str(&text).map_err(|error| StoreError::BadRow {
            path,
            line: error.line(),
            message: error.to_string(),
        })?;
        Ok(Self { hashes, files: BTreeMap::new() })
    }

    /// Writes it into the run in `folder`.
    pub(super) fn write(&self, folder: &Path) -> Result<(), StoreError> {
        let path = folder.join(CONTENT);
        let text = serde_json::to_string_pretty(&self.hashes).map_err(io::Error::from);
        write_changed(&path, &(text.map_err(io_error(&path))? + "\n"))
    }

    /// Adds what `other` has and this has not.
    pub(super) fn extend(&mut self, other: Self) {
        for (key, hash) in other.hashes {
            self.hashes.entry(key).or_insert(hash);
        }
    }

    /// Checks that what both have is the same; planners without a row, by `has_row`, may differ.
    pub(super) fn require_same(
        &self,
        before: &Self,
        folder: &Path,
        has_row: impl Fn(&str) -> bool,
    ) -> Result<(), StoreError> {
        let counts = |key: &str| key.strip_prefix(PLANNER).is_none_or(&has_row);
        let differs = |(key, hash): &(&String, &String)| {
            counts(key) && before.hashes.get(*key).is_some_and(|before| before != *hash)
        };
        match self.hashes.iter().find(differs) {
            None => Ok(()),
            Some((key, _)) => Err(StoreError::Changed {
                path: folder.into(),
                what: match self.files.get(key) {
                    Some(file) => format!("{key} = \"{file}\""),
                    None => key.clone(),
                },
            }),
        }
    }
}

fn sha256(bytes: &[u8]) -> String {
    hex(Sha256::digest(bytes))
}
