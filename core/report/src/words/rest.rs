//! What the rest is like, in words: what on record it goes with, and in what shape.

use super::few_poses::fraction_in_words;
use crate::phrase::{figure, listed};
use plumb_diagnosis::{CategoryMeans, Description, Remaining, ResidualShape, Rest, Trend, TwoPositions};

/// What the rest is like; empty where that was not asked.
pub fn rest_in_words(remaining: &Remaining) -> String {
    match &remaining.shape {
        None => String::new(),
        Some(Rest::Structure(description)) => description_in_words(description),
        Some(Rest::AfterAllEffects(description)) => {
            format!(
                "no further effect predicts rows that were left out; {}",
                description_in_words(description)
            )
        }
        Some(Rest::TwoPositions(positions)) => two_positions(positions),
        Some(Rest::PoseAlone(fraction)) => fraction_in_words(fraction),
    }
}

/// Hardware that is in two positions.
fn two_positions(positions: &[TwoPositions]) -> String {
    let each =
        positions.iter().map(|one| format!("about {} {} apart at {}", figure(one.apart), one.unit, one.site));
    let each: Vec<String> = each.collect();
    format!(
        "returns to one pose fall into two groups {}, for no reason the table records",
        listed(&each, "and")
    )
}

fn description_in_words(description: &Description) -> String {
    match description {
        Description::Trend(trend) => trend_in_words(trend),
        Description::Categories(means) => categories_in_words(means),
        Description::Unrelated(conditions) => format!(
            "no single joint, moment or condition on record correlates with it ({}); return to some poses from either side, after waiting, and under load",
            listed(conditions, "and")
        ),
    }
}

/// A value of the covariate with its unit.
fn at(trend: &Trend, value: f64) -> String {
    let shown = if trend.in_degrees { value.to_degrees() } else { value };
    format!("{} {}", figure(shown), trend.unit).trim_end().to_owned()
}

fn trend_in_words(trend: &Trend) -> String {
    let (along, name, unit) = (&trend.along, &trend.against, trend.of_residual);
    match trend.shape {
        ResidualShape::Periodic { order, amplitude } => {
            format!("{along} it swings {order} times a turn of {name}, by {} {unit}", figure(amplitude))
        }
        ResidualShape::Levels { difference, first, last } => format!(
            "{along} it differs by {} {unit} between {name} {} and {}",
            figure(difference),
            at(trend, first),
            at(trend, last)
        ),
        ResidualShape::Step { height, at: position } => {
            format!("{along} it jumps by {} {unit} at {name} {}", figure(height), at(trend, position))
        }
        ResidualShape::Linear { rise, from, to } => format!(
            "{along} it changes steadily with {name}, by {} {unit} from {} to {}",
            figure(rise),
            at(trend, from),
            at(trend, to)
        ),
        ResidualShape::Curved { lowest, highest } => format!(
            "{along} it bends with {name}: {} {unit} near {} and {} {unit} near {}",
            figure(lowest.0),
            at(trend, lowest.1),
            figure(highest.0),
            at(trend, highest.1)
        ),
    }
}

/// The two categories that differ most, in the table's order, and by how much.
fn extremes(means: &[(String, f64)]) -> Option<(&str, &str, f64)> {
    let each = means.iter().enumerate();
    let (lowest, (_, least)) = each.clone().min_by(|left, right| left.1.1.total_cmp(&right.1.1))?;
    let (highest, (_, most)) = each.max_by(|left, right| left.1.1.total_cmp(&right.1.1))?;
    let first = means.get(lowest.min(highest))?;
    let last = means.get(lowest.max(highest))?;
    Some((&first.0, &last.0, most - least))
}

fn categories_in_words(means: &CategoryMeans) -> String {
    let Some((first, last, difference)) = extremes(&means.means) else { return String::new() };
    let (along, name, unit) = (&means.along, &means.against, means.of_residual);
    let mut text =
        format!("{along} it differs by {} {unit} between {name} {first} and {last}", figure(difference));
    if means.means.len() > 2 {
        let all: Vec<String> = means
            .means
            .iter()
            .map(|(category, mean)| format!("{category} {} {unit}", figure(*mean)))
            .collect();
        text.push_str(&format!(" (on average {})", all.join(", ")));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use plumb_calibration::measurement::ReadingUnit;

    #[test]
    fn angles_are_shown_in_degrees_and_a_missing_unit_leaves_no_blank() {
        let shape = ResidualShape::Step { height: 0.25, at: std::f64::consts::FRAC_PI_2 };
        let mut trend = Trend {
            along: "along x".to_owned(),
            against: "lift".to_owned(),
            unit: "deg",
            of_residual: ReadingUnit::Mm,
            in_degrees: true,
            shape,
        };
        assert_eq!(trend_in_words(&trend), "along x it jumps by 0.2500 mm at lift 90.00 deg");
        (trend.unit, trend.in_degrees) = ("", false);
        assert_eq!(trend_in_words(&trend), "along x it jumps by 0.2500 mm at lift 1.57");
    }

    fn of_fixtures(means: &[(&str, f64)]) -> String {
        let means = means.iter().map(|(category, mean)| ((*category).to_owned(), *mean)).collect();
        let means = CategoryMeans {
            along: "along x".to_owned(),
            against: "fixture".to_owned(),
            of_residual: ReadingUnit::Mm,
            means,
        };
        categories_in_words(&means)
    }

    #[test]
    fn two_categories_are_compared_by_name() {
        assert_eq!(
            of_fixtures(&[("left", 0.0), ("right", 0.6)]),
            "along x it differs by 0.6000 mm between fixture left and right"
        );
    }

    #[test]
    fn of_three_categories_all_are_given_and_the_two_that_differ_most_in_the_tables_order() {
        assert_eq!(
            of_fixtures(&[("left", 0.0), ("right", 0.6), ("rear", -0.6)]),
            "along x it differs by 1.20 mm between fixture right and rear (on average left 0.0000 mm, right 0.6000 mm, rear -0.6000 mm)"
        );
    }

    #[test]
    fn what_is_in_two_positions_is_reported_with_its_distance_and_unit() {
        let one = |site: &str, apart: f64, unit| TwoPositions { site: site.to_owned(), apart, unit };
        let shape = Some(Rest::TwoPositions(vec![one("pan", 0.572_958, "deg"), one("lift", 0.25, "mm")]));
        let sentence = rest_in_words(&Remaining { shape, ..Remaining::default() });
        assert!(
            sentence.contains("about 0.5730 deg apart at pan and about 0.2500 mm apart at lift"),
            "{sentence}"
        );
        assert_eq!(rest_in_words(&Remaining::default()), "");
    }

    #[test]
    fn after_all_effects_it_is_said_that_no_further_one_predicts() {
        let conditions = vec!["time".to_owned(), "load".to_owned()];
        let remaining = |shape| Remaining { shape: Some(shape), ..Remaining::default() };
        let sentence = rest_in_words(&remaining(Rest::AfterAllEffects(Description::Unrelated(conditions))));
        assert!(
            sentence.starts_with("no further effect predicts rows that were left out; no single joint"),
            "{sentence}"
        );
        assert!(sentence.contains("(time and load)"), "{sentence}");
    }
}
