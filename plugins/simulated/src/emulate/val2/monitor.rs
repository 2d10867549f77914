//! The monitor: what it makes of each character, and what it says.

use std::collections::BTreeMap;

use super::arm::{ArmError, DrivenArm, Ended};
use super::dialect::{ControllerError, Dialect};
use super::event::Event;
use super::format::{columns, joint_heading, joints, transformation, unfolded, where_heading};
use super::words::{Command, changes, parse};
use crate::arm::puma560::JOINTS;

/// The longest line that is taken.
const LONGEST_LINE: usize = 80;
/// How far POTCAL drives each joint to find the index pulses beside it, deg.
const POTCAL_TURN_DEG: f64 = 6.0;

const CONTROL_C: u8 = 3;

/// What the monitor is about.
#[derive(Debug, Clone, PartialEq)]
enum Mode {
    /// A command is being typed.
    Command,
    /// Changes of a point are being typed: its name and its values, deg.
    Changes(String, [f64; 6]),
    /// It has asked whether somebody is sure.
    Sure(Confirmed),
    /// The arm moves.
    Moving,
    /// All joints are driven to their next index pulses.
    Calibrating,
    /// A joint (from 0) is driven to and fro; true on the way back.
    PotCal(usize, bool),
    /// A user's program runs, which moves nothing.
    Program,
}

/// A command that is asked about once more before it is done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Confirmed {
    Calibrate,
    PotCal,
    /// To end the program that runs.
    Abort,
}

/// The monitor of one controller.
#[derive(Debug)]
pub(super) struct Monitor {
    dialect: Dialect,
    arm: DrivenArm,
    mode: Mode,
    line: Vec<u8>,
    points: BTreeMap<String, [f64; 6]>,
    /// Percent.
    speed: f64,
    power: bool,
    calibrated: bool,
    output: Vec<u8>,
}

impl Monitor {
    pub(super) fn new(dialect: Dialect, arm: DrivenArm) -> Self {
        Self {
            dialect,
            arm,
            mode: Mode::Command,
            line: Vec::new(),
            points: BTreeMap::new(),
            speed: 100.0,
            power: true,
            calibrated: true,
            output: Vec::new(),
        }
    }

    /// What it has had to say since this was asked last.
    pub(super) fn take_said(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.output)
    }

    /// Whether the arm is moved.
    pub(super) fn is_moving(&self) -> bool {
        matches!(self.mode, Mode::Moving | Mode::Calibrating | Mode::PotCal(..))
    }

    /// Whether characters are taken now; where the arm moves without a prompt, only a control C is.
    pub(super) fn listens_to(&self, byte: u8) -> bool {
        byte == CONTROL_C || !self.is_moving() || self.dialect.busy_prompt().is_some()
    }

    /// Takes one character.
    pub(super) fn hear(&mut self, byte: u8) -> Result<(), ArmError> {
        match byte {
            CONTROL_C => self.cancel(),
            b'\r' => {
                self.newline();
                let line = String::from_utf8_lossy(&std::mem::take(&mut self.line)).into_owned();
                self.take_line(&line)
            }
            0x08 | 0x7f => {
                if self.line.pop().is_some() {
                    self.output.extend_from_slice(b"\x08 \x08");
                }
                Ok(())
            }
            b' '..=b'~' if self.line.len() < LONGEST_LINE => {
                self.output.push(self.dialect.echo(byte));
                self.line.push(byte);
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Looks whether the arm has arrived.
    pub(super) fn look(&mut self) -> Result<(), ArmError> {
        if !self.is_moving() {
            return Ok(());
        }
        let Some(ended) = self.arm.ended()? else { return Ok(()) };
        match (self.mode.clone(), ended) {
            (Mode::PotCal(joint, false), Ended::Arrived) => self.drive_for_potcal(joint, true),
            (Mode::PotCal(joint, true), Ended::Arrived) if joint + 1 < JOINTS.len() => {
                self.drive_for_potcal(joint + 1, false)
            }
            (Mode::PotCal(..), Ended::Arrived) => {
                self.arm.define(JOINTS.map(|joint| joint.ready_deg))?;
                self.say_line("POTCAL.DAT written; zero references are those of the ready position");
                self.calibrated = true;
                self.back_to_commands();
                Ok(())
            }
            (mode, Ended::Arrived) => {
                self.calibrated |= mode == Mode::Calibrating;
                self.back_to_commands();
                Ok(())
            }
            (_, Ended::CutShort) => self.end_with(ControllerError::Aborted),
            (_, Ended::Refused) => self.end_with(ControllerError::JointRange(1)),
        }
    }

    /// Something happens on the panel.
    pub(super) fn happen(&mut self, event: &Event) -> Result<(), ArmError> {
        let error = match event {
            Event::Program => {
                self.halt()?;
                self.line.clear();
                self.newline();
                self.go_on_with_program();
                return Ok(());
            }
            Event::Power(true) => {
                self.power = true;
                return Ok(());
            }
            Event::Power(false) => ControllerError::PowerOff,
            Event::Panic => ControllerError::Panic,
            Event::Envelope(joint) => ControllerError::Envelope(*joint),
            Event::Reboot => {
                self.halt()?;
                self.reboot();
                return Ok(());
            }
            _ => return Ok(()),
        };
        self.power = false;
        let was_moving = self.is_moving();
        self.halt()?;
        self.line.clear();
        self.newline();
        let text = self.dialect.text(error);
        self.say_line(&text);
        if was_moving || self.mode == Mode::Command {
            self.back_to_commands();
        }
        Ok(())
    }

    /// It starts anew: points, speed and calibration are lost, arm power is off.
    fn reboot(&mut self) {
        self.line.clear();
        self.points.clear();
        self.speed = 100.0;
        self.power = false;
        self.calibrated = false;
        self.output.extend_from_slice(b"\r\n");
        self.output.extend_from_slice(self.dialect.greeting().as_bytes());
        self.back_to_commands();
    }

    /// Stops the arm and waits for it to come to rest.
    fn halt(&mut self) -> Result<(), ArmError> {
        if self.is_moving() {
            self.arm.stop()?;
            while self.arm.ended()?.is_none() {
                std::thread::sleep(std::time::Duration::from_millis(1));
            }
        }
        Ok(())
    }

    fn cancel(&mut self) -> Result<(), ArmError> {
        let was_moving = self.is_moving();
        self.halt()?;
        self.line.clear();
        self.newline();
        if was_moving {
            return self.end_with(ControllerError::Aborted);
        }
        if matches!(self.mode, Mode::Program | Mode::Sure(Confirmed::Abort)) {
            // A control C cancels what is typed; the program goes on.
            self.go_on_with_program();
            return Ok(());
        }
        self.back_to_commands();
        Ok(())
    }

    fn take_line(&mut self, line: &str) -> Result<(), ArmError> {
        match self.mode.clone() {
            Mode::Command => match parse(line) {
                Ok(command) => self.carry_out(command),
                Err(error) => self.end_with(error),
            },
            Mode::Changes(name, values) => self.change(name, values, line),
            Mode::Sure(confirmed) => self.dare(confirmed, line),
            Mode::Program => {
                match parse(line) {
                    Ok(Command::Abort) => {
                        self.mode = Mode::Sure(Confirmed::Abort);
                        self.output.extend_from_slice(self.dialect.sure().as_bytes());
                        return Ok(());
                    }
                    Ok(Command::Nothing) => {}
                    Ok(Command::Where) => self.show_where()?,
                    _ => {
                        let text = self.dialect.text(ControllerError::NotNow);
                        self.say_line(&text);
                    }
                }
                self.go_on_with_program();
                Ok(())
            }
            Mode::Moving | Mode::Calibrating | Mode::PotCal(..) => match parse(line) {
                Ok(Command::Abort) => {
                    self.halt()?;
                    self.end_with(ControllerError::Aborted)
                }
                Ok(Command::Nothing) => {
                    self.busy_prompt();
                    Ok(())
                }
                Ok(Command::Where) => {
                    self.show_where()?;
                    self.busy_prompt();
                    Ok(())
                }
                Ok(_) => self.complain_while_busy(ControllerError::NotNow),
                Err(error) => self.complain_while_busy(error),
            },
        }
    }

    fn carry_out(&mut self, command: Command) -> Result<(), ArmError> {
        match command {
            Command::Nothing | Command::Abort | Command::Configuration => {}
            Command::Where => self.show_where()?,
            Command::Here(name) => {
                let (degrees, _) = self.arm.read()?;
                self.points.insert(name.clone(), degrees);
                self.ask_for_changes(name, degrees);
                return Ok(());
            }
            Command::Point(name) => {
                let values = match self.points.get(&name) {
                    Some(values) => *values,
                    None => self.arm.read()?.0,
                };
                self.ask_for_changes(name, values);
                return Ok(());
            }
            Command::Speed(percent) => match percent {
                Some(percent) => self.speed = percent,
                None => {
                    let shown = format!("{:.2} percent", self.speed);
                    self.say_line(&shown);
                }
            },
            Command::Calibrate => return self.ask_whether_sure(Confirmed::Calibrate),
            Command::Execute(program) if program == "POTCAL" => {
                return self.ask_whether_sure(Confirmed::PotCal);
            }
            Command::Execute(_) => return self.end_with(ControllerError::NoProgram),
            Command::Set(name, angles) => {
                self.points.insert(name, angles);
            }
            Command::Move(name) => {
                let Some(values) = self.points.get(&name).copied() else {
                    return self.end_with(ControllerError::Undefined);
                };
                return self.go(values.map(Some), false, self.speed);
            }
            Command::Drive(joint, degrees, percent) => {
                let mut by = [None; 6];
                if let Some(by) = by.get_mut(joint - 1) {
                    *by = Some(degrees);
                }
                return self.go(by, true, percent);
            }
            Command::Ready => return self.go(JOINTS.map(|joint| Some(joint.ready_deg)), false, self.speed),
        }
        self.back_to_commands();
        Ok(())
    }

    /// Starts a motion, if it may be made.
    fn go(&mut self, joints: [Option<f64>; 6], relative: bool, percent: f64) -> Result<(), ArmError> {
        if !self.power {
            return self.end_with(ControllerError::PowerOff);
        }
        if !self.calibrated {
            return self.end_with(ControllerError::NotCalibrated);
        }
        let (here, _) = self.arm.read()?;
        for (index, (joint, facts)) in joints.iter().zip(&JOINTS).enumerate() {
            let here = here.get(index).copied().unwrap_or_default();
            let target = joint.map_or(here, |value| if relative { here + value } else { value });
            let [lower, upper] = facts.limits_deg;
            // An arm left a little beyond its range by a servo may stay there, or come back.
            let slack = (lower - here).max(here - upper).max(0.005);
            if target < lower - slack || target > upper + slack {
                return self.end_with(ControllerError::JointRange(index + 1));
            }
        }
        self.arm.start(joints, relative, percent / 100.0)?;
        self.mode = Mode::Moving;
        self.busy_prompt();
        Ok(())
    }

    fn ask_whether_sure(&mut self, confirmed: Confirmed) -> Result<(), ArmError> {
        if !self.power {
            return self.end_with(ControllerError::PowerOff);
        }
        self.mode = Mode::Sure(confirmed);
        self.output.extend_from_slice(self.dialect.sure().as_bytes());
        Ok(())
    }

    fn dare(&mut self, confirmed: Confirmed, line: &str) -> Result<(), ArmError> {
        let is_sure = line.trim().eq_ignore_ascii_case("y");
        match confirmed {
            Confirmed::Abort if !is_sure => {
                self.go_on_with_program();
                Ok(())
            }
            _ if !is_sure => {
                self.back_to_commands();
                Ok(())
            }
            Confirmed::Abort => {
                self.say_line("Program task 0 stopped");
                self.back_to_commands();
                Ok(())
            }
            Confirmed::Calibrate => self.find_index_pulses(),
            Confirmed::PotCal => {
                let (here, _) = self.arm.read()?;
                let off =
                    here.iter().zip(&JOINTS).position(|(here, joint)| (here - joint.ready_deg).abs() > 15.0);
                if let Some(joint) = off {
                    return self.end_with(ControllerError::JointRange(joint + 1));
                }
                self.drive_for_potcal(0, false)
            }
        }
    }

    /// The potentiometers say within which turn of its motor each joint is; where exactly, the index pulse says that comes next on the way
    /// to the ready position. All joints go there together.
    fn find_index_pulses(&mut self) -> Result<(), ArmError> {
        let (here, _) = self.arm.read()?;
        let mut by = [None; 6];
        for ((by, here), joint) in by.iter_mut().zip(here).zip(&JOINTS) {
            *by = Some(to_index_pulse(here - joint.ready_deg, joint.index_spacing_deg()));
        }
        self.mode = Mode::Calibrating;
        self.arm.start(by, true, 0.1)
    }

    fn drive_for_potcal(&mut self, joint: usize, back: bool) -> Result<(), ArmError> {
        if !back {
            let text = format!("Joint {}", joint + 1);
            self.say_line(&text);
        }
        let mut by = [None; 6];
        if let Some(by) = by.get_mut(joint) {
            *by = Some(if back { -POTCAL_TURN_DEG } else { POTCAL_TURN_DEG });
        }
        self.mode = Mode::PotCal(joint, back);
        self.arm.start(by, true, 0.2)
    }

    fn ask_for_changes(&mut self, name: String, values: [f64; 6]) {
        self.say_line(joint_heading(self.dialect));
        let shown = joints(self.dialect, &values);
        // A point has no hand.
        let shown = if self.dialect == Dialect::Late { columns(self.dialect, &values) } else { shown };
        self.say_line(&shown);
        self.output.extend_from_slice(self.dialect.changes().as_bytes());
        self.mode = Mode::Changes(name, values);
    }

    fn change(&mut self, name: String, mut values: [f64; 6], line: &str) -> Result<(), ArmError> {
        if line.trim().is_empty() {
            self.points.insert(name, values);
            self.back_to_commands();
            return Ok(());
        }
        let (here, _) = self.arm.read()?;
        match changes(line) {
            Err(error) => {
                let text = self.dialect.text(error);
                self.say_line(&text);
            }
            Ok(typed) => {
                for (index, value) in typed.into_iter().enumerate() {
                    let (Some(value), Some(kept)) = (value, values.get_mut(index)) else { continue };
                    let here = here.get(index).copied().unwrap_or_default();
                    match unfolded(index, value, here) {
                        Some(value) => *kept = value,
                        None => {
                            let text = self.dialect.text(ControllerError::JointRange(index + 1));
                            self.say_line(&text);
                        }
                    }
                }
            }
        }
        self.ask_for_changes(name, values);
        Ok(())
    }

    fn show_where(&mut self) -> Result<(), ArmError> {
        let (degrees, _) = self.arm.read()?;
        let pose = transformation(&self.arm.base_from_flange(&degrees));
        self.say_line(where_heading(self.dialect));
        let (first, second) = (columns(self.dialect, &pose), joints(self.dialect, &degrees));
        self.say_line(&first);
        self.say_line(&second);
        Ok(())
    }

    fn end_with(&mut self, error: ControllerError) -> Result<(), ArmError> {
        let text = self.dialect.text(error);
        self.say_line(&text);
        self.back_to_commands();
        Ok(())
    }

    fn complain_while_busy(&mut self, error: ControllerError) -> Result<(), ArmError> {
        let text = self.dialect.text(error);
        self.say_line(&text);
        self.busy_prompt();
        Ok(())
    }

    fn back_to_commands(&mut self) {
        // Anyone who was typing behind a `*` finds a new line.
        if self.is_moving() && self.dialect.busy_prompt().is_some() {
            self.line.clear();
            self.newline();
        }
        self.mode = Mode::Command;
        self.output.extend_from_slice(self.dialect.prompt().as_bytes());
    }

    /// A program runs: every monitor shows that by a `*`.
    fn go_on_with_program(&mut self) {
        self.mode = Mode::Program;
        self.output.extend_from_slice(self.dialect.busy_prompt().unwrap_or("*").as_bytes());
    }

    fn busy_prompt(&mut self) {
        if let Some(prompt) = self.dialect.busy_prompt() {
            self.output.extend_from_slice(prompt.as_bytes());
        }
    }

    fn newline(&mut self) {
        self.output.extend_from_slice(self.dialect.newline().as_bytes());
    }

    fn say_line(&mut self, text: &str) {
        self.output.extend_from_slice(text.as_bytes());
        self.newline();
    }
}
/// How far a joint that is so far from the ready position turns toward it to the next pulse, deg; away from it where it is there.
fn to_index_pulse(from_ready: f64, spacing: f64) -> f64 {
    let turns = from_ready / spacing;
    let next = if turns > 0.0 { (turns - 1e-6).floor() } else { (turns + 1e-6).ceil() };
    let by = next * spacing - from_ready;
    if by.abs() < 1e-9 { spacing } else { by }
}

#[cfg(test)]
mod tests {
    use super::to_index_pulse;

    #[test]
    fn a_joint_turns_toward_the_ready_position_and_by_less_than_a_turn_of_its_motor() {
        for (from_ready, by) in [(1.0, -1.0), (7.0, -1.5), (-1.0, 1.0), (-6.0, 0.5), (0.0, 5.5)] {
            assert!((to_index_pulse(from_ready, 5.5) - by).abs() < 1e-9, "{from_ready}");
        }
    }
}
