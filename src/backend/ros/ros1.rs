//! ROS 1, by roslibrust: for labs whose drivers are of that age.
//!
//! Its messages are those of ROS 2 but for the header, which counts too.

use super::master::publisher_count;
use super::message::{
    BioTacHand, BiotacAll, Described, DiagnosticArray, Float64MultiArray, Header, JointState,
    JointTrajectory, Time, WrenchStamped,
};
use super::packet::Packet;
use super::service::{Answer, Service};
use super::settings::BackendSettings;
use super::topics::{Side, Topic, Topics};
use super::transport::{Delivery, Transport, TransportError, Waker};
use roslibrust::ros1::{NodeHandle, Publisher, ServiceServer};
use roslibrust::{MessageDescriptor, RosMessageType, RosServiceType};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tokio::runtime::Runtime;

/// Messages that wait in a reader or writer; chosen, more than come while a thread is held up.
const QUEUE: usize = 64;

/// How long an answer to a call from outside is waited for; chosen.
const ANSWER: Duration = Duration::from_millis(500);

/// A header as ROS 1 sends it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Counted {
    /// Consecutive number.
    seq: u32,
    /// When.
    stamp: Time,
    /// In which frame.
    frame_id: String,
}

impl From<Header> for Counted {
    fn from(Header { stamp, frame_id }: Header) -> Self {
        Self { seq: 0, stamp, frame_id }
    }
}

impl From<Counted> for Header {
    fn from(Counted { stamp, frame_id, .. }: Counted) -> Self {
        Self { stamp, frame_id }
    }
}

/// The type of a message in ROS 1, with the MD5 sum of its definition (genmsg).
macro_rules! ros1 {
    ($type:ty, $name:expr, $md5:expr) => {
        impl RosMessageType for $type {
            const DESCRIPTION: MessageDescriptor = MessageDescriptor::new::<Self>(
                $name,
                $md5,
                <$type as Described>::DEFINITION.fields,
                "",
                &[0; 32],
            );
        }
    };
}

ros1!(JointState<Counted>, "sensor_msgs/JointState", "3066dcd76a6cfaef579bd0f34173e9fd");
ros1!(WrenchStamped<Counted>, "geometry_msgs/WrenchStamped", "d78d3cb249ce23087ade7e7d0c40cfa7");
ros1!(BioTacHand<Counted>, "biotac_sensors/BioTacHand", "d96f900cbfb096d61de125081e11dcab");
ros1!(BiotacAll<Counted>, "sr_robot_msgs/BiotacAll", "0022d8afb0897596a0c41f523836ee37");
ros1!(
    DiagnosticArray<Counted>,
    "diagnostic_msgs/DiagnosticArray",
    "60810da900de1dd6ddd437c3503511da"
);
ros1!(
    JointTrajectory<Counted>,
    "trajectory_msgs/JointTrajectory",
    "65b4f94a94d1ed67169da35a02f33d3f"
);
ros1!(Float64MultiArray, "std_msgs/Float64MultiArray", "4b7d974086d4060e7db4613a7e6c3ba4");

impl RosMessageType for Counted {
    const DESCRIPTION: MessageDescriptor = MessageDescriptor::new::<Self>(
        "std_msgs/Header",
        "2176decaecbce78abc3b96ef049fabed",
        "uint32 seq\ntime stamp\nstring frame_id\n",
        "",
        &[0; 32],
    );
}

/// `std_srvs/Trigger`.
struct Trigger;

/// Its request, which is empty.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Request {}

/// Its response.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Response {
    success: bool,
    message: String,
}

/// MD5 sum of `std_srvs/Trigger` (genmsg).
const TRIGGER_MD5: &str = "937c9679a518e3a18d831e57125ea522";

impl RosMessageType for Request {
    const DESCRIPTION: MessageDescriptor =
        MessageDescriptor::new::<Self>("std_srvs/TriggerRequest", TRIGGER_MD5, "", "", &[0; 32]);
}

impl RosMessageType for Response {
    const DESCRIPTION: MessageDescriptor =
        MessageDescriptor::new::<Self>("std_srvs/TriggerResponse", TRIGGER_MD5, "", "", &[0; 32]);
}

impl RosServiceType for Trigger {
    const ROS_SERVICE_NAME: &'static str = "std_srvs/Trigger";
    const MD5SUM: &'static str = TRIGGER_MD5;
    type Request = Request;
    type Response = Response;
}

/// What comes out of the tasks.
enum Item {
    Delivery(Delivery),
    Wake,
}

type Writer = Box<dyn Fn(&Runtime, &Packet) -> Option<Result<(), String>>>;
/// Calls from outside that wait for their answer.
type Waiting = Arc<Mutex<HashMap<u64, Sender<Answer>>>>;

/// One side's end in a ROS 1 network.
pub struct Ros1 {
    runtime: Runtime,
    node: NodeHandle,
    master: String,
    topics: Topics,
    inbox: Receiver<Item>,
    out: Sender<Item>,
    writers: Vec<Writer>,
    /// Kept, for a service ends with it.
    _servers: Vec<ServiceServer>,
    waiting: Waiting,
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
        let name = match side {
            Side::Explorer => "/palpate_explorer",
            Side::Arm => "/palpate_arm",
        };
        let master = settings.master.clone();
        let node = runtime
            .block_on(NodeHandle::new(&master, name))
            .map_err(open(&format!("a node at the master {master}")))?;
        let (out, inbox) = channel();
        let mut end = Self {
            runtime,
            node,
            master,
            topics: settings.topics.clone(),
            inbox,
            out,
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
        self.topic(
            side,
            Topic::Heartbeat,
            |message: Counted| Packet::Heartbeat(message.into()),
            |packet| match packet {
                Packet::Heartbeat(message) => Some(message.clone().into()),
                _ => None,
            },
        )?;
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
        let name = self.topics.line(topic).name.to_owned();
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
        let out = self.out.clone();
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
                if out.send(Item::Delivery(delivery)).is_err() {
                    break;
                }
            }
        });
        Ok(())
    }

    /// A service is answered by the link's loop; the caller's task waits for it.
    fn serve(&mut self, number: usize, service: Service) -> Result<(), TransportError> {
        let name = service.name();
        let (out, waiting) = (Mutex::new(self.out.clone()), Arc::clone(&self.waiting));
        let number = number as u64;
        let answer = move |_: Request| {
            let (sender, answer) = channel();
            waiting.lock().unwrap_or_else(PoisonError::into_inner).insert(number, sender);
            let delivery = Delivery::Call { service: service.clone(), call: number };
            let _ =
                out.lock().unwrap_or_else(PoisonError::into_inner).send(Item::Delivery(delivery));
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
        let wake = Mutex::new(self.out.clone());
        Arc::new(move || {
            let _ = wake.lock().unwrap_or_else(PoisonError::into_inner).send(Item::Wake);
        })
    }

    fn send(&mut self, packet: &Packet) -> Result<(), TransportError> {
        let sent = self.writers.iter().find_map(|writer| writer(&self.runtime, packet));
        let words = match sent {
            Some(Ok(())) => return Ok(()),
            Some(Err(words)) => words,
            None => "not this side's".into(),
        };
        let what = self.topics.line(packet.topic()).name.to_owned();
        Err(TransportError::Send { what, words })
    }

    fn receive(&mut self, timeout: Duration, take: &mut dyn FnMut(Delivery)) {
        let mut next = self.inbox.recv_timeout(timeout);
        loop {
            match next {
                Ok(Item::Delivery(delivery)) => take(delivery),
                Ok(Item::Wake) => (),
                Err(_) => break,
            }
            next = self.inbox.try_recv().map_err(|_| RecvTimeoutError::Timeout);
        }
    }

    fn publisher_count(&self, topic: Topic) -> usize {
        publisher_count(&self.master, self.topics.line(topic).name).unwrap_or(0)
    }

    fn call(&mut self, service: &Service) -> Result<(), TransportError> {
        let (node, out, service) = (self.node.clone(), self.out.clone(), service.clone());
        self.runtime.spawn(async move {
            let answer = match node.service_client::<Trigger>(&service.name()).await {
                Ok(client) => match client.call(&Request {}).await {
                    Ok(Response { success, message }) => {
                        Answer { is_done: success, words: message }
                    }
                    Err(error) => Answer { is_done: false, words: error.to_string() },
                },
                Err(error) => Answer { is_done: false, words: error.to_string() },
            };
            let _ = out.send(Item::Delivery(Delivery::Answered { service, answer }));
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
            _ => Err(TransportError::Send { what: service.name(), words: "no call".into() }),
        }
    }
}

/// A message with the header of the one system and of the other.
macro_rules! headed {
    ($in:ident, $out:ident, $type:ident, $packet:ident, { $($field:ident),* }) => {
        fn $in(message: $type<Counted>) -> Packet {
            let $type { header, $($field),* } = message;
            Packet::$packet($type { header: header.into(), $($field),* }.into())
        }

        fn $out(message: $type) -> $type<Counted> {
            let $type { header, $($field),* } = message;
            $type { header: header.into(), $($field),* }
        }
    };
}

headed!(joints_in, joints_out, JointState, Joints, { name, position, velocity, effort });
headed!(wrench_in, wrench_out, WrenchStamped, Wrench, { wrench });
headed!(hand_in, hand_out, BioTacHand, Hand, { hand_id, bt_data, bt_time });
headed!(fingers_in, fingers_out, BiotacAll, Fingers, { tactiles });
headed!(status_in, status_out, DiagnosticArray, Status, { status });
headed!(command_in, command_out, JointTrajectory, Command, { joint_names, points });
