//! One simulated campaign: the user's part and the truth.

use serde::{Deserialize, Serialize};

use crate::physics::imperfection::{Imperfection, Kind, Mechanism};

use super::poses::Visit;
use super::specification::Specification;

/// The verdicts of the lab.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Nothing above the noise.
    AtFloor,
    /// One effect, one site.
    Named,
    /// The joint is known, the mechanism is not.
    Located,
    /// Several explanations that these data cannot distinguish.
    Tied,
    /// Nothing known explains it.
    Unknown,
    /// These poses could not show it.
    Blind,
    /// The machine does not repeat.
    NotRepeatable,
    /// The noise is not known.
    FloorUnknown,
}

/// One hidden imperfection, in the words of the lab's files.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Hidden {
    /// Effect of the lab, or mechanism outside its library.
    pub effect: String,
    /// Joint, `base`, `p1` or axis.
    #[serde(rename = "where")]
    pub site: String,
    /// Size in `unit`.
    pub size: f64,
    /// Unit of the size.
    pub unit: String,
    /// Root mean square of what it adds to the readings, over the noise.
    pub over_noise: f64,
    /// The same of what is left once everything the model leaves free has swallowed its part.
    pub visible_over_noise: f64,
    /// The same against the noise of the whole campaign: how many standard errors its size is from nothing.
    pub standard_errors: f64,
    /// Second joint, turns for a turn, time constant and the like.
    #[serde(default, skip_serializing_if = "serde_json::Map::is_empty")]
    pub details: serde_json::Map<String, serde_json::Value>,
}

/// What was hidden, and which answers are right.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// Seed of the case.
    pub seed: u64,
    /// Everything hidden.
    pub hidden: Vec<Hidden>,
    /// Verdicts that are right.
    pub accept_verdict: Vec<Verdict>,
    /// Whether several effects are to be found one after the other.
    pub grow: bool,
    /// Effect and site of each thing to be named.
    pub effects: Vec<(String, String)>,
    /// Standard deviation of the noise of each reading, in its unit.
    pub noise: f64,
    /// Rows (from 1, as in the table below its header) that are grossly wrong.
    pub outlier_rows: Vec<usize>,
}

/// A simulated campaign.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// What was asked for.
    pub specification: Specification,
    /// The rows' commands and circumstances.
    pub visits: Vec<Visit>,
    /// What was read in each row, mm.
    pub readings: Vec<Vec<f64>>,
    /// Constant errors of the arm that the user's model leaves free.
    pub nuisances: Vec<Imperfection>,
    /// What is hidden.
    pub imperfections: Vec<Imperfection>,
    /// The truth in the words of the lab's files.
    pub truth: Truth,
}

impl Truth {
    /// The truth about an arm with these hidden, before verdicts and outliers are known.
    pub(super) fn of(
        specification: &Specification,
        imperfections: &[Imperfection],
        hidden: Vec<Hidden>,
    ) -> Self {
        let nameable = imperfections.iter().filter(|one| one.mechanism.kind() == Kind::Library);
        let effect =
            |one: &Imperfection| (one.mechanism.name().to_owned(), one.mechanism.site(&specification.arm));
        Self {
            seed: 0,
            hidden,
            accept_verdict: Vec::new(),
            grow: imperfections.len() > 1,
            effects: nameable.map(effect).collect(),
            noise: specification.noise,
            outlier_rows: Vec::new(),
        }
    }
}

/// How much of an imperfection there is in the readings, over the noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Strength {
    pub(super) over_noise: f64,
    pub(super) visible_over_noise: f64,
    pub(super) standard_errors: f64,
}

/// Puts an imperfection in the words of the lab's files.
pub(super) fn describe(
    specification: &Specification,
    imperfection: &Imperfection,
    strength: Strength,
) -> Hidden {
    let arm = &specification.arm;
    let mut details = serde_json::Map::new();
    let mut add = |key: &str, value: serde_json::Value| {
        details.insert(key.to_owned(), value);
    };
    match imperfection.mechanism {
        Mechanism::JointHarmonic { per_turn, phase, .. } => {
            add("n", per_turn.into());
            add("phase_rad", phase.into());
        }
        Mechanism::ScrewWave { pitch, per_turn, phase, .. } => {
            add("n", per_turn.into());
            add("pitch_mm", pitch.into());
            add("phase_rad", phase.into());
        }
        Mechanism::JointCoupling { driver, .. } | Mechanism::CableDrag { driver, .. } => {
            add("with", arm.joint_name(driver).into())
        }
        Mechanism::JointStep { at_s, .. } => add("at_s", at_s.into()),
        Mechanism::JointStiffening { knee, .. } => add("knee_nm", knee.into()),
        Mechanism::JointSettling { forgetting_s, .. } => add("forgetting_s", forgetting_s.into()),
        Mechanism::WarmUp { of, time_constant_s, .. } => {
            add("of", of.name().into());
            add("time_constant_s", time_constant_s.into());
        }
        Mechanism::InstrumentTilt { direction } => add("direction_rad", direction.into()),
        Mechanism::BaseTilt { axis: direction }
        | Mechanism::BasePosition { direction }
        | Mechanism::ToolOffset { direction }
        | Mechanism::Drift { direction } => {
            add("direction", direction.to_vec().into());
        }
        Mechanism::StickSlip { spacing, .. } => add("spacing_rad", spacing.into()),
        Mechanism::WornGear { worn_at, spread, .. } => {
            add("worn_at_rad", worn_at.into());
            add("spread_rad", spread.into());
        }
        Mechanism::CableWindUp { slack, .. } => add("slack_rad", slack.into()),
        Mechanism::RockingBase { direction, softness } => {
            add("direction_rad", direction.into());
            add("softness_nm", softness.into());
        }
        _ => {}
    }
    Hidden {
        effect: imperfection.mechanism.name().to_owned(),
        site: imperfection.mechanism.site(arm),
        size: imperfection.size,
        unit: imperfection.mechanism.unit_on(arm).to_owned(),
        over_noise: strength.over_noise,
        visible_over_noise: strength.visible_over_noise,
        standard_errors: strength.standard_errors,
        details,
    }
}
