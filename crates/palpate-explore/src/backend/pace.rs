//! Real-time pacing of a loop, and the time of day.

use std::thread::sleep;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Returns the seconds since 1970.
pub fn now_s() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |since| since.as_secs_f64())
}

/// Paces ticks of a fixed period.
pub struct RealTimePacer {
    period: Duration,
    /// Deadline of the current tick.
    next: Instant,
    overruns: u64,
}

impl RealTimePacer {
    /// Creates a pacer whose first period starts now.
    pub fn new(period_s: f64) -> Self {
        let period = Duration::try_from_secs_f64(period_s).unwrap_or_default();
        Self { period, next: Instant::now(), overruns: 0 }
    }

    /// Waits for the deadline of the current tick. A deadline missed by more than `slack` periods
    /// is counted as an overrun and skipped.
    pub fn wait(&mut self, slack: u32) {
        let now = Instant::now();
        self.next += self.period;
        if self.next + self.period * slack < now {
            self.overruns += 1;
            self.next = now;
        }
        sleep(self.next.saturating_duration_since(Instant::now()));
    }

    /// Restarts the deadlines now, without counting an overrun.
    pub fn restart(&mut self) {
        self.next = Instant::now();
    }

    /// Returns the number of overruns.
    pub fn overruns(&self) -> u64 {
        self.overruns
    }
}
