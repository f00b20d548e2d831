//! What has arrived at an end, until its thread takes it.

use super::transport::{Delivery, Waker};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;

/// Where deliveries are put in, from any thread; nothing wakes who waits.
#[derive(Clone)]
pub struct Inlet(Sender<Option<Delivery>>);

/// Where they are taken out.
pub struct Outlet(Receiver<Option<Delivery>>);

/// Both ends of a queue.
pub fn queue() -> (Inlet, Outlet) {
    let (sender, receiver) = channel();
    (Inlet(sender), Outlet(receiver))
}

impl Inlet {
    /// Puts a delivery in; whether anybody is there to take it.
    pub fn put(&self, delivery: Delivery) -> bool {
        self.0.send(Some(delivery)).is_ok()
    }

    /// What ends a wait early.
    pub fn waker(&self) -> Waker {
        let inlet = self.clone();
        Arc::new(move || {
            let _ = inlet.0.send(None);
        })
    }
}

impl Outlet {
    /// Waits for at most `timeout` and hands over all that is there.
    pub fn receive(&self, timeout: Duration, take: &mut dyn FnMut(Delivery)) {
        let mut next = self.0.recv_timeout(timeout);
        while let Ok(delivery) = next {
            if let Some(delivery) = delivery {
                take(delivery);
            }
            next = self.0.try_recv().map_err(|_| RecvTimeoutError::Timeout);
        }
    }
}
