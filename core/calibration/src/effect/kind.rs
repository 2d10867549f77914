//! What a kind of effect says of itself: where it may act, how it is seen, what it is like.

use plumb_kinematics::{LinkFrames, Motion, Weights};

use super::identity::{EffectId, EffectNameError, Site};
use super::summary::DatasetSummary;
use super::{Effect, Parameter, Unit};
use crate::arm_model::{Model, Sensor};

/// A link that is no longer is none (mm): lengths of arms are wrong by less, and parts that carry an arm are longer.
const SHORTEST_LINK: f64 = 5.0;

/// What kind of thing an effect is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    /// Constant errors of shape.
    Geometry,
    /// What a joint's drive does.
    Joint,
    /// What changes in time or with temperature, and what bends.
    LinkAndTime,
    /// What the arm's own sensor does.
    Sensor,
    /// What the instrument does.
    Instrument,
    /// What somebody re-set between two stretches of rows.
    Epoch,
}

/// Where effects of a kind may act, which is also how they are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SiteKind {
    /// One joint: `name(joint)`.
    Joints,
    /// One joint and a number of periods a turn: `name(joint, n)`.
    JointsAndOrder,
    /// One joint and a number of straight pieces: `name(joint, n)`.
    JointsAndPieces,
    /// Two joints: `name(joint, other)`.
    JointPairs,
    /// One joint and what of it changes: `name(joint, zero|length|offset)`.
    JointsAndQuantity,
    /// A target: `name(p1)`.
    Targets,
    /// An axis of the instrument: `name(x)`.
    Axes,
    /// The base: `name`.
    Base,
    /// The instrument: `name`.
    Instrument,
    /// The arm's own sensor: `name`.
    Sensor,
    /// A surface the sensor triggers over: `name(table)`.
    Surfaces,
    /// One number an instrument reads: `name(distance)`.
    Readings,
}

/// What inside an effect is searched for rather than fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Search {
    /// Nothing.
    Nothing,
    /// A number on which the effect depends smoothly: it costs as much as a fitted parameter.
    Smooth,
    /// One of many unlike places: each counts as a trial of its own.
    Jumps,
}

impl Search {
    /// What the search costs in Schwarz's criterion, for so many equations.
    pub fn cost(self, equations: f64) -> f64 {
        match self {
            Self::Nothing => 0.0,
            Self::Smooth => equations.ln(),
            Self::Jumps => 2.0 * equations.ln(),
        }
    }
}

/// The quantity that drives an effect, against which its own plot is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DrivenBy {
    /// The coordinate of the joint it acts on.
    Coordinate,
    /// The same, in waves of so many periods a turn.
    Waves,
    /// Where within a turn of its screw the joint it acts on is, in waves: over the whole travel they would have more periods than a plot
    /// has columns.
    ScrewTurn,
    /// The moment of gravity about the joint it acts on.
    Moment,
    /// The weights of declared masses along a link: more than one axis would show.
    Weights,
    /// The coordinate of the other of its two joints.
    OtherJoint,
    /// The way in which the joint it acts on arrived.
    WayOfArrival,
    /// How far the joint it acts on moved from the row before.
    LastMove,
    /// How fast the joint it acts on went in the last move, of the fastest joint.
    Speed,
    /// The temperature.
    Temperature,
    /// The time, or the order of the rows where that is not logged.
    Time,
    /// The order of the rows: a step shows where it happened, however long the rows before it took.
    RowOrder,
    /// The coordinate of the point along the axis of the instrument it acts on.
    InstrumentAxis,
    /// Several quantities, or the whole pose: no single axis would show it.
    Several,
}

impl DrivenBy {
    /// Whether the weight of declared masses drives it, so that it changes nothing in a model without any.
    pub fn is_weight(self) -> bool {
        matches!(self, Self::Moment | Self::Weights)
    }
}

/// A drawing of three lines: what is drawn is dashed or thin, what is built is heavy. A line has at most [`SKETCH_COLUMNS`] columns.
pub type Sketch = [&'static str; 3];

/// Columns of the widest sketch: those of a card on a screen of 80 columns.
pub const SKETCH_COLUMNS: usize = 26;

/// A kind of effect.
pub struct Kind {
    /// Its name.
    pub name: &'static str,
    /// What kind of thing it is.
    pub family: Family,
    /// Where it may act.
    pub sites: SiteKind,
    /// Whether `geometry(*)` includes it.
    pub geometry_group: bool,
    /// Whether it can differ between two visits to one pose.
    pub depends_on_conditions: bool,
    /// Whether it has no mechanism of its own: sums of such effects imitate anything at their joint, so several of them at
    /// one joint are a sign of something else.
    pub imitates_anything: bool,
    /// Whether it depends on time or temperature, which poses to come do not repeat.
    pub depends_on_time: bool,
    /// Whether it is something that happened once rather than a property of the arm: finding the zeros anew puts it right, so
    /// no prediction uses it.
    pub is_event: bool,
    /// What inside it is searched for rather than fitted.
    pub search: Search,
    /// What its own plot is drawn against.
    pub driven_by: DrivenBy,
    /// What it is, in one plain sentence.
    pub sentence: &'static str,
    /// What to measure to see it.
    pub how_to_see: &'static str,
    /// What it looks like.
    pub sketch: Sketch,
    /// Makes it at a place.
    pub build: fn(&Setting<'_>) -> Result<Box<dyn Effect>, EffectNameError>,
    /// Everywhere a table could show it.
    pub candidates: fn(&CandidateContext<'_>) -> Vec<EffectId>,
}

impl Kind {
    /// Whether it grows or fades as time goes by, rather than jumping at one moment.
    pub fn changes_gradually(&self) -> bool {
        self.depends_on_time && !self.is_event
    }
}

/// An effect about to be made: which, where, in which model.
pub struct Setting<'a> {
    /// Which and where.
    pub id: &'a EffectId,
    /// In which model.
    pub model: &'a Model,
}

impl Setting<'_> {
    pub(super) fn unusable(&self, reason: &str) -> EffectNameError {
        EffectNameError::Unusable { effect: self.model.label(self.id), reason: reason.to_owned() }
    }

    /// The joint it acts on.
    pub(super) fn joint(&self) -> Result<usize, EffectNameError> {
        let joint = self.id.joint().filter(|joint| *joint < self.model.chain.len());
        joint.ok_or_else(|| self.unusable("needs a joint to act on"))
    }

    /// The target it acts on.
    pub(super) fn target(&self) -> Result<usize, EffectNameError> {
        match self.id.site {
            Site::Target(target) if target < self.model.targets.len() => Ok(target),
            _ => Err(self.unusable("needs a target to act on, such as p1")),
        }
    }

    /// The arm's own sensor, which the model has to describe.
    pub(super) fn sensor(&self) -> Result<Sensor, EffectNameError> {
        // Effects of the sensor are shares of what its data sheet says.
        let missing =
            "needs the arm's sensor described in the model file, as in `sensor: {working_mm: 8, peak_mm: 5}`";
        self.model.sensor.ok_or_else(|| self.unusable(missing))
    }

    /// A parameter that displaces the joint it acts on: in degrees where that turns, in millimetres where it slides. Each name comes with the greatest plausible size, rad or mm,
    /// of either sign.
    pub(super) fn displacement(
        &self,
        (deg, rad): (&str, f64),
        (mm, length): (&str, f64),
    ) -> Result<Parameter, EffectNameError> {
        Ok(match self.slides(self.joint()?) {
            false => Parameter::new(deg, Unit::DEG, (-rad, rad)),
            true => Parameter::new(mm, Unit::MM, (-length, length)),
        })
    }

    /// Whether a joint slides.
    pub(super) fn slides(&self, joint: usize) -> bool {
        self.model.slides(joint)
    }
}

/// A model and what its table offers: where candidates come from.
pub struct CandidateContext<'a> {
    /// The model.
    pub model: &'a Model,
    /// What the table logs.
    pub summary: &'a DatasetSummary,
}

impl CandidateContext<'_> {
    /// One candidate a joint.
    pub(super) fn every_joint(&self, name: &str) -> Vec<EffectId> {
        (0..self.model.chain.len()).map(|joint| EffectId::at(name, Site::Joint(joint))).collect()
    }

    /// One candidate a joint that turns.
    pub(super) fn every_turning_joint(&self, name: &str) -> Vec<EffectId> {
        let mut ids = self.every_joint(name);
        ids.retain(|id| id.joint().is_some_and(|joint| self.turns(joint)));
        ids
    }

    /// One candidate a joint whose link has a length of its own, in the arm as drawn. Where axes meet, what is fitted of a length is an error of the arm: no beam and no
    /// shaft, whose stiffness would be anything.
    pub(super) fn every_link(&self, name: &str) -> Vec<EffectId> {
        let chain = &self.model.chain;
        let link_frames = LinkFrames::of(chain, &vec![0.0; chain.len()], &[]);
        let mut ids = self.every_joint(name);
        ids.retain(|id| {
            let ends = id.joint().and_then(|joint| Weights::WITHOUT.link(&link_frames, joint));
            ends.is_some_and(|(start, end)| (end - start).norm() > SHORTEST_LINK)
        });
        ids
    }

    /// Whether a joint turns.
    pub fn turns(&self, joint: usize) -> bool {
        self.model.chain.joints.get(joint).is_some_and(|joint| joint.motion == Motion::Turns)
    }

    /// Whether anything with weight hangs on the arm.
    pub fn has_weight(&self) -> bool {
        // A load that differs from row to row pulls, though no mass of a link is known.
        !self.model.masses.is_empty() || self.summary.payload_range.is_some_and(|range| range > 0.0)
    }
}
