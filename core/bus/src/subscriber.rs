//! A receiving end of a stream.

use std::fmt;

use iceoryx2::identifiers::UniquePublisherId;
use iceoryx2::port::subscriber::Subscriber as IceoryxSubscriber;
use iceoryx2::sample::Sample;
use plumb_plugin::message::{PREFIX_LENGTH, SEQUENCE_OFFSET};
use plumb_plugin::{Message, StreamDescription};

use crate::names::stream_name;
use crate::node::Node;
use crate::publisher::stream_service;
use crate::senders::Senders;
use crate::service::Service;
use crate::{OpenError, ReceiveError, StreamShape};

/// A receiving end of a stream. Messages come in order; a gap in their numbers is an error, reported once. A device that is started again goes on
/// on the same stream.
///
/// A receiver that opens after the sender gets the last message sent before, so that it knows how things are.
pub struct Subscriber {
    stream: String,
    port: IceoryxSubscriber<Service, [u64], ()>,
    senders: Senders<UniquePublisherId>,
    /// A message that came after a gap: returned by the call after the one that reported the gap.
    held: Option<Sample<Service, [u64], ()>>,
}

impl Subscriber {
    pub(crate) fn open(
        node: &Node,
        device: &str,
        stream: &StreamDescription,
        shape: StreamShape,
    ) -> Result<Self, OpenError> {
        let name = stream_name(device, stream);
        let what = format!("a receiving end of stream {name}");
        let port = stream_service(node, &name, stream, shape)?
            .subscriber_builder()
            .buffer_size(shape.depth)
            .history_request(1)
            .create()
            .map_err(|error| OpenError::new(&what, error))?;
        Ok(Self { stream: name, port, senders: Senders::default(), held: None })
    }

    /// `device/stream`.
    pub fn stream(&self) -> &str {
        &self.stream
    }

    /// Hands the next message's bytes to `read`; `None` when none waits.
    ///
    /// # Errors
    /// [`ReceiveError::Lost`] once; then the next call goes on with what is there.
    pub fn receive_with<R>(&mut self, read: impl FnOnce(&[u8]) -> R) -> Result<Option<R>, ReceiveError> {
        if let Some(sample) = self.held.take() {
            return Ok(Some(read(bytemuck::cast_slice(sample.payload()))));
        }
        let broken = |cause: &dyn fmt::Display| ReceiveError::Broken {
            stream: self.stream.clone(),
            cause: cause.to_string(),
        };
        let Some(sample) = self.port.receive().map_err(|error| broken(&error))? else { return Ok(None) };
        let bytes: &[u8] = bytemuck::cast_slice(sample.payload());
        let sequence = sequence_of(bytes)
            .ok_or_else(|| broken(&format!("a message of {} bytes has no number", bytes.len())))?;
        let sender = sample.header().publisher_id();
        match self.senders.missing_before(sender, sequence) {
            0 => Ok(Some(read(bytes))),
            count => {
                self.held = Some(sample);
                Err(ReceiveError::Lost { stream: self.stream.clone(), count })
            }
        }
    }

    /// The next message as its type; `None` when none waits.
    ///
    /// # Errors
    /// As [`Self::receive_with`], and [`ReceiveError::Length`] for a message of another layout.
    pub fn receive<M: Message>(&mut self) -> Result<Option<M>, ReceiveError> {
        let stream = self.stream.clone();
        self.receive_with(|bytes| {
            bytemuck::try_pod_read_unaligned(bytes).map_err(|_| ReceiveError::Length {
                stream,
                length: bytes.len(),
                expected: size_of::<M>(),
            })
        })?
        .transpose()
    }
}

fn sequence_of(message: &[u8]) -> Option<u64> {
    let bytes = message.get(SEQUENCE_OFFSET..PREFIX_LENGTH)?;
    Some(u64::from_ne_bytes(bytes.try_into().ok()?))
}

impl fmt::Debug for Subscriber {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Subscriber").field("stream", &self.stream).finish_non_exhaustive()
    }
}
