//! Objects of a protocol that are not shipped: meshes in a folder of the user, known by their
//! hashes. Each is explored as `palpate new --around` does, or all are the library of one
//! experiment.

use super::planners::with_planners;
use super::setup::{Asker, FingerKind, MeshOptions, MeshPlacement};
use crate::experiment::Experiment;
use crate::experiment::experiment::SWEEP;
use crate::experiment::measure::{self, MEASURES, Measure};
use crate::experiment::sweep::{SweepCase, sweep_cases};
use crate::sim::placement::{ObjectSide, UpAxis};
use crate::sim::scene::Unit;
use anyhow::{Context, bail, ensure};
use clap::ValueEnum;
use palpate_input::config::Loader;
use palpate_input::error::InputError;
use palpate_input::files;
use palpate_input::format::hex;
use serde::{Deserialize, Serialize};
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

/// Use of the objects of a protocol.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
enum ObjectRole {
    /// Each is explored in an experiment of its own.
    #[default]
    Shapes,
    /// All are the `[library]` of one experiment, or of each combination of a `[sweep]`.
    Library,
}

/// Result of another system, to be read beside a benchmark's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rival {
    /// Name of the system.
    pub system: String,
    /// Its result.
    pub figure: String,
    /// Publication of the result.
    pub source: String,
    /// Differences of its task from the protocol's.
    pub differs: String,
}

/// Table `[objects]` of a protocol.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ObjectList {
    /// Place from which the user gets the folder.
    source: String,
    /// Use of the objects.
    #[serde(default)]
    role: ObjectRole,
    /// Reported measures, by their names in files, the most important first.
    measures: Vec<String>,
    /// Objects by which settings were chosen; means over the others are reported, too.
    #[serde(default)]
    tuned_on: Vec<String>,
    /// Results of other systems.
    #[serde(default)]
    rivals: Vec<Rival>,
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
        let made = Self { path: path.into(), experiment, objects, up };
        made.check()?;
        Ok(Some(made))
    }

    /// Checks the names in the table.
    fn check(&self) -> Result<(), InputError> {
        let ObjectList { role, measures, tuned_on, .. } = &self.objects;
        let wrong = |key: &str, value: &str, allowed: String| {
            let error = InputError::new(format!("objects.{key}")).at(self.path.display());
            Err(error.value(value).allowed(allowed))
        };
        let known = || MEASURES.iter().map(|measure| measure.id).collect::<Vec<_>>().join(", ");
        if let Some(name) = measures.iter().find(|name| measure::by_id(name).is_none()) {
            return wrong("measures", name, known());
        }
        if measures.is_empty() {
            return wrong("measures", "[]", format!("at least one of {}", known()));
        }
        let names = self.names();
        if let Some(name) = tuned_on.iter().find(|name| !names.contains(name)) {
            return wrong("tuned_on", name, names.join(", "));
        }
        match (role, self.up) {
            (ObjectRole::Library, UpAxis::Z) | (ObjectRole::Shapes, _) => Ok(()),
            (ObjectRole::Library, _) => {
                wrong("up", &self.objects.up, "z: the meshes of a library have z up".into())
            }
        }
    }

    /// Returns the assignments of counts that are smaller than the protocol's.
    pub fn at_most(&self, counts: &[(&str, i64)]) -> Vec<String> {
        let own = |key: &str| self.experiment.get(key).and_then(Value::as_integer);
        let is_less = |(key, count): &&(&str, i64)| own(key).is_none_or(|own| *count < own);
        counts.iter().filter(is_less).map(|(key, count)| format!("{key}={count}")).collect()
    }

    /// Reported measures, the most important first.
    pub fn measures(&self) -> Vec<&'static Measure> {
        self.objects.measures.iter().filter_map(|name| measure::by_id(name)).collect()
    }

    /// Objects by which settings were chosen.
    pub fn tuned_on(&self) -> &[String] {
        &self.objects.tuned_on
    }

    /// Results of other systems.
    pub fn rivals(&self) -> &[Rival] {
        &self.objects.rivals
    }

    /// Whether the objects are the library of one experiment.
    pub fn is_library(&self) -> bool {
        self.objects.role == ObjectRole::Library
    }

    /// Returns the names of the objects in the order of the meshes: that of the mesh, or of its
    /// folder if meshes have equal names.
    fn names(&self) -> Vec<String> {
        let listed = || self.objects.sha256.keys().map(Path::new);
        let stems: BTreeSet<_> = listed().map(Path::file_stem).collect();
        let has_names = stems.len() == self.objects.sha256.len();
        let name_of = |path: &Path| {
            let folder = path.parent().and_then(Path::file_name).filter(|_| !has_names);
            let name = folder.or_else(|| path.file_stem()).unwrap_or_default();
            name.to_string_lossy().into_owned()
        };
        listed().map(name_of).collect()
    }

    /// Loads the experiments of the protocol on the objects in `folder`: one for each object, or
    /// for each combination of a library's `[sweep]`.
    ///
    /// # Errors
    /// If an object or the protocol cannot be used.
    pub fn experiments(
        &self,
        folder: &Path,
        sets: &[String],
        planners: &[String],
    ) -> anyhow::Result<Vec<Experiment>> {
        let meshes = self.meshes(folder)?;
        match self.is_library() {
            true => self.cells(folder, sets, planners),
            false => {
                let load = |(name, mesh): &(String, PathBuf)| {
                    self.experiment((name, mesh), sets, planners)
                };
                meshes.iter().map(load).collect()
            }
        }
    }

    /// Loads the experiments with all objects as their library.
    fn cells(
        &self,
        folder: &Path,
        sets: &[String],
        planners: &[String],
    ) -> anyhow::Result<Vec<Experiment>> {
        let without_ending = |name: &String| Path::new(name).with_extension("");
        let names = self
            .objects
            .sha256
            .keys()
            .map(|name| Value::String(without_ending(name).to_string_lossy().into_owned()));
        let library = Table::from_iter([
            ("folder".into(), std::path::absolute(folder)?.to_string_lossy().as_ref().into()),
            ("unit".into(), self.objects.unit.to_string().into()),
            ("objects".into(), Value::Array(names.collect())),
        ]);
        let library = format!("scene.library={}", Value::Table(library));
        let mut table = self.experiment.clone();
        table.remove(SWEEP);
        let text = toml::to_string(&table)?;
        let mut cases = sweep_cases(&self.path)?;
        if cases.is_empty() {
            cases.push(SweepCase { label: String::new(), sets: Vec::new() });
        }
        let load = |case: &SweepCase| {
            let sets = [sets, &case.sets[..], std::slice::from_ref(&library)].concat();
            let load = |sets: &[String]| {
                Experiment::from_loader(Loader::from_text(&self.path, text.clone())?, sets)
            };
            let mut experiment = with_planners(&sets, planners, load)?;
            experiment.name += &case.label;
            Ok(experiment)
        };
        cases.iter().map(load).collect()
    }

    /// Place from which the user gets the objects.
    pub fn source(&self) -> &str {
        &self.objects.source
    }

    /// Returns the meshes in `folder` by the names of their objects.
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
        let paths = listed.keys().map(|name| folder.join(name));
        Ok(self.names().into_iter().zip(paths).collect())
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
            folder: None,
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
