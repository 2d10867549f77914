//! A measurement campaign on an imperfect arm: what a user would hold afterwards, and, apart from it, the truth.

pub mod case;
pub mod catalogue;
pub mod files;
pub mod instrument;
pub mod poses;
pub mod seal;
pub mod specification;

use super::imperfection::{Imperfection, Kind, Mechanism};
use super::machine::{Conditions, Machine, NoEquilibrium};
use super::random::Random;

pub use case::{Case, Hidden, Truth, Verdict};
use catalogue::ChoiceError;
use instrument::Instrument;
use poses::Visit;
use specification::{Free, Size, Specification};

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
        "`{name}` at `{place}` does not move the readings in these poses: give its size itself, or another place"
    )]
    DoesNotShow {
        /// The mechanism.
        name: &'static str,
        /// Where it was to sit.
        place: String,
    },
    /// No poses.
    #[error("a campaign needs at least one pose")]
    NoPoses,
}

/// Simulates the campaign. The same specification and seed give the same case everywhere.
pub fn generate(specification: &Specification, seed: u64) -> Result<Case, GenerateError> {
    let visits = poses::plan(specification, seed);
    let Some(duration_s) = visits.last().map(|visit| visit.time_s.max(1.0)) else {
        return Err(GenerateError::NoPoses);
    };
    let nuisances = nuisances(specification, seed);
    let mut random = Random::new(seed, "hidden");
    let plain = run(specification, &visits, &nuisances)?;
    let mut hidden = Vec::with_capacity(specification.hidden.len());
    for wanted in &specification.hidden {
        let mechanism = wanted.choice.draw(&specification.arm, duration_s, &mut random)?;
        let sign = if has_either_sign(&mechanism) { random.sign() } else { 1.0 };
        let imperfection = match wanted.size {
            Size::Exact(size) => Imperfection { mechanism, size },
            Size::OverNoise(ratio) => {
                sized(specification, &visits, &nuisances, &plain, mechanism, sign, ratio)?
            }
        };
        hidden.push(imperfection);
    }
    let all: Vec<Imperfection> = nuisances.iter().chain(&hidden).cloned().collect();
    let clean = run(specification, &visits, &all)?;
    let over_noise = hidden
        .iter()
        .map(|one| {
            let others: Vec<Imperfection> = all.iter().filter(|other| *other != one).cloned().collect();
            Ok(distance(&clean, &run(specification, &visits, &others)?) / specification.noise_mm)
        })
        .collect::<Result<Vec<f64>, NoEquilibrium>>()?;
    let (readings, outliers) = observe(specification, &clean, seed);
    Ok(Case::new(specification, seed, visits, readings, outliers, nuisances, hidden, over_noise))
}

/// Drives an arm with these imperfections through the visits and reads the instrument, without noise: one row of readings a visit.
pub fn run(
    specification: &Specification,
    visits: &[Visit],
    imperfections: &[Imperfection],
) -> Result<Vec<Vec<f64>>, NoEquilibrium> {
    let mut machine = Machine::new(&specification.arm, imperfections);
    let instrument = Instrument::new(specification.reading, imperfections);
    machine.go(&vec![0.0; specification.arm.joints.len()], 0.0);
    let read = |visit: &Visit| {
        if specification.approach == specification::Approach::EitherSide {
            machine.go(&visit.beyond(), visit.time_s);
        }
        machine.go(&visit.commanded, visit.time_s);
        let conditions = Conditions {
            time_s: visit.time_s,
            temperature_c: visit.temperature_c,
            payload_kg: visit.payload_kg,
        };
        Ok(instrument.read(machine.stand(&conditions)?.posture.target))
    };
    visits.iter().map(read).collect()
}

/// Root mean square difference of two sets of readings, per reading.
fn distance(left: &[Vec<f64>], right: &[Vec<f64>]) -> f64 {
    let differences = left.iter().flatten().zip(right.iter().flatten()).map(|(a, b)| (a - b).powi(2));
    let (sum, count) = differences.fold((0.0, 0_usize), |(sum, count), square| (sum + square, count + 1));
    if count == 0 { 0.0 } else { (sum / count as f64).sqrt() }
}

/// The size at which a mechanism moves the readings by `ratio` times the noise.
fn sized(
    specification: &Specification,
    visits: &[Visit],
    nuisances: &[Imperfection],
    plain: &[Vec<f64>],
    mechanism: Mechanism,
    sign: f64,
    ratio: f64,
) -> Result<Imperfection, GenerateError> {
    let mut size = sign * first_guess(&mechanism);
    for _ in 0..3 {
        let tried: Vec<Imperfection> =
            nuisances.iter().cloned().chain([Imperfection { mechanism: mechanism.clone(), size }]).collect();
        let moved = distance(&run(specification, visits, &tried)?, plain);
        if moved < 1e-9 {
            let place = mechanism.place(&specification.arm);
            return Err(GenerateError::DoesNotShow { name: mechanism.name(), place });
        }
        size *= ratio * specification.noise_mm / moved;
    }
    Ok(Imperfection { mechanism, size })
}

/// An order of magnitude that no arm minds.
fn first_guess(mechanism: &Mechanism) -> f64 {
    match mechanism.unit() {
        "rad/(N m)" => 1e-6,
        "1/(N m2)" => 1e-7,
        "1/K" => 1e-5,
        "mm" | "mm/h" => 0.1,
        _ => 1e-4,
    }
}

fn has_either_sign(mechanism: &Mechanism) -> bool {
    !matches!(
        mechanism,
        Mechanism::JointCompliance { .. }
            | Mechanism::JointStiffening { .. }
            | Mechanism::JointHarmonic { .. }
            | Mechanism::JointBacklash { .. }
            | Mechanism::JointSettling { .. }
            | Mechanism::LinkSag { .. }
            | Mechanism::ThermalGrowth { .. }
            | Mechanism::WornGear { .. }
            | Mechanism::CableWindUp { .. }
            | Mechanism::RockingBase { .. }
            | Mechanism::StickSlip { .. }
    )
}

/// The small constant errors every arm has and every user's model leaves free.
fn nuisances(specification: &Specification, seed: u64) -> Vec<Imperfection> {
    let mut random = Random::new(seed, "nuisances");
    let mut all = Vec::new();
    let mut add = |mechanism: Mechanism, size: f64| all.push(Imperfection { mechanism, size });
    let fixed = |name: &str| specification.hidden.iter().any(|wanted| wanted.choice.name == name);
    let tilt = Mechanism::BaseTilt { direction: random.between(0.0, std::f64::consts::TAU) };
    let tilt_size = 0.2_f64.to_radians() * random.normal();
    let shift = Mechanism::BasePosition { direction: random.direction().into() };
    let shift_size = random.between(0.5, 4.0);
    if !fixed("base_tilt") && !fixed("base_position") && !fixed("drift") && !fixed("instrument_tilt") {
        add(tilt, tilt_size);
        add(shift, shift_size);
    }
    let offset = Mechanism::ToolOffset { direction: random.direction().into() };
    let offset_size = random.between(0.2, 1.5);
    if !fixed("tool_offset") {
        add(offset, offset_size);
    }
    for joint in 0..specification.arm.joints.len() {
        let sizes = [random.normal(), random.normal(), random.normal(), random.normal(), random.normal()];
        if specification.free != Free::None {
            add(Mechanism::JointZero { joint }, 0.1_f64.to_radians() * sizes[0]);
        }
        if specification.free == Free::Geometry {
            add(Mechanism::LinkLength { joint }, 0.3 * sizes[1]);
            add(Mechanism::LinkOffset { joint }, 0.3 * sizes[2]);
            add(Mechanism::LinkTwist { joint }, 0.03_f64.to_radians() * sizes[3]);
            add(Mechanism::AxisSkew { joint }, 0.03_f64.to_radians() * sizes[4]);
        }
    }
    all
}

/// Adds noise, and gross errors where chance has it. Also tells which rows are grossly wrong.
fn observe(specification: &Specification, clean: &[Vec<f64>], seed: u64) -> (Vec<Vec<f64>>, Vec<usize>) {
    let mut noise = Random::new(seed, "noise");
    let mut gross = Random::new(seed, "outliers");
    let mut outliers = Vec::new();
    let observed = clean.iter().enumerate().map(|(row, reading)| {
        let mut seen: Vec<f64> =
            reading.iter().map(|value| value + specification.noise_mm * noise.normal()).collect();
        let (wrong, size, direction) =
            (gross.chance(specification.outliers), gross.magnitude(10.0, 100.0), gross.direction());
        if wrong {
            outliers.push(row);
            for (value, share) in seen.iter_mut().zip(<[f64; 3]>::from(direction)) {
                *value += specification.noise_mm * size * 3.0_f64.sqrt() * share;
            }
        }
        seen
    });
    (observed.collect(), outliers)
}

/// What is right to say about an arm that hides these.
fn accepted(hidden: &[Imperfection]) -> Vec<Verdict> {
    let kind = |kind: Kind| hidden.iter().any(|one| one.mechanism.kind() == kind);
    if kind(Kind::NotRepeatable) {
        vec![Verdict::NotRepeatable]
    } else if kind(Kind::Outside) {
        vec![Verdict::Unknown, Verdict::Located]
    } else if hidden.is_empty() {
        vec![Verdict::AtFloor]
    } else {
        vec![Verdict::Named, Verdict::Located, Verdict::Tied]
    }
}
