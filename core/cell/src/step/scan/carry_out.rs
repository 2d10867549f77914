//! `scan`: a stripe at each position of a line, turned into points by the pose at the moment of its exposure.

use std::time::{Duration, Instant};

use nalgebra::{Point3, Vector3};
use plumb_cloud::{Cloud, CloudPoint};
use plumb_plugin::{JointVector, StripeFault, StripeHeader, StripePoint};
use serde_json::{Map, Value, json};

use super::{Fitted, ScanStep};
use crate::device::Stripe;
use crate::engine::Engine;
use crate::engine::believed::picture_not_before;
use crate::engine::flange::flange_at;
use crate::engine::scan_state::{Capture, Exposed, Scan, ScanProgress};
use crate::engine::scope::named_value;
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::event::NamedValue;

/// More stripes are a mistake.
const MOST_STRIPES: f64 = 10_000.0;

impl Engine {
    pub(crate) fn execute_scan(&mut self, step: &ScanStep, at: &StepContext) -> Result<Done, StepError> {
        let scan = self.plan_scan(step, at)?;
        let mut made = match self.paused_scan.take() {
            Some((path, paused, made)) if path == at.path && paused == scan => made,
            _ => self.begin_scan(step)?,
        };
        let flight = step.fly.as_ref().map(|fly| self.number(at.scope, fly)).transpose()?.unwrap_or(0.0);
        let begin = Instant::now();
        let scanned = match flight == 0.0 {
            true => self.scan_at_rest(step, at, &scan, &mut made),
            false => self.fly(step, at, &scan, flight, &mut made),
        };
        made.lasted += begin.elapsed();
        match scanned {
            Ok(()) => self.describe_scan(step, at, &made),
            Err(interrupted @ StepError::Interrupted { .. }) => {
                // Of a way that was flown in part nothing is kept: it is flown anew as a whole.
                self.paused_scan = (flight == 0.0).then(|| (at.path.clone(), scan, made));
                Err(interrupted)
            }
            Err(error) => Err(error),
        }
    }

    /// What the sensor saw before a scan is none of it.
    fn begin_scan(&mut self, step: &ScanStep) -> Result<ScanProgress, StepError> {
        self.sensor(&step.sensor)?.link.arm().map_err(|error| self.device_error(error))?;
        // Losses before it are none of its own either.
        let _ = self.sensor(&step.sensor)?.link.stripes();
        Ok(ScanProgress::default())
    }

    /// A stripe at each position of the line. While the sensor works on a picture the arm is on its way to the next.
    fn scan_at_rest(
        &mut self,
        step: &ScanStep,
        at: &StepContext,
        scan: &Scan,
        made: &mut ScanProgress,
    ) -> Result<(), StepError> {
        while made.next < scan.stripes {
            let leaving = Instant::now();
            let went = self.go_to_stripe(step, at, scan, scan.fraction(made.next));
            made.moving += leaving.elapsed();
            // Where the way was cut short the picture before belongs to the scan all the same.
            let fetched = self.fetch_stripe(step, at, made);
            let joints = went?;
            fetched?;
            let arrived = Instant::now();
            made.worked_on = Some(self.expose(step, made.next, &joints)?);
            made.exposing += arrived.elapsed();
            made.next += 1;
            let text =
                format!("stripe {} of {}, {} points", made.next, scan.stripes, made.cloud.points.len());
            self.journal.progress(&at.path, Some(made.next as f64 / scan.stripes as f64), text);
        }
        self.fetch_stripe(step, at, made)
    }

    /// Fits, saves and reports what a scan has made.
    fn describe_scan(
        &mut self,
        step: &ScanStep,
        at: &StepContext,
        made: &ScanProgress,
    ) -> Result<Done, StepError> {
        let ScanProgress { cloud, empty, .. } = made;
        if cloud.points.is_empty() {
            return Err(StepError::error(format!(
                "none of the {} pictures showed a stripe ({}): {}",
                cloud.poses.len(),
                empty.counts_by_cause(),
                empty.cure()
            )));
        }
        let seconds = made.lasted.as_secs_f64();
        let fraction = |time: Duration| time.as_secs_f64() / seconds.max(1e-9);
        let processing = (1.0 - fraction(made.moving + made.exposing)).max(0.0);
        let mut result = Map::from_iter([
            ("points".to_owned(), json!(cloud.points.len())),
            ("stripes".to_owned(), json!(cloud.poses.len())),
            ("empty".to_owned(), json!(empty.stripes)),
            ("seconds".to_owned(), json!(seconds)),
            ("camera_percent".to_owned(), json!(100.0 * fraction(made.exposing))),
            ("processing_percent".to_owned(), json!(100.0 * processing)),
        ]);
        let mut message = format!(
            "{} points of {} stripes ({} without one)",
            cloud.points.len(),
            cloud.poses.len(),
            empty.stripes
        );
        if let Some(fitted) = step.fit {
            message.push_str(&fit(fitted, cloud, &mut result)?);
        }
        if let Some(name) = &step.save {
            let folder = self.outputs.clone();
            let joints = self.joint_names(&step.robot)?;
            let name = cloud
                .save(&folder, name, &joints, step.on.as_deref().unwrap_or(name))
                .map_err(|error| StepError::error(error.to_string()))?;
            message.push_str(&format!(", in {}", folder.join(format!("{name}.ply")).display()));
        }
        let values: Vec<NamedValue> =
            result.iter().filter_map(|(name, value)| Some(named_value(name, value.as_f64()?))).collect();
        self.journal.noted(&at.path, &step.sensor, &values)?;
        Ok(Done { result: Value::Object(result), values, message })
    }

    fn plan_scan(&mut self, step: &ScanStep, at: &StepContext) -> Result<Scan, StepError> {
        let from = self.position(&step.from, at)?;
        let way = self.position(&step.to, at)? - from;
        let pitch = self.number(at.scope, &step.step)?;
        let stripes = (way.norm() / pitch + 1e-9).floor() + 1.0;
        if !(pitch > 0.0 && stripes <= MOST_STRIPES) {
            return Err(StepError::error(format!(
                "a step of {pitch} mm on a way of {:.1} mm makes no scan: give `step_mm` above 0, for {MOST_STRIPES} stripes at most",
                way.norm()
            )));
        }
        let way = if way.norm() > 0.0 { way.normalize() * (pitch * (stripes - 1.0)) } else { way };
        let attitude = self.attitude([&step.tilt, &step.azimuth, &step.turn], at)?;
        Ok(Scan { from, way, stripes: stripes as usize, attitude, aim: Vector3::from(step.aim_mm) })
    }

    pub(crate) fn go_to_stripe(
        &mut self,
        step: &ScanStep,
        at: &StepContext,
        scan: &Scan,
        fraction: f64,
    ) -> Result<JointVector, StepError> {
        let (here, target) = self.stripe_target(step, scan, fraction)?;
        self.move_arm(&step.robot, &here, &target, step.speed, at)
    }

    /// Where the drive is, and what it has to be commanded to bring the aim to a fraction of the way.
    pub(crate) fn stripe_target(
        &mut self,
        step: &ScanStep,
        scan: &Scan,
        fraction: f64,
    ) -> Result<(JointVector, JointVector), StepError> {
        let position = scan.from + scan.way * fraction;
        let requested = flange_at(position, scan.attitude, scan.aim);
        let here = self.read_pose(&step.robot)?.joints;
        let arm = self.arm(&step.robot)?;
        let target = arm.joints_for(&requested, &here).map_err(|cause| {
            StepError::error(format!(
                "no stripe at [{:.1}, {:.1}, {:.1}] mm: {cause}",
                position.x, position.y, position.z
            ))
        })?;
        arm.check_move(&here, &target).map_err(|reason| StepError::error(reason.to_string()))?;
        Ok((here, target))
    }

    /// Takes a picture where the arm is. It may go on as soon as the camera has it; a sensor that has no camera to be asked is waited for.
    fn expose(&mut self, step: &ScanStep, stripe: usize, joints: &JointVector) -> Result<Exposed, StepError> {
        self.look_for_interrupt()?;
        let rest_ns = picture_not_before(self.rest_ns);
        let reading = self.read_sensor(step.camera().unwrap_or(&step.sensor), 0, rest_ns)?;
        // Known now: once the arm has set out its joints arrive from other sides.
        let capture = self.capture(step, joints, &JointVector::zeros(joints.len()))?;
        Ok(Exposed { stripe, time_ns: step.camera().map(|_| reading.time_ns), capture })
    }

    /// Fetches what the sensor has made of the last picture, and keeps it.
    fn fetch_stripe(
        &mut self,
        step: &ScanStep,
        at: &StepContext,
        made: &mut ScanProgress,
    ) -> Result<(), StepError> {
        let Some(Exposed { stripe, time_ns, capture }) = made.worked_on.clone() else { return Ok(()) };
        if let Some(time_ns) = time_ns {
            let read = self.sensor(&step.sensor)?.link.read(time_ns);
            read.map_err(|error| self.device_error(error))?;
        }
        let Some((header, points)) = self.stripes_of(step)?.pop() else {
            return Err(StepError::error(format!(
                "{} has reported no stripe: it is no light stripe sensor, or looks for something else",
                step.sensor
            )));
        };
        if let Some(fault) = StripeFault::from_code(header.fault) {
            self.journal.progress(&at.path, None, format!("stripe {}: {}", stripe + 1, fault.name()));
        }
        self.keep_stripe(step, at, capture, (&header, &points), made);
        made.worked_on = None;
        Ok(())
    }

    /// What the sensor has reported since it was last asked.
    pub(crate) fn stripes_of(&mut self, step: &ScanStep) -> Result<Vec<Stripe>, StepError> {
        let taken = self.sensor(&step.sensor)?.link.stripes();
        taken.map_err(|error| self.device_error(error))
    }

    /// Where the arm is with these joints, as the drive has them, on the way it last set out on.
    pub(crate) fn capture(
        &mut self,
        step: &ScanStep,
        joints: &JointVector,
        speeds: &JointVector,
    ) -> Result<Capture, StepError> {
        let arm = self.arm(&step.robot)?;
        Ok(Capture {
            pose: arm.corrected(joints),
            approach: arm.sides().to_vec(),
            speeds: speeds.as_slice().to_vec(),
            base_from_flange: arm.flange(joints).map_err(StepError::error)?,
        })
    }

    /// Adds a stripe to the cloud, in the base's frame.
    pub(crate) fn keep_stripe(
        &mut self,
        step: &ScanStep,
        at: &StepContext,
        capture: Capture,
        (header, points): (&StripeHeader, &[StripePoint]),
        made: &mut ScanProgress,
    ) {
        let ScanProgress { cloud, empty, .. } = made;
        if let Some(fault) = StripeFault::from_code(header.fault) {
            empty.add(fault);
        }
        let stripe = cloud.poses.len() as u32;
        cloud.poses.push(capture.pose);
        cloud.times.push(header.time_ns as f64 * 1e-9);
        cloud.approaches.push(capture.approach);
        cloud.speeds.push(capture.speeds);
        let mut positions = Vec::with_capacity(points.len());
        for point in points {
            let [x, y, z] = point.flange_mm.map(f64::from);
            let position = capture.base_from_flange * Point3::new(x, y, z);
            if position.iter().all(|axis| axis.is_finite()) {
                cloud.points.push(CloudPoint { position, stripe, seen: *point });
                positions.push(position.coords.map(|axis| axis as f32).into());
            }
        }
        self.journal.stripe(&at.path, &step.sensor, stripe, positions);
    }

    fn joint_names(&mut self, robot: &str) -> Result<Vec<String>, StepError> {
        let arm = self.arm(robot)?;
        Ok(arm.description.joints.iter().map(|joint| joint.name.clone()).collect())
    }
}

/// Fits a surface and adds what was found to the result; a sentence about it.
fn fit(fitted: Fitted, cloud: &Cloud, result: &mut Map<String, Value>) -> Result<String, StepError> {
    let wrong = |error: plumb_cloud::FitError| StepError::error(error.to_string());
    let mut add = |name: &str, value: f64| {
        result.insert(name.to_owned(), json!(value));
    };
    Ok(match fitted {
        Fitted::Plane => {
            let plane = cloud.fit_plane().map_err(wrong)?;
            add("rms_mm", plane.rms_mm);
            add("thickness_mm", plane.thickness_mm);
            for (name, value) in ["normal_x", "normal_y", "normal_z"].into_iter().zip(plane.normal.iter()) {
                add(name, *value);
            }
            add("offset_mm", plane.offset_mm);
            format!(", {:.3} mm rms from a plane, edge-on {:.3} mm thick", plane.rms_mm, plane.thickness_mm)
        }
        Fitted::Pyramid => {
            let pyramid = cloud.fit_pyramid().map_err(wrong)?;
            add("rms_mm", pyramid.rms_mm);
            for (name, value) in ["apex_x_mm", "apex_y_mm", "apex_z_mm"].into_iter().zip(pyramid.apex.iter())
            {
                add(name, *value);
            }
            let [x, y, z] = pyramid.apex.coords.into();
            format!(", apex at [{x:.3}, {y:.3}, {z:.3}] mm, {:.3} mm rms from its faces", pyramid.rms_mm)
        }
        Fitted::Sphere => {
            let sphere = cloud.fit_sphere().map_err(wrong)?;
            add("rms_mm", sphere.rms_mm);
            for (name, value) in
                ["centre_x_mm", "centre_y_mm", "centre_z_mm"].into_iter().zip(sphere.centre.iter())
            {
                add(name, *value);
            }
            add("radius_mm", sphere.radius_mm);
            format!(", a ball of {:.3} mm radius, {:.3} mm rms from it", sphere.radius_mm, sphere.rms_mm)
        }
    })
}
