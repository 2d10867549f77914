//! Planes no part of a robot may pass, and whether a way keeps clear of them. Checked in the cell before a move, and in the robot's host again.

use nalgebra::{IsometryMatrix3, Matrix3, Rotation3, Translation3, Vector3};
use plumb_host::MoveGuard;
use plumb_kinematics::{Chain, Convention, Joint, LinkFrames, Motion};
use plumb_plugin::{JointVector, RobotDescription, Value};
use serde::{Deserialize, Serialize};

use super::RobotSetting;
use crate::named_value::PlaneClearance;

/// The points p with normal . p < offset are out of bounds. In the robot's base frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct KeepOutPlane {
    /// What people call it.
    pub name: String,
    /// The robot it is for.
    pub robot: String,
    /// Unit length; points to the side that is free.
    pub normal: [f64; 3],
    /// mm along the normal.
    pub offset_mm: f64,
}

impl KeepOutPlane {
    /// How far a point (mm) is on the free side, mm; negative when it is out of bounds.
    pub fn clearance(&self, point: [f64; 3]) -> f64 {
        let along: f64 = self.normal.iter().zip(point).map(|(n, p)| n * p).sum();
        along - self.offset_mm
    }
}

/// A part of a robot would come past a plane.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Trespass {
    /// The end of a link would come beyond a plane.
    #[error(
        "on the way the end of link {link} would come {depth_mm:.1} mm past {plane}; raise the arm, or take another way"
    )]
    Beyond {
        /// The link whose end it is.
        link: String,
        /// The plane.
        plane: String,
        /// How far, mm.
        depth_mm: f64,
    },
    /// A joint's position is not known, so that nobody can say where a link is.
    #[error(
        "where the end of link {link} is on the way is not known, so that it may pass {plane}; a joint before it has no known position: find its zero first"
    )]
    Unknown {
        /// The link whose end it is.
        link: String,
        /// The plane.
        plane: String,
    },
}

/// One joint of the model, as far as its position goes: a mm, alpha rad, d mm, theta rad, sign.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Row {
    name: String,
    numbers: [f64; 5],
    /// The joint whose coordinate this one's is counted with.
    #[serde(default)]
    less: Option<usize>,
    /// Its coordinate is a length, mm.
    #[serde(default)]
    slides: bool,
    /// A constant pose before the row: the rotation's matrix by columns, then the translation, mm.
    #[serde(default)]
    before: Option<[f64; 12]>,
}

/// Whether a way of one robot keeps clear of its planes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct KeepOut {
    distal: bool,
    rows: Vec<Row>,
    /// The model's joints from the drive's: coefficients in the order of `joints`, then the constant.
    from_drive: Vec<Vec<f64>>,
    /// The drive's joints the model's are made of.
    joints: Vec<String>,
    planes: Vec<KeepOutPlane>,
    /// What is added to the drive's numbers to get attitudes, in the order of `joints`; rad.
    zeros: Vec<f64>,
}

impl KeepOut {
    /// The check of a robot; none without planes or model.
    pub(crate) fn for_robot(setting: &RobotSetting, planes: &[KeepOutPlane]) -> Option<Self> {
        let planes: Vec<KeepOutPlane> =
            planes.iter().filter(|plane| plane.robot == setting.device).cloned().collect();
        let model = setting.model.as_ref().filter(|_| !planes.is_empty())?;
        let chain = model.chain();
        let row = |joint: &Joint| Row {
            name: joint.name.clone(),
            numbers: [joint.a, joint.alpha, joint.d, joint.theta, joint.sign],
            less: joint.less,
            slides: joint.motion == Motion::Slides,
            before: joint.before.as_ref().map(numbers_of),
        };
        Some(Self {
            distal: chain.convention == Convention::Distal,
            rows: chain.joints.iter().map(row).collect(),
            from_drive: model.from_drive.clone(),
            joints: setting.joints.iter().map(|(joint, _)| joint.clone()).collect(),
            planes,
            zeros: vec![0.0; setting.joints.len()],
        })
    }

    /// The same with these zeros, given for each joint by name; rad.
    pub(crate) fn with_zeros(mut self, zero_of: impl Fn(&str) -> f64) -> Self {
        self.zeros = self.joints.iter().map(|joint| zero_of(joint)).collect();
        self
    }

    /// For the host: null-free JSON that [`guard`] reads.
    pub(crate) fn to_value(&self) -> Value {
        serde_json::to_value(self).unwrap_or(Value::Null)
    }

    fn chain(&self) -> Result<Chain, String> {
        let joint = |row: &Row| {
            let [a, alpha, d, theta, sign] = row.numbers;
            Joint {
                sign,
                less: row.less,
                motion: if row.slides { Motion::Slides } else { Motion::Turns },
                before: row.before.as_ref().map(pose_of),
                ..Joint::turning(&row.name, a, alpha, d, theta)
            }
        };
        let convention = if self.distal { Convention::Distal } else { Convention::Proximal };
        Chain::new(convention, self.rows.iter().map(joint).collect()).map_err(|error| error.to_string())
    }

    /// Binds the check to a robot's joints.
    ///
    /// # Errors
    /// A sentence, when the robot lacks a joint or the model is no chain.
    pub(crate) fn bind(&self, description: &RobotDescription) -> Result<BoundKeepOut, String> {
        let column = |joint: &String| {
            let found = description.joints.iter().position(|known| known.name == *joint);
            found.ok_or_else(|| format!("the robot has no joint `{joint}`"))
        };
        let columns: Result<Vec<usize>, String> = self.joints.iter().map(column).collect();
        Ok(BoundKeepOut { check: self.clone(), chain: self.chain()?, columns: columns? })
    }
}

/// A pose as numbers that go into a file.
fn numbers_of(pose: &IsometryMatrix3<f64>) -> [f64; 12] {
    let mut numbers = [0.0; 12];
    let parts = pose.rotation.matrix().iter().chain(pose.translation.vector.iter());
    numbers.iter_mut().zip(parts).for_each(|(number, part)| *number = *part);
    numbers
}

fn pose_of(numbers: &[f64; 12]) -> IsometryMatrix3<f64> {
    let (rotation, translation) = numbers.split_at(9);
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_column_slice(rotation));
    IsometryMatrix3::from_parts(Translation3::from(Vector3::from_column_slice(translation)), rotation)
}

/// The check of moves of one robot, its joints in the drive's order.
#[derive(Debug, Clone)]
pub(crate) struct BoundKeepOut {
    check: KeepOut,
    chain: Chain,
    columns: Vec<usize>,
}

/// The way between two looks, rad or mm of the joint that moves furthest.
const LOOK_EVERY: f64 = 0.03;

impl BoundKeepOut {
    pub(crate) fn set_zeros(&mut self, zero_of: impl Fn(&str) -> f64) {
        self.check.zeros = self.check.joints.iter().map(|joint| zero_of(joint)).collect();
    }

    /// Looks along the straight way in joint space. A robot that is beyond a plane may leave it.
    pub(crate) fn check(&self, from: &JointVector, to: &JointVector) -> Result<(), Trespass> {
        let furthest =
            from.as_slice().iter().zip(to.as_slice()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let pieces = (furthest / LOOK_EVERY).ceil().clamp(1.0, 400.0) as usize;
        let start = self.link_ends(from, to, 0.0);
        let mut deepest: Option<(f64, Trespass)> = None;
        for piece in 1..=pieces {
            let here = self.link_ends(from, to, piece as f64 / pieces as f64);
            for ((row, point), before) in self.check.rows.iter().zip(here).zip(&start) {
                for plane in &self.check.planes {
                    let clearance = plane.clearance(point);
                    let (link, name) = (row.name.clone(), plane.name.clone());
                    if clearance.is_nan() {
                        return Err(Trespass::Unknown { link, plane: name });
                    }
                    let depth_mm = -clearance;
                    let is_deepest = deepest.as_ref().is_none_or(|(known, _)| depth_mm > *known);
                    let is_free = clearance >= -1e-6 || clearance >= plane.clearance(*before) - 1e-6;
                    if !is_free && is_deepest {
                        deepest = Some((depth_mm, Trespass::Beyond { link, plane: name, depth_mm }));
                    }
                }
            }
        }
        deepest.map_or(Ok(()), |(_, trespass)| Err(trespass))
    }

    fn link_ends(&self, from: &JointVector, to: &JointVector, fraction: f64) -> Vec<[f64; 3]> {
        let at = |(column, zero): (&usize, &f64)| {
            let (a, b) = (from.get(*column).unwrap_or(f64::NAN), to.get(*column).unwrap_or(f64::NAN));
            a + fraction * (b - a) + zero
        };
        let attitudes: Vec<f64> = self.columns.iter().zip(&self.check.zeros).map(at).collect();
        self.ends_of(&attitudes)
    }

    /// The ends of the links, mm in the base frame, for the joints in the cell's order with their zeros.
    fn ends_of(&self, attitudes: &[f64]) -> Vec<[f64; 3]> {
        let joints: Vec<f64> =
            self.check.from_drive.iter().map(|row| super::model_file::model_joint(row, attitudes)).collect();
        let link_frames = LinkFrames::of(&self.chain, &joints, &[]);
        link_frames.joints.iter().map(|frame| frame.end.translation.vector.into()).collect()
    }

    /// How far the nearest end of a link is on the free side of each plane. `corrected` are the joints in the drive's order with their zeros: rad, or
    /// mm; NaN of a joint whose position is not known, and then the clearance is not known either.
    pub(crate) fn clearances(&self, corrected: &[f64]) -> Vec<PlaneClearance> {
        let attitudes: Vec<f64> =
            self.columns.iter().map(|column| corrected.get(*column).copied().unwrap_or(f64::NAN)).collect();
        let ends = self.ends_of(&attitudes);
        let clearance = |plane: &KeepOutPlane| PlaneClearance {
            plane: plane.name.clone(),
            clearance_mm: nearest(ends.iter().map(|end| plane.clearance(*end))),
        };
        self.check.planes.iter().map(clearance).collect()
    }
}

/// The least of several clearances, mm; none where one of them is no number, or where there is none.
fn nearest(clearances: impl Iterator<Item = f64>) -> Option<f64> {
    let least = clearances.reduce(|one, other| if one.is_nan() || one < other { one } else { other })?;
    least.is_finite().then_some(least)
}

impl MoveGuard for BoundKeepOut {
    fn check(&self, from: &JointVector, to: &JointVector) -> Result<(), String> {
        BoundKeepOut::check(self, from, to).map_err(|trespass| trespass.to_string())
    }
}

/// The check of moves a robot's host makes of what the cell gave it.
///
/// # Errors
/// A sentence that says what does not fit.
pub fn guard(value: &Value, robot: &RobotDescription) -> Result<Box<dyn MoveGuard>, String> {
    if value.is_null() {
        return Ok(Box::new(plumb_host::NoGuard));
    }
    let check: KeepOut = serde_json::from_value(value.clone())
        .map_err(|error| format!("the check of moves cannot be read: {error}"))?;
    Ok(Box::new(check.bind(robot)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use plumb_plugin::{JointDescription, JointUnit, RobotCapabilities};

    /// An arm of two links of 100 mm, turning in a vertical plane 150 mm over the table.
    fn check() -> KeepOut {
        let row = |name: &str, numbers| Row {
            name: name.to_owned(),
            numbers,
            less: None,
            slides: false,
            before: None,
        };
        KeepOut {
            distal: true,
            rows: vec![
                row("waist", [0.0, std::f64::consts::FRAC_PI_2, 150.0, 0.0, 1.0]),
                row("shoulder", [100.0, 0.0, 0.0, 0.0, 1.0]),
                row("elbow", [100.0, 0.0, 0.0, 0.0, 1.0]),
            ],
            from_drive: vec![vec![1.0, 0.0, 0.0, 0.0], vec![0.0, 1.0, 0.0, 0.0], vec![0.0, 0.0, 1.0, 0.0]],
            joints: ["waist", "shoulder", "elbow"].map(str::to_owned).to_vec(),
            planes: vec![KeepOutPlane {
                name: "the table".into(),
                robot: "arm".into(),
                normal: [0.0, 0.0, 1.0],
                offset_mm: 0.0,
            }],
            zeros: vec![0.0; 3],
        }
    }

    fn robot() -> RobotDescription {
        let joint = |name: &str| JointDescription {
            name: name.to_owned(),
            unit: JointUnit::Radian,
            lower: -3.0,
            upper: 3.0,
            resolution: 0.0,
            max_speed: 1.0,
            home: 0.0,
        };
        RobotDescription {
            model: "two links".into(),
            joints: ["waist", "shoulder", "elbow"].map(joint).to_vec(),
            inputs: Vec::new(),
            outputs: Vec::new(),
            capabilities: RobotCapabilities::default(),
        }
    }

    fn pose(shoulder_deg: f64, elbow_deg: f64) -> JointVector {
        JointVector::from_slice(&[0.0, shoulder_deg.to_radians(), elbow_deg.to_radians()]).unwrap()
    }

    #[test]
    fn a_joint_that_counts_the_other_way_is_watched_where_it_goes() {
        let mut against = check();
        let with = guard(&against.to_value(), &robot()).unwrap();
        against.rows[1].numbers[4] = -1.0;
        let against = guard(&against.to_value(), &robot()).unwrap();
        let (up, down) = (pose(60.0, 0.0), pose(-60.0, 0.0));
        assert!(with.check(&pose(0.0, 0.0), &up).is_ok() && with.check(&pose(0.0, 0.0), &down).is_err());
        assert!(
            against.check(&pose(0.0, 0.0), &up).is_err() && against.check(&pose(0.0, 0.0), &down).is_ok()
        );
    }

    #[test]
    fn a_way_through_the_table_is_refused_although_both_its_ends_are_above() {
        let guard = guard(&check().to_value(), &robot()).unwrap();
        assert_eq!(guard.check(&pose(0.0, 0.0), &pose(-30.0, 0.0)), Ok(()));
        let refused = guard.check(&pose(-45.0, 45.0), &pose(-45.0, -225.0)).unwrap_err();
        assert!(
            refused.contains("the end of link elbow would come") && refused.contains("past the table"),
            "{refused}"
        );
    }

    #[test]
    fn a_robot_beyond_a_plane_may_leave_it_but_go_no_deeper() {
        let bound = check().bind(&robot()).unwrap();
        let beyond = pose(-60.0, 0.0);
        assert!(bound.check(&beyond, &pose(-20.0, 0.0)).is_ok());
        assert!(bound.check(&beyond, &pose(-70.0, 0.0)).is_err());
    }

    #[test]
    fn the_zeros_in_force_decide_where_the_robot_is() {
        let lower = pose(-40.0, 0.0);
        assert!(check().bind(&robot()).unwrap().check(&pose(0.0, 0.0), &lower).is_ok());
        let shifted = check().with_zeros(|joint| if joint == "shoulder" { -0.2 } else { 0.0 });
        let trespass = shifted.bind(&robot()).unwrap().check(&pose(0.0, 0.0), &lower).unwrap_err();
        assert!(matches!(&trespass, Trespass::Beyond { link, .. } if link == "elbow"), "{trespass:?}");
    }

    #[test]
    fn a_slide_goes_by_millimetres_and_a_pose_before_a_row_is_kept() {
        let mut gantry = check();
        // The elbow's row slides straight down from the end of the upper arm, which lies 50 mm higher by a pose of its own.
        let down = Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
        let before = IsometryMatrix3::from_parts(Translation3::new(0.0, 50.0, 0.0), down);
        gantry.rows[2] = Row {
            slides: true,
            numbers: [0.0, 0.0, 0.0, 0.0, 1.0],
            before: Some(numbers_of(&before)),
            ..gantry.rows[2].clone()
        };
        let guard = guard(&gantry.to_value(), &robot()).unwrap();
        let at = |slide: f64| JointVector::from_slice(&[0.0, 0.0, slide]).unwrap();
        assert_eq!(guard.check(&at(0.0), &at(195.0)), Ok(()));
        let refused = guard.check(&at(0.0), &at(210.0)).unwrap_err();
        assert!(refused.contains("10.0 mm past the table"), "{refused}");
    }

    #[test]
    fn the_nearest_part_of_the_arm_says_how_far_it_is_clear_of_a_plane() {
        let bound = check().bind(&robot()).unwrap();
        let clearance = |pose: JointVector| bound.clearances(pose.as_slice())[0].clearance_mm.unwrap();
        assert!((clearance(pose(0.0, 0.0)) - 150.0).abs() < 1e-9);
        assert!((clearance(pose(0.0, -90.0)) - 50.0).abs() < 1e-9);
        assert!((clearance(pose(-90.0, 0.0)) + 50.0).abs() < 1e-9, "beyond it is negative");
    }

    #[test]
    fn a_clearance_is_unknown_while_the_position_of_a_joint_is() {
        let bound = check().bind(&robot()).unwrap();
        for unknown in 0..2 {
            let mut joints = [0.0; 3];
            joints[unknown] = f64::NAN;
            assert_eq!(bound.clearances(&joints)[0].clearance_mm, None, "joint {unknown}");
        }
        assert_eq!(bound.clearances(&[])[0].clearance_mm, None, "no joint is known");
    }

    #[test]
    fn a_move_of_which_nobody_knows_where_it_leads_is_refused_in_words() {
        let unknown = JointVector::from_slice(&[0.0, f64::NAN, 0.0]).unwrap();
        let refused = check().bind(&robot()).unwrap().check(&unknown, &pose(0.0, 0.0)).unwrap_err();
        assert!(matches!(&refused, Trespass::Unknown { link, .. } if link == "shoulder"), "{refused:?}");
        assert!(!refused.to_string().contains("NaN"), "{refused}");
    }

    #[test]
    fn a_check_that_cannot_be_read_is_reported() {
        let refused = guard(&serde_json::json!({"planes": 3}), &robot()).err().unwrap();
        assert!(refused.contains("cannot be read"), "{refused}");
    }

    #[test]
    fn the_nearest_of_several_ends_counts_and_one_that_is_not_known_makes_none_known() {
        assert_eq!(nearest([30.0, 10.0, 20.0].into_iter()), Some(10.0));
        assert_eq!(nearest([-5.0, 10.0].into_iter()), Some(-5.0));
        for index in 0..3 {
            let mut clearances = [30.0, 10.0, 20.0];
            clearances[index] = f64::NAN;
            assert_eq!(nearest(clearances.into_iter()), None, "{index}");
        }
        assert_eq!(nearest(std::iter::empty()), None);
    }
}
