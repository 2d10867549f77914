//! A model as it is believed: checked, in mm and rad.

use std::sync::Arc;

use nalgebra::{IsometryMatrix3, Rotation3, Translation3, Vector3};
use plumb_kinematics::{Chain, Mass, Motion};

use super::epochs::Epochs;
use super::measured_region::{MeasuredRegion, Outside};
use super::residual_map::ResidualMap;
use super::sensor::Sensor;
use super::stripe_rig::StripeRig;
use super::surface::SurfaceShape;
use crate::effect::{Definition, EffectId, Site};
use crate::reading_unit::RmsError;
use crate::table::scalar::Scalar;

/// A named point fixed in the flange's frame, mm; with axes of its own where it is a body or a camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Target {
    /// `p1`, `p2`, ...
    pub name: String,
    /// Where it is, flange frame, mm.
    pub xyz: Vector3<f64>,
    /// Whether fits may move it.
    pub free: bool,
    /// From its axes to those of the flange.
    pub rotation: Rotation3<f64>,
    /// Whether fits may turn it, where its orientation was measured or it is a camera.
    pub rotation_free: bool,
}

impl Target {
    /// A point, turned as the flange is.
    pub fn point(name: &str, xyz: Vector3<f64>, free: bool) -> Self {
        Self { name: name.to_owned(), xyz, free, rotation: Rotation3::identity(), rotation_free: free }
    }
}

/// A board that a camera on the arm sees.
#[derive(Debug, Clone, PartialEq)]
pub struct Board {
    /// What tables call it in the column `board`; nothing where it is the only one.
    pub name: Option<String>,
    /// The camera, by its index among the targets.
    pub camera: usize,
    /// Pose of the board in the measurements' frame, mm.
    pub pose: IsometryMatrix3<f64>,
    /// Whether fits may move it.
    pub free: bool,
}

/// Where the arm's base is in the frame of the measurements.
#[derive(Debug, Clone, PartialEq)]
pub struct Base {
    /// Pose of the base in the measurements' frame, mm.
    pub pose: IsometryMatrix3<f64>,
    /// Whether fits may move it.
    pub free: bool,
    /// Whether every session of the table has a base (or an instrument) of its own.
    pub per_session: bool,
}

impl Base {
    /// From a position (mm) and roll, pitch, yaw (rad): Rz(yaw) Ry(pitch) Rx(roll).
    pub fn new(xyz: [f64; 3], rpy: [f64; 3], free: bool) -> Self {
        let rotation = Rotation3::from_euler_angles(rpy[0], rpy[1], rpy[2]);
        Self {
            pose: IsometryMatrix3::from_parts(Translation3::from(Vector3::from(xyz)), rotation),
            free,
            per_session: false,
        }
    }
}

/// In whose frame positions were measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MeasuredFrom {
    /// An instrument placed anywhere; the base pose absorbs it.
    Instrument,
    /// A level frame with gravity along -z.
    World,
}

/// A named surface, edge or point in the frame of the measurements.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Name, as used in `on` and `distance_to`.
    pub name: String,
    /// Its shape and place.
    pub shape: SurfaceShape,
    /// Whether fits may move it.
    pub free: bool,
    /// Of an edge: on which side what the sensor sees is light, +1 left and -1 right of its direction, seen from above; nothing where not said.
    pub light: Option<f64>,
}

/// What a frame is fixed to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Frame {
    /// The base.
    Base,
    /// The end of a joint's row; the last one is the flange.
    After(usize),
}

/// A frame whose tilts are measured: where a spirit level lies.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// As the table's column `level` names it; none for the one of a model that has one only.
    pub name: Option<String>,
    /// What the level is on.
    pub frame: Frame,
    /// How it is turned there.
    pub rotation: Rotation3<f64>,
}

/// Declared noise, 1 sigma per axis; mm and rad; nothing where not declared.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Noise {
    /// Of a target's position, by target name.
    pub positions: Vec<(String, f64)>,
    /// Of a target's orientation about each of its axes, rad, by target name.
    pub orientations: Vec<(String, f64)>,
    /// Of where a camera on the arm sees a board, mm.
    pub board: Option<f64>,
    /// Of how it sees it turned, rad.
    pub board_rotation: Option<f64>,
    /// Of a point of a laser line sensor across what it lies on, mm.
    pub profile: Option<f64>,
    /// Of what columns of one number hold (heights, distances), mm or rad, by the column's name; that of heights is also that of lying on a
    /// surface.
    pub scalars: Vec<(&'static str, f64)>,
    /// Of tilts, rad.
    pub tilt: Option<f64>,
    /// Of touching, mm.
    pub touch: Option<f64>,
    /// What a fit showed of readings whose noise nobody declared, mm or rad, by their keys of `noise:`; never written to a file.
    pub estimated: Vec<(String, f64)>,
}

impl Noise {
    /// Of what a column of one number holds, mm or rad, if declared.
    pub fn of(&self, scalar: &Scalar) -> Option<f64> {
        self.scalars.iter().find(|(name, _)| *name == scalar.name).map(|(_, sigma)| *sigma)
    }

    /// Declares it.
    pub(crate) fn set(&mut self, scalar: &'static Scalar, sigma: f64) {
        self.scalars.retain(|(name, _)| *name != scalar.name);
        self.scalars.push((scalar.name, sigma));
    }

    /// Of a target's position, mm, if declared.
    pub(crate) fn of_position(&self, target: &str) -> Option<f64> {
        self.positions.iter().find(|(name, _)| name == target).map(|(_, sigma)| *sigma)
    }

    /// Of a target's orientation, rad, if declared.
    pub(crate) fn of_orientation(&self, target: &str) -> Option<f64> {
        self.orientations.iter().find(|(name, _)| name == target).map(|(_, sigma)| *sigma)
    }

    /// What a fit showed of an undeclared noise, mm or rad, by its key of `noise:`.
    pub(crate) fn estimated_of(&self, key: &str) -> Option<f64> {
        self.estimated.iter().find(|(name, _)| name == key).map(|(_, sigma)| *sigma)
    }
}

/// A known distance between two touched points.
#[derive(Debug, Clone, PartialEq)]
pub struct TouchDistance {
    /// The two places' names, as in the table's `touch`.
    pub between: [String; 2],
    /// mm.
    pub length: f64,
}

/// Which target touches, and what is known of the places.
#[derive(Debug, Clone, PartialEq)]
pub struct Touch {
    /// The target's name.
    pub target: String,
    /// Known distances.
    pub distances: Vec<TouchDistance>,
}

/// An effect with the values it has now, in internal units (mm, rad, and what the effect says).
#[derive(Debug, Clone, PartialEq)]
pub struct AddedEffect {
    /// Which, and where.
    pub id: EffectId,
    /// One value a parameter, in the effect's order.
    pub values: Vec<f64>,
}

/// An added effect that is a correction: it predicts rows it has not seen, but its mechanism is not identified.
#[derive(Debug, Clone, PartialEq)]
pub struct Correction {
    /// The effect, one of those added.
    pub id: EffectId,
    /// The mechanisms it may mean, as people write them.
    pub may_be: Vec<String>,
}

/// What is known of the values of an added effect before any row is looked at: each is normally distributed about zero. Waves of a transmission are many and small; alone a part of
/// a turn hardly determines those of low order.
#[derive(Debug, Clone, PartialEq)]
pub struct ValuePrior {
    /// The effect, one of those added.
    pub id: EffectId,
    /// Standard deviation of each value, internal unit, where the rows scatter as declared; where they scatter s times as much, so many times more (conjugate prior: Gelman et al.,
    /// Bayesian Data Analysis, 3rd ed., section 14.8). Nothing of a value of which nothing is known.
    pub sd: Vec<Option<f64>>,
}

/// How a revision of a model file came to be.
#[derive(Debug, Clone, PartialEq)]
pub struct Revision {
    /// From 1 for the first file written beside the original.
    pub number: u32,
    /// The original file's name.
    pub of: String,
    /// What was done, in words.
    pub did: String,
    /// The table it was fitted to.
    pub data: Option<String>,
    /// The revision it was made from; 0 for the original.
    pub parent: Option<u32>,
    /// RMS of the fit, in the unit of the table's readings.
    pub rms: Option<RmsError>,
}

/// What the machine is believed to be.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// The arm's name.
    pub arm: String,
    /// Its nominal joints.
    pub chain: Chain,
    /// Masses of its links.
    pub masses: Vec<Mass>,
    /// Where its base is.
    pub base: Base,
    /// Points measured on it.
    pub targets: Vec<Target>,
    /// The boards that a camera among them sees.
    pub boards: Vec<Board>,
    /// The laser line sensor among the targets.
    pub profile_sensor: Option<usize>,
    /// Effects that are always fitted, as written: `joint_zero(*)`.
    pub free: Vec<String>,
    /// What the user has added, in order.
    pub effects: Vec<AddedEffect>,
    /// Which of them are corrections; all others are mechanisms.
    pub corrections: Vec<Correction>,
    /// What is known beforehand of their values.
    pub priors: Vec<ValuePrior>,
    /// Where corrections and the residual map hold; nothing where there are none.
    pub measured_region: Option<MeasuredRegion>,
    /// What a flexible regression takes away of what the model leaves; explains nothing.
    pub residual_map: Option<ResidualMap>,
    /// Poses (rad or mm) each of which has an error of its own while conditions are asked about; never written to a file.
    pub pose_errors: Vec<Vec<f64>>,
    /// Values of the free effects from an earlier fit: where the next starts.
    pub fitted: Vec<AddedEffect>,
    /// What triggers and heights refer to.
    pub surfaces: Vec<Surface>,
    /// In whose frame positions are.
    pub measured_from: MeasuredFrom,
    /// Direction of gravity in the base's nominal frame, if given.
    pub gravity: Option<Vector3<f64>>,
    /// Where the first target is to be right, frame of the measurements, mm: least and greatest x, y and z; nothing if not declared.
    pub working_volume: Option<[(f64, f64); 3]>,
    /// The frames whose tilts are measured.
    pub levels: Vec<Level>,
    /// The arm's own proximity sensor.
    pub sensor: Option<Sensor>,
    /// The light stripe it carries; never written to a file, it has one of its own.
    pub stripe_rig: Option<StripeRig>,
    /// Declared noise.
    pub noise: Noise,
    /// The touching target.
    pub touch: Option<Touch>,
    /// Effects of the user's own.
    pub definitions: Vec<Arc<Definition>>,
    /// Where something was re-set among the rows; nothing where nothing was.
    pub epochs: Option<Epochs>,
    /// How this revision came to be; nothing for an original.
    pub revision: Option<Revision>,
}

impl Model {
    /// Direction of gravity in the base's frame, unit length, for a base with this orientation in the measurements'
    /// frame. An instrument's frame says nothing of gravity: the arm is then taken to be upright on its base.
    pub fn down(&self, base: &Rotation3<f64>) -> Vector3<f64> {
        match (self.gravity, self.measured_from) {
            (Some(given), _) => given,
            // Level by definition: z is up.
            (None, MeasuredFrom::World) => -base.matrix().row(2).transpose(),
            (None, MeasuredFrom::Instrument) => -Vector3::z(),
        }
    }

    /// What is said of an added effect that is a correction; nothing of a mechanism.
    pub fn correction(&self, id: &EffectId) -> Option<&Correction> {
        self.corrections.iter().find(|correction| correction.id.same_as(id))
    }

    /// What is known beforehand of the values of an added effect; nothing where nothing is.
    pub fn prior(&self, id: &EffectId) -> Option<&ValuePrior> {
        self.priors.iter().find(|prior| prior.id.same_as(id))
    }

    /// Whether a pose (rad or mm) may be commanded by this model: one with corrections or a residual map holds only where it was measured.
    ///
    /// # Errors
    /// Why not, and what would help.
    pub fn holds_at(&self, q: &[f64]) -> Result<(), String> {
        let Some(region) = &self.measured_region else { return Ok(()) };
        region.check(q).map_err(|outside: Outside| {
            let mut parts: Vec<String> =
                self.corrections.iter().map(|correction| format!("the correction {}", self.label(&correction.id))).collect();
            parts.extend(self.residual_map.is_some().then(|| "the residual map".to_owned()));
            let held = if parts.len() == 1 { "holds" } else { "hold" };
            format!(
                "{}. {} of the model {held} only in the measured region: measure there and `grow` again, or take them out (`plumb model remove`)",
                outside.describe(&self.chain),
                parts.join(" and ")
            )
        })
    }

    /// A target's index in the list, by name.
    pub fn target_position(&self, name: &str) -> Option<usize> {
        self.targets.iter().position(|target| target.name == name)
    }

    /// An effect of the user's own, by name.
    pub fn definition(&self, name: &str) -> Option<&Arc<Definition>> {
        self.definitions.iter().find(|definition| definition.name == name)
    }

    /// A level's index in the list: the one of this name, or, where none is named, the only one there is.
    pub fn level_position(&self, name: Option<&str>) -> Option<usize> {
        match name {
            Some(name) => self.levels.iter().position(|level| level.name.as_deref() == Some(name)),
            None => (self.levels.len() == 1).then_some(0),
        }
    }

    /// A board's index in the list: the one of this name, or, where none is named, the only one there is. One that has no name goes by any.
    pub fn board_position(&self, name: Option<&str>) -> Option<usize> {
        match (name, self.boards.as_slice()) {
            (_, [only]) if only.name.is_none() => Some(0),
            (Some(name), boards) => boards.iter().position(|board| board.name.as_deref() == Some(name)),
            (None, boards) => (boards.len() == 1).then_some(0),
        }
    }

    /// What people call a board: `board`, or its name.
    pub fn board_name(&self, board: usize) -> &str {
        self.boards.get(board).and_then(|board| board.name.as_deref()).unwrap_or("board")
    }

    /// A surface's index in the list, by name.
    pub fn surface_position(&self, name: &str) -> Option<usize> {
        self.surfaces.iter().position(|surface| surface.name == name)
    }

    /// How many epochs the table is cut into; 1 where nothing was re-set.
    pub fn epoch_count(&self) -> usize {
        self.epochs.as_ref().map_or(1, Epochs::count)
    }

    /// Whether a joint slides.
    pub fn slides(&self, joint: usize) -> bool {
        self.chain.joints.get(joint).is_some_and(|joint| joint.motion == Motion::Slides)
    }

    /// The name of where an effect acts, as people write it; `?` for something the model does not have.
    pub fn site_name(&self, site: Site) -> String {
        let name = match site {
            Site::Joint(index) => self.chain.joints.get(index).map(|joint| joint.name.as_str()),
            Site::Target(index) => self.targets.get(index).map(|target| target.name.as_str()),
            Site::Axis(axis) => ["x", "y", "z"].get(axis).copied(),
            Site::Base => Some("base"),
            Site::Sensor => Some("sensor"),
            Site::Surface(index) => self.surfaces.get(index).map(|surface| surface.name.as_str()),
            Site::Instrument => Some("instrument"),
            Site::Reading(channel) => Some(channel.name()),
        };
        name.unwrap_or("?").to_owned()
    }

    /// An effect as people write it: `joint_harmonic(lift, 20)`.
    pub fn label(&self, id: &EffectId) -> String {
        let other = id.with.and_then(|with| self.chain.joints.get(with)).map(|joint| joint.name.clone());
        let order = id.order.map(|order| format!("{order}"));
        let of = id.of.map(|of| of.name().to_owned());
        let arguments: Vec<String> =
            [Some(self.site_name(id.site)), other, order, of].into_iter().flatten().collect();
        format!("{}({})", id.name, arguments.join(", "))
    }
}
