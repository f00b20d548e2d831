//! The folder a run's results lie in.
//!
//! `resolved.toml` (the experiment with every default written out), `manifest.json` (what ran
//! it, a program each), `surface.csv` (the truth on the test grid), `trials.jsonl` (a row per finished trial).
//! Everything else in it is drawn from these.

mod error;
mod rows;

pub use error::StoreError;

use self::error::io_error;
use crate::experiment::experiment::Experiment;
use crate::experiment::row::TrialRow;
use crate::experiment::truth::Truth;
use crate::task::Zone;
use serde::Serialize;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Write};
use std::path::{Component, Path, PathBuf};

/// File of a run's settings, defaults written out.
pub const RESOLVED: &str = "resolved.toml";
const SURFACE: &str = "surface.csv";
const TRIALS: &str = "trials.jsonl";
/// Folder of a run's figures.
pub const FIGURES: &str = "figures";
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

/// A run folder that rows are being added to.
pub struct RunFolder {
    path: PathBuf,
    trials: File,
    /// What is about to add its first row.
    unsigned: Option<Manifest>,
}

/// A run folder read back.
pub struct Run {
    /// What was run.
    pub experiment: Experiment,
    /// The truth on its test grid.
    pub truth: Truth,
    /// Its finished trials, by trial and in the experiment's order of planners.
    pub rows: Vec<TrialRow>,
}

impl RunFolder {
    /// Opens `path` for `experiment`: makes it, or continues what was begun there, or, if
    /// `fresh`, throws that away.
    ///
    /// Returns the rows that are already there. A last line cut short by a crash is dropped.
    ///
    /// # Errors
    /// If the folder holds something else, is being written, or cannot be.
    pub fn open(
        path: &Path,
        experiment: &Experiment,
        truth: &Truth,
        manifest: &Manifest,
        fresh: bool,
    ) -> Result<(Self, Vec<TrialRow>), StoreError> {
        fs::create_dir_all(path).map_err(io_error(path))?;
        let file = path.join(TRIALS);
        refuse_foreign(path)?;
        let trials = OpenOptions::new()
            .create(true)
            .read(true)
            .append(true)
            .open(&file)
            .map_err(io_error(&file))?;
        match trials.try_lock() {
            Err(TryLockError::WouldBlock) => return Err(StoreError::Busy { path: path.into() }),
            Err(TryLockError::Error(cause)) => return Err(StoreError::Io { path: file, cause }),
            Ok(()) => {}
        }
        if fresh {
            trials.set_len(0).map_err(io_error(&file))?;
            clear(path)?;
        }
        write_or_compare(path, RESOLVED, &saved(experiment, path))?;
        write_or_compare(path, SURFACE, &surface(experiment, truth))?;
        let (rows, good_bytes) = rows::read(&file, experiment)?;
        trials.set_len(good_bytes).map_err(io_error(&file))?;
        let unsigned = Some(manifest.clone());
        Ok((Self { path: path.into(), trials, unsigned }, rows))
    }

    /// Adds a row and hands it to the operating system, so that a later kill cannot lose it.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn append(&mut self, row: &TrialRow) -> Result<(), StoreError> {
        let file = self.path.join(TRIALS);
        let mut line = serde_json::to_vec(row).map_err(io::Error::from).map_err(io_error(&file))?;
        // A number that is not finite has no JSON: such a row could not be read back.
        if let Err(error) = serde_json::from_slice::<TrialRow>(&line) {
            return Err(StoreError::BadRow { path: file, line: 0, message: error.to_string() });
        }
        line.push(b'\n');
        if let Some(manifest) = self.unsigned.take() {
            sign(&self.path.join(MANIFEST), &manifest)?;
        }
        self.trials.write_all(&line).map_err(io_error(&file))
    }

    /// Puts the rows in order of trial and planner: the same bytes whoever finished first.
    ///
    /// # Errors
    /// If the file cannot be read back or replaced.
    pub fn sort(self, experiment: &Experiment) -> Result<(), StoreError> {
        let file = self.path.join(TRIALS);
        let (mut rows, _) = rows::read(&file, experiment)?;
        rows::sort(&mut rows, experiment);
        let mut text = String::new();
        for row in &rows {
            text +=
                &serde_json::to_string(row).map_err(io::Error::from).map_err(io_error(&file))?;
            text.push('\n');
        }
        write_whole(&file, &text)
    }
}

impl Run {
    /// Reads a run folder back.
    ///
    /// # Errors
    /// If it is not one, or a file in it is damaged.
    pub fn read(path: &Path) -> Result<Self, StoreError> {
        for missing in [RESOLVED, SURFACE, TRIALS] {
            if !path.join(missing).is_file() {
                return Err(StoreError::NotARun { path: path.into(), missing });
            }
        }
        let experiment = Experiment::load(&path.join(RESOLVED), &[])?;
        let truth = read_surface(&path.join(SURFACE), &experiment.scene.zone)?;
        let (mut rows, _) = rows::read(&path.join(TRIALS), &experiment)?;
        rows::sort(&mut rows, &experiment);
        Ok(Self { experiment, truth, rows })
    }
}

/// The experiment with every default written out.
pub fn resolved(experiment: &Experiment) -> String {
    let text = toml::to_string(experiment).unwrap_or_default();
    format!(
        "# Every setting of this run, defaults written out. It can be run again as it is.\n{text}"
    )
}

/// As [`resolved`], with the mesh's path relative to the run's folder, so that both may move.
fn saved(experiment: &Experiment, folder: &Path) -> String {
    let mut experiment = experiment.clone();
    if let (Some(object), Ok(folder)) = (&mut experiment.scene.object, folder.canonicalize()) {
        let mesh = object.mesh.canonicalize().unwrap_or_else(|_| object.mesh.clone());
        object.mesh = relative(&mesh, &folder);
    }
    resolved(&experiment)
}

/// `path` as seen from `folder`, both absolute.
fn relative(path: &Path, folder: &Path) -> PathBuf {
    let shared = path.components().zip(folder.components()).take_while(|(a, b)| a == b).count();
    let up = folder.components().skip(shared).map(|_| Component::ParentDir);
    up.chain(path.components().skip(shared)).collect()
}

/// Adds `manifest` to the list of programs that wrote a run, unless the last one was the same.
fn sign(path: &Path, manifest: &Manifest) -> Result<(), StoreError> {
    let to_value = |text: String| serde_json::from_str::<Vec<serde_json::Value>>(&text).ok();
    let mut signed = fs::read_to_string(path).ok().and_then(to_value).unwrap_or_default();
    let new = serde_json::to_value(manifest).map_err(io::Error::from).map_err(io_error(path))?;
    if signed.last() != Some(&new) {
        signed.push(new);
        let text = serde_json::to_string_pretty(&signed).map_err(io::Error::from);
        write_whole(path, &text.map_err(io_error(path))?)?;
    }
    Ok(())
}

/// Removes what an earlier run wrote, the mark of a run's folder last.
fn clear(path: &Path) -> Result<(), StoreError> {
    for name in
        ["report.html", "summary.csv", "comparison.csv", "equal_error.csv", MANIFEST, SURFACE]
    {
        remove(&path.join(name), |file| fs::remove_file(file))?;
    }
    // Figures are drawn again; others' files beside them are not ours to remove.
    remove(&path.join(RESOLVED), |file| fs::remove_file(file))
}

/// A folder that is not empty must hold a run, or at most the empty beginning of one.
fn refuse_foreign(path: &Path) -> Result<(), StoreError> {
    if path.join(RESOLVED).exists() {
        return Ok(());
    }
    for entry in fs::read_dir(path).map_err(io_error(path))? {
        let entry = entry.map_err(io_error(path))?;
        let is_empty = entry.metadata().is_ok_and(|metadata| metadata.len() == 0);
        if entry.file_name() != TRIALS || !is_empty {
            return Err(StoreError::Foreign { path: path.into() });
        }
    }
    Ok(())
}

fn surface(experiment: &Experiment, truth: &Truth) -> String {
    let mut text =
        String::from(if experiment.scene.zone.dimension() == 1 { "x_m" } else { "x_m,z_m" });
    text += ",height_m,is_reachable\n";
    for (i, place) in truth.places.iter().enumerate() {
        for coordinate in place {
            text += &format!("{coordinate},");
        }
        let height = truth.heights_m[i].map_or(String::new(), |height| height.to_string());
        text += &format!("{height},{}\n", u8::from(truth.is_reachable[i]));
    }
    text
}

fn read_surface(path: &Path, zone: &Zone) -> Result<Truth, StoreError> {
    let bad =
        |line: usize, message: String| StoreError::BadRow { path: path.into(), line, message };
    let text = fs::read_to_string(path).map_err(io_error(path))?;
    let (mut places, mut heights_m, mut is_reachable) = (Vec::new(), Vec::new(), Vec::new());
    for (i, record) in csv::Reader::from_reader(text.as_bytes()).records().enumerate() {
        let record = record.map_err(|error| bad(i + 2, error.to_string()))?;
        let number = |field: &str| {
            let number = field.parse::<f64>().ok().filter(|number| number.is_finite());
            number.ok_or_else(|| bad(i + 2, format!("\"{field}\" is not a number")))
        };
        let mut fields = record.iter();
        let reachable = fields.next_back().map(number).transpose()? == Some(1.0);
        let height =
            fields.next_back().filter(|field| !field.is_empty()).map(number).transpose()?;
        let place = fields.map(number).collect::<Result<Vec<f64>, _>>()?;
        if place.len() != zone.dimension() {
            return Err(bad(i + 2, format!("{} coordinates", place.len())));
        }
        places.push(place);
        heights_m.push(height);
        is_reachable.push(reachable);
    }
    Ok(Truth::new(zone, places, heights_m, is_reachable))
}

/// Writes `name`, or, if the folder has it already, insists that it says the same.
fn write_or_compare(folder: &Path, name: &'static str, text: &str) -> Result<(), StoreError> {
    let path = folder.join(name);
    match fs::read_to_string(&path) {
        Ok(found) if found == text => Ok(()),
        Ok(found) => {
            let mut pairs = found.lines().zip(text.lines()).filter(|(a, b)| a != b);
            let (found, wanted) = pairs.next().unwrap_or(("(fewer or more lines)", "..."));
            Err(StoreError::Differs {
                path: folder.into(),
                file: name,
                found: found.into(),
                wanted: wanted.into(),
            })
        }
        Err(cause) if cause.kind() == io::ErrorKind::NotFound => write_whole(&path, text),
        Err(cause) => Err(StoreError::Io { path, cause }),
    }
}

/// Writes a file so that a reader sees all of it or none.
///
/// # Errors
/// If it cannot be written.
pub fn write_whole(path: &Path, text: &str) -> Result<(), StoreError> {
    let mut partial = path.as_os_str().to_owned();
    partial.push(".part");
    let partial = PathBuf::from(partial);
    fs::write(&partial, text).map_err(io_error(&partial))?;
    fs::rename(&partial, path).map_err(io_error(path))
}

fn remove(path: &Path, how: impl Fn(&Path) -> io::Result<()>) -> Result<(), StoreError> {
    match how(path) {
        Err(cause) if cause.kind() != io::ErrorKind::NotFound => {
            Err(StoreError::Io { path: path.into(), cause })
        }
        _ => Ok(()),
    }
}
