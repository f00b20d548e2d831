//! The way that the joints came, to go back on it.

use super::interlock::Now;
use crate::robot::arm::Joints;
use std::collections::VecDeque;

/// How much of the way is kept; chosen: 10 mm at 5 mm/s, the slowest contact.
const KEPT_S: f64 = 2.0;

/// Most postures kept.
const MOST: usize = 4096;

/// Postures of the last ticks, oldest first; holds no more than what it was made for.
pub struct WayBack {
    postures: VecDeque<Joints>,
    most: usize,
}

impl WayBack {
    /// Of a body with ticks of `period_s`.
    pub fn new(period_s: f64) -> Self {
        let most = ((KEPT_S / period_s) as usize).clamp(1, MOST);
        Self { postures: VecDeque::with_capacity(most), most }
    }

    /// Nothing is behind.
    pub fn forget(&mut self) {
        self.postures.clear();
    }

    /// Adds where the body stands.
    pub fn push(&mut self, q: &Joints) {
        if self.postures.len() >= self.most {
            self.postures.pop_front();
        }
        self.postures.push_back(*q);
    }

    /// Joint velocities that lead back with the tip at `speed_m_s`, dropping the postures passed;
    /// none where the way ends.
    pub fn velocity(&mut self, now: &Now, speed_m_s: f64) -> Option<Joints> {
        while let Some(q) = self.postures.back() {
            let by = q - now.q;
            let travel_s = now.tip_speed_m_s(&by) / speed_m_s;
            if travel_s >= now.period_s {
                return Some(by / travel_s);
            }
            self.postures.pop_back();
        }
        None
    }
}
