//! The steps a procedure is made of. Each kind of step is one file with one `KIND`: its fields, how they are read and checked, how long it
//! takes, what it moves, what later steps may name of its result, and how it is carried out. `library` is the table of all kinds: a new kind
//! is a new file, and a line there.

mod apply;
mod beyond;
mod call;
mod check;
mod compute;
mod configure;
mod correct;
mod declaration;
mod declare;
mod error_terms;
mod geometry;
mod joint_targets;
mod kind;
mod known_point;
mod known_robot;
mod library;
mod limits;
mod listen;
mod measure;
mod motions;
mod motors;
mod move_joints;
mod point;
mod prompt;
mod question;
mod read;
mod read_question;
mod repeat;
mod row;
mod scan;
mod search;
mod time;
mod turns;

pub(crate) use declaration::{Action, Inside, MovedJoints, OnError, Searched, Step, StepQuestion};
pub(crate) use error_terms::{ErrorTerm, INSTRUMENTS, TOLERANCES};
pub(crate) use geometry::Geometry;
pub(crate) use known_robot::KnownRobot;
pub use known_robot::{JointFacts, RobotFacts};
pub(crate) use library::{KINDS, kind, read_action};
pub use motions::PlannedMotion;
pub(crate) use motions::{MotionContext, rounded};
pub(crate) use question::PromptQuestion;
pub(crate) use read::{LONGEST_NAME, check_name, read_steps};
pub(crate) use search::CIRCUMSTANCES;
pub(crate) use time::{Foreseen, TimeContext};
pub use turns::Rows;
pub(crate) use turns::Turns;
