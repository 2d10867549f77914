//! Forms that a formula may have: a factor times a function of an angle, at a joint's coordinate or at the base's attitude. Each is worked out here for the search, and
//! written as a formula of a model file for the user; a test holds the two together.

use plumb_calibration::effect::{Drive, Effect, Handle, LooksAt, Parameter, Situation, Unit};

/// What a formula is added to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Site {
    /// The coordinate of a joint that turns, or slides.
    Joint { joint: usize, slides: bool },
    /// The attitude of the base: turns about its x and its y, each with numbers of its own.
    Base,
}

/// What a function of the pose is multiplied with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Factor {
    One,
    /// Side from which a joint arrived.
    Side(usize),
    /// Last move of a joint.
    Move(usize),
    /// Hours since the first row.
    Hours,
    /// Temperature over this one, deg C.
    Temperature(f64),
    /// Load, kg.
    Payload,
    /// Moment of gravity about a joint's axis, N m.
    Moment(usize),
    /// Its amount.
    Load(usize),
    /// The way it pulls: gravity takes play up to that side.
    Pull(usize),
}

/// A joint's coordinate, or the sum or difference of two.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Angle {
    pub(super) first: usize,
    /// Another joint, and whether it counts the other way.
    pub(super) second: Option<(usize, bool)>,
}

/// A function of an angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Shape {
    One,
    Linear(Angle),
    /// Sine and cosine of so many times the angle.
    Wave(Angle, u32),
    /// How far the angle is above a value.
    Above(Angle, f64),
    /// How far it is below a value.
    Below(Angle, f64),
    /// How far it is beyond a value either way, with a number for each.
    Beyond(Angle, f64),
    /// Which side of a value it is on.
    Step(Angle, f64),
    /// Which half of the turn about a value it is in: what leans one way or the other as the arm swings round.
    Half(Angle, f64),
    /// A bump about a value, of so many rad (mm) standard deviation: what is worn, bent or dirty at one place.
    Bump(Angle, f64, f64),
}

/// One form at one place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Form {
    pub(super) site: Site,
    pub(super) factor: Factor,
    pub(super) shape: Shape,
}

impl Factor {
    fn value(self, situation: &Situation<'_>) -> f64 {
        let logged = |value: f64| if value.is_finite() { value } else { 0.0 };
        match self {
            Self::One => 1.0,
            Self::Side(joint) => situation.side(joint),
            Self::Move(joint) => {
                let before = situation.previous.and_then(|previous| previous.get(joint));
                before.map_or(0.0, |before| situation.coordinate(joint) - before)
            }
            Self::Hours => logged(situation.time) / 3600.0,
            Self::Temperature(middle) => logged(situation.temperature) - middle,
            Self::Payload => situation.weights.payload,
            Self::Moment(joint) => situation.moment(joint),
            Self::Load(joint) => situation.moment(joint).abs(),
            Self::Pull(joint) => sign(situation.moment(joint)),
        }
    }

    /// As a formula writes it; nothing for one.
    fn written(self) -> Option<String> {
        Some(match self {
            Self::One => return None,
            Self::Side(joint) => format!("side{}", joint + 1),
            Self::Move(joint) => format!("move{}", joint + 1),
            Self::Hours => "(t_s/3600)".to_owned(),
            Self::Temperature(middle) => format!("(temperature_c{})", less(middle)),
            Self::Payload => "payload_kg".to_owned(),
            Self::Moment(joint) => format!("m{}", joint + 1),
            Self::Load(joint) => format!("abs(m{})", joint + 1),
            Self::Pull(joint) => format!("sign(m{})", joint + 1),
        })
    }
}

impl Angle {
    pub(super) fn of(joint: usize) -> Self {
        Self { first: joint, second: None }
    }

    pub(super) fn value(self, coordinate: impl Fn(usize) -> f64) -> f64 {
        let other = self.second.map_or(
            0.0,
            |(joint, minus)| {
                if minus { -coordinate(joint) } else { coordinate(joint) }
            },
        );
        coordinate(self.first) + other
    }

    fn written(self) -> String {
        let first = format!("q{}", self.first + 1);
        match self.second {
            None => first,
            Some((joint, minus)) => format!("{first} {} q{}", if minus { '-' } else { '+' }, joint + 1),
        }
    }
}

/// As formulas have it: 0 of 0.
fn sign(value: f64) -> f64 {
    if value == 0.0 { 0.0 } else { value.signum() }
}

/// ` - 0.5`, or ` + 0.5` where half is to be added.
fn less(value: f64) -> String {
    if value < 0.0 { format!(" + {}", -value) } else { format!(" - {value}") }
}

impl Shape {
    fn values(self, situation: &Situation<'_>) -> Vec<f64> {
        let value = |angle: Angle| angle.value(|joint| situation.coordinate(joint));
        match self {
            Self::One => vec![1.0],
            Self::Linear(angle) => vec![value(angle)],
            Self::Wave(angle, order) => {
                let turned = f64::from(order) * value(angle);
                vec![turned.sin(), turned.cos()]
            }
            Self::Above(angle, at) => vec![(value(angle) - at).max(0.0)],
            Self::Below(angle, at) => vec![(at - value(angle)).max(0.0)],
            Self::Beyond(angle, at) => {
                vec![(value(angle) - at).max(0.0), (value(angle) + at).min(0.0)]
            }
            Self::Step(angle, at) => vec![sign(value(angle) - at)],
            Self::Half(angle, at) => vec![sign((value(angle) - at).sin())],
            Self::Bump(angle, at, wide) => vec![(-((value(angle) - at) / wide).powi(2) / 2.0).exp()],
        }
    }

    /// As a formula writes its terms.
    fn written(self) -> Vec<Option<String>> {
        let some = |text: String| Some(text);
        match self {
            Self::One => vec![None],
            Self::Linear(angle) => vec![some(format!("({})", angle.written()))],
            Self::Wave(angle, order) => {
                let inside = match (order, angle.second) {
                    (1, _) => angle.written(),
                    (order, None) => format!("{order}*{}", angle.written()),
                    (order, Some(_)) => format!("{order}*({})", angle.written()),
                };
                vec![some(format!("sin({inside})")), some(format!("cos({inside})"))]
            }
            Self::Above(angle, at) => vec![some(format!("max({}{}, 0)", angle.written(), less(at)))],
            Self::Below(angle, at) => vec![some(format!("max({at} - ({}), 0)", angle.written()))],
            Self::Beyond(angle, at) => vec![
                some(format!("max({}{}, 0)", angle.written(), less(at))),
                some(format!("min({}{}, 0)", angle.written(), less(-at))),
            ],
            Self::Step(angle, at) => vec![some(format!("sign({}{})", angle.written(), less(at)))],
            Self::Half(angle, at) => vec![some(format!("sign(sin({}{}))", angle.written(), less(at)))],
            Self::Bump(angle, at, wide) => {
                vec![some(format!("exp(-0.5*(({}{})/{wide})^2)", angle.written(), less(at)))]
            }
        }
    }

    /// Whether a number inside it was searched for.
    pub(super) fn is_searched(self) -> bool {
        !matches!(self, Self::One | Self::Linear(_) | Self::Wave(..))
    }
}

/// Most degrees, or degrees a unit of what drives it, that a formula may add to a joint or the base: beyond it is no error but another arm.
const MOST_DEG: f64 = 5.0;

/// The same for a joint that slides, mm.
const MOST_MM: f64 = 20.0;

/// Names of a formula's parameters, in order.
const NAMES: [&str; 4] = ["a", "b", "c", "d"];

impl Form {
    /// The key of `adds:`, and the formula, of each thing it is added to.
    pub(super) fn formulas(&self) -> Vec<(&'static str, String)> {
        let own = self.shape.written();
        let term = |(name, term): (&&str, &Option<String>)| {
            let parts = [Some((*name).to_owned()), self.factor.written(), term.clone()];
            parts.into_iter().flatten().collect::<Vec<_>>().join("*")
        };
        let sum = |names: &[&str]| names.iter().zip(&own).map(term).collect::<Vec<_>>().join(" + ");
        let (first, second) = NAMES.split_at(own.len());
        match self.site {
            Site::Joint { slides: false, .. } => vec![("deg", sum(first))],
            Site::Joint { slides: true, .. } => vec![("mm", sum(first))],
            Site::Base => vec![("base_x_deg", sum(first)), ("base_y_deg", sum(second))],
        }
    }

    /// Its parameters, in the unit of what it is added to.
    pub(super) fn parameters(&self) -> Vec<Parameter> {
        let own = self.shape.written().len();
        let (count, name, most) = match self.site {
            Site::Joint { slides: false, .. } => (own, "deg", MOST_DEG),
            Site::Joint { slides: true, .. } => (own, "mm", MOST_MM),
            Site::Base => (2 * own, "deg", MOST_DEG),
        };
        let unit = Unit::by_name(name).unwrap_or(Unit::RATIO);
        NAMES.iter().take(count).map(|name| Parameter::new(name, unit, (-most, most))).collect()
    }
}

/// A form as an effect, for the search.
#[derive(Debug)]
pub(super) struct Candidate {
    pub(super) form: Form,
    parameters: Vec<Parameter>,
}

impl Candidate {
    pub(super) fn new(form: Form) -> Self {
        Self { form, parameters: form.parameters() }
    }
}

impl Effect for Candidate {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn drive(&self, situation: &Situation<'_>, drives: &mut Vec<Drive>) {
        let factor = self.form.factor.value(situation);
        let values = self.form.shape.values(situation);
        let radians = 1.0_f64.to_radians();
        for (index, value) in values.iter().map(|value| factor * value).enumerate() {
            match self.form.site {
                Site::Joint { joint, slides } => {
                    let rate = if slides { value } else { value * radians };
                    drives.push(situation.drive_joint(joint, index, rate));
                }
                Site::Base => drives.extend([0, 1].map(|axis| Drive {
                    parameter: axis * values.len() + index,
                    handle: Handle::BaseTurn(axis),
                    rate: value * radians,
                })),
            }
        }
    }

    fn looks_at(&self) -> LooksAt {
        LooksAt::Gravity
    }
}
