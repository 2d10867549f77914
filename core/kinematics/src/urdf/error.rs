//! What can be wrong with a URDF file.

use crate::chain::ChainError;

/// Why a URDF file gives no arm.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum UrdfError {
    /// No XML.
    #[error("line {line}: this is no XML: {reason}")]
    Syntax {
        /// Line of the file.
        line: u32,
        /// What the parser said.
        reason: String,
    },
    /// XML, but of something else.
    #[error("the file's outermost element is <{0}>; a URDF file has <robot>{hint}", hint = if .0.contains("xacro") || .0 == "sdf" { ": expand xacro and convert SDF first" } else { "" })]
    NotARobot(String),
    /// An element lacks something, or has what it cannot have.
    #[error("line {line}: {element}: {reason}")]
    Element {
        /// Line of the file.
        line: u32,
        /// Such as "joint `elbow`".
        element: String,
        /// What is wrong and what would be right.
        reason: String,
    },
    /// A link that hangs on two joints.
    #[error(
        "line {line}: link `{link}` hangs on both joint `{first}` and joint `{second}`: a closed loop, which a chain of joints cannot describe; leave the \
         joint out that is not driven, and give the other an effect for what it forces"
    )]
    ClosedLoop {
        /// Line of the second joint.
        line: u32,
        /// The link.
        link: String,
        /// The joint that came first in the file.
        first: String,
        /// The other.
        second: String,
    },
    /// Joints in a circle, or several trees.
    #[error("{0}")]
    NoTree(String),
    /// Several branches are as long.
    #[error(
        "the robot branches: {0} end after equally many moving joints; say which is the arm's tip (`--tip LINK`, in a model file `tip: LINK`)"
    )]
    Branches(String),
    /// No such link.
    #[error("there is no link `{requested}`; there are {known}")]
    UnknownTip {
        /// What was asked for.
        requested: String,
        /// What there is.
        known: String,
    },
    /// Nothing moves.
    #[error("no joint between `{root}` and `{tip}` moves: an arm needs at least one that does")]
    NothingMoves {
        /// Where the arm begins.
        root: String,
        /// Where it ends.
        tip: String,
    },
    /// Numbers in another unit.
    #[error("{0}")]
    Units(String),
    /// The rows are no chain.
    #[error(transparent)]
    Chain(#[from] ChainError),
}
