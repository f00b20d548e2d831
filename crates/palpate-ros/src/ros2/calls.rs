//! Clients and servers of the services, each with the types of its messages.

use super::endpoint::{reliable, watch};
use crate::control_message::{
    ControllerState, ControllerStateHumble, ListControllersHumbleResponse, ListControllersRequest,
    ListControllersResponse, SwitchControllerHumbleRequest, SwitchControllerHumbleResponse,
    SwitchControllerRequest, SwitchControllerResponse,
};
use crate::controllers::{Controller, STATES, Switch};
use crate::driver::Release;
use crate::message::{Duration, TriggerRequest, TriggerResponse};
use crate::service::{Answer, Service};
use crate::transport::cannot_open;
use palpate_input::error::InputError;
use ros2_client::request_id::RmwRequestId;
use ros2_client::{Client, Message, Name, Node, Server, ServiceMapping, ServiceTypeName};
use rustdds::mio1::Poll;
use serde::{Deserialize, Serialize};
use std::cell::RefCell;
use std::collections::HashMap;
use std::marker::PhantomData;
use std::rc::Rc;
use std::time::Instant;

/// A type of request, and that of its response.
pub(super) trait Request: Message + Default + Clone + 'static {
    /// Type of the response.
    type Response: Response;

    /// Returns the request that calls `service`.
    fn of(service: &Service) -> Self;

    /// Returns the call of a server of `service` by this request.
    fn call(self, service: &Service) -> Service;
}

/// A type of response.
pub(super) trait Response: Message + Clone + 'static {
    /// Returns the response that contains `answer`.
    fn of(answer: &Answer) -> Self;

    /// Returns the answer that it contains.
    fn answer(self) -> Answer;
}

impl Message for TriggerRequest {}
impl Message for TriggerResponse {}
impl Message for SwitchControllerRequest {}
impl Message for SwitchControllerResponse {}
impl Message for SwitchControllerHumbleRequest {}
impl Message for SwitchControllerHumbleResponse {}
impl Message for ListControllersResponse {}
impl Message for ListControllersHumbleResponse {}

/// Request to list controllers, with the response of a release.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub(super) struct ListRequest<R> {
    message: ListControllersRequest,
    response: PhantomData<R>,
}

impl<R> Message for ListRequest<R> {}

impl<R: Response + Default> Request for ListRequest<R> {
    type Response = R;

    fn of(_: &Service) -> Self {
        Self::default()
    }

    fn call(self, _: &Service) -> Service {
        Service::ListControllers
    }
}

impl Request for TriggerRequest {
    type Response = TriggerResponse;

    fn of(_: &Service) -> Self {
        Self::default()
    }

    fn call(self, service: &Service) -> Service {
        service.clone()
    }
}

impl Response for TriggerResponse {
    fn of(answer: &Answer) -> Self {
        Self { success: answer.success, message: answer.message.clone() }
    }

    fn answer(self) -> Answer {
        Answer { success: self.success, message: self.message, ..Answer::default() }
    }
}

/// Implements the responses of a release that list controllers.
macro_rules! list_response {
    ($response:ident of $state:ident) => {
        impl Response for $response {
            fn of(answer: &Answer) -> Self {
                let state = |one: &Controller| $state {
                    name: one.name.clone(),
                    state: one.state.clone(),
                    r#type: one.kind.clone(),
                    claimed_interfaces: one.claimed.clone(),
                    ..$state::default()
                };
                Self { controller: answer.controllers.iter().map(state).collect() }
            }

            fn answer(self) -> Answer {
                listed(self.controller.into_iter().map(|one| Controller {
                    name: one.name,
                    state: one.state,
                    kind: one.r#type,
                    claimed: one.claimed_interfaces,
                }))
            }
        }
    };
}

list_response!(ListControllersResponse of ControllerState);
list_response!(ListControllersHumbleResponse of ControllerStateHumble);

/// Returns the answer with these controllers, unless they cannot be some: another release lays
/// them out differently.
fn listed(controllers: impl Iterator<Item = Controller>) -> Answer {
    let controllers: Vec<Controller> = controllers.collect();
    let is_one = |one: &Controller| !one.name.is_empty() && STATES.contains(&one.state.as_str());
    match controllers.iter().all(is_one) {
        true => Answer { success: true, controllers, ..Answer::default() },
        false => Answer::refused(OTHER_RELEASE),
    }
}

/// Remedy of an answer with another layout.
const OTHER_RELEASE: &str = "its answer cannot be read; set backend.ros2.release to the release of ROS 2 on \
                             the driver's computer";

/// Strictness of a switch: as far as possible, or all or none.
const STRICTNESS: [i32; 2] = [1, 2];

/// Timeout of a switch.
// heuristic: many cycles of the controller manager.
const TIMEOUT: Duration = Duration { sec: 2, nanosec: 0 };

fn switch_of(service: &Service) -> Switch {
    match service {
        Service::SwitchController(switch) => switch.clone(),
        _ => Switch::default(),
    }
}

impl Request for SwitchControllerRequest {
    type Response = SwitchControllerResponse;

    fn of(service: &Service) -> Self {
        let Switch { activate, deactivate, is_strict } = switch_of(service);
        Self {
            activate_controllers: activate,
            deactivate_controllers: deactivate,
            strictness: STRICTNESS[usize::from(is_strict)],
            activate_asap: true,
            timeout: TIMEOUT,
        }
    }

    fn call(self, _: &Service) -> Service {
        Service::SwitchController(Switch {
            activate: self.activate_controllers,
            deactivate: self.deactivate_controllers,
            is_strict: self.strictness == STRICTNESS[1],
        })
    }
}

impl Response for SwitchControllerResponse {
    fn of(answer: &Answer) -> Self {
        Self { ok: answer.success, message: answer.message.clone() }
    }

    fn answer(self) -> Answer {
        Answer { success: self.ok, message: self.message, ..Answer::default() }
    }
}

impl Request for SwitchControllerHumbleRequest {
    type Response = SwitchControllerHumbleResponse;

    fn of(service: &Service) -> Self {
        let request = SwitchControllerRequest::of(service);
        Self {
            activate_controllers: request.activate_controllers,
            deactivate_controllers: request.deactivate_controllers,
            strictness: request.strictness,
            activate_asap: request.activate_asap,
            timeout: request.timeout,
            ..Self::default()
        }
    }

    fn call(self, _: &Service) -> Service {
        // The former names of both lists count too.
        Service::SwitchController(Switch {
            activate: [self.activate_controllers, self.start_controllers].concat(),
            deactivate: [self.deactivate_controllers, self.stop_controllers].concat(),
            is_strict: self.strictness == STRICTNESS[1],
        })
    }
}

impl Response for SwitchControllerHumbleResponse {
    fn of(answer: &Answer) -> Self {
        Self { ok: answer.success }
    }

    fn answer(self) -> Answer {
        match self.ok {
            true => Answer { success: true, ..Answer::default() },
            false => Answer::refused("the controller manager refuses; its log has the reason"),
        }
    }
}

fn type_name(service: &Service) -> ServiceTypeName {
    let name = service.type_name();
    let package = name.split('/').next().unwrap_or_default();
    ServiceTypeName::new(package, name.rsplit('/').next().unwrap_or_default())
}

/// A client or a server of a service.
pub(super) trait OpenService: Sized {
    /// Creates one with requests of type `R`.
    ///
    /// # Errors
    /// If it cannot be created.
    fn typed<R: Request>(
        node: &mut Node,
        poll: &Poll,
        mapping: ServiceMapping,
        name: &str,
        service: Service,
    ) -> Result<Self, InputError>;

    /// Creates one for calls of the kind of `service`, as laid out in `release`.
    ///
    /// # Errors
    /// If it cannot be created.
    fn open(
        node: &mut Node,
        poll: &Poll,
        mapping: ServiceMapping,
        name: &str,
        service: Service,
        release: Release,
    ) -> Result<Self, InputError> {
        let typed = match (&service, release) {
            (Service::SwitchController(_), Release::Humble) => {
                Self::typed::<SwitchControllerHumbleRequest>
            }
            (Service::SwitchController(_), _) => Self::typed::<SwitchControllerRequest>,
            (Service::ListControllers, Release::Humble) => {
                Self::typed::<ListRequest<ListControllersHumbleResponse>>
            }
            (Service::ListControllers, _) => Self::typed::<ListRequest<ListControllersResponse>>,
            _ => Self::typed::<TriggerRequest>,
        };
        typed(node, poll, mapping, name, service)
    }
}

/// Sends a request that calls a service.
type Send = Box<dyn Fn(&Service) -> Result<(), String>>;
/// Sends the response to a request.
type Respond = Box<dyn Fn(RmwRequestId, &Answer) -> Result<(), String>>;

/// A client of a service.
pub(super) struct ServiceClient {
    send: Send,
    take: Box<dyn Fn() -> Option<Answer>>,
    /// Last call, which the next response answers.
    called: RefCell<Service>,
    /// Time of creation.
    pub(super) since: Instant,
}

impl OpenService for ServiceClient {
    fn typed<R: Request>(
        node: &mut Node,
        poll: &Poll,
        mapping: ServiceMapping,
        name: &str,
        service: Service,
    ) -> Result<Self, InputError> {
        let path = Name::parse(name).map_err(cannot_open(name))?;
        let mut client: Client<R, R::Response> = node
            .create_client(mapping, &path, &type_name(&service), reliable(), reliable())
            .map_err(cannot_open(name))?;
        watch(poll, &mut client, name)?;
        let is_of_release = service.depends_on_release();
        let client = Rc::new(client);
        let responses = Rc::clone(&client);
        Ok(Self {
            send: Box::new(move |service| {
                let sent = client.send_request(R::of(service));
                sent.map(drop).map_err(|error| error.to_string())
            }),
            take: Box::new(move || match responses.receive_response() {
                Ok(response) => response.map(|(_, response)| response.answer()),
                // Of other types, it may be the answer to another client.
                Err(_) => is_of_release.then(|| Answer::refused(OTHER_RELEASE)),
            }),
            called: RefCell::new(service),
            since: Instant::now(),
        })
    }
}

impl ServiceClient {
    /// Sends a request.
    pub(super) fn send(&self, service: &Service) -> Result<(), String> {
        self.called.replace(service.clone());
        (self.send)(service)
    }

    /// Returns the next received response, with the call that it answers.
    pub(super) fn take(&self) -> Option<(Service, Answer)> {
        (self.take)().map(|answer| (self.called.borrow().clone(), answer))
    }
}

/// Receives the next request; an outer `None` ends the queue, an inner one is a request without
/// this mapping.
type Receive = Box<dyn Fn() -> Option<Option<(RmwRequestId, Service)>>>;

/// Vendor id of Eclipse Cyclone DDS in the first two bytes of a GUID (RTPS 2.5, section 9.3.1.3;
/// list of vendors of the DDS Foundation).
pub(super) const CYCLONE: [u8; 2] = [0x01, 0x10];

/// Vendors of the clients that a server answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Clients {
    /// All vendors.
    All,
    /// Eclipse Cyclone DDS.
    Cyclone,
    /// All but Eclipse Cyclone DDS.
    Others,
}

impl Clients {
    /// Whether the client with this request is one of them.
    fn contains(self, id: &RmwRequestId) -> bool {
        let is_cyclone = id.writer_gid.to_bytes16().starts_with(&CYCLONE);
        match self {
            Self::All => true,
            Self::Cyclone => is_cyclone,
            Self::Others => !is_cyclone,
        }
    }
}

/// A server of a service.
pub(super) struct ServiceServer {
    receive: Receive,
    answer: Respond,
    clients: Clients,
    /// Calls that wait for their answers.
    calls: HashMap<u64, RmwRequestId>,
}

/// Largest number of requests that are read at once.
// heuristic: more than wait in the queue of a reader.
const REQUESTS_MAX: usize = 256;

impl OpenService for ServiceServer {
    fn typed<R: Request>(
        node: &mut Node,
        poll: &Poll,
        mapping: ServiceMapping,
        name: &str,
        service: Service,
    ) -> Result<Self, InputError> {
        let path = Name::parse(name).map_err(cannot_open(name))?;
        let mut server: Server<R, R::Response> = node
            .create_server(mapping, &path, &type_name(&service), reliable(), reliable())
            .map_err(cannot_open(name))?;
        watch(poll, &mut server, name)?;
        let server = Rc::new(server);
        let requests = Rc::clone(&server);
        Ok(Self {
            receive: Box::new(move || match requests.receive_request() {
                Ok(None) => None,
                Ok(Some((id, request))) => Some(Some((id, request.call(&service)))),
                Err(_) => Some(None),
            }),
            answer: Box::new(move |id, answer| {
                server.send_response(id, R::Response::of(answer)).map_err(|error| error.to_string())
            }),
            clients: Clients::All,
            calls: HashMap::new(),
        })
    }
}

impl ServiceServer {
    /// Restricts the server to these clients: those of its mapping, where several servers of a
    /// service receive each request.
    pub(super) fn of(self, clients: Clients) -> Self {
        Self { clients, ..self }
    }

    /// Returns the next received call, to be answered under the number `call`.
    pub(super) fn take(&mut self, call: u64) -> Option<Service> {
        for _ in 0..REQUESTS_MAX {
            // A request that another mapping encoded may be unreadable, or read wrongly.
            let Some((id, service)) = (self.receive)()? else { continue };
            if self.clients.contains(&id) {
                self.calls.insert(call, id);
                return Some(service);
            }
        }
        None
    }

    /// Answers a call; returns `None` if it is none of this server.
    pub(super) fn answer(&mut self, call: u64, answer: &Answer) -> Option<Result<(), String>> {
        self.calls.remove(&call).map(|id| (self.answer)(id, answer))
    }
}
