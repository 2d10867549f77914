//! A [`Robot`] or a [`Sensor`] behind the C contract: its C functions, made from the table of operations.

use std::ffi::c_void;
use std::ptr;

use plumb_abi::{
    Bytes, CONTRACT_MAJOR, CONTRACT_MINOR, Entry, HostFunctions, Instance, MAGIC, ROBOT_EXTENSION,
    RobotFunctions, SENSOR_EXTENSION, SensorFunctions, Status, c_argument, c_result,
};

use super::call::{Device, answer, deliver, done, given, json};
use crate::{Robot, Sensor};

/// Calls a method of the device and puts its result where the host wants it.
macro_rules! call {
    ($device:ident.$name:ident($($argument:ident: $Argument:ident)?)) => {
        done($device.$name($(received!($argument: $Argument))?))
    };
    ($device:ident.$name:ident($($argument:ident: $Argument:ident)?) fills $message:ident) => {
        deliver($message, $device.$name($(received!($argument: $Argument))?)?)
    };
    ($device:ident.$name:ident() writes $message:ident) => {
        answer($message, &$device.$name())
    };
    ($device:ident.$name:ident($($argument:ident: $Argument:ident)?) writes_when_seen $message:ident) => {
        match $device.$name($(received!($argument: $Argument))?)? {
            Some(value) => answer($message, &value),
            None => Ok(Status::EMPTY),
        }
    };
}

/// An argument as the device's method takes it, from what came through C.
macro_rules! received {
    ($argument:ident: u64) => {
        $argument
    };
    ($argument:ident: bool) => {
        $argument != 0
    };
    ($argument:ident: Value) => {
        &json($argument.as_slice())?
    };
    ($argument:ident: $Message:ident) => {
        given::<crate::$Message>($argument)?
    };
}

/// The entry of a kind of device and its C functions, one for each line of its section.
macro_rules! exported {
    ($Device:ident $Functions:ident $EXTENSION:ident {
        $(
            $(#[doc = $doc:literal])* $need:ident $name:ident($($argument:ident: $Argument:ident)?) $($result:ident $message:ident: $Message:ident)?
            $(, asked $code:literal $Variant:ident $title:literal -> $Answer:tt within $limit:ident $way:ident)?;
        )*
    }) => {
        /// The entry of a library whose device is `T`.
        pub const fn entry<T: $Device>(manifest: &'static str) -> Entry {
            Entry {
                magic: MAGIC,
                contract_major: CONTRACT_MAJOR,
                contract_minor: CONTRACT_MINOR,
                size: size_of::<Entry>() as u32,
                reserved: 0,
                manifest: Bytes::of_text(manifest),
                create: Some(create::<T>),
                destroy: Some(destroy::<T>),
                extension: Some(extension::<T>),
            }
        }

        struct Table<T>(std::marker::PhantomData<T>);

        impl<T: $Device> Table<T> {
            const FUNCTIONS: &'static $Functions = &$Functions {
                size: size_of::<$Functions>() as u32,
                reserved: 0,
                $($name: Some($name::<T>),)*
            };
        }

        unsafe extern "C" fn create<T: $Device>(
            host: *const HostFunctions,
            config: Bytes,
            instance: *mut *mut Instance,
        ) -> Status {
            // SAFETY: the arguments are passed on as they came.
            unsafe { Device::<T>::create(host, config, instance, T::create) }
        }

        unsafe extern "C" fn destroy<T>(instance: *mut Instance) {
            // SAFETY: the contract hands back what `create` gave, once.
            unsafe { Device::<T>::destroy(instance) }
        }

        pub(super) unsafe extern "C" fn extension<T: $Device>(name: Bytes) -> *const c_void {
            // SAFETY: the contract lends the name for this call.
            let name = unsafe { name.as_slice() };
            if name == $EXTENSION.as_bytes() { ptr::from_ref(Table::<T>::FUNCTIONS).cast() } else { ptr::null() }
        }

        $(
            unsafe extern "C" fn $name<T: $Device>(
                instance: *mut Instance
                $(, $argument: c_argument!($Argument))?
                $(, $message: c_result!($result))?
            ) -> Status {
                // SAFETY: the contract hands back the instance that `create` gave, one call at a time, with pointers that are valid during the call and
                // point to what the table says.
                unsafe {
                    Device::<T>::call(instance, |device| call!(device.$name($($argument: $Argument)?) $($result $message)?))
                }
            }
        )*
    };
}

macro_rules! kinds_of_device {
    (common { $($common:tt)* } robot { $($robot:tt)* } sensor { $($sensor:tt)* }) => {
        /// A robot's entry.
        pub(super) mod robot {
            use super::*;
            exported! { Robot RobotFunctions ROBOT_EXTENSION { $($robot)* } }
        }
        /// A sensor's entry.
        pub(super) mod sensor {
            use super::*;
            exported! { Sensor SensorFunctions SENSOR_EXTENSION { $($sensor)* } }
        }
    };
}

plumb_abi::device_operations!(kinds_of_device);

/// The entry of a library whose device is a robot or a sensor, as its host asks for: one that runs drivers of other languages.
pub const fn either_entry<T: Robot + Sensor>(manifest: &'static str) -> Entry {
    Entry { extension: Some(either::<T>), ..robot::entry::<T>(manifest) }
}

unsafe extern "C" fn either<T: Robot + Sensor>(name: Bytes) -> *const c_void {
    // SAFETY: the name is passed on as it came. Both tables take the instance that the one `create` gave.
    unsafe {
        let robot = robot::extension::<T>(name);
        if robot.is_null() { sensor::extension::<T>(name) } else { robot }
    }
}
