//! Requests to a device and their answers.

mod client;
mod header;
mod server;

pub use client::{Call, Client};
pub use server::{Answer, Asked, Server};

use iceoryx2::service::port_factory::request_response::PortFactory;

use crate::bus::{Service, service_name};
use crate::{Bus, OpenError};
use header::{ReplyHeader, RequestHeader};

/// The longest body of a request or an answer in bytes: a description, or a reading with a few hundred edges.
const MAX_BODY: usize = 64 * 1024;

/// How many may ask a device: the orchestrator, a second terminal, a few programs of the user's.
const MAX_CLIENTS: usize = 6;

/// How many processes may know a device's requests.
const MAX_NODES: usize = 16;

type RequestService = PortFactory<Service, [u64], (), [u64], ()>;

/// The service of a device's requests, made by whoever comes first.
fn request_service(bus: &Bus, device: &str) -> Result<RequestService, OpenError> {
    let what = format!("the requests of {device}");
    bus.node()
        .service_builder(&service_name(&what, &format!("request/{device}"))?)
        .request_response::<[u64], [u64]>()
        .enable_safe_overflow_for_requests(false)
        .enable_safe_overflow_for_responses(false)
        .enable_fire_and_forget_requests(false)
        .max_active_requests_per_client(2)
        .max_loaned_requests(1)
        .max_response_buffer_size(1)
        .max_borrowed_responses_per_pending_response(1)
        .max_servers(2)
        .max_clients(MAX_CLIENTS)
        .max_nodes(MAX_NODES)
        .open_or_create()
        .map_err(|error| OpenError::new(&what, format!("{error:?}")))
}

pub(crate) fn request_signal(device: &str) -> String {
    format!("request/{device}")
}

pub(crate) fn reply_signal(device: &str) -> String {
    format!("reply/{device}")
}
