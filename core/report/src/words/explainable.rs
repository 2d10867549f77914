//! What is said of how much could be explained.

use crate::phrase::listed;
use plumb_diagnosis::Explainable;

/// How much could be explained, and by what kind of knowledge of a row.
pub fn explainable_sentence(explainable: &Explainable) -> String {
    let unit = explainable.unit;
    if !explainable.is_structured() {
        let asked: Vec<String> = explainable.groups.iter().map(|group| group.group.clone()).collect();
        return format!(
            "left after what is fitted {:.3} {unit}; nothing of it is predictable from {} (0.000 +- {:.3} {unit})",
            explainable.left_mm,
            listed(&asked, "or"),
            explainable.scatter_mm
        );
    }
    let steps = explainable.groups.iter().filter(|group| group.explains).enumerate().map(|(index, group)| {
        let plus = if index > 0 { "+ " } else { "" };
        format!("{plus}{} {:.3}", group.group, group.left_mm)
    });
    let silent = explainable.groups.iter().filter(|group| !group.explains);
    let silent: Vec<String> = silent.map(|group| group.group.clone()).collect();
    let silent = match silent.is_empty() {
        true => String::new(),
        false => format!(" (nothing more from {})", listed(&silent, "or")),
    };
    format!(
        "left after what is fitted {:.3} {unit}; predictable from {}{silent} -> {:.3} +- {:.3} {unit} of structure is still to be named, {:.3} {unit} is not predictable",
        explainable.left_mm,
        steps.collect::<Vec<_>>().join(", "),
        explainable.to_name_mm,
        explainable.scatter_mm,
        explainable.not_predictable_mm
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use plumb_calibration::measurement::ReadingUnit;
    use plumb_diagnosis::ExplainableGroup;

    fn group(name: &str, explains: bool, left_mm: f64) -> ExplainableGroup {
        ExplainableGroup {
            group: name.to_owned(),
            explains,
            left_mm,
            beyond_others_mm: 0.0,
            scatter_mm: 0.01,
        }
    }

    fn explainable(groups: Vec<ExplainableGroup>) -> Explainable {
        let not_predictable_mm = groups.last().map_or(0.617, |group| group.left_mm);
        Explainable {
            unit: ReadingUnit::Mm,
            left_mm: 0.617,
            not_predictable_mm,
            to_name_mm: 0.617 - not_predictable_mm,
            scatter_mm: 0.02,
            groups,
            blocked: None,
            rows: 100,
            points: 100,
        }
    }

    #[test]
    fn the_sentence_says_what_each_group_leaves_and_what_is_left_at_last() {
        let found = explainable(vec![
            group("pose", true, 0.40),
            group("last move", true, 0.35),
            group("time", false, 0.35),
        ]);
        assert_eq!(
            explainable_sentence(&found),
            "left after what is fitted 0.617 mm; predictable from pose 0.400, + last move 0.350 (nothing more from time) -> 0.267 +- 0.020 mm of structure is \
             still to be named, 0.350 mm is not predictable"
        );
    }

    #[test]
    fn where_nothing_is_predictable_it_says_so_with_its_scatter() {
        let found = explainable(vec![group("pose", false, 0.617), group("order", false, 0.617)]);
        assert!(!found.is_structured());
        assert_eq!(
            explainable_sentence(&found),
            "left after what is fitted 0.617 mm; nothing of it is predictable from pose or order (0.000 +- 0.020 mm)"
        );
    }
}
