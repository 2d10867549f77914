//! How the body of a request or a reply lies in bytes.

use bytemuck::Pod;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::{
    Description, DeviceState, DigitalInputs, JogState, JointState, JointVector, Motion, MotorState, Reading,
    Value,
};

/// The bytes of a request or reply cannot be understood: sender and receiver are of different versions, or one is faulty.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WireError {
    /// The code of the operation is not known.
    #[error("operation {0} is not known; the two programs are of different versions")]
    Operation(u32),
    /// The body has the wrong length or content.
    #[error("the body of {operation} cannot be read: {cause}")]
    Body {
        /// Which request or reply.
        operation: &'static str,
        /// What is wrong.
        cause: String,
    },
}

/// A value that is the body of a request or a reply.
pub(crate) trait Body: Sized {
    /// Its bytes.
    fn to_bytes(&self) -> Vec<u8>;

    /// The value of some bytes; `operation` is named in errors.
    ///
    /// # Errors
    /// [`WireError::Body`] for bytes of another length or content.
    fn from_bytes(operation: &'static str, body: &[u8]) -> Result<Self, WireError>;
}

/// Bodies that are the value's own bytes.
macro_rules! plain_bodies {
    ($($Type:ty),*) => {$(
        impl Body for $Type {
            fn to_bytes(&self) -> Vec<u8> {
                bytemuck::bytes_of(self).to_vec()
            }

            fn from_bytes(operation: &'static str, body: &[u8]) -> Result<Self, WireError> {
                read_plain(operation, body)
            }
        }
    )*};
}

plain_bodies!(u64, Motion, JointVector, JointState, DigitalInputs, JogState, MotorState);

/// Bodies that are JSON.
macro_rules! json_bodies {
    ($($Type:ty),*) => {$(
        impl Body for $Type {
            fn to_bytes(&self) -> Vec<u8> {
                json(self)
            }

            fn from_bytes(operation: &'static str, body: &[u8]) -> Result<Self, WireError> {
                read_json(operation, body)
            }
        }
    )*};
}

json_bodies!(Value, Reading, Box<Description>);

impl Body for bool {
    fn to_bytes(&self) -> Vec<u8> {
        bytemuck::bytes_of(&u32::from(*self)).to_vec()
    }

    fn from_bytes(operation: &'static str, body: &[u8]) -> Result<Self, WireError> {
        read_plain::<u32>(operation, body).map(|flag| flag != 0)
    }
}

impl Body for DeviceState {
    fn to_bytes(&self) -> Vec<u8> {
        bytemuck::bytes_of(&self.code()).to_vec()
    }

    fn from_bytes(operation: &'static str, body: &[u8]) -> Result<Self, WireError> {
        let code: u32 = read_plain(operation, body)?;
        Self::from_code(code)
            .ok_or_else(|| WireError::Body { operation, cause: format!("{code} is no state") })
    }
}

fn read_plain<T: Pod>(operation: &'static str, body: &[u8]) -> Result<T, WireError> {
    bytemuck::try_pod_read_unaligned(body).map_err(|_| WireError::Body {
        operation,
        cause: format!("it has {} bytes instead of {}", body.len(), size_of::<T>()),
    })
}

/// JSON of a type of this crate, none of which can fail to be written: a value that somehow does is written as null and refused by the reader.
fn json<T: Serialize>(value: &T) -> Vec<u8> {
    serde_json::to_vec(value).unwrap_or_else(|_| b"null".to_vec())
}

fn read_json<T: DeserializeOwned>(operation: &'static str, body: &[u8]) -> Result<T, WireError> {
    serde_json::from_slice(body).map_err(|error| WireError::Body { operation, cause: error.to_string() })
}
