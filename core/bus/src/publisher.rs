//! The sending end of a stream.

use std::time::{Duration, Instant};
use std::{fmt, thread};

use iceoryx2::port::publisher::{Publisher as IceoryxPublisher, PublisherCreateError};
use iceoryx2::prelude::AttributeVerifier;
use iceoryx2::sample_mut::SampleMut;
use iceoryx2::service::attribute::{AttributeKey, AttributeValue};
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;
use plumb_plugin::StreamDescription;
use plumb_plugin::message::{PREFIX_LENGTH, SEQUENCE_OFFSET};

use crate::names::{stream_name, stream_service_name, stream_signal};
use crate::node::Node;
use crate::service::{Service, WORD};
use crate::{EmitError, OpenError, Signal, StreamShape};

/// The attribute of a stream's service that names the layout of its messages.
const MESSAGE_ATTRIBUTE: &str = "message";

/// How many processes may know a stream.
const MAX_NODES: usize = 24;

/// A device's own sender, and one that takes over before the dead one's port is free.
const MAX_PUBLISHERS: usize = 2;

/// How long a sender waits for the ports of its dead predecessors: those of a program killed a moment ago may still be ending.
const TAKING_OVER_TIME: Duration = Duration::from_secs(1);

/// The sending end of a stream. Writes each message's number and wakes anyone who listens.
pub struct Publisher {
    stream: String,
    shape: StreamShape,
    sequence: u64,
    port: IceoryxPublisher<Service, [u64], ()>,
    signal: Signal,
}

/// What `create` makes, asked again while every slot is taken and `wait`, which waits a little, says that it is not time to give up. After the last wait it is
/// asked once more.
fn once_a_slot_is_free<T>(
    mut create: impl FnMut() -> Result<T, PublisherCreateError>,
    mut wait: impl FnMut() -> bool,
) -> Result<T, PublisherCreateError> {
    let mut goes_on = true;
    loop {
        match create() {
            Err(PublisherCreateError::ExceedsMaxSupportedPublishers) if goes_on => goes_on = wait(),
            other => return other,
        }
    }
}

impl Publisher {
    pub(crate) fn open(
        node: &Node,
        device: &str,
        stream: &StreamDescription,
        shape: StreamShape,
    ) -> Result<Self, OpenError> {
        let name = stream_name(device, stream);
        let what = format!("the sending end of stream {name}");
        let service = stream_service(node, &name, stream, shape)?;
        let create = || {
            service
                .publisher_builder()
                .initial_max_slice_len(shape.max_bytes.div_ceil(WORD))
                .max_loaned_samples(1)
                .create()
        };
        let given_up = Instant::now() + TAKING_OVER_TIME;
        let port = once_a_slot_is_free(create, || {
            thread::sleep(TAKING_OVER_TIME / 100);
            node.clean_after_the_dead();
            Instant::now() < given_up
        });
        let port = port.map_err(|error| OpenError::new(&what, error))?;
        let signal = Signal::open(node, &stream_signal(&name))?;
        Ok(Self { stream: name, shape, sequence: 0, port, signal })
    }

    /// `device/stream`.
    pub fn stream(&self) -> &str {
        &self.stream
    }

    /// Sends a message given as its bytes.
    ///
    /// # Errors
    /// [`EmitError::Length`] for a length that is not the layout's.
    pub fn emit(&mut self, message: &[u8]) -> Result<(), EmitError> {
        let mut loan = self.loan(message.len())?;
        loan.bytes_mut().copy_from_slice(message);
        self.send(loan)
    }

    /// Lends `length` zeroed bytes of shared memory, aligned to 8, to build the next message in. One at a time.
    ///
    /// # Errors
    /// [`EmitError::Length`] for a length that is not the layout's, [`EmitError::Broken`] when one is lent already.
    pub fn loan(&self, length: usize) -> Result<Loan, EmitError> {
        self.check_length(length)?;
        let sample = self.port.loan_slice(length / WORD).map_err(|error| self.broken(error))?;
        Ok(Loan { sample })
    }

    /// Sends what was lent by this sender.
    ///
    /// # Errors
    /// [`EmitError::Broken`].
    pub fn send(&mut self, mut loan: Loan) -> Result<(), EmitError> {
        if let Some(number) = loan.bytes_mut().get_mut(SEQUENCE_OFFSET..PREFIX_LENGTH) {
            number.copy_from_slice(&self.sequence.to_ne_bytes());
        }
        loan.sample.send().map_err(|error| self.broken(error))?;
        self.sequence += 1;
        self.signal.notify().map_err(|error| self.broken(error))
    }

    fn check_length(&self, length: usize) -> Result<(), EmitError> {
        let wrong = |right| EmitError::Length { stream: self.stream.clone(), length, right };
        self.shape.check_length(length).map_err(wrong)
    }

    fn broken(&self, cause: impl fmt::Display) -> EmitError {
        EmitError::Broken { stream: self.stream.clone(), cause: cause.to_string() }
    }
}

/// Bytes of shared memory in which a message is built. Given back unsent when dropped.
pub struct Loan {
    sample: SampleMut<Service, [u64], ()>,
}

impl Loan {
    /// The message: zero at first, aligned to 8.
    pub fn bytes_mut(&mut self) -> &mut [u8] {
        bytemuck::cast_slice_mut(self.sample.payload_mut())
    }
}

impl fmt::Debug for Publisher {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Publisher").field("stream", &self.stream).finish_non_exhaustive()
    }
}

/// The service of a stream, made by the first that comes.
pub(crate) fn stream_service(
    node: &Node,
    name: &str,
    stream: &StreamDescription,
    shape: StreamShape,
) -> Result<PortFactory<Service, [u64], ()>, OpenError> {
    let what = format!("stream {name} of {} messages", stream.message);
    let key = AttributeKey::try_from(MESSAGE_ATTRIBUTE).map_err(|error| OpenError::new(&what, error))?;
    let layout =
        AttributeValue::try_from(stream.message.as_str()).map_err(|error| OpenError::new(&what, error))?;
    let attributes =
        AttributeVerifier::new().require(&key, &layout).map_err(|error| OpenError::new(&what, error))?;
    node.service(&what, &stream_service_name(name))?
        .publish_subscribe::<[u64]>()
        .enable_safe_overflow(true)
        .subscriber_max_buffer_size(shape.depth)
        .subscriber_max_borrowed_samples(1)
        .history_size(1)
        .max_subscribers(shape.receivers)
        .max_publishers(MAX_PUBLISHERS)
        .max_nodes(MAX_NODES)
        .open_or_create_with_attributes(&attributes)
        .map_err(|error| OpenError::new(&what, error))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TAKEN: Result<u32, PublisherCreateError> = Err(PublisherCreateError::ExceedsMaxSupportedPublishers);

    /// What comes of answers in turn where so many waits go on, and how often was waited.
    fn asked(
        answers: &[Result<u32, PublisherCreateError>],
        waits: u32,
    ) -> (Result<u32, PublisherCreateError>, u32) {
        let (mut answers, mut waited) = (answers.iter(), 0);
        let made = once_a_slot_is_free(
            || *answers.next().unwrap(),
            || {
                waited += 1;
                waited < waits
            },
        );
        (made, waited)
    }

    #[test]
    fn a_slot_that_becomes_free_while_it_is_waited_for_is_taken() {
        assert_eq!(asked(&[Ok(1)], 9), (Ok(1), 0), "a free place is not waited for");
        assert_eq!(asked(&[TAKEN, TAKEN, Ok(2)], 9), (Ok(2), 2));
        assert_eq!(asked(&[TAKEN, TAKEN, Ok(3)], 2), (Ok(3), 2), "also after the last wait");
        assert_eq!(asked(&[TAKEN; 3], 2), (TAKEN, 2), "then it is refused");
        let other = Err(PublisherCreateError::UnableToCreateDataSegment);
        assert_eq!(asked(&[TAKEN, other], 9), (other, 1), "what waiting does not mend is said at once");
    }
}
