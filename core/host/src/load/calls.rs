//! The C functions of a loaded plugin, made safe to call: one method for each line of the table of operations.

use std::ffi::c_void;
use std::ptr;

use bytemuck::Pod;
use plumb_abi::{Bytes, Instance, RobotFunctions, SensorFunctions, Sink, Status};
use plumb_plugin::{PluginError, argument_type, owned_type};
use serde::de::DeserializeOwned;

use crate::context::Context;
use crate::flood::LONGEST_ANSWER;

/// The functions of a device, to be called one at a time. What every call relies on: the instance is the plugin's own, this is the thread that
/// created it, and no other call is under way.
pub(crate) struct Calls<'a, Table> {
    pub(super) table: &'a Table,
    pub(super) instance: *mut Instance,
    pub(super) context: &'static Context,
}

/// What a call gives when the plugin has no such function.
macro_rules! absent {
    (implied $name:ident) => {
        Ok(())
    };
    ($need:ident $name:ident) => {
        Err(PluginError::unsupported(&stringify!($name).replace('_', " ")))
    };
}

/// What a call gives, by how the function puts its result.
macro_rules! result_type {
    () => { () };
    (writes_when_seen $Message:ident) => { Option<owned_type!($Message)> };
    ($result:ident $Message:ident) => { owned_type!($Message) };
}

/// An argument in the form that is lent to C for the call.
macro_rules! kept {
    ($argument:ident: bool) => {
        u32::from($argument)
    };
    ($argument:ident: Value) => {
        $argument.to_string()
    };
    ($argument:ident: $Other:ident) => {
        $argument
    };
}

/// An argument as C takes it.
macro_rules! passed {
    ($argument:ident: u64) => {
        $argument
    };
    ($argument:ident: bool) => {
        $argument
    };
    ($argument:ident: Value) => {
        Bytes::of_text(&$argument)
    };
    ($argument:ident: $Message:ident) => {
        ptr::from_ref($argument).cast()
    };
}

/// Calls a function of the table, by how it puts its result.
macro_rules! call {
    ($this:ident, $function:ident($($argument:ident: $Argument:ident)?)) => {
        // SAFETY: as `Calls` says; the argument outlives the call.
        $this.call(|| unsafe { $function($this.instance $(, passed!($argument: $Argument))?) })
    };
    ($this:ident, $function:ident($($argument:ident: $Argument:ident)?) fills $message:ident) => {
        // SAFETY: as `Calls` says; the argument outlives the call.
        $this.filled(|message| unsafe { $function($this.instance $(, passed!($argument: $Argument))?, message) })
    };
    ($this:ident, $function:ident($($argument:ident: $Argument:ident)?) writes $message:ident) => {
        // SAFETY: as `Calls` says; the argument outlives the call.
        $this
            .written(|sink| unsafe { $function($this.instance $(, passed!($argument: $Argument))?, sink) })
            .and_then(|answer| parsed(stringify!($message), &answer))
    };
    ($this:ident, $function:ident($($argument:ident: $Argument:ident)?) writes_when_seen $message:ident) => {{
        let mut is_seen = true;
        let answer = $this.written(|sink| {
            // SAFETY: as `Calls` says; the argument outlives the call.
            let status = unsafe { $function($this.instance $(, passed!($argument: $Argument))?, sink) };
            is_seen = status != Status::EMPTY;
            if is_seen { status } else { Status::OK }
        })?;
        if is_seen { parsed(stringify!($message), &answer).map(Some) } else { Ok(None) }
    }};
}

macro_rules! calls_of {
    ($Table:ident {
        $(
            $(#[doc = $doc:literal])* $need:ident $name:ident($($argument:ident: $Argument:ident)?) $($result:ident $message:ident: $Message:ident)?
            $(, asked $code:literal $Variant:ident $title:literal -> $Answer:tt within $limit:ident $way:ident)?;
        )*
    }) => {
        impl Calls<'_, $Table> {
            $(
                $(#[doc = $doc])*
                pub(crate) fn $name(
                    &self
                    $(, $argument: argument_type!($Argument))?
                ) -> Result<result_type!($($result $Message)?), PluginError> {
                    let Some(function) = self.table.$name else { return absent!($need $name) };
                    $(let $argument = kept!($argument: $Argument);)?
                    call!(self, function($($argument: $Argument)?) $($result $message)?)
                }
            )*
        }
    };
}

macro_rules! calls {
    (common { $($common:tt)* } robot { $($robot:tt)* } sensor { $($sensor:tt)* }) => {
        calls_of! { RobotFunctions { $($robot)* } }
        calls_of! { SensorFunctions { $($sensor)* } }
    };
}

plumb_abi::device_operations!(calls);

impl<Table> Calls<'_, Table> {
    /// One call of the plugin.
    fn call(&self, function: impl FnOnce() -> Status) -> Result<(), PluginError> {
        checked(self.context, function())
    }

    /// One call that fills in a message.
    fn filled<M: Pod>(&self, function: impl FnOnce(*mut c_void) -> Status) -> Result<M, PluginError> {
        let mut message = M::zeroed();
        self.call(|| function(ptr::from_mut(&mut message).cast()))?;
        Ok(message)
    }

    /// One call that writes an answer.
    fn written(&self, function: impl FnOnce(*const Sink) -> Status) -> Result<Vec<u8>, PluginError> {
        let mut answer = Answer { bytes: Vec::new(), length: 0 };
        let sink = Sink { context: ptr::from_mut(&mut answer).cast(), write: Some(append) };
        self.call(|| function(&raw const sink))?;
        if answer.length > LONGEST_ANSWER {
            return Err(PluginError::Failed(format!(
                "the plugin's answer has {} bytes; it may have {LONGEST_ANSWER}",
                answer.length
            )));
        }
        Ok(answer.bytes)
    }
}

/// The error of a status, with the text the plugin gave.
pub(super) fn checked(context: &Context, status: Status) -> Result<(), PluginError> {
    let text = context.take_failure();
    match status {
        Status::OK => Ok(()),
        other => Err(PluginError::from_status(
            other,
            text.unwrap_or_else(|| "the plugin does not say why".to_owned()),
        )),
    }
}

fn parsed<T: DeserializeOwned>(what: &str, answer: &[u8]) -> Result<T, PluginError> {
    serde_json::from_slice(answer)
        .map_err(|error| PluginError::Failed(format!("the plugin's {what} cannot be understood: {error}")))
}

/// An answer as it is written piece by piece: no more of it is kept than an answer may have.
struct Answer {
    bytes: Vec<u8>,
    length: usize,
}

/// Appends a piece to an answer.
unsafe extern "C" fn append(context: *mut c_void, piece: Bytes) {
    // SAFETY: the context is the answer of the call under way, which nothing else uses meanwhile; the piece is lent for this call.
    unsafe {
        if let Some(answer) = context.cast::<Answer>().as_mut() {
            let piece = piece.as_slice();
            answer.length = answer.length.saturating_add(piece.len());
            if answer.length <= LONGEST_ANSWER {
                answer.bytes.extend_from_slice(piece);
            }
        }
    }
}
