//! Web server of the live page.
//!
//! It runs in its own thread and only reads the desk, so that no trial waits for a viewer. A viewer
//! that stops reading is dropped.

use super::desk::Desk;
use super::guard::{Access, Passage};
use super::order::Order;
use super::picture::{self, BeliefView, Picture, Shown};
use crate::experiment::metrics::truth::Truth;
use crate::report::canvas::escape;
use crate::report::explorer::{self, choice};
use crate::report::html;
use anyhow::Context;
use http_body_util::channel::Channel;
use http_body_util::combinators::BoxBody;
use http_body_util::{BodyExt, Full, Limited};
use hyper::body::{Bytes, Frame, Incoming};
use hyper::header::{
    CACHE_CONTROL, CONTENT_LENGTH, CONTENT_SECURITY_POLICY, CONTENT_TYPE, HeaderName, HeaderValue,
    LOCATION, REFERRER_POLICY, SET_COOKIE, X_CONTENT_TYPE_OPTIONS, X_FRAME_OPTIONS,
};
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper::{Method, Request, Response, StatusCode};
use hyper_util::rt::{TokioIo, TokioTimer};
use palpate_input::error::InputError;
use palpate_input::files::bytes_below;
use serde::Deserialize;
use serde_json::{Value, json};
use socket2::SockRef;
use std::convert::Infallible;
use std::net::SocketAddr;
use std::path::Path;
use std::sync::{Arc, OnceLock, PoisonError, RwLock};
use std::time::Duration;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;
use tokio::task::AbortHandle;
use tokio::time::{sleep, timeout};

/// Largest number of open connections; a page keeps about two.
const CONNECTIONS: usize = 64;

/// Largest body of an order, and of a mesh.
const ORDER_BYTES: usize = 64 << 10;
const MESH_BYTES: usize = 64 << 20;

/// Size of the operating system's buffer of a connection.
const SEND_BUFFER_BYTES: usize = 64 << 10;

/// Largest file of a run that a viewer may read.
const FILE_BYTES: u64 = 256 << 20;

/// Time for a request to arrive, and for a viewer to read an event.
const ARRIVES: Duration = Duration::from_secs(20);
const READS: Duration = Duration::from_secs(5);

/// Time between two events.
const TICK: Duration = Duration::from_millis(40);

/// Number of ticks after which an event is sent though nothing has changed, so that a lost
/// connection is noticed.
const QUIET_TICKS: u32 = 250;

const SCRIPT: &str = include_str!("live.js");
const STYLE: &str =
    concat!(include_str!("../report/explorer/explorer.css"), include_str!("live.css"));

/// A mesh from the page, with the answers of its form.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeshWish {
    /// File name.
    pub name: String,
    /// Unit of the numbers; by their evidence without.
    pub unit: Option<String>,
    /// Side that faces the finger.
    pub side: String,
    /// Finger.
    pub finger: String,
    /// Whether the whole object is explored.
    #[serde(default)]
    pub around: bool,
}

/// A mesh that is ready to be explored.
pub struct Brought {
    /// Choices with their evidence.
    pub words: String,
    /// Picture of the scene, a PNG file.
    pub picture: Vec<u8>,
}

/// Program behind the page.
pub trait Host: Send + Sync {
    /// Writes an experiment for a mesh.
    ///
    /// # Errors
    /// If the file is no mesh, or an answer is not allowed.
    fn bring(&self, wish: &MeshWish, mesh: &[u8]) -> Result<Brought, InputError>;

    /// Starts the experiment that was written last, with these planners.
    ///
    /// # Errors
    /// If there is none, or a planner does not exist.
    fn start(&self, planners: Vec<String>) -> Result<(), InputError>;

    /// Names of the planners that a person may choose.
    fn planners(&self) -> Vec<String>;
}

/// Server of the page.
pub struct Server {
    access: Access,
    host: Box<dyn Host>,
    shown: RwLock<Option<Arc<Shown>>>,
    /// Mistake that viewers are shown; empty without.
    alert: RwLock<String>,
}

type Body = BoxBody<Bytes, Infallible>;

/// Handle that ends a connection.
type Cut = Arc<OnceLock<AbortHandle>>;

impl Server {
    /// Opens the port of `address` and serves in a thread of its own.
    ///
    /// # Errors
    /// If the port cannot be opened.
    pub fn open(address: SocketAddr, host: Box<dyn Host>) -> anyhow::Result<Arc<Self>> {
        let listener = std::net::TcpListener::bind(address)
            .with_context(|| format!("cannot listen at {address}; choose another --listen"))?;
        listener.set_nonblocking(true)?;
        let access = Access::new(listener.local_addr()?);
        let (shown, alert) = Default::default();
        let server = Arc::new(Self { access, host, shown, alert });
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let own = Arc::clone(&server);
        std::thread::Builder::new().name("live page".into()).spawn(move || {
            runtime.block_on(async {
                if let Ok(listener) = TcpListener::from_std(listener) {
                    own.accept(listener).await;
                }
            });
        })?;
        Ok(server)
    }

    /// Address for a browser.
    pub fn url(&self) -> String {
        self.access.url()
    }

    /// Shows the trials of a desk, and the files of their run's folder.
    pub fn show(&self, desk: Arc<Desk>, truth: Truth, folder: &Path) {
        let (picture, folder) = (Picture::new(truth), folder.to_owned());
        let shown = Arc::new(Shown { desk, picture, folder });
        *self.shown.write().unwrap_or_else(PoisonError::into_inner) = Some(shown);
        self.alert(String::new());
    }

    /// Shows words about a mistake until something else is shown.
    pub fn alert(&self, words: String) {
        *self.alert.write().unwrap_or_else(PoisonError::into_inner) = words;
    }

    fn shown(&self) -> Option<Arc<Shown>> {
        self.shown.read().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Accepts connections for ever.
    async fn accept(self: Arc<Self>, listener: TcpListener) {
        let free = Arc::new(Semaphore::new(CONNECTIONS));
        loop {
            let Ok((stream, _)) = listener.accept().await else {
                // The process may have no file descriptor left.
                sleep(TICK).await;
                continue;
            };
            // Beyond the limit a connection is closed at once.
            if let Ok(place) = Arc::clone(&free).try_acquire_owned() {
                let server = Arc::clone(&self);
                tokio::spawn(async move {
                    server.serve(stream).await;
                    drop(place);
                });
            }
        }
    }

    async fn serve(self: Arc<Self>, stream: TcpStream) {
        // A viewer that does not read keeps little memory.
        let _ = SockRef::from(&stream).set_send_buffer_size(SEND_BUFFER_BYTES);
        let cut = Cut::default();
        let own = Arc::clone(&cut);
        let service = service_fn(move |request| {
            let (server, cut) = (Arc::clone(&self), Arc::clone(&own));
            async move { Ok::<_, Infallible>(server.answer(request, cut).await) }
        });
        let mut builder = http1::Builder::new();
        builder.timer(TokioTimer::new()).header_read_timeout(ARRIVES);
        let connection = builder.serve_connection(TokioIo::new(stream), service);
        let task = tokio::spawn(connection);
        let _ = cut.set(task.abort_handle());
        // A connection that breaks off needs no answer.
        let _ = task.await;
    }

    async fn answer(self: Arc<Self>, request: Request<Incoming>, cut: Cut) -> Response<Body> {
        let passage = self.access.check(request.method(), request.uri(), request.headers());
        let answered = match passage {
            Err((status, words)) => Err(refusal(status, words)),
            Ok(Passage::Enters) => Ok(entry(&self.access)),
            Ok(Passage::Free) => self.route(request, cut).await,
        };
        guarded(answered.unwrap_or_else(Into::into))
    }

    /// Answers an allowed request.
    ///
    /// # Errors
    /// The refusal.
    async fn route(
        self: Arc<Self>,
        request: Request<Incoming>,
        cut: Cut,
    ) -> Result<Response<Body>, Refusal> {
        let (method, path) = (request.method().clone(), request.uri().path().to_owned());
        let query = request.uri().query().unwrap_or_default().to_owned();
        let shown = self.shown();
        match (method, path.as_str()) {
            (Method::GET, "/") => Ok(file("text/html; charset=utf-8", self.page())),
            (Method::GET, "/live.css") => Ok(file("text/css", STYLE.to_owned())),
            (Method::GET, "/live.js") => {
                let view = BeliefView::of(shown.as_ref().map(|shown| &*shown.desk));
                let script = explorer::script(view.scripts) + SCRIPT;
                Ok(file("text/javascript; charset=utf-8", script))
            }
            (Method::GET, "/events") => Ok(self.events(cut)),
            (Method::GET, "/beliefs") => {
                let touches = query.strip_prefix("touches=").and_then(|it| it.parse().ok());
                let touches = touches.ok_or_else(|| bad("touches: allowed is a whole number"))?;
                let shown = shown.ok_or_else(nothing)?;
                let drawn = blocking(move || shown.picture.beliefs(&shown.desk, touches)).await?;
                drawn.map(|data| json_file(&data)).map_err(|error| failed(&error))
            }
            (Method::POST, "/seen") => {
                shown.ok_or_else(nothing)?.desk.seen();
                Ok(json_file(&json!({})))
            }
            (Method::POST, "/order") => {
                let order: Order = parsed(&body(request, ORDER_BYTES).await?)?;
                shown.ok_or_else(nothing)?.desk.order(order).map_err(|error| bad(&error.0))?;
                Ok(json_file(&json!({})))
            }
            (Method::POST, "/mesh") => {
                // The form is a header, so that the body is the file alone.
                let wish = request.headers().get("x-mesh").and_then(|it| it.to_str().ok());
                let wish: MeshWish = parsed(wish.unwrap_or_default().as_bytes())?;
                let mesh = body(request, MESH_BYTES).await?;
                let own = Arc::clone(&self);
                let brought = blocking(move || own.host.bring(&wish, &mesh)).await?;
                let Brought { words, picture } =
                    brought.map_err(|error| bad(&error.to_string()))?;
                let picture =
                    base64::Engine::encode(&base64::engine::general_purpose::STANDARD, picture);
                Ok(json_file(&json!({ "words": words, "picture": picture })))
            }
            (Method::POST, "/start") => {
                let planners: Vec<String> = parsed(&body(request, ORDER_BYTES).await?)?;
                let own = Arc::clone(&self);
                let started = blocking(move || own.host.start(planners)).await?;
                started.map_err(|error| bad(&error.to_string()))?;
                Ok(json_file(&json!({})))
            }
            (Method::GET, path) => {
                let shown = shown.ok_or_else(missing)?;
                let (path, kind) = picture::file(path).ok_or_else(missing)?;
                let read = blocking(move || bytes_below(&shown.folder, &path, FILE_BYTES)).await?;
                let mut response =
                    Response::new(Full::new(read.map_err(|_| missing())?.into()).boxed());
                response.headers_mut().insert(CONTENT_TYPE, HeaderValue::from_static(kind));
                // A report has its script and its style in itself.
                let own = HeaderValue::from_static(
                    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:",
                );
                response.headers_mut().insert(CONTENT_SECURITY_POLICY, own);
                Ok(response)
            }
            _ => Err(missing()),
        }
    }

    /// Returns the page around the canvases, which the script adds.
    fn page(&self) -> String {
        let shown = self.shown();
        let name = shown.as_ref().map_or("Live", |shown| &shown.desk.experiment().name);
        let BeliefView { colours, .. } = BeliefView::of(shown.as_ref().map(|shown| &*shown.desk));
        let planners = self.host.planners();
        let boxes: String = planners
            .iter()
            .map(|name| {
                let is_first = ["active", "human"].contains(&name.as_str());
                let (name, checked) = (escape(name), if is_first { " checked" } else { "" });
                format!("<label><input type=\"checkbox\" name=\"with\" value=\"{name}\"{checked}> {name}</label>\n")
            })
            .collect();
        let body = include_str!("live.html")
            .replace("{colours}", &choice("colour", colours.iter().copied()))
            .replace("{planners}", &boxes);
        html::page_with("Palpate live", name, "", &body, HEAD)
    }

    /// Returns the stream of events: `state` after each change, `readings` of bodies that move, and
    /// `alert`.
    fn events(self: Arc<Self>, cut: Cut) -> Response<Body> {
        let (mut sender, body) = Channel::<Bytes, Infallible>::new(1);
        tokio::spawn(async move {
            let mut sent = Sent::default();
            loop {
                let text = self.news(&mut sent);
                if let Some(text) = text {
                    match timeout(READS, sender.send(Frame::data(text.into()))).await {
                        Ok(Ok(())) => (),
                        Ok(Err(_)) => return,
                        Err(_) => return cut.get().map(AbortHandle::abort).unwrap_or_default(),
                    }
                }
                sleep(TICK).await;
            }
        });
        let mut response = Response::new(body.boxed());
        let headers = response.headers_mut();
        headers.insert(CONTENT_TYPE, HeaderValue::from_static("text/event-stream"));
        response
    }

    /// Returns what is new since `sent`, as events.
    fn news(&self, sent: &mut Sent) -> Option<String> {
        let mut text = String::new();
        let shown = self.shown();
        let number = |shown: &Arc<Shown>| (Arc::as_ptr(shown) as usize, shown.desk.lock().version);
        let now = shown.as_ref().map(number).unwrap_or_default();
        if sent.version != Some(now) {
            let is_other = sent.version.is_some_and(|before| before.0 != now.0);
            sent.version = Some(now);
            let state = shown
                .as_ref()
                .map_or(json!({ "phase": "choosing" }), |it| picture::state(&it.desk));
            let name = if is_other { "reload" } else { "state" };
            text += &format!("event: {name}\ndata: {state}\n\n");
        }
        if let Some(shown) = &shown {
            let now = picture::readings(&shown.desk);
            if now != sent.readings {
                text += &format!("event: readings\ndata: {now}\n\n");
                sent.readings = now;
            }
        }
        let alert = self.alert.read().unwrap_or_else(PoisonError::into_inner).clone();
        if alert != sent.alert {
            text += &format!("event: alert\ndata: {}\n\n", json!(alert));
            sent.alert = alert;
        }
        sent.quiet_ticks = if text.is_empty() { sent.quiet_ticks + 1 } else { 0 };
        if sent.quiet_ticks >= QUIET_TICKS {
            sent.quiet_ticks = 0;
            text += ": quiet\n\n";
        }
        (!text.is_empty()).then_some(text)
    }
}

/// News that a viewer was sent.
#[derive(Default)]
struct Sent {
    /// Desk, and version of its state.
    version: Option<(usize, u64)>,
    readings: Value,
    alert: String,
    quiet_ticks: u32,
}

const HEAD: &str = "<link rel=\"icon\" href=\"data:,\">\n<link rel=\"stylesheet\" href=\"/live.css\">\n<script src=\"/live.js\" defer></script>\n";

fn full(text: String) -> Body {
    Full::new(Bytes::from(text)).boxed()
}

fn file(kind: &'static str, text: String) -> Response<Body> {
    let mut response = Response::new(full(text));
    response.headers_mut().insert(CONTENT_TYPE, HeaderValue::from_static(kind));
    response
}

fn json_file(value: &Value) -> Response<Body> {
    file("application/json", value.to_string())
}

/// Refusal of a request.
struct Refusal {
    status: StatusCode,
    words: String,
}

impl From<Refusal> for Response<Body> {
    /// Creates the answer that gives the reason.
    fn from(Refusal { status, words }: Refusal) -> Self {
        let mut response = json_file(&json!({ "error": words }));
        *response.status_mut() = status;
        response
    }
}

fn refusal(status: StatusCode, words: &str) -> Refusal {
    Refusal { status, words: words.to_owned() }
}

fn missing() -> Refusal {
    refusal(StatusCode::NOT_FOUND, "no such page")
}

fn bad(words: &str) -> Refusal {
    refusal(StatusCode::UNPROCESSABLE_ENTITY, words)
}

fn failed(error: &anyhow::Error) -> Refusal {
    refusal(StatusCode::INTERNAL_SERVER_ERROR, &format!("{error:#}"))
}

fn nothing() -> Refusal {
    bad("no experiment is shown")
}

/// Sends a browser with the token to the page without it, so that no history keeps it.
fn entry(access: &Access) -> Response<Body> {
    let mut response = Response::new(full(String::new()));
    *response.status_mut() = StatusCode::SEE_OTHER;
    let headers = response.headers_mut();
    headers.insert(LOCATION, HeaderValue::from_static("/"));
    if let Ok(cookie) = HeaderValue::try_from(access.set_cookie()) {
        headers.insert(SET_COOKIE, cookie);
    }
    response
}

/// Adds the headers that keep a browser from using an answer elsewhere.
fn guarded(mut response: Response<Body>) -> Response<Body> {
    let rules: [(HeaderName, &str); 5] = [
        (
            CONTENT_SECURITY_POLICY,
            "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; \
             connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
        ),
        (X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (X_FRAME_OPTIONS, "DENY"),
        (REFERRER_POLICY, "no-referrer"),
        (CACHE_CONTROL, "no-store"),
    ];
    for (name, value) in rules {
        response.headers_mut().entry(name).or_insert(HeaderValue::from_static(value));
    }
    response
}

/// Reads a body.
///
/// # Errors
/// The refusal of one that is larger than `most`, too slow, or broken off.
async fn body(request: Request<Incoming>, most: usize) -> Result<Bytes, Refusal> {
    let large = || {
        let words = format!("larger than {} kB", most >> 10);
        refusal(StatusCode::PAYLOAD_TOO_LARGE, &words)
    };
    let stated =
        request.headers().get(CONTENT_LENGTH).and_then(|it| it.to_str().ok()?.parse().ok());
    if stated.is_some_and(|stated: u64| stated > most as u64) {
        return Err(large());
    }
    let slow = |_| refusal(StatusCode::REQUEST_TIMEOUT, "the message did not arrive in time");
    let read = timeout(ARRIVES, Limited::new(request.into_body(), most).collect()).await;
    Ok(read.map_err(slow)?.map_err(|_| large())?.to_bytes())
}

fn parsed<T: for<'a> Deserialize<'a>>(text: &[u8]) -> Result<T, Refusal> {
    serde_json::from_slice(text).map_err(|error| bad(&palpate_input::format::json(&error)))
}

/// Runs work that takes long outside of the server's thread.
async fn blocking<T: Send + 'static>(
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<T, Refusal> {
    let panicked = |_| refusal(StatusCode::INTERNAL_SERVER_ERROR, "it cannot be drawn");
    tokio::task::spawn_blocking(work).await.map_err(panicked)
}
