//! The tables of functions that a plugin gives for its kind of device, made from the table of operations.

use core::mem::offset_of;

use crate::{Instance, Status};

/// The name under which a robot's functions are asked for.
pub const ROBOT_EXTENSION: &str = "plumb.robot/1";

/// The name under which a sensor's functions are asked for.
pub const SENSOR_EXTENSION: &str = "plumb.sensor/1";

/// Whether a function must be there, by the first word of its line.
macro_rules! is_required {
    (required) => {
        true
    };
    ($other:ident) => {
        false
    };
}

/// One table of functions, from the lines of its section.
macro_rules! function_table {
    ($(#[doc = $about:literal])* $Table:ident {
        $(
            $(#[doc = $doc:literal])* $need:ident $name:ident($($argument:ident: $Argument:ident)?) $($result:ident $message:ident: $Message:ident)?
            $(, asked $code:literal $Variant:ident $title:literal -> $Answer:tt within $limit:ident $way:ident)?;
        )*
    }) => {
        $(#[doc = $about])*
        #[repr(C)]
        #[derive(Debug)]
        pub struct $Table {
            /// The size of this struct in bytes as the plugin knows it.
            pub size: u32,
            /// Zero.
            pub reserved: u32,
            $(
                $(#[doc = $doc])*
                pub $name: Option<
                    unsafe extern "C" fn(
                        *mut Instance
                        $(, $argument: $crate::c_argument!($Argument))?
                        $(, $message: $crate::c_result!($result))?
                    ) -> Status,
                >,
            )*
        }

        impl $Table {
            /// A table without any function.
            pub const EMPTY: Self = Self { size: 0, reserved: 0, $($name: None),* };

            /// Its functions in order, each with where it lies from the beginning, in bytes.
            pub const FUNCTIONS: &'static [(&'static str, usize)] = &[$((stringify!($name), offset_of!(Self, $name))),*];

            /// The functions that must be there and are not.
            pub fn missing(&self) -> impl Iterator<Item = &'static str> {
                [$((stringify!($name), is_required!($need) && self.$name.is_none())),*]
                    .into_iter()
                    .filter_map(|(name, is_missing)| is_missing.then_some(name))
            }
        }
    };
}

macro_rules! function_tables {
    (common { $($common:tt)* } robot { $($robot:tt)* } sensor { $($sensor:tt)* }) => {
        function_table! {
            /// What a robot can be asked. The host calls these one at a time, always from the thread that called `create`. A null function is one the
            /// robot does not have.
            ///
            /// The messages behind the `c_void` pointers are the structs of `plumb_plugin.h` named there; their Rust twins are in `plumb-plugin`.
            /// They are the host's, valid during the call, aligned to 8.
            RobotFunctions { $($robot)* }
        }
        function_table! {
            /// What a sensor can be asked. The host calls these one at a time, always from the thread that called `create`. A null function is one the
            /// sensor does not have.
            SensorFunctions { $($sensor)* }
        }
    };
}

crate::device_operations!(function_tables);

#[cfg(test)]
mod tests {
    use super::*;

    unsafe extern "C" fn stop(_: *mut Instance) -> Status {
        Status::OK
    }

    #[test]
    fn what_must_be_there_and_is_not_is_named() {
        let table = RobotFunctions { stop: Some(stop), ..RobotFunctions::EMPTY };
        assert!(table.missing().eq(["describe", "read_joints", "move_joints"]));
        assert!(SensorFunctions::EMPTY.missing().eq(["describe", "read"]));
    }

    #[test]
    fn the_tables_of_version_1_have_their_functions_where_they_were() {
        let word = size_of::<usize>();
        let in_order = |functions: &[(&str, usize)]| {
            functions.iter().enumerate().all(|(index, (_, offset))| *offset == 8 + index * word)
        };
        assert!(in_order(RobotFunctions::FUNCTIONS) && in_order(SensorFunctions::FUNCTIONS));
        let robot = [
            "describe",
            "activate",
            "deactivate",
            "read_joints",
            "move_joints",
            "stop",
            "read_inputs",
            "write_outputs",
            "jog",
            "set_zero",
            "read_motors",
        ];
        assert!(RobotFunctions::FUNCTIONS.iter().map(|(name, _)| *name).take(robot.len()).eq(robot));
        let sensor = ["describe", "configure", "arm", "poll", "read"];
        assert!(SensorFunctions::FUNCTIONS.iter().map(|(name, _)| *name).take(sensor.len()).eq(sensor));
    }
}
