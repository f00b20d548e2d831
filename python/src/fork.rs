//! Thread pools that work in a forked process.
//!
//! A fork copies only the calling thread. Work for a pool that was started before the fork would
//! wait forever in the child, so pools belong to the process that started them.

use crate::errors;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::process;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// Process that loaded this module; it and processes that were not forked use rayon's global pool.
static FIRST_PROCESS: AtomicU32 = AtomicU32::new(0);

/// Replacement of rayon's global pool in a forked process.
static FORKED: ProcessPool = ProcessPool::new(0);

/// Stores the id of the process that loads this module.
pub(crate) fn remember_process() {
    FIRST_PROCESS.store(process::id(), Ordering::Relaxed);
}

/// Runs `work` without the interpreter lock, in a process forked or not. Use it for all work that
/// may reach rayon's global pool.
///
/// # Errors
/// `PalpateError` if threads cannot be started.
pub(crate) fn detach<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    py.detach(|| install(work))
}

/// Runs `work` like [`detach`], on a thread without the interpreter lock.
///
/// # Errors
/// `PalpateError` if threads cannot be started.
pub(crate) fn install<T: Send>(work: impl FnOnce() -> T + Send) -> PyResult<T> {
    if FIRST_PROCESS.load(Ordering::Relaxed) == process::id() {
        return Ok(work());
    }
    Ok(FORKED.get()?.install(work))
}

/// Thread pool of the current process, started on first use.
pub(crate) struct ProcessPool {
    threads: usize,
    /// Process that started the pool, and the pool.
    pool: Mutex<Option<(u32, Arc<ThreadPool>)>>,
}

impl ProcessPool {
    /// Creates a pool of `threads` threads, 0 for all cores.
    pub(crate) const fn new(threads: usize) -> Self {
        Self { threads, pool: Mutex::new(None) }
    }

    /// Returns the pool.
    ///
    /// # Errors
    /// `PalpateError` if threads cannot be started.
    pub(crate) fn get(&self) -> PyResult<Arc<ThreadPool>> {
        let mut current = self.pool.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((process, pool)) = &*current
            && *process == process::id()
        {
            return Ok(Arc::clone(pool));
        }
        let pool = ThreadPoolBuilder::new().num_threads(self.threads).build();
        let pool = Arc::new(pool.map_err(errors::other)?);
        // The pool of the parent process is not dropped: its threads do not exist here.
        std::mem::forget(current.replace((process::id(), Arc::clone(&pool))));
        Ok(pool)
    }
}
