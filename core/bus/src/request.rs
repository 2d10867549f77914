//! Requests to a device and their answers.

mod call;
mod client;
mod header;
mod server;
mod service;

pub use call::Call;
pub use client::Client;
pub use server::{IncomingRequest, ReplySlot, Server};
