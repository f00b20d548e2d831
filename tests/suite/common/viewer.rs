//! Viewer of a live page, without a browser.

use serde_json::Value;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// Longest wait of a test.
pub const LONGEST: Duration = Duration::from_secs(120);

/// Viewer of the page at a host.
pub struct Viewer {
    /// Address and port.
    pub host: String,
    pub token: String,
}

impl Viewer {
    /// Creates the viewer of a printed address.
    pub fn new(url: &str) -> Self {
        let (host, token) = url.trim_start_matches("http://").split_once("/?token=").unwrap();
        Self { host: host.into(), token: token.into() }
    }

    /// Headers of the viewer's requests.
    pub fn head(&self) -> String {
        format!("Host: {}\r\nAuthorization: Bearer {}", self.host, self.token)
    }

    pub fn get(&self, path: &str) -> (u16, String) {
        let head = self.head();
        let request = format!("GET {path} HTTP/1.1\r\n{head}\r\nConnection: close\r\n\r\n");
        answer(&self.host, &request)
    }

    pub fn post(&self, path: &str, body: &Value) -> (u16, String) {
        let (host, head, body) = (&self.host, self.head(), body.to_string());
        let head = format!(
            "POST {path} HTTP/1.1\r\n{head}\r\nOrigin: http://{host}\r\nConnection: close\r\n\
             Content-Length: {}\r\n\r\n{body}",
            body.len()
        );
        answer(host, &head)
    }

    pub fn order(&self, order: &Value) {
        let (status, words) = self.post("/order", order);
        assert_eq!(status, 200, "{order}: {words}");
    }

    /// Opens the stream of events.
    pub fn events(&self) -> TcpStream {
        let mut stream = TcpStream::connect(&self.host).unwrap();
        stream.set_read_timeout(Some(LONGEST)).unwrap();
        write!(stream, "GET /events HTTP/1.1\r\n{}\r\n\r\n", self.head()).unwrap();
        stream
    }

    /// Returns the first state that fits.
    pub fn when(&self, fits: impl Fn(&Value) -> bool) -> Value {
        let stream = self.events();
        let (begun, mut last) = (Instant::now(), Value::Null);
        for line in BufReader::new(stream).lines() {
            let line = line.unwrap();
            let state = line.strip_prefix("data: ").and_then(|it| serde_json::from_str(it).ok());
            if let Some(state) = state.filter(Value::is_object) {
                if fits(&state) {
                    return state;
                }
                last = state;
            }
            assert!(begun.elapsed() < LONGEST, "the state has not come: {last}");
        }
        panic!("the stream has ended");
    }
}

/// Sends a request; returns the status and the body.
pub fn answer(host: &str, request: &str) -> (u16, String) {
    let mut stream = TcpStream::connect(host).unwrap();
    stream.set_read_timeout(Some(LONGEST)).unwrap();
    // A refusal may come before everything is sent.
    let _ = stream.write_all(request.as_bytes());
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    let answer = String::from_utf8_lossy(&answer);
    let status = answer.split(' ').nth(1).and_then(|it| it.parse().ok()).unwrap_or_default();
    (status, answer.split_once("\r\n\r\n").map(|(_, body)| body.to_owned()).unwrap_or_default())
}

fn planners(state: &Value) -> &[Value] {
    state["planners"].as_array().map_or(&[][..], Vec::as_slice)
}

/// States of the planners' trials.
pub fn statuses(state: &Value) -> Vec<&str> {
    planners(state).iter().filter_map(|planner| planner["status"].as_str()).collect()
}

/// Numbers of the planners' touches.
pub fn touches(state: &Value) -> Vec<u64> {
    planners(state).iter().filter_map(|planner| planner["touches"].as_u64()).collect()
}
