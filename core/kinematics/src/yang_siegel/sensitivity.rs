//! What the paper's sections 4 and 6 say the method is sensitive to, apart from the recursion itself.

/// How far the waist's zero spreads (rad) when the target is `offset` mm off the waist's axis and the hand starts between
/// `near` and `far` mm from it: `acos(e / R2) - acos(e / R1)` (figure 5).
///
/// `None` where the offset is larger than a distance.
pub fn waist_spread(offset: f64, near: f64, far: f64) -> Option<f64> {
    let reachable = near > 0.0 && far > 0.0 && offset.abs() <= near.min(far);
    reachable.then(|| (offset / far).acos() - (offset / near).acos())
}

/// How far from vertical the forearm may start (rad) so that its swing through the vertical does not lower the hand by more than
/// the sensor's working `clearance` (mm): `acos((L2 - h) / L2)` (section 6, figure 12).
///
/// `None` where the clearance is negative or longer than twice the forearm.
pub fn start_tolerance(forearm: f64, clearance: f64) -> Option<f64> {
    let possible = forearm > 0.0 && (0.0..=2.0 * forearm).contains(&clearance);
    possible.then(|| ((forearm - clearance) / forearm).acos())
}

/// By how much the sensor rises (mm) when a hand of length `hand`, already `tilt` off the vertical, tilts by `further` more (rad):
/// `L3 (cos Q - cos(Q + dQ))` (section 4.5).
pub fn hand_height_loss(hand: f64, tilt: f64, further: f64) -> f64 {
    hand * (tilt.cos() - (tilt + further).cos())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_forearms_tolerance_is_the_papers_17_degrees_15_minutes() {
        let minutes = start_tolerance(177.8, 8.0).unwrap().to_degrees() * 60.0;
        assert_eq!(minutes.round(), 17.0 * 60.0 + 15.0);
    }

    #[test]
    fn a_target_one_millimetre_off_costs_less_than_a_tenth_of_a_degree() {
        let degrees = waist_spread(1.0, 140.0, 180.0).unwrap().to_degrees();
        assert!((0.090..0.0915).contains(&degrees), "{degrees}");
        assert_eq!(waist_spread(0.0, 140.0, 180.0), Some(0.0));
        assert_eq!(waist_spread(150.0, 140.0, 180.0), None);
    }

    #[test]
    fn a_tenth_of_a_degree_at_the_wrist_costs_the_papers_three_micron() {
        let micron = hand_height_loss(109.0, 1.0_f64.to_radians(), 0.1_f64.to_radians()) * 1e3;
        assert!((3.4..3.6).contains(&micron), "{micron}");
    }

    #[test]
    fn a_clearance_no_forearm_has_is_refused() {
        assert_eq!(start_tolerance(177.8, -1.0), None);
        assert_eq!(start_tolerance(177.8, 400.0), None);
    }
}
