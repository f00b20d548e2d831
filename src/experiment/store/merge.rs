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

/// Puts the rows of `shards`, each with its folder, into a new run in `out`; how many.
///
/// # Errors
/// If they are not each trial of one experiment once.
pub fn merge(
    out: &Path,
    shards: Vec<(PathBuf, Run)>,
    manifest: &Manifest,
) -> Result<usize, MergeError> {
    let mut whole: Option<(PathBuf, Run)> = None;
    let mut seen: HashMap<(u32, String), PathBuf> = HashMap::new();
    for (path, run) in shards {
        for row in &run.rows {
            let (trial, planner) = (row.trial, row.planner.clone());
            if let Some(a) = seen.insert((trial, planner.clone()), path.clone()) {
                return Err(MergeError::Twice { trial, planner, a, b: path });
            }
        }
        match &mut whole {
            None => whole = Some((path, run)),
            Some((_, whole)) if whole.experiment == run.experiment => whole.rows.extend(run.rows),
            Some((first, _)) => return Err(MergeError::Foreign { path, first: first.clone() }),
        }
    }
    let Some((_, Run { experiment, truth, mut rows, .. })) = whole else { return Ok(0) };
    let missing = experiment.lacks(&rows);
    if let Some(&(trial, planner)) = missing.first() {
        let (missing, planner) = (missing.len(), planner.to_owned());
        return Err(MergeError::Missing { missing, wanted: missing + rows.len(), trial, planner });
    }
    super::rows::sort(&mut rows, &experiment);
    let (mut folder, there) = RunFolder::open(out, &experiment, &truth, manifest, false)?;
    if !there.is_empty() {
        return Err(MergeError::Taken { path: out.into() });
    }
    rows.iter().try_for_each(|row| folder.append(row))?;
    Ok(rows.len())
}
