//! What a twin sends, with the failures that are on.

use super::failure::{Act, FAILURES, Memory};
use crate::backend::ros::link::Link;
use crate::backend::ros::packet::Packet;
use crate::math::seed;
use std::collections::VecDeque;

/// Sends packets through the failures that are on.
pub struct Sender {
    is_on: Vec<bool>,
    memory: Memory,
    /// What is sent later, and when.
    delayed: VecDeque<(f64, Packet)>,
}

impl Sender {
    /// Without failures.
    pub fn new(seed: u64) -> Self {
        Self {
            is_on: vec![false; FAILURES.len()],
            memory: Memory { rng: seed::stream(seed, 0, "twin"), kept: Default::default() },
            delayed: VecDeque::new(),
        }
    }

    /// Begins or ends a failure, by its place in the table.
    pub fn set(&mut self, failure: usize, is_on: bool) {
        if let Some(slot) = self.is_on.get_mut(failure) {
            *slot = is_on;
        }
        self.memory.kept = Default::default();
    }

    /// Whether a failure is on.
    pub fn is_on(&self, failure: usize) -> bool {
        self.is_on.get(failure).copied().unwrap_or(false)
    }

    /// Sends a packet at `now_s`, changed, late or not at all if a failure says so.
    pub fn send(&mut self, link: &Link, mut packet: Packet, now_s: f64) {
        let mut delay_s = 0.0;
        for (failure, _) in FAILURES.iter().zip(&self.is_on).filter(|(_, is_on)| **is_on) {
            match failure.act {
                Act::Packet(change) => {
                    if !change(&mut packet, &mut self.memory) {
                        return;
                    }
                }
                Act::Delay(by_s) => delay_s += by_s,
                Act::Estop | Act::Deadman => (),
            }
        }
        match delay_s > 0.0 || !self.delayed.is_empty() {
            true => self.delayed.push_back((now_s + delay_s, packet)),
            false => link.send(packet),
        }
    }

    /// Sends what was held back until `now_s`.
    pub fn send_due(&mut self, link: &Link, now_s: f64) {
        while self.delayed.front().is_some_and(|(at_s, _)| *at_s <= now_s) {
            if let Some((_, packet)) = self.delayed.pop_front() {
                link.send(packet);
            }
        }
    }
}
