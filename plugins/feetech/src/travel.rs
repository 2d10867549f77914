//! One move: all servos set out together, are watched on their way, and come to rest at their targets.

use std::thread::sleep;
use std::time::{Duration, Instant};

use plumb_plugin::{Host, PluginError};

use crate::motion::{Goal, acceleration_in_steps, duration_s, speed_to_arrive_with};
use crate::servo::{STEP_DEG, STEPS_A_TURN, ServoState};
use crate::servos::Servos;

/// From one look at the servos to the next.
const LOOK: Duration = Duration::from_millis(4);
/// A servo that has been given a goal says within this time that it moves.
const SETS_OUT_WITHIN: Duration = Duration::from_millis(150);
/// How often the goal is moved on where load keeps a servo short of its target: its controller has no integral part.
const CORRECTIONS: usize = 6;
/// How far the goal may lie beyond the target for that, steps (5 degrees). What is further off does not yield to load: it is held.
const FURTHEST_BEYOND: i32 = 57;
/// A move may take twice its time, and this.
const PATIENCE: Duration = Duration::from_secs(3);

/// How a move ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum End {
    Arrived,
    Stopped,
}

/// What a move is made with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pace {
    /// Steps a second of the servo with the longest way.
    pub(crate) speed: f64,
    /// In the servos' unit.
    pub(crate) acceleration: u8,
    /// How near a servo has to come, steps.
    pub(crate) settles_within: i32,
}

/// Hears where the arm is on its way.
pub(crate) type Report<'a> = dyn Fn(&Servos, &[ServoState]) -> Result<(), PluginError> + 'a;

/// A move under way.
pub(crate) struct Travel<'a> {
    pub(crate) servos: &'a mut Servos,
    pub(crate) host: &'a Host,
    pub(crate) pace: Pace,
    /// The joints that move, with their targets, steps.
    pub(crate) targets: Vec<(usize, i32)>,
}

impl Travel<'_> {
    /// Makes the move from `here`. `report` hears where the arm is on its way. Whatever goes wrong, the servos that moved are commanded to hold.
    pub(crate) fn make(&mut self, here: &[ServoState], report: &Report<'_>) -> Result<End, PluginError> {
        let mut seen = here.to_vec();
        let made = self.go(&mut seen, report);
        if matches!(made, Ok(End::Arrived)) {
            return made;
        }
        let joints: Vec<usize> = self.targets.iter().map(|(index, _)| *index).collect();
        let held = self.servos.hold(&joints, &seen);
        match (made, held) {
            (Ok(end), held) => held.map(|()| end),
            (Err(error), Ok(())) => Err(error),
            // What first went wrong says more than that holding failed for the same reason.
            (Err(error), Err(hold)) if hold.text() == error.text() => Err(error),
            (Err(error), Err(hold)) => {
                Err(PluginError::Failed(format!("{error}; and they could not be told to hold: {hold}")))
            }
        }
    }

    fn go(&mut self, seen: &mut Vec<ServoState>, report: &Report<'_>) -> Result<End, PluginError> {
        let mut beyond = vec![0; self.targets.len()];
        for _ in 0..=CORRECTIONS {
            let deadline = Instant::now() + self.set_out(seen, &beyond)? * 2 + PATIENCE;
            if self.watch(seen, deadline, report)? == End::Stopped {
                return Ok(End::Stopped);
            }
            let mut is_there = true;
            for ((index, target), beyond) in self.targets.iter().zip(&mut beyond) {
                let short = target - seen.get(*index).map_or(*target, |state| state.position);
                is_there &= short.abs() <= self.pace.settles_within;
                *beyond += short;
            }
            if is_there {
                return Ok(End::Arrived);
            }
            if beyond.iter().any(|beyond: &i32| beyond.abs() > FURTHEST_BEYOND) {
                break;
            }
        }
        Err(self.short_of_target(seen))
    }

    /// Sends the goals, and gives the time that the longest way takes.
    fn set_out(&mut self, seen: &[ServoState], beyond: &[i32]) -> Result<Duration, PluginError> {
        let ways = self.targets.iter().zip(beyond).filter_map(|((index, target), beyond)| {
            let goal = (target + beyond).clamp(0, STEPS_A_TURN - 1);
            let servo = self.servos.joints.get(*index)?.setting.servo;
            Some((servo, goal, goal - seen.get(*index)?.position))
        });
        let ways: Vec<(u8, i32, i32)> = ways.collect();
        let longest = ways.iter().map(|(.., way)| way.abs()).max().unwrap_or_default();
        let goals: Vec<Goal> = ways
            .iter()
            .map(|(servo, step, way)| Goal {
                servo: *servo,
                step: *step,
                speed: speed_to_arrive_with(*way, longest, self.pace.speed),
            })
            .collect();
        self.servos.send(&goals, self.pace.acceleration)?;
        let acceleration = acceleration_in_steps(self.pace.acceleration);
        Ok(Duration::from_secs_f64(duration_s(longest, self.pace.speed, acceleration)))
    }

    /// Looks at the servos until all are at rest.
    fn watch(
        &mut self,
        seen: &mut Vec<ServoState>,
        deadline: Instant,
        report: &Report<'_>,
    ) -> Result<End, PluginError> {
        let begin = Instant::now();
        let mut was_at_rest = false;
        loop {
            if self.host.should_stop() {
                return Ok(End::Stopped);
            }
            let now = self.servos.states()?;
            if let Some(fault) = self.servos.fault(&now) {
                *seen = now;
                return Err(PluginError::NotReady(fault));
            }
            let moves = now
                .iter()
                .zip(seen.iter())
                .any(|(now, former)| now.moving || now.position != former.position);
            *seen = now;
            report(self.servos, seen)?;
            if !moves && was_at_rest && (self.is_near(seen) || begin.elapsed() > SETS_OUT_WITHIN) {
                return Ok(End::Arrived);
            }
            was_at_rest = !moves;
            if Instant::now() > deadline {
                return Err(PluginError::TimedOut(format!("{}: the move takes too long", self.worst(seen))));
            }
            sleep(LOOK);
        }
    }

    fn is_near(&self, seen: &[ServoState]) -> bool {
        let near = |(index, target): &(usize, i32)| {
            seen.get(*index).is_some_and(|state| (state.position - target).abs() <= self.pace.settles_within)
        };
        self.targets.iter().all(near)
    }

    /// The joint that is furthest from its target, in words.
    fn worst(&self, seen: &[ServoState]) -> String {
        let off = |(index, target): &(usize, i32)| {
            let (joint, state) = (self.servos.joints.get(*index)?, seen.get(*index)?);
            Some(((state.position - target).abs(), joint, state, *target))
        };
        let worst = self.targets.iter().filter_map(off).max_by_key(|(off, ..)| *off);
        let Some((_, joint, state, target)) = worst else { return String::new() };
        format!(
            "{} was sent to {:.2} and is at {:.2} degrees ({})",
            joint.setting.name,
            joint.direction.degrees(target),
            joint.direction.degrees(state.position),
            state.in_words()
        )
    }

    fn short_of_target(&self, seen: &[ServoState]) -> PluginError {
        PluginError::Failed(format!(
            "{}: does it touch something, or carry too much? The driver has moved its goal on by up to {:.0} degrees to make up for load",
            self.worst(seen),
            f64::from(FURTHEST_BEYOND) * STEP_DEG
        ))
    }
}
