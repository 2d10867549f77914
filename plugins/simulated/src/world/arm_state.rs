//! How the arm is at one moment, and all that follows from it.

use super::description::WorldDescription;
use super::drive::{HalfSteps, Joint, Joints};
use super::pose::ArmPose;
use super::sensor::Seen;
use crate::physics::machine::{Conditions, Machine};
use crate::physics::slow_change::COLD_C;

/// An arm this near to something solid, or this deep in it, touches it, mm.
pub(super) const TOUCH: f64 = 1e-9;

/// What the fingers hold.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Held {
    /// Width of what is between the fingers, mm; 0 when they meet each other.
    pub(super) width: f64,
    /// Mass that hangs at the fingers' tips, kg.
    pub(super) mass: f64,
}

/// How the arm is.
#[derive(Debug, Clone)]
pub(super) struct ArmState {
    /// Where the motors' rotors truly are.
    pub(super) rotors: HalfSteps,
    /// The arm behind them, with what its drives remember.
    machine: Machine,
    /// What the fingers hold.
    pub(super) held: Held,
    /// True attitudes.
    pub(super) attitudes: Joints,
    /// Where the parts are.
    pub(super) pose: ArmPose,
    /// How far the gripper's cable is drawn past the touch of the fingers, mm of its drive.
    pub(super) grip: f64,
    /// How deep the arm is in something it cannot enter, mm.
    pub(super) trespass: f64,
    /// What the sensor sees, without its noise.
    pub(super) seen: Seen,
}

impl ArmState {
    /// The arm as it was left at the world's beginning, every drive in the middle of its play and nothing in the hand.
    pub(super) fn at_start(world: &WorldDescription) -> ArmState {
        let mut machine = world.arm.mechanism.machine();
        let held = Held::default();
        let command = machine.command_for(&world.drawn_start().0, &load(held));
        machine.go(&command, 0.0);
        let rotors = HalfSteps::from_joints(&Joints::of_drives(&command));
        ArmState::at_rest(world, machine, rotors, held)
    }

    fn at_rest(world: &WorldDescription, machine: Machine, rotors: HalfSteps, held: Held) -> ArmState {
        let arm_state = machine.balance(&load(held)).arm_state;
        let mut attitudes = Joints::of_drives(&arm_state.drives);
        // The fingers stop at what they hold; their cable is drawn on.
        let opening = &mut attitudes.0[Joint::Gripper.index()];
        *opening = opening.max(held.width);
        let grip = (held.width - Joints::of_drives(machine.driven()).of(Joint::Gripper)).max(0.0);
        let pose = ArmPose::of(&arm_state.link_frames);
        let mechanism = &world.arm.mechanism;
        let past_stop = mechanism.past_stops(&arm_state.angles, attitudes.of(Joint::Gripper), grip);
        ArmState {
            trespass: if world.scene.table.solid { past_stop.max(pose.under_table()) } else { past_stop },
            seen: world.scene.seen(&pose),
            rotors,
            machine,
            held,
            attitudes,
            pose,
            grip,
        }
    }

    /// The arm after its rotors went straight from where they are to `rotors`.
    pub(super) fn after(&self, world: &WorldDescription, rotors: HalfSteps) -> ArmState {
        let mut machine = self.machine.clone();
        machine.go(&rotors.to_joints().0, 0.0);
        ArmState::at_rest(world, machine, rotors, self.held)
    }

    /// The arm a fraction of the way to `rotors`.
    pub(super) fn part_way(&self, world: &WorldDescription, rotors: &HalfSteps, fraction: f64) -> ArmState {
        let travelled = rotors.minus(&self.rotors).times(fraction);
        self.after(world, self.rotors.plus(&travelled))
    }

    /// The arm where it is, with something else in its hand.
    pub(super) fn holding(&self, world: &WorldDescription, held: Held) -> ArmState {
        ArmState::at_rest(world, self.machine.clone(), self.rotors, held)
    }

    /// Where the drives must be sent for the true attitudes to be these, as if they had no play.
    pub(super) fn command_for(&self, attitudes: &Joints) -> Joints {
        Joints::of_drives(&self.machine.command_for(&attitudes.0, &load(self.held)))
    }

    /// Where the parts would be at these true attitudes.
    pub(super) fn pose_at(&self, attitudes: &Joints) -> ArmPose {
        ArmPose::of(&self.machine.stiff(&attitudes.0).link_frames)
    }

    /// Whether the arm is in something it cannot enter.
    pub(super) fn is_trespassing(&self) -> bool {
        self.trespass > TOUCH
    }
}

/// What the hand holds hangs on the arm; nothing on a TeachMover warms up or drifts.
fn load(held: Held) -> Conditions {
    Conditions { time_s: 0.0, temperature_c: COLD_C, payload_kg: held.mass }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::drive::GRIPPER_HALF_STEPS_PER_MM;
    use crate::world::file::parse;
    use crate::world::mechanism::GRIP_SWITCH;
    use std::f64::consts::FRAC_PI_2;

    fn ideal() -> WorldDescription {
        parse("world-ideal.yaml", include_str!("../../../../workcells/teachmover/world-ideal.yaml")).unwrap()
    }

    fn sent_to(world: &WorldDescription, held: Held, drives: Joints) -> ArmState {
        ArmState::at_start(world).holding(world, held).after(world, HalfSteps::from_joints(&drives))
    }

    #[test]
    fn fingers_stop_at_what_they_hold_and_their_cable_is_drawn_on() {
        let world = ideal();
        let closing = |drive: f64| {
            sent_to(&world, Held { width: 12.0, mass: 0.0 }, Joints([0.0, 0.0, 0.0, 0.0, 0.0, drive]))
        };
        let opening = |drive: f64| closing(drive).attitudes.of(Joint::Gripper);
        assert!((opening(15.0) - 15.0).abs() < 1e-12);
        assert_eq!(opening(10.0), 12.0);
        assert!(closing(12.0).grip < GRIP_SWITCH && closing(11.7).grip >= GRIP_SWITCH);
        // One pound of grip is 32 half-steps.
        let pound = 32.0 / GRIPPER_HALF_STEPS_PER_MM;
        assert!((closing(12.0 - pound).grip - pound).abs() < 1e-12);
    }

    #[test]
    fn a_solid_table_and_a_joints_stop_are_trespassed_on() {
        let mut world = ideal();
        let low = Joints([0.0, 0.2, -FRAC_PI_2, -FRAC_PI_2, 0.0, 10.0]);
        let depth = -(195.0 + 177.8 * 0.2_f64.sin() - 177.8 - 109.0);
        assert!((sent_to(&world, Held::default(), low).trespass - depth).abs() < 1e-9);
        let folded = Joints([0.0, 1.5, -1.4, -FRAC_PI_2, 0.0, 10.0]);
        assert!(sent_to(&world, Held::default(), folded).trespass > 0.0);
        world.scene.table.solid = false;
        assert!(sent_to(&world, Held::default(), low).trespass <= 0.0);
    }
}
