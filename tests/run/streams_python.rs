//! `plumb streams CELL --python`: a file in Python that reads a cell's streams from shared memory.

use std::io::{BufRead as _, BufReader};
use std::mem::offset_of;
use std::process::{Child, Command, Stdio};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use plumb_cell::device::{CellResources, Occupancy};
use plumb_plugin::{
    DigitalInputs, FrameHeader, Health, JointState, JointVector, ProximityEdge, StripeHeader, StripePoint,
};
use serde_json::{Value, json};

use crate::lab::{CommandOutput, Lab, skipped};

/// What Python's ctypes make of the layouts in the file: of each class its size and where its fields begin.
const LAYOUTS: &str = r#"
import ctypes, json, plumb_streams
classes = {name: kind for name, kind in vars(plumb_streams).items() if isinstance(kind, type) and issubclass(kind, ctypes.Structure)}
print(json.dumps({name: [ctypes.sizeof(kind), {field: getattr(kind, field).offset for field, *_ in kind._fields_}] for name, kind in classes.items()}))
"#;

fn python_file(lab: &Lab, cell: &str) {
    let written = lab.plumb(&["streams", cell, "--python"]);
    assert_eq!(written.code(), 0, "{}", written.all());
    lab.write("plumb_streams.py", &written.out());
}

/// Runs Python in the cell's folder; none where there is none, which is said.
fn python(lab: &Lab, arguments: &[&str]) -> Option<Command> {
    if Command::new("python3").arg("--version").output().is_err() {
        skipped("there is no `python3` here");
        return None;
    }
    let mut python = Command::new("python3");
    python.args(arguments).current_dir(lab.path(".")).stdin(Stdio::null());
    Some(python)
}

/// The layouts that Python's ctypes make, of a cell of a folder of `workcells`.
fn layouts(folder: &str, cell: &str) -> Option<Value> {
    let lab = Lab::of(folder);
    python_file(&lab, cell);
    let output = CommandOutput::of(python(&lab, &["-c", LAYOUTS])?.output().unwrap());
    assert_eq!(output.code(), 0, "{}", output.all());
    Some(serde_json::from_str(&output.out()).unwrap())
}

/// A row of sizes and offsets as the compiler of this program has them.
macro_rules! layout {
    ($message:ty: $($field:ident)*) => {
        json!([size_of::<$message>(), {$(stringify!($field): offset_of!($message, $field)),*}])
    };
}

#[test]
fn layouts_in_python_are_those_of_the_program_to_the_byte() {
    let Some(arm) = layouts("teachmover", "cell.yaml") else { return };
    assert_eq!(arm["JointVector"], layout!(JointVector: count reserved values));
    assert_eq!(arm["JointState"], layout!(JointState: time_ns sequence moving reserved joints));
    let inputs = layout!(DigitalInputs: time_ns sequence levels changed joints joints_half_width);
    assert_eq!(arm["DigitalInputs"], inputs);
    let edges = layout!(ProximityEdge: time_ns sequence fired reserved joints joints_half_width);
    assert_eq!(arm["ProximityEdge"], edges);
    let health = layout!(Health: time_ns sequence state reserved requests failures longest_ns);
    assert_eq!(arm["Health"], health);

    let stripes = layouts("light-stripe", "cell.yaml").unwrap();
    assert_eq!(stripes["FrameHeader"], layout!(FrameHeader: time_ns sequence width height exposure_ns));
    let header = layout!(StripeHeader: time_ns sequence count fault joints speeds);
    assert_eq!(stripes["StripeHeader"], header);
    let point = layout!(StripePoint: u_px v_px sigma_px width_px intensity flags flange_mm sigma_mm);
    assert_eq!(stripes["StripePoint"], point);
}

/// A picture and a stripe of points, as their bytes come, in Python.
#[test]
fn what_follows_the_fields_of_a_message_is_read_as_well() {
    let lab = Lab::of("light-stripe");
    python_file(&lab, "cell.yaml");
    let frame = FrameHeader { width: 3, height: 2, time_ns: 7, ..FrameHeader::default() };
    let mut picture = vec![0; frame.message_bytes()];
    frame.write(&mut picture).unwrap().copy_from_slice(&[9, 8, 7, 6, 5, 4]);
    let point = StripePoint { u_px: 1.5, flange_mm: [1.0, 2.0, 3.0], ..StripePoint::default() };
    let stripe = StripeHeader { time_ns: 8, ..StripeHeader::default() }.message(&[point, point]);
    let list = lab.plumb(&["streams", "cell.yaml"]).out();
    let name = |layout: &str| {
        let line = list.lines().find(|line| line.contains(layout)).unwrap();
        line.split_whitespace().next().unwrap().to_owned()
    };
    let program = format!(
        "from plumb_streams import decode\nframe = decode('{}', bytes({picture:?}))\nassert frame.tail[:frame.width * frame.height] == bytes([9, 8, 7, 6, 5, 4])\n\
         stripe = decode('{}', bytes({stripe:?}))\nassert [list(point.flange_mm) for point in stripe.tail] == [[1, 2, 3]] * 2 and stripe.tail[1].u_px == 1.5\n\
         try:\n    decode('{}', bytes(8))\nexcept ValueError as error:\n    print(error)\n",
        name("frame/1"),
        name("stripe-points/2"),
        name("frame/1")
    );
    let Some(mut python) = python(&lab, &["-c", &program]) else { return };
    let output = CommandOutput::of(python.output().unwrap());
    assert_eq!(output.code(), 0, "{}", output.all());
    assert!(output.out().contains("has 8 bytes; FrameHeader has 32"), "{}", output.out());
}

/// A run that lasts until a reader has seen enough of it, however busy the computer is. Nobody reads what it prints: a full pipe would keep it from
/// ending.
fn at_the_pace_of_the_arm(lab: &Lab) -> Child {
    let mut run = lab.command(&["run", "cell.yaml", "--pace", "real"]);
    run.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

#[test]
fn a_stream_is_read_from_python_without_plumb_in_between() {
    let lab = Lab::new();
    python_file(&lab, "cell.yaml");
    let version = "import importlib.metadata, plumb_streams\nprint(importlib.metadata.version('iceoryx2') == plumb_streams.ICEORYX2)";
    let Some(mut asked) = python(&lab, &["-c", version]) else { return };
    if CommandOutput::of(asked.output().unwrap()).out().trim() != "True" {
        skipped("python3 has no package `iceoryx2` of plumb's version here");
        return;
    }
    let unknown =
        CommandOutput::of(python(&lab, &["plumb_streams.py", "arm/joint"]).unwrap().output().unwrap());
    assert_eq!(unknown.code(), 1, "{}", unknown.all());
    assert!(
        unknown.err().contains("cell teachmover has no stream 'arm/joint'; it has arm/joints,"),
        "{}",
        unknown.err()
    );
    let early = "import plumb_streams\nplumb_streams.Reader('arm/joints', wait_s=0.2)";
    let early = CommandOutput::of(python(&lab, &["-c", early]).unwrap().output().unwrap());
    assert!(early.err().contains("nobody runs cell.yaml"), "{}", early.err());

    let mut running = at_the_pace_of_the_arm(&lab);
    let mut reader = python(&lab, &["plumb_streams.py", "arm/joints"]).unwrap();
    let mut reading = reader.stdout(Stdio::piped()).spawn().unwrap();
    let lines = BufReader::new(reading.stdout.take().unwrap()).lines();
    let mut messages: Vec<Value> = Vec::new();
    for line in lines {
        messages.push(serde_json::from_str(&line.unwrap()).unwrap());
        if messages.len() == 60 {
            kill(Pid::from_raw(running.id().cast_signed()), Signal::SIGTERM).unwrap();
        }
    }
    running.wait().unwrap();
    assert!(reading.wait().unwrap().success());
    assert!(messages.len() >= 60, "{} messages", messages.len());
    for pair in messages.windows(2) {
        assert_eq!(pair[1]["sequence"].as_u64(), pair[0]["sequence"].as_u64().map(|number| number + 1));
        assert!(pair[1]["time_ns"].as_u64() >= pair[0]["time_ns"].as_u64());
    }
    assert!(messages[0]["joints"].as_array().unwrap().len() > 3, "{}", messages[0]);
    let resources = CellResources::of_cell(&lab.path("cell.yaml")).unwrap();
    assert_eq!(resources.state(), Occupancy::Empty, "the last to leave removes what is left");

    // A run that is killed ends the reader too, once it reads: one that has seen no run waits for one.
    let mut running = at_the_pace_of_the_arm(&lab);
    let mut reader = python(&lab, &["plumb_streams.py", "arm/joints"]).unwrap();
    let mut reading = reader.stdout(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(reading.stdout.take().unwrap()).lines();
    lines.next().expect("the reader has read a message").unwrap();
    running.kill().unwrap();
    running.wait().unwrap();
    assert!(lines.all(|line| line.is_ok()));
    assert!(reading.wait().unwrap().success());
}
