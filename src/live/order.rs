//! Orders of a viewer.

use serde::Deserialize;

/// Wish of a person.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "order", rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum Order {
    /// Hold all trials before their next touch.
    Hold,
    /// Go on.
    Go,
    /// Make one touch of each held trial.
    Step,
    /// Whether each touch needs an approval.
    Approve {
        /// Whether it does.
        each: bool,
    },
    /// Change the speed.
    Speed {
        /// Seconds per second of the clock; without, as many as there can be.
        times: Option<f64>,
    },
    /// Stop all trials before their next touch, as Ctrl-C does.
    Stop,
    /// Show another trial, after the trials have ended.
    Trial {
        /// Number of the trial, from 0.
        number: u32,
    },
    /// Touch a target: a person's own, or in place of a planner's that waits.
    Touch {
        /// Name of the planner.
        planner: String,
        /// Numbers of the target.
        target: Vec<f64>,
    },
    /// Approve the touch that a planner asks for.
    Confirm {
        /// Name of the planner.
        planner: String,
    },
}

/// Reason why an order is not carried out.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{0}")]
pub(super) struct OrderError(pub String);
