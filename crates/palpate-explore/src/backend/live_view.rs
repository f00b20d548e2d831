//! Backend wrapper that publishes the joint state and runs in real time.

use super::{Backend, Capabilities, Command, Fault, Reading};
use nalgebra::Point3;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// State of a backend for display.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ViewState {
    /// Time since reset, s.
    pub time_s: f64,
    /// Joint positions, rad or m.
    pub q: Vec<f64>,
    /// Marked points, in `W`.
    pub marks_w: Vec<Point3<f64>>,
    /// Whether the window was closed.
    pub is_closed: bool,
}

/// The displayed state, shared between the thread that moves the robot and the one that draws it.
#[derive(Clone, Debug, Default)]
pub struct LiveView(Arc<Mutex<ViewState>>);

impl LiveView {
    /// Returns the current state.
    pub fn seen(&self) -> ViewState {
        self.lock().clone()
    }

    /// Adds a mark.
    pub fn mark(&self, p_w: Point3<f64>) {
        self.lock().marks_w.push(p_w);
    }

    /// Requests a stop before the next tick.
    pub fn close(&self) {
        self.lock().is_closed = true;
    }

    fn lock(&self) -> MutexGuard<'_, ViewState> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn take(&self, reading: &Reading) {
        let mut seen = self.lock();
        seen.time_s = reading.time_s;
        seen.q.clone_from(&reading.q);
    }
}

/// A backend that publishes every reading and runs at no more than `speed` times real time. Its
/// readings, including their time, are those of the wrapped backend, whatever the clock says.
pub struct ViewedBackend {
    inner: Box<dyn Backend>,
    sight: LiveView,
    /// Simulated seconds per second of the clock.
    speed: f64,
    /// Reference: an instant of the clock and the backend's time then.
    since: Option<(Instant, f64)>,
}

impl ViewedBackend {
    /// Wraps `inner` so that `speed` of its seconds pass per second of the clock.
    pub fn new(inner: Box<dyn Backend>, speed: f64) -> (Self, LiveView) {
        let sight = LiveView::default();
        (Self { inner, sight: sight.clone(), speed, since: None }, sight)
    }
}

impl Backend for ViewedBackend {
    fn capabilities(&self) -> &Capabilities {
        self.inner.capabilities()
    }

    fn reset(&mut self, seed: u64) -> Result<&Reading, Fault> {
        let reading = self.inner.reset(seed)?;
        self.sight.take(reading);
        self.since = None;
        Ok(reading)
    }

    fn step(&mut self, command: &Command) -> Result<&Reading, Fault> {
        let ViewState { is_closed, time_s, .. } = *self.sight.lock();
        if is_closed {
            return Err(Fault::Stopped { time_s });
        }
        let reading = self.inner.step(command)?;
        self.sight.take(reading);
        let time_s = reading.time_s;
        let (moment, from_s) = *self.since.get_or_insert_with(|| (Instant::now(), time_s));
        let ahead_s = (time_s - from_s) / self.speed - moment.elapsed().as_secs_f64();
        if ahead_s < -LATE_S {
            self.since = None;
        } else if ahead_s > GRAIN_S {
            sleep(Duration::try_from_secs_f64(ahead_s).unwrap_or_default());
        }
        Ok(reading)
    }
}

/// Shortest wait; shorter ones are accumulated. A heuristic: the operating system cannot sleep for
/// much less.
const GRAIN_S: f64 = 0.004;

/// Delay above which lost time is skipped, as after planning; a heuristic.
const LATE_S: f64 = 0.1;
