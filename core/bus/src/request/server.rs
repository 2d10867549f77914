//! The end of a device that answers requests.

use std::fmt;
use std::time::Duration;

use iceoryx2::active_request::ActiveRequest;
use iceoryx2::port::server::Server as IceoryxServer;
use plumb_plugin::{PluginError, Reply, Request, WireError};

use super::call::Call;
use super::header::{ReplyHeader, RequestHeader, join, split, words};
use super::service::{MAX_BODY, request_service};
use crate::names::{reply_signal, request_signal};
use crate::node::Node;
use crate::service::Service;
use crate::{Cause, Listener, OpenError, Signal};

/// The end of a device that answers requests, in the order they came.
pub struct Server {
    device: String,
    port: IceoryxServer<Service, [u64], (), [u64], ()>,
    listener: Listener,
    signal: Signal,
}

/// A request that came in.
pub struct IncomingRequest {
    /// What is asked, or why its bytes cannot be understood: answer with that.
    pub request: Result<Request, WireError>,
    /// How it was made.
    pub call: Call,
    /// Where its answer goes.
    pub answer: ReplySlot,
}

/// Where one request's answer goes. A request that is dropped unanswered is seen by its asker as one without a host.
pub struct ReplySlot {
    request: ActiveRequest<Service, [u64], (), [u64], ()>,
}

impl Server {
    pub(crate) fn open(node: &Node, device: &str) -> Result<Self, OpenError> {
        let what = format!("the answering end of {device}");
        let listener = Listener::open(node, &request_signal(device))?;
        let signal = Signal::open(node, &reply_signal(device))?;
        let port = request_service(node, device)?
            .server_builder()
            .initial_max_slice_len(words::<ReplyHeader>(MAX_BODY))
            .max_loaned_responses_per_request(1)
            .create()
            .map_err(|error| OpenError::new(&what, error))?;
        Ok(Self { device: device.to_owned(), port, listener, signal })
    }

    /// The signal sent with every request, to wait for; drain it before receiving.
    pub fn listener(&self) -> &Listener {
        &self.listener
    }

    /// The next request; `None` when none waits. One whose asker has given up is passed over.
    ///
    /// # Errors
    /// [`OpenError`] when shared memory failed.
    pub fn receive(&self) -> Result<Option<IncomingRequest>, OpenError> {
        let received = self.port.receive();
        let Some(request) =
            received.map_err(|error| OpenError::new(&format!("a request to {}", self.device), error))?
        else {
            return Ok(None);
        };
        let Some((header, body)) = split::<RequestHeader>(request.payload()) else {
            let cause = format!("{} words are not a request", request.payload().len());
            let error = WireError::Body { operation: "a request", cause };
            let call = Call::within(Duration::ZERO);
            return Ok(Some(IncomingRequest { request: Err(error), call, answer: ReplySlot { request } }));
        };
        let call = Call { time_limit: Duration::from_nanos(header.time_limit_ns), span: header.span };
        let decoded = Request::decode(header.operation, body);
        Ok(Some(IncomingRequest { request: decoded, call, answer: ReplySlot { request } }))
    }

    /// Answers a request. An asker that is gone is no error.
    ///
    /// # Errors
    /// [`OpenError`] when shared memory failed.
    pub fn answer(&self, answer: ReplySlot, result: &Result<Reply, PluginError>) -> Result<(), OpenError> {
        let (mut code, mut status, mut body) = Reply::encode(result);
        if body.len() > MAX_BODY {
            let text = format!("the answer has {} bytes; an answer may have {MAX_BODY}", body.len());
            (code, status, body) = Reply::encode(&Err(PluginError::Failed(text)));
        }
        let header = ReplyHeader { code, status: status.0, body: body.len() as u32, reserved: 0 };
        let mut message = answer
            .request
            .loan_slice(words::<ReplyHeader>(body.len()))
            .map_err(|error| self.failed(error))?;
        join(message.payload_mut(), &header, &body);
        message.send().map_err(|error| self.failed(error))?;
        self.signal.notify().map_err(|error| self.failed(error))
    }
}

impl Server {
    fn failed(&self, source: impl Into<Cause>) -> OpenError {
        OpenError::new(&format!("an answer of {}", self.device), source)
    }
}

impl fmt::Debug for Server {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Server").field("device", &self.device).finish_non_exhaustive()
    }
}
