//! One client of the world, from its hello to its going away.

use std::io;
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::time::{Duration, Instant};

use serde::de::DeserializeOwned;

use super::shared::{Order, Shared, State};
use crate::joint_values::JointValues;
use crate::lines::{Lines, Received};
use crate::physics::rigid::Vector;
use crate::protocol::{
    Answer, Axis, Call, Hello, Instrument, PIXELS_A_LINE, PROTOCOL, Pace, Reading, Response, SomeJoints,
    WorldCommand,
};
use crate::served_world::{Exposure, MotionRequest, Use};

/// How often a client that says nothing is asked whether the world ends.
const LISTEN: Duration = Duration::from_millis(100);

/// How often a motion in real time is looked at.
const SLICE: Duration = Duration::from_millis(4);

/// World time between two reports of the joints on the way, ns.
const REPORT_NS: u64 = 15_000_000;

/// The longest a client may let time pass in one call, ms.
const LONGEST_WAIT_MS: u64 = 3_600_000;

/// How often an operator goes again for an attitude that play left short.
const MOST_CORRECTIONS: usize = 12;

/// One client.
pub(super) struct Session {
    shared: Arc<Shared>,
    lines: Lines,
    /// The latest change of the input lines the client knows of.
    reported: u64,
}

/// The client has gone, or speaks so that it is left alone.
struct Gone;

impl From<io::Error> for Gone {
    fn from(_: io::Error) -> Gone {
        Gone
    }
}

/// How a motion ended.
enum Ended {
    /// The arm arrived.
    Arrived,
    /// It was stopped on its way.
    CutShort,
}

/// Serves one client until it goes or the world ends.
pub(super) fn serve(shared: Arc<Shared>, stream: UnixStream) {
    shared.now().client_came();
    if let Ok(lines) = Lines::over(stream) {
        let reported = shared.now().latest_change();
        let mut session = Session { shared: Arc::clone(&shared), lines, reported };
        // A client that has gone is no error of the world's.
        let _ = session.run();
    }
    shared.now().client_went();
}

impl Session {
    fn run(&mut self) -> Result<(), Gone> {
        self.greet()?;
        loop {
            let line = self.listen()?;
            match read_line::<Call>(&line) {
                Ok(call) => self.answer(call)?,
                Err(why) => self.respond(0, Response::Refused { why })?,
            }
            if self.shared.is_ending() {
                return Ok(());
            }
        }
    }

    fn greet(&mut self) -> Result<(), Gone> {
        let line = self.listen()?;
        let refusal = match read_line::<Hello>(&line) {
            Ok(hello) if hello.protocol == PROTOCOL => {
                let welcome = self.shared.now().welcome();
                return Ok(self.lines.send(&welcome)?);
            }
            Ok(hello) => format!(
                "`{}` speaks version {} of the world's protocol, this world version {PROTOCOL}: build both from the same \
                 source",
                hello.client, hello.protocol
            ),
            Err(why) => {
                format!("a client begins with {{\"protocol\":{PROTOCOL},\"client\":\"NAME\"}}: {why}")
            }
        };
        self.respond(0, Response::Refused { why: refusal })?;
        Err(Gone)
    }

    /// The client's next line.
    fn listen(&mut self) -> Result<Vec<u8>, Gone> {
        loop {
            match self.lines.receive(LISTEN)? {
                Received::Line(line) => return Ok(line),
                Received::Closed => return Err(Gone),
                Received::Nothing if self.shared.is_ending() => return Err(Gone),
                Received::Nothing => {}
            }
        }
    }

    fn answer(&mut self, Call { id, command }: Call) -> Result<(), Gone> {
        match command {
            WorldCommand::Move { joints, relative, speed } => {
                self.answer_motion(id, &Order::Joints(MotionRequest { joints, relative, speed }))
            }
            WorldCommand::Follow { joints, ms } => self.change(id, |state| state.follow(&joints, ms)),
            WorldCommand::Step { half_steps, rate } => self.answer_half_steps(id, half_steps, rate),
            WorldCommand::Place { joints } => self.answer_place(id, &joints),
            WorldCommand::RestOnGauge { height_mm } => {
                let resting = self.shared.now().switch().map(|switch| switch.attitudes_at_height(height_mm));
                self.answer_operator(id, resting, "the shoulder cannot bring the hand to that height")
            }
            WorldCommand::PlaceHand { x_mm, y_mm, z_mm } => {
                let point = Vector { x: x_mm, y: y_mm, z: z_mm };
                let there = self.shared.now().switch().map(|switch| switch.attitudes_over(&point));
                self.answer_operator(id, there, "the arm does not reach that point")
            }
            WorldCommand::Wait { ms } => self.answer_wait(id, ms),
            WorldCommand::Read {} => self.finish(id, false),
            WorldCommand::Stop {} => self.act(id, |state| state.halt()),
            WorldCommand::Outputs { bits } => self.act(id, |state| state.world.set_outputs(bits)),
            WorldCommand::SetZero { joints } => self.change(id, |state| state.world.set_registers(&joints)),
            WorldCommand::Pendant { on } => self.act(id, |state| state.hand_over(on)),
            WorldCommand::Key { key } => self.act(id, |state| state.press(key)),
            WorldCommand::Pace { pace } => self.act(id, |state| state.set_pace(pace)),
            WorldCommand::TrimToFire {} => self.change(id, |state| state.switch()?.trim_to_fire()),
            WorldCommand::Again { seed } => self.change(id, |state| state.begin_again(seed)),
            WorldCommand::Trim { by } => self.change(id, |state| state.switch()?.turn_trim(by)),
            WorldCommand::Hold { width_mm } => {
                self.change(id, |state| state.fingers()?.put_between_fingers(width_mm))
            }
            WorldCommand::Measure { with, at, turned, axis } => {
                let used = Use { with, at: at.as_deref(), turned, axis, rising: None };
                self.answer_with(id, |state| measure(state, &used))
            }
            WorldCommand::Hang { mass_kg } => self.change(id, |state| state.world.hang(mass_kg)),
            WorldCommand::ReadPoint { axis, ahead_mm } => {
                self.answer_with(id, |state| read_point(state, axis, ahead_mm))
            }
            WorldCommand::ReadProfile { of, point, axis } => {
                self.answer_with(id, |state| read_profile(state, &of, point as usize, axis))
            }
            WorldCommand::Level { joint, at, turned, rising } => {
                let used = Use { with: Instrument::Level, at: Some(&at), turned, axis: None, rising };
                self.answer_level(id, &joint, &used)
            }
            WorldCommand::Look {} => self.answer_with(id, |state| look(state)),
            WorldCommand::Shine { laser, filter } => self.change(id, |state| state.shine(laser, filter)),
            WorldCommand::Shutter { every_ms } => self.change(id, |state| state.set_shutter(every_ms)),
            WorldCommand::Expose {} => self.answer_expose(id),
            WorldCommand::Reveal {} => {
                self.answer_with(id, |state| Response::Revealed { text: state.reveal() })
            }
            WorldCommand::Shutdown {} => {
                self.shared.end();
                self.respond(id, Response::Done {})
            }
        }
    }

    /// Does something that cannot be refused, and ends the call with what the controller knows then.
    fn act(&mut self, id: u64, act: impl FnOnce(&mut State)) -> Result<(), Gone> {
        act(&mut self.shared.now());
        self.finish(id, false)
    }

    /// Changes something, and ends the call with what the controller knows then.
    fn change(&mut self, id: u64, change: impl FnOnce(&mut State) -> Result<(), String>) -> Result<(), Gone> {
        let changed = change(&mut self.shared.now());
        match changed {
            Ok(()) => self.finish(id, false),
            Err(why) => self.respond(id, Response::Refused { why }),
        }
    }

    /// Ends the call with what is found out.
    fn answer_with(&mut self, id: u64, find_out: impl FnOnce(&mut State) -> Response) -> Result<(), Gone> {
        let found = find_out(&mut self.shared.now());
        self.respond(id, found)
    }

    fn answer_half_steps(&mut self, id: u64, half_steps: JointValues, rate: f64) -> Result<(), Gone> {
        self.answer_motion(id, &Order::HalfSteps(half_steps, rate))
    }

    fn answer_motion(&mut self, id: u64, order: &Order) -> Result<(), Gone> {
        match self.make_motion(id, order)? {
            Ok(ended) => self.finish(id, matches!(ended, Ended::CutShort)),
            Err(why) => self.respond(id, Response::Refused { why }),
        }
    }

    /// The operator drives where he wants to be, if there is a way.
    fn answer_operator(
        &mut self,
        id: u64,
        attitudes: Result<Option<SomeJoints>, String>,
        why_not: &str,
    ) -> Result<(), Gone> {
        match attitudes {
            Ok(Some(attitudes)) => self.answer_place(id, &attitudes),
            Ok(None) => self.respond(id, Response::Refused { why: why_not.to_owned() }),
            Err(why) => self.respond(id, Response::Refused { why }),
        }
    }

    /// The operator looks, drives, and looks again.
    fn answer_place(&mut self, id: u64, attitudes: &[Option<f64>]) -> Result<(), Gone> {
        for _ in 0..MOST_CORRECTIONS {
            let order = self.shared.now().world.request_toward(attitudes);
            match self.make_motion(id, &Order::Joints(order))? {
                Ok(Ended::Arrived) => {}
                Ok(Ended::CutShort) => return self.finish(id, true),
                Err(why) => return self.respond(id, Response::Refused { why }),
            }
            if self.shared.now().world.is_at(attitudes) {
                return self.finish(id, false);
            }
        }
        let touching = self.shared.now().world.truth().is_ok_and(|truth| truth.touching);
        let held = if touching { "; it touches something solid" } else { "" };
        let why = format!("the operator cannot bring the arm there{held}");
        self.respond(id, Response::Refused { why })
    }

    /// The operator looks at the bubble, turns the joint, and looks again.
    fn answer_level(&mut self, id: u64, joint: &str, used: &Use<'_>) -> Result<(), Gone> {
        for _ in 0..MOST_CORRECTIONS {
            let order =
                self.shared.now().levelled_joints().and_then(|joints| joints.level_request(joint, used));
            match order {
                Ok(None) => return self.finish(id, false),
                Ok(Some(order)) => match self.make_motion(id, &Order::Joints(order))? {
                    Ok(Ended::Arrived) => {}
                    Ok(Ended::CutShort) => return self.finish(id, true),
                    Err(why) => return self.respond(id, Response::Refused { why }),
                },
                Err(why) => return self.respond(id, Response::Refused { why }),
            }
        }
        let why = format!("the operator cannot bring the bubble to the middle with `{joint}`");
        self.respond(id, Response::Refused { why })
    }

    /// Takes a picture. The world goes on while it is made and sent.
    fn answer_expose(&mut self, id: u64) -> Result<(), Gone> {
        let exposure = self.shared.now().expose();
        let exposure = match exposure {
            Ok(exposure) => exposure,
            Err(why) => return self.respond(id, Response::Refused { why }),
        };
        let picture = exposure.light.picture(&exposure.world_from_flange, exposure.switches, exposure.number);
        const DIGITS: &[u8; 16] = b"0123456789abcdef";
        let digit = |value: u8| char::from(DIGITS.get(usize::from(value)).copied().unwrap_or(b'0'));
        for pixels in picture.pixels.chunks(PIXELS_A_LINE) {
            let hex = pixels.iter().flat_map(|pixel| [digit(pixel >> 4), digit(pixel & 15)]).collect();
            self.respond(id, Response::Pixels { hex })?;
        }
        let (width, height) = (picture.width as u32, picture.height as u32);
        let Exposure { time_ns, waiting, .. } = exposure;
        self.respond(id, Response::Exposed { time_ns, width, height, waiting })
    }

    fn answer_wait(&mut self, id: u64, ms: u64) -> Result<(), Gone> {
        if ms > LONGEST_WAIT_MS {
            let why = format!("a wait lasts at most {LONGEST_WAIT_MS} ms; wait again after it");
            return self.respond(id, Response::Refused { why });
        }
        let duration = Duration::from_millis(ms);
        let end = Instant::now() + duration;
        if self.shared.now().pace() == Pace::Fast {
            self.shared.now().pass(duration);
        } else {
            while Instant::now() < end && !self.shared.is_ending() {
                let left = end.saturating_duration_since(Instant::now());
                match self.watch(left.min(LISTEN))? {
                    Received::Line(line) => self.interrupt(&line)?,
                    _ => {
                        let reading = self.send_changes(id)?;
                        self.respond(id, Response::Joints(reading))?;
                    }
                }
            }
        }
        self.finish(id, false)
    }

    /// Makes one motion to its end, reporting what happens on the way; a client that goes meanwhile leaves the arm at rest where
    /// it was. The inner error is a refusal.
    fn make_motion(&mut self, id: u64, order: &Order) -> Result<Result<Ended, String>, Gone> {
        let (cut_short_before, beginning) = {
            let mut state = self.shared.now();
            let before = (state.cut_short, state.reading());
            if let Err(refused) = state.begin(order) {
                return Ok(Err(refused));
            }
            before
        };
        let began_ns = beginning.time_ns;
        // Where and when it began: who asks where the arm was at a moment of its way needs both ends, and that it moved from the first one on.
        self.respond(id, Response::Joints(Reading { moving: true, ..beginning }))?;
        let ended = self.follow_motion(id, cut_short_before, began_ns);
        if ended.is_err() {
            self.shared.now().halt();
        }
        ended.map(Ok)
    }

    fn follow_motion(&mut self, id: u64, cut_short_before: u64, began_ns: u64) -> Result<Ended, Gone> {
        let mut reported_ns = began_ns;
        loop {
            let (reading, cut_short) = {
                let state = self.shared.now();
                (state.reading(), state.cut_short)
            };
            self.send_changes(id)?;
            if !reading.moving {
                let ended = if cut_short > cut_short_before { Ended::CutShort } else { Ended::Arrived };
                return Ok(ended);
            }
            if reading.time_ns >= reported_ns + REPORT_NS {
                reported_ns = reading.time_ns;
                self.respond(id, Response::Joints(reading))?;
            }
            match self.watch(SLICE)? {
                Received::Line(line) => self.interrupt(&line)?,
                _ if self.shared.is_ending() => self.shared.now().halt(),
                _ => {}
            }
        }
    }

    /// A line, if one comes soon.
    fn watch(&mut self, patience: Duration) -> Result<Received, Gone> {
        match self.lines.receive(patience)? {
            Received::Closed => Err(Gone),
            received => Ok(received),
        }
    }

    /// A line while something is under way: a stop stops it, anything else must wait.
    fn interrupt(&mut self, line: &[u8]) -> Result<(), Gone> {
        match read_line::<Call>(line) {
            Ok(call) if call.command == WorldCommand::Stop {} => {
                self.shared.now().halt();
                self.finish(call.id, false)
            }
            Ok(call) => {
                let why = "a call is under way; only `stop` is heard until it ends".to_owned();
                self.respond(call.id, Response::Refused { why })
            }
            Err(why) => self.respond(0, Response::Refused { why }),
        }
    }

    /// Ends a call with what the controller knows, after all that happened before.
    fn finish(&mut self, id: u64, stopped: bool) -> Result<(), Gone> {
        let reading = self.send_changes(id)?;
        self.respond(id, Response::Reading(Reading { stopped, ..reading }))
    }

    /// Reports the changes of the input lines the client has not heard of, and returns the reading that holds after them.
    fn send_changes(&mut self, id: u64) -> Result<Reading, Gone> {
        let (changes, reading) = {
            let state = self.shared.now();
            (state.changes_after(self.reported), state.reading())
        };
        match changes {
            Ok(changes) => {
                for change in changes {
                    self.reported = change.number;
                    self.respond(id, Response::Change(change.into()))?;
                }
                Ok(reading)
            }
            Err(missing) => {
                let why = format!("{missing} changes of the input lines are forgotten; read more often");
                self.respond(id, Response::Refused { why })?;
                Err(Gone)
            }
        }
    }

    fn respond(&mut self, id: u64, response: Response) -> Result<(), Gone> {
        Ok(self.lines.send(&Answer { id, response })?)
    }
}

fn look(state: &State) -> Response {
    if !state.is_revealed() {
        let why = "this world is sealed: what is true in it stays hidden until it is revealed".to_owned();
        return Response::Refused { why };
    }
    match state.truth() {
        Ok(truth) => Response::Truth(Box::new(truth)),
        Err(why) => Response::Refused { why },
    }
}

fn measure(state: &mut State, used: &Use<'_>) -> Response {
    match state.world.measure(used) {
        Ok((value, unit)) => Response::Measured { value, unit: unit.to_owned() },
        Err(why) => Response::Refused { why },
    }
}

fn read_profile(state: &mut State, of: &str, point: usize, axis: Axis) -> Response {
    match state.world.read_profile(of, point, axis) {
        Ok(value) => Response::Measured { value, unit: "mm".to_owned() },
        Err(why) => Response::Refused { why },
    }
}

fn read_point(state: &State, axis: u8, ahead_mm: f64) -> Response {
    let Some(switch) = state.world.switch() else {
        let why = "there is no measuring arm at this arm's target".to_owned();
        return Response::Refused { why };
    };
    match switch.read_point(usize::from(axis), ahead_mm) {
        Ok(value) => Response::Measured { value, unit: "mm".to_owned() },
        Err(why) => Response::Refused { why },
    }
}

fn read_line<T: DeserializeOwned>(line: &[u8]) -> Result<T, String> {
    serde_json::from_slice(line).map_err(|error| error.to_string())
}
