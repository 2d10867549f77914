//! What the operator measures: tilts with a spirit level, heights with a ruler, positions with a laser tracker.

use super::ArmWorld;
use super::description::{LevelDirection, LevelSurface};
use crate::instrument::Instrument;
use crate::physics::description::Motion;
use crate::physics::machine::{ArmState, NoEquilibrium};
use crate::physics::rigid::{Rotation, Vector};
use crate::protocol::Axis;

/// Why nothing can be measured.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeasuringError {
    /// There is no such location.
    #[error("a spirit level does not lie at `{given}`; {locations}")]
    NoLocation {
        /// What was named.
        given: String,
        /// Where it can lie.
        locations: String,
    },
    /// The ruler does not go there.
    #[error("the ruler goes under the `flange` or the `tip`, not at `{0}`")]
    NotRuled(String),
    /// No reflector is there.
    #[error("the tracker's reflector sits at the `tip` or the `flange`, not at `{0}`")]
    NoReflector(String),
    /// A tracker's reading has three coordinates.
    #[error("say which coordinate of the tracker is read: x, y or z")]
    NoAxis,
    /// Nothing sees a board.
    #[error("no camera on this hand sees a board: the world has no `board_camera` among its instruments")]
    NoCamera,
    /// The board is behind the camera or far aside.
    #[error(
        "the camera does not see the board from here: it lies more than 40 deg aside of where the camera looks"
    )]
    OutOfView,
    /// Nothing feels.
    #[error("no measuring probe is on this hand: the world has no `touch_probe` among its instruments")]
    NoProbe,
    /// There is no such thing to feel.
    #[error("the probe knows nothing to feel called `{given}`; there is {known}")]
    NothingToFeel {
        /// What was named.
        given: String,
        /// What there is.
        known: String,
    },
    /// It is too far away, or too deep inside.
    #[error(
        "the probe does not feel `{of}` from here: its ball is {off:.2} mm from it, and it feels {reach} mm either way"
    )]
    NotFelt {
        /// What.
        of: String,
        /// mm.
        off: f64,
        /// mm.
        reach: f64,
    },
    /// Nothing sees profiles.
    #[error("no laser line sensor is on this hand: the world has no `line_sensor` among its instruments")]
    NoLineSensor,
    /// There is no such thing to look at.
    #[error("the laser line sensor knows nothing called `{given}`; there is {known}")]
    NothingCalled {
        /// What was named.
        given: String,
        /// What there is.
        known: String,
    },
    /// The profile shows nothing of it.
    #[error("the laser line sensor does not see `{of}` from here: {why}")]
    NotInTheProfile {
        /// What.
        of: String,
        /// Why not.
        why: String,
    },
    /// A profile has fewer points.
    #[error("the profile has no point {0}: a plane or a ball shows points 1 to 5, an edge point 1")]
    NoSuchPoint(usize),
    /// A profile lies in a plane.
    #[error("a profile has x, along the sensor's line, and z, away from the sensor")]
    AcrossTheProfile,
    /// The surface is so steep that the bubble is at an end.
    #[error("the surface leans by {0:.1} deg: the bubble is at its end; bring it nearer to level first")]
    Steep(f64),
    /// The joint does not move the bubble.
    #[error("turning `{joint}` does not move the bubble of a level that lies at `{location}`")]
    NoEffect {
        /// The joint.
        joint: String,
        /// Where the level lies.
        location: String,
    },
    /// The arm is not at rest.
    #[error(transparent)]
    NoEquilibrium(#[from] NoEquilibrium),
}

/// With a level of no divisions, a bubble this near to the middle is in the middle, deg.
const IN_THE_MIDDLE_DEG: f64 = 1e-7;

/// How the operator would go on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum LevelStep {
    /// The bubble is in the middle.
    Done,
    /// The joint is to be turned by so much, rad.
    Turn(f64),
}

impl ArmWorld {
    /// What the ruler reads from the table up to the middle of the wrist flange, or to the tip of the tool, mm.
    ///
    /// # Errors
    /// [`MeasuringError`]
    pub fn read_ruler(&mut self, at: Option<&str>) -> Result<f64, MeasuringError> {
        let at = at.unwrap_or("flange");
        let point = self.point(at)?.ok_or_else(|| MeasuringError::NotRuled(at.to_owned()))?;
        let table = self.description.table;
        let height = (point - Vector::Z * table.height).dot(table.normal);
        Ok(self.take(self.description.ruler, height))
    }

    /// What a laser tracker shows of one coordinate of the tool's tip (or of the flange), mm.
    ///
    /// # Errors
    /// [`MeasuringError`]
    pub fn read_tracker(&mut self, at: Option<&str>, axis: Option<Axis>) -> Result<f64, MeasuringError> {
        let at = at.unwrap_or("tip");
        let point = self.point(at)?.ok_or_else(|| MeasuringError::NoReflector(at.to_owned()))?;
        let coordinate = match axis {
            Some(Axis::X) => point.x,
            Some(Axis::Y) => point.y,
            Some(Axis::Z) => point.z,
            None => return Err(MeasuringError::NoAxis),
        };
        Ok(self.take(self.description.tracker, coordinate))
    }

    /// A point of the arm that can be measured, world, mm.
    fn point(&self, at: &str) -> Result<Option<Vector>, MeasuringError> {
        let flange = self.arm_state()?.link_frames.world_from_flange;
        Ok(match at {
            "flange" => Some(flange.translation),
            "tip" => Some(flange.apply(self.description.tool.tip)),
            _ => None,
        })
    }

    /// One more reading.
    pub(super) fn take(&mut self, instrument: Instrument, truth: f64) -> f64 {
        self.readings_taken += 1;
        instrument.read(truth, self.description.seed, self.readings_taken)
    }

    /// What the spirit level shows, deg: how much the end its arrow points to is too high. `turned` is end for end.
    ///
    /// # Errors
    /// [`MeasuringError`]
    pub fn read_level(&mut self, at: &str, turned: bool) -> Result<f64, MeasuringError> {
        let arm_state = self.arm_state()?;
        let along = self.level_direction(&arm_state, &self.surface_named(at)?, turned);
        let tilt = along.z.clamp(-1.0, 1.0).asin();
        let level = self.description.level;
        if tilt.abs() > level.reach {
            return Err(MeasuringError::Steep(tilt.to_degrees()));
        }
        Ok(self.take(level.instrument, tilt + level.zero).to_degrees())
    }

    /// Looks at the bubble, and says how the operator would turn a joint (from 0) to bring it to the middle.
    pub(super) fn level_step(
        &mut self,
        joint: usize,
        at: &str,
        turned: bool,
    ) -> Result<LevelStep, MeasuringError> {
        let shown = self.read_level(at, turned)?;
        if shown.abs() < self.smallest_seen_deg() {
            return Ok(LevelStep::Done);
        }
        let arm_state = self.arm_state()?;
        let surface = self.surface_named(at)?;
        let along = self.level_direction(&arm_state, &surface, turned);
        let no_effect = || MeasuringError::NoEffect {
            joint: self.description.paper.shape.joint_name(joint).to_owned(),
            location: at.to_owned(),
        };
        let turns = joint <= surface.carried_by && self.turns(joint);
        let axis = arm_state.link_frames.axes.get(joint).filter(|_| turns).ok_or_else(no_effect)?;
        let rise = axis.direction.cross(along).z;
        if rise.abs() < 0.3 {
            return Err(no_effect());
        }
        // Near the middle by less than it shows, so that nobody turns to and fro over one division for ever.
        let division = self.description.level.instrument.division.to_degrees();
        let fraction = if shown.abs() < 1.5 * division { 0.7 } else { 1.0 };
        Ok(LevelStep::Turn(-shown.to_radians() * fraction / rise))
    }

    /// A bubble that shows less than this is in the middle, deg.
    fn smallest_seen_deg(&self) -> f64 {
        let level = self.description.level.instrument;
        (level.division.to_degrees() / 2.0).max(level.error.to_degrees()).max(IN_THE_MIDDLE_DEG)
    }

    /// Whether a joint turns, and does not slide.
    fn turns(&self, joint: usize) -> bool {
        self.description.paper.shape.joints.get(joint).is_some_and(|joint| joint.motion == Motion::Turns)
    }

    /// The way the level's arrow points, world.
    fn level_direction(&self, arm_state: &ArmState, surface: &LevelSurface, turned: bool) -> Vector {
        let axis =
            |joint: usize| arm_state.link_frames.axes.get(joint).map_or(Vector::Z, |axis| axis.direction);
        let along = match surface.direction {
            LevelDirection::AlongAxis { along, square_to } => axis(along).across(axis(square_to)),
            LevelDirection::SquareToAxes(first, second) => axis(first).cross(axis(second)),
            LevelDirection::OnTool(direction) => {
                let lean = Rotation::from_roll_pitch_yaw(self.description.tool.lean);
                (arm_state.link_frames.world_from_flange.rotation * lean).apply(direction)
            }
            LevelDirection::AtZero(direction) => {
                let carrier = arm_state.link_frames.world_from_home.get(surface.carried_by);
                carrier.map_or(direction, |world_from_home| world_from_home.rotation.apply(direction))
            }
        };
        let along = along.unit().unwrap_or(Vector::X);
        if turned { -along } else { along }
    }

    /// The surface of this name on which a level can lie.
    fn surface_named(&self, name: &str) -> Result<LevelSurface, MeasuringError> {
        let surfaces = &self.description.paper.level_surfaces;
        surfaces.iter().find(|surface| surface.name == name).cloned().ok_or_else(|| {
            let names: Vec<&str> = surfaces.iter().map(|surface| surface.name.as_ref()).collect();
            let locations = match names.is_empty() {
                true => "this arm has no surface for one".to_owned(),
                false => format!("its places are {}", names.join(", ")),
            };
            MeasuringError::NoLocation { given: name.to_owned(), locations }
        })
    }
}
