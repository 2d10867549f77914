//! The one table of effects: help, files, candidates and screens are read from it.

use plumb_kinematics::Motion;

use super::defined::{Defined, Definition};
use super::identity::{Written, joint_names};
use super::{Effect, EffectId, EffectNameError, Passport, Quantity, Spot};
use crate::file::{Model, Sensor, suggestion};

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
}

/// Where effects of a kind may act, which is also how they are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Places {
    /// One joint: `name(joint)`.
    Joints,
    /// One joint and a number of periods a turn: `name(joint, n)`.
    JointsAndOrder,
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
    pub(crate) fn cost(self, equations: f64) -> f64 {
        match self {
            Self::Nothing => 0.0,
            Self::Smooth => equations.ln(),
            Self::Jumps => 2.0 * equations.ln(),
        }
    }
}

/// A kind of effect.
pub struct Kind {
    /// Its name.
    pub name: &'static str,
    /// What kind of thing it is.
    pub family: Family,
    /// Where it may act.
    pub places: Places,
    /// Whether `geometry(*)` includes it.
    pub geometry_group: bool,
    /// Whether it can differ between two visits to one pose.
    pub depends_on_conditions: bool,
    /// What inside it is searched for rather than fitted.
    pub search: Search,
    /// What it is, in one plain sentence.
    pub sentence: &'static str,
    /// What to measure to see it.
    pub how_to_see: &'static str,
    /// Makes it at a place.
    pub build: fn(&Setting<'_>) -> Result<Box<dyn Effect>, EffectNameError>,
    /// Everywhere a table could show it.
    pub candidates: fn(&Survey<'_>) -> Vec<EffectId>,
}

static KINDS: [Kind; 27] = [
    super::joint_zero::KIND,
    super::link_length::KIND,
    super::link_offset::KIND,
    super::link_twist::KIND,
    super::axis_skew::KIND,
    super::tool_offset::KIND,
    super::joint_gain::KIND,
    super::joint_compliance::KIND,
    super::joint_stiffening::KIND,
    super::joint_backlash::KIND,
    super::joint_settling::KIND,
    super::joint_coupling::KIND,
    super::joint_step::KIND,
    super::joint_harmonic::KIND,
    super::link_sag::KIND,
    super::thermal_growth::KIND,
    super::warm_up::KIND,
    super::drift::KIND,
    super::base_tilt::KIND,
    super::base_position::KIND,
    super::scale::KIND,
    super::trigger_height::KIND,
    super::trigger_spot::KIND,
    super::trigger_hysteresis::KIND,
    super::reflectance::KIND,
    super::sensor_tilt::KIND,
    super::instrument_tilt::KIND,
];

/// All kinds of effect, in the order they are listed to people.
pub fn kinds() -> &'static [Kind] {
    &KINDS
}

/// A kind by its name.
pub fn kind(name: &str) -> Option<&'static Kind> {
    KINDS.iter().find(|kind| kind.name == name)
}

/// An effect about to be made: which, where, in which model.
pub struct Setting<'a> {
    /// Which and where.
    pub id: &'a EffectId,
    /// In which model.
    pub model: &'a Model,
}

impl Setting<'_> {
    fn unusable(&self, reason: &str) -> EffectNameError {
        EffectNameError::Unusable { effect: self.id.label(self.model), reason: reason.to_owned() }
    }

    /// The joint it acts on.
    pub(super) fn joint(&self) -> Result<usize, EffectNameError> {
        let joint = self.id.joint().filter(|joint| *joint < self.model.chain.len());
        joint.ok_or_else(|| self.unusable("needs a joint to act on"))
    }

    /// The target it acts on.
    pub(super) fn target(&self) -> Result<usize, EffectNameError> {
        match self.id.spot {
            Spot::Target(target) if target < self.model.targets.len() => Ok(target),
            _ => Err(self.unusable("needs a target to act on, such as p1")),
        }
    }

    /// The arm's own sensor, which the model has to describe.
    pub(super) fn sensor(&self) -> Result<Sensor, EffectNameError> {
        let missing =
            "needs the arm's sensor described in the model file, as in `sensor: {working_mm: 8, peak_mm: 5}`";
        self.model.sensor.ok_or_else(|| self.unusable(missing))
    }

    /// Whether a joint slides.
    pub(super) fn slides(&self, joint: usize) -> bool {
        self.model.chain.joints.get(joint).is_some_and(|joint| joint.motion == Motion::Slides)
    }
}

/// A model and what its table offers: where candidates come from.
pub struct Survey<'a> {
    /// The model.
    pub model: &'a Model,
    /// What the table logs.
    pub passport: &'a Passport,
}

impl Survey<'_> {
    /// One candidate a joint.
    pub(super) fn every_joint(&self, name: &str) -> Vec<EffectId> {
        (0..self.model.chain.len()).map(|joint| EffectId::at(name, Spot::Joint(joint))).collect()
    }

    /// One candidate a joint that turns.
    pub(super) fn every_turning_joint(&self, name: &str) -> Vec<EffectId> {
        let mut ids = self.every_joint(name);
        ids.retain(|id| id.joint().is_some_and(|joint| self.turns(joint)));
        ids
    }

    /// Whether a joint turns.
    pub(crate) fn turns(&self, joint: usize) -> bool {
        self.model.chain.joints.get(joint).is_some_and(|joint| joint.motion == Motion::Turns)
    }

    /// Whether anything with weight hangs on the arm.
    pub(crate) fn has_weight(&self) -> bool {
        !self.model.masses.is_empty() || self.passport.payload_range.is_some_and(|range| range > 0.0)
    }
}

/// Makes an effect at its place.
///
/// # Errors
/// The name is not known, or the model lacks what the effect needs.
pub fn build(id: &EffectId, model: &Model) -> Result<Box<dyn Effect>, EffectNameError> {
    if let Some(definition) = model.definition(&id.name) {
        return Ok(Box::new(Defined::new(definition)));
    }
    let kind = kind(&id.name).ok_or_else(|| unknown(&id.name, model))?;
    (kind.build)(&Setting { id, model })
}

fn unknown(name: &str, model: &Model) -> EffectNameError {
    let names = KINDS.iter().map(|kind| kind.name);
    let names = names.chain(model.definitions.iter().map(|definition| definition.name.as_str()));
    EffectNameError::UnknownEffect { name: name.to_owned(), suggestion: suggestion(name, names) }
}

/// Reads `joint_zero(shoulder)`, `joint_harmonic(waist, 1)`: exactly one effect.
///
/// # Errors
/// Unknown names, a wildcard, or the wrong number of arguments.
pub fn parse(text: &str, model: &Model) -> Result<EffectId, EffectNameError> {
    let mut ids = expand(text, model)?;
    match (ids.pop(), ids.is_empty()) {
        (Some(id), true) => Ok(id),
        _ => Err(EffectNameError::Malformed {
            text: text.to_owned(),
            example: "one effect at one place".to_owned(),
        }),
    }
}

/// Reads one effect, a wildcard (`joint_zero(*)`) or a group (`geometry(*)`), and lists what it stands for.
///
/// # Errors
/// Unknown names or the wrong number of arguments.
pub fn expand(text: &str, model: &Model) -> Result<Vec<EffectId>, EffectNameError> {
    let written = Written::split(text)?;
    if written.name == "geometry" {
        let group = KINDS.iter().filter(|kind| kind.geometry_group);
        let parts: Result<Vec<_>, _> =
            group.map(|kind| places(kind, text, &written.arguments, model)).collect();
        return Ok(parts?.into_iter().flatten().collect());
    }
    if let Some(definition) = model.definition(written.name) {
        return defined_at(definition, text, &written.arguments, model);
    }
    let kind = kind(written.name).ok_or_else(|| unknown(written.name, model))?;
    places(kind, text, &written.arguments, model)
}

/// A defined effect stands at one place: naming it is allowed, not needed.
fn defined_at(
    definition: &Definition,
    text: &str,
    arguments: &[&str],
    model: &Model,
) -> Result<Vec<EffectId>, EffectNameError> {
    let id = EffectId::at(&definition.name, definition.spot);
    match arguments {
        [] | ["*"] => Ok(vec![id]),
        [place] if *place == id.place(model) => Ok(vec![id]),
        _ => Err(EffectNameError::Malformed { text: text.to_owned(), example: id.label(model) }),
    }
}

fn places(
    kind: &Kind,
    text: &str,
    arguments: &[&str],
    model: &Model,
) -> Result<Vec<EffectId>, EffectNameError> {
    let example = match kind.places {
        Places::Joints => "(joint)",
        Places::JointsAndOrder => "(joint, periods a turn)",
        Places::JointPairs => "(joint, other joint)",
        Places::JointsAndQuantity => "(joint, zero|length|offset)",
        Places::Targets => "(p1)",
        Places::Axes => "(x|y|z)",
        Places::Surfaces => "(surface)",
        Places::Base | Places::Instrument | Places::Sensor => "",
    };
    let malformed =
        || EffectNameError::Malformed { text: text.to_owned(), example: format!("{}{example}", kind.name) };
    let at = |spot| EffectId::at(kind.name, spot);
    match (kind.places, arguments) {
        (Places::Base, [] | ["base"]) => Ok(vec![at(Spot::Base)]),
        (Places::Instrument, [] | ["instrument"]) => Ok(vec![at(Spot::Instrument)]),
        (Places::Sensor, [] | ["sensor"]) => Ok(vec![at(Spot::Sensor)]),
        (Places::Joints, [] | ["*"]) => {
            Ok((0..model.chain.len()).map(|joint| at(Spot::Joint(joint))).collect())
        }
        (Places::Joints, [name]) => Ok(vec![at(joint(kind, name, model)?)]),
        (Places::JointsAndOrder, [name, order]) => {
            let order: f64 = order.trim_start_matches("n=").trim().parse().map_err(|_| malformed())?;
            if !(order.is_finite() && order > 0.0) {
                return Err(malformed());
            }
            let with_order = |spot| EffectId { order: Some(order), ..at(spot) };
            match *name {
                "*" => Ok((0..model.chain.len()).map(|index| with_order(Spot::Joint(index))).collect()),
                name => Ok(vec![with_order(joint(kind, name, model)?)]),
            }
        }
        (Places::JointPairs, [first, other]) if *first == "*" || *other == "*" => {
            let all = |name: &str| -> Result<Vec<usize>, EffectNameError> {
                match name {
                    "*" => Ok((0..model.chain.len()).collect()),
                    name => Ok(joint(kind, name, model)?.joint().into_iter().collect()),
                }
            };
            let (firsts, others) = (all(first)?, all(other)?);
            let pairs = firsts.iter().flat_map(|joint| others.iter().map(move |other| (*joint, *other)));
            let distinct = pairs.filter(|(joint, other)| joint != other);
            Ok(distinct
                .map(|(joint, other)| EffectId { with: Some(other), ..at(Spot::Joint(joint)) })
                .collect())
        }
        (Places::JointPairs, [name, other]) => {
            let Spot::Joint(with) = joint(kind, other, model)? else { return Err(malformed()) };
            Ok(vec![EffectId { with: Some(with), ..at(joint(kind, name, model)?) }])
        }
        (Places::JointsAndQuantity, [name, of]) => {
            let of = Quantity::by_name(of).ok_or_else(malformed)?;
            let spots = match *name {
                "*" => (0..model.chain.len()).map(Spot::Joint).collect(),
                name => vec![joint(kind, name, model)?],
            };
            Ok(spots.into_iter().map(|spot| EffectId { of: Some(of), ..at(spot) }).collect())
        }
        (Places::Targets, [] | ["*"]) => {
            Ok((0..model.targets.len()).map(|index| at(Spot::Target(index))).collect())
        }
        (Places::Targets, [name]) => match model.target_position(name) {
            Some(index) => Ok(vec![at(Spot::Target(index))]),
            None => Err(EffectNameError::UnknownPlace {
                effect: kind.name.to_owned(),
                expected: "a target",
                place: (*name).to_owned(),
                suggestion: suggestion(name, model.targets.iter().map(|target| target.name.as_str())),
            }),
        },
        (Places::Surfaces, [] | ["*"]) => {
            Ok((0..model.surfaces.len()).map(|index| at(Spot::Surface(index))).collect())
        }
        (Places::Surfaces, [name]) => match model.surface_position(name) {
            Some(index) => Ok(vec![at(Spot::Surface(index))]),
            None => Err(EffectNameError::UnknownPlace {
                effect: kind.name.to_owned(),
                expected: "a surface",
                place: (*name).to_owned(),
                suggestion: suggestion(name, model.surfaces.iter().map(|surface| surface.name.as_str())),
            }),
        },
        (Places::Axes, [] | ["*"]) => Ok((0..3).map(|axis| at(Spot::Axis(axis))).collect()),
        (Places::Axes, [name]) => match ["x", "y", "z"].iter().position(|axis| axis == name) {
            Some(axis) => Ok(vec![at(Spot::Axis(axis))]),
            None => Err(malformed()),
        },
        _ => Err(malformed()),
    }
}

fn joint(kind: &Kind, name: &str, model: &Model) -> Result<Spot, EffectNameError> {
    model.chain.position_of(name).map(Spot::Joint).ok_or_else(|| EffectNameError::UnknownPlace {
        effect: kind.name.to_owned(),
        expected: "a joint",
        place: name.to_owned(),
        suggestion: suggestion(name, joint_names(&model.chain)),
    })
}
