//! A device asked by the orchestrator.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use plumb_bus::{AnswerError, Call, CallError, Client, OpenError};
use plumb_plugin::{
    Answer, Description, DeviceState, Reply, Request, RobotDescription, SensorDescription, argument_type,
    owned_type,
};

use super::DeviceError;
use super::shared::Shared;
use crate::time_limits::{CALIBRATION, PREPARATION, SHORT, UNDER_DEBUGGER};

/// Asks a device, one thing at a time.
struct Connection {
    shared: Arc<Shared>,
    client: Mutex<Client>,
}

/// Asks a robot. Every call waits for its answer.
pub struct RobotClient(Connection);

/// Asks a sensor. Every call waits for its answer.
pub struct SensorClient(Connection);

impl Connection {
    fn open(shared: Arc<Shared>) -> Result<Self, OpenError> {
        let client = Mutex::new(shared.bus.client(&shared.device)?);
        Ok(Self { shared, client })
    }

    fn ask(&self, request: &Request, time_limit: Duration) -> Result<Reply, DeviceError> {
        let device = self.shared.device.as_str();
        let died = |reason| DeviceError::HostDied {
            device: device.to_owned(),
            operation: request.name(),
            reason: Box::new(reason),
        };
        if let Some(reason) = self.shared.end() {
            return Err(died(reason));
        }
        let time_limit = if self.shared.under_debugger { UNDER_DEBUGGER } else { time_limit };
        // What the host and its plugin say meanwhile is logged in this span, inside that of the step.
        let _called = tracing::debug_span!("call", device, request = request.name()).entered();
        let span = self.shared.spans.enter_current();
        let call = Call { time_limit, span: span.number() };
        let client = self.client.lock().unwrap_or_else(PoisonError::into_inner);
        let result = client.call_while(request, call, || self.shared.end().is_none());
        match result {
            Ok(reply) => Ok(reply),
            Err(CallError::NoHost { .. }) => match self.shared.wait_for_end(END_NOTICED) {
                Some(reason) => Err(died(reason)),
                None => {
                    let error = CallError::NoHost { device: device.to_owned() };
                    Err(DeviceError::from_call(device, request.name(), error))
                }
            },
            Err(error) => Err(DeviceError::from_call(device, request.name(), error)),
        }
    }

    /// Asks, and takes the content out of the reply.
    fn ask_for<T: Answer>(&self, request: &Request, time_limit: Duration) -> Result<T, DeviceError> {
        let reply = self.ask(request, time_limit)?;
        let kind = reply.name();
        T::from_reply(reply).ok_or_else(|| self.other_reply(request, kind))
    }

    fn description(&self) -> Result<Description, DeviceError> {
        self.ask_for::<Box<Description>>(&Request::Describe, SHORT).map(|description| *description)
    }

    /// The error of an answer that belongs to another request; `kind` says what it is.
    fn other_reply(&self, request: &Request, kind: &'static str) -> DeviceError {
        let (device, request) = (self.shared.device.as_str(), request.name());
        let source = AnswerError::OtherReply(kind);
        let error = CallError::Answer { device: device.to_owned(), request, source };
        DeviceError::from_call(device, request, error)
    }
}

/// How long after a host's end its client knows of it.
const END_NOTICED: Duration = Duration::from_secs(1);

/// What either kind of device can be asked, without a function of its own.
macro_rules! common_requests {
    ($Client:ident, $Kind:ident, $Description:ident) => {
        impl $Client {
            pub(super) fn open(shared: Arc<Shared>) -> Result<Self, OpenError> {
                Connection::open(shared).map(Self)
            }

            /// The device's name.
            pub fn device(&self) -> &str {
                &self.0.shared.device
            }

            /// What it says about itself.
            ///
            /// # Errors
            /// [`DeviceError`], as every call below.
            pub fn describe(&self) -> Result<$Description, DeviceError> {
                match self.0.description()? {
                    Description::$Kind(description) => Ok(description),
                    _ => Err(self
                        .0
                        .other_reply(&Request::Describe, "the description of another kind of device")),
                }
            }

            /// The state the device is in.
            ///
            /// # Errors
            /// [`DeviceError`].
            pub fn state(&self) -> Result<DeviceState, DeviceError> {
                self.0.ask_for(&Request::State, PREPARATION)
            }

            /// Makes it ready, and takes back an earlier stop.
            ///
            /// # Errors
            /// [`DeviceError`].
            pub fn activate(&self) -> Result<DeviceState, DeviceError> {
                self.0.ask_for(&Request::Activate, PREPARATION)
            }

            /// Brings it to rest.
            ///
            /// # Errors
            /// [`DeviceError`].
            pub fn deactivate(&self) -> Result<DeviceState, DeviceError> {
                self.0.ask_for(&Request::Deactivate, PREPARATION)
            }
        }
    };
}

common_requests!(RobotClient, Robot, RobotDescription);
common_requests!(SensorClient, Sensor, SensorDescription);

/// An argument as it goes into a request.
macro_rules! owned {
    ($argument:ident: u64) => {
        $argument
    };
    ($argument:ident: bool) => {
        $argument
    };
    ($argument:ident: $Type:ident) => {
        $argument.to_owned()
    };
}

/// One method, for one line of the table of operations.
macro_rules! method {
    (robot $($line:tt)*) => {
        impl RobotClient {
            method! { @of $($line)* }
        }
    };
    (sensor $($line:tt)*) => {
        impl SensorClient {
            method! { @of $($line)* }
        }
    };
    (@of $(#[doc = $doc:literal])* $Variant:ident $name:ident($($argument:ident: $Argument:ident)?) -> $Answer:tt within CALLER) => {
        $(#[doc = $doc])*
        ///
        /// # Errors
        /// [`DeviceError`]; after `time_limit` without an answer the device may still be at it.
        pub fn $name(
            &self,
            $($argument: argument_type!($Argument),)?
            time_limit: Duration,
        ) -> Result<owned_type!($Answer), DeviceError> {
            self.0.ask_for(&Request::$Variant$((owned!($argument: $Argument)))?, time_limit)
        }
    };
    (@of $(#[doc = $doc:literal])* $Variant:ident $name:ident($($argument:ident: $Argument:ident)?) -> $Answer:tt within $limit:ident) => {
        $(#[doc = $doc])*
        ///
        /// # Errors
        /// [`DeviceError`].
        pub fn $name(&self $(, $argument: argument_type!($Argument))?) -> Result<owned_type!($Answer), DeviceError> {
            self.0.ask_for(&Request::$Variant$((owned!($argument: $Argument)))?, $limit)
        }
    };
}

macro_rules! methods {
    (
        common { $($common:tt)* }
        operations { $(
            $kind:ident $(#[doc = $doc:literal])* $code:literal $Variant:ident $title:literal
            $name:ident($($argument:ident: $Argument:ident)?) -> $Answer:tt within $limit:ident $way:ident;
        )* }
    ) => {
        $(method! { $kind $(#[doc = $doc])* $Variant $name($($argument: $Argument)?) -> $Answer within $limit })*
    };
}

plumb_abi::device_requests!(methods);
