//! What the host offers a plugin.

use core::ffi::c_void;

use crate::{Bytes, Status};

/// What the host offers a plugin. The table and `context` stay until the process ends. Every function may be called from any thread, and
/// `context` is its first argument.
#[repr(C)]
#[derive(Debug)]
pub struct HostFunctions {
    /// The size of this struct in bytes as the host knows it.
    pub size: u32,
    /// The [`CONTRACT_MINOR`](crate::CONTRACT_MINOR) of the host.
    pub contract_minor: u32,
    /// Handed back to every function.
    pub context: *mut c_void,
    /// Writes a line to the log: level 0 error, 1 warning, 2 info, 3 debug.
    pub log: unsafe extern "C" fn(context: *mut c_void, level: u32, text: Bytes),
    /// Says why the call that is about to return another status than OK failed. The last text counts.
    pub fail: unsafe extern "C" fn(context: *mut c_void, text: Bytes),
    /// The time of the cell's clock, ns: `CLOCK_MONOTONIC`, or the time of a simulated world that runs faster than the wall.
    pub now_ns: unsafe extern "C" fn(context: *mut c_void) -> u64,
    /// 1 when a stop has been asked for, else 0. A long call looks at least every 50 ms.
    pub should_stop: unsafe extern "C" fn(context: *mut c_void) -> u32,
    /// Emits a message on a stream. The message is copied.
    pub emit: unsafe extern "C" fn(context: *mut c_void, stream: Bytes, message: Bytes) -> Status,
    /// Lends `length` bytes of shared memory, aligned to 8, for the next message of a stream: written to `*message`. At most one at a time.
    pub loan: unsafe extern "C" fn(
        context: *mut c_void,
        stream: Bytes,
        length: usize,
        message: *mut *mut u8,
    ) -> Status,
    /// Emits what was lent, when `send` is 1, or gives it back unsent. On the thread that called `loan`.
    pub publish: unsafe extern "C" fn(context: *mut c_void, message: *mut u8, send: u32) -> Status,
    /// Copies the next message of a wired input to `message` and its length to `*length`; [`Status::EMPTY`] when none waits.
    pub receive: unsafe extern "C" fn(
        context: *mut c_void,
        input: Bytes,
        message: *mut u8,
        capacity: usize,
        length: *mut usize,
    ) -> Status,
    /// Reports how far a long call has come, from 0 to 1, and what it does now.
    pub progress: unsafe extern "C" fn(context: *mut c_void, fraction: f64, text: Bytes),
}
