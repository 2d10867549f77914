//! A chain of joints: the nominal geometry of one arm.

use nalgebra::IsometryMatrix3;
use thiserror::Error;

/// How the four numbers of a joint's row are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Convention {
    /// Standard: turn `theta` about z, shift `d` along z, shift `a` along x, turn `alpha` about x.
    Distal,
    /// Modified (Craig): turn `alpha` about x, shift `a` along x, turn `theta` about z, shift `d` along z.
    Proximal,
}

/// What a joint does when it is driven.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Motion {
    /// Turns about its z axis; the coordinate is an angle in radians.
    #[default]
    Turns,
    /// Slides along its z axis; the coordinate is a length in millimetres.
    Slides,
}

/// One joint's row: Denavit-Hartenberg numbers in mm and rad, limits in the coordinate's unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Name, unique in the chain.
    pub name: String,
    /// Length along x, mm.
    pub a: f64,
    /// Twist about x, rad.
    pub alpha: f64,
    /// Offset along z, mm.
    pub d: f64,
    /// Angle about z at coordinate zero, rad.
    pub theta: f64,
    /// Least and greatest coordinate, rad (mm if it slides).
    pub limits: (f64, f64),
    /// +1 or -1: sense of the coordinate about the z axis.
    pub sign: f64,
    /// Motor turns per joint turn, where known.
    pub gear_ratio: Option<f64>,
    /// Travel of a slide for a turn of its screw, mm, where known.
    pub screw_pitch: Option<f64>,
    /// Turning or sliding.
    pub motion: Motion,
    /// Constant pose before the row (identity for Denavit-Hartenberg files; a URDF joint's origin).
    pub before: Option<IsometryMatrix3<f64>>,
    /// The joint whose coordinate this one's is counted with: the joint turns by its own coordinate less that one's. So it is where a drive keeps
    /// the attitude of what follows, as cables or a parallelogram do.
    pub less: Option<usize>,
}

impl Joint {
    /// A turning joint with this row (mm, rad), sign +1 and limits of one turn either way.
    pub fn turning(name: &str, a: f64, alpha: f64, d: f64, theta: f64) -> Self {
        let turn = std::f64::consts::TAU;
        Self {
            name: name.to_owned(),
            a,
            alpha,
            d,
            theta,
            limits: (-turn, turn),
            sign: 1.0,
            gear_ratio: None,
            screw_pitch: None,
            motion: Motion::Turns,
            before: None,
            less: None,
        }
    }
}

/// An arm's joints in order, from the base to the flange.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// How the rows are read.
    pub convention: Convention,
    /// The rows.
    pub joints: Vec<Joint>,
}

/// Why a chain cannot be built.
#[derive(Debug, Clone, Error, PartialEq)]
pub enum ChainError {
    /// No joints at all.
    #[error("an arm needs at least one joint")]
    Empty,
    /// Two joints of one name.
    #[error("joint `{0}` is named twice; joint names must differ")]
    DuplicateName(String),
    /// A number that is not finite.
    #[error("joint `{joint}`: {field} is not a finite number")]
    NotFinite {
        /// The joint.
        joint: String,
        /// Which of its numbers.
        field: &'static str,
    },
    /// A joint that keeps its attitude against one that does not come before it, or slides.
    #[error(
        "joint `{0}` turns by its coordinate less another joint's: that has to be a joint before it, and both have to turn"
    )]
    KeepsNothing(String),
}

impl Chain {
    /// Checks the rows and builds the chain.
    ///
    /// # Errors
    /// No joints, a name used twice, or a number that is not finite.
    pub fn new(convention: Convention, joints: Vec<Joint>) -> Result<Self, ChainError> {
        if joints.is_empty() {
            return Err(ChainError::Empty);
        }
        for (index, joint) in joints.iter().enumerate() {
            if joints.iter().take(index).any(|other| other.name == joint.name) {
                return Err(ChainError::DuplicateName(joint.name.clone()));
            }
            let fields = [
                ("a", joint.a),
                ("alpha", joint.alpha),
                ("d", joint.d),
                ("theta", joint.theta),
                ("sign", joint.sign),
            ];
            if let Some((field, _)) = fields.into_iter().find(|(_, value)| !value.is_finite()) {
                return Err(ChainError::NotFinite { joint: joint.name.clone(), field });
            }
            let turns = |one: &Joint| one.motion == Motion::Turns;
            if let Some(less) = joint.less
                && !(less < index && turns(joint) && joints.get(less).is_some_and(turns))
            {
                return Err(ChainError::KeepsNothing(joint.name.clone()));
            }
        }
        Ok(Self { convention, joints })
    }

    /// Number of joints.
    pub fn len(&self) -> usize {
        self.joints.len()
    }

    /// True for a chain without joints (which [`Chain::new`] refuses).
    pub fn is_empty(&self) -> bool {
        self.joints.is_empty()
    }

    /// Where a joint is in the chain, by name.
    pub fn position_of(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|joint| joint.name == name)
    }

    /// The greatest distance the flange can have from the base, mm (sum of all lengths and offsets).
    pub fn reach(&self) -> f64 {
        let before = |joint: &Joint| joint.before.as_ref().map_or(0.0, |pose| pose.translation.vector.norm());
        self.joints.iter().map(|joint| joint.a.hypot(joint.d) + before(joint)).sum()
    }
}
