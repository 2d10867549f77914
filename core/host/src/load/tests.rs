//! What a library's entry and its two manifests have to say before anything in it is called.

use std::ffi::c_void;

use plumb_abi::{Bytes, CONTRACT_MINOR, HostFunctions, Instance, Status};
use plumb_plugin::{InputDescription, Value};

use super::*;

unsafe extern "C" fn create(_: *const HostFunctions, _: Bytes, _: *mut *mut Instance) -> Status {
    Status::OK
}

unsafe extern "C" fn destroy(_: *mut Instance) {}

unsafe extern "C" fn extension(_: Bytes) -> *const c_void {
    std::ptr::null()
}

pub(super) fn entry() -> Entry {
    Entry {
        magic: MAGIC,
        contract_major: CONTRACT_MAJOR,
        contract_minor: CONTRACT_MINOR,
        size: size_of::<Entry>() as u32,
        reserved: 0,
        manifest: Bytes::of(&[]),
        create: Some(create),
        destroy: Some(destroy),
        extension: Some(extension),
    }
}

fn checked(change: impl FnOnce(&mut Entry)) -> Result<(), String> {
    let mut entry = entry();
    change(&mut entry);
    check_entry(Path::new("libarm.so"), &entry).map_err(|error| error.to_string())
}

#[test]
fn a_whole_entry_may_be_larger_but_not_smaller_than_this_program_knows() {
    assert_eq!(checked(|_| ()), Ok(()));
    assert_eq!(checked(|entry| entry.size += 8), Ok(()), "a later contract adds fields at the end");
    let size = size_of::<Entry>();
    let message =
        format!("libarm.so: is not a usable plugin: its entry has {} bytes; {size} are needed", size - 1);
    assert_eq!(checked(|entry| entry.size -= 1), Err(message));
}

#[test]
fn an_entry_of_something_else_is_refused_by_its_first_letters() {
    let message = "libarm.so: is not a usable plugin: it begins with \"ELEPHANT\" instead of 'PLUMBPLG'";
    assert_eq!(checked(|entry| entry.magic = *b"ELEPHANT"), Err(message.to_owned()));
}

#[test]
fn an_entry_of_another_contract_is_refused_with_both_versions_and_a_later_minor_is_not() {
    let message = checked(|entry| (entry.contract_major, entry.contract_minor) = (CONTRACT_MAJOR + 1, 7));
    let message = message.unwrap_err();
    assert!(message.contains(&format!("built for plugin contract {}.7", CONTRACT_MAJOR + 1)), "{message}");
    assert_eq!(checked(|entry| entry.contract_minor += 1), Ok(()));
}

#[test]
fn an_entry_that_lacks_any_of_its_three_functions_is_refused() {
    let lacking: [fn(&mut Entry); 3] =
        [|entry| entry.create = None, |entry| entry.destroy = None, |entry| entry.extension = None];
    for lack in lacking {
        let message = "libarm.so: is not a usable plugin: its entry lacks create, destroy or extension";
        assert_eq!(checked(lack), Err(message.to_owned()));
    }
}

fn manifest() -> Manifest {
    let text = "id: arm\ntitle: An arm\nversion: 0.1.0\ncontract: [1, 0]\nkind: robot\nlibrary: libarm.so\n\
                streams: [{name: joints, message: joint-state/1}]\n";
    Manifest::parse(text, "plugin.yaml").unwrap()
}

/// Changes a manifest.
type Change = fn(&mut Manifest);

/// What is said of a manifest beside the library that differs in this from the one built into it.
fn difference(change: impl FnOnce(&mut Manifest)) -> Option<String> {
    let mut beside = manifest();
    change(&mut beside);
    match check_manifests(Path::new("libarm.so"), &beside, &manifest()) {
        Ok(()) => None,
        Err(LoadError::Stale { what, .. }) => Some(what),
        Err(other) => panic!("{other}"),
    }
}

#[test]
fn a_stale_library_is_named_by_what_differs_first() {
    assert_eq!(difference(|_| ()), None);
    let input = InputDescription { name: "line".into(), message: "digital-inputs/1".into(), optional: true };
    let changes: [(Change, &str); 9] = [
        (|one| one.id = "leg".into(), "the id is leg in the file and arm in the library"),
        (|one| one.version = "0.2.0".into(), "the version is 0.2.0 in the file and 0.1.0 in the library"),
        (|one| one.kind = DeviceKind::Sensor, "the kind is sensor in the file and robot in the library"),
        (|one| one.streams.clear(), "the streams or inputs are not the same"),
        (
            |one| one.contract = ContractVersion(1, 9),
            "the contract is 1.9 in the file and 1.0 in the library",
        ),
        (|one| one.title = "A leg".into(), "the title is 'A leg' in the file and 'An arm' in the library"),
        (
            |one| one.library = "libleg.so".into(),
            "the library is libleg.so in the file and libarm.so in the library",
        ),
        (|one| one.config = Value::Bool(true), "the schema under `config` is not the same"),
        (|one| one.input_lines = Some(3), "they are not the same"),
    ];
    for (change, what) in changes {
        assert_eq!(difference(change).as_deref(), Some(what));
    }
    let inputs = difference(|one| one.inputs.push(input));
    assert_eq!(inputs.as_deref(), Some("the streams or inputs are not the same"));
}

#[test]
fn the_loaders_own_words_are_the_cause() {
    let error = unsafe { Library::open(Some("/nowhere/libarm.so"), RTLD_NOW) }.err().unwrap();
    let cause = cause_of(&error);
    assert!(cause.contains("/nowhere/libarm.so"), "{cause}");
}
