//! A transport inside this process, for tests and for a twin without a network.

use super::packet::Packet;
use super::queue::{Inlet, Outlet, queue};
use super::service::{Answer, Service};
use super::topics::{Side, Topic};
use super::transport::{Delivery, Transport, TransportError, Waker};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Where any number of ends meet.
#[derive(Clone, Default)]
pub struct Hub(Arc<Shared>);

#[derive(Default)]
struct Shared {
    ends: Mutex<Vec<End>>,
    count: AtomicU64,
}

struct End {
    id: u64,
    side: Side,
    inlet: Inlet,
}

/// One end.
pub struct Memory {
    hub: Hub,
    id: u64,
    side: Side,
    inlet: Inlet,
    outlet: Outlet,
}

impl Hub {
    /// An end on one side.
    pub fn end(&self, side: Side) -> Memory {
        let (inlet, outlet) = queue();
        let id = self.0.count.fetch_add(1, Ordering::Relaxed);
        self.lock().push(End { id, side, inlet: inlet.clone() });
        Memory { hub: self.clone(), id, side, inlet, outlet }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<End>> {
        self.0.ends.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Memory {
    fn to(&self, is_to: impl Fn(&End) -> bool, delivery: &Delivery) {
        for end in self.hub.lock().iter().filter(|end| is_to(end)) {
            // An end that was dropped hears nothing.
            end.inlet.put(delivery.clone());
        }
    }

    fn others(&self) -> impl Fn(&End) -> bool {
        let side = self.side;
        move |end| end.side != side
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        self.hub.lock().retain(|end| end.id != self.id);
    }
}

impl Transport for Memory {
    fn waker(&self) -> Waker {
        self.inlet.waker()
    }

    fn send(&mut self, packet: &Packet) -> Result<(), TransportError> {
        let packet = packet.clone();
        let delivery = Delivery::Packet { packet, sender: self.id, received: Instant::now() };
        self.to(self.others(), &delivery);
        Ok(())
    }

    fn receive(&mut self, timeout: Duration, take: &mut dyn FnMut(Delivery)) {
        self.outlet.receive(timeout, take);
    }

    fn publisher_count(&self, topic: Topic) -> usize {
        self.hub.lock().iter().filter(|end| end.side == topic.publisher()).count()
    }

    fn is_served(&mut self, _: &Service) -> bool {
        let is_other = self.others();
        self.hub.lock().iter().any(is_other)
    }

    fn call(&mut self, service: &Service) -> Result<(), TransportError> {
        let delivery = Delivery::Call { service: service.clone(), call: self.id };
        self.to(self.others(), &delivery);
        Ok(())
    }

    fn answer(
        &mut self,
        service: &Service,
        call: u64,
        answer: &Answer,
    ) -> Result<(), TransportError> {
        let delivery = Delivery::Answered { service: service.clone(), answer: answer.clone() };
        self.to(|end| end.id == call, &delivery);
        Ok(())
    }
}
