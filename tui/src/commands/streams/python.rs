//! A file in Python that reads a cell's streams from shared memory: layouts out of the one table of them, where the cell's shared memory is, and a reader.

use std::fmt::Write as _;

use plumb_bus::{Bus, Domain, LAYER_VERSION};
use plumb_plugin::message::{Field, FieldType, Layout, PREFIX_LENGTH, Tail};
use plumb_plugin::{MAX_JOINTS, StreamDescription};

/// What reads, the same for every cell.
const READER: &str = include_str!("reader.py");

/// A cell as the file knows it.
pub(super) struct PythonCell<'a> {
    pub(super) name: &'a str,
    /// Its file, as it was named.
    pub(super) file: String,
    pub(super) domain: &'a Domain,
    /// The file that the process that runs the cell holds locked.
    pub(super) lock: String,
}

/// The text of the file.
pub(super) fn python_file(cell: &PythonCell<'_>, streams: &[(String, StreamDescription)]) -> String {
    let mut text = head(cell, streams);
    text.push_str(&joint_vector());
    text.push_str(&class_of("Prefix", "what every message begins with", &prefix_fields(), PREFIX_LENGTH));
    text.push_str(&classes(streams));
    text.push_str("\n\n# The service in shared memory, the layout, what follows it again and again, and the layout's name.\nSTREAMS = {\n");
    for (device, stream) in streams {
        let layout = Layout::of(stream);
        let class = layout.as_ref().map_or("Prefix".to_owned(), class_name);
        let record = match layout.as_ref().and_then(|layout| layout.tail.as_ref()) {
            Some(Tail::Records { class, .. }) => class,
            _ => "None",
        };
        let (name, service) = (format!("{device}/{}", stream.name), Bus::stream_service(device, stream));
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "    {}: ({}, {class}, {record}, {}),",
            quoted(&name),
            quoted(&service),
            quoted(&stream.message)
        );
    }
    text.push_str("}\n");
    text.push_str(READER);
    text
}

/// What it is, what it needs, and where the cell's shared memory is.
fn head(cell: &PythonCell<'_>, streams: &[(String, StreamDescription)]) -> String {
    let (name, file, version) = (cell.name, &cell.file, env!("CARGO_PKG_VERSION"));
    let first = streams.first().map(|(device, stream)| format!("{device}/{}", stream.name));
    let example = first.unwrap_or_else(|| "arm/joints".to_owned());
    format!(
        r#""""The streams of the cell {name}, live from shared memory. Written by `plumb streams {file} --python` of plumb {version}: write it anew when the
cell's devices change, the file goes elsewhere, or plumb is another version.

    import plumb_streams
    with plumb_streams.Reader("{example}") as reader:
        for message in reader:
            print(message.time_ns)

Needs the package iceoryx2 in exactly this version: pip install iceoryx2=={LAYER_VERSION}. Only listens; a run does not notice. As a program it prints a
stream, a line of JSON for each message: python3 plumb_streams.py {example}
"""
import ctypes, fcntl, json, os, shutil, sys, time

ICEORYX2 = {layer}
CELL, CELL_FILE = {cell}, {cell_file}
PREFIX, ROOT, LOCK = {prefix}, {root}, {lock}


def check(layout, size, offsets):
    """Refuses a layout that is another here than in plumb."""
    found = {{name: getattr(layout, name).offset for name in offsets}}
    if ctypes.sizeof(layout) != size or found != offsets:
        raise ImportError(f"{{layout.__name__}} has {{ctypes.sizeof(layout)}} bytes, {{found}}; in plumb it has {{size}}, {{offsets}}")
"#,
        layer = quoted(LAYER_VERSION),
        cell = quoted(name),
        cell_file = quoted(file),
        prefix = quoted(cell.domain.prefix()),
        root = quoted(&cell.domain.root().display().to_string()),
        lock = quoted(&cell.lock),
    )
}

/// A class for each layout of the streams, and for what follows its fields.
fn classes(streams: &[(String, StreamDescription)]) -> String {
    let mut text = String::new();
    let mut written: Vec<String> = Vec::new();
    let mut write = |class: &str, what: &str, fields: &[Field], size: usize| {
        if !written.iter().any(|known| known == class) {
            text.push_str(&class_of(class, what, fields, size));
            written.push(class.to_owned());
        }
    };
    for layout in streams.iter().filter_map(|(_, stream)| Layout::of(stream)) {
        if let Some(Tail::Records { class, fields, size }) = &layout.tail {
            write(class, &layout.name, fields, *size);
        }
        write(&class_name(&layout), &layout.name, &layout.fields, layout.size);
    }
    text
}

/// What a layout's class is called: that of this program, or its name in capitals with its version, `Weight1` of `weight/1`.
fn class_name(layout: &Layout) -> String {
    if !layout.class.is_empty() {
        return layout.class.to_owned();
    }
    let words =
        layout.name.split(|letter: char| !letter.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    let capital = |word: &str| format!("{}{}", word[..1].to_ascii_uppercase(), &word[1..]);
    // A class cannot begin with a digit, and is not to be one that is there already.
    format!("Own{}", words.map(capital).collect::<String>())
}

fn prefix_fields() -> Vec<Field> {
    Layout::known("health/1").into_iter().flat_map(|health| health.fields).take(2).collect()
}

fn joint_vector() -> String {
    format!(
        r#"

class JointVector(ctypes.Structure):
    """A number for each joint: rad, or mm for one that slides. `list(vector)` are those in use."""
    _fields_ = [("count", ctypes.c_uint32), ("reserved", ctypes.c_uint32), ("values", ctypes.c_double * {MAX_JOINTS})]

    def __iter__(self):
        return iter(self.values[:self.count])

    def __len__(self):
        return self.count
"#
    )
}

/// A class of fields, and that it is laid out in Python as it is in the program: else the file cannot be imported.
fn class_of(name: &str, what: &str, fields: &[Field], size: usize) -> String {
    let mut text = format!("\n\nclass {name}(ctypes.Structure):\n    \"\"\"{what}\"\"\"\n    _fields_ = [\n");
    for field in fields {
        let unit = if field.unit.is_empty() { String::new() } else { format!("  # {}", field.unit) };
        let _ = writeln!(text, "        ({}, {}),{unit}", quoted(&field.name), ctype(field.of));
    }
    text += "    ]\n";
    let offsets: Vec<String> =
        fields.iter().map(|field| format!("{}: {}", quoted(&field.name), field.offset)).collect();
    let _ = writeln!(text, "\n\ncheck({name}, {size}, {{{}}})", offsets.join(", "));
    text
}

fn ctype(of: FieldType) -> &'static str {
    match of {
        FieldType::U32 => "ctypes.c_uint32",
        FieldType::U64 => "ctypes.c_uint64",
        FieldType::F32 => "ctypes.c_float",
        FieldType::F32x3 => "ctypes.c_float * 3",
        FieldType::F64 => "ctypes.c_double",
        FieldType::Joints(_) => "JointVector",
    }
}

/// A text as Python writes it: JSON's strings are strings of Python too.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}
