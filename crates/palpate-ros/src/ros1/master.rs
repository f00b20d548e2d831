//! The publishers that the master of ROS 1 knows, and connections to them without delay.

use crate::topics::{Topic, Topics};
use std::io::{Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// How long the master is waited for; chosen.
const PATIENCE: Duration = Duration::from_millis(200);

/// How often it is asked; chosen: it takes milliseconds to answer.
const EVERY: Duration = Duration::from_millis(250);

/// Known publishers of each topic, counted in a thread of its own, so that nobody waits for the
/// master; it looks after new connections, too.
pub struct Census {
    counts: Arc<[AtomicUsize; Topic::ALL.len()]>,
    /// Ends the thread when it is gone.
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Census {
    /// Of `topics`, as the master at `uri` says.
    pub fn new(uri: &str, topics: &Topics) -> Self {
        let counts: Arc<[AtomicUsize; Topic::ALL.len()]> = Arc::default();
        let (uri, topics, shared) = (uri.to_owned(), topics.clone(), Arc::clone(&counts));
        let (stop, stopped) = channel::<()>();
        let thread = std::thread::spawn(move || {
            loop {
                let state = state(&uri).unwrap_or_default();
                for (topic, shared) in Topic::ALL.into_iter().zip(&*shared) {
                    let known = count(&state, &topics.name(topic)).unwrap_or(0);
                    shared.store(known, Ordering::Relaxed);
                }
                #[cfg(unix)]
                send_at_once();
                if stopped.recv_timeout(EVERY) != Err(RecvTimeoutError::Timeout) {
                    break;
                }
            }
        });
        Self { counts, stop: Some(stop), thread: Some(thread) }
    }

    /// How many nodes publish `topic`; none if the master does not say.
    pub fn publishers(&self, topic: Topic) -> usize {
        self.counts[topic as usize].load(Ordering::Relaxed)
    }
}

impl Drop for Census {
    fn drop(&mut self) {
        self.stop = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// What the master answers to `getSystemState`.
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

/// Has every TCP connection of this process send without delay. ROS 1 asks for that in a
/// connection's header, and roslibrust 0.26 does not do as asked: a small message then waits for
/// the acknowledgement of the one before, for up to 40 ms.
#[cfg(unix)]
fn send_at_once() {
    use socket2::SockRef;
    use std::fs::read_dir;
    use std::os::fd::{BorrowedFd, RawFd};

    let Ok(open) = read_dir("/proc/self/fd") else { return };
    let numbers = open.flatten().filter_map(|entry| entry.file_name().to_str()?.parse().ok());
    let numbers: Vec<RawFd> = numbers.collect();
    for number in numbers {
        // SAFETY: used for one call only. Closed meanwhile, it names nothing or another file, of
        // which the call refuses all but connections.
        let descriptor = unsafe { BorrowedFd::borrow_raw(number) };
        let _ = SockRef::from(&descriptor).set_tcp_nodelay(true);
    }
}

/// How many nodes publish `topic` by an answer to `getSystemState`, which is `[code, words,
/// [publishers, subscribers, services]]`; each of the three is a list of `[topic, [node…]]`.
fn count(text: &str, topic: &str) -> Option<usize> {
    let compact: String = text.chars().filter(|c| !c.is_whitespace()).collect();
    let publishers = list_at(compact.split_once("<methodResponse>")?.1, 3)?;
    let name = format!("<value><string>{topic}</string></value>");
    let Some((_, nodes)) = publishers.split_once(&name) else { return Some(0) };
    let nodes = nodes.split_once("</data>")?.0;
    Some(nodes.matches("<string>").count())
}

/// What the first list holds that lies in `depth` lists, itself among them.
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
        assert_eq!([count(&text, "/a"), count(&text, "/b")], [Some(1), Some(2)]);
        assert_eq!([count(&text, "/c"), count(&text, "/d")], [Some(0); 2]);
        assert_eq!(count("nonsense", "/a"), None);
    }
}
