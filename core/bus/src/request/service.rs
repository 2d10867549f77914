//! The service of a device's requests.

use iceoryx2::service::port_factory::request_response::PortFactory;

use crate::OpenError;
use crate::node::Node;
use crate::service::Service;

/// The longest body of a request or an answer in bytes: a description, or a reading with a few hundred edges.
pub(super) const MAX_BODY: usize = 64 * 1024;

/// How many may ask a device: the orchestrator, a second terminal, a few programs of the user's.
const MAX_CLIENTS: usize = 6;

/// How many processes may know a device's requests.
const MAX_NODES: usize = 16;

pub(super) type RequestService = PortFactory<Service, [u64], (), [u64], ()>;

/// The service of a device's requests, created by the process that opens it first.
pub(super) fn request_service(node: &Node, device: &str) -> Result<RequestService, OpenError> {
    let what = format!("the requests of {device}");
    node.service(&what, &format!("request/{device}"))?
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
        .map_err(|error| OpenError::new(&what, error))
}
