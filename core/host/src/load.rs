//! A plugin's library: loaded once, checked before anything in it is called, never unloaded.

#![allow(unsafe_code, reason = "this is the host's side of the boundary to C")]

mod calls;
mod error;
mod functions;
mod instance;
mod table;

pub use error::LoadError;
pub(crate) use instance::Device;

use std::path::Path;
use std::str;

use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};
use plumb_abi::{CONTRACT_MAJOR, Entry, MAGIC, entry_symbol};
use plumb_plugin::{ContractVersion, DeviceKind, Manifest};

use crate::Plugin;

/// A library that has been checked against its manifest.
#[derive(Clone, Copy)]
pub(crate) struct Loaded {
    entry: &'static Entry,
    kind: DeviceKind,
}

/// Loads a plugin's library, checks it against its manifest and asks for the functions of its kind, without creating a device. What could be
/// better although the plugin can be used is given back, a sentence each. The library stays loaded: only the end of the process gets rid of it.
///
/// # Errors
/// [`LoadError`], naming both sides of what does not fit.
pub fn verify(plugin: &Plugin) -> Result<Vec<String>, LoadError> {
    let loaded = load(plugin)?;
    loaded.check_functions(&plugin.library_path, &plugin.manifest)
}

pub(crate) fn load(plugin: &Plugin) -> Result<Loaded, LoadError> {
    let path = &plugin.library_path;
    let entry = entry_of(path)?;
    check_entry(path, entry)?;
    // SAFETY: the contract makes the text constant.
    let text = unsafe { entry.manifest.as_slice() };
    let text = str::from_utf8(text)
        .map_err(|error| LoadError::BuiltInManifest { library: path.clone(), cause: error.to_string() })?;
    let built_in = Manifest::parse(text, "the manifest built into it")
        .map_err(|error| LoadError::BuiltInManifest { library: path.clone(), cause: error.to_string() })?;
    match plugin.manifest.driver.is_empty() {
        true => check_manifests(path, &plugin.manifest, &built_in)?,
        false if built_in.id == Manifest::BRIDGE_ID => {}
        false => {
            let what = format!("it names a driver, and the library is '{}'", built_in.id);
            return Err(LoadError::Stale { library: path.clone(), what });
        }
    }
    Ok(Loaded { entry, kind: plugin.manifest.kind })
}

/// The entry of a library, with nothing in it looked at.
fn entry_of(path: &Path) -> Result<&'static Entry, LoadError> {
    let not_a_library = |cause: String| LoadError::NotALibrary { library: path.to_owned(), cause };
    // Absolute, or the system's loader would look for a bare name in its own directories.
    let absolute = path.canonicalize().map_err(|error| not_a_library(error.to_string()))?;
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    let symbol = entry_symbol(name).ok_or_else(|| LoadError::Name { library: path.to_owned() })?;
    // SAFETY: a plugin's initialisers are its author's: this process exists to be the only one they can harm.
    let library = unsafe { Library::open(Some(absolute), RTLD_NOW | RTLD_LOCAL) }
        .map_err(|error| not_a_library(cause_of(&error)))?;
    // SAFETY: the address is used as an entry only after its magic has been found there.
    let entry = unsafe { library.get::<*const Entry>(symbol.as_bytes()) }
        .map_err(|_| LoadError::NoEntry {
            library: path.to_owned(),
            symbol: String::from_utf8_lossy(symbol.as_bytes()).into_owned(),
        })
        .map(|symbol| symbol.into_raw());
    // The library stays: a plugin's threads and thread-local destructors may outlive any sensible moment to unload it.
    std::mem::forget(library);
    // SAFETY: a symbol of this name is an entry by the contract, and constant data.
    unsafe { entry?.cast::<Entry>().as_ref() }.ok_or_else(|| LoadError::BadEntry {
        library: path.to_owned(),
        what: "its entry symbol has no address".to_owned(),
    })
}

fn cause_of(error: &libloading::Error) -> String {
    std::error::Error::source(error).map_or_else(|| error.to_string(), ToString::to_string)
}

/// What the entry says about itself, in the order in which it can be trusted.
fn check_entry(path: &Path, entry: &Entry) -> Result<(), LoadError> {
    let bad = |what: String| Err(LoadError::BadEntry { library: path.to_owned(), what });
    if entry.magic != MAGIC {
        return bad(format!(
            "it begins with {:?} instead of 'PLUMBPLG'",
            String::from_utf8_lossy(&entry.magic)
        ));
    }
    if entry.contract_major != CONTRACT_MAJOR {
        return Err(LoadError::Contract {
            library: path.to_owned(),
            built_for: ContractVersion(entry.contract_major, entry.contract_minor),
            speaks: ContractVersion::CURRENT,
        });
    }
    if (entry.size as usize) < size_of::<Entry>() {
        return bad(format!("its entry has {} bytes; {} are needed", entry.size, size_of::<Entry>()));
    }
    if entry.create.is_none() || entry.destroy.is_none() || entry.extension.is_none() {
        return bad("its entry lacks create, destroy or extension".to_owned());
    }
    Ok(())
}

fn quoted(text: &str) -> String {
    format!("'{text}'")
}

/// Whether the manifest beside a library is the one built into it.
fn check_manifests(path: &Path, beside: &Manifest, built_in: &Manifest) -> Result<(), LoadError> {
    if beside == built_in {
        return Ok(());
    }
    let differ = |what: &str, beside: &dyn std::fmt::Display, built_in: &dyn std::fmt::Display| {
        format!("{what} is {beside} in the file and {built_in} in the library")
    };
    let what = if beside.id != built_in.id {
        differ("the id", &beside.id, &built_in.id)
    } else if beside.version != built_in.version {
        differ("the version", &beside.version, &built_in.version)
    } else if beside.kind != built_in.kind {
        differ("the kind", &beside.kind, &built_in.kind)
    } else if beside.streams != built_in.streams || beside.inputs != built_in.inputs {
        "the streams or inputs are not the same".to_owned()
    } else if beside.contract != built_in.contract {
        differ("the contract", &beside.contract, &built_in.contract)
    } else if beside.title != built_in.title {
        differ("the title", &quoted(&beside.title), &quoted(&built_in.title))
    } else if beside.library != built_in.library {
        differ("the library", &beside.library, &built_in.library)
    } else if beside.config != built_in.config {
        "the schema under `config` is not the same".to_owned()
    } else {
        "they are not the same".to_owned()
    };
    Err(LoadError::Stale { library: path.to_owned(), what })
}

#[cfg(test)]
mod tests;
