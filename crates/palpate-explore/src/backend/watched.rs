//! Lets any body be watched: it says where it stands and keeps pace with the clock.

use super::{Backend, Capabilities, Command, Fault, Reading};
use nalgebra::Point3;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// What is seen of a body.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Seen {
    /// Its time since reset.
    pub time_s: f64,
    /// Joint positions, rad or m.
    pub q: Vec<f64>,
    /// Points that were marked, in `W`.
    pub marks_w: Vec<Point3<f64>>,
    /// Whether nobody watches any more.
    pub is_closed: bool,
}

/// What is seen, shared between the thread that moves a body and the one that draws it.
#[derive(Clone, Debug, Default)]
pub struct Sight(Arc<Mutex<Seen>>);

impl Sight {
    /// As it is now.
    pub fn seen(&self) -> Seen {
        self.lock().clone()
    }

    /// Adds a mark.
    pub fn mark(&self, p_w: Point3<f64>) {
        self.lock().marks_w.push(p_w);
    }

    /// Has the body stopped before its next tick.
    pub fn close(&self) {
        self.lock().is_closed = true;
    }

    fn lock(&self) -> MutexGuard<'_, Seen> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn take(&self, reading: &Reading) {
        let mut seen = self.lock();
        seen.time_s = reading.time_s;
        seen.q.clone_from(&reading.q);
    }
}

/// A body that shows every reading and is no faster than `speed` times the clock. Its readings are
/// those of the body inside: time stands in them, whatever the clock says.
pub struct Watched {
    inner: Box<dyn Backend>,
    sight: Sight,
    /// Seconds of the body in one of the clock.
    speed: f64,
    /// A moment of the clock and the body's time then.
    since: Option<(Instant, f64)>,
}

impl Watched {
    /// `speed` seconds of the body pass in one of the clock.
    pub fn new(inner: Box<dyn Backend>, speed: f64) -> (Self, Sight) {
        let sight = Sight::default();
        (Self { inner, sight: sight.clone(), speed, since: None }, sight)
    }
}

impl Backend for Watched {
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
        let Seen { is_closed, time_s, .. } = *self.sight.lock();
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

/// Shorter waits are saved up: a system cannot sleep for much less (chosen).
const GRAIN_S: f64 = 0.004;

/// Who is later than this does not catch up: a plan was made meanwhile (chosen).
const LATE_S: f64 = 0.1;
