//! A server that takes webhooks, and can be set to misbehave.

use std::io::{Read, Write};
use std::net::TcpListener;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use rustls::pki_types::pem::PemObject as _;
use rustls::pki_types::{CertificateDer, PrivateKeyDer};
use rustls::{ServerConfig, ServerConnection, StreamOwned};
use serde_json::Value;

use crate::certificates::Certificate;

/// What it does with a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Behaviour {
    /// Answers with this status.
    Answers(u16),
    /// Takes it, and never answers.
    Hangs,
    /// Answers a byte a second.
    Trickles,
    /// Speaks something else.
    IsNoHttp,
}

#[derive(Default)]
struct Seen {
    behaviour: Option<Behaviour>,
    requests: Vec<String>,
}

/// A server on a port that the system chooses. It ends with the test's process.
pub(crate) struct Receiver {
    seen: Arc<Mutex<Seen>>,
    port: u16,
    scheme: &'static str,
}

impl Receiver {
    pub(crate) fn new(behaviour: Behaviour) -> Self {
        Self::begin(behaviour, None)
    }

    pub(crate) fn with_tls(certificate: &Certificate) -> Self {
        Self::begin(Behaviour::Answers(204), Some(configuration(certificate)))
    }

    fn begin(behaviour: Behaviour, tls: Option<Arc<ServerConfig>>) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let seen = Arc::new(Mutex::new(Seen { behaviour: Some(behaviour), requests: Vec::new() }));
        let scheme = if tls.is_some() { "https" } else { "http" };
        let for_thread = Arc::clone(&seen);
        std::thread::spawn(move || {
            for stream in listener.incoming() {
                let (stream, seen, tls) = (stream.unwrap(), Arc::clone(&for_thread), tls.clone());
                std::thread::spawn(move || match tls {
                    None => serve(stream, &seen),
                    Some(tls) => serve(StreamOwned::new(ServerConnection::new(tls).unwrap(), stream), &seen),
                });
            }
        });
        Self { seen, port, scheme }
    }

    pub(crate) fn behave(&self, behaviour: Behaviour) {
        self.seen.lock().unwrap().behaviour = Some(behaviour);
    }

    pub(crate) fn address(&self) -> String {
        format!("{}://localhost:{}/hook/secret", self.scheme, self.port)
    }

    /// Every request so far.
    pub(crate) fn requests(&self) -> Vec<String> {
        self.seen.lock().unwrap().requests.clone()
    }

    /// The messages so far.
    pub(crate) fn messages(&self) -> Vec<Value> {
        let body =
            |request: &String| serde_json::from_str(request.split_once("\r\n\r\n").unwrap().1).unwrap();
        self.requests().iter().map(body).collect()
    }
}

fn configuration(certificate: &Certificate) -> Arc<ServerConfig> {
    let chain = CertificateDer::from_pem_file(&certificate.certificate).unwrap();
    let key = PrivateKeyDer::from_pem_file(&certificate.key).unwrap();
    let builder = ServerConfig::builder_with_provider(Arc::new(rustls::crypto::ring::default_provider()));
    let builder = builder.with_safe_default_protocol_versions().unwrap().with_no_client_auth();
    Arc::new(builder.with_single_cert(vec![chain], key).unwrap())
}

fn serve<S: Read + Write>(mut stream: S, seen: &Mutex<Seen>) {
    let mut request = Vec::new();
    let mut part = [0_u8; 4096];
    while !is_whole(&request) {
        match stream.read(&mut part) {
            Ok(0) | Err(_) => return,
            Ok(count) => request.extend_from_slice(&part[..count]),
        }
    }
    let behaviour = {
        let mut seen = seen.lock().unwrap();
        seen.requests.push(String::from_utf8_lossy(&request).into_owned());
        seen.behaviour.unwrap()
    };
    let answer = match behaviour {
        Behaviour::Answers(status) => {
            format!("HTTP/1.1 {status} x\r\nLocation: /elsewhere\r\nContent-Length: 0\r\n\r\n")
        }
        Behaviour::IsNoHttp => "SSH-2.0-OpenSSH_9.2\r\n".to_owned(),
        Behaviour::Trickles => {
            for byte in std::iter::repeat_n(b'H', 60) {
                std::thread::sleep(Duration::from_secs(1));
                if stream.write_all(&[byte]).and_then(|()| stream.flush()).is_err() {
                    return;
                }
            }
            return;
        }
        Behaviour::Hangs => {
            std::thread::sleep(Duration::from_secs(120));
            return;
        }
    };
    let _gone = stream.write_all(answer.as_bytes()).and_then(|()| stream.flush());
}

fn is_whole(request: &[u8]) -> bool {
    let text = String::from_utf8_lossy(request).into_owned();
    let Some((head, body)) = text.split_once("\r\n\r\n") else { return false };
    let length = head.lines().find_map(|line| line.strip_prefix("Content-Length: ")?.parse::<usize>().ok());
    body.len() >= length.unwrap_or(0)
}
