//! The dashboard server: a line asked, a line answered.
//!
//! <https://www.universal-robots.com/how-tos-and-faqs/how-to/ur-how-tos/dashboard-server-port-29999-15690/>

use std::net::TcpStream;
use std::time::Instant;

use plumb_plugin::PluginError;

use crate::socket::{ANSWERS_WITHIN, Found, connect, hear, send};

/// The error once the server has ended the connection, whether a read or a write finds it.
const ENDED: &str = "the dashboard server ended the connection";

/// The longest answer, bytes.
const LONGEST: usize = 4096;

/// Asks one question, or gives one command.
///
/// # Errors
/// [`PluginError::Disconnected`], [`PluginError::TimedOut`].
pub(crate) fn ask(address: &str, port: u16, question: &str) -> Result<String, PluginError> {
    let mut stream = connect(address, port, "the dashboard server")?;
    let mut heard = Vec::new();
    // It greets anyone who connects.
    line(&mut stream, &mut heard)?;
    let asked = format!("{question}\n");
    send(&mut stream, asked.as_bytes(), ENDED, "nothing can be sent to the dashboard server")?;
    line(&mut stream, &mut heard)
}

fn line(stream: &mut TcpStream, heard: &mut Vec<u8>) -> Result<String, PluginError> {
    let begin = Instant::now();
    let mut bytes = [0; 512];
    loop {
        if let Some(end) = heard.iter().position(|byte| *byte == b'\n') {
            let line: Vec<u8> = heard.drain(..=end).collect();
            return Ok(String::from_utf8_lossy(&line).trim().to_owned());
        }
        if begin.elapsed() > ANSWERS_WITHIN || heard.len() > LONGEST {
            return Err(PluginError::TimedOut("the dashboard server did not answer with a line".to_owned()));
        }
        match hear(stream, &mut bytes)? {
            Found::Nothing => {}
            Found::End => return Err(PluginError::Disconnected(ENDED.to_owned())),
            Found::Bytes(count) => heard.extend_from_slice(bytes.get(..count).unwrap_or_default()),
        }
    }
}
