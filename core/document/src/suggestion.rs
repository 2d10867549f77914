//! "Did you mean".

/// A sentence that names the one of `known` nearest to `typed`, or, when none is near, all of them.
pub fn did_you_mean<'a>(typed: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let known: Vec<&str> = known.into_iter().collect();
    match nearest(typed, &known) {
        Some(near) => format!("did you mean `{near}`?"),
        None => one_of(known),
    }
}

/// A sentence that names what is known.
pub fn one_of<'a>(known: impl IntoIterator<Item = &'a str>) -> String {
    let quoted: Vec<String> = known.into_iter().map(|name| format!("`{name}`")).collect();
    match quoted.as_slice() {
        [] => "there are none here".to_owned(),
        [only] => format!("there is only {only}"),
        many => format!("there are {}", many.join(", ")),
    }
}

/// The one of `known` that a slip of the hand could have turned into `typed`.
#[must_use]
pub fn nearest<'a>(typed: &str, known: &[&'a str]) -> Option<&'a str> {
    if let Some(longer) =
        known.iter().find(|name| name.strip_prefix(typed).is_some_and(|rest| rest.starts_with('_')))
    {
        return Some(longer);
    }
    slip_of(typed, known).or_else(|| whole_word_of(typed, known))
}

/// The one of `known` that is spelled nearest to `typed`, where no more than a third of it differs.
fn slip_of<'a>(typed: &str, known: &[&'a str]) -> Option<&'a str> {
    known
        .iter()
        .map(|name| (strsim::damerau_levenshtein(&typed.to_lowercase(), &name.to_lowercase()), *name))
        .filter(|(distance, name)| *distance <= (name.chars().count().max(typed.chars().count()) / 3).max(1))
        .min()
        .map(|(_, name)| name)
}

/// The shortest of `known` of which `typed` is one or several whole words, as `backlash` of `joint_backlash`; none where two are as short.
fn whole_word_of<'a>(typed: &str, known: &[&'a str]) -> Option<&'a str> {
    let inside = format!("_{}_", typed.to_lowercase());
    let holds = |name: &&&'a str| typed.len() > 2 && format!("_{}_", name.to_lowercase()).contains(&inside);
    let words = |name: &str| name.split('_').count();
    let fewest = known.iter().filter(holds).map(|name| words(name)).min()?;
    let mut shortest = known.iter().filter(holds).filter(|name| words(name) == fewest);
    shortest.next().filter(|_| shortest.next().is_none()).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_is_put_right_and_a_stranger_gets_the_whole_list() {
        assert_eq!(did_you_mean("shuolder", ["waist", "shoulder"]), "did you mean `shoulder`?");
        assert_eq!(did_you_mean("zebra", ["waist", "shoulder"]), "there are `waist`, `shoulder`");
        assert_eq!(did_you_mean("zebra", []), "there are none here");
    }

    #[test]
    fn a_word_of_one_name_alone_is_taken_for_it() {
        let effects = ["joint_zero", "joint_backlash", "base_tilt", "instrument_tilt", "joint_zero_reset"];
        assert_eq!(nearest("backlash", &effects), Some("joint_backlash"));
        assert_eq!(nearest("zero", &effects), Some("joint_zero"), "the shorter of two");
        assert_eq!(nearest("tilt", &effects), None, "two are meant as well");
        assert_eq!(nearest("lash", &effects), None, "no whole word");
    }
}
