//! What comes back from a device, and how it lies in bytes.

use plumb_abi::Status;

use crate::wire::Body;
use crate::{
    Description, DeviceState, DigitalInputs, JogState, JointState, MotorState, PluginError, Reading,
    WireError,
};

/// A reply's content as one Rust type, so that each type belongs to one kind of reply.
pub trait Answer: Sized + Into<Reply> {
    /// The content of a reply; none of one of another kind.
    fn from_reply(reply: Reply) -> Option<Self>;
}

/// The code of a reply that is an error: the body is its text.
const ERROR: u32 = 100;

/// The code of a reply that something was done, without content.
const DONE: u32 = 101;

/// The table of replies: code, variant, content, and the name in errors.
macro_rules! replies {
    ($($(#[doc = $doc:literal])* $code:literal $Variant:ident($Content:ty) $title:literal;)*) => {
        /// What comes back from a device.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Reply {
            /// Done; there is nothing to report.
            Done,
            $($(#[doc = $doc])* $Variant($Content),)*
        }

        impl Reply {
            /// Its name in errors.
            pub fn name(&self) -> &'static str {
                match self {
                    Self::Done => "done",
                    $(Self::$Variant(_) => $title,)*
                }
            }

            /// The reply's code, its status, and the body.
            pub fn encode(result: &Result<Self, PluginError>) -> (u32, Status, Vec<u8>) {
                match result {
                    Ok(Self::Done) => (DONE, Status::OK, Vec::new()),
                    $(Ok(Self::$Variant(content)) => ($code, Status::OK, content.to_bytes()),)*
                    Err(error) => (ERROR, error.status(), error.text().as_bytes().to_vec()),
                }
            }

            /// The reply of a code, a status and a body: the inner result is what the device answered.
            ///
            /// # Errors
            /// [`WireError`] for a code or a body that no reply has.
            pub fn decode(code: u32, status: Status, body: &[u8]) -> Result<Result<Self, PluginError>, WireError> {
                Ok(Ok(match code {
                    ERROR => {
                        let text = String::from_utf8_lossy(body).into_owned();
                        return Ok(Err(PluginError::from_status(status, text)));
                    }
                    DONE => Self::Done,
                    $($code => Self::$Variant(Body::from_bytes($title, body)?),)*
                    other => return Err(WireError::Operation(other)),
                }))
            }
        }

        $(
            impl From<$Content> for Reply {
                fn from(content: $Content) -> Self {
                    Self::$Variant(content)
                }
            }

            impl Answer for $Content {
                fn from_reply(reply: Reply) -> Option<Self> {
                    match reply {
                        Reply::$Variant(content) => Some(content),
                        _ => None,
                    }
                }
            }
        )*
    };
}

replies! {
    /// What the device says about itself.
    102 Described(Box<Description>) "a description";
    /// The state it is in now.
    103 State(DeviceState) "a state";
    /// Where the joints are.
    104 Joints(JointState) "a joint state";
    /// The levels of the input lines.
    105 Inputs(DigitalInputs) "input levels";
    /// Where the robot is while the operator drives it.
    106 Jog(JogState) "a jog state";
    /// What the sensor has seen.
    107 Reading(Reading) "a reading";
    /// What the motors report of themselves.
    108 Motors(MotorState) "a motor state";
}

impl From<()> for Reply {
    fn from((): ()) -> Self {
        Self::Done
    }
}

impl Answer for () {
    fn from_reply(reply: Reply) -> Option<Self> {
        (reply == Reply::Done).then_some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{JointVector, ProximityEdge};

    fn vector() -> JointVector {
        JointVector::from_slice(&[0.1, -1.0 / 3.0, 1e-13]).unwrap()
    }

    #[test]
    fn every_reply_survives_its_bytes_to_the_last_digit() {
        let edge =
            ProximityEdge { joints: vector(), joints_half_width: vector(), fired: 1, ..Default::default() };
        let reading =
            Reading { time_ns: u64::MAX, fired: Some(true), edges: vec![edge], quantities: Vec::new() };
        let motors = MotorState {
            time_ns: 9,
            temperature: vector(),
            load: vector(),
            voltage: vector(),
            temperature_uncertainty: 0.3,
            load_uncertainty: 0.001,
            voltage_uncertainty: 0.1,
        };
        for reply in [
            Ok(Reply::Done),
            Ok(Reply::State(DeviceState::Active)),
            Ok(Reply::Joints(JointState::new(3, vector(), true))),
            Ok(Reply::Inputs(DigitalInputs { levels: 5, joints: vector(), ..Default::default() })),
            Ok(Reply::Jog(JogState { key: 7, ..Default::default() })),
            Ok(Reply::Reading(reading)),
            Ok(Reply::Motors(motors)),
            Err(PluginError::OutOfRange("waist would turn to 95 deg; it goes to 90 deg".to_owned())),
        ] {
            let (code, status, body) = Reply::encode(&reply);
            assert_eq!(Reply::decode(code, status, &body), Ok(reply));
        }
    }

    /// NaN equals nothing, itself included.
    #[test]
    fn what_a_motor_does_not_report_is_still_not_reported_behind_the_bytes() {
        let (code, status, body) = Reply::encode(&Ok(Reply::Motors(MotorState::unreported(9, 2))));
        let Ok(Ok(Reply::Motors(motors))) = Reply::decode(code, status, &body) else {
            panic!("a motor state")
        };
        assert!(motors.load.as_slice().iter().all(|load| load.is_nan()) && motors.load.len() == 2);
        assert!(motors.load_uncertainty.is_nan());
    }

    #[test]
    fn a_reply_of_another_kind_has_not_the_content() {
        assert_eq!(JointState::from_reply(Reply::Done), None);
        assert_eq!(<()>::from_reply(Reply::State(DeviceState::Active)), None);
        assert_eq!(<()>::from_reply(().into()), Some(()));
    }

    #[test]
    fn a_state_that_is_none_is_named() {
        let error = Reply::decode(103, Status::OK, &9_u32.to_ne_bytes()).unwrap_err();
        assert_eq!(error.to_string(), "the body of a state cannot be read: 9 is no state");
    }
}
