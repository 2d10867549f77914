//! The Cell screen: devices with their states, live joints and signals, and the arm seen from the side.

mod arm_drawing;
mod arm_shape;
mod plan_view;
mod state;
mod trace;
mod view;
mod words;

use arm_drawing::side_view;
pub(crate) use arm_shape::ArmShape;
pub(crate) use plan_view::HandPosition;
use plan_view::plan_view;
pub(crate) use state::CellState;
pub(crate) use view::{joint_line, view, views};
pub(crate) use words::state_word;
