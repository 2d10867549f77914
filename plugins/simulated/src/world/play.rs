//! Play: a link follows its drive through a dead zone, so where it stands depends on where the drive has been.

/// Where the link stands once its drive has come, without turning back on the way, to `drive`.
///
/// `link` is where it stood before, `gap` the whole width of the dead zone (rad or mm, at least 0). Within the gap the link
/// rests, held by friction; beyond it the drive carries it along.
pub(super) fn follow(link: f64, drive: f64, gap: f64) -> f64 {
    let half = gap / 2.0;
    link.max(drive - half).min(drive + half)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_link_is_never_further_from_its_drive_than_half_the_gap(
            link in -2.0..2.0_f64, drives in prop::collection::vec(-2.0..2.0_f64, 1..20), gap in 0.0..0.5_f64,
        ) {
            let mut link = link;
            for drive in drives {
                link = follow(link, drive, gap);
                prop_assert!((link - drive).abs() <= gap / 2.0 + 1e-15);
            }
        }

        #[test]
        fn following_in_many_steps_of_one_direction_ends_as_one_step_does(
            link in -0.1..0.1_f64, gap in 0.2..0.5_f64, end in 0.0..2.0_f64, steps in 1..50_u32,
        ) {
            let mut small = link;
            for step in 1..=steps {
                small = follow(small, end * f64::from(step) / f64::from(steps), gap);
            }
            prop_assert!((small - follow(link, end, gap)).abs() < 1e-15);
        }

        #[test]
        fn without_a_gap_the_link_is_its_drive(link in -2.0..2.0_f64, drive in -2.0..2.0_f64) {
            prop_assert_eq!(follow(link, drive, 0.0), drive);
        }
    }

    #[test]
    fn a_drive_that_turns_back_crosses_the_gap_before_the_link_stirs() {
        let forward = follow(0.0, 1.0, 0.2);
        assert_eq!(forward, 0.9);
        assert_eq!(follow(forward, 0.85, 0.2), 0.9);
        assert!((follow(forward, 0.7, 0.2) - 0.8).abs() < 1e-15);
    }
}
