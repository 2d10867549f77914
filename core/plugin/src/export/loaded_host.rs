//! The host as a loaded plugin sees it: its table of C functions.

use std::ptr;

use plumb_abi::{Bytes, HostFunctions, Status};

use crate::{HostInterface, LogLevel, PluginError};

/// The host's table of functions. It stays until the process ends.
#[derive(Clone, Copy)]
pub(super) struct LoadedHost {
    functions: &'static HostFunctions,
}

// SAFETY: the contract lets every function be called from any thread, with the same context.
unsafe impl Send for LoadedHost {}
// SAFETY: as above.
unsafe impl Sync for LoadedHost {}

impl LoadedHost {
    /// The host behind a pointer given to `create`; `None` for null.
    ///
    /// # Safety
    /// The pointer is null or points to a table that stays until the process ends.
    pub(super) unsafe fn new(functions: *const HostFunctions) -> Option<Self> {
        // SAFETY: promised by the caller.
        unsafe { functions.as_ref() }.map(|functions| Self { functions })
    }

    /// Says why the call that is about to end failed.
    pub(super) fn fail(&self, text: &str) {
        // SAFETY: the host's own function with its own context, as in every call below.
        unsafe { (self.functions.fail)(self.functions.context, Bytes::of_text(text)) }
    }
}

/// The error of a host function's status; `what` says which call.
fn checked(status: Status, what: impl FnOnce() -> String) -> Result<(), PluginError> {
    match status {
        Status::OK => Ok(()),
        other => Err(PluginError::from_status(other, what())),
    }
}

impl HostInterface for LoadedHost {
    fn log(&self, level: LogLevel, text: &str) {
        // SAFETY: see `fail`.
        unsafe { (self.functions.log)(self.functions.context, level as u32, Bytes::of_text(text)) }
    }

    fn now_ns(&self) -> u64 {
        // SAFETY: see `fail`.
        unsafe { (self.functions.now_ns)(self.functions.context) }
    }

    fn should_stop(&self) -> bool {
        // SAFETY: see `fail`.
        unsafe { (self.functions.should_stop)(self.functions.context) != 0 }
    }

    fn emit(&self, stream: &str, message: &[u8]) -> Result<(), PluginError> {
        // SAFETY: see `fail`; both texts outlive the call.
        let status = unsafe {
            (self.functions.emit)(self.functions.context, Bytes::of_text(stream), Bytes::of(message))
        };
        checked(status, || {
            format!("the host did not emit a message of {} bytes on '{stream}'", message.len())
        })
    }

    fn emit_in_place(
        &self,
        stream: &str,
        length: usize,
        fill: &mut dyn FnMut(&mut [u8]) -> Result<(), PluginError>,
    ) -> Result<(), PluginError> {
        let mut lent = ptr::null_mut();
        // SAFETY: see `fail`; the pointer is written before the call returns.
        let status = unsafe {
            (self.functions.loan)(self.functions.context, Bytes::of_text(stream), length, &raw mut lent)
        };
        checked(status, || format!("the host lent no {length} bytes for '{stream}'"))?;
        if lent.is_null() {
            return Err(PluginError::Failed(format!("the host lent nothing for '{stream}'")));
        }
        // SAFETY: the host lent `length` initialised bytes until they are published, and nobody else has them.
        let filled = fill(unsafe { std::slice::from_raw_parts_mut(lent, length) });
        // SAFETY: see `fail`; the pointer is the one lent, and it is not used again.
        let status =
            unsafe { (self.functions.publish)(self.functions.context, lent, u32::from(filled.is_ok())) };
        filled?;
        checked(status, || format!("the host did not emit the message built for '{stream}'"))
    }

    fn receive(&self, input: &str, message: &mut [u8]) -> Result<Option<usize>, PluginError> {
        let mut length = 0;
        // SAFETY: see `fail`; the host writes at most `message.len()` bytes.
        let status = unsafe {
            (self.functions.receive)(
                self.functions.context,
                Bytes::of_text(input),
                message.as_mut_ptr(),
                message.len(),
                &raw mut length,
            )
        };
        match status {
            Status::EMPTY => Ok(None),
            Status::INPUT_LOST => Err(PluginError::InputLost(format!(
                "messages of input '{input}' were lost: it was not read fast enough"
            ))),
            other => checked(other, || {
                format!("input '{input}' is not wired, or its message is longer than {} bytes", message.len())
            })
            .map(|()| Some(length)),
        }
    }

    fn progress(&self, fraction: f64, text: &str) {
        // SAFETY: see `fail`.
        unsafe { (self.functions.progress)(self.functions.context, fraction, Bytes::of_text(text)) }
    }
}
