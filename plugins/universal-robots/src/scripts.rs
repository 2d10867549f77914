//! The connection that programs are sent on. A thread of its own reads it all the time: a controller whose words nobody reads may cut it.

use std::net::TcpStream;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use plumb_plugin::PluginError;

use crate::primary::{Messages, PrimaryMessage};
use crate::socket::{Found, connect, hear, send};

/// The error once the controller has ended this connection, whether a read or a write finds it.
const ENDED: &str = "the controller has ended the connection that programs are sent on";

/// As many texts of the controller's are kept until somebody looks.
const MOST_MESSAGES: usize = 100;

/// The connection.
#[derive(Debug)]
pub(crate) struct Scripts {
    stream: TcpStream,
    heard: Arc<Heard>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct Heard {
    closing: AtomicBool,
    book: Mutex<Book>,
    news: Condvar,
}

#[derive(Debug, Default)]
struct Book {
    messages: Vec<PrimaryMessage>,
    ended: Option<String>,
}

impl Scripts {
    /// Connects.
    ///
    /// # Errors
    /// [`PluginError::Disconnected`].
    pub(crate) fn connect(address: &str, port: u16) -> Result<Self, PluginError> {
        let stream = connect(address, port, "the script interface")?;
        let mut reading = stream.try_clone()?;
        let heard = Arc::new(Heard::default());
        let noted = Arc::clone(&heard);
        let thread = std::thread::spawn(move || noted.listen(&mut reading));
        Ok(Self { stream, heard, thread: Some(thread) })
    }

    /// Sends a program. It takes the place of the one that runs.
    ///
    /// # Errors
    /// [`PluginError::Disconnected`].
    pub(crate) fn send(&mut self, program: &str) -> Result<(), PluginError> {
        if let Some(ended) = self.ended() {
            return Err(PluginError::Disconnected(ended));
        }
        send(&mut self.stream, program.as_bytes(), ENDED, "a program could not be sent to the controller")
    }

    /// What the controller has said since this was asked last.
    pub(crate) fn take_messages(&self) -> Vec<PrimaryMessage> {
        std::mem::take(&mut self.heard.book().messages)
    }

    /// Waits until the controller has said something, or for this long.
    pub(crate) fn await_message(&self, within: Duration) {
        let book = self.heard.book();
        let silent = |book: &mut Book| book.messages.is_empty() && book.ended.is_none();
        // What it says is taken by another call.
        drop(self.heard.news.wait_timeout_while(book, within, silent));
    }

    /// Why the connection has ended, if it has.
    pub(crate) fn ended(&self) -> Option<String> {
        self.heard.book().ended.clone()
    }
}

impl Heard {
    fn book(&self) -> MutexGuard<'_, Book> {
        self.book.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn listen(&self, stream: &mut TcpStream) {
        let mut messages = Messages::default();
        let mut bytes = [0; 4096];
        while !self.closing.load(Ordering::Acquire) {
            let end = match hear(stream, &mut bytes) {
                Ok(Found::Nothing) => None,
                Ok(Found::End) => Some(ENDED.to_owned()),
                Ok(Found::Bytes(count)) => {
                    messages.push(bytes.get(..count).unwrap_or_default());
                    self.note(&mut messages)
                }
                Err(error) => Some(format!("the connection that programs are sent on broke: {error}")),
            };
            if let Some(end) = end {
                self.book().ended = Some(end);
                self.news.notify_all();
                return;
            }
        }
    }

    fn note(&self, messages: &mut Messages) -> Option<String> {
        loop {
            match messages.take() {
                Ok(Some(message)) => {
                    let mut book = self.book();
                    if book.messages.len() < MOST_MESSAGES {
                        book.messages.push(message);
                    }
                    self.news.notify_all();
                }
                Ok(None) => return None,
                Err(error) => return Some(format!("the script interface: {error}")),
            }
        }
    }
}

impl Drop for Scripts {
    fn drop(&mut self) {
        self.heard.closing.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            // It has panicked or ended: either way it reads no more.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reset_by_the_controller_is_its_end_of_the_connection() {
        let heard = Heard::default();
        heard.listen(&mut crate::socket::tests::reset());
        let ended = heard.book.lock().unwrap().ended.clone();
        assert_eq!(ended.as_deref(), Some(ENDED));
    }
}
