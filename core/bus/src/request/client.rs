//! An end that asks a device.

use std::fmt;
use std::time::{Duration, Instant};

use iceoryx2::port::client::Client as IceoryxClient;
use plumb_abi::Status;
use plumb_plugin::{Reply, Request};

use super::call::Call;
use super::header::{ReplyHeader, RequestHeader, join, split, words};
use super::service::{MAX_BODY, request_service};
use crate::names::{reply_signal, request_signal};
use crate::node::Node;
use crate::service::Service;
use crate::{AnswerError, CallError, Cause, Listener, OpenError, Signal};

/// An end that asks a device, one request at a time.
pub struct Client {
    device: String,
    port: IceoryxClient<Service, [u64], (), [u64], ()>,
    signal: Signal,
    listener: Listener,
}

impl Client {
    pub(crate) fn open(node: &Node, device: &str) -> Result<Self, OpenError> {
        let what = format!("an asking end of {device}");
        let signal = Signal::open(node, &request_signal(device))?;
        let listener = Listener::open(node, &reply_signal(device))?;
        let port = request_service(node, device)?
            .client_builder()
            .initial_max_slice_len(words::<RequestHeader>(MAX_BODY))
            .create()
            .map_err(|error| OpenError::new(&what, error))?;
        Ok(Self { device: device.to_owned(), port, signal, listener })
    }

    /// The device asked.
    pub fn device(&self) -> &str {
        &self.device
    }

    /// Asks, and waits for the answer.
    ///
    /// # Errors
    /// [`CallError::Refused`] with what the device answered; the others when no answer came.
    pub fn call(&self, request: &Request, call: Call) -> Result<Reply, CallError> {
        self.call_while(request, call, || true)
    }

    /// As [`Self::call`], and gives up with [`CallError::NoHost`] when `is_served` says that the device's host is gone.
    ///
    /// # Errors
    /// As [`Self::call`].
    pub fn call_while(
        &self,
        request: &Request,
        call: Call,
        is_served: impl Fn() -> bool,
    ) -> Result<Reply, CallError> {
        let name = request.name();
        let end = Instant::now() + call.time_limit;
        let (operation, body) = request.encode();
        if body.len() > MAX_BODY {
            let (device, length) = (self.device.clone(), body.len());
            return Err(CallError::TooLong { device, request: name, length, limit: MAX_BODY });
        }
        let time_limit_ns = u64::try_from(call.time_limit.as_nanos()).unwrap_or(u64::MAX);
        let header = RequestHeader { operation, body: body.len() as u32, span: call.span, time_limit_ns };
        let length = words::<RequestHeader>(body.len());
        let mut message = self.port.loan_slice(length).map_err(|error| self.broken(name, error))?;
        join(message.payload_mut(), &header, &body);
        let pending = message.send().map_err(|error| self.broken(name, error))?;
        if pending.number_of_server_connections() == 0 {
            return Err(CallError::NoHost { device: self.device.clone() });
        }
        self.signal.notify().map_err(|error| self.broken(name, error))?;
        loop {
            // Looked at before the answer is: a device that has answered lets go of the request at once.
            let is_awaited = pending.is_connected() && is_served();
            if let Some(response) = pending.receive().map_err(|error| self.broken(name, error))? {
                return self.understood(name, response.payload());
            }
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                let (device, limit) = (self.device.clone(), call.time_limit);
                return Err(CallError::TimedOut { device, request: name, limit });
            }
            if !is_awaited {
                return Err(CallError::NoHost { device: self.device.clone() });
            }
            self.listener.wait(left.min(LIVENESS_CHECK)).map_err(|error| self.broken(name, error))?;
        }
    }

    fn understood(&self, request: &'static str, words: &[u64]) -> Result<Reply, CallError> {
        let Some((header, body)) = split::<ReplyHeader>(words) else {
            return Err(self.not_understood(request, AnswerError::TooShort(words.len())));
        };
        Reply::decode(header.code, Status(header.status), body)
            .map_err(|error| self.not_understood(request, error.into()))?
            .map_err(CallError::Refused)
    }
}

impl Client {
    fn broken(&self, request: &'static str, source: impl Into<Cause>) -> CallError {
        CallError::Broken { device: self.device.clone(), request, source: source.into() }
    }

    fn not_understood(&self, request: &'static str, source: AnswerError) -> CallError {
        CallError::Answer { device: self.device.clone(), request, source }
    }
}

/// How often a waiting client looks whether the device is still served.
const LIVENESS_CHECK: Duration = Duration::from_millis(100);

impl fmt::Debug for Client {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Client").field("device", &self.device).finish_non_exhaustive()
    }
}
