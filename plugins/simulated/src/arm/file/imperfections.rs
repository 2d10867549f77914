//! What may be wrong with the arm, as a file gives it. A joint that turns has its sizes in degrees, one that slides in millimetres.

use std::ops::RangeInclusive;

use plumb_document::{Span, Spanned};
use serde::Deserialize;

use super::checker::{Checker, Number};
use crate::arm::description::ArmOnPaper;
use crate::physics::description::Motion;
use crate::physics::imperfection::{Imperfection, Mechanism, Warming};

/// The softest drive, rad/(N m): what trials take for the most that anyone would believe ([`Mechanism::greatest_plausible`]).
const SOFTEST: f64 = 0.05;

/// Millimetres in a metre.
const MM_PER_M: f64 = 1000.0;

/// One thing that is wrong.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum RawImperfection {
    JointZero(Zero),
    JointGain(Gain),
    LinkLength(InMm),
    LinkOffset(InMm),
    LinkTwist(InDeg),
    AxisSkew(InDeg),
    JointCompliance(Compliance),
    JointStiffening(Stiffening),
    JointHarmonic(Harmonic),
    ScrewWave(ScrewWave),
    AxisRoll(Rail),
    AxisPitch(Rail),
    AxisYaw(Rail),
    JointBacklash(Backlash),
    JointSettling(Settling),
    JointLag(Lag),
    JointCoupling(Coupling),
    LostSteps(Lost),
    WarmUp(WarmUp),
    LinkSag(Flexible),
    LinkTorsion(Flexible),
}

/// The joint reads zero elsewhere.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Zero {
    joint: Spanned<String>,
    deg: Option<Number>,
    mm: Option<Number>,
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

/// The transmission ratio differs.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Gain {
    joint: Spanned<String>,
    deg_per_deg: Option<Number>,
    mm_per_mm: Option<Number>,
}

/// Gives way evenly.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Compliance {
    joint: Spanned<String>,
    rad_per_nm: Option<Number>,
    mm_per_n: Option<Number>,
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

/// A screw out of true; its pitch is in the arm's file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ScrewWave {
    joint: Spanned<String>,
    per_turn: Option<Number>,
    amplitude_mm: Number,
    phase_deg: Option<Number>,
}

/// A guideway that is not straight.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Rail {
    joint: Spanned<String>,
    deg_per_m: Number,
}

/// Play.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Backlash {
    joint: Spanned<String>,
    width_deg: Option<Number>,
    width_mm: Option<Number>,
}

/// Short by a part of each move, which is forgotten with time.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Settling {
    joint: Spanned<String>,
    part: Number,
    time_constant_s: Number,
}

/// Short in proportion to the speed of each move.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Lag {
    joint: Spanned<String>,
    at_full_speed_deg: Option<Number>,
    at_full_speed_mm: Option<Number>,
}

/// One joint drags another.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Coupling {
    joint: Spanned<String>,
    driver: Spanned<String>,
    deg_per_deg: Number,
}

/// Steps that go missing once.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Lost {
    joint: Spanned<String>,
    at_s: Number,
    deg: Option<Number>,
    mm: Option<Number>,
}

/// Something moves while the arm warms up.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WarmUp {
    joint: Spanned<String>,
    zero_deg: Option<Number>,
    zero_mm: Option<Number>,
    length_mm: Option<Number>,
    offset_mm: Option<Number>,
    time_constant_s: Number,
}

/// A link bends, or twists.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Flexible {
    joint: Spanned<String>,
    per_nm2: Number,
}

/// An imperfection as a world file has it, `joint_backlash: {joint: slide, width_mm: 0.4}`; none for what files do not say.
pub fn written(one: &Imperfection, paper: &ArmOnPaper) -> Option<String> {
    let drive = paper.drive.joints.get(one.mechanism.joint()?)?;
    let (joint, unit) = (&drive.name, drive.unit());
    let slides = drive.motion == Motion::Slides;
    // A size of the joint's own coordinate, as it is written for one that moves so.
    let own = drive.written(one.size);
    let (size, degrees) = (one.size, one.size.to_degrees());
    let name = one.mechanism.name();
    let rest = match one.mechanism {
        Mechanism::JointZero { .. } => format!("{unit}: {own}"),
        Mechanism::JointGain { .. } => format!("{unit}_per_{unit}: {size}"),
        Mechanism::LinkLength { .. } | Mechanism::LinkOffset { .. } => format!("mm: {size}"),
        Mechanism::LinkTwist { .. } | Mechanism::AxisSkew { .. } => format!("deg: {degrees}"),
        Mechanism::JointCompliance { .. } if slides => format!("mm_per_n: {size}"),
        Mechanism::JointCompliance { .. } => format!("rad_per_nm: {size}"),
        Mechanism::JointStiffening { knee, .. } => format!("rad_per_nm: {size}, knee_nm: {knee}"),
        Mechanism::JointHarmonic { per_turn, phase, .. } => {
            format!("per_turn: {per_turn}, amplitude_deg: {degrees}, phase_deg: {}", phase.to_degrees())
        }
        Mechanism::ScrewWave { per_turn, phase, .. } => {
            format!("per_turn: {per_turn}, amplitude_mm: {size}, phase_deg: {}", phase.to_degrees())
        }
        Mechanism::AxisRoll { .. } | Mechanism::AxisPitch { .. } | Mechanism::AxisYaw { .. } => {
            format!("deg_per_m: {}", degrees * MM_PER_M)
        }
        Mechanism::JointBacklash { .. } => format!("width_{unit}: {own}"),
        Mechanism::JointLag { .. } => format!("at_full_speed_{unit}: {own}"),
        Mechanism::JointCoupling { driver, .. } => {
            format!("driver: {}, deg_per_deg: {size}", paper.drive.joints.get(driver)?.name)
        }
        Mechanism::LinkSag { .. } | Mechanism::LinkTorsion { .. } => format!("per_nm2: {size}"),
        _ => return None,
    };
    Some(format!("{name}: {{joint: {joint}, {rest}}}"))
}

/// One size under two keys: the first for a joint that turns, the second for one that slides.
struct TwoUnits<'a> {
    turning: (&'static str, &'a Option<Number>, RangeInclusive<f64>, &'static str),
    sliding: (&'static str, &'a Option<Number>, RangeInclusive<f64>, &'static str),
}

/// A mechanism at a joint, with its size.
fn at((joint, size): (usize, f64), mechanism: impl Fn(usize) -> Mechanism) -> (Mechanism, f64) {
    (mechanism(joint), size)
}

impl Checker<'_> {
    pub(super) fn imperfection(&self, raw: &RawImperfection, span: Span) -> Option<Imperfection> {
        let in_mm = |raw: &InMm| {
            Some((self.joint(&raw.joint)?, self.typed.number("mm", &raw.mm, -50.0..=50.0, "mm")))
        };
        let in_deg = |raw: &InDeg| {
            let size = self.typed.number("deg", &raw.deg, -10.0..=10.0, "deg").to_radians();
            Some((self.joint(&raw.joint)?, size))
        };
        let (mechanism, size) = match raw {
            RawImperfection::JointZero(raw) => self.zero(raw)?,
            RawImperfection::JointGain(raw) => self.gain(raw)?,
            RawImperfection::LinkLength(raw) => at(in_mm(raw)?, |joint| Mechanism::LinkLength { joint }),
            RawImperfection::LinkOffset(raw) => at(in_mm(raw)?, |joint| Mechanism::LinkOffset { joint }),
            RawImperfection::LinkTwist(raw) => at(in_deg(raw)?, |joint| Mechanism::LinkTwist { joint }),
            RawImperfection::AxisSkew(raw) => at(in_deg(raw)?, |joint| Mechanism::AxisSkew { joint }),
            RawImperfection::JointCompliance(raw) => self.compliance(raw)?,
            RawImperfection::JointStiffening(raw) => self.stiffening(raw)?,
            RawImperfection::JointHarmonic(raw) => self.harmonic(raw)?,
            RawImperfection::ScrewWave(raw) => self.screw_wave(raw)?,
            RawImperfection::AxisRoll(raw) => at(self.rail(raw)?, |joint| Mechanism::AxisRoll { joint }),
            RawImperfection::AxisPitch(raw) => at(self.rail(raw)?, |joint| Mechanism::AxisPitch { joint }),
            RawImperfection::AxisYaw(raw) => at(self.rail(raw)?, |joint| Mechanism::AxisYaw { joint }),
            RawImperfection::JointBacklash(raw) => self.backlash(raw)?,
            RawImperfection::JointSettling(raw) => self.settling(raw)?,
            RawImperfection::JointLag(raw) => self.lag(raw)?,
            RawImperfection::JointCoupling(raw) => self.coupling(raw)?,
            RawImperfection::LostSteps(raw) => self.lost_steps(raw)?,
            RawImperfection::WarmUp(raw) => self.warm_up(raw, span)?,
            RawImperfection::LinkSag(raw) => at(self.flexible(raw)?, |joint| Mechanism::LinkSag { joint }),
            RawImperfection::LinkTorsion(raw) => {
                at(self.flexible(raw)?, |joint| Mechanism::LinkTorsion { joint })
            }
        };
        Some(Imperfection { mechanism, size })
    }

    fn zero(&self, raw: &Zero) -> Option<(Mechanism, f64)> {
        let (deg, mm) = (("deg", &raw.deg), ("mm", &raw.mm));
        Some(at(self.displacement(&raw.joint, deg, mm, -20.0..=20.0)?, |joint| Mechanism::JointZero {
            joint,
        }))
    }

    fn backlash(&self, raw: &Backlash) -> Option<(Mechanism, f64)> {
        let (deg, mm) = (("width_deg", &raw.width_deg), ("width_mm", &raw.width_mm));
        Some(at(self.displacement(&raw.joint, deg, mm, 0.0..=10.0)?, |joint| Mechanism::JointBacklash {
            joint,
        }))
    }

    /// The joint stays behind what was counted.
    fn lost_steps(&self, raw: &Lost) -> Option<(Mechanism, f64)> {
        let at_s = self.typed.number("at_s", &raw.at_s, 0.0..=1e6, "s");
        let (deg, mm) = (("deg", &raw.deg), ("mm", &raw.mm));
        let (joint, lost) = self.displacement(&raw.joint, deg, mm, -20.0..=20.0)?;
        Some((Mechanism::JointStep { joint, at_s }, -lost))
    }

    fn stiffening(&self, raw: &Stiffening) -> Option<(Mechanism, f64)> {
        let knee = self.typed.number("knee_nm", &raw.knee_nm, 0.01..=1000.0, "N m");
        let size = self.typed.number("rad_per_nm", &raw.rad_per_nm, 0.0..=SOFTEST, "rad/(N m)");
        Some((Mechanism::JointStiffening { joint: self.turning_joint(&raw.joint)?, knee }, size))
    }

    fn settling(&self, raw: &Settling) -> Option<(Mechanism, f64)> {
        let forgetting_s = self.typed.number("time_constant_s", &raw.time_constant_s, 0.1..=1e6, "s");
        let part = self.typed.number("part", &raw.part, -0.1..=0.1, "of each move");
        Some((Mechanism::JointSettling { joint: self.joint(&raw.joint)?, forgetting_s }, part))
    }

    fn lag(&self, raw: &Lag) -> Option<(Mechanism, f64)> {
        let (deg, mm) =
            (("at_full_speed_deg", &raw.at_full_speed_deg), ("at_full_speed_mm", &raw.at_full_speed_mm));
        Some(at(self.displacement(&raw.joint, deg, mm, -10.0..=10.0)?, |joint| Mechanism::JointLag { joint }))
    }

    fn coupling(&self, raw: &Coupling) -> Option<(Mechanism, f64)> {
        let (joint, driver) = (self.turning_joint(&raw.joint), self.turning_joint(&raw.driver));
        let size = self.typed.number("deg_per_deg", &raw.deg_per_deg, -1.0..=1.0, "deg/deg");
        Some((Mechanism::JointCoupling { joint: joint?, driver: driver? }, size))
    }

    fn flexible(&self, raw: &Flexible) -> Option<(usize, f64)> {
        let size = self.typed.number("per_nm2", &raw.per_nm2, 0.0..=0.01, "1/(N m2)");
        Some((self.turning_joint(&raw.joint)?, size))
    }

    fn gain(&self, raw: &Gain) -> Option<(Mechanism, f64)> {
        let size = TwoUnits {
            turning: ("deg_per_deg", &raw.deg_per_deg, -0.1..=0.1, "deg/deg"),
            sliding: ("mm_per_mm", &raw.mm_per_mm, -0.1..=0.1, "mm/mm"),
        };
        let (joint, size) = self.by_motion(&raw.joint, size)?;
        Some((Mechanism::JointGain { joint }, size))
    }

    fn compliance(&self, raw: &Compliance) -> Option<(Mechanism, f64)> {
        let size = TwoUnits {
            turning: ("rad_per_nm", &raw.rad_per_nm, 0.0..=SOFTEST, "rad/(N m)"),
            sliding: ("mm_per_n", &raw.mm_per_n, 0.0..=0.1, "mm/N"),
        };
        let (joint, size) = self.by_motion(&raw.joint, size)?;
        Some((Mechanism::JointCompliance { joint }, size))
    }

    fn harmonic(&self, raw: &Harmonic) -> Option<(Mechanism, f64)> {
        let joint = self.turning_joint(&raw.joint);
        let per_turn =
            self.typed.number("per_turn", &raw.per_turn, 0.01..=1000.0, "turns for a turn of the joint");
        let phase = self.typed.or("phase_deg", &raw.phase_deg, 0.0, -360.0..=360.0, "deg").to_radians();
        let size = self.typed.number("amplitude_deg", &raw.amplitude_deg, 0.0..=3.0, "deg").to_radians();
        Some((Mechanism::JointHarmonic { joint: joint?, per_turn, phase }, size))
    }

    fn screw_wave(&self, raw: &ScrewWave) -> Option<(Mechanism, f64)> {
        let per_turn = self.typed.or("per_turn", &raw.per_turn, 1.0, 0.1..=10.0, "waves a turn of the screw");
        let phase = self.typed.or("phase_deg", &raw.phase_deg, 0.0, -360.0..=360.0, "deg").to_radians();
        let size = self.typed.number("amplitude_mm", &raw.amplitude_mm, 0.0..=1.0, "mm");
        let joint = self.sliding_joint(&raw.joint)?;
        let Some(pitch) = self.paper.shape.joints.get(joint).and_then(|row| row.screw_pitch) else {
            let problem = format!(
                "joint `{}` has no screw: give it `screw_pitch_mm`, the travel for one turn, in the arm's file",
                raw.joint.value
            );
            self.typed.wrong(raw.joint.span, &problem);
            return None;
        };
        Some((Mechanism::ScrewWave { joint, pitch, per_turn, phase }, size))
    }

    fn rail(&self, raw: &Rail) -> Option<(usize, f64)> {
        let size =
            self.typed.number("deg_per_m", &raw.deg_per_m, -1.0..=1.0, "deg/m").to_radians() / MM_PER_M;
        Some((self.sliding_joint(&raw.joint)?, size))
    }

    fn warm_up(&self, raw: &WarmUp, span: Span) -> Option<(Mechanism, f64)> {
        let time_constant_s = self.typed.number("time_constant_s", &raw.time_constant_s, 1.0..=1e6, "s");
        let joint = self.joint(&raw.joint)?;
        let given = [&raw.zero_deg, &raw.zero_mm, &raw.length_mm, &raw.offset_mm];
        if given.iter().filter(|one| one.is_some()).count() != 1 {
            let zero = if self.motion(joint) == Motion::Slides { "zero_mm" } else { "zero_deg" };
            let problem = format!(
                "a warm-up changes one thing; give `{zero}`, `length_mm` or `offset_mm`, what it comes to in the end"
            );
            self.typed.wrong(span, &problem);
            return None;
        }
        let (of, size) = match (&raw.length_mm, &raw.offset_mm) {
            (Some(length), _) => {
                (Warming::Length, self.typed.number("length_mm", length, -10.0..=10.0, "mm"))
            }
            (_, Some(offset)) => {
                (Warming::Offset, self.typed.number("offset_mm", offset, -10.0..=10.0, "mm"))
            }
            (None, None) => {
                let (deg, mm) = (("zero_deg", &raw.zero_deg), ("zero_mm", &raw.zero_mm));
                (Warming::Zero, self.displacement(&raw.joint, deg, mm, -5.0..=5.0)?.1)
            }
        };
        Some((Mechanism::WarmUp { joint, of, time_constant_s }, size))
    }

    /// A joint and how far it is moved, rad or mm: in degrees under the first key where it turns, in mm under the second where it slides.
    fn displacement(
        &self,
        joint: &Spanned<String>,
        deg: (&'static str, &Option<Number>),
        mm: (&'static str, &Option<Number>),
        range: RangeInclusive<f64>,
    ) -> Option<(usize, f64)> {
        let both =
            TwoUnits { turning: (deg.0, deg.1, range.clone(), "deg"), sliding: (mm.0, mm.1, range, "mm") };
        let (index, size) = self.by_motion(joint, both)?;
        let drive = self.paper.drive.joints.get(index);
        Some((index, drive.map_or(size, |joint| joint.read(size))))
    }

    /// A joint and a size as it is written for one that moves so.
    fn by_motion(&self, name: &Spanned<String>, both: TwoUnits<'_>) -> Option<(usize, f64)> {
        let joint = self.joint(name)?;
        let ((key, value, range, unit), (other_key, other, ..), moves) = match self.motion(joint) {
            Motion::Turns => (both.turning, both.sliding, "turns"),
            Motion::Slides => (both.sliding, both.turning, "slides"),
        };
        match (value, other) {
            (Some(value), None) => Some((joint, self.typed.number(key, value, range, unit))),
            (_, Some(wrong)) => {
                let problem = format!("joint `{}` {moves}; write `{key}`, not `{other_key}`", name.value);
                self.typed.wrong(wrong.span, &problem);
                None
            }
            (None, None) => {
                let problem = format!("the key `{key}` is missing; joint `{}` {moves}", name.value);
                self.typed.wrong(name.span, &problem);
                None
            }
        }
    }
}
