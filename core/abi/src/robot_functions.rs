//! What a robot can be asked.

use core::ffi::c_void;

use crate::{Instance, Sink, Status};

/// The name under which a robot's functions are asked for.
pub const ROBOT_EXTENSION: &str = "plumb.robot/1";

/// What a robot can be asked. The host calls these one at a time, always from the thread that called `create`. A null function is one the
/// robot does not have; `describe`, `read_joints`, `move_joints` and `stop` must be there.
///
/// The messages behind the `c_void` pointers are the structs of `plumb_plugin.h` named in the comments; their Rust twins are in
/// `plumb-plugin`. They are the host's, valid during the call, aligned to 8.
#[repr(C)]
#[derive(Debug)]
pub struct RobotFunctions {
    /// The size of this struct in bytes as the plugin knows it.
    pub size: u32,
    /// Zero.
    pub reserved: u32,
    /// Writes the robot's description as JSON.
    pub describe: Option<unsafe extern "C" fn(*mut Instance, answer: *const Sink) -> Status>,
    /// Makes ready to move.
    pub activate: Option<unsafe extern "C" fn(*mut Instance) -> Status>,
    /// Brings to rest.
    pub deactivate: Option<unsafe extern "C" fn(*mut Instance) -> Status>,
    /// Where the joints are: writes a `plumb_joint_state`.
    pub read_joints: Option<unsafe extern "C" fn(*mut Instance, state: *mut c_void) -> Status>,
    /// Moves as a `plumb_motion` says; writes the `plumb_joint_state` where the robot came to rest.
    pub move_joints:
        Option<unsafe extern "C" fn(*mut Instance, motion: *const c_void, state: *mut c_void) -> Status>,
    /// Brings to rest, now.
    pub stop: Option<unsafe extern "C" fn(*mut Instance) -> Status>,
    /// The input lines: writes a `plumb_digital_inputs`.
    pub read_inputs: Option<unsafe extern "C" fn(*mut Instance, inputs: *mut c_void) -> Status>,
    /// Sets the output lines.
    pub write_outputs: Option<unsafe extern "C" fn(*mut Instance, levels: u64) -> Status>,
    /// Hands over to the pendant (1) or takes back (0): writes a `plumb_jog_state`.
    pub jog: Option<unsafe extern "C" fn(*mut Instance, on: u32, state: *mut c_void) -> Status>,
    /// Declares where the joints are, a `plumb_joint_vector`.
    pub set_zero: Option<unsafe extern "C" fn(*mut Instance, joints: *const c_void) -> Status>,
}
