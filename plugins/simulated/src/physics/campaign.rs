//! A measurement campaign on an imperfect arm: what a user would hold afterwards, and, apart from it, the truth.

mod at_poses;
pub mod audit;
pub mod carried;
pub mod case;
pub mod catalogue;
mod drive_through;
pub mod files;
mod hide;
pub mod instrument;
mod nuisance;
pub mod poses;
pub mod seal;
pub mod specification;
mod touch;
mod visit;

use super::imperfection::{Imperfection, Kind};
use super::machine::NoEquilibrium;
use super::random::Random;

pub use at_poses::hide_at_poses;
use audit::Audit;
use case::Strength;
pub use case::{Case, Hidden, Truth, Verdict};
use catalogue::ChoiceError;
use drive_through::rms_difference;
pub use drive_through::run;
use poses::Chosen;
use specification::{Reading, Specification};

/// Why a campaign could not be simulated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GenerateError {
    /// What is to be hidden makes no sense on this arm.
    #[error(transparent)]
    Choice(#[from] ChoiceError),
    /// The arm falls down.
    #[error(transparent)]
    Balance(#[from] NoEquilibrium),
    /// The effect would not move the readings at all, so no size makes it so many times the noise.
    #[error(
        "`{name}` at `{site}` does not move the readings in these poses: give its size itself, or another place"
    )]
    DoesNotShow {
        /// The mechanism.
        name: &'static str,
        /// Where it was to sit.
        site: String,
    },
    /// Its size would have to be beyond belief.
    #[error(
        "`{name}` at `{site}` would need a size of {size} {unit} to show so much: give a smaller one, or another place"
    )]
    Unbelievable {
        /// The mechanism.
        name: &'static str,
        /// Where it was to sit.
        site: String,
        /// The size.
        size: String,
        /// Its unit.
        unit: &'static str,
    },
    /// The model's free parameters would explain it away.
    #[error(
        "wherever `{name}` was tried (last at `{site}`) the free parameters swallow it: free less, or name the place to have it all the same"
    )]
    Swallowed {
        /// The mechanism.
        name: &'static str,
        /// Where it was to sit.
        site: String,
    },
    /// The same effect at the same site twice.
    #[error("`{name}` at `{site}` is hidden already: twice the same is one effect")]
    Twice {
        /// The mechanism.
        name: &'static str,
        /// Where it was to sit.
        site: String,
    },
    /// Chosen poses do not say which socket they touch.
    #[error("further poses cannot be chosen where the arm touches sockets: take more poses from the start")]
    NoFurtherTouch,
    /// No poses.
    #[error("a campaign needs at least one pose (to read tilts: one with the flange's z pointing up)")]
    NoPoses,
}

/// Simulates the campaign. The same specification and seed give the same case everywhere.
pub fn generate(specification: &Specification, seed: u64) -> Result<Case, GenerateError> {
    generate_further(specification, seed, &[])
}

/// Simulates the campaign and, after it, further poses someone chose. What was read before stays as it was.
pub fn generate_further(
    specification: &Specification,
    seed: u64,
    chosen: &[Chosen],
) -> Result<Case, GenerateError> {
    let mut visits = poses::plan(specification, seed);
    if visits.is_empty() {
        return Err(GenerateError::NoPoses);
    }
    let nuisances = nuisance::nuisances(specification, seed);
    let audit = Audit::new(specification, &visits, &nuisances)?;
    let mut random = Random::new(seed, "hidden");
    let mut hidden = Vec::with_capacity(specification.hidden.len());
    for requested in &specification.hidden {
        hidden.push(hide::hide(&audit, requested, specification, &hidden, &mut random)?);
    }
    if specification.reading == Reading::Touch && !chosen.is_empty() {
        return Err(GenerateError::NoFurtherTouch);
    }
    visits.extend(poses::further(specification, seed, &visits, chosen));
    let audit = Audit::new(specification, &visits, &nuisances)?;
    let all: Vec<Imperfection> = nuisances.iter().chain(&hidden).cloned().collect();
    let clean = run(specification, &visits, &all)?;
    let mut described = Vec::with_capacity(hidden.len());
    for one in &hidden {
        let others: Vec<Imperfection> = all.iter().filter(|other| *other != one).cloned().collect();
        let moved = rms_difference(&clean.concat(), &run(specification, &visits, &others)?.concat());
        let visible = audit.visible_rms(one)?;
        let strength = Strength {
            over_noise: moved / specification.noise,
            visible_over_noise: visible / specification.noise,
            standard_errors: visible / specification.noise * (clean.concat().len() as f64).sqrt(),
        };
        described.push(case::describe(specification, one, strength));
    }
    let (readings, outliers) = match specification.reading {
        Reading::Touch => {
            // The noise is how badly the ball sits: it moves the pose, and the pose is all that is read.
            let (off, outliers) = observe(specification, &vec![vec![0.0; 3]; visits.len()], seed);
            touch::seat(specification, seed, &mut visits, &all, &off)?;
            (off, outliers)
        }
        _ => observe(specification, &clean, seed),
    };
    let outlier_rows = outliers.into_iter().map(|row| row + 1).collect();
    let truth = Truth {
        seed,
        accept_verdict: accepted(&hidden, &described),
        outlier_rows,
        ..Truth::of(specification, &hidden, described)
    };
    Ok(Case {
        specification: specification.clone(),
        visits,
        readings,
        nuisances,
        imperfections: hidden,
        truth,
    })
}

/// Adds noise, and gross errors where chance has it. Also reports which rows are grossly wrong.
fn observe(specification: &Specification, clean: &[Vec<f64>], seed: u64) -> (Vec<Vec<f64>>, Vec<usize>) {
    let mut noise = Random::new(seed, "noise");
    let mut gross = Random::new(seed, "outliers");
    let mut outliers = Vec::new();
    let observed = clean.iter().enumerate().map(|(row, reading)| {
        let mut seen: Vec<f64> =
            reading.iter().map(|value| value + specification.noise * noise.normal()).collect();
        let (wrong, size, direction) =
            (gross.chance(specification.outliers), gross.magnitude(10.0, 100.0), gross.direction());
        if wrong {
            outliers.push(row);
            for (value, fraction) in seen.iter_mut().zip(<[f64; 3]>::from(direction)) {
                *value += specification.noise * size * 3.0_f64.sqrt() * fraction;
            }
        }
        seen
    });
    (observed.collect(), outliers)
}

/// An effect below so many standard errors may be missed by an honest analyst who has hundreds of candidates to weigh: a chance of one in a hundred over
/// all of them needs four, and one and a half more to be met nineteen times in twenty.
const SURE_TO_SHOW: f64 = 5.5;

/// What is right to say about an arm that hides these.
fn accepted(imperfections: &[Imperfection], hidden: &[Hidden]) -> Vec<Verdict> {
    let kind = |kind: Kind| imperfections.iter().any(|one| one.mechanism.kind() == kind);
    let faint = hidden.iter().all(|one| one.standard_errors < SURE_TO_SHOW);
    let mut right = if kind(Kind::NotRepeatable) {
        vec![Verdict::NotRepeatable]
    } else if kind(Kind::Outside) {
        // What the library knows may be named among what it does not.
        let among_others = kind(Kind::Library).then_some([Verdict::Named, Verdict::Tied]);
        [Verdict::Unknown, Verdict::Located].into_iter().chain(among_others.into_iter().flatten()).collect()
    } else if hidden.is_empty() {
        return vec![Verdict::AtFloor];
    } else {
        vec![Verdict::Named, Verdict::Located, Verdict::Tied]
    };
    if faint {
        right.extend([Verdict::AtFloor, Verdict::Blind]);
    }
    right
}
