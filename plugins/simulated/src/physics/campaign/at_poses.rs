//! Hiding something in an arm that is in a cell: the poses are the cell's own, and its size is such that it shows in them.

use super::GenerateError;
use super::audit::Audit;
use super::case::{Hidden, Strength, describe};
use super::catalogue::Choice;
use super::hide::hide;
use super::specification::{Approach, Requested, Size, Specification};
use super::visit::Visit;
use crate::physics::description::ArmDescription;
use crate::physics::imperfection::Imperfection;
use crate::physics::random::Random;

/// Draws an effect that moves the target of `arm` over these poses (rad or mm, a row each, gone through straight from one to the next) by
/// `over_noise` times the `noise` of the instrument (mm, of each coordinate), root mean square, and is not imitated by zeros, base and target.
///
/// # Errors
/// [`GenerateError`]: why it cannot be hidden in this arm.
pub fn hide_at_poses(
    arm: ArmDescription,
    poses: &[Vec<f64>],
    noise: f64,
    (choice, over_noise): (Choice, f64),
    random: &mut Random,
) -> Result<(Imperfection, Hidden), GenerateError> {
    if poses.is_empty() {
        return Err(GenerateError::NoPoses);
    }
    let requested = Requested { choice, size: Size::OverNoise(over_noise) };
    let specification = Specification {
        noise,
        approach: Approach::Straight,
        hidden: vec![requested.clone()],
        ..Specification::usual(arm)
    };
    let visits: Vec<Visit> = poses.iter().map(|pose| Visit::at(pose.clone())).collect();
    let audit = Audit::new(&specification, &visits, &[])?;
    let imperfection = hide(&audit, &requested, &specification, &[], random)?;
    let visible = audit.visible_rms(&imperfection)? / noise;
    let strength = Strength {
        over_noise,
        visible_over_noise: visible,
        standard_errors: visible * (3.0 * visits.len() as f64).sqrt(),
    };
    let hidden = describe(&specification, &imperfection, strength);
    Ok((imperfection, hidden))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::arms;
    use crate::physics::description::Motion;
    use crate::physics::imperfection::Mechanism;

    /// Poses over the travel of every joint.
    fn poses(arm: &ArmDescription) -> Vec<Vec<f64>> {
        let mut random = Random::new(5, "poses");
        let pose = |random: &mut Random| -> Vec<f64> {
            arm.joints.iter().map(|joint| random.between(joint.limits[0], joint.limits[1])).collect()
        };
        (0..40).map(|_| pose(&mut random)).collect()
    }

    fn hidden(arm: &ArmDescription, choice: Choice) -> Result<(Imperfection, Hidden), GenerateError> {
        hide_at_poses(arm.clone(), &poses(arm), 0.05, (choice, 8.0), &mut Random::new(1, "hidden"))
    }

    #[test]
    fn what_is_hidden_shows_as_far_as_it_shall() {
        let arm = arms::by_name("ur5").unwrap().unwrap();
        let choice = Choice { site: Some("lift".to_owned()), ..Choice::named("joint_compliance") };
        let (imperfection, hidden) = hidden(&arm, choice).unwrap();
        assert_eq!(imperfection.mechanism, Mechanism::JointCompliance { joint: 1 });
        assert!(hidden.visible_over_noise > 1.0 && hidden.visible_over_noise <= 8.0 + 1e-6, "{hidden:?}");
        assert_eq!(hidden.unit, "rad/(N m)");
    }

    #[test]
    fn play_of_a_slide_is_in_millimetres_and_a_slide_gives_way_to_no_moment() {
        let mut arm = arms::by_name("scara4").unwrap().unwrap();
        arm.joints[2].motion = Motion::Slides;
        arm.joints[2].limits = [0.0, 200.0];
        let at_slide = |name: &str| Choice { site: Some("wrist".to_owned()), ..Choice::named(name) };
        let (imperfection, play) = hidden(&arm, at_slide("joint_backlash")).unwrap();
        assert_eq!(play.unit, "mm");
        assert!(imperfection.size > 0.2 && imperfection.size < 5.0, "{imperfection:?}");
        assert!(hidden(&arm, at_slide("joint_harmonic")).is_err());
    }
}
