//! A message by HTTP POST.
//!
//! One request of which the status alone counts: a connection, TLS as the database's, a dozen lines of HTTP/1.1 (RFC 9112). A client library would bring
//! redirects, cookies, pools and a second TLS, of which nothing is wanted here.

use std::io::{self, Read, Write};
use std::net::{IpAddr, TcpStream, ToSocketAddrs as _};
use std::sync::Arc;
use std::time::{Duration, Instant};

use plumb_record::sha256_hex;
use rustls::pki_types::ServerName;
use rustls::{ClientConfig, ClientConnection, RootCertStore, StreamOwned};
use serde_json::json;
use url::{Host, Url};

use super::trouble::Trouble;

/// How long one message may take, from the first byte to the answer's first line.
const WITHIN: Duration = Duration::from_secs(10);

/// Digits of the hash that distinguishes webhooks of one host where no secret may be kept.
const KEY_LENGTH: usize = 12;

/// Longest first line of an answer, bytes.
const LONGEST_LINE: usize = 8 * 1024;

/// Why a message did not arrive.
#[derive(Debug, thiserror::Error)]
pub(super) enum WebhookError {
    #[error("{0}; a webhook looks like https://HOST/PATH")]
    Address(String),
    #[error("a message to {0} would cross the network in plain text: give an https address")]
    Unprotected(String),
    #[error("the certificates of this machine cannot be read: {0}")]
    Certificates(String),
    #[error("{operation}: {cause}")]
    Network { operation: &'static str, cause: io::Error },
    #[error("no answer within {} s", WITHIN.as_secs())]
    Slow,
    #[error("it answers with something that is no HTTP")]
    NoHttp,
    #[error("it answers {}{}", .0, hint(*.0))]
    Status(u16),
}

fn hint(status: u16) -> &'static str {
    match status {
        300..=399 => ", which leads elsewhere: give the address it leads to",
        401 | 403 => ": it does not let this program in",
        404 | 410 => ": there is no such webhook",
        _ => "",
    }
}

impl WebhookError {
    /// Whether the same message may arrive later.
    pub(super) fn may_pass(&self) -> bool {
        match self {
            Self::Address(_) | Self::Unprotected(_) => false,
            // Too early, too many, or not in time: RFC 9110, sections 15.5.9 and on.
            Self::Status(status) => matches!(status, 408 | 425 | 429 | 500..),
            _ => true,
        }
    }
}

/// Where messages go.
pub(super) struct Webhook {
    url: Url,
    host: String,
    port: u16,
    name: String,
    key: String,
}

impl Webhook {
    pub(super) fn at(address: &str) -> Result<Self, WebhookError> {
        let url: Url = address.trim().parse().map_err(|error| WebhookError::Address(format!("{error}")))?;
        if !["http", "https"].contains(&url.scheme()) {
            return Err(WebhookError::Address(format!("`{}` is neither http nor https", url.scheme())));
        }
        if !url.username().is_empty() || url.password().is_some() {
            return Err(WebhookError::Address(
                "a name and a password in the address are not sent".to_owned(),
            ));
        }
        let (Some(host), Some(port)) = (url.host(), url.port_or_known_default()) else {
            return Err(WebhookError::Address("there is no host in it".to_owned()));
        };
        if url.scheme() == "http" && !is_this_machine(&host) {
            return Err(WebhookError::Unprotected(host.to_string()));
        }
        // The path is often the secret, so the name ends before it.
        let name = format!("webhook at {host}");
        let host = host.to_string().trim_matches(['[', ']']).to_owned();
        let hash = sha256_hex(url.as_str().as_bytes());
        let key = format!("{name}, {}", hash.get(..KEY_LENGTH).unwrap_or(&hash));
        Ok(Self { url, host, port, name, key })
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn key(&self) -> &str {
        &self.key
    }

    pub(super) fn send(&self, trouble: &Trouble) -> Result<(), WebhookError> {
        let deadline = Instant::now() + WITHIN;
        let stream = self.connect(deadline)?;
        let request = self.request(trouble);
        let status = if self.url.scheme() == "https" {
            let mut stream = StreamOwned::new(self.tls()?, stream);
            exchange(&mut stream, |stream| &stream.sock, &request, deadline)?
        } else {
            let mut stream = stream;
            exchange(&mut stream, |stream| stream, &request, deadline)?
        };
        if (200..300).contains(&status) { Ok(()) } else { Err(WebhookError::Status(status)) }
    }

    fn connect(&self, deadline: Instant) -> Result<TcpStream, WebhookError> {
        let failed = |operation| move |cause| WebhookError::Network { operation, cause };
        let addresses = (self.host.as_str(), self.port).to_socket_addrs();
        let addresses = addresses.map_err(failed("its name is not found"))?;
        let mut last = WebhookError::Slow;
        for address in addresses {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                break;
            }
            match TcpStream::connect_timeout(&address, left) {
                Ok(stream) => return Ok(stream),
                Err(cause) if cause.kind() == io::ErrorKind::TimedOut => last = WebhookError::Slow,
                Err(cause) => last = failed("it cannot be reached")(cause),
            }
        }
        Err(last)
    }

    /// TLS with the certificates that this machine trusts.
    fn tls(&self) -> Result<ClientConnection, WebhookError> {
        let found = rustls_native_certs::load_native_certs();
        let mut roots = RootCertStore::empty();
        let (usable, _) = roots.add_parsable_certificates(found.certs);
        if usable == 0 {
            let reasons: Vec<String> = found.errors.iter().map(ToString::to_string).collect();
            let reasons = if reasons.is_empty() { "there are none".to_owned() } else { reasons.join("; ") };
            return Err(WebhookError::Certificates(reasons));
        }
        let other = |error: rustls::Error| WebhookError::Network {
            operation: "TLS",
            cause: io::Error::other(error.to_string()),
        };
        let provider = Arc::new(rustls::crypto::ring::default_provider());
        let configuration = ClientConfig::builder_with_provider(provider)
            .with_safe_default_protocol_versions()
            .map_err(other)?
            .with_root_certificates(roots)
            .with_no_client_auth();
        let name = ServerName::try_from(self.host.clone())
            .map_err(|error| WebhookError::Address(error.to_string()))?;
        ClientConnection::new(Arc::new(configuration), name).map_err(other)
    }

    fn request(&self, trouble: &Trouble) -> Vec<u8> {
        // `text` is what Slack, Mattermost, Rocket.Chat and Teams show, `content` what Discord does.
        let message = json!({ "text": trouble.text, "content": trouble.text, "kind": trouble.kind, "cell": trouble.cell,
            "run": trouble.run, "since": trouble.since });
        let body = message.to_string();
        let path = &self.url[url::Position::BeforePath..url::Position::AfterQuery];
        let host = &self.url[url::Position::BeforeHost..url::Position::AfterPort];
        let version = env!("CARGO_PKG_VERSION");
        format!(
            "POST {path} HTTP/1.1\r\nHost: {host}\r\nUser-Agent: plumb/{version}\r\nContent-Type: application/json\r\nAccept: */*\r\n\
             Content-Length: {}\r\nConnection: close\r\n\r\n{body}",
            body.len()
        )
        .into_bytes()
    }
}

/// Sends the request; the status of the answer. `socket` is what the stream goes over, for its time limits.
fn exchange<S: Read + Write>(
    stream: &mut S,
    socket: impl Fn(&S) -> &TcpStream,
    request: &[u8],
    deadline: Instant,
) -> Result<u16, WebhookError> {
    let limit = |stream: &S| -> Result<(), WebhookError> {
        let left = deadline.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(WebhookError::Slow);
        }
        let set = socket(stream).set_read_timeout(Some(left));
        let set = set.and_then(|()| socket(stream).set_write_timeout(Some(left)));
        set.map_err(|cause| WebhookError::Network { operation: "no time limit", cause })
    };
    let failed = |operation| move |cause| said_as(operation, cause);
    limit(stream)?;
    stream.write_all(request).map_err(failed("it cannot be written to"))?;
    stream.flush().map_err(failed("it cannot be written to"))?;
    let mut answer = Vec::new();
    let mut part = [0_u8; 512];
    loop {
        if let Some(status) = status_of(&answer)? {
            return Ok(status);
        }
        // Each byte may come late, but not all of them together.
        limit(stream)?;
        match stream.read(&mut part) {
            Ok(0) => return Err(WebhookError::NoHttp),
            Ok(count) => answer.extend_from_slice(part.get(..count).unwrap_or_default()),
            Err(cause) if cause.kind() == io::ErrorKind::Interrupted => {}
            Err(cause) => return Err(said_as("it does not answer", cause)),
        }
    }
}

/// A time limit that ran out, or what else the network says.
fn said_as(operation: &'static str, cause: io::Error) -> WebhookError {
    match cause.kind() {
        io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut => WebhookError::Slow,
        _ => WebhookError::Network { operation, cause },
    }
}

/// The status in the first line of an answer; none while the line is not whole.
fn status_of(answer: &[u8]) -> Result<Option<u16>, WebhookError> {
    let Some(end) = answer.iter().position(|byte| *byte == b'\n') else {
        return if answer.len() > LONGEST_LINE { Err(WebhookError::NoHttp) } else { Ok(None) };
    };
    let line = String::from_utf8_lossy(answer.get(..end).unwrap_or_default()).into_owned();
    let mut words = line.split_ascii_whitespace();
    let is_http = words.next().is_some_and(|version| version.starts_with("HTTP/1."));
    let status = words.next().filter(|_| is_http).and_then(|status| status.parse::<u16>().ok());
    match status {
        Some(status @ 100..=599) => Ok(Some(status)),
        _ => Err(WebhookError::NoHttp),
    }
}

/// Whether a host is this machine, so that nothing crosses a network.
fn is_this_machine(host: &Host<&str>) -> bool {
    match host {
        Host::Domain(name) => *name == "localhost",
        Host::Ipv4(address) => IpAddr::V4(*address).is_loopback(),
        Host::Ipv6(address) => IpAddr::V6(*address).is_loopback(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_that_is_none_or_unprotected_is_refused() {
        for (wrong, expected) in [
            ("", "a webhook looks like https://HOST/PATH"),
            ("chat.lab.example/hook", "a webhook looks like"),
            ("ftp://lab/hook", "`ftp` is neither http nor https"),
            ("https://ada:secret@lab/hook", "are not sent"),
            ("http://chat.lab.example/hook", "in plain text: give an https address"),
        ] {
            let error = Webhook::at(wrong).err().expect("refused").to_string();
            assert!(error.contains(expected), "{wrong}: {error}");
        }
        let webhook = Webhook::at("https://hooks.chat.example/T0/secret?x=1").expect("taken");
        assert_eq!((webhook.name(), webhook.port), ("webhook at hooks.chat.example", 443));
        assert!(
            ["http://localhost:8/x", "http://127.0.0.1/", "http://[::1]:9/"]
                .into_iter()
                .all(|one| Webhook::at(one).is_ok())
        );
    }

    #[test]
    fn a_request_holds_the_message_as_json_under_the_names_that_chats_know() {
        let webhook = Webhook::at("https://hooks.chat.example:8443/T0/secret?x=1#part").expect("taken");
        let text = String::from_utf8(webhook.request(&Trouble::test())).expect("text");
        assert!(
            text.starts_with("POST /T0/secret?x=1 HTTP/1.1\r\nHost: hooks.chat.example:8443\r\n"),
            "{text}"
        );
        let body = text.split_once("\r\n\r\n").expect("a body").1;
        let body: serde_json::Value = serde_json::from_str(body).expect("JSON");
        assert_eq!((&body["text"], &body["kind"]), (&body["content"], &"test".into()));
    }

    #[test]
    fn the_first_line_says_the_status() {
        assert!(matches!(status_of(b"HTTP/1.1 20"), Ok(None)));
        assert!(matches!(status_of(b"HTTP/1.1 204 No Content\r\nX: y"), Ok(Some(204))));
        for wrong in [&b"SSH-2.0-OpenSSH\r\n"[..], b"HTTP/1.1 abc\r\n", b"HTTP/1.1 999\r\n", b"\n"] {
            assert!(status_of(wrong).is_err());
        }
        assert!(status_of(&[b'x'; LONGEST_LINE + 1]).is_err());
        assert!(WebhookError::Status(503).may_pass() && !WebhookError::Status(404).may_pass());
    }
}
