//! Objects of a protocol that are not shipped: meshes in a folder of the user, known by their
//! hashes, each explored as `palpate new --around` does.

use super::planners::with_planners;
use super::setup::{Asker, FingerKind, MeshOptions, MeshPlacement};
use crate::experiment::Experiment;
use crate::sim::placement::{ObjectSide, UpAxis};
use crate::sim::scene::Unit;
use anyhow::{Context, bail, ensure};
use clap::ValueEnum;
use palpate_input::config::Loader;
use palpate_input::error::InputError;
use palpate_input::files;
use palpate_input::format::hex;
use serde::Deserialize;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// Key of the objects in a protocol.
const OBJECTS: &str = "objects";

/// Largest mesh that is read.
const MESH_MAX: u64 = 1 << 30;

/// Number of objects that a message names.
const NAMED_MAX: usize = 5;

/// Objects of a protocol.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObjectList {
    /// Place from which the user gets the folder.
    source: String,
    /// Unit of the numbers in the meshes.
    unit: Unit,
    /// Up axis of the meshes.
    up: String,
    /// SHA-256 of each mesh, by its path in the folder.
    sha256: BTreeMap<String, String>,
}

impl ObjectList {
    /// Reads the objects of the protocol at `path`; `None` if it explores shipped scenes.
    ///
    /// # Errors
    /// If the protocol cannot be read, or its table of objects is invalid.
    pub fn read(path: &Path) -> anyhow::Result<Option<Self>> {
        let Some(value) = protocol(path)?.remove(OBJECTS) else { return Ok(None) };
        let list: Self =
            value.try_into().with_context(|| format!("{}: objects", path.display()))?;
        list.up_axis().map_err(|error| error.at(path.display()))?;
        Ok(Some(list))
    }

    fn up_axis(&self) -> Result<UpAxis, InputError> {
        UpAxis::from_str(&self.up, false).map_err(|_| {
            InputError::new("objects.up").value(&self.up).allowed("x, y, z, -x, -y and -z")
        })
    }

    /// Returns the meshes in `folder` by the names of their objects: that of the mesh, or of its
    /// folder if meshes have equal names.
    ///
    /// # Errors
    /// If one of them is missing, or has other contents.
    pub fn meshes(&self, folder: &Path) -> anyhow::Result<Vec<(String, PathBuf)>> {
        let mut problems = Vec::new();
        for (name, sha256) in &self.sha256 {
            match files::bytes(&folder.join(name), MESH_MAX) {
                Err(cause) => problems.push(format!("{name}: {cause}")),
                Ok(bytes) if hex(Sha256::digest(&bytes)) != *sha256 => {
                    problems.push(format!("{name}: other contents, its SHA-256 differs"));
                }
                Ok(_) => (),
            }
        }
        if !problems.is_empty() {
            let (count, of) = (problems.len(), self.sha256.len());
            let more = count.saturating_sub(NAMED_MAX);
            problems.truncate(NAMED_MAX);
            let more = if more > 0 { format!("\n  and {more} more") } else { String::new() };
            bail!(
                "{}: {count} of {of} objects of the protocol are missing or differ; get them from {}\n  {}{more}",
                folder.display(),
                self.source,
                problems.join("\n  ")
            );
        }
        let stem = |name: &str| Path::new(name).file_stem().map(|stem| stem.to_owned());
        let mut stems: Vec<_> = self.sha256.keys().map(|name| stem(name)).collect();
        stems.sort();
        stems.dedup();
        let is_unique = stems.len() == self.sha256.len();
        let name_of = |name: &String| {
            let path = Path::new(name);
            let parent = path.parent().and_then(Path::file_name).filter(|_| !is_unique);
            let name = parent.map(|it| it.to_owned()).or_else(|| stem(name)).unwrap_or_default();
            name.to_string_lossy().into_owned()
        };
        Ok(self.sha256.keys().map(|name| (name_of(name), folder.join(name))).collect())
    }

    /// Loads the experiment of the protocol at `path` on the whole object of a mesh.
    ///
    /// # Errors
    /// If the mesh or the protocol cannot be used.
    pub fn experiment(
        &self,
        path: &Path,
        (name, mesh): (&str, &Path),
        sets: &[String],
        planners: &[String],
    ) -> anyhow::Result<Experiment> {
        let options = MeshOptions {
            mesh: mesh.into(),
            is_beside: false,
            is_around: true,
            side: ObjectSide::Front,
            up: Some(self.up_axis()?),
            unit: Some(self.unit),
            finger: FingerKind::Rigid,
            allow_external_buffers: false,
        };
        // Unit and axis are given, so nothing is asked or noted.
        let asker = Asker { choose: &|_, _| None, note: &|_| () };
        let scene: Table = MeshPlacement::new(&options, asker)?.scene(&options)?.parse()?;
        let mut table = protocol(path)?;
        table.remove(OBJECTS);
        table.insert("scene".into(), Value::Table(scene));
        let text = toml::to_string(&table)?;
        let load =
            |sets: &[String]| Experiment::from_loader(Loader::from_text(path, text.clone())?, sets);
        let mut experiment = with_planners(sets, planners, load)?;
        experiment.name += &format!("-{name}");
        Ok(experiment)
    }
}

fn protocol(path: &Path) -> anyhow::Result<Table> {
    let text = files::text(path, files::TEXT_MAX);
    let text = text.with_context(|| path.display().to_string())?;
    text.parse().with_context(|| path.display().to_string())
}

/// Returns the objects of a protocol with their folder; `None` if it explores shipped scenes.
///
/// # Errors
/// If the protocol has objects and no folder is given, or the reverse.
pub fn list<'a>(
    path: &Path,
    folder: Option<&'a Path>,
) -> anyhow::Result<Option<(ObjectList, &'a Path)>> {
    match (ObjectList::read(path)?, folder) {
        (Some(list), Some(folder)) => Ok(Some((list, folder))),
        (Some(list), None) => bail!(
            "{}: its objects are not shipped: get them from {}, then use --objects FOLDER",
            path.display(),
            list.source
        ),
        (None, folder) => {
            ensure!(
                folder.is_none(),
                "{}: --objects applies only to a protocol with [objects]; this one has its scenes",
                path.display()
            );
            Ok(None)
        }
    }
}
