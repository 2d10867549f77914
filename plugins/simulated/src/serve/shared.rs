//! The world as all its clients share it, with the clock that drives it.

use std::io;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::clock::WorldClock;
use crate::joint_values::JointValues;
use crate::protocol::{PROTOCOL, Pace, PendantKey, Reading, TruthReport, Welcome};
use crate::served_world::{
    Camera, Exposure, Fingers, LevelledJoints, MotionRequest, ServedWorld, StepperMotors, Switch,
};
use crate::world::LineChange;

/// The longest cycle in which a controller leads its servos, ms: slower ones lead nothing.
const LONGEST_CYCLE_MS: f64 = 100.0;

/// The world, its clock and its pendant.
pub(super) struct Shared {
    state: Mutex<State>,
    ending: AtomicBool,
}

/// What is behind the lock.
pub(super) struct State {
    pub(super) world: Box<dyn ServedWorld>,
    pace: Pace,
    clock: WorldClock,
    /// How many motions were cut short so far.
    pub(super) cut_short: u64,
    pub(super) pendant: bool,
    key: Option<PendantKey>,
    revealed: bool,
    clients: usize,
    last_used: Instant,
}

/// A motion that somebody wants.
pub(super) enum Order {
    /// Of joints.
    Joints(MotionRequest),
    /// Of motors, by so many half-steps, the one with the most at this rate.
    HalfSteps(JointValues, f64),
}

impl Shared {
    /// A world at its beginning, which reports the cell's time in a file.
    ///
    /// # Errors
    /// What the system says of the file.
    pub(super) fn new(world: Box<dyn ServedWorld>, pace: Pace, clock: &Path) -> io::Result<Shared> {
        let world_ns = world.reading().time_ns;
        let mut clock = WorldClock::start(clock, world_ns)?;
        clock.set(pace, world_ns);
        let state = State {
            revealed: world.sealed_text().is_none(),
            world,
            pace,
            clock,
            cut_short: 0,
            pendant: false,
            key: None,
            clients: 0,
            last_used: Instant::now(),
        };
        Ok(Shared { state: Mutex::new(state), ending: AtomicBool::new(false) })
    }

    /// The world, brought up to the present moment.
    pub(super) fn now(&self) -> MutexGuard<'_, State> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.catch_up();
        state
    }

    /// Has the world end.
    pub(super) fn end(&self) {
        self.ending.store(true, Ordering::Release);
    }

    /// Whether the world ends.
    pub(super) fn is_ending(&self) -> bool {
        self.ending.load(Ordering::Acquire)
    }
}

impl State {
    fn catch_up(&mut self) {
        match self.clock.world_ns() {
            None => {
                self.world.finish_motion();
                self.clock.stopped_at(self.world.reading().time_ns);
            }
            Some(now_ns) => self.world.advance(now_ns),
        }
    }

    pub(super) fn pace(&self) -> Pace {
        self.pace
    }

    pub(super) fn set_pace(&mut self, pace: Pace) {
        self.pace = pace;
        self.set_clock();
        self.catch_up();
    }

    fn set_clock(&mut self) {
        self.clock.set(self.pace, self.world.reading().time_ns);
    }

    /// Lets time pass without waiting for the wall's clock.
    pub(super) fn pass(&mut self, duration: Duration) {
        let end = self.world.reading().time_ns.saturating_add(duration.as_nanos() as u64);
        self.world.advance(end);
        self.clock.stopped_at(end);
    }

    /// Starts a motion; in a fast world it is over at once.
    pub(super) fn begin(&mut self, order: &Order) -> Result<(), String> {
        match order {
            Order::Joints(order) => self.world.begin(order)?,
            Order::HalfSteps(travel, rate) => self.stepper_motors()?.begin_half_steps(travel, *rate)?,
        }
        self.catch_up();
        Ok(())
    }

    /// Leads the servos on; in a fast world the cycle is over at once.
    pub(super) fn follow(&mut self, joints: &JointValues, ms: f64) -> Result<(), String> {
        if !(0.1..=LONGEST_CYCLE_MS).contains(&ms) {
            return Err(format!("a cycle of {ms} ms is not to be had; from 0.1 to {LONGEST_CYCLE_MS} ms is"));
        }
        self.world.follow(joints, (ms * 1e6) as u64)?;
        self.catch_up();
        Ok(())
    }

    /// Lets the world begin again, drawn from another seed.
    pub(super) fn begin_again(&mut self, seed: u64) -> Result<(), String> {
        if self.world.reading().moving {
            return Err("the arm is moving; wait for it or stop it first".to_owned());
        }
        self.world = self.world.again(seed);
        self.pendant = false;
        self.key = None;
        self.set_clock();
        Ok(())
    }

    /// Has the camera take pictures by itself while the arm moves, or not.
    pub(super) fn set_shutter(&mut self, every_ms: Option<f64>) -> Result<(), String> {
        let every_ns = match every_ms {
            Some(every_ms) if (1.0..=60_000.0).contains(&every_ms) => Some((every_ms * 1e6) as u64),
            Some(every_ms) => {
                return Err(format!("a picture every {every_ms} ms is not to be had; from 1 to 60000 ms is"));
            }
            None => None,
        };
        self.camera()?.set_shutter(every_ns)
    }

    /// The camera on the hand, or that there is none.
    pub(super) fn camera(&mut self) -> Result<&mut dyn Camera, String> {
        self.world.camera().ok_or_else(|| "this arm has no camera".to_owned())
    }

    /// Switches the light stripe's laser and its filter.
    pub(super) fn shine(&mut self, laser: Option<bool>, filter: Option<bool>) -> Result<(), String> {
        let camera = self.world.camera().ok_or("this arm has no light stripe")?;
        camera.shine(laser, filter);
        Ok(())
    }

    /// The proximity switch on the hand, or that there is none.
    pub(super) fn switch(&mut self) -> Result<&mut dyn Switch, String> {
        self.world.switch_mut().ok_or_else(|| "this arm has no proximity sensor".to_owned())
    }

    /// The fingers, or that there are none.
    pub(super) fn fingers(&mut self) -> Result<&mut dyn Fingers, String> {
        self.world.fingers().ok_or_else(|| "this arm has no fingers".to_owned())
    }

    /// The joints that can be levelled, or that there are none.
    pub(super) fn levelled_joints(&mut self) -> Result<&mut dyn LevelledJoints, String> {
        let joints = self.world.levelled_joints();
        joints.ok_or_else(|| "in this world no joint is levelled; bring the arm to a pose instead".to_owned())
    }

    /// The stepper motors, or that there are none.
    fn stepper_motors(&mut self) -> Result<&mut dyn StepperMotors, String> {
        let motors = self.world.stepper_motors();
        motors.ok_or_else(|| "this arm has no stepper motors; move its joints instead".to_owned())
    }

    /// The number of the latest change of the input lines, 0 before the first and where nothing is wired to them.
    pub(super) fn latest_change(&self) -> u64 {
        self.world.switch().map_or(0, Switch::latest_change)
    }

    /// Whether what is true may be revealed.
    pub(super) fn is_revealed(&self) -> bool {
        self.revealed
    }

    /// Breaks the seal, and returns what was under it.
    pub(super) fn reveal(&mut self) -> String {
        self.revealed = true;
        self.world.sealed_text().unwrap_or_default().to_owned()
    }

    /// Stops the arm where it is.
    pub(super) fn halt(&mut self) {
        if self.world.reading().moving {
            self.world.halt();
            self.cut_short += 1;
        }
    }

    /// The operator presses a key.
    pub(super) fn press(&mut self, key: PendantKey) {
        self.key = Some(key);
        if key == PendantKey::Stop {
            self.halt();
            self.pendant = false;
        }
    }

    /// Hands the arm to the pendant or takes it back. What was pressed before counts no more.
    pub(super) fn hand_over(&mut self, on: bool) {
        if on && !self.pendant {
            self.key = None;
        }
        self.pendant = on;
    }

    /// What the controller knows, dated by the cell's clock, as all that follows.
    pub(super) fn reading(&self) -> Reading {
        let reading = self.world.reading();
        Reading {
            time_ns: self.clock.dated(reading.time_ns),
            pendant: self.pendant,
            key: self.key.map_or(0, |key| key as u32),
            ..reading
        }
    }

    /// What is so.
    ///
    /// # Errors
    /// Why it cannot be determined.
    pub(super) fn truth(&self) -> Result<TruthReport, String> {
        let truth = self.world.truth()?;
        Ok(TruthReport { time_ns: self.clock.dated(truth.time_ns), ..truth })
    }

    /// A picture by the camera on the hand.
    ///
    /// # Errors
    /// Why there is none.
    pub(super) fn expose(&mut self) -> Result<Exposure, String> {
        let exposure = self.camera()?.expose()?;
        Ok(Exposure { time_ns: self.clock.dated(exposure.time_ns), ..exposure })
    }

    /// The changes after this one, or how many of them are forgotten.
    pub(super) fn changes_after(&self, number: u64) -> Result<Vec<LineChange>, u64> {
        let changes = self.world.switch().map(|switch| switch.changes_after(number)).unwrap_or_default();
        let missing = self.latest_change().saturating_sub(number).saturating_sub(changes.len() as u64);
        let dated = |change: LineChange| LineChange { time_ns: self.clock.dated(change.time_ns), ..change };
        if missing == 0 { Ok(changes.into_iter().map(dated).collect()) } else { Err(missing) }
    }

    pub(super) fn client_came(&mut self) {
        self.clients += 1;
        self.last_used = Instant::now();
    }

    pub(super) fn client_went(&mut self) {
        self.clients = self.clients.saturating_sub(1);
        self.last_used = Instant::now();
    }

    /// How long nobody has been there.
    pub(super) fn idle(&self) -> Duration {
        if self.clients > 0 { Duration::ZERO } else { self.last_used.elapsed() }
    }

    pub(super) fn welcome(&self) -> Welcome {
        let arm = self.world.facts();
        Welcome {
            protocol: PROTOCOL,
            world: self.world.title().to_owned(),
            pid: std::process::id(),
            pace: self.pace,
            arm: arm.name,
            model: arm.model,
            input_lines: arm.input_lines,
            output_lines: arm.output_lines,
            braking_ms: arm.braking_ms,
            joints: arm.joints,
        }
    }
}
