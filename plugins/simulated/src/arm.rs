//! An arm of any build on a table, a tool on its flange, an operator with a spirit level, a ruler and a laser tracker, and a clock of its own.
//! A PUMA 560 is one of these ([`puma560`]); any other is described by files ([`mod@file`]).
//!
//! The arm is a product of exponentials with the mechanics of [`crate::physics`]: what its controller believes goes through gears that run out of
//! true, play and coupled wrists, and its links are where their weight and the tool's balance what yields. The controller's zeros are its own
//! matter: what it believes differs from what its encoders show by an offset for each joint, which a new calibration changes.

mod board_camera;
mod calibration;
mod description;
mod drive;
pub mod file;
mod line_sensor;
mod measuring;
pub mod puma560;
pub(crate) mod served;
mod shutter;
mod touch_probe;
mod travel;

pub use description::{
    ArmOnPaper, ArmWorldDescription, BoardCamera, LevelDirection, LevelSurface, LineSensor, Sight,
    SpiritLevel, Tabletop, Tool, TouchProbe,
};
pub use drive::{Drive, JointDrive, MotorCoupling};
pub use measuring::MeasuringError;

use crate::light::Switches;
use crate::physics::machine::{ArmState, Conditions, Machine, NoEquilibrium};
use shutter::Shutter;
use travel::Travel;

/// Temperature of the room, degrees Celsius.
const ROOM_C: f64 = 20.0;

/// The world's time at its beginning, ns: not 0, so that no moment of it can be taken for none.
const BEGINS_NS: u64 = 1_000_000_000;

/// The world and everything in it.
pub struct ArmWorld {
    description: ArmWorldDescription,
    machine: Machine,
    time_ns: u64,
    /// When the arm was switched on.
    began_ns: u64,
    /// Where the controller believes the joints to be, rad or mm.
    believed: Vec<f64>,
    /// What the drive's own values are beyond that, rad or mm: the error of each joint's zero.
    offset: Vec<f64>,
    travel: Option<Travel>,
    outputs: u64,
    readings_taken: u64,
    /// Of the board, the last that was taken.
    picture: Option<board_camera::Picture>,
    /// Of the laser line sensor, the last profile that was taken: x and z of its points, mm.
    profile: Vec<[f64; 2]>,
    switches: Switches,
    exposures: u64,
    shutter: Shutter,
    /// On the flange, beside the tool, kg.
    hung_kg: f64,
}

/// Why the arm does not start to move.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TravelRefused {
    /// Another motion is under way.
    #[error("the arm is moving already; wait for it or stop it first")]
    Moving,
    /// A value is not a finite number.
    #[error("the target of joint `{0}` is not a finite number")]
    NotFinite(String),
    /// The arm would run into a joint's stop.
    #[error(
        "joint `{joint}` has its stops at {lower:.0} and {upper:.0} {unit}; {target:.2} {unit} lies beyond them"
    )]
    Stop {
        /// The joint.
        joint: String,
        /// Lower stop, degrees or mm.
        lower: f64,
        /// Upper stop, degrees or mm.
        upper: f64,
        /// What was asked for, degrees or mm.
        target: f64,
        /// Degrees or mm.
        unit: &'static str,
    },
    /// More than the arm carries.
    #[error("{mass_kg} kg cannot be hung on the flange: it takes 0 to {most_kg} kg beside the tool")]
    Load {
        /// What was to be hung there, kg.
        mass_kg: f64,
        /// The most it takes, kg.
        most_kg: f64,
    },
    /// A list of values for another arm.
    #[error("{given} joint values for an arm of {joints} joints")]
    Count {
        /// How many were given.
        given: usize,
        /// How many the arm has.
        joints: usize,
    },
    /// The controller's calibration cannot be kept.
    #[error("the controller took the pose over, but its calibration file {0} cannot be written: {1}")]
    NotKept(String, std::io::ErrorKind),
    /// The speed is out of its range.
    #[error("the speed must be a fraction of the greatest, 0.001 to 1")]
    Speed,
}

impl ArmWorld {
    /// A world at its beginning: the arm is where it was left, and the controller believes what the file says.
    pub fn new(description: ArmWorldDescription) -> Self {
        let joints = &description.paper.drive.joints;
        let kept = description.calibration.as_deref().and_then(|file| calibration::read(file, joints));
        let mut world = Self::beginning(description, BEGINS_NS);
        if let Some(kept) = kept {
            for (offset, shift) in world.offset.iter_mut().zip(&kept) {
                *offset += shift;
            }
            world.drive_to(world.believed.clone());
        }
        world
    }

    /// The same at another moment of the world's time: the arm is switched on then.
    pub(crate) fn beginning(description: ArmWorldDescription, began_ns: u64) -> Self {
        let machine = Machine::new(&description.arm(), &description.imperfections);
        let mut world = Self {
            believed: description.start.clone(),
            offset: description.drawn_zero_error(),
            machine,
            time_ns: began_ns,
            began_ns,
            travel: None,
            outputs: 0,
            readings_taken: 0,
            picture: None,
            profile: Vec::new(),
            switches: description
                .light
                .as_ref()
                .map_or(Switches { laser: false, filter: false }, |light| light.switches),
            exposures: 0,
            shutter: Shutter::default(),
            hung_kg: 0.0,
            description,
        };
        world.drive_to(world.description.start.clone());
        world
    }

    /// How the world was described.
    pub fn description(&self) -> &ArmWorldDescription {
        &self.description
    }

    /// Where the controller believes the joints to be, rad or mm.
    pub fn believed(&self) -> &[f64] {
        &self.believed
    }

    /// By how much each joint truly is beyond what the controller believes, its drive's own errors aside, rad or mm.
    pub fn zero_errors(&self) -> &[f64] {
        &self.offset
    }

    /// The status of the arm now.
    ///
    /// # Errors
    /// [`NoEquilibrium`] for an arm that is too soft for its weight.
    pub fn arm_state(&self) -> Result<ArmState, NoEquilibrium> {
        self.machine.equilibrium(&Conditions {
            time_s: (self.time_ns - self.began_ns) as f64 * 1e-9,
            temperature_c: ROOM_C,
            payload_kg: self.hung_kg,
        })
    }

    /// Has the controller believe that the arm is so; the arm does not stir.
    ///
    /// # Errors
    /// [`TravelRefused`] while it moves, or for what is no number.
    pub fn declare(&mut self, joints: &[f64]) -> Result<(), TravelRefused> {
        if self.travel.is_some() {
            return Err(TravelRefused::Moving);
        }
        self.require_values(joints)?;
        for ((offset, believed), declared) in self.offset.iter_mut().zip(&self.believed).zip(joints) {
            *offset += believed - declared;
        }
        self.believed = joints.to_vec();
        self.keep_calibration()
    }

    /// Writes down by how much the controller's zeros differ from those it came with.
    fn keep_calibration(&self) -> Result<(), TravelRefused> {
        let Some(file) = &self.description.calibration else { return Ok(()) };
        let mut shift = self.offset.clone();
        for (shift, drawn) in shift.iter_mut().zip(self.description.drawn_zero_error()) {
            *shift -= drawn;
        }
        calibration::write(file, &self.description.paper.drive.joints, &shift)
            .map_err(|error| TravelRefused::NotKept(file.display().to_string(), error.kind()))
    }

    /// Hangs a weight (kg) on the flange beside the tool, in place of what hung there.
    ///
    /// # Errors
    /// [`TravelRefused::Load`] for more than the arm is built to carry or less than nothing.
    pub fn hang(&mut self, mass_kg: f64) -> Result<(), TravelRefused> {
        let most_kg = self.description.paper.most_hung_kg;
        if !(0.0..=most_kg).contains(&mass_kg) {
            return Err(TravelRefused::Load { mass_kg, most_kg });
        }
        self.hung_kg = mass_kg;
        Ok(())
    }

    /// Starts a motion of all joints together to `target` (rad or mm, as the controller believes) at a fraction of full speed.
    ///
    /// # Errors
    /// [`TravelRefused`]; then the arm does not stir.
    pub fn begin(&mut self, target: &[f64], speed: f64) -> Result<(), TravelRefused> {
        if self.travel.is_some() {
            return Err(TravelRefused::Moving);
        }
        self.require_values(target)?;
        if !(0.001..=1.0).contains(&speed) {
            return Err(TravelRefused::Speed);
        }
        self.require_within_stops(target)?;
        let drive = &self.description.paper.drive;
        let target = drive.nearest_held(target);
        self.travel = Some(Travel::plan(drive, self.believed.clone(), target, speed, self.time_ns));
        self.shutter.set_out(self.time_ns);
        Ok(())
    }

    /// Leads the servos on: all joints go evenly from where they are to `target` (rad or mm, as the controller believes) within a time, ns.
    ///
    /// # Errors
    /// [`TravelRefused`] beyond a stop, or while a motion is under way that the arm makes by itself; then the arm goes on as it went.
    pub fn follow(&mut self, target: &[f64], duration_ns: u64) -> Result<(), TravelRefused> {
        if self.travel.as_ref().is_some_and(|travel| !travel.is_led()) {
            return Err(TravelRefused::Moving);
        }
        self.require_values(target)?;
        self.require_within_stops(target)?;
        if self.travel.is_none() {
            self.shutter.set_out(self.time_ns);
        }
        let target = self.description.paper.drive.nearest_held(target);
        self.travel = Some(Travel::led(self.believed.clone(), target, self.time_ns, duration_ns));
        Ok(())
    }

    /// No joint goes further beyond a stop than it is.
    fn require_within_stops(&self, target: &[f64]) -> Result<(), TravelRefused> {
        for ((joint, target), believed) in
            self.description.paper.drive.joints.iter().zip(target).zip(&self.believed)
        {
            let beyond = |value: f64| joint.beyond_stop(value);
            if beyond(*target) > beyond(*believed).max(1e-9) {
                return Err(TravelRefused::Stop {
                    joint: joint.name.clone(),
                    lower: joint.written(joint.stops[0]),
                    upper: joint.written(joint.stops[1]),
                    target: joint.written(*target),
                    unit: joint.unit(),
                });
            }
        }
        Ok(())
    }

    /// When the motion under way will end, world time, ns.
    pub fn travel_ends_ns(&self) -> Option<u64> {
        self.travel.as_ref().map(Travel::end_ns)
    }

    /// Brakes: the arm comes to rest a little further on its way.
    pub fn brake(&mut self) {
        if let Some(travel) = self.travel.take() {
            self.travel = Some(travel.braked(self.time_ns));
        }
    }

    /// Lets the world's time run to `until_ns`; earlier moments change nothing.
    pub fn advance(&mut self, until_ns: u64) {
        let until_ns = until_ns.max(self.time_ns);
        // At rest no picture is due: the camera takes pictures by itself only while the arm moves.
        let moves_until_ns = self.travel_ends_ns().map_or(0, |end_ns| end_ns.min(until_ns));
        while let Some(due_ns) = self.shutter.due_before(moves_until_ns) {
            self.go_on(due_ns);
            match self.exposure() {
                Ok(exposure) => self.shutter.took(exposure),
                // An arm that finds no equilibrium takes no pictures; anyone who asks for one learns why.
                Err(_) => break,
            }
        }
        self.go_on(until_ns);
    }

    /// Lets time run without a look at the camera.
    fn go_on(&mut self, until_ns: u64) {
        if let Some(travel) = self.travel.take() {
            let (reached_ns, joints) = travel.at(until_ns);
            self.time_ns = reached_ns;
            if reached_ns >= travel.end_ns() {
                let at_rest = self.description.paper.drive.nearest_held(&joints);
                self.drive_to(at_rest);
            } else {
                self.drive_to(joints);
                self.travel = Some(travel);
            }
        }
        self.time_ns = until_ns;
    }

    fn drive_to(&mut self, joints: Vec<f64>) {
        let driven: Vec<f64> =
            joints.iter().zip(&self.offset).map(|(joint, offset)| joint + offset).collect();
        self.believed = joints;
        self.machine.go(&driven, (self.time_ns - self.began_ns) as f64 * 1e-9);
    }

    /// A finite value for each joint.
    fn require_values(&self, values: &[f64]) -> Result<(), TravelRefused> {
        let joints = &self.description.paper.drive.joints;
        if values.len() != joints.len() {
            return Err(TravelRefused::Count { given: values.len(), joints: joints.len() });
        }
        let wrong = joints.iter().zip(values).find(|(_, value)| !value.is_finite());
        wrong.map_or(Ok(()), |(joint, _)| Err(TravelRefused::NotFinite(joint.name.clone())))
    }
}
