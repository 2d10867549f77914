//! The bytes, as Universal Robots' guide has them:
//! <https://docs.universal-robots.com/tutorials/communication-protocol-tutorials/rtde-guide.html>

use plumb_universal_robots::rtde::{
    Kind, Packages, RtdeError, STATE_BYTES, State, accepted, controller_version, integer_input, recipe,
    request_version, set_up_inputs, set_up_outputs, text,
};
use proptest::prelude::*;

#[test]
fn requests_are_the_guides_bytes() {
    assert_eq!(request_version(), [0, 5, b'V', 0, 2]);
    assert_eq!(
        set_up_outputs(125.0, &["timestamp".to_owned(), "actual_q".to_owned()]),
        [&[0, 29, b'O', 0x40, 0x5f, 0x40, 0, 0, 0, 0, 0][..], b"timestamp,actual_q"].concat()
    );
    assert_eq!(set_up_inputs(&["a".to_owned()]), [0, 4, b'I', b'a']);
    assert_eq!(integer_input(3, -2), [0, 8, b'U', 3, 0xff, 0xff, 0xff, 0xfe]);
}

#[test]
fn answers_are_read_whatever_pieces_they_come_in() {
    let answers: &[u8] = &[
        0, 4, b'V', 1, 0, 19, b'v', 0, 0, 0, 5, 0, 0, 0, 19, 0, 0, 0, 0, 0, 18, 0x79, 0x27, 0, 10, b'O', 1,
        b'D', b'O', b'U', b'B', b'L', b'E', 0, 10, b'M', 2, b'h', b'i', 2, b'm', b'e', 3,
    ];
    let mut packages = Packages::default();
    let mut found = Vec::new();
    for byte in answers {
        packages.push(&[*byte]);
        found.extend(packages.take().unwrap());
    }
    let [
        (Kind::RequestVersion, version),
        (Kind::ControllerVersion, software),
        (Kind::SetUpOutputs, outputs),
        (Kind::Text, message),
    ] = found.as_slice()
    else {
        panic!("{found:?}")
    };
    assert_eq!(accepted(Kind::RequestVersion, version), Ok(true));
    assert_eq!(controller_version(software), Ok([5, 19, 0, 1_210_663]));
    assert_eq!(recipe(Kind::SetUpOutputs, outputs), Ok((1, vec!["DOUBLE".to_owned()])));
    assert_eq!(text(message), "hi");
}

/// A state by hand: recipe 1, 12.5 s, joints 0.1 to 0.6, at rest, running, normal, stopped, programs 7 and 6.
fn state() -> Vec<u8> {
    let mut bytes = vec![1];
    for number in [12.5, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.0, 0.0, 0.0, 0.0, 0.0, -0.25_f64] {
        bytes.extend(number.to_be_bytes());
    }
    for number in [7, 1, 1, 7, 6_i32] {
        bytes.extend(number.to_be_bytes());
    }
    bytes
}

#[test]
fn a_state_is_read_and_one_that_is_cut_or_another_recipes_is_not() {
    let bytes = state();
    assert_eq!(bytes.len(), STATE_BYTES);
    let read = State::read(1, &bytes).unwrap();
    assert_eq!((read.timestamp, read.joints, read.fastest()), (12.5, [0.1, 0.2, 0.3, 0.4, 0.5, 0.6], 0.25));
    assert_eq!((read.robot_mode.0, read.runtime.0, read.begun, read.ended), (7, 1, 7, 6));
    let wrong = |found| RtdeError::Size { kind: 'U', found, requested: STATE_BYTES };
    assert_eq!(State::read(2, &bytes), Err(wrong(STATE_BYTES)));
    assert_eq!(State::read(1, &bytes[..60]), Err(wrong(60)));
    let longer = [&bytes[..], &[0]].concat();
    assert_eq!(State::read(1, &longer), Err(wrong(STATE_BYTES + 1)));
    let mut no_number = bytes.clone();
    no_number[9..17].copy_from_slice(&f64::NAN.to_be_bytes());
    assert_eq!(State::read(1, &no_number), Err(RtdeError::NotFinite("a joint")));
}

#[test]
fn what_is_no_rtde_is_named() {
    for (bytes, error) in [(&[0, 2, b'V'][..], RtdeError::Length(2)), (&[0, 3, b'X'], RtdeError::Kind(b'X'))]
    {
        let mut packages = Packages::default();
        packages.push(bytes);
        assert_eq!(packages.take(), Err(error));
    }
}

proptest! {
    #[test]
    fn no_bytes_bring_it_down(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        let mut packages = Packages::default();
        packages.push(&bytes);
        while let Ok(Some((kind, body))) = packages.take() {
            let _read = (accepted(kind, &body), controller_version(&body), recipe(kind, &body), text(&body));
            if let Ok(state) = State::read(1, &body) {
                prop_assert!(state.fastest().is_finite());
            }
        }
    }
}
