//! Where a plugin writes an answer of any length.

use core::ffi::c_void;

use crate::Bytes;

/// Where a plugin writes an answer of any length, so that neither side frees what the other allocated.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Sink {
    /// Handed back to `write`.
    pub context: *mut c_void,
    /// Takes the next piece of the answer; the pieces are joined. Only during the call the sink was given to.
    pub write: Option<unsafe extern "C" fn(context: *mut c_void, piece: Bytes)>,
}
