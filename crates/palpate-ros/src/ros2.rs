//! ROS 2 transport by RustDDS, without an installation of ROS.

use super::definition::HasDefinition;
use super::message::{
    BioTacHand, BiotacAll, DiagnosticArray, Float64MultiArray, JointState, JointTrajectory,
    TriggerRequest, TriggerResponse, WrenchStamped,
};
use super::network::network;
use super::settings::{BackendSettings, MappingKind};
use super::topics::{CommandMessage, Endpoint, Service, TactileMessage, Topic, Topics};
use super::transport::{
    Delivery, Packet, PacketMessage, Transport, Waker, cannot_open, cannot_send,
};
use palpate_input::error::InputError;
use ros2_client::qos::{Durability, History, WhenFull};
use ros2_client::request_id::RmwRequestId;
use ros2_client::{
    Client, Context, MessageTypeName, Name, Node, NodeName, NodeOptions, QosProfile, Server,
    ServiceMapping, ServiceTypeName,
};
use rustdds::DomainParticipantBuilder;
use rustdds::mio1;
use rustdds::mio1::{Events, Interest, Poll, Token};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::collections::HashMap;
use std::hash::{BuildHasher, BuildHasherDefault, DefaultHasher};
use std::net::IpAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

impl ros2_client::Message for TriggerRequest {}
impl ros2_client::Message for TriggerResponse {}

/// Queue length of a reader or writer; a heuristic: more than arrive while a thread is delayed.
const DEPTH: usize = 64;

/// Token of the waker; all other sources are read after every wake-up.
const WAKE: Token = Token(0);

/// Passes on the messages received on a topic.
type Reader = Box<dyn Fn(&mut dyn FnMut(Delivery))>;
/// Publishes a packet if its topic and type match.
type Writer = Box<dyn Fn(&Packet) -> Option<Result<(), String>>>;
/// A client with its time of creation.
type MadeClient = (Client<TriggerRequest, TriggerResponse>, Instant);

/// One side in a ROS 2 network.
pub struct Ros2 {
    context: Context,
    node: Node,
    topics: Topics,
    side: Endpoint,
    poll: Poll,
    events: Events,
    waker: Arc<mio1::Waker>,
    readers: Vec<Reader>,
    writers: Vec<Writer>,
    mapping: MappingKind,
    /// Services with their clients and creation times, once servers are found.
    clients: Vec<(Service, Option<MadeClient>)>,
    /// Time of the last search for servers.
    looked: Instant,
    servers: Vec<(Service, Server<TriggerRequest, TriggerResponse>)>,
    calls: HashMap<u64, RmwRequestId>,
    call_count: u64,
}

/// Interval of the search for servers.
const LOOK: Duration = Duration::from_millis(50);

/// Delay from the creation of a client until its server knows it, so that a request is not lost.
// heuristic: several exchanges of endpoint discovery on a local network.
const SETTLE: Duration = Duration::from_millis(200);

/// Vendor id of Eclipse Cyclone DDS in the first two bytes of a GUID (RTPS 2.5, section 9.3.1.3;
/// list of vendors of the DDS Foundation).
const CYCLONE: [u8; 2] = [0x01, 0x10];

/// QoS of a writer: compatible with all readers, and never blocking.
fn reliable() -> QosProfile {
    QosProfile::publisher_default()
        .reliability_reliable(WhenFull::Fail)
        .durability(Durability::Volatile)
        .history(History::KeepLast { depth: DEPTH })
}

/// QoS of a reader: compatible with sensor drivers.
fn best_effort() -> QosProfile {
    QosProfile::subscription_default().history(History::KeepLast { depth: DEPTH })
}

/// QoS of a reader that also receives the last message published before its creation.
fn latched() -> QosProfile {
    reliable().durability(Durability::TransientLocal)
}

/// Returns the network interfaces of this machine with their IPv4 addresses.
fn interfaces() -> Vec<(String, Vec<IpAddr>)> {
    let addresses =
        |one: &netdev::Interface| one.ipv4.iter().map(|net| net.addr().into()).collect();
    netdev::get_interfaces().into_iter().map(|one| (one.name.clone(), addresses(&one))).collect()
}

impl Ros2 {
    /// Opens one side of the arm of `settings`; `services` are those that are called or served.
    ///
    /// # Errors
    /// If the network cannot be joined.
    pub fn open(
        settings: &BackendSettings,
        side: Endpoint,
        services: Vec<Service>,
    ) -> Result<Self, InputError> {
        let (domain, addresses) = network(settings, |name| std::env::var(name).ok(), &interfaces())
            .map_err(cannot_open("the network"))?;
        let mut participant = DomainParticipantBuilder::new(domain);
        if let Some(addresses) = addresses {
            participant = participant.with_only_networks(addresses);
        }
        let participant = participant.build().map_err(cannot_open("a DDS participant"))?;
        let context = Context::from_domain_participant(participant)
            .map_err(cannot_open("a DDS participant"))?;
        let name = match side {
            Endpoint::Explorer => "explorer",
            Endpoint::Arm => "arm",
        };
        let name = NodeName::new("/palpate", name).map_err(cannot_open("a node"))?;
        let options = NodeOptions::new().start_parameter_services(false);
        let node = context.new_node(name, options).map_err(cannot_open("a node"))?;
        let poll = Poll::new().map_err(cannot_open("a poll"))?;
        let waker = mio1::Waker::new(poll.registry(), WAKE).map_err(cannot_open("a waker"))?;
        let mut end = Self {
            context,
            node,
            topics: settings.topics.clone(),
            side,
            poll,
            events: Events::with_capacity(64),
            waker: Arc::new(waker),
            readers: Vec::new(),
            writers: Vec::new(),
            mapping: settings.service_mapping,
            clients: Vec::new(),
            looked: Instant::now(),
            servers: Vec::new(),
            calls: HashMap::new(),
            call_count: 0,
        };
        end.topics()?;
        match side {
            Endpoint::Explorer => {
                end.clients = services.into_iter().map(|service| (service, None)).collect();
            }
            Endpoint::Arm => services.into_iter().try_for_each(|service| end.serve(service))?,
        }
        Ok(end)
    }

    fn topics(&mut self) -> Result<(), InputError> {
        self.topic::<JointState>(Topic::Joints)?;
        self.topic::<WrenchStamped>(Topic::Wrench)?;
        self.topic::<DiagnosticArray>(Topic::Status)?;
        if self.side == Endpoint::Explorer {
            // A status that is published on change may have been published before this side
            // started.
            self.subscribe::<DiagnosticArray>(Topic::Status, latched())?;
        }
        match self.topics.tactile.message {
            TactileMessage::Fingers => self.topic::<BiotacAll>(Topic::Tactile)?,
            TactileMessage::Hand => self.topic::<BioTacHand>(Topic::Tactile)?,
        }
        match self.topics.command.message {
            CommandMessage::Velocities => self.topic::<Float64MultiArray>(Topic::Command),
            CommandMessage::Trajectory => self.topic::<JointTrajectory>(Topic::Command),
        }
    }

    /// Creates a topic with messages of type `M`: a writer on the side that publishes it, a reader
    /// on the other.
    fn topic<M>(&mut self, topic: Topic) -> Result<(), InputError>
    where
        M: PacketMessage + HasDefinition + Serialize + DeserializeOwned + Clone + 'static,
    {
        if topic.publisher() != self.side {
            return self.subscribe::<M>(topic, best_effort());
        }
        let (name, dds) = self.dds_topic::<M>(topic, &reliable())?;
        let publisher =
            self.node.create_publisher::<M>(&dds, Some(reliable())).map_err(cannot_open(&name))?;
        self.writers.push(Box::new(move |packet| {
            let message = M::in_packet(packet)?;
            Some(match publisher.publish(message.clone()) {
                Ok(()) | Err(ros2_client::error::WriteError::WouldBlock { .. }) => Ok(()),
                Err(error) => Err(error.to_string()),
            })
        }));
        Ok(())
    }

    /// Returns the name of a topic, and its DDS topic.
    fn dds_topic<M: HasDefinition>(
        &mut self,
        topic: Topic,
        qos: &QosProfile,
    ) -> Result<(String, rustdds::Topic), InputError> {
        let name = self.topics.name(topic);
        let type_name = MessageTypeName::new(M::DEFINITION.package(), M::DEFINITION.short_name());
        let path = Name::parse(&name).map_err(cannot_open(&name))?;
        let dds = self.node.create_topic(&path, type_name, qos).map_err(cannot_open(&name))?;
        Ok((name, dds))
    }

    /// Creates a reader of messages of type `M`.
    fn subscribe<M>(&mut self, topic: Topic, qos: QosProfile) -> Result<(), InputError>
    where
        M: PacketMessage + HasDefinition + DeserializeOwned + 'static,
    {
        let (name, dds) = self.dds_topic::<M>(topic, &qos)?;
        let mut subscription =
            self.node.create_subscription::<M>(&dds, Some(qos)).map_err(cannot_open(&name))?;
        self.watch(&mut subscription, &name)?;
        let hashes = BuildHasherDefault::<DefaultHasher>::new();
        self.readers.push(Box::new(move |take| {
            loop {
                match subscription.take() {
                    Ok(Some((message, info))) => {
                        let (packet, received) = (message.into(), Instant::now());
                        let sender = hashes.hash_one(info.publisher_gid());
                        take(Delivery::Packet { packet, sender, received });
                    }
                    Ok(None) => break,
                    Err(error) => {
                        take(Delivery::Malformed { topic, words: error.to_string() });
                        break;
                    }
                }
            }
        }));
        Ok(())
    }

    fn serve(&mut self, service: Service) -> Result<(), InputError> {
        let name = service.name(self.topics.namespace());
        let path = Name::parse(&name).map_err(cannot_open(&name))?;
        // The client's vendor is not known in advance: the default mapping, unless set.
        let mapping = mapping(self.mapping, [0, 0]);
        let mut server = self
            .node
            .create_server(mapping, &path, &trigger(), reliable(), reliable())
            .map_err(cannot_open(&name))?;
        self.watch(&mut server, &name)?;
        self.servers.push((service, server));
        Ok(())
    }

    /// Returns the client of a service whose server was found.
    fn client(&self, service: &Service) -> Option<&MadeClient> {
        self.clients.iter().find(|(other, _)| other == service)?.1.as_ref()
    }

    /// Creates clients for newly found servers.
    fn look_for_servers(&mut self) {
        let is_open = self.clients.iter().all(|(_, client)| client.is_some());
        if is_open || self.looked.elapsed() < LOOK {
            return;
        }
        self.looked = Instant::now();
        let readers = self.context.domain_participant().discovered_readers();
        for i in 0..self.clients.len() {
            let (service, None) = &self.clients[i] else { continue };
            let name = service.name(self.topics.namespace());
            // Name of the topic of a service's requests, as in rmw.
            let requests = format!("rq{name}Request");
            let is_server = |topic: &str| topic == requests;
            let server =
                readers.iter().find(|one| is_server(&one.subscription_topic_data.topic_name));
            let Some(server) = server else { continue };
            let guid = server.reader_proxy.remote_reader_guid.to_bytes();
            let mapping = mapping(self.mapping, [guid[0], guid[1]]);
            let Ok(path) = Name::parse(&name) else { continue };
            let made = self.node.create_client(mapping, &path, &trigger(), reliable(), reliable());
            // If it fails, the server stays unfound, and the caller's timeout reports it.
            let Ok(mut client) = made else { continue };
            if self.watch(&mut client, &name).is_ok() {
                self.clients[i].1 = Some((client, Instant::now()));
            }
        }
    }

    /// Registers `source` with the poll.
    fn watch(&self, source: &mut impl mio1::event::Source, name: &str) -> Result<(), InputError> {
        let token = Token(WAKE.0 + 1);
        self.poll.registry().register(source, token, Interest::READABLE).map_err(cannot_open(name))
    }
}

fn trigger() -> ServiceTypeName {
    ServiceTypeName::new("std_srvs", "Trigger")
}

/// Returns the mapping of a service for a server of this vendor.
fn mapping(kind: MappingKind, vendor: [u8; 2]) -> ServiceMapping {
    match kind {
        MappingKind::Cyclone => ServiceMapping::Cyclone,
        MappingKind::Auto if vendor == CYCLONE => ServiceMapping::Cyclone,
        MappingKind::Basic => ServiceMapping::Basic,
        MappingKind::Enhanced | MappingKind::Auto => ServiceMapping::Enhanced,
    }
}

impl Transport for Ros2 {
    fn waker(&self) -> Waker {
        let waker = Arc::clone(&self.waker);
        Arc::new(move || {
            let _ = waker.wake();
        })
    }

    fn send(&mut self, packet: &Packet) -> Result<(), InputError> {
        let sent = self.writers.iter().find_map(|writer| writer(packet));
        let sent = sent.unwrap_or(Err("this side does not publish the topic".into()));
        sent.map_err(|words| cannot_send(&self.topics.name(packet.topic()), words))
    }

    fn receive(&mut self, timeout: Duration, take: &mut dyn FnMut(Delivery)) {
        // Interruptions of a wait are ignored.
        let _ = self.poll.poll(&mut self.events, Some(timeout));
        self.readers.iter().for_each(|reader| reader(take));
        for (service, server) in &self.servers {
            while let Ok(Some((id, _))) = server.receive_request() {
                self.call_count += 1;
                self.calls.insert(self.call_count, id);
                take(Delivery::Call { service: service.clone(), call: self.call_count });
            }
        }
        self.look_for_servers();
        for (service, open) in &self.clients {
            let Some((client, _)) = open else { continue };
            while let Ok(Some((_, answer))) = client.receive_response() {
                take(Delivery::Response { service: service.clone(), answer });
            }
        }
    }

    fn publisher_count(&self, topic: Topic) -> usize {
        self.node.publisher_count(&self.topics.name(topic))
    }

    fn is_served(&mut self, service: &Service) -> bool {
        self.client(service).is_some_and(|(_, since)| since.elapsed() > SETTLE)
    }

    fn call(&mut self, service: &Service) -> Result<(), InputError> {
        let name = service.name(self.topics.namespace());
        let (client, _) =
            self.client(service).ok_or_else(|| cannot_send(&name, "no server found"))?;
        let sent = client.send_request(TriggerRequest::default());
        sent.map(drop).map_err(|error| cannot_send(&name, error))
    }

    fn answer(
        &mut self,
        service: &Service,
        call: u64,
        answer: TriggerResponse,
    ) -> Result<(), InputError> {
        let name = service.name(self.topics.namespace());
        let server = self.servers.iter().find(|(other, _)| other == service);
        let (Some((_, server)), Some(id)) = (server, self.calls.remove(&call)) else {
            return Err(cannot_send(&name, "the call is unknown or already answered"));
        };
        server.send_response(id, answer).map_err(|error| cannot_send(&name, error))
    }
}
