//! Which joint of an arm is meant.

use plumb_plugin::JointVector;

use super::step_error::StepError;

/// A joint of an arm, by its position in the drive's order. Only the arm makes it, from the joint's name, so that it always is one of the
/// arm's own joints: no motion is commanded of a joint that was never named.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct JointIndex(usize);

/// A robot has no joint of this name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{robot} has no joint {joint}: {help}")]
pub(crate) struct UnknownJoint {
    robot: String,
    joint: String,
    help: String,
}

/// A vector of joint values that does not reach as far as the joint that was asked for.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{count} joint values were given, and none for joint {number}")]
pub(crate) struct MissingJoint {
    count: usize,
    /// Counted from 1, for people.
    number: usize,
}

impl JointIndex {
    /// The joint called `joint` among the `names` of a robot's joints, in the drive's order.
    ///
    /// # Errors
    /// [`UnknownJoint`] with the names it has.
    pub(crate) fn find<'a>(
        robot: &str,
        names: impl Iterator<Item = &'a str> + Clone,
        joint: &str,
    ) -> Result<Self, UnknownJoint> {
        names.clone().position(|name| name == joint).map(Self).ok_or_else(|| UnknownJoint {
            robot: robot.to_owned(),
            joint: joint.to_owned(),
            help: plumb_document::did_you_mean(joint, names),
        })
    }

    /// The joints of a robot that has `count` of them.
    pub(crate) fn all(count: usize) -> impl Iterator<Item = Self> {
        (0..count).map(Self)
    }

    /// Its position in the drive's order, counted from 0.
    pub(crate) fn position(self) -> usize {
        self.0
    }

    /// The joint's number out of a vector in the drive's order, rad or mm.
    ///
    /// # Errors
    /// [`MissingJoint`] where the vector ends before it.
    pub(crate) fn value(self, joints: &JointVector) -> Result<f64, MissingJoint> {
        joints.get(self.0).ok_or_else(|| self.missing(joints))
    }

    /// Puts the joint's number, rad or mm, into a vector in the drive's order.
    ///
    /// # Errors
    /// [`MissingJoint`] where the vector ends before it; then it is as it was.
    pub(crate) fn set(self, joints: &mut JointVector, value: f64) -> Result<(), MissingJoint> {
        match joints.as_mut_slice().get_mut(self.0) {
            Some(entry) => {
                *entry = value;
                Ok(())
            }
            None => Err(self.missing(joints)),
        }
    }

    fn missing(self, joints: &JointVector) -> MissingJoint {
        MissingJoint { count: joints.len(), number: self.0 + 1 }
    }
}

impl From<UnknownJoint> for StepError {
    fn from(error: UnknownJoint) -> Self {
        Self::Error(error.to_string())
    }
}

impl From<MissingJoint> for StepError {
    fn from(error: MissingJoint) -> Self {
        Self::Error(error.to_string())
    }
}

impl From<UnknownJoint> for String {
    fn from(error: UnknownJoint) -> Self {
        error.to_string()
    }
}

impl From<MissingJoint> for String {
    fn from(error: MissingJoint) -> Self {
        error.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn joint(name: &str) -> Result<JointIndex, UnknownJoint> {
        JointIndex::find("arm", ["waist", "shoulder", "elbow"].into_iter(), name)
    }

    #[test]
    fn a_joint_is_found_by_its_name_and_an_unknown_one_is_refused() {
        assert_eq!(joint("elbow").map(JointIndex::position), Ok(2));
        let message = joint("elbo").unwrap_err().to_string();
        assert!(message.starts_with("arm has no joint elbo: "), "{message}");
        assert!(message.contains("`elbow`"), "{message}");
    }

    #[test]
    fn a_value_past_the_end_is_an_error_and_changes_nothing() {
        let mut short = JointVector::from_slice(&[1.0, 2.0]).unwrap();
        let (shoulder, elbow) = (joint("shoulder").unwrap(), joint("elbow").unwrap());
        assert_eq!(shoulder.value(&short), Ok(2.0));
        let missing = elbow.value(&short).unwrap_err().to_string();
        assert_eq!(missing, "2 joint values were given, and none for joint 3");
        assert!(elbow.set(&mut short, 9.0).is_err());
        assert_eq!(short.as_slice(), [1.0, 2.0]);
        assert_eq!(shoulder.set(&mut short, 9.0), Ok(()));
        assert_eq!(short.as_slice(), [1.0, 9.0]);
    }

    #[test]
    fn all_joints_are_counted_from_the_base() {
        let positions: Vec<usize> = JointIndex::all(3).map(JointIndex::position).collect();
        assert_eq!(positions, [0, 1, 2]);
    }
}
