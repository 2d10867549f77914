//! A stream of a device, taken in by a step.

use std::path::Path;
use std::time::Duration;

use nix::time::{ClockId, clock_gettime};
use plumb_bus::{Bus, Listener, Subscriber};
use plumb_host::DeviceError;
use plumb_plugin::cell_clock::{CellTime, ClockReader};
use plumb_plugin::message::Layout;
use plumb_plugin::{PluginError, StreamDescription};

/// A stream of a device from the moment it was opened. The last message from before may still come with the first one sent after it: its date reports, held
/// against [`StreamLink::began_ns`].
pub trait StreamLink: Send {
    /// How its messages are laid out; none where only their plugin knows.
    fn layout(&self) -> Option<&Layout>;

    /// When it was opened, ns of the cell's clock; none where that cannot be read.
    fn began_ns(&self) -> Option<u64>;

    /// The next message; none when none comes within a time.
    ///
    /// # Errors
    /// [`DeviceError`], also when messages were lost.
    fn next(&mut self, within: Duration) -> Result<Option<Vec<u8>>, DeviceError>;
}

/// A stream in shared memory.
pub(super) struct HostedStream {
    device: String,
    layout: Option<Layout>,
    began_ns: Option<u64>,
    signal: Listener,
    subscriber: Subscriber,
}

impl HostedStream {
    /// Opens a stream. `clock` is the file in which a simulated world keeps the cell's clock.
    pub(super) fn open(
        bus: &Bus,
        device: &str,
        stream: &StreamDescription,
        clock: Option<&Path>,
    ) -> Result<Self, DeviceError> {
        let failed = |cause: &dyn std::fmt::Display| {
            DeviceError::refused(device, "listen", PluginError::Failed(cause.to_string()))
        };
        let signal = bus.stream_listener(device, stream).map_err(|error| failed(&error))?;
        let began_ns = cell_time_ns(clock);
        let mut subscriber = bus.subscriber(device, stream).map_err(|error| failed(&error))?;
        // The last message sent before is given to every new receiver: at once where the sender knows it already, else with the next message. It says how things
        // was, not how they are.
        while subscriber.receive_with(|_| ()).map_err(|error| failed(&error))?.is_some() {}
        Ok(Self { device: device.to_owned(), layout: Layout::of(stream), began_ns, signal, subscriber })
    }

    fn waiting(&mut self) -> Result<Option<Vec<u8>>, DeviceError> {
        let lost =
            |cause: String| DeviceError::refused(&self.device, "listen", PluginError::InputLost(cause));
        self.subscriber.receive_with(<[u8]>::to_vec).map_err(|error| lost(error.to_string()))
    }
}

impl StreamLink for HostedStream {
    fn layout(&self) -> Option<&Layout> {
        self.layout.as_ref()
    }

    fn began_ns(&self) -> Option<u64> {
        self.began_ns
    }

    fn next(&mut self, within: Duration) -> Result<Option<Vec<u8>>, DeviceError> {
        let broken = |cause: String| PluginError::Failed(cause);
        let failed = |device: &str, cause| DeviceError::refused(device, "listen", broken(cause));
        if let Some(message) = self.waiting()? {
            return Ok(Some(message));
        }
        self.signal.wait(within).map_err(|error| failed(&self.device, error.to_string()))?;
        self.signal.drain().map_err(|error| failed(&self.device, error.to_string()))?;
        self.waiting()
    }
}

/// The cell's clock now, ns: `CLOCK_MONOTONIC`, or what a simulated world says in its file.
fn cell_time_ns(clock: Option<&Path>) -> Option<u64> {
    let time = match clock {
        None => CellTime::MONOTONIC,
        Some(file) => ClockReader::open(file).ok()?.read().ok()?,
    };
    let monotonic = Duration::from(clock_gettime(ClockId::CLOCK_MONOTONIC).ok()?);
    Some(time.at(u64::try_from(monotonic.as_nanos()).ok()?))
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use plumb_bus::Domain;
    use plumb_plugin::cell_clock::ClockWriter;
    use plumb_plugin::{JointState, JointVector};

    use super::*;

    #[test]
    fn a_stream_gives_what_is_sent_after_it_was_opened_and_dates_show_what_is_from_before() {
        let directory = tempfile::tempdir().unwrap();
        let domain = Domain::of_cell(&directory.path().join("cell.yaml")).unwrap();
        let bus = Bus::open(&domain, "test").unwrap();
        let stream = StreamDescription::of::<JointState>("joints");
        let mut sender = bus.publisher("arm", &stream).unwrap();
        let mut send = |time_ns| {
            let state = JointState::new(time_ns, JointVector::zeros(6), false);
            sender.emit(bytemuck::bytes_of(&state)).unwrap();
        };
        send(1);
        let before = cell_time_ns(None).unwrap();
        let mut opened = HostedStream::open(&bus, "arm", &stream, None).unwrap();
        let began = opened.began_ns().unwrap();
        assert!(before <= began && began <= cell_time_ns(None).unwrap());
        assert_eq!(opened.layout().and_then(Layout::length), Some(size_of::<JointState>()));
        let begun = Instant::now();
        assert_eq!(opened.next(Duration::from_millis(60)).unwrap(), None, "nothing has been sent since");
        assert!(begun.elapsed() >= Duration::from_millis(60));
        send(began + 1);
        send(began + 2);
        let mut dates = Vec::new();
        while let Some(message) = opened.next(Duration::from_millis(200)).unwrap() {
            dates.push(bytemuck::pod_read_unaligned::<JointState>(&message).time_ns);
        }
        // The one from before comes with the first that is sent after it, and is recognised by its date.
        assert_eq!(dates, [1, began + 1, began + 2]);
        assert_eq!(opened.next(Duration::ZERO).unwrap(), None);
        drop((opened, sender, bus));
        domain.remove().unwrap();
    }

    #[test]
    fn the_cells_time_is_that_of_its_world() {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("clock");
        assert_eq!(cell_time_ns(Some(&file)), None, "no world has written it");
        let _writer = ClockWriter::create(&file, CellTime::Stopped { at_ns: 77 }).unwrap();
        assert_eq!(cell_time_ns(Some(&file)), Some(77));
    }
}
