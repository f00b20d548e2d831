//! Where a trial hands its belief to the thread of a planner, and waits for the target: neither holds
//! the interpreter while it waits.

use crate::belief::Belief;
use crate::known::Known;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Planners that take no longer are not slept for: to be woken takes as long. Chosen.
const SOON: Duration = Duration::from_micros(50);

type Reply = Result<Vec<f64>, String>;

/// The planner's side of the desk.
#[pyclass(frozen, module = "palpate._palpate")]
pub(crate) struct Desk {
    requests: Mutex<Receiver<Known>>,
    replies: Sender<Reply>,
    /// Taken when the trial sits down.
    other: Mutex<Option<Trial>>,
}

/// The trial's side.
pub(crate) struct Trial {
    requests: Sender<Known>,
    replies: Receiver<Reply>,
    limit: Duration,
}

#[pymethods]
impl Desk {
    #[new]
    fn new(limit_s: f64) -> PyResult<Self> {
        let limit = Duration::try_from_secs_f64(limit_s)
            .map_err(|error| PyValueError::new_err(format!("limit_s = {limit_s}: {error}")))?;
        let ((requests, theirs), (replies, ours)) = (channel(), channel());
        let trial = Trial { requests, replies: ours, limit };
        Ok(Self { requests: Mutex::new(theirs), replies, other: Mutex::new(Some(trial)) })
    }

    /// Waits for the next belief; None once the trial is over.
    fn next(&self, py: Python<'_>) -> Option<Belief> {
        py.detach(|| {
            let requests = self.requests.lock().unwrap_or_else(PoisonError::into_inner);
            requests.recv().ok().map(Belief)
        })
    }

    /// Hands over a target.
    fn answer(&self, target: Vec<f64>) {
        // A trial that waits no more needs none.
        let _ = self.replies.send(Ok(target));
    }

    /// Says why there is no target.
    fn fail(&self, reason: String) {
        let _ = self.replies.send(Err(reason));
    }
}

impl Desk {
    /// The trial's side, once.
    pub(crate) fn trial(&self) -> Option<Trial> {
        self.other.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

/// Why there is no target.
pub(crate) enum NoTarget {
    /// The planner, or who stopped the run, says why.
    Said(String),
    /// It did not return in time.
    Late(Duration),
}

impl Trial {
    /// The target of a belief.
    ///
    /// # Errors
    /// If there is none.
    pub(crate) fn ask(&self, belief: Known) -> Result<Vec<f64>, NoTarget> {
        let gone = || NoTarget::Said("its thread has ended".into());
        self.requests.send(belief).map_err(|_| gone())?;
        let begun = Instant::now();
        while begun.elapsed() < SOON {
            if let Ok(reply) = self.replies.try_recv() {
                return reply.map_err(NoTarget::Said);
            }
            std::thread::yield_now();
        }
        match self.replies.recv_timeout(self.limit) {
            Ok(reply) => reply.map_err(NoTarget::Said),
            Err(RecvTimeoutError::Timeout) => Err(NoTarget::Late(self.limit)),
            Err(RecvTimeoutError::Disconnected) => Err(gone()),
        }
    }
}
