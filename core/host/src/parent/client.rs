//! A device asked by the orchestrator.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use plumb_bus::{Call, CallError, Client, OpenError};
use plumb_plugin::{
    Description, DeviceState, DigitalInputs, JogState, JointState, JointVector, Motion, Reading, Reply,
    Request, RobotDescription, SensorDescription, Value,
};

use super::DeviceError;
use super::shared::Shared;
use crate::time_limits::{CALIBRATION, PREPARATION, SHORT, UNDER_DEBUGGER};

/// Asks a device, one thing at a time.
struct Asking {
    shared: Arc<Shared>,
    client: Mutex<Client>,
}

/// Asks a robot. Every call waits for its answer.
pub struct RobotClient(Asking);

/// Asks a sensor. Every call waits for its answer.
pub struct SensorClient(Asking);

impl Asking {
    fn open(shared: Arc<Shared>) -> Result<Self, OpenError> {
        let client = Mutex::new(shared.bus.client(&shared.device)?);
        Ok(Self { shared, client })
    }

    fn ask(&self, request: &Request, time_limit: Duration) -> Result<Reply, DeviceError> {
        let device = self.shared.device.as_str();
        let died = |reason| DeviceError::HostDied { device: device.to_owned(), reason };
        if let Some(reason) = self.shared.end() {
            return Err(died(reason));
        }
        let time_limit = if self.shared.under_debugger { UNDER_DEBUGGER } else { time_limit };
        let span = self.shared.spans.enter_current();
        let call = Call { time_limit, span: span.number() };
        let client = self.client.lock().unwrap_or_else(PoisonError::into_inner);
        let result = client.call_while(request, call, || self.shared.end().is_none());
        match result {
            Ok(reply) => Ok(reply),
            Err(CallError::NoHost { .. }) => match self.shared.wait_for_end(END_NOTICED) {
                Some(reason) => Err(died(reason)),
                None => Err(DeviceError::Bus(CallError::NoHost { device: device.to_owned() })),
            },
            Err(error) => Err(DeviceError::from_call(device, request.name(), error)),
        }
    }

    fn expect<T>(
        &self,
        request: &Request,
        time_limit: Duration,
        wanted: impl FnOnce(Reply) -> Option<T>,
    ) -> Result<T, DeviceError> {
        let reply = self.ask(request, time_limit)?;
        let kind = reply.name();
        wanted(reply).ok_or_else(|| {
            let (device, request) = (self.shared.device.clone(), request.name());
            DeviceError::Bus(CallError::Answer { device, request, cause: format!("the answer is {kind}") })
        })
    }

    fn done(&self, request: &Request) -> Result<(), DeviceError> {
        self.expect(request, SHORT, |reply| (reply == Reply::Done).then_some(()))
    }

    fn state(&self, request: &Request) -> Result<DeviceState, DeviceError> {
        self.expect(request, PREPARATION, |reply| match reply {
            Reply::State(state) => Some(state),
            _ => None,
        })
    }
}

/// How long after a host's end everybody knows of it.
const END_NOTICED: Duration = Duration::from_secs(1);

impl RobotClient {
    pub(super) fn open(shared: Arc<Shared>) -> Result<Self, OpenError> {
        Asking::open(shared).map(Self)
    }

    /// The device's name.
    pub fn device(&self) -> &str {
        &self.0.shared.device
    }

    /// Joints, lines and capabilities.
    ///
    /// # Errors
    /// [`DeviceError`], as every call below.
    pub fn describe(&self) -> Result<RobotDescription, DeviceError> {
        self.0.expect(&Request::Describe, SHORT, |reply| match reply {
            Reply::Described(description) => match *description {
                Description::Robot(robot) => Some(robot),
                _ => None,
            },
            _ => None,
        })
    }

    /// The state the device is in.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn state(&self) -> Result<DeviceState, DeviceError> {
        self.0.state(&Request::State)
    }

    /// Makes the robot ready to move, and takes back an earlier stop.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn activate(&self) -> Result<DeviceState, DeviceError> {
        self.0.state(&Request::Activate)
    }

    /// Brings the robot to rest.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn deactivate(&self) -> Result<DeviceState, DeviceError> {
        self.0.state(&Request::Deactivate)
    }

    /// Where the joints are.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn read_joints(&self) -> Result<JointState, DeviceError> {
        self.0.expect(&Request::ReadJoints, SHORT, joints)
    }

    /// Moves, and waits until the robot is at rest; where it is then.
    ///
    /// # Errors
    /// [`DeviceError`]; [`DeviceError::TimedOut`] leaves the robot moving: stop it.
    pub fn move_joints(&self, motion: &Motion, time_limit: Duration) -> Result<JointState, DeviceError> {
        self.0.expect(&Request::MoveJoints(*motion), time_limit, joints)
    }

    /// The levels of the input lines.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn read_inputs(&self) -> Result<DigitalInputs, DeviceError> {
        self.0.expect(&Request::ReadInputs, SHORT, |reply| match reply {
            Reply::Inputs(inputs) => Some(inputs),
            _ => None,
        })
    }

    /// Sets the output lines.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn write_outputs(&self, levels: u64) -> Result<(), DeviceError> {
        self.0.done(&Request::WriteOutputs(levels))
    }

    /// Hands the robot to its pendant, or takes it back; where it is.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn jog(&self, on: bool) -> Result<JogState, DeviceError> {
        self.0.expect(&Request::Jog { on }, SHORT, |reply| match reply {
            Reply::Jog(state) => Some(state),
            _ => None,
        })
    }

    /// Declares where the joints stand now.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn set_zero(&self, joints: &JointVector) -> Result<(), DeviceError> {
        self.0.expect(&Request::SetZero(*joints), CALIBRATION, |reply| (reply == Reply::Done).then_some(()))
    }
}

fn joints(reply: Reply) -> Option<JointState> {
    match reply {
        Reply::Joints(state) => Some(state),
        _ => None,
    }
}

impl SensorClient {
    pub(super) fn open(shared: Arc<Shared>) -> Result<Self, OpenError> {
        Asking::open(shared).map(Self)
    }

    /// The device's name.
    pub fn device(&self) -> &str {
        &self.0.shared.device
    }

    /// What it measures.
    ///
    /// # Errors
    /// [`DeviceError`], as every call below.
    pub fn describe(&self) -> Result<SensorDescription, DeviceError> {
        self.0.expect(&Request::Describe, SHORT, |reply| match reply {
            Reply::Described(description) => match *description {
                Description::Sensor(sensor) => Some(sensor),
                _ => None,
            },
            _ => None,
        })
    }

    /// The state the device is in.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn state(&self) -> Result<DeviceState, DeviceError> {
        self.0.state(&Request::State)
    }

    /// Makes the sensor ready, and takes back an earlier stop.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn activate(&self) -> Result<DeviceState, DeviceError> {
        self.0.state(&Request::Activate)
    }

    /// Brings the sensor to rest.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn deactivate(&self) -> Result<DeviceState, DeviceError> {
        self.0.state(&Request::Deactivate)
    }

    /// Changes settings while it runs.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn configure(&self, settings: &Value) -> Result<(), DeviceError> {
        self.0.done(&Request::Configure(settings.clone()))
    }

    /// Makes it forget what it saw and watch from now on.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn arm(&self) -> Result<(), DeviceError> {
        self.0.done(&Request::Arm)
    }

    /// What it has seen since the last reading, once its inputs have been seen up to `after_ns` (ns of the cell's clock; 0: whatever is there).
    ///
    /// # Errors
    /// [`DeviceError`], also when the inputs are not seen that far within the time limit.
    pub fn read(&self, after_ns: u64, time_limit: Duration) -> Result<Reading, DeviceError> {
        self.0.expect(&Request::Read { after_ns }, time_limit, |reply| match reply {
            Reply::Reading(reading) => Some(reading),
            _ => None,
        })
    }
}
