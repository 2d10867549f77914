//! The one symbol of a plugin.

use core::ffi::c_void;

use crate::{Bytes, HostFunctions, Status};

/// The first bytes of every entry.
pub const MAGIC: [u8; 8] = *b"PLUMBPLG";

/// A device as the plugin knows it; the host only hands the pointer back.
#[repr(C)]
pub struct Instance {
    private: [u8; 0],
}

/// The one symbol of a plugin. Constant data: the host reads the first four fields before it trusts the rest.
#[repr(C)]
#[derive(Debug)]
pub struct Entry {
    /// [`MAGIC`].
    pub magic: [u8; 8],
    /// The [`CONTRACT_MAJOR`](crate::CONTRACT_MAJOR) the plugin was built for.
    pub contract_major: u32,
    /// The [`CONTRACT_MINOR`](crate::CONTRACT_MINOR) the plugin was built for.
    pub contract_minor: u32,
    /// The size of this struct in bytes as the plugin knows it.
    pub size: u32,
    /// Zero.
    pub reserved: u32,
    /// The text of the plugin's manifest, `plugin.yaml`; stays for ever.
    pub manifest: Bytes,
    /// Connects to a device. `config` is JSON. On [`Status::OK`], `*instance` is the device; otherwise it is left alone.
    pub create: Option<
        unsafe extern "C" fn(
            host: *const HostFunctions,
            config: Bytes,
            instance: *mut *mut Instance,
        ) -> Status,
    >,
    /// Ends a device. Afterwards no thread of the plugin may call the host on its behalf.
    pub destroy: Option<unsafe extern "C" fn(instance: *mut Instance)>,
    /// The table of functions of a name such as `plumb.robot/1`, or null. The table stays for ever.
    pub extension: Option<unsafe extern "C" fn(name: Bytes) -> *const c_void>,
}

/// The longest name of an entry symbol, with its final zero.
const NAME_LENGTH: usize = 128;

/// The name of an entry symbol.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EntryName {
    text: [u8; NAME_LENGTH],
    length: usize,
}

impl EntryName {
    /// The name, without a final zero.
    pub fn as_bytes(&self) -> &[u8] {
        self.text.get(..self.length).unwrap_or_default()
    }
}

/// The name of the entry symbol of a library: `plumb_plugin_` and the library's file name without `lib` and from its first `.` on, each
/// character that no C name may have replaced by `_`. A name of its own lets one program link several plugins.
///
/// `None` for a file name that is too long.
pub fn entry_symbol(library_file_name: &str) -> Option<EntryName> {
    let stem = library_file_name.strip_prefix("lib").unwrap_or(library_file_name);
    let stem = stem.split('.').next().unwrap_or(stem);
    let mut name = EntryName { text: [0; NAME_LENGTH], length: 0 };
    for byte in b"plumb_plugin_".iter().copied().chain(stem.bytes()) {
        let slot = name.text.get_mut(name.length)?;
        *slot = if byte.is_ascii_alphanumeric() { byte } else { b'_' };
        name.length += 1;
    }
    (name.length < NAME_LENGTH).then_some(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_symbol_carries_the_name_of_the_library() {
        let name = entry_symbol("libplumb_ir-proximity.so").unwrap();
        assert_eq!(name.as_bytes(), b"plumb_plugin_plumb_ir_proximity");
        assert_eq!(entry_symbol("arm.so.1").unwrap().as_bytes(), b"plumb_plugin_arm");
    }

    #[test]
    fn a_name_too_long_is_none() {
        let long = [b'a'; 200];
        assert_eq!(entry_symbol(core::str::from_utf8(&long).unwrap()), None);
    }
}
