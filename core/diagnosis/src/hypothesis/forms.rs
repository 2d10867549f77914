//! Forms that a formula may have: a factor times a function of an angle, at a joint's coordinate or at the base's attitude. Each is worked out here for the search, and
//! written as a formula of a model file for the user; a test holds the two together.

use plumb_calibration::effect::{Contribution, Dof, Effect, LooksAt, Parameter, Sample, Unit};

/// What a formula is added to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum FormSite {
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
    pub(super) site: FormSite,
    pub(super) factor: Factor,
    pub(super) shape: Shape,
}

impl Factor {
    fn value(self, sample: &Sample<'_>) -> f64 {
        match self {
            Self::One => 1.0,
            Self::Side(joint) => sample.side(joint),
            Self::Move(joint) => {
                let before = sample.previous.and_then(|previous| previous.get(joint));
                before.map_or(0.0, |before| sample.coordinate(joint) - before)
            }
            Self::Hours => or_zero(sample.time) / 3600.0,
            Self::Temperature(middle) => or_zero(sample.temperature) - middle,
            Self::Payload => sample.weights.payload,
            Self::Moment(joint) => sample.moment(joint),
            Self::Load(joint) => sample.moment(joint).abs(),
            Self::Pull(joint) => sign(sample.moment(joint)),
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

/// A condition as formulas have it: 0 where it was not logged.
fn or_zero(value: f64) -> f64 {
    if value.is_finite() { value } else { 0.0 }
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
    fn values(self, sample: &Sample<'_>) -> Vec<f64> {
        let Some(angle) = self.angle() else { return vec![1.0] };
        let x = angle.value(|joint| sample.coordinate(joint));
        match self {
            Self::One => vec![1.0],
            Self::Linear(_) => vec![x],
            Self::Wave(_, order) => {
                let turned = f64::from(order) * x;
                vec![turned.sin(), turned.cos()]
            }
            Self::Above(_, at) => vec![(x - at).max(0.0)],
            Self::Below(_, at) => vec![(at - x).max(0.0)],
            Self::Beyond(_, at) => vec![(x - at).max(0.0), (x + at).min(0.0)],
            Self::Step(_, at) => vec![sign(x - at)],
            Self::Half(_, at) => vec![sign((x - at).sin())],
            Self::Bump(_, at, wide) => vec![(-((x - at) / wide).powi(2) / 2.0).exp()],
        }
    }

    /// What it is a function of; nothing for one.
    fn angle(self) -> Option<Angle> {
        match self {
            Self::One => None,
            Self::Linear(angle)
            | Self::Wave(angle, _)
            | Self::Above(angle, _)
            | Self::Below(angle, _)
            | Self::Beyond(angle, _)
            | Self::Step(angle, _)
            | Self::Half(angle, _)
            | Self::Bump(angle, ..) => Some(angle),
        }
    }

    /// As a formula writes its terms; nothing in place of a term that is one.
    fn written(self) -> Vec<Option<String>> {
        // Parentheses about every difference: a formula is read by precedence, not as it looks.
        let terms = match self {
            Self::One => return vec![None],
            Self::Linear(angle) => vec![format!("({})", angle.written())],
            Self::Wave(angle, order) => {
                let inside = match (order, angle.second) {
                    (1, _) => angle.written(),
                    (order, None) => format!("{order}*{}", angle.written()),
                    (order, Some(_)) => format!("{order}*({})", angle.written()),
                };
                vec![format!("sin({inside})"), format!("cos({inside})")]
            }
            Self::Above(angle, at) => vec![format!("max({}{}, 0)", angle.written(), less(at))],
            Self::Below(angle, at) => vec![format!("max({at} - ({}), 0)", angle.written())],
            Self::Beyond(angle, at) => vec![
                format!("max({}{}, 0)", angle.written(), less(at)),
                format!("min({}{}, 0)", angle.written(), less(-at)),
            ],
            Self::Step(angle, at) => vec![format!("sign({}{})", angle.written(), less(at))],
            Self::Half(angle, at) => vec![format!("sign(sin({}{}))", angle.written(), less(at))],
            Self::Bump(angle, at, wide) => {
                vec![format!("exp(-0.5*(({}{})/{wide})^2)", angle.written(), less(at))]
            }
        };
        terms.into_iter().map(Some).collect()
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
        let (first, second) = NAMES.split_at(self.shape.written().len());
        match self.site {
            FormSite::Joint { slides: false, .. } => vec![("deg", self.sum(first))],
            FormSite::Joint { slides: true, .. } => vec![("mm", self.sum(first))],
            // The axis of a lean is not known: each component has numbers of its own.
            FormSite::Base => vec![("base_x_deg", self.sum(first)), ("base_y_deg", self.sum(second))],
        }
    }

    /// The formula with its parameters called so, in order.
    fn sum(&self, names: &[&str]) -> String {
        let terms = names.iter().zip(self.shape.written()).map(|(name, term)| {
            let parts = [Some((*name).to_owned()), self.factor.written(), term];
            parts.into_iter().flatten().collect::<Vec<_>>().join("*")
        });
        terms.collect::<Vec<_>>().join(" + ")
    }

    /// Its parameters, in the unit of what it is added to.
    pub(super) fn parameters(&self) -> Vec<Parameter> {
        let own = self.shape.written().len();
        let (count, name, most) = match self.site {
            FormSite::Joint { slides: false, .. } => (own, "deg", MOST_DEG),
            FormSite::Joint { slides: true, .. } => (own, "mm", MOST_MM),
            FormSite::Base => (2 * own, "deg", MOST_DEG),
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

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        let factor = self.form.factor.value(sample);
        let values = self.form.shape.values(sample);
        // A formula is written in degrees, as people write model files; the arm computes in radians.
        let radians = 1.0_f64.to_radians();
        for (index, value) in values.iter().map(|value| factor * value).enumerate() {
            match self.form.site {
                FormSite::Joint { joint, slides } => {
                    let rate = if slides { value } else { value * radians };
                    contributions.push(sample.contribute_to_joint(joint, index, rate));
                }
                FormSite::Base => contributions.extend([0, 1].map(|axis| Contribution {
                    parameter: axis * values.len() + index,
                    dof: Dof::BaseRotation(axis),
                    rate: value * radians,
                })),
            }
        }
    }

    fn looks_at(&self) -> LooksAt {
        LooksAt::Gravity
    }
}
