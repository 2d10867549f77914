//! The verdict in one plain sentence.

use super::few_poses::{added_to, with_condition};
use super::jumps::jumps_in_words;
use super::rejection::rejection_in_words;
use super::rest::rest_in_words;
use crate::phrase::{listed, noise_text, size_text};
use plumb_diagnosis::{Alike, Diagnosis, EffectSite, Located, Named, NotShown, Rejection, Verdict};

/// How the noise of light stripes is called among the readings of a table.
const STRIPES: &str = "stripe_mm";

/// What the lab has to say of a model and a table, in one plain sentence: what jumped, the verdict, what goes with the pose.
pub fn diagnosis_sentence(diagnosis: &Diagnosis) -> String {
    let sentence = || format!("{}{}", jumps_in_words(&diagnosis.jumps), verdict_in_words(diagnosis));
    match &diagnosis.few_poses {
        None => sentence(),
        Some(few) => match &few.condition {
            Some(condition) => with_condition(diagnosis, few, condition),
            None => added_to(sentence(), few),
        },
    }
}

/// Why two effects are tied, or nearly so.
pub fn alike_in_words(alike: &Alike) -> String {
    let Alike { one, other, correlation } = alike;
    format!(
        "beyond what is fitted {one} and {other} move the readings of these poses alike (canonical correlation {correlation:.3})"
    )
}

/// The verdict, and how much of the rest is not explained with it.
fn verdict_in_words(diagnosis: &Diagnosis) -> String {
    let floor = diagnosis.floor.sigma_mm.map_or_else(
        || "an unknown noise".to_owned(),
        |sigma| format!("the noise of {}", noise_text(sigma, diagnosis.unit, 3)),
    );
    let (miss, unit) = (diagnosis.judged_mm, diagnosis.unit);
    let words = match diagnosis.verdict {
        Verdict::Named => diagnosis.named.as_ref().map_or_else(String::new, |named| name(diagnosis, named)),
        Verdict::Located => diagnosis.located.as_ref().map_or_else(String::new, |located| {
            let free = diagnosis.free_first.map_or_else(String::new, |group| {
                format!(" Errors of the arm's geometry that the model does not free explain it as well: free `{group}` and ask again.")
            });
            let why = why_not_named(diagnosis, located);
            format!("The error of {miss:.3} {unit} sits in {}, but {why}.{free}", located.site)
        }),
        Verdict::Tied => tie(diagnosis),
        Verdict::AtFloor => at_floor(diagnosis, &floor),
        Verdict::Unknown => format!(
            "{miss:.3} {unit} is left over {floor}, and nothing in the library explains it: {}.",
            rest_in_words(&diagnosis.remaining)
        ),
        Verdict::Blind => {
            format!("These poses could not show most effects: {}.", rest_in_words(&diagnosis.remaining))
        }
        Verdict::NotRepeatable => {
            format!("The arm does not come back to where it was: {}.", rest_in_words(&diagnosis.remaining))
        }
        Verdict::FloorUnknown => format!(
            "Nothing can be named, and the noise is not known: {miss:.3} {unit} may be all noise; return to some poses."
        ),
    };
    match diagnosis.left_unexplained_mm {
        Some(left) => format!("{words} {left:.3} {unit} of the rest is not explained yet."),
        None => words,
    }
}

/// One effect is named.
fn name(diagnosis: &Diagnosis, named: &Named) -> String {
    let (miss, unit) = (diagnosis.judged_mm, diagnosis.unit);
    let label = label_of(diagnosis, &named.effect);
    let size = size_text(named.size, named.se, &named.unit);
    match named.effect.at {
        Some(at) => format!(
            "The error of {miss:.3} {unit} is {label} at {at:.0} s: {size}. No number of the model cures lost steps: find the zeros anew, and drive \
             more slowly where they were lost; add it to see what else there is."
        ),
        None => format!("The error of {miss:.3} {unit} is {label}: {size}; add it."),
    }
}

/// Why nothing is named at a known place.
fn why_not_named(diagnosis: &Diagnosis, located: &Located) -> String {
    match in_question(diagnosis, located).as_slice() {
        [] => "nothing in the library explains it".to_owned(),
        [one] => match tied_at(diagnosis, one, &located.site).as_slice() {
            [] | [_] if is_borne_out_too_little(diagnosis, one, &located.site) => {
                format!(
                    "too few poses to name it: {one} comes nearest, and does not yet predict rows it has not seen"
                )
            }
            [] | [_] => nearest(diagnosis, one, &located.site),
            several => format!("these data cannot distinguish {}", listed(several, "and")),
        },
        several => format!("these data cannot distinguish {}", listed(several, "and")),
    }
}

/// Several effects at several places do as well.
fn tie(diagnosis: &Diagnosis) -> String {
    let labels: Vec<String> = diagnosis.tied.iter().take(4).map(|tie| label_of(diagnosis, tie)).collect();
    if let Some(group) = diagnosis.free_first {
        return format!(
            "The error of {:.3} {} may be {}, or errors of the arm's geometry that the model does not free: they explain it as well. Free `{group}` and ask again.",
            diagnosis.judged_mm,
            diagnosis.unit,
            listed(&labels, "or")
        );
    }
    let mut others = diagnosis.tied.iter().skip(1).map(|tie| label_of(diagnosis, tie));
    if !diagnosis.same.is_empty() && others.all(|label| diagnosis.same.contains(&label)) {
        return format!(
            "The error of {:.3} {} is {}: the same in these data, where they move every reading alike; add either.",
            diagnosis.judged_mm,
            diagnosis.unit,
            listed(&labels, "or")
        );
    }
    format!(
        "{} cannot be distinguished with these data{}{}",
        listed(&labels, "and"),
        diagnosis.alike.first().map_or_else(String::new, |alike| format!(": {}", alike_in_words(alike))),
        what_would_distinguish(diagnosis)
    )
}

/// How the sentence of a tie ends: with what would distinguish the effects.
fn what_would_distinguish(diagnosis: &Diagnosis) -> String {
    match diagnosis.next_separation {
        _ if diagnosis.next.is_empty() => ".".to_owned(),
        Some(separation) if diagnosis.next_distinguishes() == Some(false) => format!(
            ". The poses listed would not do it either: what the effects predict there differs by {separation:.1} standard errors. `plumb model next` says what would."
        ),
        _ => "; measure the poses listed.".to_owned(),
    }
}

/// Of the effects of a place those that may be the one in question: what was found besides is at work together with it, and no rival of it.
fn in_question(diagnosis: &Diagnosis, located: &Located) -> Vec<String> {
    let rivals = located.family.iter().filter(|name| !is_only_besides(diagnosis, name, &located.site));
    let rivals: Vec<String> = rivals.cloned().collect();
    if rivals.is_empty() { located.family.clone() } else { rivals }
}

/// Whether an effect of this name was found besides at a place, and none of that name is tied there.
fn is_only_besides(diagnosis: &Diagnosis, effect: &str, site: &str) -> bool {
    let (alone, with_more) = (format!("{effect}({site})"), format!("{effect}({site}, "));
    let is_besides = diagnosis.besides.iter().any(|label| *label == alone || label.starts_with(&with_more));
    is_besides && tied_at(diagnosis, effect, site).is_empty()
}

/// What comes nearest at a place, and why it is not named.
fn nearest(diagnosis: &Diagnosis, effect: &str, site: &str) -> String {
    match rejection_at(diagnosis, effect, site) {
        None | Some(Rejection::MoreThanNoiseLeft | Rejection::MoreLeftAt(_)) => {
            format!("{effect} comes nearest and does not explain all of it")
        }
        Some(other) => format!("{effect}, which comes nearest, is not named: {}", rejection_in_words(other)),
    }
}

/// Why the first candidate of this name at a place is not the name.
fn rejection_at<'d>(diagnosis: &'d Diagnosis, effect: &str, site: &str) -> Option<&'d Rejection> {
    let mut there = diagnosis.candidates.iter();
    there.find(|one| one.effect.effect == effect && one.effect.site == site)?.rejected.as_ref()
}

/// Whether what comes nearest at a place is not named because it does not predict rows it has not seen.
fn is_borne_out_too_little(diagnosis: &Diagnosis, effect: &str, site: &str) -> bool {
    rejection_at(diagnosis, effect, site) == Some(&Rejection::NotPredicted)
}

/// What is not shown, effects of one name together, in the order of the greatest of each.
fn kinds(not_shown: &[NotShown]) -> Vec<Vec<&NotShown>> {
    let mut kinds: Vec<Vec<&NotShown>> = Vec::new();
    for one in not_shown {
        match kinds.iter_mut().find(|kind| kind.iter().any(|other| other.effect.effect == one.effect.effect))
        {
            Some(kind) => kind.push(one),
            None => kinds.push(vec![one]),
        }
    }
    kinds
}

/// Effects of one name with all their places, and how far they could put the tip off: `link_sag(shoulder, elbow) up to 0.7 mm`.
fn together(of_kind: &[&NotShown]) -> String {
    let name = of_kind.first().map_or("", |one| one.effect.effect.as_str());
    let mut sites: Vec<String> = Vec::new();
    for one in of_kind {
        if !sites.contains(&one.effect.site) {
            sites.push(one.effect.site.clone());
        }
    }
    let most = of_kind.iter().map(|one| one.up_to_mm).reduce(|most, one| Some(most?.max(one?))).flatten();
    let size = most.map_or_else(|| "of any size".to_owned(), |most| format!("up to {most:.1} mm"));
    format!("{name}({}) {size}", sites.join(", "))
}

/// A model at the floor: no more is said than the rows can show.
fn at_floor(diagnosis: &Diagnosis, floor: &str) -> String {
    let unlogged = match diagnosis.not_logged.as_slice() {
        [] => String::new(),
        some => format!(" The table does not log {}: what goes by that is not judged.", listed(some, "or")),
    };
    if diagnosis.not_shown.is_empty() {
        return format!(
            "Nothing is left but {floor}: any effect of the library that moved the tip by more would have shown in these rows.{unlogged}"
        );
    }
    let spoken: Vec<String> =
        kinds(&diagnosis.not_shown).into_iter().map(|of_kind| together(&of_kind)).collect();
    let next = match diagnosis.noise.iter().any(|one| one.reading == STRIPES) {
        true => "`plumb stripe next` lists pictures that would show it.",
        false => "`plumb model next` lists poses and loads that would show it.",
    };
    format!(
        "Nothing is left but {floor}, for what these rows can show. Not shown by them: {}. {next}{unlogged}",
        listed(&spoken, "and")
    )
}

/// Candidates of one name at one place, such as waves of several orders, that do as well as each other.
fn tied_at(diagnosis: &Diagnosis, effect: &str, site: &str) -> Vec<String> {
    let tied = diagnosis.candidates.iter().filter(|candidate| {
        candidate.effect.effect == effect
            && candidate.effect.site == site
            && matches!(candidate.rejected, Some(Rejection::IndistinguishableFrom(_)))
    });
    tied.map(|candidate| candidate.label.clone()).collect()
}

/// An effect as it is written, with the order of a wave and whatever else is part of its name.
fn label_of(diagnosis: &Diagnosis, effect: &EffectSite) -> String {
    let candidate = diagnosis.candidates.iter().find(|candidate| candidate.effect == *effect);
    candidate.map_or_else(|| format!("{}({})", effect.effect, effect.site), |known| known.label.clone())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::two_links;
    use plumb_diagnosis::NextPose;
    use plumb_estimation::Progress;

    const DECLARED: &str = "free: [joint_zero(*)]\nnoise: {p1_mm: 0.05}";

    fn diagnosed(lines: &str, seed: u64, off: impl Fn([f64; 2]) -> [f64; 2]) -> Diagnosis {
        two_links(40, lines, 0.05, seed, off).diagnose(&Progress::unwatched()).unwrap()
    }

    #[test]
    fn of_an_arm_that_is_right_it_is_said_what_is_not_shown_and_what_is_not_logged() {
        let diagnosis = diagnosed(DECLARED, 21, |_| [0.0; 2]);
        let sentence = diagnosis_sentence(&diagnosis);
        assert!(sentence.starts_with("Nothing is left but the noise of 0.050 mm an axis"), "{sentence}");
        assert!(
            sentence.ends_with("The table does not log side of approach, time or temperature: what goes by that is not judged."),
            "{sentence}"
        );
        let shown = Diagnosis { not_shown: Vec::new(), not_logged: Vec::new(), ..diagnosis };
        assert_eq!(
            diagnosis_sentence(&shown),
            "Nothing is left but the noise of 0.050 mm an axis: any effect of the library that moved the tip by more would have shown in these rows."
        );
    }

    #[test]
    fn a_name_is_reported_with_its_size_and_a_jump_with_its_time() {
        let diagnosis = diagnosed(DECLARED, 22, |q| [0.0, 0.01 * q[1]]);
        let miss = format!("The error of {:.3} mm is joint_gain(elbow)", diagnosis.judged_mm);
        let sentence = diagnosis_sentence(&diagnosis);
        assert!(
            sentence.starts_with(&format!("{miss}: 0.0")) && sentence.ends_with("; add it."),
            "{sentence}"
        );
        assert!(sentence.contains(" +- "), "{sentence}");
        let mut lost = diagnosis.clone();
        if let Some(named) = &mut lost.named {
            named.effect.at = Some(571.6);
        }
        assert!(diagnosis_sentence(&lost).contains(" at 572 s: "), "{}", diagnosis_sentence(&lost));
        let dirty = Diagnosis { left_unexplained_mm: Some(0.1234), ..diagnosis };
        assert!(diagnosis_sentence(&dirty).ends_with("; add it. 0.123 mm of the rest is not explained yet."));
    }

    #[test]
    fn a_place_is_reported_with_what_comes_nearest_and_why_it_is_not_the_name() {
        let diagnosis = diagnosed(DECLARED, 22, |q| [0.0, 0.01 * q[1]]);
        let located = |rejected: Rejection, family: &[&str]| {
            let mut diagnosis = diagnosis.clone();
            diagnosis.verdict = Verdict::Located;
            let family = family.iter().map(|name| (*name).to_owned()).collect();
            diagnosis.located = Some(Located { site: "elbow".to_owned(), family });
            for candidate in diagnosis.candidates.iter_mut().take(1) {
                candidate.rejected = Some(rejected.clone());
            }
            diagnosis_sentence(&diagnosis)
        };
        let alone = located(Rejection::NotPredicted, &["joint_gain"]);
        assert!(alone.ends_with("sits in elbow, but too few poses to name it: joint_gain comes nearest, and does not yet predict rows it has not seen."), "{alone}");
        let doubted = located(Rejection::MoreThanNoiseLeft, &["joint_gain"]);
        assert!(
            doubted.ends_with("but joint_gain comes nearest and does not explain all of it."),
            "{doubted}"
        );
        let several_terms = located(Rejection::FlexibleTermsAt("elbow".to_owned()), &["joint_gain"]);
        assert!(
            several_terms.ends_with("but joint_gain, which comes nearest, is not named: several flexible terms (gain, waves, coupling) at elbow may together imitate something else."),
            "{several_terms}"
        );
        let mut both = diagnosis.clone();
        both.verdict = Verdict::Located;
        both.besides = vec!["joint_harmonic(elbow, 3)".to_owned()];
        let family = ["joint_gain", "joint_harmonic"].map(str::to_owned).to_vec();
        both.located = Some(Located { site: "elbow".to_owned(), family });
        both.candidates[0].rejected =
            Some(Rejection::IndistinguishableFrom(vec!["base_reset(base)".to_owned()]));
        let sentence = diagnosis_sentence(&both);
        assert!(
            sentence.ends_with(
                "but joint_gain, which comes nearest, is not named: indistinguishable from base_reset(base)."
            ),
            "what is at work besides is no rival: {sentence}"
        );
        both.besides.clear();
        assert!(diagnosis_sentence(&both).ends_with("cannot distinguish joint_gain and joint_harmonic."));
        assert!(located(Rejection::Outvoted, &[]).ends_with("but nothing in the library explains it."));
        let several = located(Rejection::Outvoted, &["joint_gain", "joint_zero"]);
        assert!(
            several.ends_with("but these data cannot distinguish joint_gain and joint_zero."),
            "{several}"
        );
        let free = Diagnosis {
            verdict: Verdict::Tied,
            tied: diagnosis.named.iter().map(|named| named.effect.clone()).collect(),
            free_first: Some("geometry(*)"),
            ..diagnosis.clone()
        };
        assert!(diagnosis_sentence(&free).ends_with("Free `geometry(*)` and ask again."));
    }

    #[test]
    fn a_tie_says_whether_its_effects_are_the_same_or_only_alike() {
        let diagnosis = diagnosed(DECLARED, 22, |q| [0.0, 0.01 * q[1]]);
        let named = diagnosis.named.iter().map(|named| named.effect.clone());
        let other = EffectSite {
            effect: "link_length".to_owned(),
            site: "shoulder".to_owned(),
            with: None,
            n: None,
            of: None,
            at: None,
        };
        let pose = NextPose {
            q_deg: vec![10.0, 80.0],
            approach: vec![0, 0],
            payload_kg: 0.0,
            on: None,
            predicted: serde_json::Map::new(),
        };
        let tied = Diagnosis {
            verdict: Verdict::Tied,
            tied: named.chain([other]).collect(),
            same: Vec::new(),
            alike: Vec::new(),
            next: vec![pose],
            next_separation: Some(3.1),
            ..diagnosis
        };
        assert_eq!(
            diagnosis_sentence(&tied),
            "joint_gain(elbow) and link_length(shoulder) cannot be distinguished with these data; measure the poses listed."
        );
        let no_better = Diagnosis { next_separation: Some(2.94), ..tied.clone() };
        assert_eq!(
            diagnosis_sentence(&no_better),
            "joint_gain(elbow) and link_length(shoulder) cannot be distinguished with these data. The poses listed would not do it either: what the effects predict there differs by 2.9 standard errors. `plumb model next` says what would."
        );
        let no_pose = diagnosis_sentence(&Diagnosis { next: Vec::new(), ..tied.clone() });
        assert!(no_pose.ends_with(" cannot be distinguished with these data."), "{no_pose}");
        let one = Alike {
            one: "joint_gain(elbow)".to_owned(),
            other: "link_length(shoulder)".to_owned(),
            correlation: 0.98765,
        };
        let alike = diagnosis_sentence(&Diagnosis { alike: vec![one], ..tied.clone() });
        assert!(alike.contains("data: beyond what is fitted joint_gain(elbow) and link_length(shoulder) move the readings of these poses alike (canonical correlation 0.988);"), "{alike}");
        let same = diagnosis_sentence(&Diagnosis { same: vec!["link_length(shoulder)".to_owned()], ..tied });
        assert!(same.ends_with("is joint_gain(elbow) or link_length(shoulder): the same in these data, where they move every reading alike; add either."), "{same}");
    }
}
