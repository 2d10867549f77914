//! Streams, requests and liveness between processes. The only crate that names iceoryx2.
//!
//! Every cell has a [`Domain`] of its own: a prefix in shared memory and a directory, so that two cells on one machine never meet. A process
//! opens the domain once as a [`Bus`] and makes its ports from it:
//!
//! - [`Publisher`] and [`Subscriber`] of a stream of messages. A subscriber that falls behind loses the oldest messages and gets an error that says how many.
//! - [`Server`] and [`Client`] of a device's requests, each with a time limit.
//! - [`Signal`] and [`Listener`]: a notification without content, which never queues. A stop travels this way.
//!
//! A listener has a file descriptor: [`wait_any`] waits on several in a plain thread, [`AsyncListener`] on one in tokio.

mod async_listener;
mod bus;
mod domain;
mod error;
mod limits;
mod names;
mod node;
mod node_in_use;
mod publisher;
mod request;
mod senders;
mod service;
mod shape;
mod signal;
mod subscriber;

pub use async_listener::AsyncListener;
pub use bus::Bus;
pub use domain::Domain;
pub use error::{AnswerError, CallError, Cause, DomainError, EmitError, OpenError, ReceiveError};
pub use limits::{check_limits, open_files_allowed};
pub use node_in_use::NodeInUse;
pub use publisher::{Loan, Publisher};
pub use request::{Call, Client, IncomingRequest, ReplySlot, Server};
pub use service::LAYER_VERSION;
pub use shape::StreamShape;
pub use signal::{Listener, Signal, SignalError, wait_any};
pub use subscriber::Subscriber;
