//! The world of an arm as it is served.

use super::ArmWorld;
use super::drive::JointDrive;
use super::measuring::{LevelStep, MeasuringError};
use super::shutter::Shutter;
use crate::joint_values::JointValues;
use crate::physics::description::Motion;
use crate::protocol::{Axis, Instrument, JointFacts, JointUnit, Reading, TruthReport};
use crate::served_world::{
    Arm, ArmFacts, Camera, Exposure, Fingers, LevelledJoints, MotionRequest, Operator, ServedWorld,
    StepperMotors, Switch, Use,
};

/// As near as an arm that is set continuously comes to what the operator sees, rad or mm.
const SEEN_WITHIN: f64 = 1e-6;

/// How far the operator goes back before coming to a bubble from the right side once more, deg: more than any play.
const BACK_BEYOND_DEG: f64 = 2.0;

/// Said of a world file without `light:`.
const NO_RIG: &str = "no rig is on this arm's hand: describe it under `light:` in the world file";

impl ArmWorld {
    /// What the camera sees now.
    pub(super) fn exposure(&mut self) -> Result<Exposure, String> {
        let light = self.description.light.clone().ok_or(NO_RIG)?;
        let arm_state = self.arm_state().map_err(|error| error.to_string())?;
        self.exposures += 1;
        Ok(Exposure {
            // The shutter opens later than the camera says.
            time_ns: self.time_ns.saturating_add_signed(-light.exposure_delay_ns),
            light,
            world_from_flange: arm_state.link_frames.world_from_flange,
            switches: self.switches,
            number: self.exposures,
            waiting: 0,
        })
    }

    /// One value for each joint, as messages hold them. The file's reader lets no arm have more joints than fit.
    fn listed(values: &[f64]) -> JointValues {
        JointValues::from_slice(values).unwrap_or(JointValues::none())
    }

    /// What a driver may know of a joint.
    fn joint_facts(&self, joint: &JointDrive, start: f64) -> JointFacts {
        let [lower, upper] = joint.limits;
        JointFacts {
            name: joint.name.clone(),
            unit: match joint.motion {
                Motion::Turns => JointUnit::Rad,
                Motion::Slides => JointUnit::Mm,
            },
            lower,
            upper,
            resolution: self.description.paper.drive.step(joint),
            top_speed: joint.top_speed,
            home: start,
        }
    }
}

/// Nothing is wired to the controller of such an arm.
pub(crate) const INPUT_LINES: u32 = 0;

impl ServedWorld for ArmWorld {
    fn title(&self) -> &str {
        &self.description.title
    }

    fn sealed_text(&self) -> Option<&str> {
        self.description.sealed_text.as_deref()
    }

    fn advance(&mut self, until_ns: u64) {
        ArmWorld::advance(self, until_ns);
    }

    fn again(&self, seed: u64) -> Box<dyn ServedWorld> {
        let mut description = self.description.clone();
        description.seed = seed;
        Box::new(ArmWorld::beginning(description, self.time_ns))
    }

    fn switch(&self) -> Option<&dyn Switch> {
        None
    }

    fn switch_mut(&mut self) -> Option<&mut dyn Switch> {
        None
    }

    fn camera(&mut self) -> Option<&mut dyn Camera> {
        Some(self)
    }

    fn levelled_joints(&mut self) -> Option<&mut dyn LevelledJoints> {
        Some(self)
    }

    fn stepper_motors(&mut self) -> Option<&mut dyn StepperMotors> {
        None
    }

    fn fingers(&mut self) -> Option<&mut dyn Fingers> {
        None
    }
}

impl Arm for ArmWorld {
    fn facts(&self) -> ArmFacts {
        let paper = &self.description.paper;
        let joints = paper.drive.joints.iter().zip(&self.description.start);
        ArmFacts {
            name: paper.name.clone(),
            model: paper.model.clone(),
            joints: joints.map(|(joint, start)| self.joint_facts(joint, *start)).collect(),
            input_lines: INPUT_LINES,
            output_lines: 0,
            braking_ms: (paper.drive.braking_s * 1e3).ceil() as u32,
        }
    }

    fn reading(&self) -> Reading {
        Reading {
            time_ns: self.time_ns,
            moving: self.travel.is_some(),
            stopped: false,
            joints: Self::listed(&self.believed),
            half_steps: Self::listed(&self.description.paper.drive.encoder_counts(&self.believed)),
            inputs: 0,
            outputs: self.outputs,
            grip: false,
            pendant: false,
            key: 0,
        }
    }

    fn truth(&self) -> Result<TruthReport, String> {
        let arm_state = self.arm_state().map_err(|error| error.to_string())?;
        let flange = arm_state.link_frames.world_from_flange;
        let wrist = self.description.paper.wrist.and_then(|joint| arm_state.link_frames.axes.get(joint));
        Ok(TruthReport {
            time_ns: self.time_ns,
            counted: Self::listed(&self.believed),
            attitudes: Self::listed(&arm_state.angles),
            wrist_mm: wrist.map_or(flange.translation, |axis| axis.point).into(),
            sensor_mm: flange.apply(self.description.tool.tip).into(),
            signal: 0.0,
            fired: false,
            touching: false,
            lost_half_steps: Self::listed(&vec![0.0; self.believed.len()]),
        })
    }

    fn motion_ends_ns(&self) -> Option<u64> {
        self.travel_ends_ns()
    }

    fn begin(&mut self, request: &MotionRequest) -> Result<(), String> {
        let (given, joints) = (request.joints.len(), self.believed.len());
        if given != joints {
            return Err(super::TravelRefused::Count { given, joints }.to_string());
        }
        let mut target = self.believed.clone();
        for (target, requested) in target.iter_mut().zip(&request.joints) {
            match requested {
                Some(by) if request.relative => *target += by,
                Some(to) => *target = *to,
                None => {}
            }
        }
        ArmWorld::begin(self, &target, request.speed).map_err(|refused| refused.to_string())
    }

    fn follow(&mut self, joints: &[f64], duration_ns: u64) -> Result<(), String> {
        ArmWorld::follow(self, joints, duration_ns).map_err(|refused| refused.to_string())
    }

    fn halt(&mut self) {
        self.brake();
    }

    fn set_registers(&mut self, joints: &[f64]) -> Result<(), String> {
        self.declare(joints).map_err(|refused| refused.to_string())
    }

    fn set_outputs(&mut self, bits: u64) {
        self.outputs = bits;
    }
}

impl Operator for ArmWorld {
    fn request_toward(&self, joints: &[Option<f64>]) -> MotionRequest {
        // An arm that finds no equilibrium is nowhere: nothing is moved.
        let here = self.arm_state().map(|arm_state| arm_state.angles).unwrap_or_default();
        let short = |axis: usize| Some(joints.get(axis).copied().flatten()? - here.get(axis)?);
        let joints = (0..self.believed.len()).map(short).collect();
        MotionRequest { joints, relative: true, speed: 1.0 }
    }

    fn is_at(&self, joints: &[Option<f64>]) -> bool {
        let request = self.request_toward(joints);
        let drive = &self.description.paper.drive;
        request.joints.iter().zip(&drive.joints).all(|(short, joint)| {
            let near = (0.6 * drive.step(joint)).max(SEEN_WITHIN);
            short.is_none_or(|short| short.abs() <= near)
        })
    }

    fn measure(&mut self, used: &Use<'_>) -> Result<(f64, &'static str), String> {
        let measured = match used.with {
            Instrument::Ruler => self.read_ruler(used.at).map(|height| (height, "mm")),
            Instrument::Tracker => self.read_tracker(used.at, used.axis).map(|coordinate| (coordinate, "mm")),
            Instrument::Board => self.read_board(false, used.axis).map(|coordinate| (coordinate, "mm")),
            Instrument::Probe => self.read_probe(used.at.unwrap_or_default()).map(|off| (off, "mm")),
            Instrument::BoardTurn => self.read_board(true, used.axis).map(|turn| (turn, "rad")),
            Instrument::Level => {
                self.read_level(used.at.unwrap_or_default(), used.turned).map(|tilt| (tilt, "deg"))
            }
        };
        measured.map_err(|error: MeasuringError| error.to_string())
    }

    fn read_profile(&mut self, of: &str, point: usize, axis: Axis) -> Result<f64, String> {
        ArmWorld::read_profile(self, of, point, axis).map_err(|error| error.to_string())
    }

    fn hang(&mut self, mass_kg: f64) -> Result<(), String> {
        ArmWorld::hang(self, mass_kg).map_err(|refused| refused.to_string())
    }
}

impl Camera for ArmWorld {
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

    fn shine(&mut self, laser: Option<bool>, filter: Option<bool>) {
        self.switches.laser = laser.unwrap_or(self.switches.laser);
        self.switches.filter = filter.unwrap_or(self.switches.filter);
    }
}

impl LevelledJoints for ArmWorld {
    fn level_request(&mut self, joint: &str, used: &Use<'_>) -> Result<Option<MotionRequest>, String> {
        let joint = self.description.joint_named(joint)?;
        let at = used.at.unwrap_or_default();
        let by = match self.level_step(joint, at, used.turned).map_err(|error| error.to_string())? {
            LevelStep::Done => return Ok(None),
            // Past it, back beyond where it is to come from, and once more from there.
            LevelStep::Turn(by) if used.rising.is_some_and(|rising| rising != (by > 0.0)) => {
                by + by.signum() * BACK_BEYOND_DEG.to_radians()
            }
            LevelStep::Turn(by) => by,
        };
        let joints = (0..self.believed.len()).map(|axis| (axis == joint).then_some(by)).collect();
        Ok(Some(MotionRequest { joints, relative: true, speed: 0.1 }))
    }
}
