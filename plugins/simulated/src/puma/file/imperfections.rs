//! What may be wrong with the arm, as a file tells it.

use serde::Deserialize;
use serde_yaml::{Location, Spanned};

use super::{Checker, Number};
use crate::physics::imperfection::{Imperfection, Mechanism, Warming};
use crate::world::file::WorldFileError;

/// One thing that is wrong.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum RawImperfection {
    JointGain(InDegPerDeg),
    LinkLength(InMm),
    LinkOffset(InMm),
    LinkTwist(InDeg),
    AxisSkew(InDeg),
    JointCompliance(Compliance),
    JointStiffening(Stiffening),
    JointHarmonic(Harmonic),
    JointBacklash(Backlash),
    JointCoupling(Coupling),
    WarmUp(WarmUp),
    LinkSag(Sag),
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct InMm {
    joint: Spanned<String>,
    mm: Number,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct InDeg {
    joint: Spanned<String>,
    deg: Number,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct InDegPerDeg {
    joint: Spanned<String>,
    deg_per_deg: Number,
}

/// Gives way evenly.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Compliance {
    joint: Spanned<String>,
    rad_per_nm: Number,
}

/// Gives way less and less.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Stiffening {
    joint: Spanned<String>,
    rad_per_nm: Number,
    knee_nm: Number,
}

/// A wheel out of true.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Harmonic {
    joint: Spanned<String>,
    per_turn: Number,
    amplitude_deg: Number,
    #[serde(default)]
    phase_deg: Option<Number>,
}

/// Play.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Backlash {
    joint: Spanned<String>,
    width_deg: Number,
}

/// One joint drags another.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Coupling {
    joint: Spanned<String>,
    driver: Spanned<String>,
    deg_per_deg: Number,
}

/// Something moves while the arm warms up.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WarmUp {
    joint: Spanned<String>,
    zero_deg: Option<Number>,
    length_mm: Option<Number>,
    offset_mm: Option<Number>,
    time_constant_s: Number,
}

/// A link bends.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Sag {
    joint: Spanned<String>,
    per_nm2: Number,
}

impl Checker<'_> {
    pub(super) fn imperfection(
        &self,
        raw: &RawImperfection,
        place: Location,
    ) -> Result<Imperfection, WorldFileError> {
        let mm =
            |raw: &InMm| Ok((self.joint(&raw.joint)?, self.typed.number("mm", &raw.mm, -50.0..=50.0, "mm")?));
        let deg = |raw: &InDeg| {
            let size = self.typed.number("deg", &raw.deg, -10.0..=10.0, "deg")?.to_radians();
            Ok((self.joint(&raw.joint)?, size))
        };
        let softness = |value: &Number| self.typed.number("rad_per_nm", value, 0.0..=0.01, "rad/(N m)");
        let (mechanism, size) = match raw {
            RawImperfection::JointGain(raw) => {
                let size = self.typed.number("deg_per_deg", &raw.deg_per_deg, -0.1..=0.1, "deg/deg")?;
                (Mechanism::JointGain { joint: self.joint(&raw.joint)? }, size)
            }
            RawImperfection::LinkLength(raw) => {
                let (joint, size) = mm(raw)?;
                (Mechanism::LinkLength { joint }, size)
            }
            RawImperfection::LinkOffset(raw) => {
                let (joint, size) = mm(raw)?;
                (Mechanism::LinkOffset { joint }, size)
            }
            RawImperfection::LinkTwist(raw) => {
                let (joint, size) = deg(raw)?;
                (Mechanism::LinkTwist { joint }, size)
            }
            RawImperfection::AxisSkew(raw) => {
                let (joint, size) = deg(raw)?;
                (Mechanism::AxisSkew { joint }, size)
            }
            RawImperfection::JointCompliance(raw) => {
                (Mechanism::JointCompliance { joint: self.joint(&raw.joint)? }, softness(&raw.rad_per_nm)?)
            }
            RawImperfection::JointStiffening(raw) => {
                let knee = self.typed.number("knee_nm", &raw.knee_nm, 0.01..=1000.0, "N m")?;
                let joint = self.joint(&raw.joint)?;
                (Mechanism::JointStiffening { joint, knee }, softness(&raw.rad_per_nm)?)
            }
            RawImperfection::JointHarmonic(raw) => self.harmonic(raw)?,
            RawImperfection::JointBacklash(raw) => {
                let width = self.typed.number("width_deg", &raw.width_deg, 0.0..=5.0, "deg")?.to_radians();
                (Mechanism::JointBacklash { joint: self.joint(&raw.joint)? }, width)
            }
            RawImperfection::JointCoupling(raw) => {
                let (joint, driver) = (self.joint(&raw.joint)?, self.joint(&raw.driver)?);
                let size = self.typed.number("deg_per_deg", &raw.deg_per_deg, -1.0..=1.0, "deg/deg")?;
                (Mechanism::JointCoupling { joint, driver }, size)
            }
            RawImperfection::WarmUp(raw) => self.warm_up(raw, place)?,
            RawImperfection::LinkSag(raw) => {
                let size = self.typed.number("per_nm2", &raw.per_nm2, 0.0..=0.01, "1/(N m2)")?;
                (Mechanism::LinkSag { joint: self.joint(&raw.joint)? }, size)
            }
        };
        Ok(Imperfection { mechanism, size })
    }

    fn harmonic(&self, raw: &Harmonic) -> Result<(Mechanism, f64), WorldFileError> {
        let joint = self.joint(&raw.joint)?;
        let per_turn =
            self.typed.number("per_turn", &raw.per_turn, 0.01..=1000.0, "turns for a turn of the joint")?;
        let phase = self.typed.or("phase_deg", &raw.phase_deg, 0.0, -360.0..=360.0, "deg")?.to_radians();
        let size = self.typed.number("amplitude_deg", &raw.amplitude_deg, 0.0..=2.0, "deg")?.to_radians();
        Ok((Mechanism::JointHarmonic { joint, per_turn, phase }, size))
    }

    fn warm_up(&self, raw: &WarmUp, place: Location) -> Result<(Mechanism, f64), WorldFileError> {
        let joint = self.joint(&raw.joint)?;
        let time_constant_s = self.typed.number("time_constant_s", &raw.time_constant_s, 1.0..=1e6, "s")?;
        let (of, size) = match (&raw.zero_deg, &raw.length_mm, &raw.offset_mm) {
            (Some(zero), None, None) => {
                (Warming::Zero, self.typed.number("zero_deg", zero, -5.0..=5.0, "deg")?.to_radians())
            }
            (None, Some(length), None) => {
                (Warming::Length, self.typed.number("length_mm", length, -10.0..=10.0, "mm")?)
            }
            (None, None, Some(offset)) => {
                (Warming::Offset, self.typed.number("offset_mm", offset, -10.0..=10.0, "mm")?)
            }
            _ => {
                let problem = "a warm-up changes one thing: give `zero_deg`, `length_mm` or `offset_mm`, what it comes to in the end";
                return Err(self.typed.wrong(place, problem.to_owned()));
            }
        };
        Ok((Mechanism::WarmUp { joint, of, time_constant_s }, size))
    }
}
