//! A laser line sensor on the hand: points of a plane, a ball or an edge in the sensor's own plane, mm, as the profile of one exposure.

use super::ArmWorld;
use super::description::Sight;
use super::measuring::MeasuringError;
use crate::chance::normal;
use crate::physics::rigid::Rigid;
use crate::protocol::Axis;

/// Points of a profile.
pub(super) const POINTS: usize = 5;

/// Where the points lie along the line, or along the arc of a ball, as shares of its half.
const ALONG: [f64; POINTS] = [-0.8, -0.4, 0.0, 0.4, 0.8];

/// The smallest circle of a ball, as a fraction of its radius, that the sensor still sees well.
const LEAST_CIRCLE: f64 = 0.3;

impl Sight {
    /// The profile, frame of the sensor: x and z of its points.
    fn profile(&self, world_from_sensor: &Rigid, half_width: f64) -> Result<Vec<[f64; 2]>, &'static str> {
        let sensor_from_world = world_from_sensor.inverse();
        match *self {
            Sight::Plane { point, normal } => {
                let (point, normal) =
                    (sensor_from_world.apply(point), sensor_from_world.rotation.apply(normal));
                if normal.z.abs() < 0.2 {
                    return Err("the laser grazes it");
                }
                let at = |along: f64| {
                    let x = along * half_width;
                    [x, point.z + (normal.x * (point.x - x) + normal.y * point.y) / normal.z]
                };
                Ok(ALONG.map(at).to_vec())
            }
            Sight::Ball { centre, radius } => {
                let centre = sensor_from_world.apply(centre);
                let square = radius * radius - centre.y * centre.y;
                if square < (LEAST_CIRCLE * radius).powi(2) {
                    return Err("the laser passes beside the ball");
                }
                let circle = square.sqrt();
                let at = |along: f64| {
                    let x = along * circle;
                    [centre.x + x, centre.z - (square - x * x).sqrt()]
                };
                Ok(ALONG.map(at).to_vec())
            }
            Sight::Edge { point, direction } => {
                let (point, along) =
                    (sensor_from_world.apply(point), sensor_from_world.rotation.apply(direction));
                if along.y.abs() < 0.2 {
                    return Err("the laser runs along the edge");
                }
                let crossing = point - along * (point.y / along.y);
                Ok(vec![[crossing.x, crossing.z]])
            }
        }
    }
}

impl ArmWorld {
    /// One coordinate of one point of the profile of a thing, mm. A new profile is taken when x of the first point is asked for; the rest is read from the same.
    ///
    /// # Errors
    /// [`MeasuringError`]
    pub fn read_profile(&mut self, of: &str, point: usize, axis: Axis) -> Result<f64, MeasuringError> {
        let requested = point.checked_sub(1).ok_or(MeasuringError::NoSuchPoint(point))?;
        if (requested == 0 && axis == Axis::X) || self.profile.is_empty() {
            self.profile = self.take_profile(of)?;
        }
        let found = self.profile.get(requested).ok_or(MeasuringError::NoSuchPoint(point))?;
        match axis {
            Axis::X => Ok(found[0]),
            Axis::Z => Ok(found[1]),
            Axis::Y => Err(MeasuringError::AcrossTheProfile),
        }
    }

    fn take_profile(&mut self, of: &str) -> Result<Vec<[f64; 2]>, MeasuringError> {
        let flange = self.arm_state()?.link_frames.world_from_flange;
        let sensor = self.description.line_sensor.as_ref().ok_or(MeasuringError::NoLineSensor)?;
        let (error, half_width, [near, far]) = (sensor.error, sensor.half_width, sensor.reach);
        let Some((_, sight)) = sensor.sights.iter().find(|(name, _)| name == of) else {
            let names: Vec<&str> = sensor.sights.iter().map(|(name, _)| name.as_str()).collect();
            return Err(MeasuringError::NothingCalled { given: of.to_owned(), known: names.join(", ") });
        };
        let unseen = |why: &str| MeasuringError::NotInTheProfile { of: of.to_owned(), why: why.to_owned() };
        let seen = sight.profile(&(flange * sensor.flange_from_sensor), half_width).map_err(unseen)?;
        if seen.iter().any(|[x, _]| x.abs() > half_width) {
            return Err(unseen("it lies beside the sensor's line"));
        }
        if seen.iter().any(|[_, z]| !(near..=far).contains(z)) {
            return Err(unseen("it is nearer or farther than the sensor sees"));
        }
        self.readings_taken += 1;
        let (seed, first) =
            (self.description.seed ^ 0x11_4e5e, self.readings_taken.wrapping_mul(2 * POINTS as u64 + 2));
        let mut drawn = 0;
        let mut noise = || {
            drawn += 1;
            error * normal(seed, first.wrapping_add(drawn))
        };
        Ok(seen.iter().map(|[x, z]| [x + noise(), z + noise()]).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::rigid::{Rotation, Vector};

    /// A sensor 200 mm over the table that looks down, its line along the world's y.
    fn over_the_table() -> Rigid {
        let rotation =
            Rotation::from_roll_pitch_yaw([std::f64::consts::PI, 0.0, std::f64::consts::FRAC_PI_2]);
        Rigid { rotation, translation: Vector::new(400.0, 10.0, 200.0) }
    }

    #[test]
    fn every_point_of_a_profile_lies_on_what_was_seen() {
        let world_from_sensor = over_the_table();
        let world = |[x, z]: [f64; 2]| world_from_sensor.apply(Vector::new(x, 0.0, z));
        let normal = Vector::new(0.1, -0.05, 1.0).unit().unwrap();
        let plane = Sight::Plane { point: Vector::new(390.0, 0.0, 5.0), normal };
        for point in plane.profile(&world_from_sensor, 30.0).unwrap() {
            assert!(normal.dot(world(point) - Vector::new(390.0, 0.0, 5.0)).abs() < 1e-9, "{point:?}");
        }
        let centre = Vector::new(405.0, 12.0, 20.0);
        let ball = Sight::Ball { centre, radius: 20.0 };
        let points = ball.profile(&world_from_sensor, 30.0).unwrap();
        assert_eq!(points.len(), POINTS);
        for point in points {
            assert!(
                ((world(point) - centre).norm() - 20.0).abs() < 1e-9 && world(point).z > centre.z,
                "{point:?}"
            );
        }
        let edge = Sight::Edge { point: Vector::new(0.0, 15.0, 30.0), direction: Vector::X };
        let points = edge.profile(&world_from_sensor, 30.0).unwrap();
        let at = world(points[0]);
        assert!((at - Vector::new(400.0, 15.0, 30.0)).norm() < 1e-9 && points.len() == 1, "{at:?}");
        let aside = Sight::Ball { centre: Vector::new(425.0, 12.0, 20.0), radius: 20.0 };
        assert_eq!(aside.profile(&world_from_sensor, 30.0), Err("the laser passes beside the ball"));
        let along = Sight::Edge { point: Vector::ZERO, direction: Vector::Y };
        assert_eq!(along.profile(&world_from_sensor, 30.0), Err("the laser runs along the edge"));
    }
}
