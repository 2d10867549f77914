//! Whatever a file or a client says, the world answers and goes on.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use std::cell::RefCell;
use std::io::{Read, Write};
use std::net::Shutdown;
use std::os::unix::net::UnixStream;

use common::{Served, world_path};
use plumb_simulated::protocol::{Pace, WorldCommand};
use plumb_simulated::world::World;
use plumb_simulated::world::file::parse;
use proptest::prelude::*;

/// A world file with a piece of its text replaced by another.
fn mangled() -> impl Strategy<Value = String> {
    let whole = std::fs::read_to_string(world_path("world-worn.yaml")).unwrap();
    let pieces = prop_oneof![
        "[ -~\\n]{0,8}",
        Just("&a [*a, *a]".to_owned()),
        Just("1e308".to_owned()),
        Just("-.inf".to_owned()),
        Just("{".to_owned()),
        "[0-9.e-]{1,5}",
    ];
    (0..whole.len(), 0..12_usize, pieces).prop_map(move |(offset, length, piece)| {
        let mut text = whole.clone();
        text.replace_range(offset..(offset + length).min(text.len()), &piece);
        text
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn a_mangled_world_file_is_read_or_refused_with_its_position(text in mangled()) {
        match parse("world.yaml", &text) {
            Ok(description) => {
                let truth = World::new(description).truth();
                prop_assert!(truth.pose.tool.z.is_finite());
            }
            Err(error) => prop_assert!(error.to_string().starts_with("world.yaml:"), "{error}"),
        }
    }
}

#[test]
fn a_client_that_babbles_harms_nobody() {
    let served = Served::start("world-ideal.yaml", Pace::Fast);
    let quiet = RefCell::new(served.connect());
    proptest!(ProptestConfig::with_cases(60), |(greets: bool, babble in prop::collection::vec(any::<u8>(), 0..400))| {
        let mut stream = UnixStream::connect(&served.socket).unwrap();
        if greets {
            stream.write_all(b"{\"protocol\":1,\"client\":\"babbler\"}\n").unwrap();
        }
        let _ = stream.write_all(&babble);
        let _ = stream.write_all(b"\n");
        let _ = stream.shutdown(Shutdown::Write);
        let mut answers = Vec::new();
        let _ = stream.read_to_end(&mut answers);
        let heard = quiet.borrow_mut().read(WorldCommand::Read {});
        prop_assert!(heard.is_ok());
    });
}
