//! A model file as it was typed: names and numbers with their places, nothing checked yet.

use std::fmt;
use std::marker::PhantomData;

use plumb_document::Spanned;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

/// A map that keeps its order and the place of each key.
#[derive(Debug, Clone)]
pub(super) struct Listed<V>(pub(super) Vec<(Spanned<String>, V)>);

impl<V> Default for Listed<V> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<'de, V: Deserialize<'de>> Deserialize<'de> for Listed<V> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Entries<V>(PhantomData<V>);
        impl<'de, V: Deserialize<'de>> Visitor<'de> for Entries<V> {
            type Value = Listed<V>;
            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("a map of names to entries")
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut entries = Vec::new();
                while let Some(entry) = map.next_entry()? {
                    entries.push(entry);
                }
                Ok(Listed(entries))
            }
            fn visit_unit<E>(self) -> Result<Self::Value, E> {
                Ok(Listed::default())
            }
        }
        deserializer.deserialize_map(Entries(PhantomData))
    }
}

/// The whole file.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawModel {
    pub(super) arm: String,
    pub(super) convention: Spanned<RawConvention>,
    pub(super) urdf: Option<Spanned<String>>,
    pub(super) tip: Option<Spanned<String>>,
    #[serde(default)]
    pub(super) joints: Vec<RawJoint>,
    #[serde(default)]
    pub(super) links: Vec<RawLink>,
    #[serde(default)]
    pub(super) base: RawBase,
    #[serde(default)]
    pub(super) targets: Listed<RawTarget>,
    pub(super) board: Option<RawBoard>,
    #[serde(default)]
    pub(super) boards: Listed<RawBoard>,
    pub(super) profile: Option<RawProfile>,
    #[serde(default)]
    pub(super) free: Vec<Spanned<String>>,
    #[serde(default)]
    pub(super) effects: Vec<Spanned<RawEffect>>,
    #[serde(default)]
    pub(super) fitted: Vec<Spanned<RawEffect>>,
    #[serde(default)]
    pub(super) surfaces: Listed<RawSurface>,
    #[serde(default)]
    pub(super) measured_from: RawMeasuredFrom,
    pub(super) gravity: Option<Spanned<[f64; 3]>>,
    pub(super) working_volume: Option<Spanned<RawVolume>>,
    pub(super) level: Option<RawLevel>,
    pub(super) sensor: Option<Spanned<RawSensor>>,
    #[serde(default)]
    pub(super) levels: Listed<RawLevel>,
    #[serde(default)]
    pub(super) noise: Listed<Spanned<f64>>,
    pub(super) epochs: Option<Spanned<RawEpochs>>,
    pub(super) measured_region: Option<Spanned<RawRegion>>,
    pub(super) residual_map: Option<Spanned<RawMap>>,
    pub(super) touch: Option<RawTouch>,
    #[serde(default)]
    pub(super) define: Vec<RawDefinition>,
    pub(super) revision: Option<RawRevision>,
}

/// How the rows are read, or which URDF file they come from.
#[derive(Debug, Clone)]
pub(super) enum RawConvention {
    Distal,
    Proximal,
    Urdf { file: Option<String>, tip: Option<String> },
}

impl<'de> Deserialize<'de> for RawConvention {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Word;
        impl<'de> Visitor<'de> for Word {
            type Value = RawConvention;
            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("distal, proximal, or {urdf: FILE}")
            }
            fn visit_str<E: serde::de::Error>(self, word: &str) -> Result<Self::Value, E> {
                match word {
                    "distal" | "standard" => Ok(RawConvention::Distal),
                    "proximal" | "modified" => Ok(RawConvention::Proximal),
                    "urdf" => Ok(RawConvention::Urdf { file: None, tip: None }),
                    other => Err(E::unknown_variant(other, &["distal", "proximal", "urdf"])),
                }
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let (mut file, mut tip) = (None, None);
                while let Some(key) = map.next_key::<String>()? {
                    match key.as_str() {
                        "urdf" => file = Some(map.next_value()?),
                        "tip" => tip = Some(map.next_value()?),
                        other => return Err(serde::de::Error::unknown_field(other, &["urdf", "tip"])),
                    }
                }
                Ok(RawConvention::Urdf { file, tip })
            }
        }
        deserializer.deserialize_any(Word)
    }
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawJoint {
    pub(super) name: Spanned<String>,
    #[serde(default)]
    pub(super) a_mm: f64,
    #[serde(default)]
    pub(super) alpha_deg: f64,
    #[serde(default)]
    pub(super) d_mm: f64,
    #[serde(default)]
    pub(super) theta_deg: f64,
    pub(super) limits_deg: Option<Spanned<[f64; 2]>>,
    pub(super) limits_mm: Option<Spanned<[f64; 2]>>,
    pub(super) sign: Option<Spanned<f64>>,
    pub(super) gear_ratio: Option<Spanned<f64>>,
    pub(super) screw_pitch_mm: Option<Spanned<f64>>,
    #[serde(default)]
    pub(super) slides: bool,
    pub(super) less: Option<Spanned<String>>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawLink {
    pub(super) after: Spanned<String>,
    pub(super) mass_kg: Spanned<f64>,
    #[serde(default)]
    pub(super) centre_mm: [f64; 3],
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawBase {
    #[serde(default)]
    pub(super) xyz_mm: [f64; 3],
    #[serde(default)]
    pub(super) rpy_deg: [f64; 3],
    #[serde(default = "yes")]
    pub(super) free: bool,
    pub(super) per: Option<Spanned<RawPer>>,
}

/// What has a base of its own.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum RawPer {
    Session,
}

/// Where something was re-set among the rows.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawEpochs {
    pub(super) rows: Option<Vec<usize>>,
    pub(super) times_s: Option<Vec<f64>>,
    pub(super) sessions: Option<Vec<String>>,
}

fn yes() -> bool {
    true
}

impl Default for RawBase {
    fn default() -> Self {
        Self { xyz_mm: [0.0; 3], rpy_deg: [0.0; 3], free: true, per: None }
    }
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawTarget {
    #[serde(default)]
    pub(super) xyz_mm: [f64; 3],
    #[serde(default)]
    pub(super) rpy_deg: [f64; 3],
    #[serde(default = "yes")]
    pub(super) free: bool,
    pub(super) free_rpy: Option<bool>,
}

/// A board that a camera on the arm sees.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawBoard {
    pub(super) seen_by: Spanned<String>,
    #[serde(default)]
    pub(super) xyz_mm: [f64; 3],
    #[serde(default)]
    pub(super) rpy_deg: [f64; 3],
    #[serde(default = "yes")]
    pub(super) free: bool,
}

/// Which target is the laser line sensor.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawProfile {
    pub(super) seen_by: Spanned<String>,
}

/// An effect with its values, or just its name and place as one text: `joint_zero(*)`.
#[derive(Debug, Clone)]
pub(super) enum RawEffect {
    Named(String),
    Valued(Box<RawValuedEffect>),
}

/// `where` may be left out for effects that have no place.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawValuedEffect {
    pub(super) effect: Spanned<String>,
    #[serde(rename = "where")]
    pub(super) place: Option<Spanned<String>>,
    pub(super) with: Option<Spanned<String>>,
    pub(super) n: Option<f64>,
    pub(super) of: Option<Spanned<String>>,
    pub(super) searched: Option<f64>,
    #[serde(default)]
    pub(super) values: Listed<Spanned<f64>>,
    #[serde(default)]
    pub(super) prior_sd: Listed<Spanned<f64>>,
    pub(super) claim: Option<Spanned<RawClaim>>,
    #[serde(default)]
    pub(super) may_be: Vec<String>,
}

/// Whether an added effect is identified.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum RawClaim {
    Mechanism,
    Correction,
}

impl<'de> Deserialize<'de> for RawEffect {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = RawEffect;
            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str(
                    "an effect such as joint_zero(shoulder), or a map with `effect`, `where` and `values`",
                )
            }
            fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Self::Value, E> {
                Ok(RawEffect::Named(text.to_owned()))
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
                RawValuedEffect::deserialize(serde::de::value::MapAccessDeserializer::new(map))
                    .map(|effect| RawEffect::Valued(Box::new(effect)))
            }
        }
        deserializer.deserialize_any(Either)
    }
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawSurface {
    pub(super) plane: Option<RawPlane>,
    pub(super) line: Option<RawLine>,
    pub(super) sphere: Option<RawSphere>,
    pub(super) point_mm: Option<[f64; 3]>,
    #[serde(default)]
    pub(super) free: bool,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawPlane {
    pub(super) normal: Spanned<[f64; 3]>,
    #[serde(default)]
    pub(super) offset_mm: f64,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawLine {
    pub(super) point_mm: [f64; 3],
    pub(super) direction: Spanned<[f64; 3]>,
    pub(super) light: Option<RawSide>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum RawSide {
    Left,
    Right,
}

/// The arm's own proximity sensor, by its data sheet.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawSensor {
    pub(super) working_mm: f64,
    pub(super) peak_mm: f64,
    #[serde(default)]
    pub(super) spot_mm: f64,
    #[serde(default)]
    pub(super) hysteresis_percent: f64,
    #[serde(default)]
    pub(super) dark_percent: f64,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawSphere {
    pub(super) centre_mm: [f64; 3],
    pub(super) radius_mm: Spanned<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum RawMeasuredFrom {
    #[default]
    Instrument,
    World,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawVolume {
    pub(super) x_mm: [f64; 2],
    pub(super) y_mm: [f64; 2],
    pub(super) z_mm: [f64; 2],
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawLevel {
    pub(super) after: Option<Spanned<String>>,
    #[serde(default)]
    pub(super) rpy_deg: [f64; 3],
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawTouch {
    pub(super) p: Option<Spanned<String>>,
    #[serde(default)]
    pub(super) distances: Vec<RawTouchDistance>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawTouchDistance {
    pub(super) between: Spanned<[String; 2]>,
    pub(super) mm: Spanned<f64>,
}

/// An effect of the user's own.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawDefinition {
    pub(super) name: Spanned<String>,
    #[serde(rename = "where")]
    pub(super) place: Option<Spanned<String>>,
    pub(super) adds: RawAdds,
    #[serde(default)]
    pub(super) parameters: Listed<RawParameter>,
    pub(super) sentence: Option<String>,
}

/// What is added to, and the formulas.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawAdds {
    pub(super) joint: Option<Spanned<String>>,
    pub(super) length: Option<Spanned<String>>,
    pub(super) offset: Option<Spanned<String>>,
    pub(super) twist: Option<Spanned<String>>,
    pub(super) skew: Option<Spanned<String>>,
    pub(super) target: Option<Spanned<String>>,
    pub(super) deg: Option<Spanned<String>>,
    pub(super) mm: Option<Spanned<String>>,
    pub(super) x_mm: Option<Spanned<String>>,
    pub(super) y_mm: Option<Spanned<String>>,
    pub(super) z_mm: Option<Spanned<String>>,
    pub(super) base_x_mm: Option<Spanned<String>>,
    pub(super) base_y_mm: Option<Spanned<String>>,
    pub(super) base_z_mm: Option<Spanned<String>>,
    pub(super) base_x_deg: Option<Spanned<String>>,
    pub(super) base_y_deg: Option<Spanned<String>>,
    pub(super) base_z_deg: Option<Spanned<String>>,
    pub(super) reading_x_mm: Option<Spanned<String>>,
    pub(super) reading_y_mm: Option<Spanned<String>>,
    pub(super) reading_z_mm: Option<Spanned<String>>,
    pub(super) trigger_height_mm: Option<Spanned<String>>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawParameter {
    pub(super) unit: Option<Spanned<String>>,
    pub(super) range: Spanned<[f64; 2]>,
}

/// Where an arm was measured; degrees, or mm of a joint that slides.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawRegion {
    pub(super) ranges: Listed<Spanned<[f64; 2]>>,
    pub(super) reach: Spanned<f64>,
    pub(super) poses: Vec<Spanned<Vec<f64>>>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawMap {
    pub(super) not_understood: Spanned<f64>,
    #[serde(default)]
    pub(super) waves: Vec<Spanned<RawWave>>,
    #[serde(default)]
    pub(super) along: Vec<RawOfJoint>,
    #[serde(default)]
    pub(super) sides: Vec<RawOfJoint>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawWave {
    pub(super) rates: Vec<f64>,
    pub(super) phase_rad: f64,
    pub(super) shift_mm: [f64; 3],
}

/// Weights of a joint's functions; degrees, or mm of a joint that slides.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawOfJoint {
    pub(super) joint: Spanned<String>,
    pub(super) weights: Vec<f64>,
}

/// How a revision came to be.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawRevision {
    pub(super) number: u32,
    pub(super) of: String,
    pub(super) did: String,
    pub(super) data: Option<String>,
    pub(super) parent: Option<u32>,
    pub(super) rms_mm: Option<f64>,
    pub(super) rms_deg: Option<f64>,
}
