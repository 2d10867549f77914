//! The world of a PUMA 560 as it is served.

use super::joints::{AXES, JOINTS, encoder_counts};
use super::measuring::{Levelling, MeasuringError, joint_named, only};
use super::shutter::Shutter;
use super::{PumaWorld, Resolution};
use crate::protocol::{Instrument, JointFacts, JointUnit, Reading, TruthReport};
use crate::served_world::{ArmFacts, Exposure, ServedWorld, Use};
use crate::world::MotionOrder;
use crate::world_file::Described;

/// As near as an arm that is set continuously comes to what the operator sees, rad.
const SEEN_WITHIN: f64 = 1e-6;

/// How far the operator goes back before coming to a bubble from the right side once more, deg: more than any play.
const BACK_BEYOND_DEG: f64 = 2.0;

/// Said of a world file without `light:`.
const NO_RIG: &str = "no rig is on this arm's hand: describe it under `light:` in the world file";

impl PumaWorld {
    /// What the camera sees now.
    pub(super) fn exposure(&mut self) -> Result<Exposure, String> {
        let light = self.description.light.clone().ok_or(NO_RIG)?;
        let stance = self.standing().map_err(|error| error.to_string())?;
        self.exposures += 1;
        Ok(Exposure {
            // The shutter opens later than the camera says.
            time_ns: self.time_ns.saturating_add_signed(-light.exposure_delay_ns),
            light,
            world_from_flange: stance.posture.world_from_flange,
            switches: self.switches,
            number: self.exposures,
            waiting: 0,
        })
    }
}

impl ServedWorld for PumaWorld {
    fn title(&self) -> &str {
        &self.description.title
    }

    fn arm(&self) -> ArmFacts {
        let joints = JOINTS.iter().zip(&self.description.start).map(|(joint, start)| {
            let [lower, upper] = joint.limits_deg.map(f64::to_radians);
            JointFacts {
                name: joint.name.to_owned(),
                unit: JointUnit::Rad,
                lower,
                upper,
                resolution: match self.description.resolution {
                    Resolution::Continuous => 0.0,
                    Resolution::Encoder => (1.0 / joint.counts_per_deg).to_radians(),
                },
                top_speed: joint.top_speed_deg.to_radians(),
                home: *start,
            }
        });
        ArmFacts {
            name: "puma560",
            model: "Unimation PUMA 560",
            joints: joints.collect(),
            input_lines: 0,
            output_lines: 0,
        }
    }

    fn sealed_text(&self) -> Option<&str> {
        self.description.sealed_text.as_deref()
    }

    fn reading(&self) -> Reading {
        Reading {
            time_ns: self.time_ns,
            moving: self.travel.is_some(),
            stopped: false,
            joints: self.believed,
            half_steps: encoder_counts(&self.believed),
            inputs: 0,
            outputs: self.outputs,
            grip: false,
            pendant: false,
            key: 0,
        }
    }

    fn truth(&self) -> Result<TruthReport, String> {
        let stance = self.standing().map_err(|error| error.to_string())?;
        let mut attitudes = [0.0; AXES];
        for (attitude, angle) in attitudes.iter_mut().zip(&stance.angles) {
            *attitude = *angle;
        }
        let flange = stance.posture.world_from_flange;
        let wrist = stance.posture.axes.get(4).map_or(flange.translation, |axis| axis.point);
        Ok(TruthReport {
            time_ns: self.time_ns,
            reckoned: self.believed,
            attitudes,
            wrist_mm: wrist.into(),
            sensor_mm: flange.apply(self.description.cage.tip).into(),
            signal: 0.0,
            fired: false,
            touching: false,
            lost_half_steps: [0.0; AXES],
        })
    }

    fn advance(&mut self, until_ns: u64) {
        PumaWorld::advance(self, until_ns);
    }

    fn motion_ends_ns(&self) -> Option<u64> {
        self.travel_ends_ns()
    }

    fn begin(&mut self, order: &MotionOrder) -> Result<(), String> {
        let mut target = self.believed;
        for (target, wanted) in target.iter_mut().zip(&order.joints) {
            match wanted {
                Some(by) if order.relative => *target += by,
                Some(to) => *target = *to,
                None => {}
            }
        }
        PumaWorld::begin(self, target, order.speed).map_err(|refused| refused.to_string())
    }

    fn halt(&mut self) {
        self.brake();
    }

    fn set_registers(&mut self, joints: [f64; AXES]) -> Result<(), String> {
        self.declare(joints).map_err(|refused| refused.to_string())
    }

    fn set_outputs(&mut self, bits: u64) {
        self.outputs = bits;
    }

    fn order_toward(&self, joints: &[Option<f64>; AXES]) -> MotionOrder {
        let here = self.standing().map(|stance| stance.angles).unwrap_or_default();
        let short = std::array::from_fn(|axis| {
            let (wanted, here) = (joints.get(axis).copied().flatten()?, here.get(axis)?);
            Some(wanted - here)
        });
        MotionOrder { joints: short, relative: true, speed: 1.0 }
    }

    fn stands_at(&self, joints: &[Option<f64>; AXES]) -> bool {
        let order = self.order_toward(joints);
        order.joints.iter().zip(&JOINTS).all(|(short, joint)| {
            let near = match self.description.resolution {
                Resolution::Continuous => SEEN_WITHIN,
                Resolution::Encoder => (0.6 / joint.counts_per_deg).to_radians(),
            };
            short.is_none_or(|short| short.abs() <= near)
        })
    }

    fn measure(&mut self, used: &Use<'_>) -> Result<(f64, &'static str), String> {
        let measured = match used.with {
            Instrument::Ruler => self.read_ruler(used.at).map(|height| (height, "mm")),
            Instrument::Tracker => self.read_tracker(used.at, used.axis).map(|place| (place, "mm")),
            Instrument::Level => {
                let at =
                    used.at.ok_or_else(|| MeasuringError::NoPlace { given: String::new() }.to_string())?;
                self.read_level(at, used.turned).map(|tilt| (tilt, "deg"))
            }
        };
        measured.map_err(|error| error.to_string())
    }

    fn hang(&mut self, mass_kg: f64) -> Result<(), String> {
        PumaWorld::hang(self, mass_kg).map_err(|refused| refused.to_string())
    }

    fn again(&self, described: Described) -> Box<dyn ServedWorld> {
        match described {
            Described::Puma(described) => Box::new(PumaWorld::beginning(*described, self.time_ns)),
            other => other.into_world(),
        }
    }

    fn expose(&mut self) -> Result<Exposure, String> {
        match self.shutter.waiting.pop_front() {
            Some(taken) => Ok(Exposure { waiting: self.shutter.waiting.len() as u32, ..taken }),
            None => self.exposure(),
        }
    }

    fn set_shutter(&mut self, every_ns: Option<u64>) -> Result<(), String> {
        if self.description.light.is_none() {
            return Err(NO_RIG.to_owned());
        }
        self.shutter = Shutter { every_ns, ..Shutter::default() };
        Ok(())
    }

    fn shine(&mut self, laser: Option<bool>, filter: Option<bool>) -> Result<(), String> {
        self.switches.laser = laser.unwrap_or(self.switches.laser);
        self.switches.filter = filter.unwrap_or(self.switches.filter);
        Ok(())
    }

    fn level_order(&mut self, joint: &str, used: &Use<'_>) -> Result<Option<MotionOrder>, String> {
        let joint = joint_named(joint)?;
        let at = used.at.unwrap_or_default();
        let by = match self.levelling(joint, at, used.turned).map_err(|error| error.to_string())? {
            Levelling::Done => return Ok(None),
            // Past it, back beyond where it is to come from, and once more from there.
            Levelling::Turn(by) if used.rising.is_some_and(|rising| rising != (by > 0.0)) => {
                by + by.signum() * BACK_BEYOND_DEG.to_radians()
            }
            Levelling::Turn(by) => by,
        };
        Ok(Some(MotionOrder { joints: only(joint, by), relative: true, speed: 0.1 }))
    }
}
