//! Play: the driven side rests until the driving side has crossed the gap.

/// The play operator: the output follows the input at half a width's distance and remembers the side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Play {
    joint: usize,
    width: f64,
    wear: Option<Wear>,
    output: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Wear {
    at: f64,
    spread: f64,
}

impl Play {
    /// The same gap of `width` rad everywhere.
    pub fn even(joint: usize, width: f64) -> Self {
        Self { joint, width: width.abs(), wear: None, output: None }
    }

    /// Teeth worn around one angle: a gap of `width` rad at `at`, closing as a bell over `spread` rad.
    pub fn worn(joint: usize, width: f64, at: f64, spread: f64) -> Self {
        Self { joint, width: width.abs(), wear: Some(Wear { at, spread }), output: None }
    }

    /// The gap at `angle`, rad.
    pub fn width_at(&self, angle: f64) -> f64 {
        self.wear
            .map_or(self.width, |wear| self.width * (-0.5 * ((angle - wear.at) / wear.spread).powi(2)).exp())
    }

    /// The driven side after the driving side has moved straight to `input`.
    pub fn follow(&mut self, input: f64) -> f64 {
        let half = 0.5 * self.width_at(input);
        let output = self.output.map_or(input, |output| output.clamp(input - half, input + half));
        self.output = Some(output);
        output
    }
}

impl Play {
    pub(super) fn pass(&mut self, angles: &mut [f64]) {
        if let Some(angle) = angles.get_mut(self.joint) {
            *angle = self.follow(*angle);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A gap whose driven side is at `output`.
    fn play_at(output: f64, width: f64) -> Play {
        Play { output: Some(output), ..Play::even(0, width) }
    }

    proptest! {
        #[test]
        fn the_link_is_never_further_from_its_drive_than_half_the_gap(
            link in -2.0..2.0_f64, drives in prop::collection::vec(-2.0..2.0_f64, 1..20), gap in 0.0..0.5_f64,
        ) {
            let mut play = play_at(link, gap);
            for drive in drives {
                prop_assert!((play.follow(drive) - drive).abs() <= gap / 2.0 + 1e-15);
            }
        }

        #[test]
        fn following_in_many_steps_of_one_direction_ends_as_one_step_does(
            link in -0.1..0.1_f64, gap in 0.2..0.5_f64, end in 0.0..2.0_f64, steps in 1..50_u32,
        ) {
            let mut small = play_at(link, gap);
            for step in 1..=steps {
                small.follow(end * f64::from(step) / f64::from(steps));
            }
            prop_assert!((small.follow(end) - play_at(link, gap).follow(end)).abs() < 1e-15);
        }

        #[test]
        fn without_a_gap_the_link_is_its_drive(link in -2.0..2.0_f64, drive in -2.0..2.0_f64) {
            prop_assert_eq!(play_at(link, 0.0).follow(drive), drive);
        }
    }

    #[test]
    fn a_drive_that_turns_back_crosses_the_gap_before_the_link_moves() {
        let mut play = play_at(0.0, 0.2);
        assert_eq!(play.follow(1.0), 0.9);
        assert_eq!(play.follow(0.85), 0.9);
        assert!((play.follow(0.7) - 0.8).abs() < 1e-15);
    }
}
