//! Fuzz targets: every reader of bytes from outside, given files and replies that were changed at random.
//!
//! Each target begins with whole files (those of `workcells/`, and `corpus/` beside this file), changes them, and wants an answer or a refusal:
//! no panic, no hang, within [`limits`] of time and memory. As a test each runs for a second. For hours, or led by coverage:
//!
//! ```text
//! BOLERO_RANDOM_TEST_TIME_MS=3600000 BOLERO_RANDOM_ITERATIONS=1000000000 cargo test -p plumb --test fuzz -- table
//! cargo bolero test -p plumb --rustc-bootstrap table
//! ```

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    dead_code,
    reason = "a test that cannot go on fails; some of what it shares with the program it does not use"
)]

mod corpus;
mod limits;
mod mutation;

use std::fs;
use std::path::Path;

use corpus::{Beside, of_folder, shipped, shipped_under};
use limits::within_limits;
use mutation::Changes;
use plumb_calibration::arm_model::Model;
use plumb_calibration::table::Table;
use plumb_cell::check_file;
use plumb_cell::event::StampedEvent;
use plumb_cell::expression::Calculator;
use plumb_diagnosis::stripe::{Scans, read_scene};
use plumb_document::DocumentKind;
use plumb_kinematics::urdf::UrdfArm;
use plumb_plugin::{FrameHeader, Manifest, PluginError, Reply, Request, StripeHeader};
use plumb_simulated::physics::campaign::seal;
use plumb_simulated::physics::description::ArmDescription;
use plumb_simulated::protocol::{Answer, Call, Hello, Welcome};

/// How long a target runs as a test.
const AS_A_TEST: std::time::Duration = std::time::Duration::from_secs(1);

/// A reader of bytes.
struct Reader<F>(F);

/// What a reader leaves half done when it panics is looked at by nobody.
impl<F> std::panic::RefUnwindSafe for Reader<F> {}

impl<F: Fn(&[u8])> Reader<F> {
    fn read(&self, target: &'static str, bytes: &[u8]) {
        within_limits(target, bytes, &self.0);
    }
}

/// A target: its name, the whole files it begins with, and the reader.
macro_rules! target {
    ($name:ident, $whole:expr, $read:expr) => {
        #[test]
        fn $name() {
            let whole: Vec<Vec<u8>> = $whole.into_iter().chain(of_folder(stringify!($name))).collect();
            assert!(!whole.is_empty(), "there are no files to begin with");
            let reader = Reader($read);
            for bytes in &whole {
                reader.read(stringify!($name), bytes);
            }
            bolero::check!().with_type::<Changes>().with_test_time(AS_A_TEST).for_each(
                |changes: &Changes| {
                    reader.read(stringify!($name), &changes.of(&whole));
                },
            );
        }
    };
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// A reader of cell, procedure or answers files, each changed file in the folder of the TeachMover's cell.
fn checked(name: &'static str, kind: DocumentKind) -> impl Fn(&[u8]) {
    let cell = Beside::cell("teachmover");
    let calculator = Calculator::new();
    move |bytes| {
        let file = cell.write(name, bytes);
        if let Err(problems) = check_file(&file, kind, &calculator) {
            for problem in problems {
                assert!(problem.to_string().len() < 100_000, "words, not the file");
            }
        }
    }
}

/// A reader that takes a file's name.
fn from_file(name: &'static str, read: impl Fn(&Path)) -> impl Fn(&[u8]) {
    let folder = Beside::nothing();
    move |bytes| read(&folder.write(name, bytes))
}

target!(
    cell,
    [shipped("teachmover/cell.yaml"), shipped("puma/cell.yaml")],
    checked("changed.yaml", DocumentKind::Cell)
);
target!(
    procedure,
    shipped_under("teachmover/procedures", "yaml"),
    checked("procedures/changed.yaml", DocumentKind::Procedure)
);
target!(answers, [shipped("teachmover/answers.yaml")], checked("changed.yaml", DocumentKind::Answers));
target!(model, corpus::models(), |bytes: &[u8]| {
    let _read = Model::parse("model.yaml", &text(bytes));
});
target!(table, [corpus::table()], |bytes: &[u8]| {
    let _read = Table::parse("table.csv", &text(bytes));
});
target!(poses, [b"q1_deg, load_kg\n10,0\n\n-20.5, 1.5\n".to_vec()], |bytes: &[u8]| {
    let _read = plumb_cell::step::Rows::parse(&text(bytes));
});
target!(world, corpus::worlds(), |bytes: &[u8]| {
    let _read = plumb_simulated::world_file::parse("world.yaml", &text(bytes));
});
target!(arm_description, corpus::arm_descriptions(), |bytes: &[u8]| {
    let _read = ArmDescription::from_yaml(&text(bytes));
});
target!(urdf, [], |bytes: &[u8]| {
    let _read = UrdfArm::parse(&text(bytes), None);
});
target!(
    rig,
    [shipped("light-stripe/rig.yaml"), shipped("light-stripe/rig-modern.yaml")],
    from_file("rig.yaml", |path| drop(plumb_light_stripe::geometry::read_rig(path)))
);
target!(scene, [shipped("light-stripe/scene.yaml")], from_file("scene.yaml", |path| drop(read_scene(path))));
target!(camera, corpus::cameras(), |bytes: &[u8]| {
    let _read = plumb_light_stripe::geometry::read_camera(&text(bytes), "camera.yaml");
});
target!(manifest, corpus::manifests(), |bytes: &[u8]| {
    let _read = Manifest::parse(&text(bytes), "plugin.yaml");
});
target!(picture_pgm, corpus::pgm(), from_file("a.pgm", read_picture));
target!(picture_png, [corpus::png()], from_file("a.png", read_picture));
target!(picture_raw, corpus::pgm(), from_file("a.raw", read_picture));
target!(cloud_ply, [corpus::cloud("ply")], from_file("a.ply", |path| drop(plumb_cloud::read(path))));
target!(cloud_pcd, [corpus::cloud("pcd")], from_file("a.pcd", |path| drop(plumb_cloud::read(path))));
target!(cloud_e57, [corpus::cloud("e57")], from_file("a.e57", |path| drop(plumb_cloud::read(path))));
target!(scan_tables, [corpus::scan()], |bytes: &[u8]| {
    let both = text(bytes);
    let (poses, stripes) = both.split_once("====\n").unwrap_or((&both, ""));
    let _read = Scans::default().add("scan", (Path::new("p"), poses), (Path::new("s"), stripes));
});
target!(sealed_answer, [corpus::sealed_answer()], |bytes: &[u8]| drop(seal::open(&text(bytes))));
target!(
    val2_reply,
    corpus::lines_of(&[".WHERE", "JT1      JT2      JT3", "*Robot power off*"]),
    |bytes: &[u8]| {
        use plumb_puma::reply::{Ending, Reply};
        let _sign = plumb_puma::reply::sign(bytes);
        for ending in [Ending::Command, Ending::Busy, Ending::Question] {
            let reply = Reply::of(bytes, ending);
            let _read = (reply.controller_error(), reply.is_greeting());
            assert!(reply.rows().iter().flatten().all(|number| number.is_finite()));
        }
    }
);
target!(teachmover_reply, corpus::lines_of(&["0", "1", "2,0,0,0,0,0,0,0", "?"]), |bytes: &[u8]| {
    let _status = plumb_teachmover::protocol::parse_status(bytes);
    let _state = plumb_teachmover::protocol::parse_state(bytes);
    let _program = plumb_teachmover::protocol::parse_program(bytes);
});
target!(rtde_packages, corpus::rtde_packages(), |bytes: &[u8]| {
    use plumb_universal_robots::rtde::{Packages, State, accepted, controller_version, recipe, text};
    let mut packages = Packages::default();
    packages.push(bytes);
    while let Ok(Some((kind, body))) = packages.take() {
        let _read = (accepted(kind, &body), controller_version(&body), recipe(kind, &body), text(&body));
        if let Ok(state) = State::read(1, &body) {
            assert!(state.timestamp.is_finite() && state.joints.iter().all(|joint| joint.is_finite()));
        }
    }
});
target!(primary_messages, corpus::primary_messages(), |bytes: &[u8]| {
    let mut messages = plumb_universal_robots::primary::Messages::default();
    messages.push(bytes);
    while let Ok(Some(_said)) = messages.take() {}
});
target!(world_protocol, corpus::world_lines(), |bytes: &[u8]| {
    let _call: Result<Call, _> = serde_json::from_slice(bytes);
    let _answer: Result<Answer, _> = serde_json::from_slice(bytes);
    let _hello: Result<Hello, _> = serde_json::from_slice(bytes);
    let _welcome: Result<Welcome, _> = serde_json::from_slice(bytes);
});
target!(host_arguments, [br#"{"device":"arm","domain_prefix":"p","domain_root":"/r","manifest":"m","library":"l","config":{},"inputs":[],"joint_ranges":[],"guard":null,"watchdog_grace_ms":1}"#.to_vec()], |bytes: &[u8]| {
    let _read: Result<plumb_host::HostArguments, _> = serde_json::from_slice(bytes);
});
target!(requests, corpus::requests(), |bytes: &[u8]| {
    let (first, body) = bytes.split_first().unwrap_or((&0, &[]));
    let _request = Request::decode(u32::from(*first), body);
    let failed = Reply::encode(&Err(PluginError::Failed("no".to_owned()))).1;
    for status in [Reply::encode(&Ok(Reply::Done)).1, failed] {
        let _reply = Reply::decode(u32::from(*first), status, body);
    }
});
target!(stream_messages, corpus::messages(), |bytes: &[u8]| {
    let _frame = FrameHeader::read(bytes);
    let _stripe = StripeHeader::read(bytes);
});
target!(events, corpus::events(), |bytes: &[u8]| {
    let _read: Result<StampedEvent, _> = serde_json::from_slice(bytes);
});
target!(record, [corpus::record()], |bytes: &[u8]| {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("plumb.sqlite3"), bytes).unwrap();
    if let Ok(record) = plumb_record::Record::open(folder.path()) {
        let _damage = record.damage();
        let _runs = record.number_of_runs();
        let _found = record.find_runs(&plumb_record::RunFilter::default());
        let _sites = record.corrected_sites();
    }
});

fn read_picture(path: &Path) {
    let _read = plumb_light_stripe::frame::read_picture(path, Some(16));
}
