//! A measuring probe at the tip of the tool: a ball on a stem that gives way and shows by how much it is off what it feels, mm.

use super::ArmWorld;
use super::description::Sight;
use super::measuring::MeasuringError;
use crate::physics::rigid::Vector;

/// How far a point lies outside a thing, mm; nothing of an edge, which a ball does not feel as one.
fn outside(sight: &Sight, point: Vector) -> Option<f64> {
    match *sight {
        Sight::Plane { point: on_it, normal } => Some(normal.dot(point - on_it)),
        Sight::Ball { centre, radius } => Some((point - centre).norm() - radius),
        Sight::Edge { .. } => None,
    }
}

impl ArmWorld {
    /// By how much the probe's ball is off a thing, mm: zero where it just touches, negative where it gives way.
    ///
    /// # Errors
    /// [`MeasuringError`]
    pub fn read_probe(&mut self, of: &str) -> Result<f64, MeasuringError> {
        let tip = self.arm_state()?.link_frames.world_from_flange.apply(self.description.tool.tip);
        let probe = self.description.touch_probe.as_ref().ok_or(MeasuringError::NoProbe)?;
        let felt = probe.sights.iter().find(|(name, _)| name == of);
        let off = felt.and_then(|(_, sight)| outside(sight, tip)).map(|away| away - probe.ball_radius);
        let Some(off) = off else {
            let names: Vec<&str> = probe.sights.iter().map(|(name, _)| name.as_str()).collect();
            return Err(MeasuringError::NothingToFeel { given: of.to_owned(), known: names.join(", ") });
        };
        if off.abs() > probe.reach {
            return Err(MeasuringError::NotFelt { of: of.to_owned(), off, reach: probe.reach });
        }
        let instrument = probe.instrument;
        Ok(self.take(instrument, off))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_is_outside_a_plane_by_its_height_and_a_ball_by_its_distance() {
        let plane = Sight::Plane { point: Vector::new(1.0, 2.0, 3.0), normal: Vector::X };
        assert_eq!(outside(&plane, Vector::new(5.0, 9.0, 9.0)), Some(4.0));
        let ball = Sight::Ball { centre: Vector::new(0.0, 3.0, 0.0), radius: 2.0 };
        assert_eq!(outside(&ball, Vector::new(4.0, 0.0, 0.0)), Some(3.0));
        assert_eq!(outside(&Sight::Edge { point: Vector::ZERO, direction: Vector::X }, Vector::Y), None);
    }
}
