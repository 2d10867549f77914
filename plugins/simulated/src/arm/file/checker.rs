//! What all parts of a world file are checked with: the text, and the arm on paper that its names are held against.

use plumb_document::Spanned;

use crate::arm::description::ArmOnPaper;
use crate::physics::description::Motion;
use crate::world::file::typed::Typed;

/// A number with its position in the file.
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

    /// The index of a joint that a file names; none after a error.
    pub(super) fn joint(&self, name: &Spanned<String>) -> Option<usize> {
        let index = self.paper.shape.joint_index(&name.value);
        if index.is_none() {
            let names = self.paper.shape.joints.iter().map(|joint| joint.name.as_str());
            self.typed.unknown("joint", name, names);
        }
        index
    }

    /// The same of a joint that turns: what needs angles and moments is nothing of a slide's.
    pub(super) fn sliding_joint(&self, name: &Spanned<String>) -> Option<usize> {
        let joint = self.joint(name)?;
        if self.motion(joint) == Motion::Turns {
            let problem = format!("joint `{}` turns; this is an error of joints that slide", name.value);
            self.typed.wrong(name.span, &problem);
            return None;
        }
        Some(joint)
    }

    pub(super) fn turning_joint(&self, name: &Spanned<String>) -> Option<usize> {
        let joint = self.joint(name)?;
        if self.motion(joint) == Motion::Slides {
            let problem = format!("joint `{}` slides; this is an error of joints that turn", name.value);
            self.typed.wrong(name.span, &problem);
            return None;
        }
        Some(joint)
    }
}
