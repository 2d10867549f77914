//! Hiding something in an arm: which mechanism, and how much of it.

use crate::physics::imperfection::{Imperfection, Mechanism};
use crate::physics::random::Random;

use super::GenerateError;
use super::audit::Audit;
use super::specification::{Requested, Size, Specification};

/// How often a draw is repeated before giving up.
const DRAWS: usize = 60;
/// Least share of what is drawn at random that the free parameters may leave to be seen (of its root mean square).
const LEAST_VISIBLE: f64 = 0.15;

/// Draws one thing to hide beside `already`. Where a site is drawn at random, it is drawn again until the effect has a believable size there and the free
/// parameters do not swallow nearly all of it.
pub(super) fn hide(
    audit: &Audit<'_>,
    requested: &Requested,
    specification: &Specification,
    already: &[Imperfection],
    random: &mut Random,
) -> Result<Imperfection, GenerateError> {
    let mut refused = GenerateError::NoPoses;
    for _ in 0..DRAWS {
        let mechanism = requested.choice.draw(&specification.arm, audit.duration_s(), random)?;
        let sign = if has_either_sign(&mechanism) { random.sign() } else { 1.0 };
        let rms = match requested.size {
            Size::Exact(size) => return Ok(Imperfection { mechanism, size }),
            Size::OverNoise(ratio) => ratio * specification.noise,
        };
        let (name, site) = (mechanism.name(), mechanism.site(&specification.arm));
        if already
            .iter()
            .any(|other| other.mechanism.name() == name && other.mechanism.site(&specification.arm) == site)
        {
            refused = GenerateError::Twice { name, site };
            continue;
        }
        let greatest = mechanism.greatest_plausible(&specification.arm);
        let Some(imperfection) = sized(audit, &mechanism, (sign, greatest), rms)? else {
            refused = GenerateError::DoesNotShow { name, site };
            continue;
        };
        if imperfection.size.abs() > greatest {
            let (size, unit) =
                (format!("{:.1e}", imperfection.size.abs()), mechanism.unit_on(&specification.arm));
            refused = GenerateError::Unbelievable { name, site, size, unit };
            continue;
        }
        if requested.choice.site.is_some() || audit.visible_rms(&imperfection)? > LEAST_VISIBLE * rms {
            return Ok(imperfection);
        }
        refused = GenerateError::Swallowed { name, site };
    }
    Err(refused)
}

/// The mechanism at the size at which it moves the readings by `rms` mm; `None` when it does not move them at all.
fn sized(
    audit: &Audit<'_>,
    mechanism: &Mechanism,
    (sign, greatest): (f64, f64),
    rms: f64,
) -> Result<Option<Imperfection>, GenerateError> {
    let mut imperfection = Imperfection { mechanism: mechanism.clone(), size: sign * mechanism.small_size() };
    for _ in 0..3 {
        let moved = audit.moved_rms(&imperfection)?;
        if moved < 1e-9 {
            return Ok(None);
        }
        imperfection.size *= rms / moved;
        if imperfection.size.abs() > greatest {
            break;
        }
    }
    Ok(Some(imperfection))
}

/// Sizes along a direction drawn at random, and those of what can only go one way, are positive.
fn has_either_sign(mechanism: &Mechanism) -> bool {
    !matches!(
        mechanism,
        Mechanism::JointCompliance { .. }
            | Mechanism::JointStiffening { .. }
            | Mechanism::JointHarmonic { .. }
            | Mechanism::ScrewWave { .. }
            | Mechanism::JointBacklash { .. }
            | Mechanism::JointSettling { .. }
            | Mechanism::LinkSag { .. }
            | Mechanism::LinkTorsion { .. }
            | Mechanism::ThermalGrowth { .. }
            | Mechanism::WornGear { .. }
            | Mechanism::CableWindUp { .. }
            | Mechanism::RockingBase { .. }
            | Mechanism::StickSlip { .. }
            | Mechanism::LooseCoupling { .. }
            | Mechanism::BaseTilt { .. }
            | Mechanism::BasePosition { .. }
            | Mechanism::ToolOffset { .. }
            | Mechanism::Drift { .. }
            | Mechanism::InstrumentTilt { .. }
    )
}
