//! The Scan screen: stripes come in, keys and mouse turn the cloud, and it is drawn at several sizes.

use plumb_cell::event::Event;
use plumb_cloud::Cloud;
use ratatui::crossterm::event::KeyCode;
use ratatui::style::Color;

use super::fixtures::{begun, deliver, drawn, page, path, press, started};
use crate::screens::message::{Action, Message};
use crate::screens::scan::{ScanState, Viewpoint, picture};
use crate::screens::screen::Screen;
use crate::screens::state::State;
use crate::screens::theme::Theme;
use crate::screens::update::update;

/// The stripe at `x` over a table with a ridge along x.
fn stripe(number: u32) -> Event {
    let x = 5.0 * number as f32;
    let points = (0..41_u8).map(|row| {
        let y = f32::from(row) - 20.0;
        [x, y, (10.0 - y.abs()).max(0.0) - 300.0]
    });
    Event::StripeTaken {
        step: path("scan"),
        device: "stripe".to_owned(),
        stripe: number,
        points: points.collect(),
    }
}

pub(super) fn scanned() -> State {
    let mut state = begun();
    deliver(&mut state, started("scan"));
    for number in 0..8 {
        deliver(&mut state, stripe(number));
    }
    press(&mut state, KeyCode::Char('6'));
    state
}

/// How the eye is, deg.
fn viewpoint(state: &State) -> (f64, f64) {
    match &state.scan.as_ref().unwrap().eye.viewpoint {
        Viewpoint::Around { yaw, pitch, .. } => (yaw.to_degrees().round(), pitch.to_degrees().round()),
        Viewpoint::EdgeOn { .. } => panic!("edge-on"),
    }
}

#[test]
fn stripes_show_as_they_are_taken_and_a_new_scan_begins_anew() {
    let mut state = begun();
    press(&mut state, KeyCode::Char('6'));
    assert_ne!(state.screen, Screen::Scan);
    assert!(page(&state, 120, 40).contains("No scan has begun"));
    let mut state = scanned();
    assert_eq!(state.screen, Screen::Scan);
    assert!(page(&state, 120, 40).contains("scan \u{b7} 328 points, 8 stripes"));
    press(&mut state, KeyCode::Left);
    let eye = viewpoint(&state);
    deliver(&mut state, stripe(8));
    assert!(page(&state, 120, 40).contains("369 points, 9 stripes"));
    assert_eq!(viewpoint(&state), eye, "the eye stays where the operator set it");
    deliver(&mut state, stripe(0));
    assert!(page(&state, 120, 40).contains("41 points, 1 stripes"));
}

#[test]
fn the_scan_page_at_every_size() {
    let mut state = scanned();
    for (width, height) in [(80, 24), (120, 40), (40, 10), (1, 1)] {
        insta::assert_snapshot!(format!("scan-{width}x{height}"), page(&state, width, height));
    }
    press(&mut state, KeyCode::Char('e'));
    insta::assert_snapshot!("scan-edge-on", page(&state, 100, 30));
}

#[test]
fn the_mouse_turns_moves_zooms_and_points() {
    let mut state = scanned();
    state.size = (120, 40);
    page(&state, 120, 40);
    let before = viewpoint(&state);
    update(&mut state, Message::Click { column: 40, row: 20 });
    assert!(state.scan.as_ref().unwrap().cursor.is_some(), "a click points at something");
    update(&mut state, Message::Drag { column: 50, row: 18, moves: false });
    assert_eq!(viewpoint(&state), ((before.0 - 20.0 + 360.0) % 360.0, before.1 - 8.0));
    let target = state.scan.as_ref().unwrap().eye.target;
    update(&mut state, Message::Grab { column: 40, row: 20 });
    update(&mut state, Message::Drag { column: 42, row: 20, moves: true });
    assert!(state.scan.as_ref().unwrap().eye.target != target);
    let span = state.scan.as_ref().unwrap().eye.span;
    update(&mut state, Message::Scroll(-1));
    assert!(state.scan.as_ref().unwrap().eye.span < span, "the wheel goes nearer");
}

#[test]
fn without_colours_none_is_used_and_with_them_height_is_shown_by_colour() {
    let colours = |theme: Theme| {
        let mut state = scanned();
        state.theme = theme;
        let drawn = drawn(&state, 80, 24);
        let buffer = drawn.buffer();
        let mut colours: Vec<Color> = buffer.content().iter().map(|cell| cell.fg).collect();
        colours.sort_by_key(|colour| format!("{colour:?}"));
        colours.dedup();
        colours
    };
    assert_eq!(colours(Theme::plain()), [Color::Reset]);
    let coloured = colours(Theme::coloured());
    assert!([Color::Blue, Color::Green, Color::Red].iter().all(|one| coloured.contains(one)), "{coloured:?}");
}

#[test]
fn pictures_are_asked_for_by_the_name_of_the_cloud() {
    let mut state = scanned();
    let actions = press(&mut state, KeyCode::Char('x'));
    let [Action::SavePicture { name, bytes: Ok(bytes) }] = actions.as_slice() else { panic!("{actions:?}") };
    assert_eq!(name, "scan-view");
    assert!(bytes.starts_with(b"\x89PNG"));
}

#[test]
fn a_cloud_without_points_or_with_one_is_drawn_all_the_same() {
    let mut cloud = Cloud::default();
    for _ in 0..2 {
        let mut scan = ScanState::of_cloud("nothing.ply".to_owned(), cloud.clone());
        assert!(!scan.toggle_edge_on());
        picture(&scan, Default::default(), true).unwrap();
        for size in [(80, 24), (1, 1), (200, 3)] {
            page(&State::of_cloud(scan.clone(), Theme::plain()), size.0, size.1);
        }
        let point = plumb_cloud::CloudPoint {
            position: [1.0, 2.0, 3.0].into(),
            stripe: 0,
            seen: plumb_plugin::StripePoint::default(),
        };
        cloud.points.push(point);
    }
}
