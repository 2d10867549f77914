//! What standards ask of a machine's measurements: accuracy and repeatability of an axis after ISO 230-2, of a robot's poses after ISO 9283, and an
//! uncertainty budget by effect after the GUM (JCGM 100). It reads measurement tables and models; it knows no device.

mod axis_run;
mod iso_230_2;
mod iso_9283;
mod orientation;
mod pose_run;
mod row_orientations;
mod uncertainty_budget;

pub use axis_run::{AxisChoice, AxisRun, AxisRunError, Target, Unit};
pub use iso_230_2::{AtTarget, Bidirectional, Iso230, OneSide, Unidirectional, iso_230_2};
pub use iso_9283::{AtPose, Drift, Iso9283, SideVariation, iso_9283};
pub use orientation::{GreatestOrientation, OrientationAtPose};
pub use pose_run::{CommandedFrom, PoseRun, PoseRunError, PoseVisits, Visit};
pub use row_orientations::Predicted;
pub use uncertainty_budget::{Budget, BudgetError, Component, Question, budget};

#[cfg(test)]
mod tests;
