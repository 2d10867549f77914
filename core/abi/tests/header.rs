//! The section of `include/plumb_plugin.h` with the tables of functions is made from the table of operations.
//!
//! `PLUMB_WRITE_HEADER=1 cargo test -p plumb-abi --test header` writes it anew.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::fs;
use std::path::Path;

/// The C name of a message: `JointState` is `plumb_joint_state`.
fn c_name(message: &str) -> String {
    let mut name = "plumb".to_owned();
    for letter in message.chars() {
        if letter.is_ascii_uppercase() {
            name.push('_');
        }
        name.push(letter.to_ascii_lowercase());
    }
    name
}

/// An argument as C declares it.
fn c_argument(name: &str, kind: &str) -> String {
    match kind {
        "u64" => format!("uint64_t {name}"),
        "bool" => format!("uint32_t {name}"),
        "Value" => format!("plumb_bytes {name}"),
        message => format!("const {} *{name}", c_name(message)),
    }
}

/// Where a result goes, as C declares it.
fn c_result(way: &str, name: &str, message: &str) -> String {
    match way {
        "fills" => format!("{} *{name}", c_name(message)),
        _ => "const plumb_sink *answer".to_owned(),
    }
}

/// One function with its comment.
fn c_function(comment: &[&str], name: &str, arguments: &[String]) -> String {
    let comment: Vec<&str> = comment.iter().map(|line| line.trim()).collect();
    let arguments: String = arguments.iter().map(|argument| format!(", {argument}")).collect();
    format!(
        "    /* {} */\n    plumb_status (*{name})(plumb_instance *instance{arguments});\n",
        comment.join("\n     * ")
    )
}

macro_rules! functions {
    ($(
        $(#[doc = $doc:literal])* $need:ident $name:ident($($argument:ident: $Argument:ident)?) $($result:ident $message:ident: $Message:ident)?
        $(, asked $code:literal $Variant:ident $title:literal -> $Answer:tt within $limit:ident $way:ident)?;
    )*) => {
        [$(c_function(
            &[$($doc),*],
            stringify!($name),
            &[
                $(c_argument(stringify!($argument), stringify!($Argument)),)?
                $(c_result(stringify!($result), stringify!($message), stringify!($Message)),)?
            ],
        )),*].join("\n")
    };
}

macro_rules! sections {
    (common { $($common:tt)* } robot { $($robot:tt)* } sensor { $($sensor:tt)* }) => {
        [("plumb_robot_functions", functions!($($robot)*)), ("plumb_sensor_functions", functions!($($sensor)*))]
    };
}

/// The header with the functions of one table replaced.
fn with_functions(header: &str, table: &str, functions: &str) -> String {
    let head = format!(
        "typedef struct {table} {{\n    uint32_t size; /* sizeof({table}) */\n    uint32_t reserved;\n\n"
    );
    let (before, rest) = header.split_once(&head).unwrap();
    let (_, after) = rest.split_once(&format!("}} {table};")).unwrap();
    format!("{before}{head}{functions}}} {table};{after}")
}

#[test]
fn the_c_header_says_what_the_table_of_operations_says() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("include/plumb_plugin.h");
    let committed = fs::read_to_string(&path).unwrap();
    let made = plumb_abi::device_operations!(sections)
        .iter()
        .fold(committed.clone(), |header, (table, functions)| with_functions(&header, table, functions));
    if std::env::var_os("PLUMB_WRITE_HEADER").is_some() {
        fs::write(&path, &made).unwrap();
        return;
    }
    assert!(
        made == committed,
        "include/plumb_plugin.h is out of date: run this test with PLUMB_WRITE_HEADER=1"
    );
}

#[test]
fn a_message_has_its_c_name() {
    assert_eq!(c_name("DigitalInputs"), "plumb_digital_inputs");
}
