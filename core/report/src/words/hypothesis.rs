//! What is said of a formula that the lab found.

use plumb_diagnosis::{HYPOTHESIS, Hypothesis};

/// The formula, what it does, what does as well, and what to do with it.
pub fn hypothesis_sentence(hypothesis: &Hypothesis) -> String {
    let Hypothesis { site, formula, explains, unit, before_mm, after_mm, or, .. } = hypothesis;
    let others = match or.len() {
        0 => String::new(),
        _ => format!(" Just as good: {}.", or.join("; or ")),
    };
    format!(
        "A formula for it, as a hypothesis: {site}, {formula}. It predicts rows that were left out, takes away {:.0} % of what is beyond the noise, and leaves {after_mm:.3} of {before_mm:.3} {unit}.{others} \
         To try it, put the block into the model file and add `{HYPOTHESIS}`.",
        100.0 * explains
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use plumb_calibration::measurement::ReadingUnit;

    #[test]
    fn a_formula_is_reported_with_what_it_takes_away_and_what_does_as_well() {
        let hypothesis = |or: &[&str]| Hypothesis {
            site: "elbow".to_owned(),
            formula: "q_rad: \"a * q2 * q3\"".to_owned(),
            values: Vec::new(),
            explains: 0.874,
            unit: ReadingUnit::Mm,
            before_mm: 0.31,
            after_mm: 0.09,
            or: or.iter().map(|one| (*one).to_owned()).collect(),
            define: String::new(),
        };
        assert_eq!(
            hypothesis_sentence(&hypothesis(&[])),
            "A formula for it, as a hypothesis: elbow, q_rad: \"a * q2 * q3\". It predicts rows that were left out, takes away 87 % of what is beyond the noise, and leaves 0.090 of 0.310 mm. \
             To try it, put the block into the model file and add `hypothesis`."
        );
        assert!(
            hypothesis_sentence(&hypothesis(&["one", "two"]))
                .contains(" mm. Just as good: one; or two. To try")
        );
    }
}
