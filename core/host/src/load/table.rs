//! The table of functions a plugin gets, over the host's [`Context`].

use std::ffi::c_void;
use std::ptr;
use std::slice;

use plumb_abi::{Bytes, CONTRACT_MINOR, HostFunctions, Status};
use plumb_plugin::LogLevel;

use crate::context::Context;
use crate::flood::{LONGEST_TEXT, cut};

/// The table for a context. Both stay until the process ends.
pub(super) fn host_functions(context: &'static Context) -> &'static HostFunctions {
    Box::leak(Box::new(HostFunctions {
        size: size_of::<HostFunctions>() as u32,
        contract_minor: CONTRACT_MINOR,
        context: ptr::from_ref(context).cast_mut().cast(),
        log,
        fail,
        now_ns,
        should_stop,
        emit,
        loan,
        publish,
        receive,
        progress,
    }))
}

/// The context behind the pointer.
///
/// # Safety
/// The pointer is the table's own; anything else breaks the contract.
unsafe fn context<'a>(pointer: *mut c_void) -> &'a Context {
    // SAFETY: the table's pointer comes from a reference that stays until the process ends.
    unsafe { &*pointer.cast::<Context>() }
}

/// A text the plugin lends, with what is not UTF-8 replaced, and cut when it is longer than a line may be.
///
/// # Safety
/// As [`Bytes::as_slice`].
unsafe fn text<'a>(bytes: Bytes) -> std::borrow::Cow<'a, str> {
    // SAFETY: promised by the caller.
    let bytes = unsafe { bytes.as_slice() };
    if bytes.len() > LONGEST_TEXT { cut(bytes).into() } else { String::from_utf8_lossy(bytes) }
}

// SAFETY of all below: the contract makes the plugin pass its table's context, and lend what it passes for the length of the call.

unsafe extern "C" fn log(pointer: *mut c_void, level: u32, line: Bytes) {
    let level = match level {
        0 => LogLevel::Error,
        1 => LogLevel::Warn,
        2 => LogLevel::Info,
        _ => LogLevel::Debug,
    };
    // SAFETY: see above.
    unsafe { context(pointer).report(level, &text(line)) }
}

unsafe extern "C" fn fail(pointer: *mut c_void, why: Bytes) {
    // SAFETY: see above.
    unsafe { context(pointer).fail(&text(why)) }
}

unsafe extern "C" fn now_ns(pointer: *mut c_void) -> u64 {
    // SAFETY: see above.
    unsafe { context(pointer).clock.now_ns() }
}

unsafe extern "C" fn should_stop(pointer: *mut c_void) -> u32 {
    // SAFETY: see above.
    u32::from(unsafe { context(pointer).stop.is_asked() })
}

unsafe extern "C" fn emit(pointer: *mut c_void, stream: Bytes, message: Bytes) -> Status {
    // SAFETY: see above.
    unsafe { context(pointer).emit(&text(stream), message.as_slice()) }
}

unsafe extern "C" fn loan(
    pointer: *mut c_void,
    stream: Bytes,
    length: usize,
    message: *mut *mut u8,
) -> Status {
    // SAFETY: see above.
    match unsafe { context(pointer).loan(&text(stream), length) } {
        Ok(lent) => {
            // SAFETY: the contract gives a slot for the pointer.
            unsafe { message.write(lent) };
            Status::OK
        }
        Err(status) => status,
    }
}

unsafe extern "C" fn publish(pointer: *mut c_void, message: *mut u8, send: u32) -> Status {
    // SAFETY: see above.
    unsafe { context(pointer).publish(message, send != 0) }
}

unsafe extern "C" fn receive(
    pointer: *mut c_void,
    input: Bytes,
    message: *mut u8,
    capacity: usize,
    length: *mut usize,
) -> Status {
    // SAFETY: the contract gives `capacity` bytes at `message`, and a null pointer with none.
    let buffer =
        if message.is_null() { &mut [] } else { unsafe { slice::from_raw_parts_mut(message, capacity) } };
    // SAFETY: see above.
    match unsafe { context(pointer).receive(&text(input), buffer) } {
        Ok(received) => {
            // SAFETY: the contract gives a slot for the length.
            unsafe { length.write(received) };
            Status::OK
        }
        Err(status) => status,
    }
}

unsafe extern "C" fn progress(pointer: *mut c_void, fraction: f64, what: Bytes) {
    // SAFETY: see above.
    unsafe { context(pointer).progress(fraction, &text(what)) }
}
