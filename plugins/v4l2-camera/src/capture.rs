//! What is asked of a camera's driver, and what it answers: all that the rest knows of the kernel.

use std::time::Duration;

use crate::grey::Layout;

/// A camera that has been opened and configured: how its pictures are to come.
pub(crate) trait Capture: Send {
    /// How its pictures come.
    fn layout(&self) -> Layout;

    /// The next buffer, or none when none has come within `wait`.
    ///
    /// # Errors
    /// [`CaptureError`]; no more comes after one.
    fn next(&mut self, wait: Duration) -> Result<Option<Shot<'_>>, CaptureError>;
}

/// A buffer of the driver's, filled.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shot<'b> {
    pub(crate) bytes: &'b [u8],
    /// The driver's count of pictures; those that were lost are counted.
    pub(crate) number: u32,
    pub(crate) stamp: Stamp,
    /// The driver says that what it holds is not to be trusted.
    pub(crate) damaged: bool,
}

/// When a picture was taken, ns of `CLOCK_MONOTONIC`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stamp {
    /// The shutter opened.
    Opened(u64),
    /// The whole of it had arrived.
    Arrived(u64),
    /// The driver goes by another clock.
    Unknown,
}

/// Why no more pictures come.
#[derive(Debug, thiserror::Error)]
pub(crate) enum CaptureError {
    /// The device is gone.
    #[error("it is gone: its cable is out, or it has lost its power. Connect it and start the device again")]
    Unplugged,
    /// Anything else.
    #[error("{0}")]
    System(std::io::Error),
}
