//! What campaign a trial is to be, from the command line.

use std::path::Path;

use plumb_document::{FileKind, read_text};
use plumb_simulated::physics::arms;
use plumb_simulated::physics::campaign::catalogue::Choice;
use plumb_simulated::physics::campaign::specification::{
    Approach, Free, Reading, Requested, Size, Specification, Spread,
};
use plumb_simulated::physics::description::{ArmDescription, Motion};
use plumb_simulated::physics::random::Random;

use super::effect_request::EffectRequest;
use super::error::TrialError;

/// Options that shape a campaign.
#[derive(Debug, Clone, clap::Args)]
pub struct CampaignArguments {
    /// The arm: a name, or the path of a model file; at random when not given.
    #[arg(long, value_name = "NAME|FILE")]
    arm: Option<String>,
    /// What to hide: `none`, `any`, `outside`, `not_repeatable`, or an effect such as `joint_backlash(elbow)=3x`; repeat it for several. At random
    /// when not given.
    #[arg(long = "effect", value_name = "EFFECT")]
    effects: Vec<EffectRequest>,
    /// Poses visited once.
    #[arg(long, default_value_t = 60)]
    poses: usize,
    /// Keep each joint within a window of 40 degrees.
    #[arg(long, conflicts_with = "grid")]
    narrow: bool,
    /// Visit a regular lattice of the first three joints.
    #[arg(long)]
    grid: bool,
    /// Further poses that are returned to.
    #[arg(long, default_value_t = 6)]
    repeated_poses: usize,
    /// Visits to each of those.
    #[arg(long, default_value_t = 5)]
    returns: usize,
    /// Standard deviation of each reading, mm (tilts: degrees); that of the arm's file, else 0.05.
    #[arg(long, value_name = "MM")]
    noise: Option<f64>,
    /// Share of readings that are grossly wrong, such as 0.08.
    #[arg(long, default_value_t = 0.0, value_name = "SHARE")]
    outliers: f64,
    /// Go straight from pose to pose instead of approaching each from a side drawn at random.
    #[arg(long)]
    straight: bool,
    /// Let the temperature move.
    #[arg(long)]
    heat: bool,
    /// Payloads in use, kg, such as `0,1,2`.
    #[arg(long, value_delimiter = ',', value_name = "KG")]
    payloads: Vec<f64>,
    /// What the model file leaves free besides base and target.
    #[arg(long, value_enum, default_value_t = FreeArgument::Zeros)]
    free: FreeArgument,
    /// What is read at each pose.
    #[arg(long, value_enum, default_value_t = ReadingArgument::Position)]
    reading: ReadingArgument,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum FreeArgument {
    None,
    Zeros,
    Geometry,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum ReadingArgument {
    Position,
    /// Position and orientation of a body with reflectors on it.
    Pose,
    Height,
    Distance,
    Tilt,
    Touch,
}

impl CampaignArguments {
    /// The campaign for one seed; what the command line leaves open is drawn at random.
    pub fn specification(&self, seed: u64) -> Result<Specification, TrialError> {
        self.check()?;
        let mut rng = Random::new(seed, "trial");
        let drawn_arm = rng.pick(&arms::ARMS).map_or("puma560", |(name, _)| name);
        let drawn_effects = random_effects(&mut rng);
        let mut specification = Specification::usual(find_arm(self.arm.as_deref().unwrap_or(drawn_arm))?);
        specification.hidden = match self.effects.as_slice() {
            [] => drawn_effects,
            requests => requests.iter().filter_map(|request| request.0.clone()).collect(),
        };
        specification.poses = self.poses;
        specification.spread = match (self.narrow, self.grid) {
            (true, _) => Spread::Narrow,
            (_, true) => Spread::Grid,
            _ => Spread::Wide,
        };
        specification.repeated_poses = self.repeated_poses;
        specification.returns = self.returns;
        specification.noise = self.noise.unwrap_or(specification.noise);
        specification.outliers = self.outliers;
        specification.approach = if self.straight { Approach::Straight } else { Approach::EitherSide };
        let hot = specification.hidden.iter().any(|requested| requested.choice.name == "thermal_growth");
        // What is hidden must not be revealed by the temperature being logged as moving: half of all trials drawn at random are warm.
        specification.heat = self.heat || hot || (self.effects.is_empty() && rng.chance(0.5));
        specification.payloads_kg.clone_from(&self.payloads);
        specification.free = match self.free {
            FreeArgument::None => Free::None,
            FreeArgument::Zeros => Free::Zeros,
            FreeArgument::Geometry => Free::Geometry,
        };
        specification.reading = match self.reading {
            ReadingArgument::Position => Reading::Position,
            ReadingArgument::Pose => Reading::Pose,
            ReadingArgument::Height => Reading::Height,
            ReadingArgument::Distance => Reading::Distance,
            ReadingArgument::Tilt => Reading::Tilt,
            ReadingArgument::Touch => Reading::Touch,
        };
        Ok(specification)
    }

    fn check(&self) -> Result<(), TrialError> {
        let refuse =
            |option, value: f64, right| Err(TrialError::Option { option, value: value.to_string(), right });
        match self.noise {
            Some(noise) if !(noise.is_finite() && noise > 0.0) => {
                return refuse("noise", noise, "a standard deviation above zero");
            }
            _ => {}
        }
        if !(0.0..=0.5).contains(&self.outliers) {
            return refuse("outliers", self.outliers, "a fraction from 0 to 0.5");
        }
        match self.payloads.iter().find(|kg| !(kg.is_finite() && **kg >= 0.0)) {
            Some(bad) => refuse("payloads", *bad, "kilograms, zero or more"),
            None => Ok(()),
        }
    }
}

/// Reads the arm of this name, or the file.
pub fn find_arm(name: &str) -> Result<ArmDescription, TrialError> {
    if let Some(arm) = arms::by_name(name) {
        return arm.map_err(|source| TrialError::Description { path: name.to_owned(), source });
    }
    if !Path::new(name).exists() {
        return Err(TrialError::UnknownArm { name: name.to_owned(), known: arms::names() });
    }
    let text = read_text(Path::new(name), FileKind::WORLD)
        .map_err(|source| TrialError::Read { path: name.into(), source: source.into() })?;
    let arm = ArmDescription::from_yaml(&text)
        .map_err(|source| TrialError::Description { path: name.to_owned(), source })?;
    match arm.joints.iter().find(|joint| joint.motion == Motion::Slides) {
        Some(joint) => Err(TrialError::Slides { path: name.to_owned(), joint: joint.name.clone() }),
        None => Ok(arm),
    }
}

/// Most trials hide one effect; some none, two, something unknown to the lab, or a machine that does not repeat.
fn random_effects(rng: &mut Random) -> Vec<Requested> {
    let fraction = rng.between(0.0, 1.0);
    let names: &[&str] = match fraction {
        fraction if fraction < 0.15 => &[],
        fraction if fraction < 0.70 => &["any"],
        fraction if fraction < 0.85 => &["any", "any"],
        fraction if fraction < 0.95 => &["outside"],
        _ => &["not_repeatable"],
    };
    names
        .iter()
        .map(|name| Requested { choice: Choice::named(name), size: Size::OverNoise(rng.magnitude(1.5, 6.0)) })
        .collect()
}
