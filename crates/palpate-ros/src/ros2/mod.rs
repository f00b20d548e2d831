//! ROS 2 transport by RustDDS, without an installation of ROS.

mod calls;
pub mod camera;
mod endpoint;

use crate::control_message::{Clock, GoalStatusArray, RobotDescription};
use crate::definition::HasDefinition;
use crate::franka_message::FrankaRobotState;
use crate::message::{
    BioTacHand, BiotacAll, Bool, DiagnosticArray, Float64, Float64MultiArray, Image, JointState,
    JointTrajectory, RobotMode, SafetyMode, Touching, WrenchStamped,
};
use crate::network::network;
use crate::planning_scene::CollisionObject;
use crate::service::{Answer, Service};
use crate::settings::{MappingKind, RosSettings};
use crate::topics::{CommandMessage, Endpoint, TactileMessage, Topic};
use crate::transport::{
    Delivery, Packet, PacketMessage, Publisher, Transport, Waker, cannot_open, cannot_send,
};
use crate::view::{MarkerArray, PointCloud2, TFMessage};
use calls::{CYCLONE, Clients, OpenService as _, ServiceClient, ServiceServer};
use endpoint::{WAKE, best_effort, kept, latched, reliable, watch};
use palpate_input::error::InputError;
use ros2_client::{
    Context, MessageTypeName, Name, Node, NodeName, NodeOptions, QosProfile, ServiceMapping,
};
use rustdds::DomainParticipantBuilder;
use rustdds::discovery::DiscoveredWriterData;
use rustdds::mio1;
use rustdds::mio1::{Events, Poll};
use rustdds::policy::{Durability, Reliability};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::hash::{BuildHasher, BuildHasherDefault, DefaultHasher};
use std::net::IpAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Passes on the messages received on a topic.
type Reader = Box<dyn Fn(&mut dyn FnMut(Delivery))>;
/// Publishes a packet if its topic and type match.
type Writer = Box<dyn Fn(&Packet) -> Option<Result<(), String>>>;
/// One side in a ROS 2 network.
pub struct Ros2 {
    context: Context,
    node: Node,
    settings: RosSettings,
    side: Endpoint,
    poll: Poll,
    events: Events,
    waker: Arc<mio1::Waker>,
    readers: Vec<Reader>,
    writers: Vec<Writer>,
    /// Whether the explorer's publisher of commands exists.
    has_commands: bool,
    /// Services with their clients, once servers are found.
    clients: Vec<(Service, Option<ServiceClient>)>,
    /// Time of the last search for servers.
    looked: Instant,
    servers: Vec<ServiceServer>,
    call_count: u64,
}

/// Interval of the search for servers.
const LOOK: Duration = Duration::from_millis(50);

/// Delay from the creation of a client until its server knows it, so that a request is not lost.
// heuristic: several exchanges of endpoint discovery on a local network.
const SETTLE: Duration = Duration::from_millis(200);

/// Returns the network interfaces of this machine with their IPv4 addresses.
fn interfaces() -> Vec<(String, Vec<IpAddr>)> {
    let addresses =
        |one: &netdev::Interface| one.ipv4.iter().map(|net| net.addr().into()).collect();
    netdev::get_interfaces().into_iter().map(|one| (one.name.clone(), addresses(&one))).collect()
}

/// Opens a node of this name in the network of `settings`.
fn open_node(settings: &RosSettings, name: &str) -> Result<(Context, Node), InputError> {
    let (domain, addresses) = network(settings, |name| std::env::var(name).ok(), &interfaces())
        .map_err(cannot_open("the network"))?;
    let mut participant = DomainParticipantBuilder::new(domain);
    if let Some(addresses) = addresses {
        participant = participant.with_only_networks(addresses);
    }
    let participant = participant.build().map_err(cannot_open("a DDS participant"))?;
    let context =
        Context::from_domain_participant(participant).map_err(cannot_open("a DDS participant"))?;
    let name = NodeName::new("/palpate", name).map_err(cannot_open("a node"))?;
    let options = NodeOptions::new().start_parameter_services(false);
    let node = context.new_node(name, options).map_err(cannot_open("a node"))?;
    Ok((context, node))
}

impl Ros2 {
    /// Opens one side of the arm of `settings`; `services` are those that are called or served.
    ///
    /// # Errors
    /// If the network cannot be joined.
    pub fn open(
        settings: &RosSettings,
        side: Endpoint,
        services: Vec<Service>,
    ) -> Result<Self, InputError> {
        let (context, node) = open_node(
            settings,
            match side {
                Endpoint::Explorer => "explorer",
                Endpoint::Arm => "arm",
            },
        )?;
        let poll = Poll::new().map_err(cannot_open("a poll"))?;
        let waker = mio1::Waker::new(poll.registry(), WAKE).map_err(cannot_open("a waker"))?;
        let mut end = Self {
            context,
            node,
            settings: settings.clone(),
            side,
            poll,
            events: Events::with_capacity(64),
            waker: Arc::new(waker),
            readers: Vec::new(),
            writers: Vec::new(),
            has_commands: side == Endpoint::Arm,
            clients: Vec::new(),
            looked: Instant::now(),
            servers: Vec::new(),
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
        let tactile = self.settings.topics.tactile.message;
        let settings = self.settings.clone();
        for topic in settings.topics_of_arm().chain(settings.further_topics()) {
            match topic {
                Topic::Joints => self.topic::<JointState>(topic)?,
                Topic::Wrench => self.topic::<WrenchStamped>(topic)?,
                Topic::Tactile => match tactile {
                    TactileMessage::Fingers => self.topic::<BiotacAll>(topic)?,
                    TactileMessage::Hand => self.topic::<BioTacHand>(topic)?,
                    TactileMessage::Flag => self.topic::<Touching>(topic)?,
                    TactileMessage::Depth => self.topic::<Image>(topic)?,
                    TactileMessage::None => (),
                },
                Topic::Status => {
                    self.topic::<DiagnosticArray>(topic)?;
                    if self.side == Endpoint::Explorer {
                        // A status that is published on change may have been published before
                        // this side started.
                        self.subscribe::<DiagnosticArray>(topic, latched())?;
                    }
                }
                Topic::RobotMode => self.topic::<RobotMode>(topic)?,
                Topic::SafetyMode => self.topic::<SafetyMode>(topic)?,
                Topic::ProgramRunning => self.topic::<Bool>(topic)?,
                Topic::SpeedScaling => self.topic::<Float64>(topic)?,
                Topic::FrankaState => self.topic::<FrankaRobotState>(topic)?,
                Topic::Transforms => self.topic::<TFMessage>(topic)?,
                Topic::FixedTransforms => self.topic::<TFMessage>(topic)?,
                Topic::Goals => self.topic::<GoalStatusArray>(topic)?,
                Topic::Description => self.topic::<RobotDescription>(topic)?,
                Topic::Clock => self.topic::<Clock>(topic)?,
                Topic::Command | Topic::Markers | Topic::Points => (),
                Topic::Frames | Topic::CollisionObject => (),
            }
        }
        if self.side == Endpoint::Explorer {
            self.topic::<MarkerArray>(Topic::Markers)?;
            self.topic::<PointCloud2>(Topic::Points)?;
            if settings.topics.collision_object.is_some() {
                self.topic::<CollisionObject>(Topic::CollisionObject)?;
            }
            return self.topic::<TFMessage>(Topic::Frames);
        }
        self.commands()
    }

    /// Creates the topic of commands.
    fn commands(&mut self) -> Result<(), InputError> {
        match self.settings.topics.command.message {
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
        let is_kept = topic != Topic::Status && self.settings.is_on_change(topic);
        if topic.publisher() != self.side {
            return self.subscribe::<M>(topic, if is_kept { latched() } else { best_effort() });
        }
        let qos = match is_kept {
            // Object and table, one message each.
            true if topic == Topic::CollisionObject => kept(2),
            true => kept(1),
            false => reliable(),
        };
        let (name, dds) = self.dds_topic::<M>(topic, &qos)?;
        let publisher =
            self.node.create_publisher::<M>(&dds, Some(qos)).map_err(cannot_open(&name))?;
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
        let name = self.settings.topics.name(topic);
        let dds = dds_topic::<M>(&mut self.node, &name, qos)?;
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
        watch(&self.poll, &mut subscription, &name)?;
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
        let name = self.service_name(&service);
        let kind = self.settings.service_mapping;
        // A client's vendor is not known in advance: one server for each default mapping.
        let clients = match kind {
            MappingKind::Auto => &[Clients::Others, Clients::Cyclone][..],
            _ => &[Clients::All],
        };
        for &clients in clients {
            let vendor = if clients == Clients::Cyclone { CYCLONE } else { [0, 0] };
            let (mapping, release) = (mapping(kind, vendor), self.settings.release);
            let (node, poll, service) = (&mut self.node, &self.poll, service.clone());
            let server = ServiceServer::open(node, poll, mapping, &name, service, release)?;
            self.servers.push(server.of(clients));
        }
        Ok(())
    }

    fn service_name(&self, service: &Service) -> String {
        service.name(self.settings.topics.namespace())
    }

    /// Returns the client of a service whose server was found.
    fn client(&mut self, service: &Service) -> Option<&mut ServiceClient> {
        let name = self.service_name(service);
        let namespace = self.settings.topics.namespace();
        let mut found = self.clients.iter_mut();
        found.find(|(other, _)| other.name(namespace) == name)?.1.as_mut()
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
            let name = self.service_name(service);
            // Name of the topic of a service's requests, as in rmw.
            let requests = format!("rq{name}Request");
            let is_server = |topic: &str| topic == requests;
            let server =
                readers.iter().find(|one| is_server(&one.subscription_topic_data.topic_name));
            let Some(server) = server else { continue };
            let guid = server.reader_proxy.remote_reader_guid.to_bytes();
            let mapping = mapping(self.settings.service_mapping, [guid[0], guid[1]]);
            let (service, release) = (service.clone(), self.settings.release);
            let (node, poll) = (&mut self.node, &self.poll);
            // If it fails, the server stays unfound, and the caller's timeout reports it.
            self.clients[i].1 =
                ServiceClient::open(node, poll, mapping, &name, service, release).ok();
        }
    }
}

/// Creates the DDS topic of messages of type `M` under this name.
fn dds_topic<M: HasDefinition>(
    node: &mut Node,
    name: &str,
    qos: &QosProfile,
) -> Result<rustdds::Topic, InputError> {
    let type_name = MessageTypeName::new(M::DEFINITION.package(), M::DEFINITION.short_name());
    let path = Name::parse(name).map_err(cannot_open(name))?;
    node.create_topic(&path, type_name, qos).map_err(cannot_open(name))
}

/// Returns the name of a type in ROS: `a::msg::dds_::B_` of DDS is `a/msg/B`.
fn ros_type(name: &str) -> String {
    name.replace("::dds_::", "::").trim_end_matches('_').replace("::", "/")
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
        sent.map_err(|words| cannot_send(&self.settings.topics.name(packet.topic()), words))
    }

    fn receive(&mut self, timeout: Duration, take: &mut dyn FnMut(Delivery)) {
        // Interruptions of a wait are ignored.
        let _ = self.poll.poll(&mut self.events, Some(timeout));
        self.readers.iter().for_each(|reader| reader(take));
        for server in &mut self.servers {
            while let Some(service) = server.take(self.call_count + 1) {
                self.call_count += 1;
                take(Delivery::Call { service, call: self.call_count });
            }
        }
        self.look_for_servers();
        for client in self.clients.iter().filter_map(|(_, client)| client.as_ref()) {
            while let Some((service, answer)) = client.take() {
                take(Delivery::Response { service, answer });
            }
        }
    }

    fn publisher_count(&self, topic: Topic) -> usize {
        self.node.publisher_count(&self.settings.topics.name(topic))
    }

    fn publishers(&self) -> Vec<Publisher> {
        let writers = self.context.domain_participant().discovered_writers();
        let publisher = |writer: &DiscoveredWriterData| {
            let about = &writer.publication_topic_data;
            Some(Publisher {
                topic: about.topic_name.strip_prefix("rt")?.to_owned(),
                type_name: ros_type(&about.type_name),
                // A writer that announces nothing is reliable (DDS 1.4, section 2.2.3).
                is_reliable: !matches!(about.reliability, Some(Reliability::BestEffort)),
                is_kept: !matches!(about.durability, None | Some(Durability::Volatile)),
            })
        };
        writers.iter().filter_map(publisher).collect()
    }

    fn subscriber_count(&self, topic: Topic) -> usize {
        self.node.subscription_count(&self.settings.topics.name(topic))
    }

    fn open_commands(&mut self) -> Result<(), InputError> {
        match std::mem::replace(&mut self.has_commands, true) {
            true => Ok(()),
            false => self.commands(),
        }
    }

    fn is_served(&mut self, service: &Service) -> bool {
        self.client(service).is_some_and(|client| client.since.elapsed() > SETTLE)
    }

    fn call(&mut self, service: &Service) -> Result<(), InputError> {
        let name = self.service_name(service);
        let client = self.client(service).ok_or_else(|| cannot_send(&name, "no server found"))?;
        client.send(service).map_err(|words| cannot_send(&name, words))
    }

    fn answer(&mut self, service: &Service, call: u64, answer: Answer) -> Result<(), InputError> {
        let name = self.service_name(service);
        let mut servers = self.servers.iter_mut();
        let sent = servers.find_map(|server| server.answer(call, &answer));
        let sent = sent.unwrap_or(Err("the call is unknown or already answered".into()));
        sent.map_err(|words| cannot_send(&name, words))
    }
}
