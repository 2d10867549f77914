//! One plain sentence.

pub(crate) use super::phrase::{figure, listed, size_text};

use super::outcome::{Diagnosis, EffectPlace, Located, Named, NotShown, Verdict};

/// Why a candidate that passes everything else is not named; the names of the others follow.
pub(super) const AS_WELL: &str = "indistinguishable from";

/// Why a candidate that explains these rows is not named: there are too few of them.
pub(super) const NOT_PREDICTED: &str = "it does not predict rows it has not seen";

/// What a correction may stand for besides the effects of the library.
pub(super) const NOT_LISTED: &str = "a mechanism that is not listed";

/// How the noise of light stripes is called among the readings of a table.
const STRIPES: &str = "stripe_mm";

/// The sentence of a diagnosis.
pub(super) fn sentence(diagnosis: &Diagnosis) -> String {
    let floor = diagnosis
        .floor
        .sigma_mm
        .map_or_else(|| "an unknown noise".to_owned(), |sigma| format!("the noise of {sigma:.3} mm an axis"));
    let miss = diagnosis.rms_mm.fit;
    let told = match diagnosis.verdict {
        Verdict::Named => diagnosis.named.as_ref().map_or_else(String::new, |named| name(diagnosis, named)),
        Verdict::Located => diagnosis.located.as_ref().map_or_else(String::new, |located| {
            let free = diagnosis.free_first.map_or_else(String::new, |group| {
                format!(" Errors of the arm's geometry that the model does not free explain it as well: free `{group}` and ask again.")
            });
            let why = why_not_named(diagnosis, located);
            format!("The error of {miss:.3} mm sits in {}, but {why}.{free}", located.place)
        }),
        Verdict::Tied => tie(diagnosis),
        Verdict::AtFloor => at_floor(diagnosis, &floor),
        Verdict::Unknown => format!(
            "{miss:.3} mm is left over {floor}, and nothing in the library explains it: {}.",
            diagnosis.remaining.shape
        ),
        Verdict::Blind => format!("These poses could not show most effects: {}.", diagnosis.remaining.shape),
        Verdict::NotRepeatable => {
            format!("The arm does not come back to where it was: {}.", diagnosis.remaining.shape)
        }
        Verdict::FloorUnknown => format!(
            "Nothing can be named, and nobody knows how large the noise is: {miss:.3} mm may be all noise; return to some poses."
        ),
    };
    match diagnosis.left_unexplained_mm {
        Some(left) => format!("{told} {left:.3} mm of the rest is not explained yet."),
        None => told,
    }
}

/// One effect is named.
fn name(diagnosis: &Diagnosis, named: &Named) -> String {
    let miss = diagnosis.rms_mm.fit;
    let label = label_of(diagnosis, &named.effect);
    let size = size_text(named.size, named.se, &named.unit);
    match named.effect.at {
        Some(at) => format!(
            "The error of {miss:.3} mm is {label} at {at:.0} s: {size}. No number of the model cures lost steps: find the zeros anew, and drive \
             more slowly where they were lost; add it to see what else there is."
        ),
        None => format!("The error of {miss:.3} mm is {label}: {size}; add it."),
    }
}

/// Why nothing is named at a known place.
fn why_not_named(diagnosis: &Diagnosis, located: &Located) -> String {
    match located.family.as_slice() {
        [] => "nothing in the library explains it".to_owned(),
        [one] => match tied_at(diagnosis, one, &located.place).as_slice() {
            [] | [_] if is_borne_out_too_little(diagnosis, one, &located.place) => {
                format!(
                    "too few poses to name it: {one} comes nearest, and does not yet predict rows it has not seen"
                )
            }
            [] | [_] => format!("{one} comes nearest and does not explain all of it"),
            several => format!("these data cannot tell {} apart", listed(several, "and")),
        },
        several => format!("these data cannot tell {} apart", listed(several, "and")),
    }
}

/// Several effects at several places do as well.
fn tie(diagnosis: &Diagnosis) -> String {
    let labels: Vec<String> = diagnosis.tied.iter().take(4).map(|tie| label_of(diagnosis, tie)).collect();
    if let Some(group) = diagnosis.free_first {
        return format!(
            "The error of {:.3} mm may be {}, or errors of the arm's geometry that the model does not free: they explain it as well. Free `{group}` and ask again.",
            diagnosis.rms_mm.fit,
            listed(&labels, "or")
        );
    }
    let mut others = diagnosis.tied.iter().skip(1).map(|tie| label_of(diagnosis, tie));
    if !diagnosis.same.is_empty() && others.all(|label| diagnosis.same.contains(&label)) {
        return format!(
            "The error of {:.3} mm is {}: the same in these data, where they move every reading alike; add either.",
            diagnosis.rms_mm.fit,
            listed(&labels, "or")
        );
    }
    format!(
        "{} cannot be told apart with these data{}; measure the poses listed.",
        listed(&labels, "and"),
        diagnosis.alike.first().map_or_else(String::new, |alike| format!(": {alike}"))
    )
}

/// Whether what comes nearest at a place is not named because it does not predict rows it has not seen.
fn is_borne_out_too_little(diagnosis: &Diagnosis, effect: &str, place: &str) -> bool {
    let mut there =
        diagnosis.candidates.iter().filter(|one| one.effect.effect == effect && one.effect.place == place);
    there.next().is_some_and(|best| best.rejected.as_deref() == Some(NOT_PREDICTED))
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
    let mut places: Vec<String> = Vec::new();
    for one in of_kind {
        if !places.contains(&one.effect.place) {
            places.push(one.effect.place.clone());
        }
    }
    let most = of_kind.iter().map(|one| one.up_to_mm).reduce(|most, one| Some(most?.max(one?))).flatten();
    let size = most.map_or_else(|| "of any size".to_owned(), |most| format!("up to {most:.1} mm"));
    format!("{name}({}) {size}", places.join(", "))
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
fn tied_at(diagnosis: &Diagnosis, effect: &str, place: &str) -> Vec<String> {
    let tied = diagnosis.candidates.iter().filter(|candidate| {
        candidate.effect.effect == effect
            && candidate.effect.place == place
            && candidate.rejected.as_deref().is_some_and(|reason| reason.starts_with(AS_WELL))
    });
    tied.map(|candidate| candidate.label.clone()).collect()
}

/// An effect as it is written, with the order of a wave and whatever else is part of its name.
fn label_of(diagnosis: &Diagnosis, effect: &EffectPlace) -> String {
    let candidate = diagnosis.candidates.iter().find(|candidate| candidate.effect == *effect);
    candidate.map_or_else(|| format!("{}({})", effect.effect, effect.place), |known| known.label.clone())
}
