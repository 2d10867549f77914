//! What it would bring to name the likeliest candidate of a diagnosis from some probability on, in place of what the lab asks for a name: more right names, and more wrong ones.

use std::fmt::Write as _;

use crate::interval::Proportion;

/// Probabilities from which on the likeliest candidate would be named.
const BOUNDS: [f64; 6] = [0.99, 0.95, 0.8, 0.6, 0.4, 0.0];

/// The likeliest candidate of one injection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Likeliest {
    /// Probability, 0 to 1.
    pub(super) probability: f64,
    /// Whether it is what was hidden.
    pub(super) is_hidden: bool,
}

impl Likeliest {
    /// Of these candidates (effect, site, probability); nothing where none was given a probability.
    pub(super) fn of(
        candidates: &[(&str, &str, f64)],
        is_hidden: impl Fn(&str, &str) -> bool,
    ) -> Option<Self> {
        let likeliest = candidates.iter().max_by(|one, other| one.2.total_cmp(&other.2))?;
        let (effect, site, probability) = *likeliest;
        Some(Self { probability, is_hidden: is_hidden(effect, site) })
    }
}

/// A line for each bound: right and wrong names of all injections, per cent. Those without a candidate count as not named.
pub(super) fn table(likeliest: &[Option<Likeliest>]) -> String {
    let mut text = format!(
        "\nif the likeliest candidate were named ({} injections)\n{:<18}{:>24}{:>24}\n",
        likeliest.len(),
        "from, %",
        "right, %",
        "wrong, %"
    );
    for bound in BOUNDS {
        let named = |is_hidden: bool| {
            let holds = |one: &Likeliest| one.probability >= bound && one.is_hidden == is_hidden;
            Proportion::of(likeliest.iter().map(|one| one.as_ref().is_some_and(holds))).percent()
        };
        // Writing to a text cannot fail.
        let _ = writeln!(text, "{:<18.0}{:>24}{:>24}", 100.0 * bound, named(true), named(false));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lower_bound_names_more_of_both() {
        let said = |probability: f64, is_hidden: bool| Some(Likeliest { probability, is_hidden });
        let all = [said(0.995, true), said(0.9, true), said(0.9, false), None];
        let text = table(&all);
        let line = |from: &str| text.lines().find(|line| line.starts_with(from)).unwrap().to_owned();
        assert!(line("99 ").contains(" 25.0 [") && line("99 ").contains(" 0.0 ["), "{text}");
        assert!(line("80 ").contains(" 50.0 [") && line("80 ").contains(" 25.0 ["), "{text}");
        assert_eq!(line("0 ").split_whitespace().nth(1), line("80 ").split_whitespace().nth(1), "{text}");
    }

    #[test]
    fn the_likeliest_of_some_candidates_is_looked_at() {
        let candidates = [("joint_gain", "pan", 0.2), ("link_sag", "lift", 0.7), ("joint_gain", "lift", 0.1)];
        let found = Likeliest::of(&candidates, |effect, site| (effect, site) == ("link_sag", "lift"));
        assert_eq!(found, Some(Likeliest { probability: 0.7, is_hidden: true }));
        assert_eq!(Likeliest::of(&[], |_, _| true), None);
    }
}
