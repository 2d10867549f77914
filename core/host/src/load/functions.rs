//! The functions of a plugin's kind, asked for by name and checked.

use std::path::Path;
use std::ptr;

use plumb_abi::{Bytes, ROBOT_EXTENSION, RobotFunctions, SENSOR_EXTENSION, SensorFunctions};
use plumb_plugin::{DeviceKind, DigitalInputs, JointState, Manifest, Message as _};

use super::{LoadError, Loaded};

/// The functions of a plugin's kind; those that must be there are.
pub(super) enum Functions {
    Robot(RobotFunctions),
    Sensor(SensorFunctions),
}

/// A name that no table of functions has.
const NO_NAME: &str = "plumb.nothing/0";

/// The size and the reserved word that every table begins with, in bytes.
const TABLE_HEAD: usize = 2 * size_of::<u32>();

impl Loaded {
    /// The functions of the plugin's kind.
    ///
    /// # Errors
    /// What is wrong with them, as the end of a sentence about the plugin.
    pub(super) fn functions(self) -> Result<Functions, String> {
        match self.kind {
            DeviceKind::Robot => {
                // SAFETY: behind the name of a robot's functions lies a beginning of their table; where it ends it lacks functions, which may be null.
                let (table, size) = unsafe { self.table(ROBOT_EXTENSION, RobotFunctions::EMPTY) }?;
                self.check_required(ROBOT_EXTENSION, size, table.missing())?;
                Ok(Functions::Robot(table))
            }
            DeviceKind::Sensor => {
                // SAFETY: as above, for a sensor's.
                let (table, size) = unsafe { self.table(SENSOR_EXTENSION, SensorFunctions::EMPTY) }?;
                self.check_required(SENSOR_EXTENSION, size, table.missing())?;
                Ok(Functions::Sensor(table))
            }
        }
    }

    /// What could be better in a plugin that can be used.
    ///
    /// # Errors
    /// [`LoadError::Functions`] when it cannot be used.
    pub(super) fn check_functions(
        self,
        library: &Path,
        manifest: &Manifest,
    ) -> Result<Vec<String>, LoadError> {
        let wrong = |what: String| LoadError::Functions { library: library.to_owned(), what };
        let functions = self.functions().map_err(wrong)?;
        if self.answers_to(NO_NAME) {
            return Err(wrong(format!(
                "its `extension` gives a table for any name, also for '{NO_NAME}': compare the name, and return NULL for those it does not know"
            )));
        }
        let has = |name: &str, message: &str| {
            manifest.streams.iter().any(|stream| stream.name == name && stream.message == message)
        };
        let mut notes = Vec::new();
        if let Functions::Robot(table) = functions {
            if !has("joints", JointState::TYPE_NAME) {
                notes.push(
                    "it declares no stream `joints` of joint-state/1 messages: nobody can watch it move"
                        .to_owned(),
                );
            }
            if has("inputs", DigitalInputs::TYPE_NAME) && table.read_inputs.is_none() {
                notes.push(
                    "it declares a stream `inputs` and has no read_inputs: a sensor that is wired to it waits in vain while the robot is at rest"
                        .to_owned(),
                );
            }
        }
        Ok(notes)
    }

    fn check_required(
        self,
        name: &str,
        size: usize,
        missing: impl Iterator<Item = &'static str>,
    ) -> Result<(), String> {
        let lacks: Vec<&str> = missing.collect();
        if lacks.is_empty() {
            return Ok(());
        }
        let kind = self.kind;
        Err(format!(
            "the plugin says it is a {kind}, and its table '{name}' of {size} bytes lacks {} (set `size` to sizeof(plumb_{kind}_functions), and fill in \
             every function that a {kind} must have)",
            lacks.join(", ")
        ))
    }

    /// Whether the plugin gives a table for a name.
    fn answers_to(self, name: &str) -> bool {
        // SAFETY: the entry was checked; the name outlives the call.
        self.entry.extension.is_some_and(|extension| !unsafe { extension(Bytes::of_text(name)) }.is_null())
    }

    /// The table behind an extension's name, and the size it says it has. A plugin of an older minor version has a shorter one: what it ends before
    /// stays as in `nothing`. One of a newer version has a longer one, whose end nobody here knows.
    ///
    /// # Safety
    /// What lies behind that name is `T` or a beginning of it, and begins with its size; every field of `T` may keep its value from `nothing`
    /// while others are the plugin's.
    unsafe fn table<T>(self, name: &str, nothing: T) -> Result<(T, usize), String> {
        let theirs = match self.entry.extension {
            // SAFETY: the entry was checked; the name outlives the call.
            Some(extension) => unsafe { extension(Bytes::of_text(name)) },
            None => ptr::null(),
        };
        // SAFETY: every table begins with its size.
        let Some(size) = (unsafe { theirs.cast::<u32>().as_ref() }) else {
            return Err(self.no_table(name));
        };
        let size = *size as usize;
        if size < TABLE_HEAD + size_of::<usize>() {
            let kind = self.kind;
            return Err(format!(
                "the plugin says it is a {kind}, and the `size` of its table '{name}' is {size}: set it to sizeof(plumb_{kind}_functions), which is {} here",
                size_of::<T>()
            ));
        }
        // A field that is cut in two is none.
        let whole = size / size_of::<usize>() * size_of::<usize>();
        let mut ours = nothing;
        // SAFETY: no more is read than the plugin has, and no more written than there is; whole fields only, which the caller says may be mixed.
        unsafe {
            ptr::copy_nonoverlapping(
                theirs.cast::<u8>(),
                (&raw mut ours).cast::<u8>(),
                whole.min(size_of::<T>()),
            );
        }
        Ok((ours, size))
    }

    fn no_table(self, name: &str) -> String {
        let kind = self.kind;
        let (other, other_kind) = match kind {
            DeviceKind::Robot => (SENSOR_EXTENSION, DeviceKind::Sensor),
            DeviceKind::Sensor => (ROBOT_EXTENSION, DeviceKind::Robot),
        };
        let hint = if self.answers_to(other) {
            format!("it has one for '{other}': is it a {other_kind}?")
        } else {
            "return the table of its functions for that name".to_owned()
        };
        format!("the plugin says it is a {kind}, and its `extension` gives NULL for '{name}': {hint}")
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::entry;
    use super::*;

    #[test]
    fn a_table_without_what_its_kind_must_have_is_refused_with_what_it_lacks() {
        let loaded = Loaded { entry: Box::leak(Box::new(entry())), kind: DeviceKind::Robot };
        assert_eq!(loaded.check_required("plumb.robot/1", 96, [].into_iter()), Ok(()));
        let error =
            loaded.check_required("plumb.robot/1", 8, ["move_joints", "stop"].into_iter()).unwrap_err();
        let reported = "the plugin says it is a robot, and its table 'plumb.robot/1' of 8 bytes lacks move_joints, stop (set `size` to \
                    sizeof(plumb_robot_functions)";
        assert!(error.starts_with(reported), "{error}");
    }

    #[test]
    fn an_extension_that_gives_no_table_answers_to_no_name() {
        let loaded = Loaded { entry: Box::leak(Box::new(entry())), kind: DeviceKind::Robot };
        assert!(!loaded.answers_to("plumb.robot/1"));
        assert!(loaded.functions().is_err(), "a robot without a table is none");
    }
}
