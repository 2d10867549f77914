//! The proximity sensor in the hand: light goes out, is reflected by what lies under the hand, and switches a line.

use std::f64::consts::TAU;

use super::pose::ArmPose;
use super::target::TTarget;
use crate::chance::noise_at;
use crate::physics::rigid::Vector;

/// The table's top, z = 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Whether the arm is held up by it. Without, only light meets the table: the paper's computation, not a run.
    pub solid: bool,
    /// Reflectance where no target and no patch lies, 0 to 1.
    pub reflectance: f64,
}

/// The sensor and the circuit behind it.
#[derive(Debug, Clone, PartialEq)]
pub struct ProximitySensor {
    /// Which of the arm's input bits the line is wired to.
    pub input_bit: u32,
    /// How light becomes a signal.
    pub optics: Optics,
}

/// How light becomes a signal.
#[derive(Debug, Clone, PartialEq)]
pub enum Optics {
    /// A point that looks straight down, as the paper assumes it: it fires when it comes down over white, and is then near enough
    /// to distinguish white from black until it is raised.
    Ideal {
        /// Height at or below which it is near enough, mm: h in the paper.
        height: f64,
        /// Height above which a sensor that was near enough no longer is, mm. On the way from where it fired to line B the hand rises:
        /// by 0.18 mm in the second cycle of the paper's Table 2-1. A sensor that was blind above the height at which it fires
        /// would take that for the line.
        release_height: f64,
    },
    /// A lamp and a phototransistor whose lines of sight cross in front of them.
    Spot(Spot),
}

/// A lamp and a phototransistor in front of a Schmitt trigger.
#[derive(Debug, Clone, PartialEq)]
pub struct Spot {
    /// Diameter of the patch of table that is lit and seen, mm.
    pub diameter: f64,
    /// Distance at which most light comes back, mm.
    pub peak_distance: f64,
    /// How far below the level at which it fires the trigger lets go, as a fraction of that level.
    pub hysteresis: f64,
    /// Standard deviation of the signal's noise; the signal over a perfect white at the peak's distance is 1.
    pub noise: f64,
    /// How fast the noise changes, ns from one independent value to the next.
    pub noise_knot_ns: u64,
    /// The level of the signal at which the sensor fires, as its trim resistor is set.
    pub firing_level: f64,
}

/// What the sensor sees, against the two levels of its trigger. In units of its signal: mm for the ideal sensor; for a spot
/// the light that comes back, 1 over a perfect white at the distance of its peak.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// The signal itself.
    pub signal: f64,
    /// How far the signal is past the level at which the sensor fires; it fires at 0 or more.
    pub past_firing: f64,
    /// As `past_firing`, for a sensor that is near the surface since it last came down.
    pub past_firing_near: f64,
    /// How far the signal is past the level at which a sensor that fired lets go; it lets go below 0.
    pub past_release: f64,
}

/// What lies under the hand, and how the sensor sees it.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// The table's top.
    pub table: Table,
    /// The target on it.
    pub target: TTarget,
    /// The sensor over it.
    pub sensor: ProximitySensor,
}

/// A trigger without any hysteresis would chatter on the last digit of a floating-point number: the ideal one lets go ten
/// femtometres past the edge at which it fires.
const IDEAL_RELEASE: f64 = -1e-11;

/// A hand tilted further than this from the vertical does not look at the table, rad.
const STEEPEST_LOOK: f64 = 45.0 / 360.0 * TAU;

/// Points in the spot at which reflectance is taken.
const SPOT_SAMPLES: u32 = 160;

impl Scene {
    /// What the sensor sees without its noise.
    pub fn seen(&self, pose: &ArmPose) -> Seen {
        match &self.sensor.optics {
            Optics::Ideal { height, release_height } => {
                let tilt = (-pose.looks.z).clamp(-1.0, 1.0).acos();
                let looks_at_white = self.inside_white(pose.tool).min((STEEPEST_LOOK - tilt) * 100.0);
                let past_firing = looks_at_white.min(height - pose.tool.z);
                let past_firing_near = looks_at_white.min(release_height - pose.tool.z);
                let past_release = past_firing_near - IDEAL_RELEASE;
                Seen { signal: past_firing, past_firing, past_firing_near, past_release }
            }
            Optics::Spot(spot) => {
                let signal = spot.signal(pose, |centre| self.reflectance_of_spot(spot, centre));
                let release_level = spot.firing_level * (1.0 - spot.hysteresis);
                let past_firing = signal - spot.firing_level;
                let past_release = signal - release_level;
                Seen { signal, past_firing, past_firing_near: past_firing, past_release }
            }
        }
    }

    /// Whether the sensor is near the surface, having been so before or not: an ideal one comes near at the height at which it fires and
    /// is no longer near above the height at which it lets go.
    pub fn is_near(&self, was_near: bool, pose: &ArmPose) -> bool {
        match &self.sensor.optics {
            Optics::Ideal { height, release_height } => {
                pose.tool.z <= if was_near { *release_height } else { *height }
            }
            Optics::Spot(_) => false,
        }
    }

    /// The noise of the signal at a moment.
    pub fn noise(&self, seed: u64, time_ns: u64) -> f64 {
        match &self.sensor.optics {
            Optics::Spot(spot) if spot.noise > 0.0 => {
                spot.noise * noise_at(seed, time_ns, spot.noise_knot_ns)
            }
            _ => 0.0,
        }
    }

    /// The longest time the line must not be left unwatched, ns, if its noise is to be seen whole.
    pub fn watch_interval_ns(&self) -> Option<u64> {
        match &self.sensor.optics {
            Optics::Spot(spot) if spot.noise > 0.0 => Some(spot.noise_knot_ns / 2),
            _ => None,
        }
    }

    /// Whether the ideal sensor takes this reflectance for white.
    fn looks_white(&self, reflectance: f64) -> bool {
        reflectance >= (self.target.white + self.target.black) / 2.0
    }

    /// How far the ideal sensor's point lies inside white, mm, negative outside.
    fn inside_white(&self, point: Vector) -> f64 {
        let outside_black = self.target.outside_black(point);
        if self.looks_white(self.table.reflectance) {
            outside_black
        } else {
            outside_black.min(-self.target.outside_patch(point))
        }
    }

    /// Mean reflectance of the spot around a point of the table.
    fn reflectance_of_spot(&self, spot: &Spot, centre: Vector) -> f64 {
        let grain = spot.grain();
        let nearest_edge =
            self.target.outside_black(centre).abs().min(self.target.outside_patch(centre).abs());
        if nearest_edge > spot.diameter / 2.0 + grain {
            return self.reflectance(centre, grain);
        }
        let point_at = |(x, y)| Vector { x: centre.x + x, y: centre.y + y, z: 0.0 };
        let seen: f64 = spot.samples().map(|offset| self.reflectance(point_at(offset), grain)).sum();
        seen / f64::from(SPOT_SAMPLES)
    }

    /// Reflectance at a point of the table, its edges softened over `grain` mm.
    fn reflectance(&self, point: Vector, grain: f64) -> f64 {
        let fraction_outside = |distance: f64| (distance / grain + 0.5).clamp(0.0, 1.0);
        let blend = |inside: f64, outside: f64, fraction: f64| inside + (outside - inside) * fraction;
        let background = blend(
            self.target.white,
            self.table.reflectance,
            fraction_outside(self.target.outside_patch(point)),
        );
        blend(self.target.black, background, fraction_outside(self.target.outside_black(point)))
    }
}

impl ProximitySensor {
    /// Turns the trim resistor until the sensor just fires at this signal. False for a sensor that has none.
    pub fn trim_to(&mut self, signal: f64) -> bool {
        match &mut self.optics {
            Optics::Ideal { .. } => false,
            Optics::Spot(spot) => {
                spot.firing_level = signal.clamp(0.0, 1.0);
                true
            }
        }
    }

    /// Turns the trim resistor: the level at which the sensor fires changes by this, and stays between 0 and 1. False for a
    /// sensor that has none.
    pub fn turn_trim(&mut self, by: f64) -> bool {
        match &mut self.optics {
            Optics::Ideal { .. } => false,
            Optics::Spot(spot) => {
                spot.firing_level = (spot.firing_level + by).clamp(0.0, 1.0);
                true
            }
        }
    }
}

impl Spot {
    /// Light that comes back from a perfect white at this distance (mm), 1 at the peak: little where the lines of sight do
    /// not cross yet, and falling with the distance where they have parted.
    pub fn response(&self, distance: f64) -> f64 {
        let relative = distance.max(0.0) / self.peak_distance;
        relative.powi(2) * (2.0 * (1.0 - relative)).exp()
    }

    /// The width over which an edge is softened at one sample, so that the whole signal changes smoothly, mm.
    fn grain(&self) -> f64 {
        self.diameter * (TAU / 8.0 / f64::from(SPOT_SAMPLES)).sqrt()
    }

    fn signal(&self, pose: &ArmPose, reflectance: impl Fn(Vector) -> f64) -> f64 {
        let downward = -pose.looks.z;
        if downward < STEEPEST_LOOK.cos() {
            return 0.0;
        }
        let distance = pose.tool.z / downward;
        let centre = Vector {
            x: pose.tool.x + pose.looks.x * distance,
            y: pose.tool.y + pose.looks.y * distance,
            z: 0.0,
        };
        self.response(distance) * reflectance(centre)
    }

    /// Points spread evenly over the spot, from its centre (mm): a sunflower's seeds.
    fn samples(&self) -> impl Iterator<Item = (f64, f64)> {
        const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;
        let radius = self.diameter / 2.0;
        (0..SPOT_SAMPLES).map(move |sample| {
            let reach = radius * ((f64::from(sample) + 0.5) / f64::from(SPOT_SAMPLES)).sqrt();
            let (sine, cosine) = (f64::from(sample) * GOLDEN_ANGLE).sin_cos();
            (reach * cosine, reach * sine)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::target::tests::target;
    use super::*;

    fn scene(optics: Optics) -> Scene {
        Scene {
            table: Table { solid: true, reflectance: 0.8 },
            target: target(),
            sensor: ProximitySensor { input_bit: 0, optics },
        }
    }

    fn spot() -> Spot {
        let untrimmed = Spot {
            diameter: 4.0,
            peak_distance: 5.0,
            hysteresis: 0.02,
            noise: 0.0,
            noise_knot_ns: 1_000_000,
            firing_level: 0.0,
        };
        Spot { firing_level: untrimmed.response(8.0) * 0.9, ..untrimmed }
    }

    fn hanging_at(x: f64, y: f64, z: f64) -> ArmPose {
        ArmPose {
            elbow: Vector::default(),
            wrist: Vector { x, y, z: z + 109.0 },
            tool: Vector { x, y, z },
            looks: Vector { x: 0.0, y: 0.0, z: -1.0 },
        }
    }

    fn fires(scene: &Scene, x: f64, y: f64, z: f64) -> bool {
        scene.seen(&hanging_at(x, y, z)).past_firing >= 0.0
    }

    #[test]
    fn the_ideal_sensor_fires_over_white_at_its_height_and_not_over_black() {
        let scene = scene(Optics::Ideal { height: 8.0, release_height: 10.0 });
        assert!(fires(&scene, 170.0, 20.0, 8.0));
        assert!(!fires(&scene, 170.0, 20.0, 8.001));
        assert!(!fires(&scene, 130.0, 20.0, 7.0));
    }

    #[test]
    fn a_dark_table_is_no_white_beyond_the_patch() {
        let mut scene = scene(Optics::Ideal { height: 8.0, release_height: 10.0 });
        assert!(fires(&scene, 300.0, 0.0, 5.0));
        scene.table.reflectance = 0.1;
        assert!(!fires(&scene, 300.0, 0.0, 5.0));
        assert!(fires(&scene, 170.0, 20.0, 5.0));
    }

    #[test]
    fn a_level_hand_does_not_see_the_table() {
        for optics in [Optics::Ideal { height: 8.0, release_height: 10.0 }, Optics::Spot(spot())] {
            let scene = scene(optics);
            let mut level = hanging_at(170.0, 20.0, 5.0);
            level.looks = Vector { x: 1.0, y: 0.0, z: 0.0 };
            assert!(scene.seen(&level).past_release < 0.0);
        }
    }

    #[test]
    fn the_trimmed_spot_fires_over_the_patch_at_its_distance() {
        let scene = scene(Optics::Spot(spot()));
        assert!(!fires(&scene, 170.0, 20.0, 8.01));
        assert!(fires(&scene, 170.0, 20.0, 7.99));
    }

    #[test]
    fn over_an_edge_half_of_the_spot_reflects() {
        let scene = scene(Optics::Spot(spot()));
        let far = scene.seen(&hanging_at(170.0, 20.0, 6.0)).signal;
        let (sine, cosine) = 8_f64.to_radians().sin_cos();
        let over_edge = scene.seen(&hanging_at(140.0 * cosine, 140.0 * sine, 6.0)).signal;
        let half = far * (0.5 * 0.9 + 0.5 * 0.05) / 0.9;
        assert!((over_edge - half).abs() < 0.01 * far, "{over_edge} of {far}, {half} expected");
    }

    #[test]
    fn the_trigger_lets_go_below_the_level_at_which_it_fires() {
        let seen = scene(Optics::Spot(spot())).seen(&hanging_at(170.0, 20.0, 8.0));
        assert!(seen.past_firing.abs() < 1e-12);
        assert!((seen.past_release / seen.signal - 0.02).abs() < 1e-12);
    }

    #[test]
    fn the_ideal_sensor_holds_over_white_up_to_its_release_height() {
        let scene = scene(Optics::Ideal { height: 8.0, release_height: 10.0 });
        assert!(scene.seen(&hanging_at(170.0, 20.0, 9.999)).past_release > 0.0);
        assert!(scene.seen(&hanging_at(170.0, 20.0, 10.001)).past_release < 0.0);
        assert!(scene.seen(&hanging_at(130.0, 20.0, 8.0)).past_release < 0.0);
    }
}
