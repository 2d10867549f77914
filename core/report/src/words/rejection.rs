//! Why a candidate is not the name.

use crate::phrase::listed;
use plumb_diagnosis::{Objection, Rejection};

/// Why a candidate is not the name, and which rival is in its way.
pub fn rejection_in_words(rejection: &Rejection) -> String {
    match rejection {
        Rejection::HeldGeometry(group) => {
            format!("errors of the geometry that is not free explain it as well: free `{group}`")
        }
        Rejection::NotSignificant(holm_p) => not_significant(*holm_p),
        Rejection::Implausible => "implausible size or sign for a real machine".to_owned(),
        Rejection::IndistinguishableFrom(others) => {
            format!("indistinguishable from {}", listed(others, "and"))
        }
        Rejection::Outvoted => "it holds only where some rows count as outliers".to_owned(),
        Rejection::NotPredicted => "it does not predict rows it has not seen".to_owned(),
        Rejection::WorseThan(better) => format!("worse than {better}"),
        Rejection::SmoothExplains => {
            "a smooth function of what is known of a row explains it as well".to_owned()
        }
        Rejection::SmoothPredicts => {
            "a smooth function of what is known of a row predicts rows left out as well".to_owned()
        }
        Rejection::UnlistedAt(site) => {
            format!("a mechanism that is not listed explains it as well, or is at work too, at {site}")
        }
        Rejection::MoreLeftAt(site) => format!("too much else is left at {site}"),
        Rejection::NotSignificantBesideSmooth => {
            "not significant once a smooth function of what is known of a row explains the rest".to_owned()
        }
        Rejection::LessLikelyBesideSmooth => {
            "others are likelier once a smooth function of what is known of a row explains the rest"
                .to_owned()
        }
        Rejection::FlexibleTermsAt(site) => {
            format!(
                "several flexible terms (gain, waves, coupling) at {site} may together imitate something else"
            )
        }
        Rejection::OtherSize => "its size is another once the rest is allowed for".to_owned(),
        Rejection::MoreThanNoiseLeft => {
            "more than noise is left with it in, which a mechanism that is not listed may explain as well"
                .to_owned()
        }
    }
}

/// Why the lab would not add an effect.
pub fn objection_in_words(objection: &Objection) -> String {
    match objection {
        Objection::Rejected(rejection) => rejection_in_words(rejection),
        Objection::NotAmong(candidates) => {
            format!("it is not among the {candidates} likeliest candidates")
        }
    }
}

/// Why a candidate that chance may have made is no name. A small probability keeps three digits: 0.00 would contradict the words.
fn not_significant(holm_p: f64) -> String {
    let digits = if holm_p < 0.095 { 3 } else { 2 };
    format!("not significant (p = {holm_p:.digits$}, Holm-corrected)")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_probability_keeps_a_third_digit() {
        assert_eq!(not_significant(0.0042), "not significant (p = 0.004, Holm-corrected)");
        assert_eq!(not_significant(0.094), "not significant (p = 0.094, Holm-corrected)");
        assert_eq!(not_significant(0.097), "not significant (p = 0.10, Holm-corrected)");
        assert_eq!(not_significant(1.0), "not significant (p = 1.00, Holm-corrected)");
    }

    #[test]
    fn rivals_and_places_are_in_the_reason() {
        let rivals = ["a(x)", "b(x)", "c(y)"].map(str::to_owned).to_vec();
        let message = |rejection: Rejection| rejection_in_words(&rejection);
        assert_eq!(
            message(Rejection::IndistinguishableFrom(rivals)),
            "indistinguishable from a(x), b(x) and c(y)"
        );
        assert_eq!(message(Rejection::WorseThan("a(x)".to_owned())), "worse than a(x)");
        assert!(message(Rejection::UnlistedAt("elbow".to_owned())).ends_with("at elbow"));
        assert_eq!(message(Rejection::MoreLeftAt("elbow".to_owned())), "too much else is left at elbow");
        assert!(message(Rejection::HeldGeometry("geometry(*)")).ends_with("free `geometry(*)`"));
    }

    #[test]
    fn an_effect_that_was_judged_is_objected_to_for_its_own_reason() {
        let judged = Objection::Rejected(Rejection::Implausible);
        assert_eq!(objection_in_words(&judged), "implausible size or sign for a real machine");
        assert_eq!(
            objection_in_words(&Objection::NotAmong(12)),
            "it is not among the 12 likeliest candidates"
        );
    }
}
