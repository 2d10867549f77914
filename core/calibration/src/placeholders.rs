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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_links_of_one_mass_look_like_placeholders_and_two_or_different_ones_do_not() {
        let warning_for = |masses: &[f64]| {
            let masses: Vec<Mass> = (0..)
                .zip(masses)
                .map(|(after, mass)| Mass { after, mass: *mass, centre: Default::default() })
                .collect();
            placeholders(&masses)
        };
        assert!(warning_for(&[1.5, 1.5, 1.5]).unwrap().contains("all are 1.5 kg"));
        assert_eq!(
            (warning_for(&[1.5, 1.5]), warning_for(&[1.5, 1.5, 1.6]), warning_for(&[])),
            (None, None, None)
        );
    }
}
