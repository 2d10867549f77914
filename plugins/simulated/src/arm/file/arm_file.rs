//! Arm files: an arm as its maker describes it, joint by joint, in a file beside the world's.
//!
//! ```yaml
//! arm: scara                         # as cell files name it
//! title: A SCARA with a slide        # as people name it
//! convention: distal                 # of the rows: distal (standard) or proximal (modified, Craig)
//! joints:
//!   - {name: shoulder, a_mm: 325, d_mm: 390, limits_deg: [-132, 132], speed_deg_per_s: 380, step_deg: 0.005}
//!   - {name: slide, slides: true, alpha_deg: 180, limits_mm: [0, 200], speed_mm_per_s: 800, step_mm: 0.01, home_mm: 50}
//! links: [{after: shoulder, mass_kg: 11, centre_mm: [-170, 0, 20]}]
//! levels: [{name: upper_arm, on: shoulder, arrow: [1, 0, 0]}]   # where a spirit level can lie; its arrow where every joint is at zero
//! most_hung_kg: 5                    # what may hang on the flange beside the tool
//! braking_s: 0.1                     # from full speed to rest
//! ```
//!
//! `urdf: FILE` (and `tip: LINK`, where its chain forks) is in place of `convention` and the rows' numbers; `joints` then says only what the
//! URDF file does not.

use std::borrow::Cow;
use std::ops::RangeInclusive;
use std::path::Path;

use plumb_document::{FileKind, FileProblems, Problems, Span, Spanned, parse, read_text, typed};
use serde::Deserialize;

use super::urdf;
use crate::arm::description::{ArmOnPaper, LevelDirection, LevelSurface};
use crate::arm::drive::{Drive, JointDrive};
use crate::joint_values::MOST_JOINTS;
use crate::physics::description::{ArmDescription, Convention, Joint, Motion, Weight};
use crate::physics::rigid::{Rigid, Vector};
use crate::physics::transmission::Transmission;
use crate::world::file::WorldFileError;
use crate::world::file::typed::Typed;

type Number = Spanned<f64>;

/// How far a joint's hard stop lies beyond its limit, deg or mm.
const TO_THE_STOP: f64 = 2.0;

/// What may hang on the flange where the file does not say, kg.
const USUALLY_HUNG_KG: f64 = 5.0;

/// Longest link, mm: lengths beyond it are no arm's.
const LONGEST_MM: f64 = 20_000.0;

/// The finest screw, mm: a tenth of what micrometers have.
const FINEST_PITCH_MM: f64 = 0.05;

/// Furthest travel, deg or mm.
const FURTHEST: f64 = 5000.0;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawArm {
    arm: Spanned<String>,
    title: Option<String>,
    convention: Option<Convention>,
    urdf: Option<Spanned<String>>,
    tip: Option<String>,
    #[serde(default)]
    joints: Vec<RawJoint>,
    #[serde(default)]
    links: Vec<RawLink>,
    #[serde(default)]
    levels: Vec<RawLevel>,
    most_hung_kg: Option<Number>,
    braking_s: Option<Number>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawJoint {
    name: Spanned<String>,
    #[serde(default)]
    slides: bool,
    a_mm: Option<Number>,
    alpha_deg: Option<Number>,
    d_mm: Option<Number>,
    theta_deg: Option<Number>,
    sign: Option<Number>,
    limits_deg: Option<Spanned<[f64; 2]>>,
    limits_mm: Option<Spanned<[f64; 2]>>,
    speed_deg_per_s: Option<Number>,
    speed_mm_per_s: Option<Number>,
    step_deg: Option<Number>,
    step_mm: Option<Number>,
    home_deg: Option<Number>,
    home_mm: Option<Number>,
    screw_pitch_mm: Option<Number>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawLink {
    after: Spanned<String>,
    mass_kg: Number,
    centre_mm: Spanned<[f64; 3]>,
}

/// A flat part of a link.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawLevel {
    name: String,
    on: Spanned<String>,
    arrow: Spanned<[f64; 3]>,
}

/// The JSON Schema of arm files.
pub(crate) fn schema() -> serde_json::Value {
    plumb_document::schema_of::<RawArm>()
}

/// Reads the arm file that a world file names; none after a error about the world file.
///
/// # Errors
/// [`WorldFileError`]: all mistakes of the arm file.
pub(super) fn read(world: Typed<'_>, named: &Spanned<String>) -> Option<Result<ArmOnPaper, WorldFileError>> {
    if named.span == Span::NONE {
        return None;
    }
    let path = world.file.with_file_name(&named.value);
    match read_text(&path, FileKind::WORLD) {
        Ok(text) => Some(parse_arm(&path, &text)),
        Err(source) => {
            world.wrong(named.span, &format!("the arm file {} cannot be read: {source}", path.display()));
            None
        }
    }
}

fn parse_arm(path: &Path, text: &str) -> Result<ArmOnPaper, WorldFileError> {
    let problems = Problems::default();
    let root = parse(path, text, &problems)?;
    let raw: Option<RawArm> = typed(&root, "an arm", &problems);
    let keys_known = problems.is_empty();
    let reader = Reader { typed: Typed { file: path, problems: &problems }, keys_known };
    let arm = raw.and_then(|raw| reader.arm(raw));
    problems.into_result(path, text)?;
    arm.ok_or_else(|| FileProblems::whole_file(path, "this is no arm", "").into())
}

struct Reader<'a> {
    typed: Typed<'a>,
    /// No key was misspelled or could not be read: what is missing then is really missing.
    keys_known: bool,
}

impl Reader<'_> {
    fn arm(&self, raw: RawArm) -> Option<ArmOnPaper> {
        let (mut shape, speeds) = match (&raw.urdf, raw.convention) {
            (Some(urdf), None) => self.chain_of_urdf(urdf, raw.tip.as_deref(), &raw)?,
            (None, Some(convention)) => (self.rows_of(convention, &raw), vec![None; raw.joints.len()]),
            (Some(urdf), Some(_)) => {
                self.typed.wrong(urdf.span, "give `convention` and the rows, or `urdf`, not both");
                return None;
            }
            (None, None) => {
                let problem = "say how the rows are to be read (`convention: distal` or `proximal`), or name a URDF file (`urdf: FILE`)";
                self.typed.wrong(raw.arm.span, problem);
                return None;
            }
        };
        self.require_joints(&raw.arm, &shape)?;
        let weights: Vec<Weight> = raw.links.iter().filter_map(|link| self.weight(link, &shape)).collect();
        shape.weights.extend(weights);
        let level_surfaces =
            raw.levels.iter().filter_map(|level| self.level_surface(level, &shape)).collect();
        let joints = shape.joints.iter().zip(&speeds).map(|(joint, speed)| {
            let typed = raw.joints.iter().find(|typed| typed.name.value == joint.name);
            self.drive(&raw.arm, joint, typed, *speed)
        });
        let joints: Vec<JointDrive> = joints.collect();
        let most_hung_kg =
            self.typed.or("most_hung_kg", &raw.most_hung_kg, USUALLY_HUNG_KG, 0.0..=1000.0, "kg");
        Some(ArmOnPaper {
            name: raw.arm.value.clone(),
            model: raw.title.unwrap_or(raw.arm.value),
            drive: Drive {
                whole_counts: joints.iter().any(|joint| joint.counts_per_unit > 0.0),
                joints,
                couplings: Vec::new(),
                braking_s: self.typed.or("braking_s", &raw.braking_s, 0.0, 0.0..=5.0, "s"),
            },
            shape,
            level_surfaces,
            wrist: None,
            most_hung_kg,
        })
    }

    /// The arm as the file's own rows give it.
    fn rows_of(&self, convention: Convention, raw: &RawArm) -> ArmDescription {
        let joints = raw.joints.iter().map(|joint| self.row(joint)).collect();
        on_its_base(raw.arm.value.clone(), convention, joints)
    }

    /// The arm as a URDF file gives it, with the limits that the arm file gives in place of that file's; and the speeds of its joints, where that file
    /// knows them.
    fn chain_of_urdf(
        &self,
        urdf: &Spanned<String>,
        tip: Option<&str>,
        raw: &RawArm,
    ) -> Option<(ArmDescription, Vec<Option<f64>>)> {
        let path = self.typed.file.with_file_name(&urdf.value);
        let wrong = |problem: String| self.typed.problems.add(urdf.span, problem, "");
        let text = read_text(&path, FileKind::URDF)
            .map_err(|source| wrong(format!("the URDF file {} cannot be read: {source}", path.display())))
            .ok()?;
        let arm =
            urdf::read(&text, tip).map_err(|error| wrong(format!("{}: {error}", path.display()))).ok()?;
        let mut shape = on_its_base(raw.arm.value.clone(), Convention::Proximal, arm.joints);
        shape.flange = arm.flange;
        shape.weights = arm.weights;
        raw.joints.iter().for_each(|typed| self.refine(&mut shape, typed));
        Some((shape, arm.speeds))
    }

    /// A joint of a URDF file with the limits that the arm file gives it.
    fn refine(&self, shape: &mut ArmDescription, typed: &RawJoint) {
        let Some(joint) = shape.joints.iter_mut().find(|joint| joint.name == typed.name.value) else {
            let names = shape.joints.iter().map(|joint| joint.name.as_str());
            return self.typed.unknown("joint", &typed.name, names);
        };
        let placed = [&typed.a_mm, &typed.alpha_deg, &typed.d_mm, &typed.theta_deg, &typed.sign];
        if typed.slides || placed.iter().any(|number| number.is_some()) {
            let problem = format!(
                "the URDF file says where joint `{}` is and how it moves; here it may have limits, a speed, a step and a home",
                joint.name
            );
            return self.typed.wrong(typed.name.span, &problem);
        }
        if typed.limits_deg.is_some() || typed.limits_mm.is_some() {
            joint.limits = self.limits(typed, joint.motion);
        }
        joint.screw_pitch = self.screw_pitch(typed, joint.motion);
    }

    fn row(&self, raw: &RawJoint) -> Joint {
        let motion = if raw.slides { Motion::Slides } else { Motion::Turns };
        let length = |key, value| self.typed.or(key, value, 0.0, -LONGEST_MM..=LONGEST_MM, "mm");
        let angle = |key, value| self.typed.or(key, value, 0.0, -360.0..=360.0, "deg").to_radians();
        let sign = raw.sign.map_or(1.0, |sign| sign.value);
        if let Some(typed) = raw.sign.filter(|_| sign.abs() != 1.0) {
            self.typed.wrong(typed.span, &format!("`sign` is {sign}; it is 1 or -1"));
        }
        Joint {
            name: raw.name.value.clone(),
            motion,
            mounted: Rigid::IDENTITY,
            length: length("a_mm", &raw.a_mm),
            twist: angle("alpha_deg", &raw.alpha_deg),
            offset: length("d_mm", &raw.d_mm),
            rest_angle: angle("theta_deg", &raw.theta_deg),
            sign,
            limits: self.limits(raw, motion),
            gear_ratio: None,
            screw_pitch: self.screw_pitch(raw, motion),
        }
    }

    /// Travel for a turn of the screw, mm; none after a error.
    fn screw_pitch(&self, raw: &RawJoint, motion: Motion) -> Option<f64> {
        let pitch = raw.screw_pitch_mm.as_ref()?;
        if motion == Motion::Turns {
            let problem =
                format!("joint `{}` turns; `screw_pitch_mm` is of a joint that slides", raw.name.value);
            self.typed.wrong(pitch.span, &problem);
            return None;
        }
        Some(self.typed.number("screw_pitch_mm", pitch, FINEST_PITCH_MM..=LONGEST_MM, "mm"))
    }

    /// How far a joint goes, rad or mm; NaN after a error.
    fn limits(&self, raw: &RawJoint, motion: Motion) -> [f64; 2] {
        let name = &raw.name.value;
        let (key, given, other) = match motion {
            Motion::Turns => ("limits_deg", &raw.limits_deg, &raw.limits_mm),
            Motion::Slides => ("limits_mm", &raw.limits_mm, &raw.limits_deg),
        };
        if let Some(other) = other {
            let moves = moves(motion);
            let problem = format!("joint `{name}` {moves}; its travel is written as `{key}: [from, to]`");
            self.typed.wrong(other.span, &problem);
            return [f64::NAN; 2];
        }
        let Some(given) = given else {
            if self.keys_known {
                self.typed.wrong(raw.name.span, &format!("joint `{name}` needs `{key}: [from, to]`"));
            }
            return [f64::NAN; 2];
        };
        let [lower, upper] = given.value;
        let within = [lower, upper].iter().all(|limit| limit.abs() <= FURTHEST);
        if !within || lower >= upper {
            let problem = format!(
                "joint `{name}`: `{key}` [{lower}, {upper}] leaves no travel; the lower limit comes first, both within {FURTHEST}"
            );
            self.typed.wrong(given.span, &problem);
            return [f64::NAN; 2];
        }
        match motion {
            Motion::Turns => [lower.to_radians(), upper.to_radians()],
            Motion::Slides => [lower, upper],
        }
    }

    /// What is known of the drive of a joint. `speed` (rad/s or mm/s) is what a URDF file says of it.
    fn drive(
        &self,
        arm: &Spanned<String>,
        joint: &Joint,
        raw: Option<&RawJoint>,
        speed: Option<f64>,
    ) -> JointDrive {
        let slides = joint.motion == Motion::Slides;
        let margin = if slides { TO_THE_STOP } else { TO_THE_STOP.to_radians() };
        let [lower, upper] = joint.limits;
        let mut drive = JointDrive {
            name: joint.name.clone(),
            motion: joint.motion,
            limits: joint.limits,
            stops: [lower - margin, upper + margin],
            top_speed: 0.0,
            counts_per_unit: 0.0,
            home: within(0.0, joint.limits),
        };
        let number = |keys: [&'static str; 2], values: [Option<&Number>; 2], range: RangeInclusive<f64>| {
            self.of_motion(&joint.name, joint.motion, keys, values, range)
        };
        let of = |read: fn(&RawJoint) -> [Option<&Number>; 2]| raw.map_or([None, None], read);
        let speeds = of(|raw| [raw.speed_deg_per_s.as_ref(), raw.speed_mm_per_s.as_ref()]);
        let typed_speed = number(["speed_deg_per_s", "speed_mm_per_s"], speeds, 1e-3..=1e5);
        drive.top_speed = match (typed_speed.map(|speed| drive.read(speed)), speed) {
            (Some(speed), _) | (None, Some(speed)) => speed,
            (None, None) => {
                let key = if slides { "speed_mm_per_s" } else { "speed_deg_per_s" };
                let span = raw.map_or(arm.span, |raw| raw.name.span);
                if self.keys_known && speeds.iter().all(Option::is_none) {
                    let problem = format!("joint `{}` needs `{key}`, its greatest speed", joint.name);
                    self.typed.wrong(span, &problem);
                }
                f64::NAN
            }
        };
        let steps = of(|raw| [raw.step_deg.as_ref(), raw.step_mm.as_ref()]);
        if let Some(step) = number(["step_deg", "step_mm"], steps, 1e-9..=10.0) {
            drive.counts_per_unit = 1.0 / drive.read(step);
        }
        let homes = of(|raw| [raw.home_deg.as_ref(), raw.home_mm.as_ref()]);
        let [from, to] = [drive.written(lower), drive.written(upper)];
        if let Some(home) = number(["home_deg", "home_mm"], homes, from..=to) {
            drive.home = within(drive.read(home), joint.limits);
        }
        drive
    }

    /// A number that is written in degrees for a joint that turns and in millimetres for one that slides.
    fn of_motion(
        &self,
        joint: &str,
        motion: Motion,
        [deg, mm]: [&'static str; 2],
        [in_deg, in_mm]: [Option<&Number>; 2],
        range: RangeInclusive<f64>,
    ) -> Option<f64> {
        let (key, value, other, unit) = match motion {
            Motion::Turns => (deg, in_deg, in_mm, "deg"),
            Motion::Slides => (mm, in_mm, in_deg, "mm"),
        };
        if let Some(other) = other {
            self.typed.wrong(other.span, &format!("joint `{joint}` {}; write `{key}`", moves(motion)));
            return None;
        }
        value.map(|value| self.typed.number(key, value, range, unit))
    }

    /// There are joints, not more than a robot's messages hold, and no two of one name; none after a error.
    fn require_joints(&self, arm: &Spanned<String>, shape: &ArmDescription) -> Option<()> {
        let twice = shape.joints.iter().enumerate().find(|(index, joint)| {
            shape.joints.iter().take(*index).any(|earlier| earlier.name == joint.name)
        });
        let name = &arm.value;
        let problem = match (shape.joints.len(), twice) {
            (0, _) => format!("the arm `{name}` has no joints; list 1 to {MOST_JOINTS} under `joints`"),
            (count, _) if count > MOST_JOINTS => {
                format!("the arm `{name}` has {count} joints; a robot has at most {MOST_JOINTS}")
            }
            (_, Some((_, joint))) => format!("two joints are named `{}`; names must differ", joint.name),
            (_, None) => return Some(()),
        };
        self.typed.wrong(arm.span, &problem);
        None
    }

    /// A location for a spirit level; none after a error.
    fn level_surface(&self, raw: &RawLevel, shape: &ArmDescription) -> Option<LevelSurface> {
        let Some(carried_by) = shape.joint_index(&raw.on.value) else {
            self.typed.unknown("joint", &raw.on, shape.joints.iter().map(|joint| joint.name.as_str()));
            return None;
        };
        let Some(arrow) = Vector::from(raw.arrow.value).unit() else {
            let problem =
                "`arrow` has no direction; three numbers, as it points where every joint is at zero";
            self.typed.wrong(raw.arrow.span, problem);
            return None;
        };
        let name = Cow::Owned(raw.name.clone());
        Some(LevelSurface { name, carried_by, direction: LevelDirection::AtZero(arrow) })
    }

    fn weight(&self, raw: &RawLink, shape: &ArmDescription) -> Option<Weight> {
        let mass = self.typed.number("mass_kg", &raw.mass_kg, 0.0..=10_000.0, "kg");
        if raw.centre_mm.value.iter().any(|part| part.abs() > LONGEST_MM) {
            let problem = "`centre_mm` is too far away; it is three numbers, in the frame of the joint's row";
            self.typed.wrong(raw.centre_mm.span, problem);
        }
        let Some(after) = shape.joint_index(&raw.after.value) else {
            self.typed.unknown("joint", &raw.after, shape.joints.iter().map(|joint| joint.name.as_str()));
            return None;
        };
        Some(Weight { after, mass, centre: Vector::from(raw.centre_mm.value) })
    }
}

/// A coordinate within a joint's limits; 0 where those could not be read.
fn within(coordinate: f64, [lower, upper]: [f64; 2]) -> f64 {
    if lower <= upper { coordinate.clamp(lower, upper) } else { 0.0 }
}

fn moves(motion: Motion) -> &'static str {
    match motion {
        Motion::Turns => "turns",
        Motion::Slides => "slides",
    }
}

/// The arm with these joints, upright on the origin of the world, nothing on its flange.
fn on_its_base(name: String, convention: Convention, joints: Vec<Joint>) -> ArmDescription {
    ArmDescription {
        name,
        convention,
        joints,
        weights: Vec::new(),
        base_position: Vector::ZERO,
        base_orientation: [0.0; 3],
        flange: Rigid::IDENTITY,
        target: Vector::ZERO,
        transmission: Transmission::Direct,
        declared_noise: None,
    }
}
