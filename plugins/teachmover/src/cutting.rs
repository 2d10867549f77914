//! Cutting a move into pieces short enough for a stop.
//!
//! The controller cannot be interrupted from the line: it answers when a move has ended. So a move goes out in pieces, and a stop takes effect
//! at the end of the piece that is under way. The worst moment for a stop is just before the first byte of a piece: then the arm still
//! moves after the time of the command on the line and the time of the motion. At 9600 baud a move of one joint takes some 24 characters
//! (25 ms), one of all six up to 34 (35 ms); with 15 ms kept for the way of the stop to this plugin and for the system, 100 ms leave 60 ms and
//! 50 ms of motion, which is 17 and 14 half-steps at speed code 220 (290 a second). Reading registers and inputs after each piece takes 25 to
//! 55 ms more, in which the arm is at rest.

use std::time::Duration;

use crate::drive::{HalfSteps, MOTORS};
use crate::protocol::Command;
use crate::speed_code::SpeedCode;

/// What is kept of the stop time for the way of a stop to this plugin, and for the system's way with bytes and threads.
const RESERVE: Duration = Duration::from_millis(15);

/// What decides how long a piece may be.
#[derive(Clone, Copy, Debug)]
pub struct Cutting {
    /// How fast the piece runs.
    pub speed: SpeedCode,
    /// The time of one character on the line.
    pub character: Duration,
    /// How long a stop may take.
    pub stop_within: Duration,
    /// How many times longer than the speed code says the motors have been seen to take; at least 1.
    pub slowness: f64,
    /// How far the whole move closes the gripper, and by how much a piece may, where its switch is watched.
    pub closing: Option<Closing>,
    /// Whether each piece is one half-step of the motor that makes the most of them: the pose at which an input changes is known no finer
    /// than a piece.
    pub finest: bool,
}

/// A gripper that closes while its switch is watched, half-steps beside following the elbow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Closing {
    /// By how much the move closes it.
    pub by: u32,
    /// By how much one piece may.
    pub piece: u32,
}

impl Cutting {
    /// The pieces of a move, each the counts of one command; they add up to `travel` and stay within one half-step of the straight line.
    pub fn pieces(&self, travel: HalfSteps) -> Vec<HalfSteps> {
        let count = self.count(travel);
        let at = |piece: u32| {
            let mut counts = travel;
            for value in &mut counts.0 {
                *value = (f64::from(*value) * f64::from(piece) / f64::from(count)).round() as i32;
            }
            counts
        };
        (0..count).map(|piece| at(piece + 1).since(at(piece))).collect()
    }

    /// The longest time from a stop at the worst moment of a piece to its last half-step, where the pieces of a move of `joints` motors can be
    /// cut no shorter or need not be.
    pub fn longest_stop(&self, joints: usize) -> Duration {
        let mut travel = HalfSteps::default();
        for count in travel.0.iter_mut().take(joints) {
            *count = -10_000;
        }
        let piece = self.longest_piece(travel);
        RESERVE + self.duration(shrunk(travel, piece))
    }

    fn count(&self, travel: HalfSteps) -> u32 {
        let by_time = travel.largest().div_ceil(self.longest_piece(travel).max(1));
        let by_grip = self.closing.map_or(0, |closing| closing.by.div_ceil(closing.piece.max(1)));
        by_time.max(by_grip)
    }

    /// The most half-steps of the motor that makes the most of them in one piece; at least 1, however slow line and motors are.
    fn longest_piece(&self, travel: HalfSteps) -> u32 {
        let budget = self.stop_within.saturating_sub(RESERVE);
        let whole = travel.largest();
        if self.finest {
            return 1;
        }
        let at_full_budget = (budget.as_secs_f64() * self.speed.rate()) as u32;
        let longest = (1..=at_full_budget.min(whole)).rev();
        longest.into_iter().find(|piece| self.duration(shrunk(travel, *piece)) <= budget).unwrap_or(1)
    }

    /// From the first byte of a piece on the line to its last half-step.
    fn duration(&self, counts: HalfSteps) -> Duration {
        let command = Command::Step { speed: self.speed, counts, outputs: None };
        let characters = command.bytes(b'@').len() as u32;
        self.character * characters + self.speed.duration(counts.largest()).mul_f64(self.slowness)
    }
}

/// The travel shortened so that its largest count is `largest`, each count rounded away from zero: no piece's command is longer.
fn shrunk(travel: HalfSteps, largest: u32) -> HalfSteps {
    let whole = f64::from(travel.largest().max(1));
    let mut counts = [0; MOTORS];
    for (count, value) in counts.iter_mut().zip(travel.0) {
        let part = f64::from(value) * f64::from(largest) / whole;
        *count = (part.abs().ceil() as i32) * value.signum();
    }
    HalfSteps(counts)
}

/// How much longer than expected the motors have been seen to take.
#[derive(Clone, Debug, Default)]
pub struct Slowness {
    ratios: [f64; 3],
    next: usize,
}

/// What a reply may be late by for reasons other than the motors: the latency of a USB adapter and the system's.
const REPLY_LATENCY: Duration = Duration::from_millis(30);

impl Slowness {
    /// The factor, at least 1: that of the fastest of the last three pieces, so that one late reply changes nothing.
    pub fn factor(&self) -> f64 {
        self.ratios.into_iter().fold(f64::INFINITY, f64::min).max(1.0)
    }

    /// Takes in how long a piece took beside its time on the line.
    pub fn observe(&mut self, expected: Duration, measured: Duration) {
        if expected.is_zero() {
            return;
        }
        let ratio = measured.saturating_sub(REPLY_LATENCY).as_secs_f64() / expected.as_secs_f64();
        if let Some(entry) = self.ratios.get_mut(self.next) {
            *entry = ratio;
        }
        self.next = (self.next + 1) % self.ratios.len();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn at_9600(speed: u8) -> Cutting {
        Cutting {
            speed: SpeedCode::new(speed).unwrap(),
            character: Duration::from_secs_f64(10.0 / 9600.0),
            stop_within: Duration::from_millis(100),
            slowness: 1.0,
            closing: None,
            finest: false,
        }
    }

    proptest! {
        #[test]
        fn the_pieces_add_up_and_each_stops_in_time(
            travel in prop::array::uniform6(-3000..3000_i32), speed in 0..=245_u8, slowness in 1.0..3.0_f64,
        ) {
            let cutting = Cutting { slowness, ..at_9600(speed) };
            let mut end = HalfSteps::default();
            for piece in cutting.pieces(HalfSteps(travel)) {
                end = piece.after(end);
                let duration = cutting.duration(piece);
                prop_assert!(duration <= Duration::from_millis(85) || piece.largest() <= 1, "{piece:?} takes {duration:?}");
            }
            prop_assert_eq!(end, HalfSteps(travel));
        }

        #[test]
        fn the_motors_keep_in_step_along_the_way(travel in prop::array::uniform6(-3000..3000_i32)) {
            let cutting = at_9600(220);
            let (mut here, largest) = (HalfSteps::default(), f64::from(HalfSteps(travel).largest().max(1)));
            for piece in cutting.pieces(HalfSteps(travel)) {
                here = piece.after(here);
                let fraction = f64::from(here.largest()) / largest;
                for (count, whole) in here.0.iter().zip(travel) {
                    prop_assert!((f64::from(*count) - f64::from(whole) * fraction).abs() <= 1.0);
                }
            }
        }
    }

    #[test]
    fn the_documented_figures_hold() {
        let one_joint = HalfSteps([1000, 0, 0, 0, 0, 0]);
        assert_eq!(at_9600(220).longest_piece(one_joint), 17);
        assert_eq!(at_9600(220).longest_piece(HalfSteps([-1000; 6])), 14);
        assert!(at_9600(220).longest_stop(6) <= Duration::from_millis(100));
    }

    #[test]
    fn nothing_to_do_is_no_piece() {
        assert!(at_9600(220).pieces(HalfSteps::default()).is_empty());
    }

    #[test]
    fn a_line_too_slow_for_the_stop_time_is_cut_as_short_as_it_goes_and_says_so() {
        let slow = Cutting { character: Duration::from_secs_f64(10.0 / 300.0), ..at_9600(220) };
        assert_eq!(slow.longest_piece(HalfSteps([1000; 6])), 1);
        assert!(slow.longest_stop(6) > Duration::from_millis(900));
    }

    #[test]
    fn a_watched_grip_switch_makes_closing_pieces_short() {
        let watched = Cutting { closing: Some(Closing { by: 100, piece: 8 }), ..at_9600(220) };
        let pieces = watched.pieces(HalfSteps([0, 0, 0, 0, 0, -100]));
        assert!(pieces.iter().all(|piece| piece.largest() <= 8), "{pieces:?}");
        assert!(at_9600(220).pieces(HalfSteps([0, 0, 0, 0, 0, -100])).len() < pieces.len());
    }

    #[test]
    fn the_finest_pieces_are_single_half_steps() {
        let finest = Cutting { finest: true, ..at_9600(180) };
        let pieces = finest.pieces(HalfSteps([0, 7, -3, 0, 0, -3]));
        assert_eq!(pieces.len(), 7);
        assert!(pieces.iter().all(|piece| piece.largest() == 1));
    }

    #[test]
    fn one_late_reply_does_not_make_the_motors_slow_but_three_do() {
        let mut slowness = Slowness::default();
        let expected = Duration::from_millis(50);
        slowness.observe(expected, Duration::from_millis(500));
        assert_eq!(slowness.factor(), 1.0);
        slowness.observe(expected, Duration::from_millis(130));
        slowness.observe(expected, Duration::from_millis(130));
        assert!((slowness.factor() - 2.0).abs() < 1e-9);
        slowness.observe(expected, Duration::from_millis(50));
        assert_eq!(slowness.factor(), 1.0);
    }
}
