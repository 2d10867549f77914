//! One call across the contract: panics are caught, errors reported to the host.

use std::any::Any;
use std::cell::RefCell;
use std::ffi::c_void;
use std::panic::{self, AssertUnwindSafe};
use std::sync::{Arc, Once};

use bytemuck::Pod;
use plumb_abi::{Bytes, HostFunctions, Instance, Sink, Status};
use serde::Serialize;

use super::loaded_host::LoadedHost;
use crate::{Host, PluginError, Value};

/// What is behind the pointer the host hands back.
pub(super) struct Device<T> {
    device: T,
    host: LoadedHost,
    /// The message of a panic: from then on the device refuses every call, because it may be half changed.
    panic: Option<String>,
}

impl<T> Device<T> {
    /// Creates a device and writes the pointer to it.
    ///
    /// # Safety
    /// The arguments are those of the contract's `create`.
    pub(super) unsafe fn create(
        functions: *const HostFunctions,
        config: Bytes,
        instance: *mut *mut Instance,
        new: impl FnOnce(&Value, Host) -> Result<T, PluginError>,
    ) -> Status {
        // SAFETY: the contract keeps the table in place, and lends the configuration for this call.
        let (host, config) = unsafe { (LoadedHost::new(functions), config.as_slice()) };
        let Some(host) = host else { return Status::REFUSED };
        match caught(|| new(&json(config)?, Host::new(Arc::new(host)))) {
            Ok(device) => {
                let device = Box::new(Self { device, host, panic: None });
                // SAFETY: the contract gives a slot for the pointer.
                unsafe { instance.write(Box::into_raw(device).cast()) };
                Status::OK
            }
            Err(error) => reported(&host, Err(error)),
        }
    }

    /// Ends the device behind a pointer.
    ///
    /// # Safety
    /// The pointer came from [`Self::create`] of the same type, is used by nobody else, and is not used again.
    pub(super) unsafe fn destroy(instance: *mut Instance) {
        if instance.is_null() {
            return;
        }
        // SAFETY: promised by the caller.
        let device = unsafe { Box::from_raw(instance.cast::<Self>()) };
        if device.panic.is_some() {
            std::mem::forget(device);
            return;
        }
        let host = device.host;
        if let Err(error) = caught(|| {
            drop(device);
            Ok(())
        }) {
            host.fail(error.text());
        }
    }

    /// Calls the device behind a pointer; `work` says how a call that did not fail ended. The host learns why when it fails.
    ///
    /// # Safety
    /// The pointer came from [`Self::create`] of the same type and no other call on it is under way.
    pub(super) unsafe fn call(
        instance: *mut Instance,
        work: impl FnOnce(&mut T) -> Result<Status, PluginError>,
    ) -> Status {
        // SAFETY: promised by the caller.
        let Some(this) = (unsafe { instance.cast::<Self>().as_mut() }) else {
            return Status::REFUSED;
        };
        let result = match &this.panic {
            Some(text) => Err(PluginError::Panicked(format!("{text}; the device must be started anew"))),
            None => caught(|| work(&mut this.device)),
        };
        if let Err(PluginError::Panicked(text)) = &result
            && this.panic.is_none()
        {
            this.panic = Some(text.clone());
        }
        reported(&this.host, result)
    }
}

/// The status of a result; an error's text goes to the host.
fn reported(host: &LoadedHost, result: Result<Status, PluginError>) -> Status {
    match result {
        Ok(status) => status,
        Err(error) => {
            host.fail(error.text());
            error.status()
        }
    }
}

/// A configuration as JSON; nothing at all is null.
pub(super) fn json(config: &[u8]) -> Result<Value, PluginError> {
    if config.is_empty() {
        return Ok(Value::Null);
    }
    serde_json::from_slice(config)
        .map_err(|error| PluginError::Refused(format!("the configuration is not JSON: {error}")))
}

thread_local! {
    /// Where the panic that is unwinding this thread began.
    static LOCATION: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Does the work; a panic becomes an error that says where.
fn caught<R>(work: impl FnOnce() -> Result<R, PluginError>) -> Result<R, PluginError> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        panic::set_hook(Box::new(|information| {
            let folder =
                information.location().map(|folder| format!(" at {}:{}", folder.file(), folder.line()));
            LOCATION.set(Some(folder.unwrap_or_default()));
        }));
    });
    panic::catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|payload| {
        let folder = LOCATION.take().unwrap_or_default();
        Err(PluginError::Panicked(format!("the plugin panicked{folder}: {}", message_of(payload.as_ref()))))
    })
}

/// The text a panic was raised with.
fn message_of(payload: &(dyn Any + Send)) -> &str {
    let text = payload.downcast_ref::<&str>().copied();
    text.or_else(|| payload.downcast_ref::<String>().map(String::as_str)).unwrap_or("no message")
}

/// A call without a result.
pub(super) fn done(result: Result<(), PluginError>) -> Result<Status, PluginError> {
    result.map(|()| Status::OK)
}

/// What the host gave as an argument.
///
/// # Safety
/// The pointer is null or points to an `M` that stays for `'a`.
pub(super) unsafe fn given<'a, M>(message: *const c_void) -> Result<&'a M, PluginError> {
    // SAFETY: promised by the caller.
    unsafe { message.cast::<M>().as_ref() }
        .ok_or_else(|| PluginError::Refused("the host gave no argument".to_owned()))
}

/// Writes an answer to the host's sink, as JSON.
///
/// # Safety
/// The sink is the one of the call under way.
pub(super) unsafe fn answer(sink: *const Sink, value: &impl Serialize) -> Result<Status, PluginError> {
    let text = serde_json::to_vec(value).map_err(|error| PluginError::Failed(error.to_string()))?;
    // SAFETY: promised by the caller.
    let sink = unsafe { sink.as_ref() };
    let Some(Sink { context, write: Some(write) }) = sink else {
        return Err(PluginError::Refused("the host gave no sink for the answer".to_owned()));
    };
    // SAFETY: the sink's own function with its own context.
    unsafe { write(*context, Bytes::of(&text)) };
    Ok(Status::OK)
}

/// Copies a message to where the host wants it.
///
/// # Safety
/// The pointer is null or points to a `T` of the host's.
pub(super) unsafe fn deliver<T: Pod>(target: *mut c_void, message: T) -> Result<Status, PluginError> {
    // SAFETY: promised by the caller.
    match unsafe { target.cast::<T>().as_mut() } {
        Some(target) => {
            *target = message;
            Ok(Status::OK)
        }
        None => Err(PluginError::Refused("the host gave no memory for the message".to_owned())),
    }
}
