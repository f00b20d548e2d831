//! Publishers known to the ROS 1 master, and TCP connections without delay.

use crate::topics::{Topic, Topics};
use std::io::{Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// Timeout of the master; a heuristic.
const PATIENCE: Duration = Duration::from_millis(200);

/// Interval of queries; a heuristic: the master answers within milliseconds.
const EVERY: Duration = Duration::from_millis(250);

/// Counter of known publishers of each topic, in its own thread, so that no caller waits for the
/// master; the thread also configures new connections.
pub struct PublisherCounter {
    /// Number of publishers and of subscribers of each topic.
    counts: Arc<[[AtomicUsize; 2]; Topic::ALL.len()]>,
    /// Ends the thread when dropped.
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl PublisherCounter {
    /// Creates a counter of the publishers of `topics` known to the master at `uri`.
    pub fn new(uri: &str, topics: &Topics) -> Self {
        let counts: Arc<[[AtomicUsize; 2]; Topic::ALL.len()]> = Arc::default();
        let (uri, topics, shared) = (uri.to_owned(), topics.clone(), Arc::clone(&counts));
        let (stop, stopped) = channel::<()>();
        let thread = std::thread::spawn(move || {
            loop {
                let state = state(&uri).unwrap_or_default();
                for (topic, shared) in Topic::ALL.into_iter().zip(&*shared) {
                    for (role, shared) in shared.iter().enumerate() {
                        let known = count(&state, role, &topics.name(topic)).unwrap_or(0);
                        shared.store(known, Ordering::Relaxed);
                    }
                }
                #[cfg(unix)]
                set_tcp_nodelay();
                if stopped.recv_timeout(EVERY) != Err(RecvTimeoutError::Timeout) {
                    break;
                }
            }
        });
        Self { counts, stop: Some(stop), thread: Some(thread) }
    }

    /// Returns the number of nodes that publish `topic`; 0 if the master does not answer.
    pub fn publishers(&self, topic: Topic) -> usize {
        self.counts[topic as usize][0].load(Ordering::Relaxed)
    }

    /// Returns the number of nodes that subscribe to `topic`; 0 if the master does not answer.
    pub fn subscribers(&self, topic: Topic) -> usize {
        self.counts[topic as usize][1].load(Ordering::Relaxed)
    }
}

impl Drop for PublisherCounter {
    fn drop(&mut self) {
        self.stop = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Returns the master's answer to `getSystemState`.
fn state(uri: &str) -> Option<String> {
    let host = uri.strip_prefix("http://")?.trim_end_matches('/');
    let address = host.to_socket_addrs().ok()?.next()?;
    let mut stream = TcpStream::connect_timeout(&address, PATIENCE).ok()?;
    stream.set_read_timeout(Some(PATIENCE)).ok()?;
    let body = "<?xml version=\"1.0\"?><methodCall><methodName>getSystemState</methodName>\
                <params><param><value><string>/palpate</string></value></param></params></methodCall>";
    let request = format!(
        "POST / HTTP/1.0\r\nHost: {host}\r\nContent-Type: text/xml\r\n\
         Content-Length: {}\r\n\r\n{body}",
        body.len()
    );
    stream.write_all(request.as_bytes()).ok()?;
    let mut text = String::new();
    stream.read_to_string(&mut text).ok()?;
    Some(text)
}

/// Sets TCP_NODELAY on every TCP connection of this process. ROS 1 requests it in a connection's
/// header, but roslibrust 0.26 ignores the request: a small message then waits for the
/// acknowledgement of the previous one, for up to 40 ms.
#[cfg(unix)]
fn set_tcp_nodelay() {
    use socket2::SockRef;
    use std::fs::read_dir;
    use std::os::fd::{BorrowedFd, RawFd};

    let Ok(open) = read_dir("/proc/self/fd") else { return };
    let numbers = open.flatten().filter_map(|entry| entry.file_name().to_str()?.parse().ok());
    let numbers: Vec<RawFd> = numbers.collect();
    for number in numbers {
        // SAFETY: used for one call only. If it is closed meanwhile, it refers to nothing or to
        // another file, and the call fails on everything except connections.
        let descriptor = unsafe { BorrowedFd::borrow_raw(number) };
        let _ = SockRef::from(&descriptor).set_tcp_nodelay(true);
    }
}

/// Returns the number of nodes that publish `topic` (role 0) or subscribe to it (role 1) in an
/// answer to `getSystemState`, `[code, words, [publishers, subscribers, services]]`; each of the
/// three is a list of `[topic, [node…]]`.
fn count(text: &str, role: usize, topic: &str) -> Option<usize> {
    let compact: String = text.chars().filter(|c| !c.is_whitespace()).collect();
    let mut rest = list_at(compact.split_once("<methodResponse>")?.1, 2)?;
    for _ in 0..role {
        let list = list_at(rest, 1)?;
        rest = rest.get(rest.find("<data>")? + "<data>".len() + list.len()..)?;
    }
    let name = format!("<value><string>{topic}</string></value>");
    let Some((_, nodes)) = list_at(rest, 1)?.split_once(&name) else { return Some(0) };
    let nodes = nodes.split_once("</data>")?.0;
    Some(nodes.matches("<string>").count())
}

/// Returns the contents of the first list at nesting depth `depth`.
fn list_at(text: &str, depth: usize) -> Option<&str> {
    let mut start = 0;
    for _ in 0..depth {
        start += text.get(start..)?.find("<data>")? + "<data>".len();
    }
    let (mut open, mut end) = (1, start);
    while open > 0 {
        let rest = text.get(end..)?;
        let closes = rest.find("</data>")?;
        match rest.find("<data>").filter(|&opens| opens < closes) {
            Some(opens) => (open, end) = (open + 1, end + opens + "<data>".len()),
            None => (open, end) = (open - 1, end + closes + "</data>".len()),
        }
    }
    text.get(start..end)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn publishers_are_counted_in_the_masters_answer() {
        let value = |text: &str| format!("<value><string>{text}</string></value>\n");
        let list = |inner: &str| format!("<value><array><data>\n{inner}</data></array></value>\n");
        let entry = |topic: &str, nodes: &[&str]| {
            let nodes: String = nodes.iter().map(|node| value(node)).collect();
            list(&format!("{}{}", value(topic), list(&nodes)))
        };
        let publishers = list(&(entry("/a", &["/x"]) + &entry("/b", &["/x", "/y"])));
        let state = list(&(publishers + &list(&entry("/c", &["/z"])) + &list("")));
        let state = list(&("<value><int>1</int></value>".to_owned() + &value("state") + &state));
        let text = format!("HTTP/1.0 200 OK\r\n\r\n<?xml version='1.0'?>\n<methodResponse>{state}");
        assert_eq!([count(&text, 0, "/a"), count(&text, 0, "/b")], [Some(1), Some(2)]);
        assert_eq!([count(&text, 0, "/c"), count(&text, 0, "/d")], [Some(0); 2]);
        assert_eq!([count(&text, 1, "/a"), count(&text, 1, "/c")], [Some(0), Some(1)]);
        assert_eq!(count("nonsense", 0, "/a"), None);
    }
}
