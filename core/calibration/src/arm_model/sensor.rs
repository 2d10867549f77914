//! The arm's own proximity sensor, as its data sheet has it: a lamp and a phototransistor whose lines of sight cross in front of them, and a
//! Schmitt trigger behind.

use std::f64::consts::PI;

/// What is known of the sensor. It looks along the flange's z; where it fires over the surfaces' standard white, p1 lies on the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensor {
    /// Distance at which it fires over standard white, mm.
    pub working: f64,
    /// Distance at which most light comes back, mm.
    pub peak: f64,
    /// Diameter of the spot it sees, mm.
    pub spot: f64,
    /// How far below the level at which it fires it lets go, as a fraction of that level.
    pub hysteresis: f64,
    /// Light from the dark side of an edge, as a fraction of that from the light side.
    pub dark: f64,
}

/// Rounds of halving.
const HALVINGS: usize = 60;

impl Sensor {
    /// What is wrong with its numbers, if anything.
    pub(crate) fn fault(&self) -> Option<&'static str> {
        let all = [self.working, self.peak, self.spot, self.hysteresis, self.dark];
        if all.iter().any(|number| !number.is_finite()) || self.peak <= 0.0 || self.spot < 0.0 {
            return Some(
                "a sensor needs working_mm and peak_mm above zero, and a spot_mm that is not negative",
            );
        }
        if self.working <= self.peak {
            return Some(
                "a sensor that fires at `peak_mm` or nearer fires on its way in and lets go again: working_mm has to be greater than peak_mm",
            );
        }
        if !(0.0..0.9).contains(&self.hysteresis) || !(0.0..0.9).contains(&self.dark) {
            return Some("hysteresis_percent and dark_percent lie from 0 to 90");
        }
        None
    }

    /// Light that comes back from a distance (mm), 1 where most does: little where the lines of sight do not cross yet, and falling where they
    /// have parted.
    fn light(&self, distance: f64) -> f64 {
        let relative = distance.max(0.0) / self.peak;
        relative.powi(2) * (2.0 * (1.0 - relative)).exp()
    }

    /// How much less light comes back a mm further, as a fraction, where the sensor works.
    pub(crate) fn falls_off(&self) -> f64 {
        2.0 / self.peak - 2.0 / self.working
    }

    /// How much higher than where it fires over a surface the sensor switches (mm), for this hysteresis: nothing on its way down.
    pub(crate) fn above(&self, came_on: bool, hysteresis: f64) -> f64 {
        if came_on {
            return 0.0;
        }
        let level = (1.0 - hysteresis) * self.light(self.working);
        let (mut near, mut far) = (self.working, 20.0 * self.peak);
        for _ in 0..HALVINGS {
            let middle = f64::midpoint(near, far);
            if self.light(middle) > level { near = middle } else { far = middle }
        }
        far - self.working
    }

    /// How far on the light side of an edge the middle of the spot is when the sensor switches, in radii of the spot, at this distance (mm).
    pub(crate) fn early(&self, came_on: bool, distance: f64, hysteresis: f64) -> f64 {
        let level = if came_on { 1.0 } else { 1.0 - hysteresis };
        let needed = level * self.light(self.working) / self.light(distance).max(1e-9);
        light_side((needed - self.dark) / (1.0 - self.dark))
    }
}

/// How far on the light side of an edge a disk of radius 1 has its middle when this share of it is light.
fn light_side(fraction: f64) -> f64 {
    let (mut low, mut high) = (-1.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = f64::midpoint(low, high);
        // The area of a circular segment, over that of the disk.
        let light = 0.5 + (middle * (1.0 - middle * middle).max(0.0).sqrt() + middle.asin()) / PI;
        if light < fraction { low = middle } else { high = middle }
    }
    f64::midpoint(low, high)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SENSOR: Sensor = Sensor { working: 8.0, peak: 5.0, spot: 4.0, hysteresis: 0.1, dark: 0.05 };

    #[test]
    fn half_a_spot_is_light_when_its_middle_is_over_the_edge() {
        assert!(light_side(0.5).abs() < 1e-9);
        assert!((light_side(1.0) - 1.0).abs() < 1e-4);
        assert!((light_side(0.25) + light_side(0.75)).abs() < 1e-9);
    }

    #[test]
    fn it_lets_go_higher_than_it_fires() {
        assert_eq!(SENSOR.above(true, 0.1), 0.0);
        let above = SENSOR.above(false, 0.1);
        let ratio = SENSOR.light(8.0 + above) / SENSOR.light(8.0);
        assert!((ratio - 0.9).abs() < 1e-9, "{above} mm above, {ratio}");
    }

    #[test]
    fn nearer_to_the_paper_less_of_the_spot_has_to_be_light() {
        assert!(SENSOR.early(false, 6.0, 0.1) < SENSOR.early(false, 8.0, 0.1));
        assert!(SENSOR.early(true, 6.0, 0.1) > SENSOR.early(false, 6.0, 0.1));
    }
}
