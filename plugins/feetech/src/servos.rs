//! All servos of the arm: read together, sent together, held together.

use std::thread::sleep;
use std::time::{Duration, Instant};

use plumb_plugin::PluginError;

use crate::bus::{Bus, BusError};
use crate::calibration::Calibration;
use crate::configuration::{Configuration, JointSetting};
use crate::motion::{Direction, Goal};
use crate::registers::{ACCELERATION, GOAL, STATE, STATE_LENGTH, TORQUE};
use crate::servo::{STEPS_A_TURN, ServoState};
use crate::settings::{Settings, take_for};

/// How often goals are sent until every servo has them.
const SENDINGS: usize = 3;
/// How often the servos are read until two readings agree.
const READINGS: usize = 6;
/// Two readings of an arm at rest differ by no more, steps.
const ALIKE: i32 = 1;
/// From one look at the servos to the next.
const LOOK: Duration = Duration::from_millis(5);
/// How long servos that were commanded to hold may go on: they slow down by their own acceleration.
const HELD_WITHIN: Duration = Duration::from_millis(400);
/// The status bit of an encoder that does not work: a position is then none.
const NO_POSITION: u8 = 2;

/// A joint and its servo.
#[derive(Clone, Debug)]
pub(crate) struct Joint {
    pub(crate) setting: JointSetting,
    pub(crate) direction: Direction,
    pub(crate) settings: Settings,
}

impl Joint {
    /// As a message calls it.
    fn in_words(&self) -> String {
        format!("{} (servo {})", self.setting.name, self.setting.servo)
    }
}

/// The servos.
#[derive(Debug)]
pub(crate) struct Servos {
    pub(crate) bus: Bus,
    pub(crate) joints: Vec<Joint>,
    port: String,
    baud: u32,
}

impl Servos {
    /// Opens the bus and reads how each servo is set. Nothing moves.
    pub(crate) fn open(configuration: &Configuration) -> Result<Self, PluginError> {
        let Configuration { port, baud, reply_within, .. } = configuration;
        let bus = Bus::open(port, *baud, *reply_within)
            .map_err(|error| PluginError::Disconnected(error.to_string()))?;
        let unread = Settings {
            model: 0,
            homing_offset: 0,
            lowest_goal: 0,
            highest_goal: 0,
            operating_mode: 0,
            steps_a_unit: 1,
        };
        let joint = |setting: &JointSetting| Joint {
            setting: setting.clone(),
            direction: Direction::of(setting.reversed),
            settings: unread,
        };
        let joints = configuration.joints.iter().map(joint).collect();
        let mut servos = Self { bus, joints, port: port.clone(), baud: *baud };
        // All at once first: who does not answer is then named with the others.
        servos.states()?;
        for index in 0..servos.joints.len() {
            servos.read_settings(index)?;
        }
        Ok(servos)
    }

    fn read_settings(&mut self, index: usize) -> Result<(), PluginError> {
        let Some(joint) = self.joints.get(index) else { return Ok(()) };
        let servo = joint.setting.servo;
        let settings = Settings::read(&mut self.bus, servo).map_err(|error| self.plugin_error(error))?;
        let Some(joint) = self.joints.get_mut(index) else { return Ok(()) };
        joint.settings = settings;
        match settings.objection() {
            None => Ok(()),
            Some(why) => Err(PluginError::Refused(format!("{}: {why}", joint.in_words()))),
        }
    }

    /// Takes the directions that a calibration file keeps; the homing offsets must be those it was written with.
    pub(crate) fn follow(&mut self, calibration: &Calibration) -> Result<(), PluginError> {
        for joint in &mut self.joints {
            let Some(kept) = calibration.get(&joint.setting.name) else { continue };
            let name = &joint.setting.name;
            if kept.id != joint.setting.servo {
                return Err(PluginError::Refused(format!(
                    "{name} has servo {} in the cell file and {} in the calibration file; one of them belongs to another arm",
                    joint.setting.servo, kept.id
                )));
            }
            if kept.homing_offset != joint.settings.homing_offset {
                return Err(PluginError::Refused(format!(
                    "{name}: the servo's homing offset is {}, and {} when it was calibrated: it was exchanged, or another program has calibrated it since. \
                     Put the calibration file away and calibrate the arm anew",
                    joint.settings.homing_offset, kept.homing_offset
                )));
            }
            joint.direction = Direction::of(kept.drive_mode == 1);
        }
        Ok(())
    }

    /// Every servo's number.
    fn numbers(&self) -> Vec<u8> {
        self.joints.iter().map(|joint| joint.setting.servo).collect()
    }

    /// Every servo's state now, joint by joint.
    pub(crate) fn states(&mut self) -> Result<Vec<ServoState>, PluginError> {
        let numbers = self.numbers();
        let answers = self
            .bus
            .read_all(&numbers, STATE.address, STATE_LENGTH)
            .map_err(|error| self.plugin_error(error))?;
        let mut states = Vec::with_capacity(numbers.len());
        for (joint, number) in self.joints.iter().zip(&numbers) {
            let answer = answers.iter().find(|answer| answer.servo == *number);
            let state = answer.and_then(|answer| ServoState::of_block(answer.status, &answer.data));
            let state = state.ok_or_else(|| {
                PluginError::Failed(format!("{}: its state cannot be read", joint.in_words()))
            })?;
            if state.status & NO_POSITION != 0 {
                let why = state.fault().unwrap_or_default();
                return Err(PluginError::Failed(format!(
                    "{}: {why}; its position is not known",
                    joint.in_words()
                )));
            }
            states.push(state);
        }
        Ok(states)
    }

    /// The states of an arm at rest: read until two readings agree. The second value says whether it still moves (it is turned by hand, or sinks).
    pub(crate) fn resting(&mut self) -> Result<(Vec<ServoState>, bool), PluginError> {
        let mut former = self.states()?;
        for _ in 1..READINGS {
            let now = self.states()?;
            let at_rest = now.iter().zip(&former).all(|(now, former)| {
                !now.moving && !former.moving && (now.position - former.position).abs() <= ALIKE
            });
            if at_rest {
                return Ok((now, false));
            }
            former = now;
            sleep(LOOK);
        }
        Ok((former, true))
    }

    /// The first servo with a fault, in words.
    pub(crate) fn fault(&self, states: &[ServoState]) -> Option<String> {
        let of = |(joint, state): (&Joint, &ServoState)| {
            state.fault().map(|fault| format!("{}: {fault} ({})", joint.in_words(), state.in_words()))
        };
        self.joints.iter().zip(states).find_map(of)
    }

    /// Sends goals to several servos at once, until each has its own.
    pub(crate) fn send(&mut self, goals: &[Goal], acceleration: u8) -> Result<(), PluginError> {
        let blocks: Vec<(u8, Vec<u8>)> = goals
            .iter()
            .map(|goal| {
                let joint = self.joints.iter().find(|joint| joint.setting.servo == goal.servo);
                let steps_a_unit = joint.map_or(1, |joint| joint.settings.steps_a_unit);
                (goal.servo, goal.block(acceleration, steps_a_unit))
            })
            .collect();
        let requested: Vec<(u8, i32)> = goals.iter().map(|goal| (goal.servo, goal.step)).collect();
        self.write_until_taken(ACCELERATION.address, 7, &blocks, &requested)
    }

    /// Has servos hold where they are now. One that does not say where it is holds where it was `seen` last. Waits until they are at rest.
    pub(crate) fn hold(&mut self, joints: &[usize], seen: &[ServoState]) -> Result<(), PluginError> {
        let mut requested = Vec::new();
        let mut silent = None;
        for joint_index in joints {
            let Some(servo) = self.joints.get(*joint_index).map(|joint| joint.setting.servo) else {
                continue;
            };
            let read = self.bus.read_block(servo, STATE.address, STATE_LENGTH);
            let now = match read {
                Ok(answer) => ServoState::of_block(answer.status, &answer.data),
                Err(error) => {
                    silent.get_or_insert(error);
                    None
                }
            };
            if let Some(state) = now.or_else(|| seen.get(*joint_index).copied()) {
                requested.push((servo, state.position.clamp(0, STEPS_A_TURN - 1)));
            }
        }
        let block = |(servo, step): &(u8, i32)| {
            (*servo, u16::try_from(*step).unwrap_or_default().to_le_bytes().to_vec())
        };
        let blocks: Vec<_> = requested.iter().map(block).collect();
        let held = self.write_until_taken(GOAL.address, GOAL.length, &blocks, &requested);
        if let Some(error) = silent {
            return Err(self.plugin_error(error));
        }
        held?;
        let begin = Instant::now();
        while self.states()?.iter().any(|state| state.moving) {
            if begin.elapsed() > HELD_WITHIN {
                return Err(PluginError::TimedOut(
                    "the servos were told to hold and still move: cut their power".to_owned(),
                ));
            }
            sleep(LOOK);
        }
        Ok(())
    }

    /// Writes blocks to several servos at once, until each servo's goal is what was `wanted`.
    fn write_until_taken(
        &mut self,
        address: u8,
        length: u8,
        blocks: &[(u8, Vec<u8>)],
        requested: &[(u8, i32)],
    ) -> Result<(), PluginError> {
        if requested.is_empty() {
            return Ok(());
        }
        let servos: Vec<u8> = requested.iter().map(|(servo, _)| *servo).collect();
        let mut missing = Vec::new();
        for _ in 0..SENDINGS {
            self.bus.write_all(address, length, blocks).map_err(|error| self.plugin_error(error))?;
            let answers = self
                .bus
                .read_all(&servos, GOAL.address, GOAL.length)
                .map_err(|error| self.plugin_error(error))?;
            let has = |(servo, step): &(u8, i32)| {
                let bytes = u16::try_from(*step).unwrap_or_default().to_le_bytes();
                answers.iter().any(|answer| answer.servo == *servo && answer.data == bytes)
            };
            missing = requested.iter().filter(|requested| !has(requested)).map(|(servo, _)| *servo).collect();
            if missing.is_empty() {
                return Ok(());
            }
        }
        Err(PluginError::Failed(format!(
            "{} did not take the goal that was sent {SENDINGS} times: check the bus cable",
            self.named(&missing)
        )))
    }

    /// Switches the torque of every servo. Before it is switched on each is commanded to hold where it is: an old goal would make it leap.
    pub(crate) fn switch_torque(&mut self, on: bool) -> Result<(), PluginError> {
        let states = self.states()?;
        for (index, state) in states.iter().enumerate() {
            let Some(servo) = self.joints.get(index).map(|joint| joint.setting.servo) else { continue };
            let here = u16::try_from(state.position.clamp(0, STEPS_A_TURN - 1)).unwrap_or_default();
            let switched = match on {
                true => self.bus.read(servo, TORQUE).and_then(|is_on| match is_on {
                    1 => Ok(()),
                    _ => self.bus.write(servo, GOAL, here).and_then(|()| self.bus.write(servo, TORQUE, 1)),
                }),
                false => self.bus.write(servo, TORQUE, 0),
            };
            switched.map_err(|error| self.plugin_error(error))?;
        }
        Ok(())
    }

    /// Has a joint's servo call the position where it is `step` from now on.
    pub(crate) fn take_for(&mut self, index: usize, step: i32) -> Result<(), PluginError> {
        let Some(servo) = self.joints.get(index).map(|joint| joint.setting.servo) else { return Ok(()) };
        let taken = take_for(&mut self.bus, servo, step).map_err(|error| self.plugin_error(error))?;
        let Some(joint) = self.joints.get_mut(index) else { return Ok(()) };
        match taken {
            Some(offset) => joint.settings.homing_offset = offset,
            None => {
                return Err(PluginError::Refused(format!(
                    "{}: its zero would lie half a turn from the middle of what it counts, which its register cannot hold: turn its horn by one tooth",
                    joint.in_words()
                )));
            }
        }
        Ok(())
    }

    fn named(&self, servos: &[u8]) -> String {
        let joints = self.joints.iter().filter(|joint| servos.contains(&joint.setting.servo));
        joints.map(Joint::in_words).collect::<Vec<_>>().join(", ")
    }

    /// What went wrong on the bus, in the operator's words.
    fn plugin_error(&self, error: BusError) -> PluginError {
        let BusError::Silent { servos, damaged } = error else {
            return PluginError::Disconnected(format!("{}: {error}", self.port));
        };
        let damage = match damaged {
            0 => String::new(),
            count => format!(" ({count} damaged answers came: check cables and plugs)"),
        };
        PluginError::Disconnected(match servos.len() {
            all if all == self.joints.len() && all > 1 => format!(
                "none of the {all} servos answers on {} at {} baud{damage}: is the arm's power supply on, and the bus cable in the adapter?",
                self.port, self.baud
            ),
            1 => format!(
                "{} does not answer{damage}: look at its plug and at those before it; has it this number?",
                self.named(&servos)
            ),
            _ => format!(
                "{} do not answer{damage}: look at the plug of the first of them",
                self.named(&servos)
            ),
        })
    }
}
