//! A scan in motion: the arm goes the whole way at once, and the camera takes pictures by itself meanwhile.

use std::time::Instant;

use serde_json::json;

use super::ScanStep;
use crate::engine::Engine;
use crate::engine::scan_state::{Scan, ScanProgress};
use crate::engine::step_context::StepContext;
use crate::engine::step_error::StepError;

/// The camera's quantity that counts the pictures it still holds.
const WAITING: &str = "waiting";

impl Engine {
    /// Flies along the line at `speed_mm_s`, a picture every step, and keeps the stripes that were taken under way, each with where the arm was then.
    pub(crate) fn fly(
        &mut self,
        step: &ScanStep,
        at: &StepContext,
        scan: &Scan,
        speed_mm_s: f64,
        made: &mut ScanProgress,
    ) -> Result<(), StepError> {
        let camera = step.camera().ok_or_else(|| {
            StepError::error("a scan in motion asks a camera for its pictures: give `trigger:`".to_owned())
        })?;
        let way_mm = scan.way.norm();
        if !(speed_mm_s > 0.0 && scan.stripes > 1) {
            return Err(StepError::error(format!(
                "a scan in motion at {speed_mm_s} mm/s with {} stripes is none: give `fly_mm_s` above 0 and a way of several steps",
                scan.stripes
            )));
        }
        let leaving = Instant::now();
        self.go_to_stripe(step, at, scan, 0.0)?;
        made.moving += leaving.elapsed();
        let (here, target) = self.stripe_target(step, scan, 1.0)?;
        let duration_s = way_mm / speed_mm_s;
        let speed = self.arm(&step.robot)?.expected_time(&here, &target, 1.0).as_secs_f64() / duration_s;
        if !(0.001..=1.0).contains(&speed) {
            return Err(StepError::error(format!(
                "{} goes this way at {:.1} to {:.0} mm/s, not at {speed_mm_s}",
                step.robot,
                0.001 * speed_mm_s / speed,
                speed_mm_s / speed
            )));
        }
        let every_ms = 1000.0 * duration_s / (scan.stripes - 1) as f64;
        self.set_shutter(camera, every_ms)?;
        let leaving = Instant::now();
        let flown = self.move_arm(&step.robot, &here, &target, speed, at);
        made.moving += leaving.elapsed();
        let kept = flown.and_then(|_| self.keep_pictures(step, at, camera, made));
        let shut = self.set_shutter(camera, 0.0);
        kept.and(shut)?;
        let (stripes, points) = (made.cloud.poses.len(), made.cloud.points.len());
        let text = format!("{stripes} stripes at {speed_mm_s} mm/s, {points} points");
        self.journal.progress(&at.path, Some(1.0), text);
        Ok(())
    }

    /// Without poses under way nothing of a flight can be kept: a pose between its ends would be made up.
    fn blind_on_the_way(&self, step: &ScanStep) -> StepError {
        StepError::error(format!(
            "{} does not report where it is while it moves, so that a picture taken in motion has no pose: nothing of this scan is kept. Scan at rest (`fly_mm_s` 0), or wire `pose` of {} if it is not",
            step.robot, step.sensor
        ))
    }

    fn set_shutter(&mut self, camera: &str, every_ms: f64) -> Result<(), StepError> {
        let set = self.sensor(camera)?.link.configure(&json!({"every_ms": every_ms}));
        set.map_err(|error| self.device_error(error))
    }

    /// Fetches the pictures that were taken under way; one whose time says that the arm was at rest is left out.
    fn keep_pictures(
        &mut self,
        step: &ScanStep,
        at: &StepContext,
        camera: &str,
        made: &mut ScanProgress,
    ) -> Result<(), StepError> {
        loop {
            self.look_for_interrupt()?;
            let taken = self.sensor(camera)?.link.read(0).map_err(|error| self.device_error(error))?;
            let waiting = taken.quantities.iter().find(|quantity| quantity.name == WAITING);
            let waiting = waiting.map(|quantity| quantity.value).ok_or_else(|| {
                StepError::error(format!("{camera} takes no pictures by itself: it reports no `{WAITING}`"))
            })?;
            let read = self.sensor(&step.sensor)?.link.read(taken.time_ns);
            read.map_err(|error| self.device_error(error))?;
            for (header, points) in self.stripes_of(step)? {
                if header.joints.is_empty() {
                    return Err(self.blind_on_the_way(step));
                }
                if header.speeds.as_slice().iter().any(|speed| *speed != 0.0) {
                    let capture = self.capture(step, &header.joints, &header.speeds)?;
                    self.keep_stripe(step, at, capture, (&header, &points), made);
                }
            }
            if waiting < 1.0 {
                return Ok(());
            }
        }
    }
}
