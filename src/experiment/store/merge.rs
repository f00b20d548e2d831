//! Shards of a run, put together: the bytes of one that ran in a single process.

use super::content::Content;
use super::error::io_error;
use super::rows::{self, Place};
use super::surface::{self, SURFACE};
use super::{RunFolder, StoreError, TRIALS, resolved};
use crate::experiment::experiment::Experiment;
use crate::experiment::trial::row::TrialId;
use crate::experiment::truth::Truth;
use std::fs::File;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Why folders are no whole run.
#[derive(Debug, Error)]
pub enum MergeError {
    /// One of them cannot be read, or the run not be written.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// One is of another experiment.
    #[error(
        "{}: another experiment than {}: settings, planners, trials or the object differ", path.display(), first.display()
    )]
    Foreign {
        /// It.
        path: PathBuf,
        /// The first shard.
        first: PathBuf,
    },
    /// Two have the same trial.
    #[error("trial {trial} of {planner} stands in {} and in {}", a.display(), b.display())]
    Twice {
        /// Which.
        trial: u32,
        /// Of which planner.
        planner: String,
        /// In one.
        a: PathBuf,
        /// In the other.
        b: PathBuf,
    },
    /// Some trials stand in none.
    #[error(
        "{missing} of {wanted} trials are missing, the first is trial {trial} of {planner}: run its shard \
         again, the same command continues"
    )]
    Missing {
        /// How many.
        missing: usize,
        /// How many there should be.
        wanted: usize,
        /// The first.
        trial: u32,
        /// Its planner.
        planner: String,
    },
    /// Where the run shall be there are rows.
    #[error("{}: has rows already; name a new folder", path.display())]
    Taken {
        /// The folder.
        path: PathBuf,
    },
}

/// Folders that hold each trial of an experiment once, all of them together.
pub struct Shards {
    experiment: Experiment,
    truth: Truth,
    content: Content,
    paths: Vec<PathBuf>,
    /// Which of `paths` has a row, and where, in the rows' order.
    places: Vec<(usize, Place)>,
}

impl Shards {
    /// Looks at the folders, row by row.
    ///
    /// # Errors
    /// If they are not each trial of one experiment once.
    pub fn open(paths: &[PathBuf]) -> Result<Option<Self>, MergeError> {
        let Some(first) = paths.first() else { return Ok(None) };
        super::require_run(first)?;
        let experiment = resolved::read(first, &[])?;
        let truth = surface::read(&first.join(SURFACE), &experiment)?;
        let mut content = Content::default();
        let mut places: Vec<(usize, Place)> = Vec::new();
        for (i, path) in paths.iter().enumerate() {
            super::require_run(path)?;
            let is_same = resolved::read(path, &[])? == experiment
                && surface::read(&path.join(SURFACE), &experiment)? == truth;
            if !is_same {
                return Err(MergeError::Foreign { path: path.clone(), first: first.clone() });
            }
            let own = Content::read(path)?;
            own.require_same(&content, path, |_| true)?;
            content.extend(own);
            let mut own = rows::places(&path.join(TRIALS), &experiment)?;
            own.retain(|place| experiment.lists(&place.id));
            places.extend(own.into_iter().map(|place| (i, place)));
        }
        places.sort_by(|(_, a), (_, b)| rows::order(&a.id, &b.id, &experiment));
        let mut pairs = places.array_windows();
        if let Some([(a, place), (b, _)]) = pairs.find(|[(_, a), (_, b)]| a.id == b.id) {
            let TrialId { trial, planner } = place.id.clone();
            let (a, b) = (paths[*a].clone(), paths[*b].clone());
            return Err(MergeError::Twice { trial, planner, a, b });
        }
        let missing = experiment.lacks(places.iter().map(|(_, place)| &place.id));
        if let Some(&(trial, planner)) = missing.first() {
            let (missing, planner) = (missing.len(), planner.to_owned());
            let wanted = missing + places.len();
            return Err(MergeError::Missing { missing, wanted, trial, planner });
        }
        Ok(Some(Self { experiment, truth, content, paths: paths.into(), places }))
    }

    /// What was run.
    pub fn experiment(&self) -> &Experiment {
        &self.experiment
    }

    /// Puts their rows into a new run in `out`; how many.
    ///
    /// # Errors
    /// If there are rows already, or it cannot be written.
    pub fn merge(&self, out: &Path) -> Result<usize, MergeError> {
        let (mut folder, there) =
            RunFolder::open(out, &self.experiment, &self.truth, &self.content, false)?;
        if !there.is_empty() {
            return Err(MergeError::Taken { path: out.into() });
        }
        let mut line = Vec::new();
        for (i, place) in &self.places {
            line.clear();
            let path = self.paths[*i].join(TRIALS);
            // One at a time: there may be more shards than files that a process may have open.
            File::open(&path)
                .and_then(|mut file| rows::copy(&mut file, &place.bytes, &mut line))
                .map_err(io_error(&path))?;
            folder.append_line(&line)?;
        }
        Ok(self.places.len())
    }
}
