//! The one table of what a device can be asked. Everything that spells an operation follows from it:
//!
//! - the function tables of the C contract, [`RobotFunctions`](crate::RobotFunctions) and [`SensorFunctions`](crate::SensorFunctions);
//! - their section of `include/plumb_plugin.h` (`tests/header.rs` writes it, and fails when it is out of date);
//! - in `plumb-plugin`: the C functions of a plugin written in Rust, and the requests with their bytes;
//! - in `plumb-host`: the calls of a loaded plugin, what a host does with a request, and the methods of the orchestrator's clients.
//!
//! # Adding an operation
//!
//! One line at the end of `robot` or `sensor` below (tables of functions grow at their end only), a method of that name with a default in the trait
//! `Robot` or `Sensor` of `plumb-plugin`, and a plugin that overrides it. `CONTRACT_MINOR` goes up, in `lib.rs` and in the header. A message of a new type
//! is a struct in `plumb-plugin/src/message`, its twin in the header, its layout in `plumb-plugin/tests/c_header.rs`, and a word in `reply.rs` and `wire.rs`.
//! As an example, a robot that can brake:
//!
//! ```text
//! /// Holds the joints with their brakes (1), or lets go (0).
//! optional brake(on: bool), asked 14 Brake "brake" -> () within SHORT direct;
//! ```
//!
//! | part of a line | meaning |
//! |---|---|
//! | doc comment | the comment in the C header and in every type made from the line |
//! | `required` | a plugin without this function is not loaded |
//! | `optional` | null: the device cannot do it, and says so |
//! | `implied` | null: there is nothing to do, which is well |
//! | `name(argument: Type)` | at most one argument: `u64`, `bool`, `Value` (JSON), or a message of `plumb-plugin`, lent for the call |
//! | `fills state: JointState` | the function fills in a message of the host's |
//! | `writes description: T` | the function writes `T` as JSON, and always can |
//! | `writes_when_seen reading: T` | the same, or `Status::EMPTY` when the inputs have not been seen far enough |
//! | `asked 5 ReadJoints "read joints"` | the request: its code, its variant of `Request`, and its name in messages |
//! | `-> JointState` | what the orchestrator gets; a type of the table of replies in `plumb-plugin/src/reply.rs` |
//! | `within SHORT` | the time limit, a constant of `plumb-host/src/time_limits.rs`; `CALLER`: the caller gives it |
//! | `direct` | the host passes it on as it is |
//! | `checked` | the host's `Service` has a method of that name that checks it first |
//! | `awaited` | as `checked`, and it may wait for inputs until its time is up |
//!
//! A line without `asked` is a function that the host calls by itself. `common` holds the requests to any device that have no function of their own.

/// Hands the whole table to the macro named: `common { .. } robot { .. } sensor { .. }`, behind any tokens given after a comma.
#[macro_export]
macro_rules! device_operations {
    ($generator:ident) => { $crate::device_operations! { @into [$generator] [] } };
    ($crate_name:tt::$generator:ident, $($first:tt)*) => { $crate::device_operations! { @into [$crate_name::$generator] [$($first)*] } };
    (@into [$($generator:tt)+] [$($first:tt)*]) => {
        $($generator)+! {
            $($first)*
            common {
                /// Joints, lines, values.
                1 Describe "describe";
                /// The state the device is in.
                2 State "state";
                /// Make ready; for a robot: may move from now on. Clears a stop.
                3 Activate "activate";
                /// Bring to rest.
                4 Deactivate "deactivate";
            }
            robot {
                /// Writes the description as JSON: {"model", "joints": [{"name", "unit": "rad"|"mm", "lower", "upper", "resolution", "max_speed",
                /// "home"}], "inputs": [{"name", "bit"}], "outputs": [...], "capabilities": {"interruptible", "stop_time_ms", "jog", "only_pendant_ends_jog",
                /// "set_zero"}}.
                required describe() writes description: RobotDescription;
                /// Makes ready to move. Clears an earlier stop.
                implied activate();
                /// Brings to rest so that the robot may be left alone.
                implied deactivate();
                /// Where the joints are now; within 5 s.
                required read_joints() fills state: JointState, asked 5 ReadJoints "read joints" -> JointState within SHORT checked;
                /// Moves; writes the state in which the robot came to rest. The host has checked the limits. Looks at should_stop every 50 ms.
                required move_joints(motion: Motion) fills state: JointState, asked 6 MoveJoints "move joints" -> JointState within CALLER checked;
                /// Brings to rest, now; called after a move was interrupted and when none was under way.
                required stop();
                /// The input lines now.
                optional read_inputs() fills inputs: DigitalInputs, asked 7 ReadInputs "read inputs" -> DigitalInputs within SHORT direct;
                /// Sets the output lines: bit n is the level of line n.
                optional write_outputs(levels: u64), asked 8 WriteOutputs "write outputs" -> () within SHORT direct;
                /// Hands the robot to its pendant (1) or takes it back (0), and reports where it is. Called again and again while the operator drives.
                optional jog(on: bool) fills state: JogState, asked 9 Jog "jog" -> JogState within SHORT checked;
                /// Declares that the joints are at `joints` now. Nothing moves.
                optional set_zero(joints: JointVector), asked 10 SetZero "set zero" -> () within CALIBRATION checked;
                /// What the motor of each joint reports of itself: temperature, load, supply voltage. Nothing moves. Since contract 1.1.
                optional read_motors() fills motors: MotorState, asked 14 ReadMotors "read motors" -> MotorState within SHORT direct;
            }
            sensor {
                /// Writes the description as JSON: {"model", "switches": true|false, "quantities": [{"name", "unit"}]}.
                required describe() writes description: SensorDescription;
                /// Changes settings while running: JSON, only the keys to be changed.
                optional configure(settings: Value), asked 11 Configure "configure" -> () within SHORT direct;
                /// Forgets what was seen so far and watches from now on.
                implied arm(), asked 12 Arm "arm" -> () within SHORT checked;
                /// Takes in what has come: called when a wired input has messages. An error is returned by the next read.
                implied poll();
                /// Writes what was seen since the last reading, with every quantity of the description, within 5 s or the manifest's read_time_limit_s, and
                /// not older than after_ns, as JSON: {"time_ns", "fired", "edges": [{"time_ns", "sequence", "fired", "joints": [...],
                /// "joints_half_width": [...]}], "quantities": [{"name", "value", "standard_uncertainty"}]}. PLUMB_EMPTY when the inputs have not been
                /// seen up to after_ns: the host takes in more and asks again.
                required read(after_ns: u64) writes_when_seen reading: Reading, asked 13 Read "read" -> Reading within CALLER awaited;
            }
        }
    };
}

/// Hands the requests to the macro named, `common { .. } operations { .. }`, the lines of the second each as
/// `robot #[doc = ..] 5 ReadJoints "read joints" read_joints() -> JointState within SHORT checked;`. The functions that the host calls by itself are left out.
#[macro_export]
macro_rules! device_requests {
    // A line that is asked for is kept in the short form.
    (@keep [$($generator:tt)+] [$($common:tt)*] [$($kept:tt)*] $kind:ident {
        $(#[doc = $doc:literal])* $need:ident $name:ident($($argument:ident: $Argument:ident)?) $($result:ident $message:ident: $Message:ident)?,
        asked $code:literal $Variant:ident $title:literal -> $Answer:tt within $limit:ident $way:ident; $($rest:tt)*
    } $($sections:tt)*) => {
        $crate::device_requests! {
            @keep [$($generator)+] [$($common)*]
            [$($kept)* $kind $(#[doc = $doc])* $code $Variant $title $name($($argument: $Argument)?) -> $Answer within $limit $way;]
            $kind { $($rest)* } $($sections)*
        }
    };
    // One that the host calls by itself is left out.
    (@keep [$($generator:tt)+] [$($common:tt)*] [$($kept:tt)*] $kind:ident {
        $(#[doc = $doc:literal])* $need:ident $name:ident($($argument:ident: $Argument:ident)?) $($result:ident $message:ident: $Message:ident)?; $($rest:tt)*
    } $($sections:tt)*) => {
        $crate::device_requests! { @keep [$($generator)+] [$($common)*] [$($kept)*] $kind { $($rest)* } $($sections)* }
    };
    // The end of a section, and of the table.
    (@keep [$($generator:tt)+] [$($common:tt)*] [$($kept:tt)*] $kind:ident {} $($sections:tt)*) => {
        $crate::device_requests! { @keep [$($generator)+] [$($common)*] [$($kept)*] $($sections)* }
    };
    (@keep [$($generator:tt)+] [$($common:tt)*] [$($kept:tt)*]) => {
        $($generator)+! { common { $($common)* } operations { $($kept)* } }
    };
    (@table [$($generator:tt)+] common { $($common:tt)* } $($sections:tt)+) => {
        $crate::device_requests! { @keep [$($generator)+] [$($common)*] [] $($sections)+ }
    };
    ($generator:ident) => {
        $crate::device_operations! { $crate::device_requests, @table [$generator] }
    };
}

/// The C type of an argument of the table.
#[macro_export]
macro_rules! c_argument {
    (u64) => { u64 };
    (bool) => { u32 };
    (Value) => { $crate::Bytes };
    ($Message:ident) => { *const ::core::ffi::c_void };
}

/// The C type of where a function of the table puts its result.
#[macro_export]
macro_rules! c_result {
    (fills) => { *mut ::core::ffi::c_void };
    ($writes:ident) => { *const $crate::Sink };
}
