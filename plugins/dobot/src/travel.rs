//! One move: it is put into the queue, watched on its way, and ended early where something is wrong.

use std::time::{Duration, Instant};

use plumb_plugin::{Host, PluginError};

use crate::configuration::Configuration;
use crate::controller::Controller;
use crate::joints::{self, Angles, JOINTS};

/// From one look at the arm to the next.
const LOOK: Duration = Duration::from_millis(10);
/// Two readings of an arm at rest differ by no more, deg: half a step of its motors.
const ALIKE_DEG: f64 = 0.006;
/// How long the arm may take to come to rest after it was commanded to stop.
const AT_REST_WITHIN: Duration = Duration::from_millis(700);
/// A move may take twice its time, and this.
const PATIENCE: Duration = Duration::from_secs(3);
/// An arm that is at rest for so long and does not say that it has carried out its move has not set out, or is held by something.
const AT_REST_TOO_LONG: Duration = Duration::from_secs(2);

/// Hears where the arm is on its way.
pub(crate) type Report<'a> = dyn Fn(&Angles) -> Result<(), PluginError> + 'a;

/// How a move ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum End {
    Arrived,
    Stopped(Angles),
}

/// Where the joints are; an answer that holds no angles is an error.
pub(crate) fn look(controller: &mut Controller) -> Result<Angles, PluginError> {
    controller.angles()?.ok_or_else(|| {
        PluginError::Failed(
            "the Dobot says of its joints what are no angles: switch it off and on, and home it".to_owned(),
        )
    })
}

/// Where the joints are when two readings agree; whether they do.
pub(crate) fn look_at_rest(
    controller: &mut Controller,
    within: Duration,
) -> Result<(Angles, bool), PluginError> {
    let begin = Instant::now();
    let mut former = look(controller)?;
    loop {
        std::thread::sleep(LOOK);
        let now = look(controller)?;
        if are_alike(&now, &former) {
            return Ok((now, true));
        }
        if begin.elapsed() > within {
            return Ok((now, false));
        }
        former = now;
    }
}

fn are_alike(one: &Angles, other: &Angles) -> bool {
    one.iter().zip(other).all(|(one, other)| (one - other).abs() <= ALIKE_DEG)
}

/// Stops the arm and waits until it is at rest.
pub(crate) fn halt(controller: &mut Controller) -> Result<Angles, PluginError> {
    controller.halt()?;
    match look_at_rest(controller, AT_REST_WITHIN)? {
        (angles, true) => Ok(angles),
        (_, false) => Err(PluginError::TimedOut(
            "the Dobot was told to stop and still moves: switch its power off".to_owned(),
        )),
    }
}

/// A move under way.
pub(crate) struct Travel<'a> {
    pub(crate) controller: &'a mut Controller,
    pub(crate) host: &'a Host,
    pub(crate) configuration: &'a Configuration,
    pub(crate) target: Angles,
    pub(crate) speed_fraction: f64,
}

impl Travel<'_> {
    /// Makes the move from `here`. Whatever goes wrong, the arm is commanded to stop and its queue is emptied.
    pub(crate) fn make(&mut self, here: &Angles, report: &Report<'_>) -> Result<End, PluginError> {
        let made = self.go(here, report);
        if matches!(made, Ok(true)) {
            return Ok(End::Arrived);
        }
        match (made, halt(self.controller)) {
            (Ok(_), held) => held.map(End::Stopped),
            (Err(error), Ok(_)) => Err(error),
            // What first went wrong says more than that stopping failed for the same reason.
            (Err(error @ PluginError::Disconnected(_)), Err(PluginError::Disconnected(_))) => Err(error),
            (Err(error), Err(held)) => {
                Err(PluginError::Failed(format!("{error}; and it could not be told to stop: {held}")))
            }
        }
    }

    /// Whether it arrived; `false` after a stop was asked for.
    fn go(&mut self, here: &Angles, report: &Report<'_>) -> Result<bool, PluginError> {
        self.controller.set_ratio(self.speed_fraction)?;
        let index = self.controller.queue_move(&self.target)?;
        let deadline = Instant::now() + self.duration(here) * 2 + PATIENCE;
        let (mut former, mut at_rest_since) = (*here, Instant::now());
        loop {
            if self.host.should_stop() {
                return Ok(false);
            }
            let is_done = self.controller.index()? >= index;
            let now = look(self.controller)?;
            let alarms = self.controller.alarms()?;
            if !alarms.are_none() {
                return Err(PluginError::NotReady(alarms.in_words()));
            }
            report(&now)?;
            let at_rest = are_alike(&now, &former);
            if !at_rest {
                at_rest_since = Instant::now();
            }
            if is_done && at_rest {
                return self.arrived(&now).map(|()| true);
            }
            if Instant::now() > deadline || at_rest_since.elapsed() > AT_REST_TOO_LONG {
                let what = if at_rest {
                    "it is at rest, and its queue does not go on"
                } else {
                    "the move takes too long"
                };
                return Err(PluginError::TimedOut(format!(
                    "{what}: {} with {} to go to: is the arm free, and was it homed?",
                    joints::in_words(&now, joints::count(self.configuration)),
                    joints::in_words(&self.target, joints::count(self.configuration)),
                )));
            }
            former = now;
            std::thread::sleep(LOOK);
        }
    }

    /// Says which joint did not come to its target, if so.
    fn arrived(&self, now: &Angles) -> Result<(), PluginError> {
        let joints = JOINTS.iter().zip(now).zip(&self.target).take(joints::count(self.configuration));
        for (((name, _), now), target) in joints {
            if (now - target).abs() > self.configuration.settles_within {
                return Err(PluginError::Failed(format!(
                    "{name} was sent to {target:.2} and is at {now:.2} degrees, though the Dobot has ended its move without an alarm: does it touch something?"
                )));
            }
        }
        Ok(())
    }

    /// How long the longest way takes, at an even speed and with its ramps.
    fn duration(&self, here: &Angles) -> Duration {
        let way =
            here.iter().zip(&self.target).map(|(here, target)| (here - target).abs()).fold(0.0, f64::max);
        let speed = self.configuration.full_speed * self.speed_fraction;
        Duration::from_secs_f64(way / speed + speed / self.configuration.acceleration)
    }
}
