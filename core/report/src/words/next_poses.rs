//! What is said of poses to measure next.

use crate::phrase::{figure, listed};
use plumb_diagnosis::{Asked, Instead, NextPoses, OtherWay};

/// What the poses do, what would do instead, and what they leave open.
pub fn next_poses_sentence(poses: &NextPoses) -> String {
    match &poses.asked {
        Asked::Rivals { named, alike } => of_rivals(poses, *named, alike),
        Asked::NotShown { shown, size } => of_what_is_not_shown(poses, shown, *size),
    }
}

/// What does what poses within reach do not.
pub fn instead_in_words(instead: &Instead) -> String {
    match instead {
        Instead::Way { way, separation, poses } => format!(
            "{} would distinguish them ({separation:.0} standard errors in {poses} poses)",
            way_in_words(*way)
        ),
        Instead::Same => "neither a load nor a second point nor whole positions would: for this arm they are the same thing, so either will do"
            .to_owned(),
        Instead::BelowNoise => "neither a load nor a second point nor whole positions would: they differ by less than these readings show, so either will do"
            .to_owned(),
        Instead::NotShownEither { hidden, how_to_see } => {
            format!("they would not show {}; what would: {}", listed(hidden, "or"), uncapitalized(how_to_see))
        }
    }
}

fn way_in_words(way: OtherWay) -> String {
    match way {
        OtherWay::Load(load) => format!("a load of {load:.0} kg"),
        OtherWay::WholePositions => "an instrument that measures whole positions of p1".to_owned(),
        OtherWay::SecondPoint => "a second point on the hand, well off its axis,".to_owned(),
    }
}

/// Of poses that distinguish effects, `alike` the pairs that they do not.
fn of_rivals(poses: &NextPoses, named: bool, alike: &[(String, String)]) -> String {
    let (labels, count, separation) = (&poses.between, poses.new, poses.separation);
    let all = listed(labels, "and");
    match (labels.len(), &poses.instead) {
        (1, _) => {
            format!("Measure these {count} poses, and return to the first two: there the model knows least.")
        }
        (_, Some(instead)) => format!(
            "No pose within reach distinguishes {all} ({separation:.1} standard errors in {count} poses); {}.",
            instead_in_words(instead)
        ),
        (rivals, None) => {
            let least = if rivals > 2 { "at least " } else { "" };
            let proof = if named { ", which proves the name or corrects it" } else { "" };
            let pairs: Vec<String> = alike.iter().map(|(one, other)| format!("{one} from {other}")).collect();
            let rest = match pairs.as_slice() {
                [] => String::new(),
                pairs => format!(" They do not distinguish {}.", listed(pairs, "nor")),
            };
            format!(
                "Measure these {count} poses, and return to the first two: they put {all} {least}{separation:.0} standard errors apart{proof}.{rest}"
            )
        }
    }
}

/// Of poses that show what the rows do not, at `size` times the noise.
fn of_what_is_not_shown(poses: &NextPoses, shown: &[String], size: f64) -> String {
    let sentence = match shown {
        [] => "No pose within reach would show what these rows do not".to_owned(),
        shown => format!(
            "Measure these {} poses, and return to the first two: they would show {}, if there (at {size} times the noise by at least {} standard errors)",
            poses.new,
            listed(shown, "and"),
            figure(poses.separation)
        ),
    };
    match &poses.instead {
        Some(instead) => format!("{sentence}; {}", instead_in_words(instead)),
        None => format!("{sentence}."),
    }
}

fn uncapitalized(sentence: &str) -> String {
    let mut letters = sentence.chars();
    letters.next().map_or_else(String::new, |first| first.to_lowercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn poses(labels: &[&str], asked: Asked, instead: Option<Instead>) -> NextPoses {
        let between = labels.iter().map(|label| (*label).to_owned()).collect();
        NextPoses { next: Vec::new(), between, separation: 4.4, new: 5, asked, instead }
    }

    fn rivals(named: bool, alike: &[(&str, &str)]) -> Asked {
        let alike = alike.iter().map(|(one, other)| ((*one).to_owned(), (*other).to_owned())).collect();
        Asked::Rivals { named, alike }
    }

    #[test]
    fn the_sentence_says_which_pairs_the_poses_do_not_distinguish() {
        let tied = poses(&["a", "b", "c"], rivals(false, &[("a", "c")]), None);
        assert_eq!(
            next_poses_sentence(&tied),
            "Measure these 5 poses, and return to the first two: they put a, b and c at least 4 standard errors apart. They do not distinguish a from c."
        );
        let named = next_poses_sentence(&poses(&["a", "b"], rivals(true, &[]), None));
        assert!(named.ends_with("4 standard errors apart, which proves the name or corrects it."), "{named}");
        let alone = next_poses_sentence(&poses(&["a"], rivals(false, &[]), None));
        assert!(alone.contains("there the model knows least"), "{alone}");
    }

    #[test]
    fn where_poses_do_not_do_the_other_way_is_said_or_that_there_is_none() {
        let way = |way| Instead::Way { way, separation: 12.3, poses: 4 };
        let message = |instead| next_poses_sentence(&poses(&["a", "b"], rivals(false, &[]), Some(instead)));
        assert_eq!(
            message(way(OtherWay::Load(3.0))),
            "No pose within reach distinguishes a and b (4.4 standard errors in 5 poses); a load of 3 kg would distinguish them (12 standard errors in 4 poses)."
        );
        assert!(message(way(OtherWay::WholePositions)).contains("whole positions of p1 would distinguish"));
        assert!(message(way(OtherWay::SecondPoint)).contains("well off its axis, would distinguish"));
        assert!(message(Instead::Same).contains("they are the same thing"));
        assert!(message(Instead::BelowNoise).contains("less than these readings show"));
    }

    #[test]
    fn of_what_the_rows_do_not_show_it_is_said_what_poses_show_and_how_the_rest_is_seen() {
        let shown = |shown: &[&str]| Asked::NotShown {
            shown: shown.iter().map(|one| (*one).to_owned()).collect(),
            size: 2.0,
        };
        let hidden = Instead::NotShownEither {
            hidden: vec!["d".to_owned(), "e".to_owned()],
            how_to_see: "Measure under load.",
        };
        let one = next_poses_sentence(&poses(&["a"], shown(&["a", "b"]), None));
        assert_eq!(
            one,
            "Measure these 5 poses, and return to the first two: they would show a and b, if there (at 2 times the noise by at least 4.40 standard errors)."
        );
        assert_eq!(
            next_poses_sentence(&poses(&["a"], shown(&[]), Some(hidden))),
            "No pose within reach would show what these rows do not; they would not show d or e; what would: measure under load."
        );
    }
}
