//! What errors of a slide's guideway share: the carriage turns as it goes, by so much for each mm of travel from the coordinate's zero.
//!
//! A guideway that is bowed evenly carries the carriage along an arc: with the curvature `k` it has turned by `k q` at the coordinate `q`, and lies off the
//! straight line
//! by `k q^2 / 2` (the straightness error that goes with it). One that is twisted evenly turns it about its own line. Everything beyond the slide goes along,
//! so that what is off
//! grows with the distance from the guideway (Abbe 1890).

use nalgebra::Vector3;

use super::kind::{CandidateContext, Setting};
use super::{Contribution, Dof, Effect, EffectId, EffectNameError, LooksAt, Parameter, Sample, Unit};

/// About which line a carriage turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Turn {
    /// About the direction of travel.
    Roll,
    /// About the level line across the travel: positive lifts the end towards which the coordinate grows.
    Pitch,
    /// About what is up, square to the travel: positive turns that end to the left.
    Yaw,
}

/// Greatest turn for a mm of travel that a working guideway has, rad: 1 degree a metre.
const GREATEST: f64 = 1.75e-5;

/// A travel is taken for upright where it leans from there by less than this (sine, 45 degrees): pitch and yaw are then about lines that are level, across x
/// and along x of the base.
const UPRIGHT: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// An error of the guideway of a slide.
#[derive(Debug)]
pub(super) struct Guideway {
    joint: usize,
    turn: Turn,
    parameters: [Parameter; 1],
}

impl Guideway {
    /// # Errors
    /// The joint does not slide.
    pub(super) fn new(setting: &Setting<'_>, turn: Turn, name: &str) -> Result<Self, EffectNameError> {
        let joint = setting.joint()?;
        if !setting.slides(joint) {
            return Err(setting.unusable("is of a joint that slides"));
        }
        let parameters = [Parameter::new(name, Unit::DEG_PER_M, (-GREATEST, GREATEST))];
        Ok(Self { joint, turn, parameters })
    }
}

/// The lines about which a carriage pitches and yaws, for a direction of travel and what is up (unit vectors).
fn across(travel: &Vector3<f64>, up: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    // Upright travel has no level line across it of its own: then the base's x is taken.
    let lean = travel.cross(up).norm();
    let reference = if lean < UPRIGHT { Vector3::x() } else { *up };
    let pitch = travel.cross(&reference).normalize();
    (pitch, pitch.cross(travel))
}

impl Effect for Guideway {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        let (Some(frame), Some(row)) =
            (sample.link_frames.joints.get(self.joint), sample.chain.joints.get(self.joint))
        else {
            return;
        };
        // The way in which the coordinate grows, base frame.
        let travel = frame.axis * row.sign;
        let q = sample.coordinate(self.joint);
        let (pitch, yaw) = across(&travel, &-sample.weights.down);
        let (about, bow) = match self.turn {
            Turn::Roll => (travel, 0.0),
            Turn::Pitch => (pitch, 1.0),
            Turn::Yaw => (yaw, 1.0),
        };
        // The chord of an arc: turned by `k q`, and off the tangent by `k q^2 / 2`, square to both.
        let dof = Dof::Twist {
            after: self.joint,
            shift: about.cross(&travel) * (0.5 * bow * q * q),
            rotation: about * q,
            about: frame.axis_point + travel * q,
        };
        contributions.push(Contribution { parameter: 0, dof, rate: 1.0 });
    }

    /// It needs the arm's frames, which are worked out for what bends.
    fn looks_at(&self) -> LooksAt {
        LooksAt::Gravity
    }
}

/// Everywhere such an error may be: every joint that slides.
pub(super) fn candidates(context: &CandidateContext<'_>, name: &str) -> Vec<EffectId> {
    let mut ids = context.every_joint(name);
    ids.retain(|id| id.joint().is_some_and(|joint| !context.turns(joint)));
    ids
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;
    use crate::arm_model::Model;
    use crate::effect;
    use crate::forward::ForwardModel;

    /// A slide along the world's x; its point hangs 400 mm below.
    const AXIS: &str = "
arm: axis
convention: distal
joints: [{name: x, slides: true, limits_mm: [0, 900]}]
base: {xyz_mm: [0, 0, 0], rpy_deg: [0, 90, 0], free: false}
targets: {p1: {xyz_mm: [400, 0, 0], free: false}}
measured_from: world
";

    /// How far the point at 800 mm moves with so many deg/m, world.
    fn moved(text: &str, effect: &str, key: &str, size: f64) -> Vector3<f64> {
        let point = |effects: &str| {
            let model = Model::parse("axis.yaml", &format!("{text}effects: [{effects}]\n")).unwrap();
            let (base, target) = (model.base.pose, model.targets[0].xyz);
            let q = if model.chain.joints[0].sign < 0.0 { -800.0 } else { 800.0 };
            base * ForwardModel::new(model).unwrap().flange(&[q], &[]) * Point3::from(target)
        };
        point(&format!("{{effect: {effect}, where: x, values: {{{key}: {size}}}}}")) - point("")
    }

    fn assert_moved(found: Vector3<f64>, expected: [f64; 3]) {
        assert!((found - Vector3::from(expected)).norm() < 1e-4, "{found:?} and not {expected:?}");
    }

    #[test]
    fn a_bowed_or_twisted_guideway_turns_the_carriage_and_takes_it_off_the_line() {
        // 0.02 deg/m over 800 mm: turned by 0.016 deg, half of that times 800 mm aside; 400 mm below it goes ahead by the turn times 400.
        let turn = 0.016_f64.to_radians();
        let (aside, lever) = (0.5 * turn * 800.0, 400.0 * turn);
        assert_moved(moved(AXIS, "axis_pitch", "pitch_deg_per_m", 0.02), [lever, 0.0, aside]);
        assert_moved(moved(AXIS, "axis_yaw", "yaw_deg_per_m", 0.02), [0.0, aside, 0.0]);
        assert_moved(moved(AXIS, "axis_roll", "roll_deg_per_m", 0.02), [0.0, lever, 0.0]);
    }

    #[test]
    fn a_row_that_counts_against_its_axis_travels_the_other_way() {
        let against =
            AXIS.replace("slides: true, limits_mm: [0, 900]", "slides: true, sign: -1, limits_mm: [-900, 0]");
        // At -800 of a joint of sign -1 it is at the same place, and the travel as it counts points to -x: from zero to there it went backwards.
        let turn = 0.016_f64.to_radians();
        assert_moved(
            moved(&against, "axis_pitch", "pitch_deg_per_m", 0.02),
            [400.0 * turn, 0.0, 0.5 * turn * 800.0],
        );
    }

    #[test]
    fn a_joint_that_turns_has_no_guideway() {
        let model =
            Model::parse("axis.yaml", &AXIS.replace("slides: true, limits_mm: [0, 900]", "a_mm: 1")).unwrap();
        let refused = effect::build(&effect::parse("axis_yaw(x)", &model).unwrap(), &model).unwrap_err();
        assert!(refused.to_string().contains("is of a joint that slides"), "{refused}");
    }
}
