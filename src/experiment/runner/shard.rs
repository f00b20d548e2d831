//! A part of an experiment's trials, for a machine or task of its own.

use crate::experiment::runner::Job;
use std::str::FromStr;
use thiserror::Error;

/// Every `count`-th trial, with all its planners.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Which, from 1.
    pub index: u32,
    /// Of how many.
    pub count: u32,
}

/// What is no shard.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("allowed is I/N with I from 1 to N, as in 3/8")]
pub struct NoShard;

impl FromStr for Shard {
    type Err = NoShard;

    fn from_str(text: &str) -> Result<Self, NoShard> {
        let (index, count) = text.split_once('/').ok_or(NoShard)?;
        let number = |text: &str| text.trim().parse::<u32>().map_err(|_| NoShard);
        let (index, count) = (number(index)?, number(count)?);
        if index == 0 || index > count {
            return Err(NoShard);
        }
        Ok(Self { index, count })
    }
}

impl Shard {
    /// Whether it has a trial.
    pub fn has(self, trial: u32) -> bool {
        trial % self.count == self.index - 1
    }

    /// Leaves its own of all jobs.
    pub fn keep(self, jobs: &mut Vec<Job>) {
        jobs.retain(|(trial, _)| self.has(*trial));
    }
}
