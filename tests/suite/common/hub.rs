//! An in-process transport with any number of ends on either side.

use palpate::error::InputError;
use palpate::ros::service::{Answer, Service};
use palpate::ros::topics::{Endpoint, Topic};
use palpate::ros::transport::{Delivery, Packet, Transport, Waker};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

/// Shared hub of the ends; clones refer to the same hub.
#[derive(Clone, Default)]
pub struct Hub(Arc<Mutex<Ends>>);

#[derive(Default)]
struct Ends {
    all: Vec<End>,
    count: u64,
}

struct End {
    id: u64,
    side: Endpoint,
    /// Whether it publishes commands.
    has_commands: bool,
    /// Queue of incoming messages; `None` only wakes the receiver.
    inlet: Sender<Option<Delivery>>,
}

/// One end of the transport.
pub struct Memory {
    hub: Hub,
    id: u64,
    side: Endpoint,
    inlet: Sender<Option<Delivery>>,
    outlet: Receiver<Option<Delivery>>,
}

impl Hub {
    /// Creates an end on one side.
    pub fn end(&self, side: Endpoint) -> Memory {
        let (inlet, outlet) = channel();
        let mut ends = self.lock();
        let id = ends.count;
        ends.count += 1;
        ends.all.push(End { id, side, has_commands: false, inlet: inlet.clone() });
        Memory { hub: self.clone(), id, side, inlet, outlet }
    }

    fn lock(&self) -> MutexGuard<'_, Ends> {
        self.0.lock().unwrap()
    }
}

impl Memory {
    fn to(&self, is_to: impl Fn(&End) -> bool, delivery: &Delivery) {
        for end in self.hub.lock().all.iter().filter(|end| is_to(end)) {
            // An end that was dropped receives nothing.
            let _ = end.inlet.send(Some(delivery.clone()));
        }
    }

    fn others(&self) -> impl Fn(&End) -> bool + use<> {
        let side = self.side;
        move |end| end.side != side
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        self.hub.lock().all.retain(|end| end.id != self.id);
    }
}

impl Transport for Memory {
    fn waker(&self) -> Waker {
        let inlet = self.inlet.clone();
        Arc::new(move || {
            let _ = inlet.send(None);
        })
    }

    fn send(&mut self, packet: &Packet) -> Result<(), InputError> {
        let has_commands = |end: &End| end.id == self.id && end.has_commands;
        let is_open = self.hub.lock().all.iter().any(has_commands);
        if packet.topic() == Topic::Command && self.side == Endpoint::Explorer && !is_open {
            return Err(InputError::new("this side does not publish commands"));
        }
        let packet = packet.clone();
        let delivery = Delivery::Packet { packet, sender: self.id, received: Instant::now() };
        self.to(self.others(), &delivery);
        Ok(())
    }

    fn receive(&mut self, timeout: Duration, take: &mut dyn FnMut(Delivery)) {
        let mut next = self.outlet.recv_timeout(timeout);
        while let Ok(delivery) = next {
            delivery.into_iter().for_each(&mut *take);
            next = self.outlet.try_recv().map_err(|_| RecvTimeoutError::Timeout);
        }
    }

    fn publisher_count(&self, topic: Topic) -> usize {
        let publishes = |end: &&End| {
            end.side == topic.publisher() && (topic != Topic::Command || end.has_commands)
        };
        self.hub.lock().all.iter().filter(publishes).count()
    }

    fn subscriber_count(&self, topic: Topic) -> usize {
        self.hub.lock().all.iter().filter(|end| end.side != topic.publisher()).count()
    }

    fn open_commands(&mut self) -> Result<(), InputError> {
        let mut ends = self.hub.lock();
        let own = ends.all.iter_mut().find(|end| end.id == self.id);
        own.into_iter().for_each(|end| end.has_commands = true);
        Ok(())
    }

    fn is_served(&mut self, _: &Service) -> bool {
        let is_other = self.others();
        self.hub.lock().all.iter().any(is_other)
    }

    fn call(&mut self, service: &Service) -> Result<(), InputError> {
        let delivery = Delivery::Call { service: service.clone(), call: self.id };
        self.to(self.others(), &delivery);
        Ok(())
    }

    fn answer(&mut self, service: &Service, call: u64, answer: Answer) -> Result<(), InputError> {
        let delivery = Delivery::Response { service: service.clone(), answer };
        self.to(|end| end.id == call, &delivery);
        Ok(())
    }
}
