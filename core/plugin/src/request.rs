//! What the orchestrator asks of a device, and how it lies in bytes. Made from the table of operations, `plumb-abi/src/operations.rs`.

use crate::WireError;
use crate::wire::Body;

/// The type an argument of the table has in a request.
#[doc(hidden)]
#[macro_export]
macro_rules! owned_type {
    (u64) => {
        u64
    };
    (bool) => {
        bool
    };
    (()) => {
        ()
    };
    ($Type:ident) => {
        $crate::$Type
    };
}

/// The type with which an argument of the table is passed to a function.
#[doc(hidden)]
#[macro_export]
macro_rules! argument_type {
    (u64) => {
        u64
    };
    (bool) => {
        bool
    };
    ($Type:ident) => {
        &$crate::$Type
    };
}

/// The bytes of a request's argument; none without one.
fn body<const COUNT: usize>(argument: [Vec<u8>; COUNT]) -> Vec<u8> {
    argument.concat()
}

macro_rules! request {
    (
        common { $($(#[doc = $common_doc:literal])* $common_code:literal $Common:ident $common_title:literal;)* }
        operations { $(
            $kind:ident $(#[doc = $doc:literal])* $code:literal $Variant:ident $title:literal
            $name:ident($($argument:ident: $Argument:ident)?) -> $Answer:tt within $limit:ident $way:ident;
        )* }
    ) => {
        /// What the orchestrator asks of a device.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Request {
            $($(#[doc = $common_doc])* $Common,)*
            $($(#[doc = $doc])* $Variant$((owned_type!($Argument)))?,)*
        }

        impl Request {
            /// Its name in log lines and errors.
            pub fn name(&self) -> &'static str {
                match self {
                    $(Self::$Common => $common_title,)*
                    $(Self::$Variant { .. } => $title,)*
                }
            }

            /// The operation's code, and the body.
            pub fn encode(&self) -> (u32, Vec<u8>) {
                match self {
                    $(Self::$Common => ($common_code, Vec::new()),)*
                    $(Self::$Variant$(($argument))? => ($code, body([$(Body::to_bytes($argument))?])),)*
                }
            }

            /// The request of a code and a body.
            ///
            /// # Errors
            /// [`WireError`] for a code or a body that no request has.
            pub fn decode(operation: u32, body: &[u8]) -> Result<Self, WireError> {
                Ok(match operation {
                    $($common_code => Self::$Common,)*
                    $($code => Self::$Variant$((<owned_type!($Argument) as Body>::from_bytes($title, body)?))?,)*
                    other => return Err(WireError::Operation(other)),
                })
            }
        }
    };
}

plumb_abi::device_requests!(request);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::JointVector;
    use crate::Motion;

    fn vector() -> JointVector {
        JointVector::from_slice(&[0.1, -1.0 / 3.0, 1e-13]).unwrap()
    }

    #[test]
    fn every_request_survives_its_bytes() {
        for request in [
            Request::Describe,
            Request::State,
            Request::Activate,
            Request::Deactivate,
            Request::ReadJoints,
            Request::MoveJoints(Motion::relative(vector(), 0.25)),
            Request::ReadInputs,
            Request::WriteOutputs(u64::MAX),
            Request::Jog(true),
            Request::SetZero(vector()),
            Request::Configure(serde_json::json!({"threshold": 0.1})),
            Request::Arm,
            Request::Read(7),
            Request::ReadMotors,
        ] {
            let (operation, body) = request.encode();
            assert_eq!(Request::decode(operation, &body), Ok(request));
        }
    }

    #[test]
    fn a_body_cut_short_is_named() {
        let (operation, body) = Request::MoveJoints(Motion::default()).encode();
        let error = Request::decode(operation, &body[1..]).unwrap_err();
        assert_eq!(
            error.to_string(),
            "the body of move joints cannot be read: it has 87 bytes instead of 88"
        );
    }

    #[test]
    fn an_unknown_operation_is_named() {
        assert_eq!(Request::decode(999, &[]), Err(WireError::Operation(999)));
    }

    #[test]
    fn the_codes_of_the_requests_stay_what_they_are() {
        let code = |request: Request| request.encode().0;
        assert_eq!(code(Request::Describe), 1);
        assert_eq!(code(Request::Deactivate), 4);
        assert_eq!(code(Request::ReadJoints), 5);
        assert_eq!(Request::Jog(true).encode(), (9, vec![1, 0, 0, 0]));
        assert_eq!(Request::Read(7).encode(), (13, 7_u64.to_ne_bytes().to_vec()));
        assert_eq!(Request::Configure(serde_json::json!({"a": 1})).encode(), (11, b"{\"a\":1}".to_vec()));
        assert_eq!(code(Request::ReadMotors), 14);
    }

    #[test]
    fn a_request_is_named_as_in_the_table() {
        assert_eq!(Request::SetZero(vector()).name(), "set zero");
        assert_eq!(Request::State.name(), "state");
    }
}
