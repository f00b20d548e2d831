//! Keeps a loop in step with the clock; the time of day.

use std::thread::sleep;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Seconds since 1970.
pub fn now_s() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |since| since.as_secs_f64())
}

/// Ticks of a fixed period.
pub struct Pace {
    period: Duration,
    /// When the tick in hand ends.
    next: Instant,
    overruns: u64,
}

impl Pace {
    /// From now on.
    pub fn new(period_s: f64) -> Self {
        let period = Duration::try_from_secs_f64(period_s).unwrap_or_default();
        Self { period, next: Instant::now(), overruns: 0 }
    }

    /// Waits until the tick in hand ends. Who is late by more than `slack` periods does not catch
    /// up: that is an overrun.
    pub fn wait(&mut self, slack: u32) {
        let now = Instant::now();
        self.next += self.period;
        if self.next + self.period * slack < now {
            self.overruns += 1;
            self.next = now;
        }
        sleep(self.next.saturating_duration_since(Instant::now()));
    }

    /// Begins anew: what was waited for was no tick.
    pub fn restart(&mut self) {
        self.next = Instant::now();
    }

    /// How often it was late.
    pub fn overruns(&self) -> u64 {
        self.overruns
    }
}
