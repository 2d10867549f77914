//! Requests as a browser sends them, by hand: what is tested is what goes over the wire.

use std::io::{ErrorKind, Read as _, Write as _};
use std::net::TcpStream;
use std::time::Duration;

use serde_json::Value;

/// Nothing asked here takes nearly as long.
const PATIENCE: Duration = Duration::from_secs(60);

/// Status and body of a request; `headers` end with a line break each. A body that is no JSON comes as text.
pub(crate) fn request(address: &str, method: &str, path: &str, headers: &str, body: &str) -> (u16, Value) {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    let text = format!(
        "{method} {path} HTTP/1.1\r\n{headers}Content-Type: application/json\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{body}",
        body.len()
    );
    // A server that refuses a long body early closes before all of it is written.
    let _written = stream.write_all(text.as_bytes());
    let answer = whole_answer(&mut stream);
    let status = answer.split(' ').nth(1).and_then(|status| status.parse().ok()).unwrap_or(0);
    let body = answer.split_once("\r\n\r\n").map_or("", |(_, body)| body);
    (status, serde_json::from_str(body).unwrap_or(Value::String(body.to_owned())))
}

/// Reads an answer to its end: as long as it says it is, since not every server closes when it is asked to.
fn whole_answer(stream: &mut TcpStream) -> String {
    let mut answer = Vec::new();
    let mut part = [0_u8; 8192];
    while !is_whole(&answer) {
        match stream.read(&mut part) {
            // A computer that was suspended interrupts a read that has a timeout.
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Ok(0) | Err(_) => break,
            Ok(count) => answer.extend_from_slice(&part[..count]),
        }
    }
    String::from_utf8_lossy(&answer).into_owned()
}

fn is_whole(answer: &[u8]) -> bool {
    let Some(end) = answer.windows(4).position(|four| four == b"\r\n\r\n") else { return false };
    let head = String::from_utf8_lossy(&answer[..end]).to_lowercase();
    let length =
        head.lines().find_map(|line| line.strip_prefix("content-length:")?.trim().parse::<usize>().ok());
    length.is_some_and(|length| answer.len() >= end + 4 + length)
}
