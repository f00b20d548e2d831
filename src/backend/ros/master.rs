//! What the master of ROS 1 knows: who publishes.

use std::io::{Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

/// How long the master is waited for; chosen.
const PATIENCE: Duration = Duration::from_millis(200);

/// How many nodes publish `topic`, as the master at `uri` says; none if it does not say.
pub fn publisher_count(uri: &str, topic: &str) -> Option<usize> {
    let host = uri.strip_prefix("http://")?.trim_end_matches('/');
    let address = host.to_socket_addrs().ok()?.next()?;
    let mut stream = TcpStream::connect_timeout(&address, PATIENCE).ok()?;
    stream.set_read_timeout(Some(PATIENCE)).ok()?;
    let body = "<?xml version=\"1.0\"?><methodCall><methodName>getSystemState</methodName>\
                <params><param><value><string>/palpate</string></value></param></params></methodCall>";
    let request = format!(
        "POST / HTTP/1.0\r\nHost: {host}\r\nContent-Type: text/xml\r\nContent-Length: {}\r\n\r\n{body}",
        body.len()
    );
    stream.write_all(request.as_bytes()).ok()?;
    let mut text = String::new();
    stream.read_to_string(&mut text).ok()?;
    count(&text, topic)
}

/// Reads it from an answer to `getSystemState`, which is `[code, words, [publishers, subscribers,
/// services]]`; each of the three is a list of `[topic, [node…]]`.
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
