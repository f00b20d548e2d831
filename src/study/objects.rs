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
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// Key of the objects in a protocol.
const OBJECTS: &str = "objects";

/// Largest mesh that is read.
const MESH_MAX: u64 = 1 << 30;

/// Number of objects that a message names.
const NAMED_MAX: usize = 5;

/// Protocol on meshes of a folder.
pub struct ObjectProtocol {
    path: PathBuf,
    /// Experiment on each object, without its scene.
    experiment: Table,
    objects: ObjectList,
    up: UpAxis,
}

/// Table `[objects]` of a protocol.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ObjectList {
    /// Place from which the user gets the folder.
    source: String,
    /// Unit of the numbers in the meshes.
    unit: Unit,
    /// Up axis of the meshes.
    up: String,
    /// SHA-256 of each mesh, by its path in the folder.
    sha256: BTreeMap<String, String>,
}

impl ObjectProtocol {
    /// Reads the protocol at `path`; `None` if it explores shipped scenes.
    ///
    /// # Errors
    /// If it cannot be read, or its table of objects is invalid.
    pub fn read(path: &Path) -> anyhow::Result<Option<Self>> {
        let named = || path.display().to_string();
        let text = files::text(path, files::TEXT_MAX).with_context(named)?;
        let mut experiment: Table = text.parse().with_context(named)?;
        let Some(value) = experiment.remove(OBJECTS) else { return Ok(None) };
        let objects: ObjectList =
            value.try_into().with_context(|| format!("{}: {OBJECTS}", named()))?;
        let up = UpAxis::from_str(&objects.up, false).map_err(|_| {
            InputError::new("objects.up")
                .at(path.display())
                .value(&objects.up)
                .allowed("x, y, z, -x, -y and -z")
        })?;
        Ok(Some(Self { path: path.into(), experiment, objects, up }))
    }

    /// Place from which the user gets the objects.
    pub fn source(&self) -> &str {
        &self.objects.source
    }

    /// Returns the meshes in `folder` by the names of their objects: that of the mesh, or of its
    /// folder if meshes have equal names.
    ///
    /// # Errors
    /// If one of them is missing, or has other contents.
    pub fn meshes(&self, folder: &Path) -> anyhow::Result<Vec<(String, PathBuf)>> {
        let ObjectList { source, sha256: listed, .. } = &self.objects;
        let mut problems = Vec::new();
        for (name, sha256) in listed {
            match files::bytes(&folder.join(name), MESH_MAX) {
                Err(cause) => problems.push(format!("{name}: {cause}")),
                Ok(bytes) if hex(Sha256::digest(&bytes)) != *sha256 => {
                    problems.push(format!("{name}: other contents, its SHA-256 differs"));
                }
                Ok(_) => (),
            }
        }
        if !problems.is_empty() {
            let (count, of) = (problems.len(), listed.len());
            let more = count.saturating_sub(NAMED_MAX);
            problems.truncate(NAMED_MAX);
            let more = if more > 0 { format!("\n  and {more} more") } else { String::new() };
            bail!(
                "{}: {count} of {of} objects of the protocol are missing or differ; get them from {source}\n  {}{more}",
                folder.display(),
                problems.join("\n  ")
            );
        }
        let stems: BTreeSet<_> = listed.keys().map(|name| Path::new(name).file_stem()).collect();
        let has_names = stems.len() == listed.len();
        let name_of = |path: &Path| {
            let folder = path.parent().and_then(Path::file_name).filter(|_| !has_names);
            let name = folder.or_else(|| path.file_stem()).unwrap_or_default();
            name.to_string_lossy().into_owned()
        };
        Ok(listed.keys().map(|name| (name_of(Path::new(name)), folder.join(name))).collect())
    }

    /// Loads the experiment on the whole object of a mesh.
    ///
    /// # Errors
    /// If the mesh or the protocol cannot be used.
    pub fn experiment(
        &self,
        (name, mesh): (&str, &Path),
        sets: &[String],
        planners: &[String],
    ) -> anyhow::Result<Experiment> {
        let options = MeshOptions {
            mesh: mesh.into(),
            is_beside: false,
            is_around: true,
            side: ObjectSide::Front,
            up: Some(self.up),
            unit: Some(self.objects.unit),
            finger: FingerKind::Rigid,
            allow_external_buffers: false,
        };
        // Unit and axis are given, so nothing is asked or noted.
        let asker = Asker { choose: &|_, _| None, note: &|_| () };
        let scene: Table = MeshPlacement::new(&options, asker)?.scene(&options)?.parse()?;
        let mut table = self.experiment.clone();
        table.insert("scene".into(), Value::Table(scene));
        let text = toml::to_string(&table)?;
        let load = |sets: &[String]| {
            Experiment::from_loader(Loader::from_text(&self.path, text.clone())?, sets)
        };
        let mut experiment = with_planners(sets, planners, load)?;
        experiment.name += &format!("-{name}");
        Ok(experiment)
    }
}

/// Returns the protocol at `path` on objects, with their folder; `None` if it explores shipped
/// scenes.
///
/// # Errors
/// If the protocol has objects and no folder is given, or the reverse.
pub fn protocol<'a>(
    path: &Path,
    folder: Option<&'a Path>,
) -> anyhow::Result<Option<(ObjectProtocol, &'a Path)>> {
    match (ObjectProtocol::read(path)?, folder) {
        (Some(protocol), Some(folder)) => Ok(Some((protocol, folder))),
        (Some(protocol), None) => bail!(
            "{}: its objects are not shipped: get them from {}, then use --objects FOLDER",
            path.display(),
            protocol.source()
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
