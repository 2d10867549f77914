//! The PUMA 560 and its like: two axes crossing at the shoulder, an elbow, and a wrist whose three axes meet in a point (Paul, Shimano & Mayer 1981; Lee &
//! Ziegler 1984), in the distal rows of Agin 1985.

use nalgebra::{IsometryMatrix3, Matrix3, Rotation3, Vector3};

use super::{NoSolution, wrapped};

/// Its lengths, mm: rows (0, -90, 0), (upper arm, 0, shoulder offset), (elbow offset, 90, 0), (0, -90, forearm), (0, 90, 0), (0, 0, flange).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PumaGeometry {
    /// Shoulder's axis to elbow's axis: a of the second row, 431.8.
    pub upper_arm: f64,
    /// From the waist's axis sideways to the plane of the arm: d of the second row, 149.09.
    pub shoulder_offset: f64,
    /// a of the third row, -20.32.
    pub elbow_offset: f64,
    /// Elbow to wrist: d of the fourth row, 433.07.
    pub forearm: f64,
    /// Wrist to flange: d of the sixth row, 56.25.
    pub flange: f64,
}

/// On which side of the waist's axis the shoulder is, seen from behind the arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shoulder {
    /// As a person's left arm.
    Lefty,
    /// As a person's right arm.
    Righty,
}

/// Whether the elbow is above or below the line from shoulder to wrist.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Elbow {
    /// Above.
    Above,
    /// Below.
    Below,
}

/// The sign of the wrist's bend.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wrist {
    /// Joint 5 is not negative.
    NoFlip,
    /// Joint 5 is negative.
    Flip,
}

/// Which of the eight ways of reaching a pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PumaConfiguration {
    /// Left or right.
    pub shoulder: Shoulder,
    /// Above or below.
    pub elbow: Elbow,
    /// Flipped or not.
    pub wrist: Wrist,
}

impl PumaConfiguration {
    /// All eight.
    pub fn all() -> impl Iterator<Item = Self> {
        [Shoulder::Lefty, Shoulder::Righty].into_iter().flat_map(|shoulder| {
            [Elbow::Above, Elbow::Below].into_iter().flat_map(move |elbow| {
                [Wrist::NoFlip, Wrist::Flip].into_iter().map(move |wrist| Self { shoulder, elbow, wrist })
            })
        })
    }
}

/// Bends of the wrist below this leave only the sum of its two turns determined.
const STRAIGHT: f64 = 1e-9;

impl PumaGeometry {
    /// The arm of Agin 1985 (VAL's angles).
    pub const PUMA_560: Self = Self {
        upper_arm: 431.8,
        shoulder_offset: 149.09,
        elbow_offset: -20.32,
        forearm: 433.07,
        flange: 56.25,
    };

    /// Joints (rad) that bring the flange there in this configuration, each between -pi and pi. Where the wrist is straight, its first turn stays at
    /// `roll_now` and its last makes up the rest. Limits are the caller's.
    ///
    /// # Errors
    /// [`NoSolution`]
    pub fn inverse(
        &self,
        flange: &IsometryMatrix3<f64>,
        configuration: PumaConfiguration,
        roll_now: f64,
    ) -> Result<[f64; 6], NoSolution> {
        let wrist = flange.translation.vector - flange.rotation * Vector3::z() * self.flange;
        let outward = wrist.x.hypot(wrist.y);
        let in_plane = outward * outward - self.shoulder_offset * self.shoulder_offset;
        if in_plane < 0.0 {
            return Err(NoSolution::OnFirstAxis { radius_mm: outward });
        }
        // The left arm is left of the plane it reaches in: its wrist is ahead. The right one's is behind, the waist turned half round.
        let ahead = match configuration.shoulder {
            Shoulder::Lefty => in_plane.sqrt(),
            Shoulder::Righty => -in_plane.sqrt(),
        };
        let waist = wrist.y.atan2(wrist.x) - self.shoulder_offset.atan2(ahead);
        let (shoulder, elbow) = self.shoulder_and_elbow(ahead, -wrist.z, configuration)?;
        let forearm = Rotation3::from_matrix_unchecked(
            rotate_z(waist) * quarter_x(-1.0) * rotate_z(shoulder + elbow) * quarter_x(1.0),
        );
        let hand = (forearm.inverse() * flange.rotation).into_inner();
        let [roll, bend, last] = wrist_angles(&hand, configuration.wrist, roll_now);
        Ok([waist, shoulder, elbow, roll, bend, last].map(wrapped))
    }

    /// In the arm's plane: x ahead, y down.
    fn shoulder_and_elbow(
        &self,
        ahead: f64,
        down: f64,
        configuration: PumaConfiguration,
    ) -> Result<(f64, f64), NoSolution> {
        let lower = self.elbow_offset.hypot(self.forearm);
        let across = ahead.hypot(down);
        let away = (across - self.upper_arm - lower).max((self.upper_arm - lower).abs() - across);
        if away > 1e-9 {
            return Err(NoSolution::OutOfReach { away_mm: away });
        }
        let cosine = (across * across - self.upper_arm * self.upper_arm - lower * lower)
            / (2.0 * self.upper_arm * lower);
        let bent = cosine.clamp(-1.0, 1.0).acos();
        // y points down: an elbow above turns the lower arm down from the upper arm's line when it reaches ahead, and up when it reaches behind.
        let ahead_of = if configuration.shoulder == Shoulder::Lefty { 1.0 } else { -1.0 };
        let sense = if configuration.elbow == Elbow::Above { ahead_of } else { -ahead_of };
        let elbow = self.forearm.atan2(self.elbow_offset) + sense * bent;
        let (sine, cosine) = elbow.sin_cos();
        let along = self.upper_arm + self.elbow_offset * cosine + self.forearm * sine;
        let aside = self.elbow_offset * sine - self.forearm * cosine;
        Ok((down.atan2(ahead) - aside.atan2(along), elbow))
    }

    /// In which configuration joints (rad) are.
    pub fn configuration(&self, joints: &[f64; 6]) -> PumaConfiguration {
        let [_, shoulder, elbow, _, bend, _] = *joints;
        let lower = shoulder + elbow;
        let ahead =
            self.upper_arm * shoulder.cos() + self.elbow_offset * lower.cos() + self.forearm * lower.sin();
        let lefty = ahead >= 0.0;
        let bent = wrapped(elbow - self.forearm.atan2(self.elbow_offset));
        let above = (bent >= 0.0) == lefty;
        PumaConfiguration {
            shoulder: if lefty { Shoulder::Lefty } else { Shoulder::Righty },
            elbow: if above { Elbow::Above } else { Elbow::Below },
            wrist: if wrapped(bend) < 0.0 { Wrist::Flip } else { Wrist::NoFlip },
        }
    }
}

/// The three turns of the wrist for the hand's attitude against the forearm.
fn wrist_angles(hand: &Matrix3<f64>, wrist: Wrist, roll_now: f64) -> [f64; 3] {
    let aside = hand.m13.hypot(hand.m23);
    let sense = if wrist == Wrist::NoFlip { 1.0 } else { -1.0 };
    let bend = (sense * aside).atan2(hand.m33);
    let roll = if aside > STRAIGHT { (sense * hand.m23).atan2(sense * hand.m13) } else { roll_now };
    let before = rotate_z(roll) * quarter_x(-1.0) * rotate_z(bend) * quarter_x(1.0);
    let rest = before.transpose() * hand;
    [roll, bend, rest.m21.atan2(rest.m11)]
}

fn rotate_z(angle: f64) -> Matrix3<f64> {
    Rotation3::from_axis_angle(&Vector3::z_axis(), angle).into_inner()
}

/// A right angle about x, exactly.
fn quarter_x(sense: f64) -> Matrix3<f64> {
    Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, -sense, 0.0, sense, 0.0)
}
