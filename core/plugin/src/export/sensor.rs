//! A [`Sensor`] behind the C contract.

use std::ffi::c_void;
use std::ptr;

use plumb_abi::{
    Bytes, CONTRACT_MAJOR, CONTRACT_MINOR, Entry, HostFunctions, Instance, MAGIC, SENSOR_EXTENSION,
    SensorFunctions, Sink, Status,
};

use super::call::{Device, answer, json};
use crate::{PluginError, Sensor};

/// The entry of a library whose device is the sensor `T`.
pub const fn sensor_entry<T: Sensor>(manifest: &'static str) -> Entry {
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

impl<T: Sensor> Table<T> {
    const FUNCTIONS: &'static SensorFunctions = &SensorFunctions {
        size: size_of::<SensorFunctions>() as u32,
        reserved: 0,
        describe: Some(describe::<T>),
        configure: Some(configure::<T>),
        arm: Some(arm::<T>),
        poll: Some(poll::<T>),
        read: Some(read::<T>),
    };
}

unsafe extern "C" fn create<T: Sensor>(
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

unsafe extern "C" fn extension<T: Sensor>(name: Bytes) -> *const c_void {
    // SAFETY: the contract lends the name for this call.
    let name = unsafe { name.as_slice() };
    if name == SENSOR_EXTENSION.as_bytes() {
        ptr::from_ref(Table::<T>::FUNCTIONS).cast()
    } else {
        ptr::null()
    }
}

// SAFETY of all below: the contract hands back the instance that `create` gave, one call at a time, with pointers that are valid during the call
// and point to what the table's comments say.

unsafe extern "C" fn describe<T: Sensor>(instance: *mut Instance, sink: *const Sink) -> Status {
    // SAFETY: see above.
    unsafe {
        Device::<T>::call(instance, |sensor| {
            let text = serde_json::to_vec(&sensor.describe())
                .map_err(|error| PluginError::Failed(error.to_string()))?;
            answer(sink, &text)
        })
    }
}

unsafe extern "C" fn configure<T: Sensor>(instance: *mut Instance, settings: Bytes) -> Status {
    // SAFETY: see above.
    unsafe { Device::<T>::call(instance, |sensor| sensor.configure(&json(settings.as_slice())?)) }
}

unsafe extern "C" fn arm<T: Sensor>(instance: *mut Instance) -> Status {
    // SAFETY: see above.
    unsafe { Device::<T>::call(instance, Sensor::arm) }
}

unsafe extern "C" fn poll<T: Sensor>(instance: *mut Instance) -> Status {
    // SAFETY: see above.
    unsafe { Device::<T>::call(instance, Sensor::poll) }
}

unsafe extern "C" fn read<T: Sensor>(instance: *mut Instance, after_ns: u64, sink: *const Sink) -> Status {
    let mut seen_far_enough = true;
    // SAFETY: see above.
    let status = unsafe {
        Device::<T>::call(instance, |sensor| match sensor.read(after_ns)? {
            Some(reading) => {
                let text =
                    serde_json::to_vec(&reading).map_err(|error| PluginError::Failed(error.to_string()))?;
                answer(sink, &text)
            }
            None => {
                seen_far_enough = false;
                Ok(())
            }
        })
    };
    if status.is_ok() && !seen_far_enough { Status::EMPTY } else { status }
}
