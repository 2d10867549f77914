//! The part a robot's own pendant takes while an operator brings the robot somewhere.

use plumb_plugin::RobotCapabilities;

use crate::engine::Engine;
use crate::engine::step_error::StepError;
use crate::prompt::Prompt;

/// How a robot is handed to its pendant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Pendant {
    /// Not at all: it is jogged from here.
    None,
    /// Whenever it is not jogged from here: it can be taken back at any time.
    Shared,
    /// When the operator asks for it, because nothing but the pendant gives it back.
    OnRequest {
        /// Whether the pendant has it now.
        handed_over: bool,
    },
}

impl Pendant {
    pub(crate) fn for_robot(capabilities: &RobotCapabilities) -> Self {
        match (capabilities.jog, capabilities.only_pendant_ends_jog) {
            (false, _) => Self::None,
            (true, false) => Self::Shared,
            (true, true) => Self::OnRequest { handed_over: false },
        }
    }

    /// Whether an operator may ask for it.
    pub(crate) fn is_on_request(self) -> bool {
        matches!(self, Self::OnRequest { .. })
    }
}

impl Engine {
    /// Hands the robot to its pendant because the operator asked for it.
    pub(crate) fn hand_over(
        &mut self,
        robot: &str,
        pendant: &mut Pendant,
        prompt: &Prompt,
    ) -> Result<(), StepError> {
        match pendant {
            Pendant::None => self.refuse(prompt, "this robot is not handed to a pendant here"),
            Pendant::Shared => self.refuse(prompt, "its pendant works already"),
            Pendant::OnRequest { handed_over: true } => self.refuse(prompt, UNDER_HAND_CONTROL),
            Pendant::OnRequest { handed_over } => match self.jog(robot, true) {
                Ok(_) => {
                    *handed_over = true;
                    self.refuse(prompt, UNDER_HAND_CONTROL);
                }
                Err(StepError::Error(reason)) => self.refuse(prompt, &reason),
                Err(other) => return Err(other),
            },
        }
        Ok(())
    }

    /// Takes the robot back from its pendant, so that it may be moved from here, and shows where it is.
    pub(crate) fn take_back(&mut self, robot: &str, pendant: &mut Pendant) -> Result<(), StepError> {
        match pendant {
            Pendant::None | Pendant::OnRequest { handed_over: false } => {
                self.read_pose_anywhere(robot)?;
            }
            Pendant::Shared => {
                self.jog(robot, false)?;
            }
            Pendant::OnRequest { handed_over } => {
                self.jog(robot, false)?;
                *handed_over = false;
            }
        }
        Ok(())
    }

    /// Lets the pendant have its part while nothing else is asked for, and shows where the robot is.
    pub(crate) fn look_on(
        &mut self,
        robot: &str,
        pendant: &mut Pendant,
        prompt: &Prompt,
    ) -> Result<(), StepError> {
        match pendant {
            Pendant::None | Pendant::OnRequest { handed_over: false } => {
                self.read_pose_anywhere(robot)?;
            }
            Pendant::Shared => {
                self.jog(robot, true)?;
            }
            Pendant::OnRequest { handed_over } => {
                if self.jog(robot, true)? {
                    *handed_over = false;
                    self.jog(robot, false)?;
                    self.refuse(prompt, "the pendant has given the arm back");
                }
            }
        }
        Ok(())
    }

    /// Hands over or takes back; true once the operator has ended it on the pendant.
    pub(crate) fn jog(&mut self, robot: &str, on: bool) -> Result<bool, StepError> {
        self.pose_cache.forget();
        let asked_ns = self.links.clock_ns();
        let state = self.arm(robot)?.link.jog(on).map_err(|error| self.device_error(error))?;
        self.believe_state(robot, &state.state, asked_ns)?;
        // The pendant may have moved it until now.
        self.rest_ns = self.rest_ns.max(state.state.time_ns);
        self.arm(robot)?.saw_manual(&state.state.joints);
        self.show_pose(robot, &state.state)?;
        Ok(state.finished != 0)
    }
}

/// What an operator has to know while the pendant has the arm.
const UNDER_HAND_CONTROL: &str =
    "the pendant has the arm: only STOP on the pendant stops it, and gives it back";
