//! Which effect, and where it acts: the names people write and read.

use std::fmt;

use plumb_kinematics::Chain;
use thiserror::Error;

use crate::table::scalar::{SCALARS, Scalar, ScalarUnit};

/// Where an effect acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Site {
    /// A joint, by its index.
    Joint(usize),
    /// A target, by its index in the model.
    Target(usize),
    /// An axis of the instrument: 0 x, 1 y, 2 z.
    Axis(usize),
    /// The base.
    Base,
    /// The instrument.
    Instrument,
    /// The arm's own sensor.
    Sensor,
    /// A surface the sensor triggers over, by its index in the model.
    Surface(usize),
    /// One number an instrument reads.
    Reading(Channel),
}

impl Site {
    /// The joint, if it is one.
    pub fn joint(self) -> Option<usize> {
        match self {
            Self::Joint(joint) => Some(joint),
            _ => None,
        }
    }
}

/// One number an instrument reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Channel {
    /// A position's x, mm.
    X,
    /// A position's y, mm.
    Y,
    /// A position's z, mm.
    Z,
    /// What a column of one number a row holds (mm or rad), by its index among all of these.
    Number(usize),
    /// A tilt about x, rad.
    TiltX,
    /// A tilt about y, rad.
    TiltY,
}

impl Channel {
    /// How many there are.
    pub const COUNT: usize = 5 + SCALARS.len();

    /// All of them, each at its index.
    pub fn all() -> impl Iterator<Item = Self> + Clone {
        let numbers = (0..SCALARS.len()).map(Self::Number);
        [Self::X, Self::Y, Self::Z].into_iter().chain(numbers).chain([Self::TiltX, Self::TiltY])
    }

    /// What a column of one number holds.
    pub fn of(scalar: &Scalar) -> Option<Self> {
        SCALARS.iter().position(|known| *known == scalar).map(Self::Number)
    }

    /// The column of one number that it is of, if it is of one.
    pub(crate) fn scalar(self) -> Option<&'static Scalar> {
        match self {
            Self::Number(index) => SCALARS.get(index).copied(),
            _ => None,
        }
    }

    /// Its index among all of them.
    pub(crate) fn index(self) -> usize {
        match self {
            Self::X => 0,
            Self::Y => 1,
            Self::Z => 2,
            Self::Number(number) => 3 + number,
            Self::TiltX => Self::COUNT - 2,
            Self::TiltY => Self::COUNT - 1,
        }
    }

    /// As written in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
            Self::Number(_) => self.scalar().map_or("", |scalar| scalar.name),
            Self::TiltX => "tilt_x",
            Self::TiltY => "tilt_y",
        }
    }

    /// By its name.
    pub fn by_name(name: &str) -> Option<Self> {
        Self::all().find(|channel| channel.name() == name)
    }

    /// Whether it is in mm (else rad).
    pub fn is_length(self) -> bool {
        match self {
            Self::X | Self::Y | Self::Z => true,
            Self::Number(_) => self.scalar().is_some_and(|scalar| scalar.unit == ScalarUnit::Length),
            Self::TiltX | Self::TiltY => false,
        }
    }
}

/// What of a link changes in time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Quantity {
    /// The joint's zero.
    Zero,
    /// The link's length.
    Length,
    /// The link's offset.
    Offset,
}

impl Quantity {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Zero, Self::Length, Self::Offset];

    /// As written in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Zero => "zero",
            Self::Length => "length",
            Self::Offset => "offset",
        }
    }

    /// By its name.
    pub fn by_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|quantity| quantity.name() == name)
    }
}

/// Which effect, and where.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectId {
    /// The effect's name.
    pub name: String,
    /// Where it acts.
    pub site: Site,
    /// The other joint of a coupling.
    pub with: Option<usize>,
    /// Periods a turn of a harmonic.
    pub order: Option<f64>,
    /// What warms up.
    pub of: Option<Quantity>,
    /// Parameters searched for, not fitted: a time constant (s), the time of a step (s).
    pub inner: Option<f64>,
}

impl EffectId {
    /// An effect at a place, nothing more said.
    pub fn at(name: &str, site: Site) -> Self {
        Self { name: name.to_owned(), site, with: None, order: None, of: None, inner: None }
    }

    /// The same effect at the same place, whatever was searched for inside.
    pub fn same_as(&self, other: &Self) -> bool {
        self.name == other.name
            && self.site == other.site
            && self.with == other.with
            && self.of == other.of
            // `inner` is left out: a time constant that was found anew makes no other effect.
            && self.order == other.order
    }

    /// The joint it acts on.
    pub fn joint(&self) -> Option<usize> {
        self.site.joint()
    }
}

/// Why a written effect cannot be understood.
#[derive(Debug, Error, PartialEq)]
pub enum EffectNameError {
    /// There is no such effect.
    #[error("there is no effect `{name}`{suggestion}")]
    UnknownEffect {
        /// What was written.
        name: String,
        /// What may have been meant.
        suggestion: String,
    },
    /// There is no such joint, target or axis.
    #[error("`{effect}` acts on {expected}, and there is none called `{site}`{suggestion}")]
    UnknownSite {
        /// The effect.
        effect: String,
        /// Joint, target, axis.
        expected: &'static str,
        /// What was written.
        site: String,
        /// What may have been meant.
        suggestion: String,
    },
    /// Brackets or arguments that cannot be read.
    #[error("`{text}` is no effect; write {example}")]
    Malformed {
        /// What was written.
        text: String,
        /// What would be right.
        example: String,
    },
    /// The effect is known but the model lacks what it needs.
    #[error("`{effect}` {reason}")]
    Unusable {
        /// The effect.
        effect: String,
        /// What is missing.
        reason: String,
    },
}

/// `name(first, second)` split into its parts.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Written<'a> {
    pub(crate) name: &'a str,
    pub(crate) arguments: Vec<&'a str>,
}

impl<'a> Written<'a> {
    pub(crate) fn split(text: &'a str) -> Result<Self, EffectNameError> {
        let malformed = EffectNameError::Malformed {
            text: text.to_owned(),
            example: "a name and its place, such as joint_zero(*) or joint_harmonic(waist, 1)".to_owned(),
        };
        let text = text.trim();
        let Some((name, rest)) = text.split_once('(') else {
            return if text.contains(')') || text.is_empty() {
                Err(malformed)
            } else {
                Ok(Self { name: text, arguments: Vec::new() })
            };
        };
        let Some(inside) = rest.strip_suffix(')') else { return Err(malformed) };
        let arguments: Vec<&str> =
            inside.split(',').map(str::trim).filter(|argument| !argument.is_empty()).collect();
        if arguments.iter().any(|argument| argument.contains(['(', ')'])) {
            return Err(malformed);
        }
        Ok(Self { name: name.trim(), arguments })
    }
}

/// Joints' names, for messages.
pub(crate) fn joint_names(chain: &Chain) -> impl Iterator<Item = &str> {
    chain.joints.iter().map(|joint| joint.name.as_str())
}

impl fmt::Display for Quantity {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}
