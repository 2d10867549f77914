//! World files with a PUMA 560: YAML a person writes, read as it was typed and then checked. Every key carries its unit.

use std::ops::RangeInclusive;
use std::path::Path;
use std::sync::Arc;

use serde::Deserialize;
use serde_yaml::{Location, Spanned};

use super::description::{Cage, PumaDescription, Resolution, SpiritLevel, Tabletop};
use super::joints::{AXES, JOINTS};
use crate::light::Light;
use crate::light::file::RawLight;
use crate::physics::arms;
use crate::physics::imperfection::{Imperfection, Mechanism};
use crate::physics::machine::{Conditions, Machine};
use crate::physics::rigid::{Rotation, Vector};
use crate::world::Instrument;
use crate::world::file::WorldFileError;
use crate::world::file::error::unknown;
use crate::world::file::typed::Typed;

mod imperfections;

type Number = Spanned<f64>;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawWorld {
    world: Spanned<String>,
    #[serde(default)]
    seed: u64,
    calibration: Option<String>,
    arm: RawArm,
    #[serde(default)]
    cage: RawCage,
    #[serde(default)]
    table: RawTable,
    #[serde(default)]
    instruments: RawInstruments,
    light: Option<Spanned<RawLight>>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
enum RawArm {
    Puma560(Box<RawPuma>),
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawPuma {
    resolution: RawResolution,
    start: Option<RawJoints>,
    #[serde(default)]
    zero_error: RawJoints,
    #[serde(default)]
    zero_error_within: RawJoints,
    #[serde(default)]
    base: RawBase,
    #[serde(default)]
    imperfections: Vec<Spanned<imperfections::RawImperfection>>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum RawResolution {
    Continuous,
    Encoder,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawJoints {
    waist_deg: Option<Number>,
    shoulder_deg: Option<Number>,
    elbow_deg: Option<Number>,
    wrist_roll_deg: Option<Number>,
    wrist_bend_deg: Option<Number>,
    flange_deg: Option<Number>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawBase {
    tilt_x_deg: Option<Number>,
    tilt_y_deg: Option<Number>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawCage {
    mass_kg: Option<Number>,
    lean_x_deg: Option<Number>,
    lean_y_deg: Option<Number>,
    turn_deg: Option<Number>,
    tip_mm: Option<Spanned<[f64; 3]>>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawTable {
    height_mm: Option<Number>,
    tilt_x_deg: Option<Number>,
    tilt_y_deg: Option<Number>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawInstruments {
    #[serde(default)]
    level: RawLevel,
    #[serde(default)]
    ruler: RawRuler,
    #[serde(default)]
    tracker: RawRuler,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawLevel {
    error_deg: Option<Number>,
    division_deg: Option<Number>,
    zero_deg: Option<Number>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawRuler {
    error_mm: Option<Number>,
    division_mm: Option<Number>,
}

/// Checks the text of an open world file; `file` is the name its errors bear.
pub(crate) fn parse(file: &str, text: &str) -> Result<PumaDescription, WorldFileError> {
    let typed = Typed { file };
    Checker { typed }.world(typed.parse(text)?)
}

struct Checker<'a> {
    typed: Typed<'a>,
}

impl Checker<'_> {
    fn world(&self, raw: RawWorld) -> Result<PumaDescription, WorldFileError> {
        let RawArm::Puma560(arm) = raw.arm;
        let place = raw.world.referenced;
        let nominal = match arms::by_name("puma560") {
            Some(Ok(nominal)) => nominal,
            Some(Err(error)) => return Err(self.typed.wrong(place, error.to_string())),
            None => return Err(self.typed.wrong(place, "the program does not know the PUMA 560".to_owned())),
        };
        let mut imperfections = self.base(&arm.base)?;
        for one in &arm.imperfections {
            imperfections.push(self.imperfection(&one.value, one.referenced)?);
        }
        let start = match &arm.start {
            Some(start) => self.joints(start, -270.0..=270.0)?,
            None => JOINTS.map(|joint| joint.ready_deg.to_radians()),
        };
        let described = PumaDescription {
            title: raw.world.value,
            seed: raw.seed,
            nominal,
            resolution: match arm.resolution {
                RawResolution::Continuous => Resolution::Continuous,
                RawResolution::Encoder => Resolution::Encoder,
            },
            start,
            zero_error: self.joints(&arm.zero_error, -20.0..=20.0)?,
            zero_error_within: self.joints(&arm.zero_error_within, 0.0..=20.0)?,
            imperfections,
            cage: self.cage(&raw.cage)?,
            table: self.table(&raw.table)?,
            level: self.level(&raw.instruments.level)?,
            ruler: self.ruler(&raw.instruments.ruler)?,
            light: self.light(raw.light.as_ref(), raw.seed)?,
            tracker: self.ruler(&raw.instruments.tracker)?,
            calibration: raw.calibration.map(|name| Path::new(self.typed.file).with_file_name(name)),
            sealed_text: None,
        };
        self.require_standing(&described, place)?;
        Ok(described)
    }

    fn light(
        &self,
        raw: Option<&Spanned<RawLight>>,
        seed: u64,
    ) -> Result<Option<Arc<Light>>, WorldFileError> {
        let Some(raw) = raw else { return Ok(None) };
        let checked = raw.value.check(seed);
        checked
            .map(|light| Some(Arc::new(light)))
            .map_err(|what| self.typed.wrong(raw.referenced, format!("light: {what}")))
    }

    /// The arm must stand, stretched out with its load: what is too soft there is a mistake of the file.
    fn require_standing(&self, world: &PumaDescription, place: Location) -> Result<(), WorldFileError> {
        let mut machine = Machine::new(&world.arm(), &world.imperfections);
        machine.go(&[0.0, 0.0, std::f64::consts::FRAC_PI_2, 0.0, 0.0, 0.0], 0.0);
        let conditions = Conditions { time_s: 0.0, temperature_c: 20.0, payload_kg: 0.0 };
        machine.stand(&conditions).map(drop).map_err(|error| self.typed.wrong(place, error.to_string()))
    }

    fn joints(&self, raw: &RawJoints, range: RangeInclusive<f64>) -> Result<[f64; AXES], WorldFileError> {
        let degrees = |key, value| self.typed.or(key, value, 0.0, range.clone(), "deg").map(f64::to_radians);
        Ok([
            degrees("waist_deg", &raw.waist_deg)?,
            degrees("shoulder_deg", &raw.shoulder_deg)?,
            degrees("elbow_deg", &raw.elbow_deg)?,
            degrees("wrist_roll_deg", &raw.wrist_roll_deg)?,
            degrees("wrist_bend_deg", &raw.wrist_bend_deg)?,
            degrees("flange_deg", &raw.flange_deg)?,
        ])
    }

    fn base(&self, raw: &RawBase) -> Result<Vec<Imperfection>, WorldFileError> {
        let tilt = |key, value, axis: [f64; 3]| {
            let size = self.typed.or(key, value, 0.0, -5.0..=5.0, "deg")?.to_radians();
            Ok(Imperfection { mechanism: Mechanism::BaseTilt { axis }, size })
        };
        let tilts = [
            tilt("tilt_x_deg", &raw.tilt_x_deg, [1.0, 0.0, 0.0])?,
            tilt("tilt_y_deg", &raw.tilt_y_deg, [0.0, 1.0, 0.0])?,
        ];
        Ok(tilts.into_iter().filter(|tilt| tilt.size != 0.0).collect())
    }

    fn cage(&self, raw: &RawCage) -> Result<Cage, WorldFileError> {
        let lean = |key, value| self.typed.or(key, value, 0.0, -10.0..=10.0, "deg").map(f64::to_radians);
        let tip = match &raw.tip_mm {
            Some(tip) if tip.value.iter().any(|part| !part.is_finite() || part.abs() > 1000.0) => {
                let problem = "`tip_mm` is three numbers, each within 1000 mm of the flange".to_owned();
                return Err(self.typed.wrong(tip.referenced, problem));
            }
            Some(tip) => Vector::from(tip.value),
            None => Vector::new(40.0, 0.0, 120.0),
        };
        Ok(Cage {
            mass_kg: self.typed.or("mass_kg", &raw.mass_kg, 1.05, 0.0..=5.0, "kg")?,
            centre: Vector::new(0.0, 0.0, 50.8),
            lean: [
                lean("lean_x_deg", &raw.lean_x_deg)?,
                lean("lean_y_deg", &raw.lean_y_deg)?,
                lean("turn_deg", &raw.turn_deg)?,
            ],
            tip,
        })
    }

    fn table(&self, raw: &RawTable) -> Result<Tabletop, WorldFileError> {
        let tilt = |key, value| self.typed.or(key, value, 0.0, -5.0..=5.0, "deg").map(f64::to_radians);
        let turned = Rotation::about(Vector::X, tilt("tilt_x_deg", &raw.tilt_x_deg)?)
            * Rotation::about(Vector::Y, tilt("tilt_y_deg", &raw.tilt_y_deg)?);
        Ok(Tabletop {
            height: self.typed.or("height_mm", &raw.height_mm, -671.8, -2000.0..=0.0, "mm")?,
            normal: turned.z,
        })
    }

    fn level(&self, raw: &RawLevel) -> Result<SpiritLevel, WorldFileError> {
        let degrees =
            |key, value, most: f64| self.typed.or(key, value, 0.0, 0.0..=most, "deg").map(f64::to_radians);
        let instrument = Instrument {
            error: degrees("error_deg", &raw.error_deg, 5.0)?,
            division: degrees("division_deg", &raw.division_deg, 5.0)?,
        };
        let zero = self.typed.or("zero_deg", &raw.zero_deg, 0.0, -5.0..=5.0, "deg")?.to_radians();
        Ok(SpiritLevel { instrument, zero })
    }

    fn ruler(&self, raw: &RawRuler) -> Result<Instrument, WorldFileError> {
        Ok(Instrument {
            error: self.typed.or("error_mm", &raw.error_mm, 0.0, 0.0..=50.0, "mm")?,
            division: self.typed.or("division_mm", &raw.division_mm, 0.0, 0.0..=50.0, "mm")?,
        })
    }

    /// The place of a joint that a file names.
    fn joint(&self, name: &Spanned<String>) -> Result<usize, WorldFileError> {
        let found = JOINTS.iter().position(|joint| joint.name == name.value);
        found.ok_or_else(|| {
            let names = JOINTS.map(|joint| joint.name);
            self.typed.wrong(name.referenced, unknown("joint", &name.value, &names))
        })
    }
}
