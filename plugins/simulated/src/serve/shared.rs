//! The world as all its clients share it, with the clock that drives it.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crate::protocol::{JointFacts, PROTOCOL, Pace, PendantKey, Reading, Welcome};
use crate::world::{
    AXES, HalfSteps, Joint, Joints, LineChange, MotionOrder, MotionRefused, Resolution, World,
    WorldDescription,
};

/// The world, its clock and its pendant.
pub(super) struct Shared {
    state: Mutex<State>,
    ending: AtomicBool,
}

/// What is behind the lock.
pub(super) struct State {
    pub(super) world: World,
    /// As the file describes it, before anybody turned or held anything.
    original: WorldDescription,
    pace: Pace,
    /// A moment of the wall's clock, and the world's time at that moment.
    wall: Instant,
    world_ns: u64,
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
    Joints(MotionOrder),
    /// Of motors, by so many half-steps, the one with the most at this rate.
    HalfSteps(HalfSteps, f64),
}

impl Shared {
    pub(super) fn new(world: World, pace: Pace) -> Shared {
        let now = Instant::now();
        let world_ns = world.reading().time_ns;
        let state = State {
            original: world.description().clone(),
            revealed: world.description().sealed_text.is_none(),
            world,
            pace,
            wall: now,
            world_ns,
            cut_short: 0,
            pendant: false,
            key: None,
            clients: 0,
            last_used: now,
        };
        Shared { state: Mutex::new(state), ending: AtomicBool::new(false) }
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
        match self.pace {
            Pace::Fast => self.world.finish_motion(),
            Pace::Real => {
                let since = u64::try_from(self.wall.elapsed().as_nanos()).unwrap_or(u64::MAX);
                self.world.advance(self.world_ns.saturating_add(since));
            }
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
        self.wall = Instant::now();
        self.world_ns = self.world.reading().time_ns;
    }

    /// Lets time pass without waiting for the wall's clock.
    pub(super) fn pass(&mut self, duration: Duration) {
        let end = self.world.reading().time_ns.saturating_add(duration.as_nanos() as u64);
        self.world.advance(end);
    }

    /// Starts a motion; in a fast world it is over at once.
    pub(super) fn begin(&mut self, order: &Order) -> Result<(), MotionRefused> {
        match order {
            Order::Joints(order) => self.world.begin(order)?,
            Order::HalfSteps(travel, rate) => self.world.begin_half_steps(travel, *rate)?,
        }
        self.catch_up();
        Ok(())
    }

    /// Lets the world begin again, drawn from another seed.
    pub(super) fn begin_again(&mut self, seed: u64) -> Result<(), String> {
        if self.world.reading().moving {
            return Err("the arm is moving; wait for it or stop it first".to_owned());
        }
        let description = WorldDescription { seed, ..self.original.clone() };
        self.world = World::in_place_of(&self.world, description);
        self.pendant = false;
        self.key = None;
        self.set_clock();
        Ok(())
    }

    /// Whether what is true may be told.
    pub(super) fn is_revealed(&self) -> bool {
        self.revealed
    }

    /// Breaks the seal, and returns what was under it.
    pub(super) fn reveal(&mut self) -> String {
        self.revealed = true;
        self.world.description().sealed_text.clone().unwrap_or_default()
    }

    /// Stops the arm where it stands.
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

    pub(super) fn reading(&self) -> Reading {
        let reading = Reading::of(&self.world.reading(), self.world.outputs());
        Reading { pendant: self.pendant, key: self.key.map_or(0, |key| key as u32), ..reading }
    }

    /// The changes after this one, or how many of them are forgotten.
    pub(super) fn changes_after(&self, number: u64) -> Result<Vec<LineChange>, u64> {
        let changes = self.world.changes_after(number);
        let missing = self.world.latest_change().saturating_sub(number) - changes.len() as u64;
        if missing == 0 { Ok(changes) } else { Err(missing) }
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
        let description = self.world.description();
        let arm = &description.arm;
        let home = arm.start.minus(&arm.zero_error);
        let step = each_alone(&HalfSteps([1.0; AXES]));
        let top_speed = each_alone(&arm.top_rates);
        let joints = Joint::ALL.map(|joint| JointFacts {
            name: joint.name().to_owned(),
            resolution: match arm.resolution {
                Resolution::Continuous => 0.0,
                Resolution::HalfStep => step.of(joint),
            },
            top_speed: top_speed.of(joint),
            home: home.of(joint),
        });
        Welcome {
            protocol: PROTOCOL,
            world: description.title.clone(),
            pid: std::process::id(),
            pace: self.pace,
            arm: "teachmover".to_owned(),
            joints: joints.into(),
        }
    }
}

/// How far each joint goes when the motors that work it, and no others, go this far: both of the wrist's for its pitch and roll.
fn each_alone(motors: &HalfSteps) -> Joints {
    let [base, shoulder, elbow, right, left, gripper] = motors.0;
    let of = |motors: [f64; AXES], joint: Joint| HalfSteps(motors).to_joints().of(joint).abs();
    let wrist = right.min(left);
    Joints([
        of([base, 0.0, 0.0, 0.0, 0.0, 0.0], Joint::Waist),
        of([0.0, shoulder, 0.0, 0.0, 0.0, 0.0], Joint::Shoulder),
        of([0.0, 0.0, elbow, 0.0, 0.0, 0.0], Joint::Elbow),
        of([0.0, 0.0, 0.0, wrist, wrist, 0.0], Joint::WristPitch),
        of([0.0, 0.0, 0.0, -wrist, wrist, 0.0], Joint::WristRoll),
        of([0.0, 0.0, 0.0, 0.0, 0.0, gripper], Joint::Gripper),
    ])
}
