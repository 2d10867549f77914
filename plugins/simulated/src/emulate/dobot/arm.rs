//! The arm on the controller's motors: that of a world, or one of air.
//!
//! The controller's angles are those of its motors: rear arm and forearm each against base, for a parallelogram holds the forearm and another one the hand level.
//! A world's arm has its joints one after the other: base, rear arm, elbow, wrist, hand. Where a motor's angle sensor is off, the arm is elsewhere than it says.

use std::path::Path;

use crate::emulate::world_motion::{MotionError, WorldMotion};

/// Motors.
pub(super) const AXES: usize = 4;
/// Joints of the arm in a world.
const WORLD_JOINTS: usize = 5;

/// The arm cannot be moved any more.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the arm behind the Dobot's controller: {0}")]
pub struct ArmError(String);

impl From<MotionError> for ArmError {
    fn from(error: MotionError) -> Self {
        Self(error.to_string())
    }
}

/// Angles of the motors, deg.
pub(super) type Angles = [f64; AXES];

/// An arm of air: it goes evenly.
#[derive(Debug, Clone, Copy)]
struct Bare {
    from: Angles,
    to: Angles,
    began_ns: u64,
    lasts_ns: u64,
}

impl Bare {
    fn fraction(&self, now_ns: u64) -> f64 {
        let gone = now_ns.saturating_sub(self.began_ns);
        if gone >= self.lasts_ns { 1.0 } else { gone as f64 / self.lasts_ns as f64 }
    }

    fn at(&self, now_ns: u64) -> Angles {
        let fraction = self.fraction(now_ns);
        std::array::from_fn(|axis| self.from[axis] + (self.to[axis] - self.from[axis]) * fraction)
    }
}

enum Body {
    World(Box<WorldMotion>),
    Bare(Bare),
}

/// The arm.
pub(super) struct Arm {
    body: Body,
    /// By how much each motor's angle says more than is so, deg.
    sensors_off: Angles,
    /// Whether an arm of air moves in no time.
    at_once: bool,
}

/// Where homing leaves the arm, deg (protocol, 1.6).
pub(super) const HOME: Angles = [0.0, 45.0, 45.0, 0.0];

impl Arm {
    pub(super) fn connect(
        socket: Option<&Path>,
        sensors_off: Angles,
        at_once: bool,
    ) -> Result<Self, ArmError> {
        let body = match socket {
            None => Body::Bare(Bare { from: HOME, to: HOME, began_ns: 0, lasts_ns: 0 }),
            Some(socket) => {
                let motion = WorldMotion::connect(socket, "Dobot", "a Dobot's joints")?;
                let count = motion.joints().len();
                if count != WORLD_JOINTS {
                    return Err(ArmError(format!(
                        "that world's arm has {count} joints; a Magician's has {WORLD_JOINTS}: base, rear arm, elbow, wrist and hand"
                    )));
                }
                Body::World(Box::new(motion))
            }
        };
        Ok(Self { body, sensors_off, at_once })
    }

    /// What the motors' sensors say, deg, and whether the arm moves.
    pub(super) fn read(&mut self, now_ns: u64) -> Result<(Angles, bool), ArmError> {
        match &mut self.body {
            Body::Bare(bare) => Ok((bare.at(now_ns), bare.fraction(now_ns) < 1.0)),
            Body::World(motion) => {
                let (joints, moves) = motion.read()?;
                let [base, rear_arm, elbow, _, hand] = joints[..] else {
                    return Err(ArmError("its joints do not all answer".to_owned()));
                };
                let true_angles = [base, rear_arm, elbow + rear_arm, hand].map(f64::to_degrees);
                Ok((std::array::from_fn(|axis| true_angles[axis] + self.sensors_off[axis]), moves))
            }
        }
    }

    /// Has the arm go where its sensors then say `to` (deg), in so many seconds.
    pub(super) fn go(&mut self, to: Angles, lasts_s: f64, now_ns: u64) -> Result<(), ArmError> {
        let (from, _) = self.read(now_ns)?;
        let lasts_ns = if self.at_once { 0 } else { (lasts_s * 1e9) as u64 };
        match &mut self.body {
            Body::Bare(bare) => *bare = Bare { from, to, began_ns: now_ns, lasts_ns },
            Body::World(motion) => {
                let so = |axis: usize| (to[axis] - self.sensors_off[axis]).to_radians();
                // The wrist turns back by what the forearm has gone down.
                let joints = [so(0), so(1), so(2) - so(1), so(2), so(3)].map(Some);
                motion.begin(joints.to_vec(), lasts_s)?;
            }
        }
        Ok(())
    }

    /// Ends the motion under way.
    pub(super) fn brake(&mut self, now_ns: u64) -> Result<(), ArmError> {
        match &mut self.body {
            Body::Bare(bare) => {
                let here = bare.at(now_ns);
                *bare = Bare { from: here, to: here, began_ns: now_ns, lasts_ns: 0 };
                Ok(())
            }
            Body::World(motion) => Ok(motion.brake()?),
        }
    }
}
