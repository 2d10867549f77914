//! `prompt`: something a person does or knows.

use crate::expression::{Expression, Shape, Template};
use crate::prompt::ChoiceOption;
use crate::read_context::{CheckContext, DegOrMm, ReadContext};
use crate::yaml::{MapReader, Node, NodeValue, Place, did_you_mean};

/// A declared prompt.
#[derive(Debug, Clone)]
pub struct PromptStep {
    /// What is asked, or to be done.
    pub text: Template,
    /// More, for who wants to know.
    pub help: Option<Template>,
    /// The robot that is drawn under the text as it stands, and where its name stands.
    pub draw: Option<(String, Place)>,
    /// What counts as an answer.
    pub question: Question,
    /// In a simulated cell, what the operator's hands do when this is answered, or what the instrument reads that is asked for.
    pub simulated: Option<SimulatedAct>,
}

/// Something an operator does in a simulated world: the world knows it by name. Where the world is real, people do it.
#[derive(Debug, Clone)]
pub struct SimulatedAct {
    /// Its name.
    pub act: String,
    /// Its numbers.
    pub numbers: Vec<(String, Expression)>,
    /// Its words.
    pub words: Vec<(String, String)>,
}

/// What an act is told in words; all else are numbers.
const WORDS: [&str; 7] = ["at", "joint", "axis", "turned", "from", "laser", "filter"];

/// What counts as an answer.
#[derive(Debug, Clone)]
pub enum Question {
    /// Done.
    Acknowledge {
        /// What is confirmed.
        label: String,
    },
    /// One of several.
    Choice {
        /// In the order shown.
        options: Vec<ChoiceOption>,
        /// Offered first.
        default: Option<String>,
    },
    /// A number.
    Number {
        /// Its unit; empty for a bare number.
        unit: String,
        /// Smallest allowed.
        minimum: Option<Expression>,
        /// Greatest allowed.
        maximum: Option<Expression>,
        /// Offered first.
        default: Option<Expression>,
    },
    /// A line of text.
    Text {
        /// The most characters it may have.
        longest: usize,
    },
    /// A spirit level, read along two axes.
    Level {
        /// Furthest it can show to either side, deg.
        most: f64,
    },
    /// A picture that is taken, by its file.
    Photo,
    /// The arm brought somewhere by hand.
    JogTo {
        /// Which robot.
        robot: String,
        /// Where its name stands.
        place: Place,
        /// Bounds that have to be kept.
        goals: Vec<Goal>,
        /// From which side joints have to arrive.
        arrivals: Vec<Arrival>,
    },
}

/// From which side a joint that is driven by hand has to arrive.
#[derive(Debug, Clone)]
pub struct Arrival {
    /// The joint.
    pub joint: String,
    /// Where its name stands.
    pub place: Place,
    /// The side.
    pub from: ArrivalSide,
}

/// A side from which a joint arrives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ArrivalSide {
    /// Its reading increases.
    Below,
    /// Its reading decreases.
    Above,
}

impl ArrivalSide {
    /// As the measurement table has it: 1 from below, -1 from above.
    pub fn side(self) -> i8 {
        match self {
            Self::Below => 1,
            Self::Above => -1,
        }
    }

    /// `below` or `above`.
    pub fn in_words(self) -> &'static str {
        match self {
            Self::Below => "below",
            Self::Above => "above",
        }
    }
}

/// Bounds on one joint of a jog.
#[derive(Debug, Clone)]
pub struct Goal {
    /// The joint.
    pub joint: String,
    /// Where it stands.
    pub place: Place,
    /// How its numbers are written.
    pub unit: DegOrMm,
    /// Smallest allowed.
    pub minimum: Expression,
    /// Greatest allowed.
    pub maximum: Expression,
}

pub(super) fn read(node: &Node, context: &ReadContext<'_>) -> Option<PromptStep> {
    let mut map = MapReader::new(node, "a prompt", context.problems)?;
    let text = map.required("text").and_then(|node| context.template(node, "`text`"));
    let help = map.optional("help").and_then(|node| context.template(node, "`help`"));
    let draw = map
        .optional("draw")
        .and_then(|node| Some((node.text("`draw`", context.problems)?.to_owned(), node.place)));
    let acknowledge = map.optional("acknowledge");
    let choice = map.optional("choice");
    let default = map.optional("default");
    let number = map.optional("number");
    let write = map.optional("write");
    let level = map.optional("level");
    let photo = map.optional("photo");
    let jog_to = map.optional("jog_to");
    let simulated = map.optional("simulated").and_then(|node| read_simulated(node, context));
    let place = map.place();
    map.finish();
    let given = [acknowledge, choice, number, write, level, photo, jog_to].iter().flatten().count();
    if given > 1 {
        context.problems.add(
            place,
            "a prompt asks for one thing",
            "keep one of `acknowledge`, `choice`, `number`, `write`, `level`, `photo`, `jog_to`",
        );
    }
    let question = match (choice, number, write, (level, photo), jog_to) {
        (Some(node), ..) => read_choice(node, default, context),
        (_, Some(node), ..) => read_number(node, context),
        (_, _, Some(node), ..) => read_write(node, context),
        (_, _, _, (Some(node), _), _) => read_level(node, context),
        (_, _, _, (_, Some(node)), _) => read_photo(node, context),
        (.., Some(node)) => read_jog(node, context),
        _ => {
            let label =
                acknowledge.and_then(|node| node.text("`acknowledge`", context.problems)).unwrap_or("Done");
            Some(Question::Acknowledge { label: label.to_owned() })
        }
    };
    Some(PromptStep { text: text?, help, draw, question: question?, simulated })
}

fn read_simulated(node: &Node, context: &ReadContext<'_>) -> Option<SimulatedAct> {
    let entries = node.entries("`simulated`", context.problems)?;
    let [(act, values)] = entries else {
        let help = "write the act and its numbers, as in `simulated: {rest_on_gauge: {height_mm: h_mm}}`";
        context.problems.add(node.place, "a simulated operator does one thing", help);
        return None;
    };
    let mut read = SimulatedAct { act: act.name.clone(), numbers: Vec::new(), words: Vec::new() };
    for (key, node) in values.entries("what an act is told", context.problems)? {
        let what = format!("`{}`", key.name);
        match &node.value {
            NodeValue::Bool(word) if WORDS.contains(&key.name.as_str()) => {
                read.words.push((key.name.clone(), word.to_string()));
            }
            _ if WORDS.contains(&key.name.as_str()) => {
                read.words.push((key.name.clone(), node.text(&what, context.problems)?.to_owned()));
            }
            _ => read.numbers.push((key.name.clone(), context.expression(node, &what)?)),
        }
    }
    Some(read)
}

fn read_choice(node: &Node, default: Option<&Node>, context: &ReadContext<'_>) -> Option<Question> {
    let entries = node.entries("`choice`", context.problems)?;
    if entries.len() < 2 {
        context.problems.add(
            node.place,
            "a choice has at least two options",
            "write `choice: {light: Light paper, dark: Dark paper}`",
        );
    }
    let options: Vec<ChoiceOption> = entries
        .iter()
        .filter_map(|(key, node)| {
            let label = node.text("the label of an option", context.problems)?;
            Some(ChoiceOption { key: key.name.clone(), label: label.to_owned() })
        })
        .collect();
    let default = default.and_then(|node| {
        let key = node.text("`default`", context.problems)?;
        if !options.iter().any(|option| option.key == key) {
            let help = did_you_mean(key, options.iter().map(|option| option.key.as_str()));
            context.problems.add(node.place, format!("`{key}` is no option of this choice"), help);
        }
        Some(key.to_owned())
    });
    Some(Question::Choice { options, default })
}

fn read_number(node: &Node, context: &ReadContext<'_>) -> Option<Question> {
    let mut map = MapReader::new(node, "a number prompt", context.problems)?;
    let unit = context.required_text(&mut map, "unit");
    let minimum = map.optional("minimum").and_then(|node| context.expression(node, "`minimum`"));
    let maximum = map.optional("maximum").and_then(|node| context.expression(node, "`maximum`"));
    let default = map.optional("default").and_then(|node| context.expression(node, "`default`"));
    map.finish();
    let unit = match unit?.0.as_str() {
        "none" => String::new(),
        unit => unit.to_owned(),
    };
    Some(Question::Number { unit, minimum, maximum, default })
}

/// The most characters a written line may have, unless said otherwise, and whatever is said.
const USUALLY_LONGEST: f64 = 80.0;
const LONGEST: f64 = 400.0;

fn read_write(node: &Node, context: &ReadContext<'_>) -> Option<Question> {
    let mut map = MapReader::new(node, "`write`", context.problems)?;
    let longest = context.number_or(&mut map, "longest", (1.0, LONGEST), USUALLY_LONGEST);
    map.finish();
    Some(Question::Text { longest: longest as usize })
}

/// How far a level shows to either side unless said otherwise, and whatever is said, deg.
const USUALLY_MOST: f64 = 10.0;
const MOST: f64 = 90.0;

fn read_level(node: &Node, context: &ReadContext<'_>) -> Option<Question> {
    let mut map = MapReader::new(node, "`level`", context.problems)?;
    let most = context.number_or(&mut map, "most_deg", (0.01, MOST), USUALLY_MOST);
    map.finish();
    Some(Question::Level { most })
}

fn read_photo(node: &Node, context: &ReadContext<'_>) -> Option<Question> {
    MapReader::new(node, "`photo`", context.problems)?.finish();
    Some(Question::Photo)
}

fn read_jog(node: &Node, context: &ReadContext<'_>) -> Option<Question> {
    let mut map = MapReader::new(node, "`jog_to`", context.problems)?;
    let robot = context.required_text(&mut map, "robot");
    let mut goals = Vec::new();
    for (key, unit) in [("within_deg", DegOrMm::Deg), ("within_mm", DegOrMm::Mm)] {
        let Some(entries) =
            map.optional(key).and_then(|node| node.entries(&format!("`{key}`"), context.problems))
        else {
            continue;
        };
        for (joint, node) in entries {
            let bounds = match &node.value {
                NodeValue::List(items) => items.as_slice(),
                _ => &[],
            };
            let [minimum, maximum] = bounds else {
                context.problems.add(
                    node.place,
                    format!("the bounds of `{}` are two numbers", joint.name),
                    "write `[least, most]`",
                );
                continue;
            };
            let what = "a bound";
            if let (Some(minimum), Some(maximum)) =
                (context.expression(minimum, what), context.expression(maximum, what))
            {
                goals.push(Goal { joint: joint.name.clone(), place: joint.place, unit, minimum, maximum });
            }
        }
    }
    let arrivals = map.optional("from").map(|node| read_arrivals(node, context)).unwrap_or_default();
    map.finish();
    let (robot, place) = robot?;
    Some(Question::JogTo { robot, place, goals, arrivals })
}

fn read_arrivals(node: &Node, context: &ReadContext<'_>) -> Vec<Arrival> {
    let mut arrivals = Vec::new();
    for (joint, node) in node.entries("`from`", context.problems).unwrap_or_default() {
        let from = match node.text("a side", context.problems) {
            Some("below") => ArrivalSide::Below,
            Some("above") => ArrivalSide::Above,
            Some(other) => {
                let help = "write `below`, for a reading that increases until the joint is there, or `above`";
                context.problems.add(node.place, format!("`{other}` is no side to arrive from"), help);
                continue;
            }
            None => continue,
        };
        arrivals.push(Arrival { joint: joint.name.clone(), place: joint.place, from });
    }
    arrivals
}

impl PromptStep {
    pub(super) fn check(&self, context: &CheckContext<'_>) {
        context.check_template(&self.text);
        if let Some(help) = &self.help {
            context.check_template(help);
        }
        for (_, value) in self.simulated.iter().flat_map(|simulated| &simulated.numbers) {
            context.check_expression(value);
        }
        if let Some((robot, place)) = &self.draw {
            context.robot(robot, *place);
        }
        match &self.question {
            Question::Number { minimum, maximum, default, .. } => {
                for expression in [minimum, maximum, default].into_iter().flatten() {
                    context.check_expression(expression);
                }
            }
            Question::JogTo { robot, place, goals, arrivals } => {
                let robot = context.robot(robot, *place);
                for goal in goals {
                    goal.check(robot, context);
                }
                for arrival in arrivals {
                    if let Some(robot) = robot {
                        context.joint(robot, &arrival.joint, arrival.place);
                    }
                }
            }
            Question::Acknowledge { .. }
            | Question::Choice { .. }
            | Question::Text { .. }
            | Question::Level { .. }
            | Question::Photo => {}
        }
    }

    pub(super) fn result_shape(&self, joints_of: impl Fn(&str) -> Shape) -> Shape {
        match &self.question {
            Question::Acknowledge { .. } => Shape::Map(Vec::new()),
            Question::Choice { .. } => Shape::Map(vec![("choice".to_owned(), Shape::Single)]),
            Question::Number { .. } => Shape::Map(vec![("value".to_owned(), Shape::Single)]),
            Question::Text { .. } => Shape::Map(vec![("text".to_owned(), Shape::Single)]),
            Question::Level { .. } => {
                let single = |name: &str| (name.to_owned(), Shape::Single);
                Shape::Map(vec![single("x_deg"), single("y_deg"), single("tilt_deg")])
            }
            Question::Photo => {
                let single = |name: &str| (name.to_owned(), Shape::Single);
                Shape::Map(vec![single("file"), single("format"), single("bytes"), single("sha256")])
            }
            Question::JogTo { robot, .. } => Shape::Map(vec![("joints".to_owned(), joints_of(robot))]),
        }
    }
}

impl Goal {
    fn check(&self, robot: Option<&crate::read_context::RobotNames>, context: &CheckContext<'_>) {
        context.check_expression(&self.minimum);
        context.check_expression(&self.maximum);
        if let Some(robot) = robot
            && let Some(unit) = context.joint(robot, &self.joint, self.place)
            && unit != self.unit
        {
            let message = format!("joint `{}` goes by {}", self.joint, unit.symbol());
            context.problems.add(self.place, message, format!("write it under `within_{}`", unit.symbol()));
        }
    }
}
