//! ROS 1 transport by roslibrust, for drivers of ROS 1.

pub mod camera;
mod master;
mod wire;

use crate::message::{
    BioTacHand, BiotacAll, DiagnosticArray, Float64MultiArray, Image, JointState, JointTrajectory,
    Touching, TriggerResponse, WrenchStamped,
};
use crate::service::{Answer, Service};
use crate::settings::RosSettings;
use crate::topics::{CommandMessage, Endpoint, TactileMessage, Topic, Topics};
use crate::transport::{
    Delivery, Packet, PacketMessage, Transport, Waker, cannot_open, cannot_send,
};
use master::PublisherCounter;
use palpate_input::error::InputError;
use roslibrust::RosMessageType;
use roslibrust::ros1::{NodeHandle, Publisher, ServiceServer};
use std::collections::HashMap;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tokio::runtime::Runtime;
use wire::{Request, SequencedMessage, Trigger};

/// Queue length of a reader or writer; a heuristic: more than arrive while a thread is delayed.
const QUEUE: usize = 64;

/// Timeout of the answer to an incoming call; a heuristic.
const ANSWER: Duration = Duration::from_millis(500);

/// Publishes a packet if its topic and type match.
type Writer = Box<dyn Fn(&Runtime, &Packet) -> Option<Result<(), String>>>;

/// One side in a ROS 1 network.
pub struct Ros1 {
    runtime: Runtime,
    node: NodeHandle,
    census: PublisherCounter,
    topics: Topics,
    side: Endpoint,
    /// Whether the explorer's publisher of commands exists.
    has_commands: bool,
    /// Received items from any thread; `None` only wakes the receiver.
    inlet: Sender<Option<Delivery>>,
    outlet: Receiver<Option<Delivery>>,
    writers: Vec<Writer>,
    /// Servers of the services; dropping a server ends its service.
    _servers: Vec<ServiceServer>,
    /// Incoming calls that wait for their answer.
    waiting: Arc<Mutex<HashMap<u64, Sender<Answer>>>>,
}

/// Disables TLS certificates, which ROS 1 does not use; loading them for each dead publisher would
/// delay messages by 200 ms. Call it before any thread runs, at the start of a program.
pub fn disable_tls_certificates() {
    // SAFETY: no other thread reads the environment yet.
    unsafe {
        std::env::set_var("SSL_CERT_FILE", "/dev/null");
        std::env::set_var("SSL_CERT_DIR", "/nonexistent");
    }
}

impl Ros1 {
    /// Opens one side of the arm of `settings`; `services` are those that are served.
    ///
    /// # Errors
    /// If there is no master, or it rejects the node.
    pub fn open(
        settings: &RosSettings,
        side: Endpoint,
        services: Vec<Service>,
    ) -> Result<Self, InputError> {
        let runtime = Runtime::new().map_err(cannot_open("threads"))?;
        // A second node of the same name would end the first.
        let name = match side {
            Endpoint::Explorer => format!("/palpate_explorer_{}", std::process::id()),
            Endpoint::Arm => format!("/palpate_arm_{}", std::process::id()),
        };
        let master = settings.master.clone();
        let node = runtime
            .block_on(NodeHandle::new(&master, &name))
            .map_err(cannot_open(&format!("a node at the master {master}")))?;
        let (inlet, outlet) = channel();
        let mut end = Self {
            runtime,
            node,
            census: PublisherCounter::new(&master, &settings.topics),
            topics: settings.topics.clone(),
            side,
            has_commands: side == Endpoint::Arm,
            inlet,
            outlet,
            writers: Vec::new(),
            _servers: Vec::new(),
            waiting: Arc::default(),
        };
        end.topics(side)?;
        if side == Endpoint::Arm {
            services.into_iter().enumerate().try_for_each(|(i, service)| end.serve(i, service))?;
        }
        Ok(end)
    }

    fn topics(&mut self, side: Endpoint) -> Result<(), InputError> {
        self.headed::<JointState>(side, Topic::Joints)?;
        self.headed::<WrenchStamped>(side, Topic::Wrench)?;
        self.headed::<DiagnosticArray>(side, Topic::Status)?;
        match self.topics.tactile.message {
            TactileMessage::Fingers => self.headed::<BiotacAll>(side, Topic::Tactile)?,
            TactileMessage::Hand => self.headed::<BioTacHand>(side, Topic::Tactile)?,
            TactileMessage::Depth => self.headed::<Image>(side, Topic::Tactile)?,
            TactileMessage::None => (),
            TactileMessage::Flag => {
                self.topic::<Touching>(side, Topic::Tactile, Into::into, |packet| {
                    Touching::in_packet(packet).copied()
                })?;
            }
        }
        if side == Endpoint::Arm { self.commands() } else { Ok(()) }
    }

    /// Creates the topic of commands.
    fn commands(&mut self) -> Result<(), InputError> {
        let side = self.side;
        match self.topics.command.message {
            CommandMessage::Velocities => {
                self.topic::<Float64MultiArray>(side, Topic::Command, Into::into, |packet| {
                    Float64MultiArray::in_packet(packet).cloned()
                })
            }
            CommandMessage::Trajectory => self.headed::<JointTrajectory>(side, Topic::Command),
        }
    }

    /// Creates a topic with messages of type `M`, which have a header.
    fn headed<M: PacketMessage + Clone>(
        &mut self,
        side: Endpoint,
        topic: Topic,
    ) -> Result<(), InputError>
    where
        SequencedMessage<M>: RosMessageType,
    {
        self.topic::<SequencedMessage<M>>(
            side,
            topic,
            |counted| counted.message.into(),
            |packet| {
                let message = M::in_packet(packet)?.clone();
                Some(SequencedMessage { seq: 0, message })
            },
        )
    }

    /// Creates a topic with messages of type `M`: a writer on the side that publishes it, a reader
    /// on the other.
    fn topic<M: RosMessageType>(
        &mut self,
        side: Endpoint,
        topic: Topic,
        wrap: fn(M) -> Packet,
        pick: fn(&Packet) -> Option<M>,
    ) -> Result<(), InputError> {
        let name = self.topics.name(topic);
        if topic.publisher() == side {
            let publisher: Publisher<M> = self
                .runtime
                .block_on(self.node.advertise(&name, QUEUE, false))
                .map_err(cannot_open(&name))?;
            self.writers.push(Box::new(move |runtime, packet| {
                let message = pick(packet)?;
                Some(runtime.block_on(publisher.publish(&message)).map_err(|e| e.to_string()))
            }));
            return Ok(());
        }
        let mut subscriber = self
            .runtime
            .block_on(self.node.subscribe::<M>(&name, QUEUE))
            .map_err(cannot_open(&name))?;
        let inlet = self.inlet.clone();
        self.runtime.spawn(async move {
            while let Some(message) = subscriber.next().await {
                let delivery = match message {
                    Ok(message) => {
                        let (packet, received) = (wrap(message), Instant::now());
                        Delivery::Packet { packet, sender: 0, received }
                    }
                    Err(error) if error.to_string().contains("lag") => continue,
                    Err(error) => Delivery::Malformed { topic, words: error.to_string() },
                };
                if inlet.send(Some(delivery)).is_err() {
                    break;
                }
            }
        });
        Ok(())
    }

    /// Registers a service; the link's loop answers each call, and the caller's task waits for the
    /// answer.
    fn serve(&mut self, number: usize, service: Service) -> Result<(), InputError> {
        let name = service.name(self.topics.namespace());
        let (inlet, waiting) = (self.inlet.clone(), Arc::clone(&self.waiting));
        let number = number as u64;
        let answer = move |_: Request| {
            let (sender, answer) = channel();
            waiting.lock().unwrap_or_else(PoisonError::into_inner).insert(number, sender);
            let _ = inlet.send(Some(Delivery::Call { service: service.clone(), call: number }));
            let Answer { success, message, .. } = answer
                .recv_timeout(ANSWER)
                .unwrap_or_else(|_| Answer::refused("no answer within the timeout"));
            Ok(TriggerResponse { success, message })
        };
        let server = self
            .runtime
            .block_on(self.node.advertise_service::<Trigger, _>(&name, answer))
            .map_err(cannot_open(&name))?;
        self._servers.push(server);
        Ok(())
    }
}

impl Transport for Ros1 {
    fn waker(&self) -> Waker {
        let inlet = self.inlet.clone();
        Arc::new(move || {
            let _ = inlet.send(None);
        })
    }

    fn send(&mut self, packet: &Packet) -> Result<(), InputError> {
        let sent = self.writers.iter().find_map(|writer| writer(&self.runtime, packet));
        let sent = sent.unwrap_or(Err("this side does not publish the topic".into()));
        sent.map_err(|words| cannot_send(&self.topics.name(packet.topic()), words))
    }

    fn receive(&mut self, timeout: Duration, take: &mut dyn FnMut(Delivery)) {
        let mut next = self.outlet.recv_timeout(timeout);
        while let Ok(delivery) = next {
            if let Some(delivery) = delivery {
                take(delivery);
            }
            next = self.outlet.try_recv().map_err(|_| RecvTimeoutError::Timeout);
        }
    }

    fn publisher_count(&self, topic: Topic) -> usize {
        self.census.publishers(topic)
    }

    fn subscriber_count(&self, topic: Topic) -> usize {
        self.census.subscribers(topic)
    }

    fn open_commands(&mut self) -> Result<(), InputError> {
        match std::mem::replace(&mut self.has_commands, true) {
            true => Ok(()),
            false => self.commands(),
        }
    }

    /// Returns true, because a call queries the master for the server itself.
    fn is_served(&mut self, _: &Service) -> bool {
        true
    }

    fn call(&mut self, service: &Service) -> Result<(), InputError> {
        let (node, inlet, service) = (self.node.clone(), self.inlet.clone(), service.clone());
        let name = service.name(self.topics.namespace());
        self.runtime.spawn(async move {
            let answered = match node.service_client::<Trigger>(&name).await {
                Ok(client) => client.call(&Request {}).await.map_err(|error| error.to_string()),
                Err(error) => Err(error.to_string()),
            };
            let answer = match answered {
                Ok(TriggerResponse { success, message }) => {
                    Answer { success, message, ..Answer::default() }
                }
                Err(words) => Answer::refused(words),
            };
            let _ = inlet.send(Some(Delivery::Response { service, answer }));
        });
        Ok(())
    }

    fn answer(&mut self, service: &Service, call: u64, answer: Answer) -> Result<(), InputError> {
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        let sent = waiting.remove(&call).and_then(|waiting| waiting.send(answer).ok());
        sent.ok_or_else(|| {
            cannot_send(
                &service.name(self.topics.namespace()),
                "the call is unknown or already answered",
            )
        })
    }
}
