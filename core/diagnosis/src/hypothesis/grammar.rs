//! Which forms are tried: at every joint and at the base, sums and products of what the table logs.

use std::sync::Arc;

use super::forms::{Angle, Candidate, Factor, Form, FormSite, Shape};
use crate::laboratory::Laboratory;
use crate::score_test::Probe;
use plumb_calibration::effect::{EffectId, Search, Site};

/// Where in the range of an angle a step, or the beginning of a slope, is tried: fractions of the range.
const KINKS: [f64; 7] = [0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875];

/// Where a slope is tried that begins either way of zero: fractions of the farthest the angle reaches.
const EITHER_WAY: [f64; 4] = [0.15, 0.3, 0.45, 0.6];

/// Where a turn is parted into halves: fractions of half a turn, for the other half only changes the sign.
const HALVES: [f64; 8] = [0.0, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875];

/// Standard deviations of bumps: fractions of the range. Narrower ones few poses would meet, wider ones are waves.
const BUMPS: [f64; 2] = [0.07, 0.15];

/// Orders of waves in one joint's coordinate. Higher ones are the library's `joint_harmonic`.
const ORDERS: [u32; 2] = [1, 2];

/// Numbers of a formula are written with so many digits after the point: rad, mm, deg C.
const DIGITS: f64 = 1e3;

fn rounded(value: f64) -> f64 {
    (value * DIGITS).round() / DIGITS
}

/// All forms that a table could show, one probe each; those that differ in a searched number share a family.
pub(super) fn probes(lab: &Laboratory) -> Vec<(Form, Probe)> {
    let mut found = Vec::new();
    let mut family = 0;
    for site in sites(lab) {
        for factor in factors(lab, site) {
            for variants in shapes(lab, site, factor) {
                family += 1;
                for shape in variants.into_iter().filter(|shape| is_new(site, factor, *shape)) {
                    let form = Form { site, factor, shape };
                    found.push((form, probe(form, family)));
                }
            }
        }
    }
    found
}

fn probe(form: Form, family: usize) -> Probe {
    let site = site_of(form.site);
    Probe {
        id: EffectId::at("hypothesis", site),
        effect: Arc::new(Candidate::new(form)),
        search: if form.shape.is_searched() { Search::Smooth } else { Search::Nothing },
        family,
        weight: 1.0,
        search_cost: 0.0,
    }
}

/// Where a form acts.
pub(super) fn site_of(site: FormSite) -> Site {
    match site {
        FormSite::Joint { joint, .. } => Site::Joint(joint),
        FormSite::Base => Site::Base,
    }
}

fn sites(lab: &Laboratory) -> Vec<FormSite> {
    let joints = 0..lab.model().chain.len();
    let joints = joints.map(|joint| FormSite::Joint { joint, slides: !lab.context().turns(joint) });
    joints.chain([FormSite::Base]).collect()
}

/// A shift of a joint's zero is free, or a candidate of the library: a form must say more than that.
fn is_new(site: FormSite, factor: Factor, shape: Shape) -> bool {
    let constant = factor == Factor::One && shape == Shape::One;
    let base_alone = site == FormSite::Base && factor == Factor::One && !matches!(shape, Shape::Half(..));
    !(constant || base_alone)
}

/// What is known of the rows and varies.
fn factors(lab: &Laboratory, site: FormSite) -> Vec<Factor> {
    let summary = lab.summary();
    let mut factors = vec![Factor::One];
    if summary.time_span.is_some_and(|span| span > 0.0) {
        factors.push(Factor::Hours);
    }
    if summary.temperature_range.is_some_and(|range| range > 0.0) {
        factors.push(Factor::Temperature(middle(lab.table().temperature.as_deref().unwrap_or(&[]))));
    }
    if summary.payload_range.is_some_and(|range| range > 0.0) {
        factors.push(Factor::Payload);
    }
    let joints = lab.model().chain.len();
    let near: Vec<usize> = match site {
        FormSite::Joint { joint, .. } => {
            // A bearing or a gear feels the moment about its own axis and its neighbours'; those farther off would only multiply what is tried.
            (joint.saturating_sub(1)..=joint + 1).filter(|one| *one < joints).collect()
        }
        FormSite::Base => (0..joints.min(3)).collect(),
    };
    if lab.context().has_weight() {
        for joint in &near {
            // Of a joint whose axis is upright gravity turns nothing.
            if summary.greatest_moments.get(*joint).is_none_or(|most| *most <= 0.0) {
                continue;
            }
            factors.extend([Factor::Moment(*joint), Factor::Load(*joint), Factor::Pull(*joint)]);
        }
    }
    if let FormSite::Joint { joint, .. } = site {
        if summary.has_both_sides(joint) {
            factors.push(Factor::Side(joint));
        }
        if summary.time_span.is_some() {
            factors.push(Factor::Move(joint));
        }
    }
    factors
}

/// Mean of what was logged, rounded to a tenth.
fn middle(values: &[f64]) -> f64 {
    let finite: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    let mean = finite.iter().sum::<f64>() / finite.len().max(1) as f64;
    // The user reads it in the formula; the constant that rounding leaves over goes with the zeros.
    (mean * 10.0).round() / 10.0
}

/// Functions of the pose that a factor is multiplied with; those that differ in a searched number together.
fn shapes(lab: &Laboratory, site: FormSite, factor: Factor) -> Vec<Vec<Shape>> {
    let mut shapes = vec![vec![Shape::One]];
    let context = lab.context();
    let all = 0..lab.model().chain.len();
    for joint in all.clone() {
        // A line in each joint first: what a wave or a kink explains as well is the simpler thing.
        let angle = Angle::of(joint);
        shapes.push(vec![Shape::Linear(angle)]);
        if context.turns(joint) {
            shapes.extend(ORDERS.map(|order| vec![Shape::Wave(angle, order)]));
            shapes.push(
                HALVES.map(|fraction| Shape::Half(angle, rounded(fraction * std::f64::consts::PI))).to_vec(),
            );
        }
        shapes.extend(kinked(lab, angle));
    }
    // Of two joints the products of waves are waves of their sum and of their difference; what both pull at, such as a cable, goes by the sum.
    let FormSite::Joint { joint, .. } = site else { return shapes };
    for other in all.filter(|other| *other != joint && context.turns(*other) && context.turns(joint)) {
        for minus in [false, true] {
            let angle = Angle { first: joint, second: Some((other, minus)) };
            shapes.push(vec![Shape::Wave(angle, 1)]);
            if factor == Factor::One && joint.abs_diff(other) == 1 {
                shapes.extend(kinked(lab, angle));
            }
        }
    }
    shapes
}

/// Steps and slopes in an angle.
fn kinked(lab: &Laboratory, angle: Angle) -> Vec<Vec<Shape>> {
    let (low, high) = reach(lab, angle);
    if high - low < 1.0 / DIGITS {
        return Vec::new();
    }
    let positions = KINKS.map(|fraction| rounded(low + fraction * (high - low)));
    let mut shapes = vec![
        positions.map(|at| Shape::Above(angle, at)).to_vec(),
        positions.map(|at| Shape::Below(angle, at)).to_vec(),
        positions.map(|at| Shape::Step(angle, at)).to_vec(),
    ];
    // A bump in a sum of two angles is a line of poses that nothing mechanical singles out.
    if angle.second.is_none() {
        let wide = BUMPS.map(|wide| rounded(wide * (high - low)));
        shapes.push(positions.iter().flat_map(|at| wide.map(|wide| Shape::Bump(angle, *at, wide))).collect());
    }
    if low < 0.0 && high > 0.0 {
        let far = low.abs().max(high);
        shapes
            .push(EITHER_WAY.iter().map(|fraction| Shape::Beyond(angle, rounded(fraction * far))).collect());
    }
    shapes
}

/// Least and greatest value of an angle that the poses can have, each joint for itself.
fn reach(lab: &Laboratory, angle: Angle) -> (f64, f64) {
    let ranges = &lab.summary().ranges;
    let own = ranges.get(angle.first).copied().unwrap_or_default();
    let other = angle.second.map_or((0.0, 0.0), |(joint, minus)| {
        let (low, high) = ranges.get(joint).copied().unwrap_or_default();
        // What is taken away turns its range round.
        if minus { (-high, -low) } else { (low, high) }
    });
    (own.0 + other.0, own.1 + other.1)
}

/// Steps on either side of a searched number at which it is tried again, to a tenth of the first search's spacing.
const FINER: i32 = 9;

/// Numbers about a searched one, within the spacing of the first search.
fn about(lab: &Laboratory, angle: Angle, at: f64) -> impl Iterator<Item = f64> {
    let (low, high) = reach(lab, angle);
    let step = KINKS.first().copied().unwrap_or(0.1) * (high - low) / f64::from(FINER + 1);
    (-FINER..=FINER).map(move |steps| rounded(at + f64::from(steps) * step))
}

/// The same form with its searched number about where it is, within the first search's spacing.
pub(super) fn finer(lab: &Laboratory, form: &Form) -> Vec<(Form, Probe)> {
    let shapes: Vec<Shape> = match form.shape {
        Shape::One | Shape::Linear(_) | Shape::Wave(..) => vec![form.shape],
        Shape::Above(angle, at) => about(lab, angle, at).map(|at| Shape::Above(angle, at)).collect(),
        Shape::Below(angle, at) => about(lab, angle, at).map(|at| Shape::Below(angle, at)).collect(),
        Shape::Step(angle, at) => about(lab, angle, at).map(|at| Shape::Step(angle, at)).collect(),
        Shape::Half(angle, at) => {
            let step = HALVES[1] * std::f64::consts::PI / f64::from(FINER + 1);
            (-FINER..=FINER).map(|steps| Shape::Half(angle, rounded(at + f64::from(steps) * step))).collect()
        }
        Shape::Beyond(angle, at) => {
            // From zero on it would be a slope that begins nowhere.
            about(lab, angle, at).filter(|at| *at > 0.0).map(|at| Shape::Beyond(angle, at)).collect()
        }
        Shape::Bump(angle, at, wide) => {
            // A root of two narrower and wider: half of the step from one width that was tried to the next.
            let widths = [0.7, 1.0, 1.4].map(|times| rounded(times * wide));
            about(lab, angle, at).flat_map(|at| widths.map(|wide| Shape::Bump(angle, at, wide))).collect()
        }
    };
    shapes.into_iter().map(|shape| Form { shape, ..*form }).map(|form| (form, probe(form, 0))).collect()
}

#[cfg(test)]
mod tests {
    use plumb_calibration::arm_model::Model;
    use plumb_calibration::table::Table;

    use super::*;
    use crate::laboratory::Options;

    #[test]
    fn the_middle_of_what_was_logged_is_its_mean_to_a_tenth() {
        assert_eq!(middle(&[21.96, f64::NAN, 22.5, -1.0]), 14.5, "14.487");
        assert_eq!((middle(&[-21.96]), middle(&[f64::NAN]), middle(&[])), (-22.0, 0.0, 0.0));
    }

    fn laboratory(model: &str, table: &str) -> Laboratory {
        let model = Model::parse("model.yaml", model).unwrap();
        Laboratory::new(model, Table::parse("t.csv", table).unwrap(), Options::default()).unwrap()
    }

    /// Three joints that turn, whose table logs what is given, a line a row.
    fn logged(columns: &str, rows: [&str; 4]) -> Laboratory {
        let model = format!("{}targets: {{p1: {{}}}}\n", crate::testing::THREE_JOINTS);
        let header = if columns.is_empty() { String::new() } else { format!("{columns},") };
        let rows = rows.iter().enumerate().map(|(row, cells)| {
            let cells = if cells.is_empty() { String::new() } else { format!("{cells},") };
            format!("{cells}{},{},{},1,2,3\n", 10 * row, 7 * row * row, 40 - 9 * row)
        });
        let rows: String = rows.collect();
        let text = format!("{header}q1_deg,q2_deg,q3_deg,p1_x_mm,p1_y_mm,p1_z_mm\n{rows}");
        laboratory(&model, &text)
    }

    fn joint(joint: usize) -> FormSite {
        FormSite::Joint { joint, slides: false }
    }

    #[test]
    fn forms_act_at_every_joint_and_at_the_base() {
        let lab = logged("", [""; 4]);
        assert_eq!(sites(&lab), [joint(0), joint(1), joint(2), FormSite::Base]);
        assert_eq!((site_of(joint(2)), site_of(FormSite::Base)), (Site::Joint(2), Site::Base));
    }

    #[test]
    fn a_factor_is_what_was_logged_and_varies() {
        let columns = "time_s,temperature_c,payload_kg";
        let varying = logged(columns, ["0,20,1", "60,21,1", "120,22,2", "180,23.04,2"]);
        let of_base = factors(&varying, FormSite::Base);
        let expected = [Factor::One, Factor::Hours, Factor::Temperature(21.5), Factor::Payload];
        assert_eq!(of_base[..4], expected);
        let steady = logged(columns, ["5,20,1"; 4]);
        assert!(expected[1..].iter().all(|factor| !factors(&steady, FormSite::Base).contains(factor)));
        assert_eq!(factors(&logged("", [""; 4]), FormSite::Base)[0], Factor::One);
        // How a joint moved last is known where the rows have an order in time, of a joint alone.
        assert!(factors(&varying, joint(1)).contains(&Factor::Move(1)));
        assert!(!of_base.iter().any(|factor| matches!(factor, Factor::Move(_) | Factor::Side(_))));
        assert!(!factors(&logged("", [""; 4]), joint(1)).contains(&Factor::Move(1)));
    }

    #[test]
    fn the_side_of_approach_is_a_factor_of_a_joint_that_arrived_from_both() {
        let lab = crate::testing::with_table(&logged("", [""; 4]), |table| {
            table.approach = Some([1, 1, 0, -1, 1, 0, 1, 1, 0, -1, 1, 0].to_vec());
        });
        let sides = |at: usize| factors(&lab, joint(at)).contains(&Factor::Side(at));
        assert_eq!([sides(0), sides(1), sides(2)], [true, false, false]);
    }

    #[test]
    fn a_constant_is_no_form_and_at_the_base_only_halves_are_without_a_factor() {
        let (angle, base) = (Angle::of(1), FormSite::Base);
        assert!(!is_new(joint(0), Factor::One, Shape::One) && !is_new(base, Factor::One, Shape::One));
        assert!(is_new(joint(0), Factor::Hours, Shape::One) && is_new(base, Factor::Hours, Shape::One));
        assert!(is_new(joint(0), Factor::One, Shape::Linear(angle)));
        assert!(!is_new(base, Factor::One, Shape::Linear(angle)));
        assert!(is_new(base, Factor::One, Shape::Half(angle, 0.5)));
        assert!(is_new(base, Factor::Hours, Shape::Linear(angle)));
    }

    /// Whether some of the shapes are of the sum or difference of these joints, waves and others.
    fn of_two(shapes: &[Vec<Shape>], first: usize, other: usize) -> (usize, usize) {
        let is_it = |angle: &Angle| angle.first == first && angle.second.is_some_and(|(one, _)| one == other);
        let all = || shapes.iter().flatten();
        let waves = all().filter(|shape| matches!(shape, Shape::Wave(angle, 1) if is_it(angle))).count();
        let steps = all().filter(|shape| matches!(shape, Shape::Step(angle, _) if is_it(angle))).count();
        (waves, steps)
    }

    #[test]
    fn two_joints_make_waves_of_their_sum_and_difference_and_neighbours_slopes_and_steps_as_well() {
        let lab = logged("", [""; 4]);
        let alone = shapes(&lab, joint(0), Factor::One);
        assert_eq!(alone[0], [Shape::One]);
        // Seven positions in the range of the sum and of the difference.
        assert_eq!((of_two(&alone, 0, 1), of_two(&alone, 0, 2)), ((2, 14), (2, 0)));
        assert_eq!(of_two(&alone, 0, 0), (0, 0));
        let with_hours = shapes(&lab, joint(0), Factor::Hours);
        assert_eq!((of_two(&with_hours, 0, 1), of_two(&with_hours, 0, 2)), ((2, 0), (2, 0)));
        assert_eq!(of_two(&shapes(&lab, FormSite::Base, Factor::Hours), 0, 1), (0, 0));
    }

    #[test]
    fn an_angle_of_two_joints_reaches_as_far_as_both_and_what_is_taken_away_the_other_way() {
        // From 0 to 30, from 0 to 63 and from 13 to 40 degrees.
        let lab = logged("", [""; 4]);
        let reached = |second: Option<(usize, bool)>| {
            let (low, high) = reach(&lab, Angle { first: 0, second });
            [low.to_degrees().round(), high.to_degrees().round()]
        };
        assert_eq!(reached(None), [0.0, 30.0]);
        assert_eq!(reached(Some((1, false))), [0.0, 93.0]);
        assert_eq!(reached(Some((2, true))), [-40.0, 17.0]);
    }

    #[test]
    fn a_joint_feels_the_moments_about_itself_and_its_neighbours_and_the_base_those_of_the_first_three() {
        let model = "arm: four\nconvention: distal\njoints:\n  - {name: j1, a_mm: 90}\n  - {name: j2, a_mm: 90}\n  - {name: j3, a_mm: 90}\n  - {name: j4, a_mm: 90}\ngravity: [0, -1, 0]\nlinks: [{after: j4, mass_kg: 2, centre_mm: [-50, 0, 0]}]\ntargets: {p1: {}}\n";
        let rows: String = (0..6).map(|row| format!("{0},{0},{0},{0},1,2,3\n", 5 * row)).collect();
        let lab = laboratory(model, &format!("q1_deg,q2_deg,q3_deg,q4_deg,p1_x_mm,p1_y_mm,p1_z_mm\n{rows}"));
        let moments = |site: FormSite| {
            let of = factors(&lab, site).into_iter().filter_map(|factor| match factor {
                Factor::Moment(joint) => Some(joint),
                _ => None,
            });
            of.collect::<Vec<usize>>()
        };
        assert_eq!(moments(joint(0)), [0, 1]);
        assert_eq!((moments(joint(1)), moments(joint(2))), (vec![0, 1, 2], vec![1, 2, 3]));
        assert_eq!((moments(joint(3)), moments(FormSite::Base)), (vec![2, 3], vec![0, 1, 2]));
    }

    #[test]
    fn halves_are_parted_every_eighth_of_half_a_turn_and_a_range_of_half_a_radian_has_steps() {
        let alone = shapes(&logged("", [""; 4]), joint(0), Factor::One);
        let numbers = alone.iter().flatten().filter_map(|shape| match shape {
            Shape::Half(angle, at) | Shape::Step(angle, at) if *angle == Angle::of(0) => Some(*at),
            _ => None,
        });
        // Eighths of pi, then of 30 deg, 0.5236 rad, to a thousandth.
        let halves = [0.0, 0.393, 0.785, 1.178, 1.571, 1.963, 2.356, 2.749];
        let steps = [0.065, 0.131, 0.196, 0.262, 0.327, 0.393, 0.458];
        assert_eq!(numbers.collect::<Vec<f64>>(), [&halves[..], &steps[..]].concat());
    }

    #[test]
    fn a_slope_either_way_of_zero_begins_at_shares_of_the_farther_end() {
        // From 0 to 30 less from 13 to 40 degrees: the farther end is 40 degrees, 0.698 rad.
        let angle = Angle { first: 0, second: Some((2, true)) };
        let beyond =
            kinked(&logged("", [""; 4]), angle).into_iter().flatten().filter_map(|shape| match shape {
                Shape::Beyond(_, at) => Some(at),
                _ => None,
            });
        assert_eq!(beyond.collect::<Vec<f64>>(), [0.105, 0.209, 0.314, 0.419]);
    }

    #[test]
    fn forms_that_differ_in_a_searched_number_alone_are_one_family() {
        let all = probes(&logged("", [""; 4]));
        let of_shape = |is_it: fn(Shape) -> bool| {
            let own = all.iter().filter(|(form, _)| form.site == joint(1) && is_it(form.shape));
            own.map(|(_, probe)| probe.family).collect::<Vec<usize>>()
        };
        let steps = of_shape(|shape| matches!(shape, Shape::Step(angle, _) if angle == Angle::of(1)));
        assert!(steps.len() == 7 && steps.iter().all(|family| *family == steps[0]), "{steps:?}");
        let lines = of_shape(|shape| matches!(shape, Shape::Linear(_)));
        assert!(lines.len() == 3 && lines.windows(2).all(|pair| pair[0] < pair[1]), "{lines:?}");
        assert!(!lines.contains(&steps[0]));
    }
}
