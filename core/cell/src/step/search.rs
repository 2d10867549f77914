//! `search`: a guarded move of one joint until a sensor changes.

use super::row::CIRCUMSTANCES;
use crate::expression::Expression;
use crate::read_context::{CheckContext, DegOrMm, ReadContext};
use crate::yaml::{MapReader, Node, Place, did_you_mean};

/// A declared search.
#[derive(Debug, Clone)]
pub struct SearchStep {
    /// Which robot.
    pub robot: String,
    /// Where its name stands.
    pub robot_place: Place,
    /// The joint that moves.
    pub joint: String,
    /// Where its name stands.
    pub joint_place: Place,
    /// How the search's lengths are written.
    pub unit: DegOrMm,
    /// How far at most; its sign is the direction.
    pub travel: Expression,
    /// The sensor that is watched.
    pub sensor: String,
    /// Where its name stands.
    pub sensor_place: Place,
    /// The search ends where the sensor comes on, or where it goes off.
    pub until_on: bool,
    /// The first approach.
    pub fast: Approach,
    /// The second approach, from the same side.
    pub slow: Approach,
    /// How far it goes back between the two.
    pub back_off: f64,
    /// When the sensor is there already at the start: go back by `back_off` until it is not, rather than fail.
    pub back_off_first: bool,
    /// When the sensor does not change on the whole way: go on, and say so in the result, rather than fail.
    pub may_find_nothing: bool,
    /// What the sensor stands over when it changes, for who fits a model to the trigger poses.
    pub finds: Option<Finds>,
}

/// What the sensor stands over when it changes.
#[derive(Debug, Clone)]
pub struct Finds {
    /// The surface or line, as the robot's model file calls it.
    pub surface: String,
    /// Where its name stands.
    pub place: Place,
    /// How high over it the hand is then, mm.
    pub height_mm: Option<Expression>,
    /// Under which circumstances, by the model lab's columns: load, temperature, which return to a pose.
    pub circumstances: Vec<(&'static str, Expression)>,
}

/// How a search approaches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Approach {
    /// It moves in pieces this long, so that it overshoots by one at most.
    pub chunk: f64,
    /// Part of the full speed.
    pub speed: f64,
}

pub(super) fn read(node: &Node, context: &ReadContext<'_>) -> Option<SearchStep> {
    let mut map = MapReader::new(node, "a search", context.problems)?;
    let robot = context.required_text(&mut map, "robot");
    let joint = context.required_text(&mut map, "joint");
    let until = map.required("until").and_then(|node| read_until(node, context));
    let in_mm = map.optional("travel_mm");
    let unit = if in_mm.is_some() { DegOrMm::Mm } else { DegOrMm::Deg };
    let travel_node = match in_mm {
        Some(node) => Some(node),
        None => map.required("travel_deg"),
    };
    let travel = travel_node.and_then(|node| context.expression(node, "the travel of a search"));
    let fast = read_approach(&mut map, "fast", (1.0, 1.0), unit, context);
    let slow = read_approach(&mut map, "slow", (0.25, 0.2), unit, context);
    let back_off_key = if unit == DegOrMm::Mm { "back_off_mm" } else { "back_off_deg" };
    let back_off = context.number_or(&mut map, back_off_key, (0.001, 90.0), 2.0 * fast.chunk);
    let back_off_first = map
        .optional("already_there")
        .and_then(|node| node.word("way to begin", &["fail", "back_off"], context.problems))
        == Some(1);
    let may_find_nothing = map
        .optional("nothing_found")
        .and_then(|node| node.word("way to end", &["fail", "go_on"], context.problems))
        == Some(1);
    let finds = map.optional("finds").and_then(|node| read_finds(node, context));
    map.finish();
    let (robot, robot_place) = robot?;
    let (joint, joint_place) = joint?;
    let (sensor, sensor_place, until_on) = until?;
    let travel = travel?;
    Some(SearchStep {
        robot,
        robot_place,
        joint,
        joint_place,
        unit,
        travel,
        sensor,
        sensor_place,
        until_on,
        fast,
        slow,
        back_off,
        back_off_first,
        may_find_nothing,
        finds,
    })
}

fn read_until(node: &Node, context: &ReadContext<'_>) -> Option<(String, Place, bool)> {
    let mut map = MapReader::new(node, "`until` of a search", context.problems)?;
    let sensor = context.required_text(&mut map, "sensor");
    let is =
        map.required("is").and_then(|node| node.word("state of a sensor", &["on", "off"], context.problems));
    map.finish();
    let (sensor, place) = sensor?;
    Some((sensor, place, is? == 0))
}

fn read_finds(node: &Node, context: &ReadContext<'_>) -> Option<Finds> {
    let mut map = MapReader::new(node, "`finds`", context.problems)?;
    let surface = context.required_text(&mut map, "on");
    let height_mm = map.optional("height_mm").and_then(|node| context.expression(node, "`height_mm`"));
    let circumstances = CIRCUMSTANCES.into_iter().filter_map(|column| {
        let value = context.expression(map.optional(column)?, &format!("`{column}`"))?;
        Some((column, value))
    });
    let circumstances = circumstances.collect();
    map.finish();
    let (surface, place) = surface?;
    Some(Finds { surface, place, height_mm, circumstances })
}

fn read_approach(
    map: &mut MapReader<'_>,
    key: &'static str,
    (chunk, speed): (f64, f64),
    unit: DegOrMm,
    context: &ReadContext<'_>,
) -> Approach {
    let default = Approach { chunk, speed };
    let Some(mut map) =
        map.optional(key).and_then(|node| MapReader::new(node, "an approach", context.problems))
    else {
        return default;
    };
    let chunk_key = if unit == DegOrMm::Mm { "chunk_mm" } else { "chunk_deg" };
    let chunk = context.number_or(&mut map, chunk_key, (1e-4, 30.0), default.chunk);
    let speed = context.number_or(&mut map, "speed", (0.001, 1.0), default.speed);
    map.finish();
    Approach { chunk, speed }
}

impl SearchStep {
    pub(super) fn check(&self, context: &CheckContext<'_>) {
        context.check_expression(&self.travel);
        if let Some(finds) = &self.finds {
            let circumstances = finds.circumstances.iter().map(|(_, value)| value);
            finds.height_mm.iter().chain(circumstances).for_each(|value| context.check_expression(value));
        }
        context.sensor(&self.sensor, self.sensor_place);
        let Some(robot) = context.robot(&self.robot, self.robot_place) else { return };
        if let Some(finds) = self.finds.as_ref().filter(|finds| !robot.surfaces.contains(&finds.surface)) {
            let message = format!("the model of {} has no surface `{}`", robot.name, finds.surface);
            let help = did_you_mean(&finds.surface, robot.surfaces.iter().map(String::as_str));
            context.problems.add(finds.place, message, help);
        }
        if let Some(unit) = context.joint(robot, &self.joint, self.joint_place)
            && unit != self.unit
        {
            let message = format!("joint `{}` goes by {}", self.joint, unit.symbol());
            context.problems.add(self.joint_place, message, format!("write `travel_{}`", unit.symbol()));
        }
    }
}
