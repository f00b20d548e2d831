//! Backend wrapper that publishes each reading and runs at the pace of the clock.

use super::{Backend, Capabilities, Command, Fault, Reading};
use crate::robot::sensor::Sample;
use nalgebra::Point3;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// State of a backend for display.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewState {
    /// Time since reset, s.
    pub time_s: f64,
    /// Joint positions, rad or m.
    pub q: Vec<f64>,
    /// Magnitude of the force on the finger, if a sensor measures it.
    pub force_n: Option<f64>,
    /// Value of the fingertip's sensor, as [`Sample::level`] gives it.
    pub sensor: Option<f64>,
    /// Simulated seconds per second of the clock; infinite for as many as there can be.
    pub speed: f64,
    /// Marked points, in `W`.
    pub marks_w: Vec<Point3<f64>>,
    /// Whether the window was closed.
    pub is_closed: bool,
}

impl ViewState {
    /// Returns a state before the first reading.
    fn new(speed: f64) -> Self {
        let (force_n, sensor, is_closed) = (None, None, false);
        Self { time_s: 0.0, q: Vec::new(), force_n, sensor, speed, marks_w: Vec::new(), is_closed }
    }
}

/// The displayed state, shared between the thread that moves the robot and the one that draws it.
#[derive(Clone, Debug)]
pub struct LiveView(Arc<Mutex<ViewState>>);

impl LiveView {
    /// Creates a view of a backend in which `speed` seconds pass per second of the clock.
    pub fn new(speed: f64) -> Self {
        Self(Arc::new(Mutex::new(ViewState::new(speed))))
    }

    /// Changes the speed.
    pub fn set_speed(&self, speed: f64) {
        self.lock().speed = speed;
    }

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
        seen.force_n = reading.wrench.map(|wrench| wrench.force_n.norm());
        if let Some(level) = reading.samples.last().map(Sample::level) {
            seen.sensor = Some(level);
        }
    }
}

/// A backend that publishes every reading and runs at no more than the view's speed. Its readings,
/// including their time, are those of the wrapped backend, whatever the clock says.
pub struct ViewedBackend {
    inner: Box<dyn Backend>,
    sight: LiveView,
    /// Reference: an instant of the clock, the backend's time then, and its speed since.
    since: Option<(Instant, f64, f64)>,
}

impl ViewedBackend {
    /// Wraps `inner` so that `sight` shows it and sets its speed.
    pub fn new(inner: Box<dyn Backend>, sight: LiveView) -> Self {
        Self { inner, sight, since: None }
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
        let ViewState { is_closed, time_s, speed, .. } = *self.sight.lock();
        if is_closed {
            return Err(Fault::Stopped { time_s });
        }
        let reading = self.inner.step(command)?;
        self.sight.take(reading);
        if speed.is_infinite() {
            return Ok(reading);
        }
        let time_s = reading.time_s;
        self.since = self.since.filter(|(.., since)| *since == speed);
        let (moment, from_s, _) =
            *self.since.get_or_insert_with(|| (Instant::now(), time_s, speed));
        let ahead_s = (time_s - from_s) / speed - moment.elapsed().as_secs_f64();
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
