//! Where every joint's axis and every link's end are for given coordinates, and how the tip moves with each error.

use nalgebra::{IsometryMatrix3, Matrix3, Rotation3, Translation3, Vector3};

use crate::chain::{Chain, Convention, Joint, Motion};

/// What one joint's row differs by from the nominal: mm and rad, added to the row's own numbers.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Deviation {
    /// About the joint's axis, rad.
    pub theta: f64,
    /// Along the joint's axis, mm.
    pub d: f64,
    /// Along the common normal x, mm.
    pub a: f64,
    /// About x, rad.
    pub alpha: f64,
    /// About y, before the joint turns (Hayati's skew: what makes nominally parallel axes not so), rad.
    pub beta: f64,
}

/// One of the five numbers of a row that an error may move.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum DhParameter {
    /// Turn about the joint's axis.
    Theta,
    /// Shift along the joint's axis.
    D,
    /// Shift along the common normal.
    A,
    /// Turn about the common normal.
    Alpha,
    /// Turn about y.
    Beta,
}

impl Deviation {
    /// Adds `amount` (mm or rad) to one of the five numbers.
    pub fn add(&mut self, dh_parameter: DhParameter, amount: f64) {
        match dh_parameter {
            DhParameter::Theta => self.theta += amount,
            DhParameter::D => self.d += amount,
            DhParameter::A => self.a += amount,
            DhParameter::Alpha => self.alpha += amount,
            DhParameter::Beta => self.beta += amount,
        }
    }
}

/// How a point and a frame that travel with the tip move per unit of one error: mm and rad per unit, base frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Twist {
    /// Of the point, mm per rad or mm per mm.
    pub linear: Vector3<f64>,
    /// Of the frame, rad per rad (zero for shifts).
    pub angular: Vector3<f64>,
}

/// The axes of one joint's row, in the base frame.
#[derive(Debug, Clone, Copy)]
pub struct JointFrame {
    /// The joint's axis z.
    pub axis: Vector3<f64>,
    /// A point on the axis.
    pub axis_point: Vector3<f64>,
    /// The common normal x of the row.
    pub normal: Vector3<f64>,
    /// A point on the line about which `alpha` turns.
    pub normal_point: Vector3<f64>,
    /// The axis y about which `beta` leans the joint's own axis, just before the joint turns.
    pub skew: Vector3<f64>,
    /// A point on that axis.
    pub skew_point: Vector3<f64>,
    /// The frame after the whole row: masses of this link are given in it.
    pub end: IsometryMatrix3<f64>,
}

/// All frames of a chain at one pose. Reused from row to row to save allocation.
#[derive(Debug, Clone)]
pub struct LinkFrames {
    /// One per joint.
    pub joints: Vec<JointFrame>,
    /// The flange: the end of the last row, in the base frame.
    pub flange: IsometryMatrix3<f64>,
    /// Joints that turn back as another goes on, because their drives keep attitudes.
    kept: Vec<Kept>,
    /// What each row was turned by last.
    rotations: Vec<RowRotations>,
}

/// A joint that turns as another's drive does, times `fraction`.
#[derive(Debug, Clone, Copy)]
struct Kept {
    joint: usize,
    drive: usize,
    fraction: f64,
}

impl Default for LinkFrames {
    fn default() -> Self {
        Self {
            joints: Vec::new(),
            flange: IsometryMatrix3::identity(),
            kept: Vec::new(),
            rotations: Vec::new(),
        }
    }
}

/// A frame under construction: its axes as columns, and its origin.
#[derive(Clone, Copy)]
struct Walker {
    x: Vector3<f64>,
    y: Vector3<f64>,
    z: Vector3<f64>,
    origin: Vector3<f64>,
}

/// An angle (rad) with its sine and cosine.
#[derive(Debug, Clone, Copy)]
struct PlaneRotation {
    angle: f64,
    sine: f64,
    cosine: f64,
}

impl Default for PlaneRotation {
    fn default() -> Self {
        Self { angle: 0.0, sine: 0.0, cosine: 1.0 }
    }
}

impl PlaneRotation {
    /// This rotation if it is by that angle, else made anew: sine and cosine take longer than all else of a frame.
    fn by(&mut self, angle: f64) -> Self {
        // Written so that what is not a number is made anew.
        let is_known = angle == self.angle;
        if !is_known {
            let (sine, cosine) = angle.sin_cos();
            *self = Self { angle, sine, cosine };
        }
        *self
    }
}

/// The rotations of one joint's row. From pose to pose only that about the joint's axis changes, and not even that where the same pose is asked for other deviations.
#[derive(Debug, Clone, Copy, Default)]
struct RowRotations {
    theta: PlaneRotation,
    alpha: PlaneRotation,
    beta: PlaneRotation,
}

/// Rotates two axes of a frame about the third, from the first towards the second.
fn rotate(first: &mut Vector3<f64>, second: &mut Vector3<f64>, by: PlaneRotation) {
    let PlaneRotation { angle, sine, cosine } = by;
    if angle == 0.0 {
        return;
    }
    let turned = *first * cosine + *second * sine;
    *second = *second * cosine - *first * sine;
    *first = turned;
}

impl Walker {
    fn start() -> Self {
        Self { x: Vector3::x(), y: Vector3::y(), z: Vector3::z(), origin: Vector3::zeros() }
    }

    /// At a frame that is known.
    fn at(pose: &IsometryMatrix3<f64>) -> Self {
        let [x, y, z] = [0, 1, 2].map(|axis| pose.rotation.matrix().column(axis).into_owned());
        Self { x, y, z, origin: pose.translation.vector }
    }

    fn rotate_z(&mut self, by: PlaneRotation) {
        rotate(&mut self.x, &mut self.y, by);
    }

    fn rotate_x(&mut self, by: PlaneRotation) {
        rotate(&mut self.y, &mut self.z, by);
    }

    fn rotate_y(&mut self, by: PlaneRotation) {
        rotate(&mut self.z, &mut self.x, by);
    }

    fn follow(&mut self, pose: &IsometryMatrix3<f64>) {
        let axes = Matrix3::from_columns(&[self.x, self.y, self.z]);
        self.origin += axes * pose.translation.vector;
        let turned = axes * pose.rotation.matrix();
        self.x = turned.column(0).into_owned();
        self.y = turned.column(1).into_owned();
        self.z = turned.column(2).into_owned();
    }

    fn pose(&self) -> IsometryMatrix3<f64> {
        let axes = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[self.x, self.y, self.z]));
        IsometryMatrix3::from_parts(Translation3::from(self.origin), axes)
    }
}

fn place(
    walker: &mut Walker,
    convention: Convention,
    joint: &Joint,
    coordinate: f64,
    deviation: &Deviation,
    rotations: &mut RowRotations,
) -> JointFrame {
    if let Some(before) = &joint.before {
        walker.follow(before);
    }
    let driven = joint.sign * coordinate;
    let (turned, slid) = match joint.motion {
        Motion::Turns => (driven, 0.0),
        Motion::Slides => (0.0, driven),
    };
    let theta = rotations.theta.by(joint.theta + turned + deviation.theta);
    let d = joint.d + slid + deviation.d;
    let a = joint.a + deviation.a;
    let alpha = rotations.alpha.by(joint.alpha + deviation.alpha);
    let beta = rotations.beta.by(deviation.beta);
    let (axis, axis_point, normal, normal_point, skew, skew_point) = match convention {
        Convention::Distal => {
            let skew = walker.y;
            walker.rotate_y(beta);
            let (axis, axis_point) = (walker.z, walker.origin);
            walker.rotate_z(theta);
            walker.origin += walker.z * d + walker.x * a;
            let (normal, normal_point) = (walker.x, walker.origin);
            walker.rotate_x(alpha);
            (axis, axis_point, normal, normal_point, skew, axis_point)
        }
        Convention::Proximal => {
            let normal = walker.x;
            walker.rotate_x(alpha);
            walker.origin += walker.x * a;
            let (normal_point, skew) = (walker.origin, walker.y);
            walker.rotate_y(beta);
            let (axis, axis_point) = (walker.z, walker.origin);
            walker.rotate_z(theta);
            walker.origin += walker.z * d;
            (axis, axis_point, normal, normal_point, skew, normal_point)
        }
    };
    JointFrame { axis, axis_point, normal, normal_point, skew, skew_point, end: walker.pose() }
}

impl LinkFrames {
    /// Computes every frame of `chain` for coordinates `q` (rad or mm, one per joint) and the rows' deviations.
    /// Missing coordinates or deviations count as zero.
    pub fn update(&mut self, chain: &Chain, q: &[f64], deviations: &[Deviation]) {
        self.update_from(0, chain, q, deviations);
    }

    /// The same where nothing has changed of the joints before `first` since the last update with this chain: their frames are left as they are.
    pub fn update_from(&mut self, first: usize, chain: &Chain, q: &[f64], deviations: &[Deviation]) {
        self.joints.truncate(first);
        let first = self.joints.len();
        self.kept.retain(|kept| kept.joint < first);
        self.rotations.resize(chain.joints.len(), RowRotations::default());
        let mut walker = self.joints.last().map_or_else(Walker::start, |before| Walker::at(&before.end));
        for ((index, joint), rotations) in
            chain.joints.iter().enumerate().zip(&mut self.rotations).skip(first)
        {
            let coordinate = |of: usize| q.get(of).copied().unwrap_or(0.0);
            let mut deviation = deviations.get(index).copied().unwrap_or_default();
            let mut driven = coordinate(index);
            if let Some(drive) = joint.less {
                let fraction = -joint.sign * chain.joints.get(drive).map_or(1.0, |drive| drive.sign);
                driven -= coordinate(drive);
                deviation.theta += fraction * deviations.get(drive).map_or(0.0, |of_drive| of_drive.theta);
                self.kept.push(Kept { joint: index, drive, fraction });
            }
            self.joints.push(place(&mut walker, chain.convention, joint, driven, &deviation, rotations));
        }
        self.flange = walker.pose();
    }

    /// From something about each joint's axis to the same about its drive: what a drive turns, and what turns back to keep its attitude.
    pub(crate) fn about_drives(&self, about_axes: &mut [f64]) {
        for kept in &self.kept {
            let about = about_axes.get(kept.joint).copied().unwrap_or(0.0);
            if let Some(drive) = about_axes.get_mut(kept.drive) {
                *drive += kept.fraction * about;
            }
        }
    }

    /// The configuration of `chain` at `q`.
    pub fn of(chain: &Chain, q: &[f64], deviations: &[Deviation]) -> Self {
        let mut link_frames = Self::default();
        link_frames.update(chain, q, deviations);
        link_frames
    }

    /// How `point` (base frame, mm, carried by the flange) moves per unit of one number of one row; zero for a joint
    /// the chain does not have.
    pub fn twist(&self, joint: usize, dh_parameter: DhParameter, point: &Vector3<f64>) -> Twist {
        let Some(frame) = self.joints.get(joint) else {
            return Twist { linear: Vector3::zeros(), angular: Vector3::zeros() };
        };
        let turn = |axis: Vector3<f64>, through: Vector3<f64>| Twist {
            linear: axis.cross(&(point - through)),
            angular: axis,
        };
        let shift = |direction: Vector3<f64>| Twist { linear: direction, angular: Vector3::zeros() };
        match dh_parameter {
            DhParameter::Theta => {
                let mut twist = turn(frame.axis, frame.axis_point);
                for kept in self.kept.iter().filter(|kept| kept.drive == joint) {
                    if let Some(other) = self.joints.get(kept.joint) {
                        let back = turn(other.axis, other.axis_point);
                        twist.linear += back.linear * kept.fraction;
                        twist.angular += back.angular * kept.fraction;
                    }
                }
                twist
            }
            DhParameter::D => shift(frame.axis),
            DhParameter::A => shift(frame.normal),
            DhParameter::Alpha => turn(frame.normal, frame.normal_point),
            DhParameter::Beta => turn(frame.skew, frame.skew_point),
        }
    }
}
