//! What all parts of a world file are checked with: the text, and the arm on paper that its names are held against.

use serde_yaml::Spanned;

use crate::arm::description::ArmOnPaper;
use crate::physics::description::Motion;
use crate::world::file::WorldFileError;
use crate::world::file::error::unknown;
use crate::world::file::typed::Typed;

/// A number with its place in the file.
pub(super) type Number = Spanned<f64>;

/// Checks one file.
pub(super) struct Checker<'a> {
    pub(super) typed: Typed<'a>,
    pub(super) paper: &'a ArmOnPaper,
}

impl Checker<'_> {
    /// Whether a joint turns or slides.
    pub(super) fn motion(&self, joint: usize) -> Motion {
        self.paper.drive.joints.get(joint).map_or(Motion::Turns, |joint| joint.motion)
    }

    /// The index of a joint that a file names.
    pub(super) fn joint(&self, name: &Spanned<String>) -> Result<usize, WorldFileError> {
        self.paper.shape.joint_index(&name.value).ok_or_else(|| {
            let names: Vec<&str> = self.paper.shape.joints.iter().map(|joint| joint.name.as_str()).collect();
            self.typed.wrong(name.referenced, unknown("joint", &name.value, &names))
        })
    }

    /// The same of a joint that turns: what needs angles and moments is nothing of a slide's.
    pub(super) fn turning_joint(&self, name: &Spanned<String>) -> Result<usize, WorldFileError> {
        let joint = self.joint(name)?;
        match self.motion(joint) {
            Motion::Turns => Ok(joint),
            Motion::Slides => {
                let problem =
                    format!("joint `{}` slides, and this is an error of joints that turn", name.value);
                Err(self.typed.wrong(name.referenced, problem))
            }
        }
    }
}
