//! Files and trials that the page of `palpate live` may change.

use super::new::{self, Written};
use super::terminal::Verbosity;
use crate::experiment::Experiment;
use crate::experiment::planner_names::known_planners;
use crate::live::files::file_name;
use crate::live::{Brought, Host, MeshWish};
use crate::study::planners::planners_setting;
use anyhow::Context;
use palpate_input::error::InputError;
use palpate_input::files;
use std::path::{Path, PathBuf};
use std::sync::mpsc::Sender;
use std::sync::{Mutex, PoisonError};

/// Files and trials that the page may change.
pub(super) struct Page {
    /// Folder of all files that the page writes.
    folder: PathBuf,
    /// Experiment that was written last.
    brought: Mutex<Option<PathBuf>>,
    wishes: Sender<Experiment>,
}

impl Page {
    /// Page whose starts go to `wishes`.
    pub(super) fn new(wishes: Sender<Experiment>) -> Self {
        Self { folder: Path::new("runs").join("live"), brought: Mutex::new(None), wishes }
    }

    /// Writes an experiment for a mesh file, and returns one trial of each planner.
    pub(super) fn experiment(
        &self,
        mesh: &Path,
        planners: &[String],
        sets: &[String],
    ) -> anyhow::Result<Experiment> {
        let folder = self.folder.to_string_lossy().into_owned();
        let words = [mesh.to_string_lossy().into_owned(), "--out".into(), folder];
        let args = new::Args::of_words(&own_files(&words))?;
        let written = new::write(&args, Verbosity { quiet: true })?;
        brought(&written.experiment, planners, sets)
    }
}

impl Host for Page {
    fn bring(&self, wish: &MeshWish, mesh: &[u8]) -> Result<Brought, InputError> {
        let path = self.folder.join(file_name(&wish.name)?);
        let out = self.folder.to_string_lossy().into_owned();
        let mut words = vec![path.to_string_lossy().into_owned(), "--out".into(), out];
        let pairs = [
            ("--side", Some(&wish.side)),
            ("--finger", Some(&wish.finger)),
            ("--unit", wish.unit.as_ref()),
        ];
        for (option, value) in pairs {
            words.extend(value.into_iter().flat_map(|value| [option.to_owned(), value.clone()]));
        }
        words.extend(wish.around.then(|| "--around".to_owned()));
        let write = || -> anyhow::Result<Brought> {
            files::make_folder(&self.folder).with_context(|| self.folder.display().to_string())?;
            let args = new::Args::of_words(&own_files(&words))?;
            let mut brought = self.brought.lock().unwrap_or_else(PoisonError::into_inner);
            files::replace_by(&path, |to| std::io::Write::write_all(to, mesh))?;
            let Written { words, experiment, picture, .. } =
                new::write(&args, Verbosity { quiet: true })?;
            let picture = std::fs::read(&picture).unwrap_or_default();
            *brought = Some(experiment);
            Ok(Brought { words, picture })
        };
        write().map_err(|error| InputError::new(format!("{error:#}")))
    }

    fn start(&self, planners: Vec<String>) -> Result<(), InputError> {
        let path = self.brought.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let path = path.ok_or_else(|| InputError::new("no mesh was brought"))?;
        let loaded = brought(&path, &planners, &[]);
        let experiment = loaded.map_err(|error| InputError::new(format!("{error:#}")))?;
        self.wishes.send(experiment).map_err(|_| InputError::new("the command has ended"))
    }

    fn planners(&self) -> Vec<String> {
        known_planners().map(|(name, _)| name.to_owned()).collect()
    }
}

/// Returns a folder that does not exist, for a run that is started on the page.
pub(super) fn new_folder(name: &str) -> PathBuf {
    let folder = |number: u32| Path::new("runs").join(format!("{name}-live-{number}"));
    (1..).map(folder).find(|path| !path.exists()).unwrap_or_else(|| folder(0))
}

/// Adds the options of files that belong to the page.
fn own_files(words: &[String]) -> Vec<String> {
    words.iter().cloned().chain(["--yes".into(), "--force".into()]).collect()
}

/// Returns one trial of an experiment that was written for a mesh.
fn brought(path: &Path, planners: &[String], sets: &[String]) -> anyhow::Result<Experiment> {
    let own = [planners_setting(planners.iter()), "trials=1".into()];
    Ok(Experiment::load(path, &[&own[..], sets].concat())?)
}
