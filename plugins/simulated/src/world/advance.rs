//! Letting time run: the arm goes on, is held up by what is solid, and the sensor's line switches on the way.

use std::ops::Range;

use super::arm_state::{ArmState, TOUCH};
use super::crossing::{first_change, summit};
use super::drive::{AXES, HalfSteps, Joints};
use super::motion::{Motion, Resolution};
use super::sensor::Seen;
use super::{LineChange, REMEMBERED_CHANGES, World};
use crate::chance::uniform;

/// Half-steps in one electrical turn of a motor: what it loses, it loses in such turns.
const HALF_STEPS_PER_ELECTRICAL_TURN: f64 = 8.0;

/// How near, as a fraction of one part of a motion, an event is found: far below 1e-13 rad.
const EVENT_WIDTH: f64 = 1e-12;

/// One part of a motion: where the arm was before it and after it, what the registers counted, and when.
struct Part {
    before: ArmState,
    after: ArmState,
    registers_before: HalfSteps,
    registers_after: HalfSteps,
    time: Range<u64>,
}

impl World {
    /// Lets the world's time run to `until_ns`; earlier moments change nothing.
    pub fn advance(&mut self, until_ns: u64) {
        while let Some(mut motion) = self.motion.take() {
            match motion.next_part() {
                Some((time, registers)) if time.end <= until_ns => {
                    self.make_part(&motion, registers, time);
                    motion.complete_part();
                    self.motion = Some(motion);
                }
                None if motion.end_ns() <= until_ns => self.time_ns = self.time_ns.max(motion.end_ns()),
                _ => {
                    self.motion = Some(motion);
                    self.time_ns = self.time_ns.max(until_ns);
                    return;
                }
            }
        }
        self.rest(until_ns);
    }

    /// Lets time run to the end of the motion under way, if there is one.
    pub fn finish_motion(&mut self) {
        if let Some(end_ns) = self.motion_ends_ns() {
            self.advance(end_ns);
        }
    }

    fn make_part(&mut self, motion: &Motion, registers: HalfSteps, time: Range<u64>) {
        let slipped = self.slipping.of_part(self, motion, &registers.minus(&self.registers));
        self.lose(&slipped);
        let before = self.arm_state.clone();
        let after = before.after(&self.description, registers.plus(&self.slip));
        if after.is_trespassing() {
            self.make_blocked_part(&after.rotors, registers, time);
        } else {
            self.accept(after, registers, time);
        }
    }

    /// A part in which the arm meets something solid: it goes as far as it can, and then the motors that would push it
    /// further in stall, while the others go on.
    fn make_blocked_part(&mut self, goal: &HalfSteps, registers: HalfSteps, time: Range<u64>) {
        let free = match self.description.arm.resolution {
            Resolution::HalfStep => 0.0,
            Resolution::Continuous => self.free_share(goal),
        };
        let touched_ns = within(&time, free);
        if free > 0.0 {
            let touching = self.arm_state.part_way(&self.description, goal, free);
            let counted = self.registers.plus(&registers.minus(&self.registers).times(free));
            self.accept(touching, counted, time.start..touched_ns);
        }
        let stalled = self.stalled(&goal.minus(&self.arm_state.rotors));
        self.lose(&stalled);
        let after = self.arm_state.after(&self.description, registers.plus(&self.slip));
        self.accept(after, registers, touched_ns..time.end);
    }

    /// The fraction of the way to `goal` the arm can go before it touches.
    fn free_share(&self, goal: &HalfSteps) -> f64 {
        if self.arm_state.is_trespassing() {
            return 0.0;
        }
        first_change(0.0, 1.0, EVENT_WIDTH, |fraction| {
            self.arm_state.part_way(&self.description, goal, fraction).is_trespassing()
        })
    }

    /// Which of this travel the motors cannot make, the arm being in touch.
    fn stalled(&self, requested: &HalfSteps) -> HalfSteps {
        let rotors = self.arm_state.rotors;
        let pushes = |travel: &HalfSteps| {
            let there = self.arm_state.after(&self.description, rotors.plus(travel));
            there.is_trespassing() && there.trespass > self.arm_state.trespass + TOUCH * 1e-3
        };
        let stalled = HalfSteps(std::array::from_fn(|axis| {
            let mut alone = HalfSteps::default();
            alone.0[axis] = requested.0[axis];
            if requested.0[axis] != 0.0 && pushes(&alone) { requested.0[axis] } else { 0.0 }
        }));
        if pushes(&requested.minus(&stalled)) { *requested } else { stalled }
    }

    /// The registers will count these half-steps, the rotors do not make them.
    fn lose(&mut self, half_steps: &HalfSteps) {
        self.slip = self.slip.minus(half_steps);
        self.lost = self.lost.plus(&HalfSteps(half_steps.0.map(f64::abs)));
    }

    fn accept(&mut self, after: ArmState, registers: HalfSteps, time: Range<u64>) {
        let part = Part {
            before: self.arm_state.clone(),
            after,
            registers_before: self.registers,
            registers_after: registers,
            time: time.clone(),
        };
        match self.description.arm.resolution {
            Resolution::Continuous => self.watch_throughout(&part),
            Resolution::HalfStep => self.watch_at_the_end(&part),
        }
        self.registers = registers;
        self.near = self.description.scene.is_near(self.near || self.fired, &part.after.pose);
        self.arm_state = part.after;
        self.time_ns = self.time_ns.max(time.end);
    }

    /// Switches the line wherever on the way the signal passes the level it waits for.
    fn watch_throughout(&mut self, part: &Part) {
        let mut from = 0.0;
        while let Some(fraction) = self.next_switch(part, from) {
            let travelled = part.registers_after.minus(&part.registers_before).times(fraction);
            let joints = part.registers_before.plus(&travelled).to_joints();
            self.switch(within(&part.time, fraction), joints, Joints::default());
            from = fraction;
        }
    }

    /// The fraction of the part, from `from` on, at which the line switches next.
    fn next_switch(&self, part: &Part, from: f64) -> Option<f64> {
        let switches = |fraction: f64| self.switches(self.excess_at(part, fraction));
        if switches(1.0) {
            return Some(first_change(from, 1.0, EVENT_WIDTH, switches));
        }
        let (top, _) = summit(1e-9, |fraction| self.excess_at(part, from + (1.0 - from) * fraction))?;
        let top = from + (1.0 - from) * top;
        switches(top).then(|| first_change(from, top, EVENT_WIDTH, switches))
    }

    /// A half-step is a jump: the line is looked at where it ends, and the edge lies somewhere on it.
    fn watch_at_the_end(&mut self, part: &Part) {
        if self.switches(self.excess_at(part, 1.0)) {
            let (before, after) = (part.registers_before, part.registers_after);
            let middle = before.plus(&after).times(0.5).to_joints();
            self.switch(part.time.end, middle, half_width(&after.minus(&before)));
        }
    }

    /// How far the sensor is past switching at a fraction of a part.
    fn excess_at(&self, part: &Part, fraction: f64) -> f64 {
        let seen = if fraction >= 1.0 {
            part.after.seen
        } else {
            part.before.part_way(&self.description, &part.after.rotors, fraction).seen
        };
        self.excess(&seen, within(&part.time, fraction))
    }

    /// How far the sensor, as its line is, is past switching it.
    fn excess(&self, seen: &Seen, time_ns: u64) -> f64 {
        let noise = self.noise_at(time_ns);
        let past_firing = if self.near { seen.past_firing_near } else { seen.past_firing };
        if self.fired { -(seen.past_release + noise) } else { past_firing + noise }
    }

    /// Whether the line switches: it comes on at its level, and goes off below its level.
    fn switches(&self, excess: f64) -> bool {
        if self.fired { excess > 0.0 } else { excess >= 0.0 }
    }

    fn switch(&mut self, time_ns: u64, joints: Joints, half_width: Joints) {
        self.fired = !self.fired;
        self.near |= self.fired;
        self.changes_seen += 1;
        if self.changes.len() == REMEMBERED_CHANGES {
            self.changes.pop_front();
        }
        self.changes.push_back(LineChange {
            number: self.changes_seen,
            time_ns,
            levels: self.inputs(),
            changed: 1 << self.description.scene.sensor.input_bit,
            joints,
            half_width,
        });
    }

    /// Switches the line of an arm that is at rest, if it must.
    pub(super) fn watch_at_rest(&mut self) {
        if self.switches(self.excess(&self.arm_state.seen, self.time_ns)) {
            self.switch(self.time_ns, self.registers.to_joints(), Joints::default());
        }
    }

    /// The arm is at rest and the sensor's noise goes on.
    fn rest(&mut self, until_ns: u64) {
        if let Some(interval) = self.description.scene.watch_interval_ns() {
            let interval = interval.max(1);
            while self.time_ns + interval <= until_ns {
                self.time_ns += interval;
                self.watch_at_rest();
            }
        }
        self.time_ns = self.time_ns.max(until_ns);
    }
}

/// The moment a fraction of the way through a span of time.
fn within(time: &Range<u64>, fraction: f64) -> u64 {
    time.start + (time.end.saturating_sub(time.start) as f64 * fraction) as u64
}

/// Half of what each joint moves in these half-steps.
fn half_width(travel: &HalfSteps) -> Joints {
    Joints(travel.times(0.5).to_joints().0.map(f64::abs))
}

/// Motors that fall out of step because they are driven too fast.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Slipping {
    /// Electrical turns drawn so far, by all motors.
    drawn: u64,
    /// Half-steps issued to each motor in its present electrical turn.
    into_turn: [f64; AXES],
    /// Whether each motor slips through its present electrical turn.
    slips: [bool; AXES],
}

impl Slipping {
    pub(super) fn start_motion(&mut self) {
        self.into_turn = [HALF_STEPS_PER_ELECTRICAL_TURN; AXES];
        self.slips = [false; AXES];
    }

    fn of_part(mut self, world: &mut World, motion: &Motion, issued: &HalfSteps) -> HalfSteps {
        let Some(pull_out) = world.description.arm.pull_out_rates else {
            return HalfSteps::default();
        };
        let rates = motion.rates();
        let slipped = HalfSteps(std::array::from_fn(|axis| {
            if rates.0[axis] <= pull_out.0[axis] || issued.0[axis] == 0.0 {
                return 0.0;
            }
            if self.into_turn[axis] >= HALF_STEPS_PER_ELECTRICAL_TURN {
                self.into_turn[axis] = 0.0;
                self.drawn += 1;
                let lost_fraction = 1.0 - pull_out.0[axis] / rates.0[axis];
                self.slips[axis] = uniform(world.description.seed ^ 0x5119, self.drawn) < lost_fraction;
            }
            self.into_turn[axis] += issued.0[axis].abs();
            if self.slips[axis] { issued.0[axis] } else { 0.0 }
        }));
        world.slipping = self;
        slipped
    }
}
