//! A PUMA 560 on a table, a cage on its flange, an operator with a spirit level and a ruler, and a clock of its own.
//!
//! The arm is a product of exponentials with the mechanics of [`crate::physics`]: what its controller believes goes through gears that run out of
//! true, play and coupled wrists, and its links stand where their weight and the cage's balance what yields. The controller's zeros are its own
//! matter: what it believes differs from what its encoders show by an offset for each joint, which a new calibration changes.

mod calibration;
mod description;
pub(crate) mod file;
mod joints;
mod measuring;
mod served;
mod shutter;
mod travel;

pub use description::{Cage, PumaDescription, Resolution, SpiritLevel, Tabletop};
pub use joints::{JOINTS, JointOfPuma, encoder_counts};
pub use measuring::{LevelPlace, MeasuringError};

use crate::light::Switches;
use crate::physics::machine::{Conditions, Machine, NoEquilibrium, Stance};
use joints::{AXES, nearest_counted};
use shutter::Shutter;
use travel::Travel;

/// Temperature of the room, degrees Celsius.
const ROOM_C: f64 = 20.0;

/// The world's time at its beginning, ns: not 0, so that no moment of it can be taken for none.
const BEGINS_NS: u64 = 1_000_000_000;

/// What may hang on the flange beside the cage, kg.
const MOST_HUNG_KG: f64 = 4.0;

/// The world and everything in it.
pub struct PumaWorld {
    description: PumaDescription,
    machine: Machine,
    time_ns: u64,
    /// When the arm was switched on.
    began_ns: u64,
    /// Where the controller believes the joints to stand, rad.
    believed: [f64; AXES],
    /// What the drive's own angles are beyond that, rad: the error of each joint's zero.
    offset: [f64; AXES],
    travel: Option<Travel>,
    outputs: u64,
    readings_taken: u64,
    switches: Switches,
    exposures: u64,
    shutter: Shutter,
    /// On the flange, beside the cage, kg.
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
    NotFinite(&'static str),
    /// The arm would run into a joint's stop.
    #[error(
        "joint `{joint}` has its stops at {lower:.0} and {upper:.0} deg; {target:.2} deg lies beyond them"
    )]
    Stop {
        /// The joint.
        joint: &'static str,
        /// Lower stop, degrees.
        lower: f64,
        /// Upper stop, degrees.
        upper: f64,
        /// What was asked for, degrees.
        target: f64,
    },
    /// More than the arm carries.
    #[error("{0} kg cannot be hung on the flange: it takes 0 to {MOST_HUNG_KG} kg beside the cage")]
    Load(f64),
    /// The controller's calibration cannot be kept.
    #[error("the controller took the pose over, but its calibration file {0} cannot be written: {1}")]
    NotKept(String, std::io::ErrorKind),
    /// The speed is out of its range.
    #[error("the speed must be a share of the greatest, 0.001 to 1")]
    Speed,
}

impl PumaWorld {
    /// A world at its beginning: the arm stands where it was left, and the controller believes what the file says.
    pub fn new(description: PumaDescription) -> Self {
        let kept = description.calibration.as_deref().and_then(calibration::read);
        let mut world = Self::beginning(description, BEGINS_NS);
        if let Some(kept) = kept {
            for (offset, shift) in world.offset.iter_mut().zip(&kept) {
                *offset += shift;
            }
            world.drive_to(world.believed);
        }
        world
    }

    /// The same at another moment of the world's time: the arm is switched on then.
    pub(crate) fn beginning(description: PumaDescription, began_ns: u64) -> Self {
        let machine = Machine::new(&description.arm(), &description.imperfections);
        let mut world = Self {
            believed: description.start,
            offset: description.drawn_zero_error(),
            machine,
            time_ns: began_ns,
            began_ns,
            travel: None,
            outputs: 0,
            readings_taken: 0,
            switches: description
                .light
                .as_ref()
                .map_or(Switches { laser: false, filter: false }, |light| light.switches),
            exposures: 0,
            shutter: Shutter::default(),
            hung_kg: 0.0,
            description,
        };
        world.drive_to(world.description.start);
        world
    }

    /// How the world was described.
    pub fn description(&self) -> &PumaDescription {
        &self.description
    }

    /// Where the controller believes the joints to stand, rad.
    pub fn believed(&self) -> [f64; AXES] {
        self.believed
    }

    /// By how much each joint truly stands beyond what the controller believes, its drive's own errors aside, rad.
    pub fn zero_errors(&self) -> [f64; AXES] {
        self.offset
    }

    /// How the arm stands now.
    ///
    /// # Errors
    /// [`NoEquilibrium`] for an arm that is too soft for its weight.
    pub fn standing(&self) -> Result<Stance, NoEquilibrium> {
        self.machine.stand(&Conditions {
            time_s: (self.time_ns - self.began_ns) as f64 * 1e-9,
            temperature_c: ROOM_C,
            payload_kg: self.hung_kg,
        })
    }

    /// Has the controller believe that the arm stands so; the arm does not stir.
    ///
    /// # Errors
    /// [`TravelRefused`] while it moves, or for what is no number.
    pub fn declare(&mut self, joints: [f64; AXES]) -> Result<(), TravelRefused> {
        if self.travel.is_some() {
            return Err(TravelRefused::Moving);
        }
        require_finite(&joints)?;
        for ((offset, believed), declared) in self.offset.iter_mut().zip(&self.believed).zip(&joints) {
            *offset += believed - declared;
        }
        self.believed = joints;
        self.keep_calibration()
    }

    /// Writes down by how much the controller's zeros differ from those it came with.
    fn keep_calibration(&self) -> Result<(), TravelRefused> {
        let Some(file) = &self.description.calibration else { return Ok(()) };
        let mut shift = self.offset;
        for (shift, drawn) in shift.iter_mut().zip(self.description.drawn_zero_error()) {
            *shift -= drawn;
        }
        calibration::write(file, &shift)
            .map_err(|error| TravelRefused::NotKept(file.display().to_string(), error.kind()))
    }

    /// Hangs a weight (kg) on the flange beside the cage, in place of what hung there.
    ///
    /// # Errors
    /// [`TravelRefused::Load`] for more than the arm is built to carry or less than nothing.
    pub fn hang(&mut self, mass_kg: f64) -> Result<(), TravelRefused> {
        if !(0.0..=MOST_HUNG_KG).contains(&mass_kg) {
            return Err(TravelRefused::Load(mass_kg));
        }
        self.hung_kg = mass_kg;
        Ok(())
    }

    /// Starts a motion of all joints together to `target` (rad, as the controller believes) at a share of full speed.
    ///
    /// # Errors
    /// [`TravelRefused`]; then the arm does not stir.
    pub fn begin(&mut self, target: [f64; AXES], speed: f64) -> Result<(), TravelRefused> {
        if self.travel.is_some() {
            return Err(TravelRefused::Moving);
        }
        require_finite(&target)?;
        if !(0.001..=1.0).contains(&speed) {
            return Err(TravelRefused::Speed);
        }
        for ((joint, target), believed) in JOINTS.iter().zip(&target).zip(&self.believed) {
            let beyond = |value: f64| joint.beyond_stop(value);
            if beyond(*target) > beyond(*believed).max(1e-9) {
                return Err(TravelRefused::Stop {
                    joint: joint.name,
                    lower: joint.stops_deg()[0],
                    upper: joint.stops_deg()[1],
                    target: target.to_degrees(),
                });
            }
        }
        let target = self.counted(target);
        self.travel = Some(Travel::plan(self.believed, target, speed, self.time_ns));
        self.shutter.set_out(self.time_ns);
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
                // An arm that cannot stand takes no pictures; whoever asks for one is told why.
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
                let at_rest = self.counted(joints);
                self.drive_to(at_rest);
            } else {
                self.drive_to(joints);
                self.travel = Some(travel);
            }
        }
        self.time_ns = until_ns;
    }

    fn drive_to(&mut self, joints: [f64; AXES]) {
        self.believed = joints;
        let driven: Vec<f64> =
            joints.iter().zip(&self.offset).map(|(joint, offset)| joint + offset).collect();
        self.machine.go(&driven, (self.time_ns - self.began_ns) as f64 * 1e-9);
    }

    /// The nearest joint values the encoders can hold.
    fn counted(&self, joints: [f64; AXES]) -> [f64; AXES] {
        match self.description.resolution {
            Resolution::Continuous => joints,
            Resolution::Encoder => nearest_counted(&joints),
        }
    }
}

fn require_finite(joints: &[f64; AXES]) -> Result<(), TravelRefused> {
    let wrong = JOINTS.iter().zip(joints).find(|(_, value)| !value.is_finite());
    wrong.map_or(Ok(()), |(joint, _)| Err(TravelRefused::NotFinite(joint.name)))
}
