//! Masses of links that look as if they had not been measured.

use plumb_kinematics::Mass;

/// Links from which on equal masses are no chance.
const SEVERAL: usize = 3;

/// What to say of masses that look as if nobody had measured them.
pub fn placeholders(masses: &[Mass]) -> Option<String> {
    let first = masses.first().filter(|_| masses.len() >= SEVERAL)?;
    masses.iter().all(|mass| (mass.mass - first.mass).abs() < 1e-9).then(|| {
        format!(
            "the links' masses look like placeholders: all are {} kg. Sizes of what gravity does are only as good as they are: write better ones under `links:`",
            first.mass
        )
    })
}
