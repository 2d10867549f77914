//! A [`Robot`] behind the C contract.

use std::ffi::c_void;
use std::ptr;

use plumb_abi::{
    Bytes, CONTRACT_MAJOR, CONTRACT_MINOR, Entry, HostFunctions, Instance, MAGIC, ROBOT_EXTENSION,
    RobotFunctions, Sink, Status,
};

use super::call::{Device, answer, deliver};
use crate::{JointVector, Motion, PluginError, Robot};

/// The entry of a library whose device is the robot `T`.
pub const fn robot_entry<T: Robot>(manifest: &'static str) -> Entry {
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

impl<T: Robot> Table<T> {
    const FUNCTIONS: &'static RobotFunctions = &RobotFunctions {
        size: size_of::<RobotFunctions>() as u32,
        reserved: 0,
        describe: Some(describe::<T>),
        activate: Some(activate::<T>),
        deactivate: Some(deactivate::<T>),
        read_joints: Some(read_joints::<T>),
        move_joints: Some(move_joints::<T>),
        stop: Some(stop::<T>),
        read_inputs: Some(read_inputs::<T>),
        write_outputs: Some(write_outputs::<T>),
        jog: Some(jog::<T>),
        set_zero: Some(set_zero::<T>),
    };
}

unsafe extern "C" fn create<T: Robot>(
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

unsafe extern "C" fn extension<T: Robot>(name: Bytes) -> *const c_void {
    // SAFETY: the contract lends the name for this call.
    let name = unsafe { name.as_slice() };
    if name == ROBOT_EXTENSION.as_bytes() { ptr::from_ref(Table::<T>::FUNCTIONS).cast() } else { ptr::null() }
}

// SAFETY of all below: the contract hands back the instance that `create` gave, one call at a time, with pointers that are valid during the call
// and point to what the table's comments say.

unsafe extern "C" fn describe<T: Robot>(instance: *mut Instance, sink: *const Sink) -> Status {
    // SAFETY: see above.
    unsafe {
        Device::<T>::call(instance, |robot| {
            let text = serde_json::to_vec(&robot.describe())
                .map_err(|error| PluginError::Failed(error.to_string()))?;
            answer(sink, &text)
        })
    }
}

unsafe extern "C" fn activate<T: Robot>(instance: *mut Instance) -> Status {
    // SAFETY: see above.
    unsafe { Device::<T>::call(instance, Robot::activate) }
}

unsafe extern "C" fn deactivate<T: Robot>(instance: *mut Instance) -> Status {
    // SAFETY: see above.
    unsafe { Device::<T>::call(instance, Robot::deactivate) }
}

unsafe extern "C" fn read_joints<T: Robot>(instance: *mut Instance, state: *mut c_void) -> Status {
    // SAFETY: see above.
    unsafe { Device::<T>::call(instance, |robot| deliver(state, robot.read_joints()?)) }
}

unsafe extern "C" fn move_joints<T: Robot>(
    instance: *mut Instance,
    motion: *const c_void,
    state: *mut c_void,
) -> Status {
    // SAFETY: see above.
    unsafe {
        Device::<T>::call(instance, |robot| {
            let motion = given::<Motion>(motion)?;
            deliver(state, robot.move_joints(motion)?)
        })
    }
}

unsafe extern "C" fn stop<T: Robot>(instance: *mut Instance) -> Status {
    // SAFETY: see above.
    unsafe { Device::<T>::call(instance, Robot::stop) }
}

unsafe extern "C" fn read_inputs<T: Robot>(instance: *mut Instance, inputs: *mut c_void) -> Status {
    // SAFETY: see above.
    unsafe { Device::<T>::call(instance, |robot| deliver(inputs, robot.read_inputs()?)) }
}

unsafe extern "C" fn write_outputs<T: Robot>(instance: *mut Instance, levels: u64) -> Status {
    // SAFETY: see above.
    unsafe { Device::<T>::call(instance, |robot| robot.write_outputs(levels)) }
}

unsafe extern "C" fn jog<T: Robot>(instance: *mut Instance, on: u32, state: *mut c_void) -> Status {
    // SAFETY: see above.
    unsafe { Device::<T>::call(instance, |robot| deliver(state, robot.jog(on != 0)?)) }
}

unsafe extern "C" fn set_zero<T: Robot>(instance: *mut Instance, joints: *const c_void) -> Status {
    // SAFETY: see above.
    unsafe { Device::<T>::call(instance, |robot| robot.set_zero(given::<JointVector>(joints)?)) }
}

/// What the host gave.
///
/// # Safety
/// The pointer is null or points to an `M` that stays for `'a`.
unsafe fn given<'a, M>(message: *const c_void) -> Result<&'a M, PluginError> {
    // SAFETY: promised by the caller.
    unsafe { message.cast::<M>().as_ref() }
        .ok_or_else(|| PluginError::Refused("the host gave no argument".to_owned()))
}
