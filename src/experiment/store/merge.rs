//! Shards of a run, put together: the bytes of one that ran in a single process.

use super::{Manifest, Run, RunFolder, StoreError};
use std::collections::HashMap;
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
        "{}: another experiment than {}: settings, planners or trials differ", path.display(), first.display()
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

/// Puts the rows of `shards` into a new run in `out`; how many.
///
/// # Errors
/// If they are not each trial of one experiment once.
pub fn merge(out: &Path, shards: &[PathBuf], manifest: &Manifest) -> Result<usize, MergeError> {
    let mut whole: Option<Run> = None;
    let mut seen: HashMap<(u32, String), &PathBuf> = HashMap::new();
    for path in shards {
        let run = Run::read(path)?;
        for row in &run.rows {
            let (trial, planner) = (row.trial, row.planner.clone());
            if let Some(a) = seen.insert((trial, planner.clone()), path) {
                return Err(MergeError::Twice { trial, planner, a: a.clone(), b: path.clone() });
            }
        }
        match &mut whole {
            None => whole = Some(run),
            Some(whole) if whole.experiment == run.experiment => whole.rows.extend(run.rows),
            Some(_) => {
                let (path, first) = (path.clone(), shards[0].clone());
                return Err(MergeError::Foreign { path, first });
            }
        }
    }
    let Some(mut whole) = whole else { return Ok(0) };
    let experiment = &whole.experiment;
    let wanted = (0..experiment.trials)
        .flat_map(|trial| experiment.planners.iter().map(move |planner| (trial, planner.clone())));
    let mut missing = wanted.filter(|key| !seen.contains_key(key));
    if let Some((trial, planner)) = missing.next() {
        let missing = 1 + missing.count();
        let wanted = experiment.trials as usize * experiment.planners.len();
        return Err(MergeError::Missing { missing, wanted, trial, planner });
    }
    super::rows::sort(&mut whole.rows, experiment);
    let (mut folder, there) = RunFolder::open(out, experiment, &whole.truth, manifest, false)?;
    if !there.is_empty() {
        return Err(MergeError::Taken { path: out.into() });
    }
    whole.rows.iter().try_for_each(|row| folder.append(row))?;
    Ok(whole.rows.len())
}
