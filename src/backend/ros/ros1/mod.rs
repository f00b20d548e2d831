//! ROS 1, by roslibrust: for labs whose drivers are of that age.

mod definitions;
mod master;
#[cfg(unix)]
mod nodelay;
mod types;

use crate::backend::ros::packet::Packet;
use crate::backend::ros::queue::{Inlet, Outlet, queue};
use crate::backend::ros::service::{Answer, Service};
use crate::backend::ros::settings::BackendSettings;
use crate::backend::ros::topics::{Side, Topic, Topics};
use crate::backend::ros::transport::{Delivery, Transport, TransportError, Waker};
use master::Census;
use roslibrust::RosMessageType;
use roslibrust::ros1::{NodeHandle, Publisher, ServiceServer};
use std::collections::HashMap;
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tokio::runtime::Runtime;
use types::*;

/// Messages that wait in a reader or writer; chosen, more than come while a thread is held up.
const QUEUE: usize = 64;

/// How long an answer to a call from outside is waited for; chosen.
const ANSWER: Duration = Duration::from_millis(500);

type Writer = Box<dyn Fn(&Runtime, &Packet) -> Option<Result<(), String>>>;
/// Calls from outside that wait for their answer.
type Waiting = Arc<Mutex<HashMap<u64, Sender<Answer>>>>;

/// One side's end in a ROS 1 network.
pub struct Ros1 {
    runtime: Runtime,
    node: NodeHandle,
    census: Census,
    topics: Topics,
    inlet: Inlet,
    outlet: Outlet,
    writers: Vec<Writer>,
    /// Kept, for a service ends with it.
    _servers: Vec<ServiceServer>,
    waiting: Waiting,
}

/// Spares ROS 1 the loading of certificates, which nobody uses there: each attempt to reach a dead
/// publisher would load them anew and hold messages up for 200 ms. To be called before any thread
/// runs, as a program's first act.
pub fn spare_certificates() {
    // SAFETY: no other thread reads the environment yet.
    unsafe {
        std::env::set_var("SSL_CERT_FILE", "/dev/null");
        std::env::set_var("SSL_CERT_DIR", "/nonexistent");
    }
}

fn open<E: std::fmt::Display>(what: &str) -> impl Fn(E) -> TransportError {
    let what = what.to_owned();
    move |error| TransportError::Open { what: what.clone(), words: error.to_string() }
}

impl Ros1 {
    /// An end on one side of the arm of `settings`; `services` are those that are served.
    ///
    /// # Errors
    /// If there is no master, or it does not take the node.
    pub fn open(
        settings: &BackendSettings,
        side: Side,
        services: Vec<Service>,
    ) -> Result<Self, TransportError> {
        let runtime = Runtime::new().map_err(open("threads"))?;
        // A second node of the same name would end the first.
        let name = match side {
            Side::Explorer => format!("/palpate_explorer_{}", std::process::id()),
            Side::Arm => format!("/palpate_arm_{}", std::process::id()),
        };
        let master = settings.master.clone();
        let node = runtime
            .block_on(NodeHandle::new(&master, &name))
            .map_err(open(&format!("a node at the master {master}")))?;
        let (inlet, outlet) = queue();
        let mut end = Self {
            runtime,
            node,
            census: Census::new(&master, &settings.topics),
            topics: settings.topics.clone(),
            inlet,
            outlet,
            writers: Vec::new(),
            _servers: Vec::new(),
            waiting: Waiting::default(),
        };
        end.topics(side)?;
        if side == Side::Arm {
            services.into_iter().enumerate().try_for_each(|(i, service)| end.serve(i, service))?;
        }
        Ok(end)
    }

    fn topics(&mut self, side: Side) -> Result<(), TransportError> {
        self.topic(side, Topic::Joints, joints_in, |packet| match packet {
            Packet::Joints(message) => Some(joints_out(message.clone())),
            _ => None,
        })?;
        self.topic(side, Topic::Wrench, wrench_in, |packet| match packet {
            Packet::Wrench(message) => Some(wrench_out(message.clone())),
            _ => None,
        })?;
        self.topic(side, Topic::Status, status_in, |packet| match packet {
            Packet::Status(message) => Some(status_out(message.clone())),
            _ => None,
        })?;
        match self.topics.tactile.is_shadow() {
            true => self.topic(side, Topic::Tactile, fingers_in, |packet| match packet {
                Packet::Fingers(message) => Some(fingers_out(*message.clone())),
                _ => None,
            })?,
            false => self.topic(side, Topic::Tactile, hand_in, |packet| match packet {
                Packet::Hand(message) => Some(hand_out(*message.clone())),
                _ => None,
            })?,
        }
        match self.topics.command.is_bare() {
            true => self.topic(side, Topic::Command, Packet::Velocities, |packet| match packet {
                Packet::Velocities(message) => Some(message.clone()),
                _ => None,
            }),
            false => self.topic(side, Topic::Command, command_in, |packet| match packet {
                Packet::Command(message) => Some(command_out(message.clone())),
                _ => None,
            }),
        }
    }

    /// A topic with messages of type `M`: a writer on the side that publishes it, a reader on the
    /// other.
    fn topic<M: RosMessageType>(
        &mut self,
        side: Side,
        topic: Topic,
        wrap: fn(M) -> Packet,
        pick: fn(&Packet) -> Option<M>,
    ) -> Result<(), TransportError> {
        let name = self.topics.line(topic).name.into_owned();
        if topic.publisher() == side {
            let publisher: Publisher<M> = self
                .runtime
                .block_on(self.node.advertise(&name, QUEUE, false))
                .map_err(open(&name))?;
            self.writers.push(Box::new(move |runtime, packet| {
                let message = pick(packet)?;
                Some(runtime.block_on(publisher.publish(&message)).map_err(|e| e.to_string()))
            }));
            return Ok(());
        }
        let mut subscriber =
            self.runtime.block_on(self.node.subscribe::<M>(&name, QUEUE)).map_err(open(&name))?;
        let inlet = self.inlet.clone();
        self.runtime.spawn(async move {
            while let Some(message) = subscriber.next().await {
                let delivery = match message {
                    Ok(message) => {
                        let (packet, received) = (wrap(message), Instant::now());
                        Delivery::Packet { packet, sender: 0, received }
                    }
                    Err(error) if error.to_string().contains("lag") => continue,
                    Err(error) => Delivery::Garbled { topic, words: error.to_string() },
                };
                if !inlet.put(delivery) {
                    break;
                }
            }
        });
        Ok(())
    }

    /// A service is answered by the link's loop; the caller's task waits for it.
    fn serve(&mut self, number: usize, service: Service) -> Result<(), TransportError> {
        let name = service.name(self.topics.namespace());
        let (inlet, waiting) = (self.inlet.clone(), Arc::clone(&self.waiting));
        let number = number as u64;
        let answer = move |_: Request| {
            let (sender, answer) = channel();
            waiting.lock().unwrap_or_else(PoisonError::into_inner).insert(number, sender);
            inlet.put(Delivery::Call { service: service.clone(), call: number });
            Ok(match answer.recv_timeout(ANSWER) {
                Ok(Answer { is_done, words }) => Response { success: is_done, message: words },
                Err(_) => Response { success: false, message: "not answered in time".into() },
            })
        };
        let server = self
            .runtime
            .block_on(self.node.advertise_service::<Trigger, _>(&name, answer))
            .map_err(open(&name))?;
        self._servers.push(server);
        Ok(())
    }
}

impl Transport for Ros1 {
    fn waker(&self) -> Waker {
        self.inlet.waker()
    }

    fn send(&mut self, packet: &Packet) -> Result<(), TransportError> {
        let sent = self.writers.iter().find_map(|writer| writer(&self.runtime, packet));
        TransportError::of_sending(&self.topics.line(packet.topic()).name, sent)
    }

    fn receive(&mut self, timeout: Duration, take: &mut dyn FnMut(Delivery)) {
        self.outlet.receive(timeout, take);
    }

    fn publisher_count(&self, topic: Topic) -> usize {
        self.census.publishers(topic)
    }

    /// A call asks the master for the server by itself.
    fn is_served(&mut self, _: &Service) -> bool {
        true
    }

    fn call(&mut self, service: &Service) -> Result<(), TransportError> {
        let (node, inlet, service) = (self.node.clone(), self.inlet.clone(), service.clone());
        let name = service.name(self.topics.namespace());
        self.runtime.spawn(async move {
            let answer = match node.service_client::<Trigger>(&name).await {
                Ok(client) => match client.call(&Request {}).await {
                    Ok(Response { success, message }) => {
                        Answer { is_done: success, words: message }
                    }
                    Err(error) => Answer { is_done: false, words: error.to_string() },
                },
                Err(error) => Answer { is_done: false, words: error.to_string() },
            };
            inlet.put(Delivery::Answered { service, answer });
        });
        Ok(())
    }

    fn answer(
        &mut self,
        service: &Service,
        call: u64,
        answer: &Answer,
    ) -> Result<(), TransportError> {
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        let sent = waiting.remove(&call).map(|waiting| waiting.send(answer.clone()));
        match sent {
            Some(Ok(())) => Ok(()),
            _ => Err(TransportError::Send {
                what: service.name(self.topics.namespace()),
                words: "no call".into(),
            }),
        }
    }
}
