//! The C header says what the Rust types say, to the byte.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::fmt::Write as _;
use std::io::ErrorKind;
use std::mem::offset_of;
use std::path::Path;
use std::process::Command;

use plumb_abi as abi;
use plumb_plugin::message::{
    DigitalInputs, JogState, JointState, JointVector, MAX_JOINTS, Motion, MotorState, ProximityEdge,
    SEQUENCE_OFFSET,
};

/// Lines of C that fail to compile where a struct's size or a field's offset differs.
macro_rules! layout {
    ($c:literal, $rust:ty, [$($field:ident),* $(,)?]) => {{
        let mut lines = format!("_Static_assert(sizeof({}) == {}, \"size of {}\");\n", $c, size_of::<$rust>(), $c);
        $(
            let offset = offset_of!($rust, $field);
            let _ = writeln!(lines, "_Static_assert(offsetof({0}, {1}) == {offset}, \"{0}.{1}\");", $c, stringify!($field));
        )*
        lines
    }};
}

/// The same for a table of functions, whose fields the table of operations names.
fn table<T>(c: &str, functions: &[(&str, usize)]) -> String {
    let size = size_of::<T>();
    let mut lines = format!("_Static_assert(sizeof({c}) == {size}, \"size of {c}\");\n");
    for (name, offset) in functions {
        let _ = writeln!(lines, "_Static_assert(offsetof({c}, {name}) == {offset}, \"{c}.{name}\");");
    }
    lines
}

#[test]
fn the_c_header_and_the_rust_types_agree_to_the_byte() {
    let mut program = "#include \"plumb_plugin.h\"\n".to_owned();
    for lines in [
        layout!("plumb_joint_vector", JointVector, [count, values]),
        layout!("plumb_joint_state", JointState, [time_ns, sequence, moving, joints]),
        layout!(
            "plumb_digital_inputs",
            DigitalInputs,
            [time_ns, sequence, levels, changed, joints, joints_half_width]
        ),
        layout!("plumb_proximity_edge", ProximityEdge, [time_ns, sequence, fired, joints, joints_half_width]),
        layout!("plumb_motion", Motion, [target, joint_mask, relative, speed_fraction]),
        layout!("plumb_jog_state", JogState, [state, key, finished]),
        layout!(
            "plumb_motor_state",
            MotorState,
            [
                time_ns,
                temperature,
                load,
                voltage,
                temperature_uncertainty,
                load_uncertainty,
                voltage_uncertainty
            ]
        ),
        layout!("plumb_bytes", abi::Bytes, [data, length]),
        layout!("plumb_sink", abi::Sink, [context, write]),
        layout!(
            "plumb_host_functions",
            abi::HostFunctions,
            [
                size,
                contract_minor,
                context,
                log,
                fail,
                now_ns,
                should_stop,
                emit,
                loan,
                publish,
                receive,
                progress
            ]
        ),
        layout!(
            "plumb_entry",
            abi::Entry,
            [magic, contract_major, contract_minor, size, manifest, create, destroy, extension]
        ),
        table::<abi::RobotFunctions>("plumb_robot_functions", abi::RobotFunctions::FUNCTIONS),
        table::<abi::SensorFunctions>("plumb_sensor_functions", abi::SensorFunctions::FUNCTIONS),
    ] {
        program.push_str(&lines);
    }
    for (name, value) in [
        ("PLUMB_CONTRACT_MAJOR", abi::CONTRACT_MAJOR as usize),
        ("PLUMB_CONTRACT_MINOR", abi::CONTRACT_MINOR as usize),
        ("PLUMB_MAX_JOINTS", MAX_JOINTS),
        ("offsetof(plumb_joint_state, sequence)", SEQUENCE_OFFSET),
        ("PLUMB_OK", abi::Status::OK.0 as usize),
        ("PLUMB_FAILED", abi::Status::FAILED.0 as usize),
        ("PLUMB_REFUSED", abi::Status::REFUSED.0 as usize),
        ("PLUMB_OUT_OF_RANGE", abi::Status::OUT_OF_RANGE.0 as usize),
        ("PLUMB_UNSUPPORTED", abi::Status::UNSUPPORTED.0 as usize),
        ("PLUMB_STOPPED", abi::Status::STOPPED.0 as usize),
        ("PLUMB_NOT_READY", abi::Status::NOT_READY.0 as usize),
        ("PLUMB_DISCONNECTED", abi::Status::DISCONNECTED.0 as usize),
        ("PLUMB_TIMED_OUT", abi::Status::TIMED_OUT.0 as usize),
        ("PLUMB_INPUT_LOST", abi::Status::INPUT_LOST.0 as usize),
        ("PLUMB_PANICKED", abi::Status::PANICKED.0 as usize),
        ("PLUMB_EMPTY", abi::Status::EMPTY.0 as usize),
    ] {
        let _ = writeln!(program, "_Static_assert({name} == {value}, \"{name}\");");
    }
    assert_compiles(&program);
}

fn assert_compiles(program: &str) {
    let directory = tempfile::tempdir().unwrap();
    let source = directory.path().join("layout.c");
    std::fs::write(&source, program).unwrap();
    let include = Path::new(env!("CARGO_MANIFEST_DIR")).join("../abi/include");
    let output = Command::new("cc")
        .args(["-std=c11", "-Wall", "-Werror", "-fsyntax-only", "-I"])
        .arg(include)
        .arg(&source)
        .output();
    match output {
        Ok(output) => assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr)),
        Err(error) if error.kind() == ErrorKind::NotFound => {
            println!("skipped: there is no C compiler 'cc' here")
        }
        Err(error) => panic!("cc cannot be run: {error}"),
    }
}
