//! ROS 2, by RustDDS: no installation of ROS, no master.

use super::message::{Described, TriggerRequest, TriggerResponse};
use super::packet::Packet;
use super::service::{Answer, Service};
use super::settings::BackendSettings;
use super::topics::{Side, Topic, Topics};
use super::transport::{Delivery, Transport, TransportError, Waker};
use ros2_client::qos::{Durability, History, WhenFull};
use ros2_client::request_id::RmwRequestId;
use ros2_client::{
    Client, Context, ContextOptions, MessageTypeName, Name, Node, NodeName, NodeOptions,
    QosProfile, Server, ServiceMapping, ServiceTypeName,
};
use rustdds::mio1;
use rustdds::mio1::{Events, Interest, Poll, Token};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::Arc;
use std::time::{Duration, Instant};

impl ros2_client::Message for TriggerRequest {}
impl ros2_client::Message for TriggerResponse {}

/// Messages that wait in a reader or writer; chosen, more than come while a thread is held up.
const DEPTH: usize = 64;

/// Token of the waker; every other one is looked at whatever woke the thread.
const WAKE: Token = Token(0);

type Reader = Box<dyn Fn(&mut dyn FnMut(Delivery))>;
/// Publishes a packet if it is of its topic and type.
type Writer = Box<dyn Fn(&Packet) -> Option<Result<(), String>>>;

/// One side's end in a ROS 2 network.
pub struct Ros2 {
    node: Node,
    topics: Topics,
    side: Side,
    poll: Poll,
    events: Events,
    waker: Arc<mio1::Waker>,
    readers: Vec<Reader>,
    writers: Vec<Writer>,
    clients: Vec<(Service, Client<TriggerRequest, TriggerResponse>)>,
    servers: Vec<(Service, Server<TriggerRequest, TriggerResponse>)>,
    calls: HashMap<u64, RmwRequestId>,
    call_count: u64,
}

fn open<E: std::fmt::Display>(what: &str) -> impl Fn(E) -> TransportError {
    let what = what.to_owned();
    move |error| TransportError::Open { what: what.clone(), words: error.to_string() }
}

/// What a writer promises: nobody has to ask for less, and it never waits.
fn reliable() -> QosProfile {
    QosProfile::publisher_default()
        .reliability_reliable(WhenFull::Fail)
        .durability(Durability::Volatile)
        .history(History::KeepLast { depth: DEPTH })
}

/// What a reader asks for: what sensors' drivers promise.
fn best_effort() -> QosProfile {
    QosProfile::subscription_default().history(History::KeepLast { depth: DEPTH })
}

impl Ros2 {
    /// An end on one side of the arm of `settings`; `services` are those that are called or served.
    ///
    /// # Errors
    /// If the network cannot be joined.
    pub fn open(
        settings: &BackendSettings,
        side: Side,
        services: Vec<Service>,
    ) -> Result<Self, TransportError> {
        let options = ContextOptions::new().domain_id(settings.domain);
        let context = Context::with_options(options).map_err(open("a DDS participant"))?;
        let name = match side {
            Side::Explorer => "explorer",
            Side::Arm => "arm",
        };
        let name = NodeName::new("/palpate", name).map_err(open("a node"))?;
        let options = NodeOptions::new().start_parameter_services(false);
        let node = context.new_node(name, options).map_err(open("a node"))?;
        let poll = Poll::new().map_err(open("a poll"))?;
        let waker = mio1::Waker::new(poll.registry(), WAKE).map_err(open("a waker"))?;
        let mut end = Self {
            node,
            topics: settings.topics.clone(),
            side,
            poll,
            events: Events::with_capacity(64),
            waker: Arc::new(waker),
            readers: Vec::new(),
            writers: Vec::new(),
            clients: Vec::new(),
            servers: Vec::new(),
            calls: HashMap::new(),
            call_count: 0,
        };
        end.topics()?;
        services.into_iter().try_for_each(|service| end.service(service))?;
        Ok(end)
    }

    fn topics(&mut self) -> Result<(), TransportError> {
        self.topic(Topic::Joints, Packet::Joints, |packet| match packet {
            Packet::Joints(message) => Some(message),
            _ => None,
        })?;
        self.topic(Topic::Wrench, Packet::Wrench, |packet| match packet {
            Packet::Wrench(message) => Some(message),
            _ => None,
        })?;
        self.topic(Topic::Status, Packet::Status, |packet| match packet {
            Packet::Status(message) => Some(message),
            _ => None,
        })?;
        self.topic(Topic::Heartbeat, Packet::Heartbeat, |packet| match packet {
            Packet::Heartbeat(message) => Some(message),
            _ => None,
        })?;
        match self.topics.tactile.is_shadow() {
            true => self.topic(
                Topic::Tactile,
                |m| Packet::Fingers(Box::new(m)),
                |packet| match packet {
                    Packet::Fingers(message) => Some(message.as_ref()),
                    _ => None,
                },
            )?,
            false => self.topic(
                Topic::Tactile,
                |m| Packet::Hand(Box::new(m)),
                |packet| match packet {
                    Packet::Hand(message) => Some(message.as_ref()),
                    _ => None,
                },
            )?,
        }
        match self.topics.command.is_bare() {
            true => self.topic(Topic::Command, Packet::Velocities, |packet| match packet {
                Packet::Velocities(message) => Some(message),
                _ => None,
            }),
            false => self.topic(Topic::Command, Packet::Command, |packet| match packet {
                Packet::Command(message) => Some(message),
                _ => None,
            }),
        }
    }

    /// A topic with messages of type `M`: a writer on the side that publishes it, a reader on the
    /// other.
    fn topic<M>(
        &mut self,
        topic: Topic,
        wrap: fn(M) -> Packet,
        pick: fn(&Packet) -> Option<&M>,
    ) -> Result<(), TransportError>
    where
        M: Described + Serialize + DeserializeOwned + Clone + 'static,
    {
        let name = self.topics.line(topic).name.to_owned();
        let type_name = MessageTypeName::new(M::DEFINITION.package(), M::DEFINITION.short_name());
        let is_ours = topic.publisher() == self.side;
        let qos = if is_ours { reliable() } else { best_effort() };
        let path = Name::parse(&name).map_err(open(&name))?;
        let dds = self.node.create_topic(&path, type_name, &qos).map_err(open(&name))?;
        if is_ours {
            let publisher =
                self.node.create_publisher::<M>(&dds, Some(qos)).map_err(open(&name))?;
            self.writers.push(Box::new(move |packet| {
                let message = pick(packet)?;
                Some(match publisher.publish(message.clone()) {
                    Ok(()) | Err(ros2_client::error::WriteError::WouldBlock { .. }) => Ok(()),
                    Err(error) => Err(error.to_string()),
                })
            }));
            return Ok(());
        }
        let mut subscription =
            self.node.create_subscription::<M>(&dds, Some(qos)).map_err(open(&name))?;
        self.watch(&mut subscription, &name)?;
        self.readers.push(Box::new(move |take| {
            loop {
                match subscription.take() {
                    Ok(Some((message, info))) => {
                        let (packet, received) = (wrap(message), Instant::now());
                        let sender = hash(&info.publisher_gid());
                        take(Delivery::Packet { packet, sender, received });
                    }
                    Ok(None) => break,
                    Err(error) => {
                        take(Delivery::Garbled { topic, words: error.to_string() });
                        break;
                    }
                }
            }
        }));
        Ok(())
    }

    fn service(&mut self, service: Service) -> Result<(), TransportError> {
        let name = service.name();
        let path = Name::parse(&name).map_err(open(&name))?;
        let type_name = ServiceTypeName::new("std_srvs", "Trigger");
        let mapping = ServiceMapping::Enhanced;
        match self.side {
            Side::Explorer => {
                let mut client = self
                    .node
                    .create_client(mapping, &path, &type_name, reliable(), reliable())
                    .map_err(open(&name))?;
                self.watch(&mut client, &name)?;
                self.clients.push((service, client));
            }
            Side::Arm => {
                let mut server = self
                    .node
                    .create_server(mapping, &path, &type_name, reliable(), reliable())
                    .map_err(open(&name))?;
                self.watch(&mut server, &name)?;
                self.servers.push((service, server));
            }
        }
        Ok(())
    }

    /// Has the poll woken by what arrives at `source`.
    fn watch(
        &self,
        source: &mut impl mio1::event::Source,
        name: &str,
    ) -> Result<(), TransportError> {
        let token = Token(WAKE.0 + 1);
        self.poll.registry().register(source, token, Interest::READABLE).map_err(open(name))
    }
}

fn hash(value: &impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    value.hash(&mut hasher);
    hasher.finish()
}

impl Transport for Ros2 {
    fn waker(&self) -> Waker {
        let waker = Arc::clone(&self.waker);
        Arc::new(move || {
            let _ = waker.wake();
        })
    }

    fn send(&mut self, packet: &Packet) -> Result<(), TransportError> {
        let sent = self.writers.iter().find_map(|writer| writer(packet));
        TransportError::of_sending(self.topics.line(packet.topic()).name, sent)
    }

    fn receive(&mut self, timeout: Duration, take: &mut dyn FnMut(Delivery)) {
        // What interrupts a wait is nothing to act on.
        let _ = self.poll.poll(&mut self.events, Some(timeout));
        self.readers.iter().for_each(|reader| reader(take));
        for (service, server) in &self.servers {
            while let Ok(Some((id, _))) = server.receive_request() {
                self.call_count += 1;
                self.calls.insert(self.call_count, id);
                take(Delivery::Call { service: service.clone(), call: self.call_count });
            }
        }
        for (service, client) in &self.clients {
            while let Ok(Some((_, response))) = client.receive_response() {
                let TriggerResponse { success, message } = response;
                let answer = Answer { is_done: success, words: message };
                take(Delivery::Answered { service: service.clone(), answer });
            }
        }
    }

    fn publisher_count(&self, topic: Topic) -> usize {
        self.node.publisher_count(self.topics.line(topic).name)
    }

    fn call(&mut self, service: &Service) -> Result<(), TransportError> {
        let client = self.clients.iter().find(|(other, _)| other == service);
        let sent = client.map(|(_, client)| client.send_request(TriggerRequest::default()));
        match sent {
            Some(Ok(_)) => Ok(()),
            Some(Err(error)) => {
                Err(TransportError::Send { what: service.name(), words: error.to_string() })
            }
            None => Err(TransportError::Send { what: service.name(), words: "not known".into() }),
        }
    }

    fn answer(
        &mut self,
        service: &Service,
        call: u64,
        answer: &Answer,
    ) -> Result<(), TransportError> {
        let server = self.servers.iter().find(|(other, _)| other == service);
        let (Some((_, server)), Some(id)) = (server, self.calls.remove(&call)) else {
            return Err(TransportError::Send { what: service.name(), words: "no call".into() });
        };
        let response = TriggerResponse { success: answer.is_done, message: answer.words.clone() };
        server.send_response(id, response).map_err(|error| TransportError::Send {
            what: service.name(),
            words: error.to_string(),
        })
    }
}
