//! The Cell screen: devices with their states, live joints and signals, and the arm seen from the side.

mod arm_drawing;
mod arm_shape;
mod state;
mod trace;
mod view;
mod words;

pub(crate) use arm_drawing::side_view;
pub(crate) use arm_shape::ArmShape;
pub(crate) use state::CellState;
pub(crate) use view::{joint_line, view};
pub(crate) use words::state_word;
