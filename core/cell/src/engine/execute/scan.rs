//! `scan`: a stripe at each place of a line, turned into points by the pose at the moment of its exposure.

use std::time::Instant;

use nalgebra::{IsometryMatrix3, Point3, Rotation3, Translation3, Vector3};
use plumb_plugin::{JointVector, StripeFault, StripeHeader, StripePoint};
use serde_json::{Map, Value, json};

use crate::cloud::{Cloud, CloudPoint};
use crate::device::Stripe;
use crate::engine::Engine;
use crate::engine::scope::named_value;
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::event::NamedValue;
use crate::expression::Expression;
use crate::step::{Fitted, ScanStep};

/// A scan with its numbers.
pub(super) struct Scan {
    from: Vector3<f64>,
    /// From the first stripe's middle to the last's.
    pub(super) way: Vector3<f64>,
    pub(super) stripes: usize,
    attitude: Rotation3<f64>,
    aim: Vector3<f64>,
}

/// Pictures without a stripe, and why.
#[derive(Default)]
pub(super) struct Empty {
    stripes: usize,
    faults: Vec<(StripeFault, usize)>,
}

impl Empty {
    fn add(&mut self, fault: StripeFault) {
        self.stripes += 1;
        match self.faults.iter_mut().find(|(known, _)| *known == fault) {
            Some((_, count)) => *count += 1,
            None => self.faults.push((fault, 1)),
        }
    }

    fn told(&self) -> String {
        let each = self.faults.iter().map(|(fault, count)| format!("{count} {}", fault.name()));
        each.collect::<Vec<_>>().join(", ")
    }

    /// What the most frequent fault is usually cured by.
    fn cure(&self) -> &'static str {
        match self.faults.iter().max_by_key(|(_, count)| *count).map(|(fault, _)| fault) {
            Some(StripeFault::Dark) => {
                "is the laser on, and does the sheet meet anything the camera sees there?"
            }
            Some(StripeFault::Bright) => "is the filter before the lens?",
            Some(StripeFault::Flat) => "turn the rig so that the stripe runs down the picture",
            Some(StripeFault::Ambiguous) => "what else shines there?",
            Some(StripeFault::Short) | None => "is the laser on, the filter in, the aim right?",
        }
    }
}

/// More stripes are a mistake.
const MOST_STRIPES: f64 = 10_000.0;

impl Engine {
    pub(super) fn execute_scan(&mut self, step: &ScanStep, at: &StepContext) -> Result<Done, StepError> {
        let begin = Instant::now();
        let scan = self.plan_scan(step, at)?;
        self.sensor(&step.sensor)?.link.arm().map_err(|error| self.device_error(error))?;
        // What was emitted before this scan is none of it.
        let _ = self.sensor(&step.sensor)?.link.stripes();
        let mut cloud = Cloud::default();
        let mut empty = Empty::default();
        let mut moving_s = 0.0;
        let flight = step.fly.as_ref().map(|fly| self.number(at.scope, fly)).transpose()?.unwrap_or(0.0);
        if flight != 0.0 {
            moving_s += self.fly(step, at, &scan, flight, &mut cloud, &mut empty)?;
        }
        for stripe in 0..if flight == 0.0 { scan.stripes } else { 0 } {
            let share = if scan.stripes > 1 { stripe as f64 / (scan.stripes - 1) as f64 } else { 0.0 };
            let leaving = Instant::now();
            self.go_to_stripe(step, at, &scan, share)?;
            moving_s += leaving.elapsed().as_secs_f64();
            self.take_stripe(step, at, stripe, &mut cloud, &mut empty)?;
            let text = format!("stripe {} of {}, {} points", stripe + 1, scan.stripes, cloud.points.len());
            self.journal.progress(&at.path, Some((stripe + 1) as f64 / scan.stripes as f64), text);
        }
        if cloud.points.is_empty() {
            return Err(StepError::error(format!(
                "none of the {} pictures showed a stripe ({}): {}",
                cloud.poses.len(),
                empty.told(),
                empty.cure()
            )));
        }
        let seconds = begin.elapsed().as_secs_f64();
        let mut result = Map::from_iter([
            ("points".to_owned(), json!(cloud.points.len())),
            ("stripes".to_owned(), json!(cloud.poses.len())),
            ("empty".to_owned(), json!(empty.stripes)),
            ("seconds".to_owned(), json!(seconds)),
            ("processing_percent".to_owned(), json!(100.0 * (1.0 - moving_s / seconds).max(0.0))),
        ]);
        let mut message = format!(
            "{} points of {} stripes ({} without one)",
            cloud.points.len(),
            cloud.poses.len(),
            empty.stripes
        );
        if let Some(fitted) = step.fit {
            message.push_str(&fit(fitted, &cloud, &mut result)?);
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
        let from = self.place(&step.from, at)?;
        let way = self.place(&step.to, at)? - from;
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

    /// The flange's attitude by tilt, azimuth and turn, deg, each 0 where it is left out: looking straight down.
    pub(super) fn attitude(
        &mut self,
        angles: [&Option<Expression>; 3],
        at: &StepContext,
    ) -> Result<Rotation3<f64>, StepError> {
        let mut angle = |expression: &Option<Expression>| match expression {
            None => Ok(0.0),
            Some(expression) => self.number(at.scope, expression).map(f64::to_radians),
        };
        let [tilt, azimuth, turn] = angles;
        let (tilt, azimuth, turn) = (angle(tilt)?, angle(azimuth)?, angle(turn)?);
        let about_z = |angle: f64| Rotation3::from_axis_angle(&Vector3::z_axis(), angle);
        let down = Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        // Tilted so that the flange stands in the direction of the azimuth and looks back at the place.
        let tilted =
            about_z(azimuth) * Rotation3::from_axis_angle(&Vector3::y_axis(), tilt) * about_z(-azimuth);
        Ok(tilted * about_z(turn) * down)
    }

    pub(super) fn place(
        &mut self,
        place: &[Expression; 3],
        at: &StepContext,
    ) -> Result<Vector3<f64>, StepError> {
        let [x, y, z] = place;
        Ok(Vector3::new(self.number(at.scope, x)?, self.number(at.scope, y)?, self.number(at.scope, z)?))
    }

    pub(super) fn go_to_stripe(
        &mut self,
        step: &ScanStep,
        at: &StepContext,
        scan: &Scan,
        share: f64,
    ) -> Result<(), StepError> {
        let (here, target) = self.stripe_target(step, scan, share)?;
        self.move_arm(&step.robot, &here, &target, step.speed, at).map(drop)
    }

    /// Where the drive stands, and what it has to be told to bring the aim to a share of the way.
    pub(super) fn stripe_target(
        &mut self,
        step: &ScanStep,
        scan: &Scan,
        share: f64,
    ) -> Result<(JointVector, JointVector), StepError> {
        let place = scan.from + scan.way * share;
        let origin = place - scan.attitude * scan.aim;
        let wanted = IsometryMatrix3::from_parts(Translation3::from(origin), scan.attitude);
        let here = self.read_pose(&step.robot)?.joints;
        let arm = self.arm(&step.robot)?;
        let target = arm.joints_for(&wanted, &here).map_err(|cause| {
            StepError::error(format!(
                "no stripe at [{:.1}, {:.1}, {:.1}] mm: {cause}",
                place.x, place.y, place.z
            ))
        })?;
        arm.check_move(&here, &target).map_err(|reason| StepError::error(reason.to_string()))?;
        Ok((here, target))
    }

    /// Takes a stripe where the arm stands.
    fn take_stripe(
        &mut self,
        step: &ScanStep,
        at: &StepContext,
        stripe: usize,
        cloud: &mut Cloud,
        empty: &mut Empty,
    ) -> Result<(), StepError> {
        self.take_reading(&step.sensor, step.camera())?;
        let taken = self.stripes_of(step)?;
        let Some((header, points)) = taken.last() else {
            return Err(StepError::error(format!(
                "{} has told no stripe: it is no light stripe sensor, or looks for something else",
                step.sensor
            )));
        };
        if let Some(fault) = StripeFault::from_code(header.fault) {
            self.journal.progress(&at.path, None, format!("stripe {}: {}", stripe + 1, fault.name()));
        }
        self.keep_stripe(step, at, header, points, cloud, empty)
    }

    /// What the sensor has told since it was last asked.
    pub(super) fn stripes_of(&mut self, step: &ScanStep) -> Result<Vec<Stripe>, StepError> {
        let taken = self.sensor(&step.sensor)?.link.stripes();
        taken.map_err(|error| self.device_error(error))
    }

    /// Adds a stripe to the cloud, in the base's frame.
    pub(super) fn keep_stripe(
        &mut self,
        step: &ScanStep,
        at: &StepContext,
        header: &StripeHeader,
        points: &[StripePoint],
        cloud: &mut Cloud,
        empty: &mut Empty,
    ) -> Result<(), StepError> {
        if let Some(fault) = StripeFault::from_code(header.fault) {
            empty.add(fault);
        }
        let joints = match header.joints.len() {
            0 => self.read_pose(&step.robot)?.joints,
            _ => header.joints,
        };
        let arm = self.arm(&step.robot)?;
        let base_from_flange = arm.flange(&joints).map_err(StepError::error)?;
        let stripe = cloud.poses.len() as u32;
        cloud.poses.push(arm.corrected(&joints));
        cloud.approaches.push(arm.sides().to_vec());
        cloud.speeds.push(header.speeds.as_slice().to_vec());
        let mut places = Vec::with_capacity(points.len());
        for point in points {
            let [x, y, z] = point.flange_mm.map(f64::from);
            let place = base_from_flange * Point3::new(x, y, z);
            if place.iter().all(|axis| axis.is_finite()) {
                cloud.points.push(CloudPoint { place, stripe, seen: *point });
                places.push(place.coords.map(|axis| axis as f32).into());
            }
        }
        self.journal.stripe(&at.path, &step.sensor, stripe, places);
        Ok(())
    }

    fn joint_names(&mut self, robot: &str) -> Result<Vec<String>, StepError> {
        let arm = self.arm(robot)?;
        Ok(arm.description.joints.iter().map(|joint| joint.name.clone()).collect())
    }
}

/// Fits a surface and adds what was found to the result; a sentence about it.
fn fit(fitted: Fitted, cloud: &Cloud, result: &mut Map<String, Value>) -> Result<String, StepError> {
    let wrong = |error: crate::cloud::FitError| StepError::error(error.to_string());
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
