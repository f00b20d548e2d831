//! Channel between a trial and a planner's thread: the trial sends its belief and waits for the
//! target. Neither side holds the interpreter lock while waiting.

use crate::belief::Belief;
use crate::known::Known;
use crate::target::TargetInput;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Time of busy waiting before a trial sleeps.
// heuristic: waking up takes about as long.
const BUSY_WAIT: Duration = Duration::from_micros(50);

type Reply = Result<TargetInput, String>;

/// Planner's end of the channel.
#[pyclass(frozen, module = "palpate._palpate")]
pub(crate) struct PlannerChannel {
    requests: Mutex<Receiver<Known>>,
    replies: Sender<Reply>,
    /// Trial's end, until the trial takes it.
    other: Mutex<Option<TrialEnd>>,
}

/// Trial's end of the channel.
pub(crate) struct TrialEnd {
    requests: Sender<Known>,
    replies: Receiver<Reply>,
    limit: Duration,
}

#[pymethods]
impl PlannerChannel {
    #[new]
    fn new(limit_s: f64) -> PyResult<Self> {
        let limit = Duration::try_from_secs_f64(limit_s)
            .map_err(|error| PyValueError::new_err(format!("limit_s = {limit_s}: {error}")))?;
        let ((requests, theirs), (replies, ours)) = (channel(), channel());
        let trial = TrialEnd { requests, replies: ours, limit };
        Ok(Self { requests: Mutex::new(theirs), replies, other: Mutex::new(Some(trial)) })
    }

    /// Waits for the next belief; returns None after the trial.
    fn next(&self, py: Python<'_>) -> Option<Belief> {
        py.detach(|| {
            let requests = self.requests.lock().unwrap_or_else(PoisonError::into_inner);
            requests.recv().ok().map(Belief)
        })
    }

    /// Sends a target.
    fn answer(&self, target: TargetInput) {
        // Ignored if the trial no longer waits.
        let _ = self.replies.send(Ok(target));
    }

    /// Sends the reason why there is no target.
    fn fail(&self, reason: String) {
        let _ = self.replies.send(Err(reason));
    }
}

impl PlannerChannel {
    /// Takes the trial's end; returns `None` the second time.
    pub(crate) fn trial(&self) -> Option<TrialEnd> {
        self.other.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

/// Reasons for a missing target.
pub(crate) enum NoTarget {
    /// The planner failed, or the run was stopped, for this reason.
    Failed(String),
    /// The planner exceeded the time limit.
    Timeout(Duration),
}

impl TrialEnd {
    /// Sends a belief and waits for the target.
    ///
    /// # Errors
    /// If there is no target.
    pub(crate) fn ask(&self, belief: Known) -> Result<TargetInput, NoTarget> {
        let gone = || NoTarget::Failed("the planner's thread has ended".into());
        self.requests.send(belief).map_err(|_| gone())?;
        let begun = Instant::now();
        while begun.elapsed() < BUSY_WAIT {
            if let Ok(reply) = self.replies.try_recv() {
                return reply.map_err(NoTarget::Failed);
            }
            std::thread::yield_now();
        }
        match self.replies.recv_timeout(self.limit) {
            Ok(reply) => reply.map_err(NoTarget::Failed),
            Err(RecvTimeoutError::Timeout) => Err(NoTarget::Timeout(self.limit)),
            Err(RecvTimeoutError::Disconnected) => Err(gone()),
        }
    }
}
