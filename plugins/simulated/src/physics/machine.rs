//! An arm at work: commanded to go somewhere, it goes as its imperfections let it, remembers what came before, and rests where forces balance.

use std::sync::Arc;

use super::description::ArmDescription;
use super::drive::{self, DrivePart};
use super::elastic::{self, ElasticPart, Loaded, Yielding};
use super::imperfection::{Imperfection, Mechanism};
use super::link_frames::{LinkFrames, Load};
use super::rigid::{Rigid, Rotation, Vector};
use super::shape::{Arm, Shape};
use super::slow_change::{self, SlowChange};
use super::transmission::Transmission;

/// Circumstances of a measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conditions {
    /// Since switching on, s.
    pub time_s: f64,
    /// Of the arm, degrees Celsius.
    pub temperature_c: f64,
    /// At the target, kg.
    pub payload_kg: f64,
}

/// Why an arm finds no equilibrium.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "the arm finds no equilibrium under {payload_kg} kg: its springs are too soft for its weight (last step {last_step:.1e} rad)"
)]
pub struct NoEquilibrium {
    /// At the target, kg.
    pub payload_kg: f64,
    /// How far the last round of the balance still moved a joint, rad.
    pub last_step: f64,
}

/// An arm at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmState {
    /// Where everything is.
    pub link_frames: LinkFrames,
    /// True values of the drives, what they yield included, rad, or mm of a slide: those of the joints where each has a drive of its own.
    pub drives: Vec<f64>,
    /// True joint values, rad, or mm of a slide.
    pub angles: Vec<f64>,
    /// Gravity's moment on each joint, N m (its force on a slide, N).
    pub moments: Vec<f64>,
}

/// An arm whose loads and springs have been balanced as far as they do.
#[derive(Debug, Clone, PartialEq)]
pub struct Balanced {
    /// Its pose.
    pub arm_state: ArmState,
    /// How far the last round of the balance still moved a joint, rad: 0 for a stiff arm.
    pub last_step: f64,
}

/// An imperfect arm. Of a copy, only what has a memory is copied.
#[derive(Debug, Clone)]
pub struct Machine {
    body: Arc<Body>,
    drive: Vec<DrivePart>,
    driven: Vec<f64>,
}

/// What of an arm has no memory.
#[derive(Debug)]
struct Body {
    shape: Shape,
    arm: Arm,
    changes: Vec<SlowChange>,
    elastic: Vec<Box<dyn ElasticPart>>,
    transmission: Transmission,
    /// The drive before its first move.
    new_drive: Vec<DrivePart>,
}

/// The balance of load and yielding is found when a round moves no joint further than this, rad: a hundred times the rounding of what is computed in a round.
const STILL: f64 = 1e-13;

/// Rounds after which the arm is given up. Every spring of a working machine settles within ten.
const MOST_ROUNDS: usize = 200;

/// Rounds in which a command is found that leads to given values of the drives. Each round leaves a few hundredths of what was missing.
const MOST_COMMANDS: usize = 50;

impl Machine {
    /// The arm of `description` with these imperfections, cold, with every joint at its zero and no history.
    pub fn new(description: &ArmDescription, imperfections: &[Imperfection]) -> Self {
        let mut shape = Shape::nominal(description);
        for imperfection in imperfections {
            misshape(&mut shape, imperfection);
        }
        let drive = drive::parts(description, imperfections);
        let body = Body {
            arm: shape.arm(),
            changes: slow_change::changes(imperfections),
            elastic: elastic::parts(imperfections),
            transmission: description.transmission.clone(),
            new_drive: drive.clone(),
            shape,
        };
        let driven = vec![0.0; body.transmission.drives(body.shape.rows.len())];
        Self { body: Arc::new(body), drive, driven }
    }

    /// Goes straight to `commanded` (rad, or mm of a slide, one a drive), arriving at world time `time_s`.
    pub fn go(&mut self, commanded: &[f64], time_s: f64) {
        self.driven.clear();
        self.driven.extend_from_slice(commanded);
        pass(&mut self.drive, &mut self.driven, time_s);
    }

    /// Where the last move has brought the drives, before anything yields, rad or mm.
    pub fn driven(&self) -> &[f64] {
        &self.driven
    }

    /// Where the arm is under these conditions.
    ///
    /// # Errors
    /// [`NoEquilibrium`] for an arm that is too soft for its weight.
    pub fn equilibrium(&self, conditions: &Conditions) -> Result<ArmState, NoEquilibrium> {
        let Balanced { arm_state, last_step } = self.balance(conditions);
        if last_step < STILL {
            Ok(arm_state)
        } else {
            Err(NoEquilibrium { payload_kg: conditions.payload_kg, last_step })
        }
    }

    /// Where the arm is under these conditions; one that is too soft for its weight, where its sinking was last followed to.
    pub fn balance(&self, conditions: &Conditions) -> Balanced {
        let yielded = |turns: &[f64]| -> Vec<f64> {
            self.driven.iter().zip(turns).map(|(driven, turn)| driven + turn).collect()
        };
        self.body.balance(conditions, yielded).0
    }

    /// The arm's configuration at these values of its drives (rad or mm) if nothing yielded or had changed, without a payload.
    pub fn stiff(&self, drives: &[f64]) -> ArmState {
        let body = &self.body;
        body.loaded(&body.arm, drives.to_vec(), &Yielding::none(drives.len()), 0.0).0
    }

    /// The command that brings a machine without history (play in its middle) to where its drives truly are so under these conditions.
    pub fn command_for(&self, drives: &[f64], conditions: &Conditions) -> Vec<f64> {
        let (_, yielding) = self.body.balance(conditions, |_| drives.to_vec());
        let driven: Vec<f64> = drives.iter().zip(&yielding.turns).map(|(drive, turn)| drive - turn).collect();
        let mut command = driven.clone();
        for _ in 0..MOST_COMMANDS {
            let mut reached = command.clone();
            pass(&mut self.body.new_drive.clone(), &mut reached, conditions.time_s);
            let missing: Vec<f64> =
                driven.iter().zip(&reached).map(|(goal, reached)| goal - reached).collect();
            if missing.iter().all(|part| part.abs() < STILL * 1e-2) {
                break;
            }
            command.iter_mut().zip(&missing).for_each(|(command, part)| *command += part);
        }
        command
    }
}

fn pass(parts: &mut [DrivePart], values: &mut [f64], time_s: f64) {
    for part in parts {
        part.pass(values, time_s);
    }
}

impl Body {
    /// The arm at home as time and temperature have changed it; `None` where they change nothing.
    fn changed(&self, conditions: &Conditions) -> Option<Arm> {
        if self.changes.is_empty() {
            return None;
        }
        let mut shape = self.shape.clone();
        for change in &self.changes {
            change.apply(&mut shape, conditions.time_s, conditions.temperature_c);
        }
        Some(shape.arm())
    }

    /// Iterates until the load of the yielded arm yields the same arm again. `drives` reports where the drives are when they have turned so far under load.
    fn balance(&self, conditions: &Conditions, drives: impl Fn(&[f64]) -> Vec<f64>) -> (Balanced, Yielding) {
        let changed = self.changed(conditions);
        let arm = changed.as_ref().unwrap_or(&self.arm);
        let mut yielding = Yielding::none(self.transmission.drives(self.shape.rows.len()));
        let mut last_step = if self.elastic.is_empty() { 0.0 } else { f64::INFINITY };
        let mut rounds = 0;
        loop {
            let drives = drives(&yielding.turns);
            let (arm_state, loads) = self.loaded(arm, drives, &yielding, conditions.payload_kg);
            if last_step < STILL || rounds == MOST_ROUNDS {
                return (Balanced { arm_state, last_step }, yielding);
            }
            let loaded = Loaded {
                arm,
                link_frames: &arm_state.link_frames,
                angles: &arm_state.angles,
                loads: &loads,
                moments: &self.transmission.on_drives(&arm_state.moments),
                payload: conditions.payload_kg,
            };
            let mut next = Yielding::none(yielding.turns.len());
            for part in &self.elastic {
                part.yield_to(&loaded, &mut next);
            }
            last_step = step(&yielding, &next);
            yielding = next;
            rounds += 1;
        }
    }

    /// The arm with its drives here and its links bent so, and what hangs beyond each of its joints.
    fn loaded(
        &self,
        arm: &Arm,
        drives: Vec<f64>,
        yielding: &Yielding,
        payload_kg: f64,
    ) -> (ArmState, Vec<Load>) {
        let angles = self.transmission.joints(&drives);
        let rocking = Rigid::turned_about(
            arm.world_from_base.translation,
            Rotation::by(yielding.rocking),
            Vector::ZERO,
        );
        let link_frames = arm.link_frames(&angles, &yielding.bends, rocking);
        let loads = arm.loads(&link_frames, payload_kg);
        let moments = arm.gravity_moments(&link_frames, &loads);
        (ArmState { link_frames, drives, angles, moments }, loads)
    }
}

/// The largest change between two rounds, rad (mm of bending count a hundredth).
fn step(before: &Yielding, after: &Yielding) -> f64 {
    let turns = before.turns.iter().zip(&after.turns).map(|(a, b)| (a - b).abs());
    let bends = after.bends.iter().enumerate().map(|(link, bend)| {
        let earlier = before.bends.get(link).copied().unwrap_or(Rigid::IDENTITY);
        let turned =
            (bend.rotation.x - earlier.rotation.x).norm() + (bend.rotation.y - earlier.rotation.y).norm();
        turned + (bend.translation - earlier.translation).norm() * 1e-2
    });
    turns.chain(bends).fold((before.rocking - after.rocking).norm(), f64::max)
}

/// Builds a constant error of shape into the arm.
fn misshape(shape: &mut Shape, imperfection: &Imperfection) {
    let size = imperfection.size;
    match imperfection.mechanism {
        Mechanism::ToolOffset { direction } => shape.target += Vector::from(direction) * size,
        Mechanism::BasePosition { direction } => {
            shape.world_from_base.translation += Vector::from(direction) * size
        }
        Mechanism::BaseTilt { axis } => {
            let lean = Rotation::about(axis.into(), size);
            shape.world_from_base.rotation = lean * shape.world_from_base.rotation;
        }
        _ => {
            let Some(row) = imperfection.mechanism.joint().and_then(|joint| shape.rows.get_mut(joint)) else {
                return;
            };
            match imperfection.mechanism {
                Mechanism::JointZero { .. } => row.shift_zero(size),
                Mechanism::LinkLength { .. } => row.length += size,
                Mechanism::LinkOffset { .. } => row.offset += size,
                Mechanism::LinkTwist { .. } => row.twist += size,
                Mechanism::AxisSkew { .. } => row.skew += size,
                _ => {}
            }
        }
    }
}
