//! Guard of the server: which requests may read or order anything.
//!
//! A page of another site can send requests from a person's browser. It cannot set `Host` or
//! `Origin`, so those must be the server's own; a name that is rebound to this machine (DNS
//! rebinding) is another host. A token keeps out other users of this machine and other machines.

use hyper::header::{AUTHORIZATION, COOKIE, HOST, HeaderMap, ORIGIN};
use hyper::{Method, StatusCode, Uri};
use std::net::{IpAddr, SocketAddr};
use subtle::ConstantTimeEq;

/// Number of random bytes of a token.
const TOKEN_BYTES: usize = 16;

/// Refusal of a request without the token.
const NO_TOKEN: &str =
    "the token is missing or wrong: open the address that `palpate live` printed";

/// Rules of who may use the server.
pub struct Access {
    address: SocketAddr,
    /// Secret of the printed address.
    token: String,
}

/// Answer that an allowed request gets.
#[derive(Debug, PartialEq)]
pub(super) enum Passage {
    /// It is answered.
    Free,
    /// Its address has the token: the answer stores it in a cookie.
    Enters,
}

impl Access {
    /// Creates the rules of a server at `address` with a new token.
    pub fn new(address: SocketAddr) -> Self {
        let bytes: [u8; TOKEN_BYTES] = rand::random();
        let token = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        Self { address, token }
    }

    /// Address for a browser, with the token.
    pub fn url(&self) -> String {
        let host = if self.address.ip().is_unspecified() {
            SocketAddr::new(IpAddr::from([127, 0, 0, 1]), self.address.port())
        } else {
            self.address
        };
        format!("http://{host}/?token={}", self.token)
    }

    /// Name of the cookie; browsers share cookies between the ports of a host.
    fn cookie(&self) -> String {
        format!("palpate-{}", self.address.port())
    }

    /// Value of `Set-Cookie` for a page that has entered.
    pub(super) fn set_cookie(&self) -> String {
        // `Lax`, because a browser counts a file and a link as another site, and would not send a
        // `Strict` cookie to the page that follows the token.
        format!("{}={}; HttpOnly; SameSite=Lax; Path=/", self.cookie(), self.token)
    }

    /// Checks a request.
    ///
    /// # Errors
    /// The status and the reason of a refusal.
    pub(super) fn check(
        &self,
        method: &Method,
        uri: &Uri,
        headers: &HeaderMap,
    ) -> Result<Passage, (StatusCode, &'static str)> {
        let text = |name| headers.get(name).and_then(|value| value.to_str().ok());
        let host = text(HOST).filter(|_| headers.get_all(HOST).iter().count() == 1);
        let host = host.filter(|host| self.is_own(host));
        let host = host.ok_or((StatusCode::MISDIRECTED_REQUEST, "another host's name"))?;
        let origin = headers.get(ORIGIN).map(|origin| origin.to_str().unwrap_or_default());
        let is_same = |origin: &str| origin == format!("http://{host}");
        // Browsers send the origin with every request that orders something.
        let is_fine = origin.map_or(method == Method::GET, is_same);
        let site = headers.get("sec-fetch-site").map(|site| site.as_bytes());
        let is_fine =
            is_fine && site.is_none_or(|site| [&b"same-origin"[..], b"none"].contains(&site));
        // A link from elsewhere may lead to the first page.
        let is_entry = method == Method::GET && uri.path() == "/";
        if !(is_fine || is_entry && origin.is_none()) {
            return Err((StatusCode::FORBIDDEN, "another page's request"));
        }
        let query = uri.query().and_then(|query| query.strip_prefix("token="));
        if is_entry && query.is_some_and(|given| is_equal(given, &self.token)) {
            return Ok(Passage::Enters);
        }
        let cookie = format!("{}=", self.cookie());
        let cookies = text(COOKIE).unwrap_or_default().split(';').map(str::trim);
        let bearer = text(AUTHORIZATION).and_then(|value| value.strip_prefix("Bearer "));
        let mut given = cookies.filter_map(|it| it.strip_prefix(&cookie)).chain(bearer);
        match given.any(|given| is_equal(given, &self.token)) {
            true => Ok(Passage::Free),
            false => Err((StatusCode::FORBIDDEN, NO_TOKEN)),
        }
    }

    /// Whether a `Host` is this server's: an address, or `localhost`, with its port.
    fn is_own(&self, host: &str) -> bool {
        let port = self.address.port();
        let local = host == format!("localhost:{port}");
        let address = host.parse::<SocketAddr>().ok().filter(|it| it.port() == port);
        match self.address.ip().is_loopback() {
            true => local || address.is_some_and(|it| it.ip().is_loopback()),
            false => local || address.is_some(),
        }
    }
}

/// Compares in a time that does not depend on how many characters agree.
fn is_equal(given: &str, token: &str) -> bool {
    given.as_bytes().ct_eq(token.as_bytes()).into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use hyper::header::{HeaderName, HeaderValue};

    fn check(access: &Access, method: Method, path: &str, headers: &[(&str, &str)]) -> u16 {
        let pairs = headers.iter().map(|(name, value)| {
            (HeaderName::try_from(*name).unwrap(), HeaderValue::from_str(value).unwrap())
        });
        let found = access.check(&method, &path.parse().unwrap(), &pairs.collect());
        found.map_or_else(
            |(status, _)| status.as_u16(),
            |passage| match passage {
                Passage::Free => 200,
                Passage::Enters => 303,
            },
        )
    }

    #[test]
    fn only_its_own_page_orders() {
        let access = Access::new(([127, 0, 0, 1], 8080).into());
        let bearer = format!("Bearer {}", access.token);
        let bearer = ("authorization", bearer.as_str());
        let own = ("host", "127.0.0.1:8080");
        let same = ("origin", "http://127.0.0.1:8080");
        for (method, headers, status) in [
            (Method::GET, &[own][..], 200),
            (Method::GET, &[("host", "localhost:8080")], 200),
            (Method::POST, &[own, same], 200),
            (Method::POST, &[own], 403),
            (Method::POST, &[own, ("origin", "null")], 403),
            (Method::POST, &[own, ("origin", "http://127.0.0.1:8081")], 403),
            (Method::POST, &[own, ("origin", "https://127.0.0.1:8080")], 403),
            (Method::GET, &[own, ("origin", "http://evil.example")], 403),
            (Method::GET, &[own, ("sec-fetch-site", "cross-site")], 403),
            (Method::GET, &[("host", "evil.example:8080")], 421),
            (Method::GET, &[("host", "127.0.0.1:8081")], 421),
            (Method::GET, &[("host", "10.0.0.1:8080")], 421),
            (Method::GET, &[], 421),
            (Method::GET, &[own, own], 421),
        ] {
            let entered = [headers, &[bearer]].concat();
            assert_eq!(
                check(&access, method.clone(), "/events", &entered),
                status,
                "{method} {headers:?}"
            );
            let status = status.max(403);
            assert_eq!(check(&access, method.clone(), "/events", headers), status, "no token");
        }
        // A link from elsewhere shows the page, and nothing more.
        let link = [own, ("sec-fetch-site", "cross-site"), bearer];
        assert_eq!(check(&access, Method::GET, "/", &link), 200);
    }

    #[test]
    fn every_server_asks_for_its_token() {
        for (ip, host) in [([127, 0, 0, 1], "127.0.0.1:8080"), ([0, 0, 0, 0], "10.0.0.1:8080")] {
            let access = Access { address: (ip, 8080).into(), token: "secret".into() };
            let own = ("host", host);
            let cookie = |value| [own, ("cookie", value)];
            for (path, status) in [
                ("/?token=secret", 303),
                ("/?token=secrets", 403),
                ("/?token=", 403),
                ("/?", 403),
                ("/", 403),
                ("/events?token=secret", 403),
                ("/live.js", 403),
                ("/trials.jsonl", 403),
            ] {
                assert_eq!(check(&access, Method::GET, path, &[own]), status, "{path}");
            }
            for (value, status) in [
                ("palpate-8080=secret", 200),
                ("a=b; palpate-8080=secret", 200),
                ("palpate-8080=secre", 403),
                ("palpate-8080=secrets", 403),
                ("palpate-8080=", 403),
                ("palpate-8081=secret", 403),
            ] {
                let found = check(&access, Method::GET, "/events", &cookie(value));
                assert_eq!(found, status, "{value}");
            }
            let origin = format!("http://{host}");
            let same = ("origin", origin.as_str());
            let bearer = ("authorization", "Bearer secret");
            for path in ["/order", "/seen", "/mesh", "/start"] {
                assert_eq!(check(&access, Method::POST, path, &[own, same]), 403, "{path}");
                assert_eq!(check(&access, Method::POST, path, &[own, same, bearer]), 200, "{path}");
            }
            let other = ("host", "evil.example:8080");
            assert_eq!(check(&access, Method::GET, "/events", &[other, bearer]), 421);
        }
    }

    #[test]
    fn tokens_are_new_and_in_the_address() {
        let [one, other] = [(); 2].map(|()| Access::new(([127, 0, 0, 1], 80).into()));
        assert_eq!(one.token.len(), 2 * TOKEN_BYTES);
        assert_ne!(one.token, other.token);
        assert_eq!(one.url(), format!("http://127.0.0.1:80/?token={}", one.token));
    }
}
