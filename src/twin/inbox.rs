//! What arrives at a twin, kept until its loop looks.

use crate::backend::ros::link::Sink;
use crate::backend::ros::packet::Packet;
use crate::backend::ros::transport::Delivery;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

/// Most deliveries that wait; chosen, seconds of commands.
const WAITING_MAX: usize = 1024;

/// Deliveries in the order in which they came.
#[derive(Clone, Default)]
pub struct Inbox(Arc<Mutex<VecDeque<Delivery>>>);

impl Inbox {
    /// The oldest, if there is one.
    pub fn next(&self) -> Option<Delivery> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).pop_front()
    }
}

impl Sink for Inbox {
    fn take(&mut self, delivery: Delivery) {
        let mut waiting = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if waiting.len() == WAITING_MAX {
            waiting.pop_front();
        }
        waiting.push_back(delivery);
    }

    fn tick(&mut self, _send: &mut dyn FnMut(Packet)) {}
}
