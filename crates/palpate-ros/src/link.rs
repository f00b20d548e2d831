//! Thread that serves the topics of one side: passes on received messages immediately, and sends
//! without blocking the control loop.

use super::service::{Answer, Service};
use super::topics::Topic;
use super::transport::{Connect, Delivery, Packet, Publisher, Transport, Waker};
use palpate_input::error::InputError;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::channel;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Interval for counting publishers, s; a heuristic: discovery takes longer.
const COUNTED_S: f64 = 0.1;

/// Time without a turn of the thread after which this program counts as stopped, s: an arm has come
/// to rest by itself in that time.
const STALL_S: f64 = 0.15;

/// Largest time for a turn of the thread.
// heuristic: five control ticks.
pub const TURN: Duration = Duration::from_millis(20);

/// A send operation, run by the thread.
type Job = Box<dyn FnOnce(&mut dyn Transport) -> Result<(), InputError> + Send>;

/// Largest number of pending jobs; beyond it the oldest is dropped.
const JOBS_MAX: usize = 256;

#[derive(Default)]
struct Shared {
    jobs: Mutex<VecDeque<Job>>,
    is_closed: AtomicBool,
    /// Number of known publishers by topic.
    publishers: [AtomicUsize; Topic::ALL.len()],
    /// Number of known subscribers of commands.
    subscribers: AtomicUsize,
    /// Number of turns of the thread.
    turns: AtomicU64,
    broken: Mutex<Option<InputError>>,
    /// Duration of the last stall that was not taken, s.
    stalled_s: Mutex<Option<f64>>,
    /// Calls whose server has not been found yet.
    waiting: Mutex<Vec<Service>>,
}

/// One side of a transport, run by its own thread.
pub struct Link {
    shared: Arc<Shared>,
    waker: Waker,
    thread: Option<JoinHandle<()>>,
}

impl Link {
    /// Opens a transport in its own thread, which passes received messages to `take`, and about
    /// every `period` sends the packet returned by `idle`.
    ///
    /// # Errors
    /// If it cannot be opened.
    pub fn open(
        connect: Connect,
        period: Duration,
        take: impl FnMut(Delivery) + Send + 'static,
        idle: impl FnMut() -> Option<Packet> + Send + 'static,
    ) -> Result<Self, InputError> {
        let shared = Arc::new(Shared::default());
        let (opened, is_open) = channel();
        let inside = Arc::clone(&shared);
        let thread = std::thread::spawn(move || match connect() {
            Ok(transport) => {
                let _ = opened.send(Ok(transport.waker()));
                serve(transport, &inside, period, take, idle);
            }
            Err(error) => {
                let _ = opened.send(Err(error));
            }
        });
        let gone = |_| InputError::new("cannot open the transport: its thread ended");
        let waker = is_open.recv().map_err(gone)??;
        Ok(Self { shared, waker, thread: Some(thread) })
    }

    /// Queues a packet for sending.
    pub fn send(&self, packet: Packet) {
        self.add(Box::new(move |transport| transport.send(&packet)));
    }

    /// Calls a service of the other side as soon as its server is found; the answer arrives as a
    /// [`Delivery`].
    pub fn call(&self, service: Service) {
        let mut waiting = lock(&self.shared.waiting);
        if !waiting.contains(&service) {
            waiting.push(service);
        }
        drop(waiting);
        (self.waker)();
    }

    /// Whether a call of `service` is still waiting for its server.
    pub fn awaits_server(&self, service: &Service) -> bool {
        lock(&self.shared.waiting).contains(service)
    }

    /// Answers a call.
    pub fn answer(&self, service: Service, call: u64, answer: Answer) {
        self.add(Box::new(move |transport| transport.answer(&service, call, answer)));
    }

    /// Returns the number of known publishers of a topic, including this side's own.
    pub fn publisher_count(&self, topic: Topic) -> usize {
        self.shared.publishers[topic as usize].load(Ordering::Relaxed)
    }

    /// Returns the number of known subscribers of the commands.
    pub fn subscriber_count(&self) -> usize {
        self.shared.subscribers.load(Ordering::Relaxed)
    }

    /// Returns all known publishers, if the network announces them; waits for the thread's answer
    /// for at most a second.
    pub fn publishers(&self) -> Vec<Publisher> {
        let (sender, found) = channel();
        self.add(Box::new(move |transport| {
            let _ = sender.send(transport.publishers());
            Ok(())
        }));
        found.recv_timeout(Duration::from_secs(1)).unwrap_or_default()
    }

    /// Returns those of `services` whose server is not known.
    pub fn missing(&self, services: &[Service]) -> Vec<Service> {
        let (sender, found) = channel();
        let services = services.to_vec();
        self.add(Box::new(move |transport| {
            let mut is_missing = |service: &Service| !transport.is_served(service);
            let _ = sender.send(services.into_iter().filter(|it| is_missing(it)).collect());
            Ok(())
        }));
        found.recv_timeout(Duration::from_secs(1)).unwrap_or_default()
    }

    /// Creates this side's publisher of commands.
    pub fn open_commands(&self) {
        self.add(Box::new(|transport| transport.open_commands()));
    }

    /// Waits until everything that has arrived was passed on; returns after `timeout` at the
    /// latest.
    pub fn wait_for_turn(&self, timeout: Duration) {
        let turns = || self.shared.turns.load(Ordering::Acquire);
        let (begun, first) = (Instant::now(), turns());
        (self.waker)();
        // The turn that runs now may have begun before the last arrival.
        while turns() < first + 2 && begun.elapsed() < timeout {
            std::thread::sleep(Duration::from_micros(200));
        }
    }

    /// Returns the error that ended sending, if there is one.
    pub fn broken(&self) -> Option<InputError> {
        lock(&self.shared.broken).clone()
    }

    /// Returns the duration of the last stall of this program, s, if it is new: a signal or an
    /// overloaded computer stopped it for longer than an arm needs to come to rest.
    pub fn take_stall_s(&self) -> Option<f64> {
        lock(&self.shared.stalled_s).take()
    }

    fn add(&self, job: Job) {
        let mut jobs = lock(&self.shared.jobs);
        if jobs.len() == JOBS_MAX {
            jobs.pop_front();
        }
        jobs.push_back(job);
        drop(jobs);
        (self.waker)();
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        self.shared.is_closed.store(true, Ordering::Relaxed);
        (self.waker)();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Runs the thread.
fn serve(
    mut transport: Box<dyn Transport>,
    shared: &Shared,
    period: Duration,
    mut take: impl FnMut(Delivery),
    mut idle: impl FnMut() -> Option<Packet>,
) {
    let mut next = Instant::now() + period;
    let mut counted = Instant::now() - Duration::from_secs(1);
    let mut turned = Instant::now();
    while !shared.is_closed.load(Ordering::Relaxed) {
        let wait = next.saturating_duration_since(Instant::now());
        transport.receive(wait, &mut take);
        let mut result = Ok(());
        loop {
            let Some(job) = lock(&shared.jobs).pop_front() else { break };
            result = result.and(job(&mut *transport));
        }
        lock(&shared.waiting).retain(|service| {
            let is_found = transport.is_served(service);
            if is_found {
                result = result.clone().and(transport.call(service));
            }
            !is_found
        });
        let now = Instant::now();
        let turn_s = (now - turned).as_secs_f64();
        if turn_s > STALL_S {
            *lock(&shared.stalled_s) = Some(turn_s);
        }
        turned = now;
        if now >= next {
            if let Some(packet) = idle() {
                result = result.and(transport.send(&packet));
            }
            // Missed periods are skipped.
            next = (next + period).max(now);
        }
        if counted.elapsed().as_secs_f64() > COUNTED_S {
            counted = now;
            for topic in Topic::ALL {
                let count = transport.publisher_count(topic);
                shared.publishers[topic as usize].store(count, Ordering::Relaxed);
            }
            let count = transport.subscriber_count(Topic::Command);
            shared.subscribers.store(count, Ordering::Relaxed);
        }
        *lock(&shared.broken) = result.err();
        shared.turns.fetch_add(1, Ordering::Release);
    }
    // Pending messages are still sent at the end.
    for job in lock(&shared.jobs).drain(..) {
        let _ = job(&mut *transport);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A transport whose first wait takes much longer than asked for, as in a program that was
    /// stopped.
    struct Stopped(bool);

    impl Transport for Stopped {
        fn waker(&self) -> Waker {
            Arc::new(|| ())
        }

        fn send(&mut self, _: &Packet) -> Result<(), InputError> {
            Ok(())
        }

        fn receive(&mut self, timeout: Duration, _: &mut dyn FnMut(Delivery)) {
            let stop = Duration::from_secs_f64(2.0 * STALL_S);
            std::thread::sleep(if std::mem::take(&mut self.0) { stop } else { timeout });
        }

        fn publisher_count(&self, _: Topic) -> usize {
            0
        }

        fn subscriber_count(&self, _: Topic) -> usize {
            0
        }

        fn open_commands(&mut self) -> Result<(), InputError> {
            Ok(())
        }

        fn is_served(&mut self, _: &Service) -> bool {
            false
        }

        fn call(&mut self, _: &Service) -> Result<(), InputError> {
            Ok(())
        }

        fn answer(&mut self, _: &Service, _: u64, _: Answer) -> Result<(), InputError> {
            Ok(())
        }
    }

    #[test]
    fn a_stop_of_the_program_is_noticed_once() {
        let connect: Connect = Box::new(|| Ok(Box::new(Stopped(true))));
        let link = Link::open(connect, Duration::from_millis(4), |_| (), || None).unwrap();
        let stalled_s = loop {
            match link.take_stall_s() {
                Some(stalled_s) => break stalled_s,
                None => std::thread::sleep(Duration::from_millis(1)),
            }
        };
        assert!(stalled_s >= 2.0 * STALL_S, "{stalled_s}");
    }
}
