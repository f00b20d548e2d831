//! The folder a run's results lie in.
//!
//! `resolved.toml` (the experiment with every default written out), `manifest.json` (what ran
//! it), `surface.csv` (the truth on the test grid), `trials.jsonl` (a row per finished trial).
//! Everything else in it is drawn from these.

use super::experiment::Experiment;
use super::metrics::Truth;
use super::row::TrialRow;
use crate::ground::config::ConfigError;
use crate::world::Zone;
use serde::Serialize;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// What can go wrong with a run folder.
#[derive(Debug, Error)]
pub enum StoreError {
    /// Reading or writing failed.
    #[error("{}: {cause}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: io::Error,
    },
    /// The folder holds another experiment.
    #[error(
        "{} holds another experiment: {file} says `{found}`, this one `{wanted}`; \
         choose another folder with --out, or start over with --fresh", path.display()
    )]
    Differs {
        /// The folder.
        path: PathBuf,
        /// The file that differs.
        file: &'static str,
        /// First line of it that differs.
        found: String,
        /// What that line is in this experiment.
        wanted: String,
    },
    /// Another process writes there.
    #[error("{}: another run is writing this folder", path.display())]
    Busy {
        /// The folder.
        path: PathBuf,
    },
    /// A line is not a row.
    #[error("{}:{line}: not a row of results: {message}", path.display())]
    BadRow {
        /// The file.
        path: PathBuf,
        /// Its line.
        line: usize,
        /// What the parser says.
        message: String,
    },
    /// The recorded experiment cannot be read.
    #[error(transparent)]
    Config(#[from] ConfigError),
}

const RESOLVED: &str = "resolved.toml";
const SURFACE: &str = "surface.csv";
const TRIALS: &str = "trials.jsonl";
/// Folder of a run's figures.
pub const FIGURES: &str = "figures";
/// Everything a run writes, which `--fresh` removes.
const WRITTEN: &[&str] =
    &[TRIALS, RESOLVED, SURFACE, "manifest.json", "summary.csv", "report.html"];

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
    /// Vector extensions of this processor that change speed, not results.
    pub cpu_features: Vec<&'static str>,
    /// Root of all randomness.
    pub seed: u64,
}

/// A run folder that rows are being added to.
pub struct RunFolder {
    path: PathBuf,
    trials: File,
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
    /// Opens `path` for `experiment`: makes it, or continues what was begun there.
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
    ) -> Result<(Self, Vec<TrialRow>), StoreError> {
        fs::create_dir_all(path).map_err(io_error(path))?;
        let file = path.join(TRIALS);
        let trials = OpenOptions::new()
            .create(true)
            .read(true)
            .append(true)
            .open(&file)
            .map_err(io_error(&file))?;
        trials.try_lock().map_err(|_| StoreError::Busy { path: path.into() })?;
        write_or_compare(path, RESOLVED, &resolved(experiment))?;
        write_or_compare(path, SURFACE, &surface(experiment, truth))?;
        let manifest = serde_json::to_string_pretty(manifest).map_err(io::Error::from);
        let manifest = manifest.map_err(io_error(path))?;
        write_whole(&path.join("manifest.json"), &manifest)?;
        let (rows, good_bytes) = read_rows(&file, true)?;
        trials.set_len(good_bytes).map_err(io_error(&file))?;
        Ok((Self { path: path.into(), trials }, rows))
    }

    /// Removes what an earlier run wrote to `path`; a folder that is no run's is left alone.
    ///
    /// # Errors
    /// If a file cannot be removed.
    pub fn clear(path: &Path) -> Result<(), StoreError> {
        if !path.join(RESOLVED).exists() {
            return Ok(());
        }
        for name in WRITTEN {
            remove(&path.join(name), |file| fs::remove_file(file))?;
        }
        remove(&path.join(FIGURES), |folder| fs::remove_dir_all(folder))
    }

    /// Adds a row and hands it to the operating system, so that a later kill cannot lose it.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn append(&mut self, row: &TrialRow) -> Result<(), StoreError> {
        let file = self.path.join(TRIALS);
        let mut line = serde_json::to_vec(row).map_err(io::Error::from).map_err(io_error(&file))?;
        line.push(b'\n');
        self.trials.write_all(&line).map_err(io_error(&file))
    }

    /// Puts the rows in order of trial and planner: the same bytes whoever finished first.
    ///
    /// # Errors
    /// If the file cannot be read back or replaced.
    pub fn sort(self, planners: &[String]) -> Result<Vec<TrialRow>, StoreError> {
        let file = self.path.join(TRIALS);
        let (mut rows, _) = read_rows(&file, false)?;
        sort(&mut rows, planners);
        let mut text = String::new();
        for row in &rows {
            text +=
                &serde_json::to_string(row).map_err(io::Error::from).map_err(io_error(&file))?;
            text.push('\n');
        }
        write_whole(&file, &text)?;
        Ok(rows)
    }
}

impl Run {
    /// Reads a run folder back.
    ///
    /// # Errors
    /// If it is not one, or a file in it is damaged.
    pub fn read(path: &Path) -> Result<Self, StoreError> {
        let experiment = Experiment::load(&path.join(RESOLVED), &[])?;
        let truth = read_surface(&path.join(SURFACE), &experiment.scene.zone)?;
        let (mut rows, _) = read_rows(&path.join(TRIALS), true)?;
        sort(&mut rows, &experiment.planners);
        Ok(Self { experiment, truth, rows })
    }
}

fn sort(rows: &mut [TrialRow], planners: &[String]) {
    rows.sort_by_key(|row| (row.trial, planners.iter().position(|name| *name == row.planner)));
}

/// The experiment with every default written out.
pub fn resolved(experiment: &Experiment) -> String {
    let text = toml::to_string(experiment).unwrap_or_default();
    format!(
        "# Every setting of this run, defaults written out. It can be run again as it is.\n{text}"
    )
}

fn surface(experiment: &Experiment, truth: &Truth) -> String {
    let mut text =
        String::from(if experiment.scene.zone.dimension() == 1 { "x_m" } else { "x_m,z_m" });
    text += ",height_m\n";
    for (place, height) in truth.places.iter().zip(&truth.heights_m) {
        for coordinate in place {
            text += &format!("{coordinate},");
        }
        text += &height.map_or(String::new(), |height| height.to_string());
        text.push('\n');
    }
    text
}

fn read_surface(path: &Path, zone: &Zone) -> Result<Truth, StoreError> {
    let bad =
        |line: usize, message: String| StoreError::BadRow { path: path.into(), line, message };
    let text = fs::read_to_string(path).map_err(io_error(path))?;
    let (mut places, mut heights_m) = (Vec::new(), Vec::new());
    for (i, record) in csv::Reader::from_reader(text.as_bytes()).records().enumerate() {
        let record = record.map_err(|error| bad(i + 2, error.to_string()))?;
        let number = |field: &str| {
            field.parse::<f64>().map_err(|_| bad(i + 2, format!("\"{field}\" is not a number")))
        };
        let mut fields = record.iter();
        let height =
            fields.next_back().filter(|field| !field.is_empty()).map(number).transpose()?;
        let place = fields.map(number).collect::<Result<Vec<f64>, _>>()?;
        if place.len() != zone.dimension() {
            return Err(bad(i + 2, format!("{} coordinates", place.len())));
        }
        places.push(place);
        heights_m.push(height);
    }
    Ok(Truth::new(zone, places, heights_m))
}

/// Rows of a results file and the number of bytes they fill.
///
/// A last line without its end, or that is no row, was cut short: it is left out if `forgive`.
fn read_rows(path: &Path, forgive: bool) -> Result<(Vec<TrialRow>, u64), StoreError> {
    let bytes = fs::read(path).map_err(io_error(path))?;
    let (mut rows, mut good) = (Vec::new(), 0);
    for (i, line) in bytes.split_inclusive(|&byte| byte == b'\n').enumerate() {
        let is_last = good + line.len() == bytes.len();
        match serde_json::from_slice(line) {
            Ok(row) if line.ends_with(b"\n") => rows.push(row),
            Ok(_) if forgive => break,
            Err(_) if forgive && is_last => break,
            Ok(_) => break,
            Err(error) => {
                let message = error.to_string();
                return Err(StoreError::BadRow { path: path.into(), line: i + 1, message });
            }
        }
        good += line.len();
    }
    Ok((rows, good as u64))
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

fn io_error(path: &Path) -> impl Fn(io::Error) -> StoreError {
    move |cause| StoreError::Io { path: path.into(), cause }
}
