//! Buffers as a driver hands them over, played back.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::Duration;

use plumb_plugin::conformance::{CheckOutcome, check_sensor};
use plumb_plugin::recording::RecordingHost;
use plumb_plugin::{FrameHeader, PluginError, Sensor, Value};
use serde_json::json;

use crate::V4l2Camera;
use crate::capture::{Capture, CaptureError, Shot, Stamp};
use crate::config::Config;
use crate::film::Film;
use crate::grey::{GreyFormat, Layout};

const MS: u64 = 1_000_000;

/// A buffer that was written down.
struct Buffer {
    bytes: Vec<u8>,
    number: u32,
    stamp: Stamp,
    damaged: bool,
}

impl Buffer {
    fn shot(&self) -> Shot<'_> {
        Shot { bytes: &self.bytes, number: self.number, stamp: self.stamp, damaged: self.damaged }
    }
}

/// Two rows of three pixels.
fn layout(format: &str) -> Layout {
    let format = GreyFormat::named(format).unwrap();
    Layout { width: 3, height: 2, stride: format.row_bytes(3), format, interval_ns: Some(10 * MS) }
}

fn buffer(number: u32, time_ns: u64) -> Buffer {
    Buffer { bytes: vec![number as u8; 6], number, stamp: Stamp::Arrived(time_ns), damaged: false }
}

/// The numbers of the pictures that are kept, and what is wrong.
fn kept(film: &mut Film, buffers: &[Buffer]) -> (Vec<u8>, Vec<String>) {
    for buffer in buffers {
        film.take(&buffer.shot(), 0);
    }
    let (mut numbers, mut errors) = (Vec::new(), Vec::new());
    loop {
        match film.fetch() {
            Ok(Some((picture, _))) => numbers.push(picture.pixels[0]),
            Ok(None) => return (numbers, errors),
            Err(error) => errors.push(error.to_string()),
        }
    }
}

#[test]
fn every_format_gives_its_brightness() {
    let cases: [(&str, &[u8], [u8; 6]); 6] = [
        ("GREY", &[1, 2, 3, 4, 5, 6], [1, 2, 3, 4, 5, 6]),
        ("YUYV", &[1, 90, 2, 90, 3, 90, 4, 90, 5, 90, 6, 90], [1, 2, 3, 4, 5, 6]),
        ("UYVY", &[90, 1, 90, 2, 90, 3, 90, 4, 90, 5, 90, 6], [1, 2, 3, 4, 5, 6]),
        ("Y16", &[9, 1, 9, 2, 9, 3, 9, 4, 9, 5, 9, 6], [1, 2, 3, 4, 5, 6]),
        ("Y10", &[4, 0, 255, 3, 0, 0, 0, 2, 8, 0, 255, 255], [1, 255, 0, 128, 2, 255]),
        ("NV12", &[1, 2, 3, 4, 5, 6, 90, 90, 90], [1, 2, 3, 4, 5, 6]),
    ];
    for (format, bytes, expected) in cases {
        assert_eq!(layout(format).grey(bytes).unwrap(), expected, "{format}");
    }
}

#[test]
fn what_a_driver_pads_its_rows_with_is_no_pixel() {
    let padded = Layout { stride: 5, ..layout("GREY") };
    assert_eq!(padded.grey(&[1, 2, 3, 0, 0, 4, 5, 6]).unwrap(), [1, 2, 3, 4, 5, 6]);
    assert_eq!(padded.grey(&[1, 2, 3, 0, 0, 4, 5]), None);
}

#[test]
fn a_pictures_time_is_the_middle_of_its_exposure() {
    for (stamp, expected) in [
        (Stamp::Opened(100 * MS), 102 * MS),
        (Stamp::Arrived(100 * MS), 98 * MS),
        // Of a driver that goes by another clock only when its picture came is known.
        (Stamp::Unknown, 205 * MS),
    ] {
        let mut film = Film::new(layout("GREY"), Some(4 * MS));
        film.want_one_since(0);
        film.take(&Buffer { stamp, ..buffer(1, 0) }.shot(), 207 * MS);
        assert_eq!(film.fetch().unwrap().unwrap().0.time_ns, expected, "{stamp:?}");
    }
}

#[test]
fn a_picture_that_was_begun_before_it_was_asked_for_is_not_it() {
    // 4 ms of exposure: picture 3, which arrives 10 ms after picture 2 at 20 ms, was begun at 16 ms or later.
    let mut film = Film::new(layout("GREY"), Some(4 * MS));
    film.want_one_since(15 * MS);
    let sent = [buffer(1, 10 * MS), buffer(2, 20 * MS), buffer(3, 30 * MS), buffer(4, 40 * MS)];
    assert_eq!(kept(&mut film, &sent), (vec![3], vec![]));
    // Where the exposure is not known picture 3 may have been begun at 10 ms.
    let mut film = Film::new(layout("GREY"), None);
    film.want_one_since(15 * MS);
    assert_eq!(kept(&mut film, &sent), (vec![4], vec![]));
}

#[test]
fn pictures_of_a_flight_are_kept_at_their_times() {
    let mut film = Film::new(layout("GREY"), None);
    film.keep_every(Some(25 * MS)).unwrap();
    let sent: Vec<Buffer> = (0..11).map(|number| buffer(number, u64::from(number) * 10 * MS)).collect();
    assert_eq!(kept(&mut film, &sent), (vec![0, 3, 5, 8, 10], vec![]));
    let error = film.keep_every(Some(5 * MS)).unwrap_err();
    assert!(
        error.text().starts_with(
            "a picture every 5.0 ms is asked for, but the camera takes one every 10.0 ms: set `frames_per_second`"
        ),
        "{error}"
    );
}

#[test]
fn a_lost_picture_is_reported_where_it_was_wanted() {
    let mut film = Film::new(layout("GREY"), None);
    film.keep_every(Some(10 * MS)).unwrap();
    let sent = [buffer(7, 0), buffer(8, 10 * MS), buffer(11, 40 * MS)];
    let (numbers, errors) = kept(&mut film, &sent);
    assert_eq!(numbers, [7, 8, 11]);
    assert_eq!(errors.len(), 1);
    assert!(
        errors[0].starts_with("several pictures from number 9 to 10 were lost between camera and computer"),
        "{errors:?}"
    );
    // Between two that are wanted it is no loss.
    film.keep_every(Some(50 * MS)).unwrap();
    let sent = [buffer(12, 50 * MS), buffer(14, 70 * MS), buffer(17, 100 * MS)];
    assert_eq!(kept(&mut film, &sent), (vec![12, 17], vec![]));
    // Nor is it when nobody asks.
    film.keep_every(None).unwrap();
    assert_eq!(kept(&mut film, &[buffer(30, 300 * MS)]), (vec![], vec![]));
}

#[test]
fn a_picture_out_of_order_of_another_size_or_damaged_is_left_out() {
    let mut film = Film::new(layout("GREY"), None);
    film.keep_every(Some(10 * MS)).unwrap();
    let (numbers, errors) = kept(&mut film, &[buffer(1, 20 * MS), buffer(2, 14 * MS), buffer(3, 30 * MS)]);
    assert_eq!(numbers, [1, 3]);
    assert_eq!(
        errors,
        ["picture 2 came out of order, 6.0 ms behind one that came before it; it is left out"]
    );
    let short = Buffer { bytes: vec![9; 5], ..buffer(4, 40 * MS) };
    let (numbers, errors) = kept(&mut film, &[short, buffer(5, 50 * MS)]);
    assert_eq!(numbers, [5]);
    assert_eq!(errors, ["picture 4 has 5 bytes; 3 x 2 pixels in GREY have 6: it is left out"]);
    film.want_one_since(40 * MS);
    let damaged = |number: u32| Buffer { damaged: true, ..buffer(number, u64::from(number) * 10 * MS) };
    assert_eq!(kept(&mut film, &[damaged(7), damaged(8), buffer(9, 90 * MS)]), (vec![9], vec![]));
    film.want_one_since(0);
    let broken: Vec<Buffer> = (10..30).map(damaged).collect();
    let (numbers, errors) = kept(&mut film, &broken);
    assert_eq!((numbers.len(), errors.len()), (0, 1));
    assert!(errors[0].starts_with("10 pictures one after the other came damaged"), "{errors:?}");
}

/// What a recorded camera does next.
enum Next {
    Sends(Buffer),
    Ends(CaptureError),
    Panics,
}

/// What a driver may be given ahead of time; who gives it more waits until it has done the first.
const AHEAD: usize = 4;

/// A driver that does what it is commanded, and then nothing.
struct Recorded {
    layout: Layout,
    receiver: Receiver<Next>,
    last: VecDeque<Buffer>,
}

impl Capture for Recorded {
    fn layout(&self) -> Layout {
        self.layout
    }

    #[allow(clippy::panic, reason = "as a binding does that believes its driver")]
    fn next(&mut self, wait: Duration) -> Result<Option<Shot<'_>>, CaptureError> {
        match self.receiver.recv_timeout(wait) {
            Ok(Next::Sends(buffer)) => {
                self.last.clear();
                self.last.push_back(buffer);
                Ok(self.last.back().map(Buffer::shot))
            }
            Ok(Next::Ends(error)) => Err(error),
            Ok(Next::Panics) => panic!("Invalid colorspace"),
            Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => Ok(None),
        }
    }
}

fn camera(config: &Value, host: plumb_plugin::Host) -> (SyncSender<Next>, V4l2Camera) {
    let (sender, receiver) = sync_channel(AHEAD);
    let recorded = Recorded { layout: layout("GREY"), receiver, last: VecDeque::new() };
    let camera = V4l2Camera::listen_to(Box::new(recorded), &Config::read(config).unwrap(), host).unwrap();
    (sender, camera)
}

/// A camera that takes a picture whenever the test's clock says so.
fn exposed_now(sender: &SyncSender<Next>, host: &plumb_plugin::Host, number: u32) {
    sender.send(Next::Sends(Buffer { stamp: Stamp::Opened(host.now_ns()), ..buffer(number, 0) })).unwrap();
}

#[test]
fn a_reading_is_a_picture_taken_after_it_was_asked_for() {
    let recording = RecordingHost::new();
    let config = json!({"device": "/dev/video0", "exposure_us": 1000});
    let (sender, mut camera) = camera(&config, recording.host());
    exposed_now(&sender, &recording.host(), 1);
    let host = recording.host();
    let asked_ns = host.now_ns();
    let sending = std::thread::spawn(move || {
        for number in 2..200 {
            exposed_now(&sender, &host, number);
            std::thread::yield_now();
        }
        sender
    });
    let reading = camera.read(0).unwrap().unwrap();
    let _sender = sending.join().unwrap();
    assert!(reading.time_ns > asked_ns + 500_000, "the middle of its exposure");
    let (header, pixels) = {
        let messages = recording.emitted_bytes("frames");
        let (header, pixels) = FrameHeader::read(&messages[0]).unwrap();
        (header, pixels.to_vec())
    };
    assert_eq!((header.time_ns, header.exposure_ns), (reading.time_ns, MS));
    assert_eq!((header.width, header.height, pixels.len()), (3, 2, 6));
    assert!(pixels[0] > 1, "not the one that was there before");
}

#[test]
fn an_unplugged_camera_gives_what_it_has_and_then_says_so() {
    let recording = RecordingHost::new();
    let (sender, mut camera) = camera(&json!({"device": "/dev/video0", "every_ms": 10}), recording.host());
    for number in 1..=2 {
        sender.send(Next::Sends(buffer(number, u64::from(number) * 10 * MS))).unwrap();
    }
    sender.send(Next::Ends(CaptureError::Unplugged)).unwrap();
    while recording.lines().is_empty() {
        std::thread::yield_now();
    }
    let times: Vec<u64> = (0..2).map(|_| camera.read(0).unwrap().unwrap().time_ns).collect();
    assert_eq!(times, [10 * MS, 20 * MS]);
    let gone = camera.read(0).unwrap_err();
    assert_eq!(
        gone,
        PluginError::Disconnected(
            "/dev/video0: it is gone: its cable is out, or it has lost its power. Connect it and start the device again".to_owned()
        )
    );
}

#[test]
fn a_binding_that_panics_ends_the_pictures_and_nothing_else() {
    let recording = RecordingHost::new();
    let (sender, mut camera) = camera(&json!({"device": "/dev/video0"}), recording.host());
    sender.send(Next::Panics).unwrap();
    let error = camera.read(0).unwrap_err();
    assert!(error.text().contains("its driver answered what no driver should"), "{error}");
}

#[test]
fn a_stop_ends_the_wait_for_a_picture() {
    let recording = RecordingHost::new();
    let (_sender, mut camera) = camera(&json!({"device": "/dev/video0"}), recording.host());
    recording.set_stop(true);
    assert!(matches!(camera.read(0).unwrap_err(), PluginError::Stopped(_)));
}

#[test]
fn it_conforms() {
    let config = json!({"device": "/dev/video0"});
    let report = check_sensor(include_str!("../../plugin.yaml"), |host| {
        let (sender, camera) = camera(&config, host.clone());
        std::thread::spawn(move || {
            let mut number = 0;
            let sends =
                |number| Next::Sends(Buffer { stamp: Stamp::Opened(host.now_ns()), ..buffer(number, 0) });
            while sender.send(sends(number)).is_ok() {
                number += 1;
            }
        });
        Ok(camera)
    });
    let well = |outcome: &CheckOutcome| !matches!(outcome, CheckOutcome::Failed(_));
    assert!(report.rows.iter().all(|(_, outcome)| well(outcome)), "{report}");
}
