use super::*;
use plumb_estimation::Random;

const EQUATIONS: usize = 300;

/// A constant that is fitted, twelve cosines of a number `t` and the readings: what `truth` makes of `t`, and noise of one.
fn smooth(seed: u64, truth: impl Fn(f64) -> f64) -> (Features, Vec<f64>) {
    let mut random = Random::seeded(seed);
    let t: Vec<f64> = (0..EQUATIONS).map(|_| random.uniform()).collect();
    let mut design = DMatrix::from_element(EQUATIONS, 14, 1.0);
    for (row, value) in t.iter().enumerate() {
        for order in 1..=12 {
            let order_f = order as f64;
            design[(row, order)] = (std::f64::consts::PI * order_f * value).cos() / order_f;
        }
        design[(row, 13)] = truth(*value) + random.normal();
    }
    let knowledge = Products::of(&DMatrix::zeros(1, 14)).without(&Products::of(&DMatrix::zeros(1, 14)));
    let one = 1..13;
    let features = Features {
        design,
        fixed: 1,
        components: std::iter::once(0..12).collect(),
        joints: vec![None],
        carriers: Vec::new(),
        groups: Vec::new(),
        equations: vec![one; 0],
        knowledge,
    };
    (features, t)
}

fn column(t: &[f64], effect: impl Fn(f64) -> f64) -> DMatrix<f64> {
    DMatrix::from_iterator(t.len(), 1, t.iter().map(|one| effect(*one)))
}

/// Fast enough that no cosine of the flexible part can follow it.
fn wave(t: f64) -> f64 {
    (150.0 * t).sin()
}

/// By how much Schwarz's criterion falls with an effect in.
fn reduction(mixed: &Mixed, parameters: &[usize]) -> (f64, MixedFit) {
    let nothing = mixed.fit(&[], None).unwrap();
    let with = mixed.fit(parameters, Some(&nothing.ratios)).unwrap();
    (nothing.deviance - with.deviance - with.rank as f64 * (EQUATIONS as f64).ln(), with)
}

#[test]
fn an_effect_in_smooth_dirt_is_decisive_and_has_its_size() {
    let dirt = |t: f64| 6.0 * (4.0 * t).sin() + 4.0 * t * t;
    let (features, t) = smooth(3, |t| dirt(t) + 1.5 * wave(t));
    let mixed = Mixed::new(&features, &column(&t, wave)).unwrap();
    let (reduction, with) = reduction(&mixed, &[0]);
    assert!(reduction > 30.0, "{reduction}");
    let error = with.covariance[(0, 0)].sqrt();
    assert!((with.values[0] - 1.5).abs() < 3.0 * error && (0.05..0.15).contains(&error), "{with:?}");
    // Root mean square 1.5 / sqrt(2) in 300 equations.
    let explained = mixed.squares_of(&with, &[0]);
    assert!((explained - 337.0).abs() < 80.0, "{explained}");
}

#[test]
fn smooth_dirt_alone_makes_no_effect_likely() {
    for seed in 0..10 {
        let (features, t) = smooth(seed, |t| 6.0 * (4.0 * t).sin() + 4.0 * t * t);
        for effect in [wave, |t: f64| t, |t: f64| (9.0 * t).cos()] {
            let mixed = Mixed::new(&features, &column(&t, effect)).unwrap();
            let (reduction, _) = reduction(&mixed, &[0]);
            assert!(reduction < 6.0, "seed {seed}: {reduction}");
        }
    }
}

#[test]
fn a_component_holds_what_its_functions_follow_and_can_be_given_up() {
    let (features, t) = smooth(2, |t| t);
    let holds = |effect: fn(f64) -> f64| {
        !Mixed::new(&features, &column(&t, effect)).unwrap().holding(&[0], &[0]).is_empty()
    };
    // Twelve cosines on the range of t follow a line, and no wave of twenty periods on it.
    assert!(
        holds(|t| t) && holds(|t| (3.0 * t).sin()) && !holds(|t| (40.0 * std::f64::consts::PI * t).sin())
    );
    // A line with so much of that wave in it that .95 of correlation are not reached.
    assert!(!holds(|t| t + 0.3 * (40.0 * std::f64::consts::PI * t).sin()));
    assert!(holds(|t| t + 0.05 * (40.0 * std::f64::consts::PI * t).sin()));
    let mixed = Mixed::new(&features, &column(&t, |t| t)).unwrap();
    assert_eq!(mixed.holding(&[0], &[]), [] as [usize; 0]);
    let fit = mixed.fit(&[], None).unwrap().at_ratios(vec![4.0, 2.0]);
    assert_eq!(fit.ratios_without(&[1]), [4.0, f64::INFINITY]);
}

#[test]
fn two_collinear_effects_are_as_likely_as_each_other_and_together_count_once() {
    let (features, t) = smooth(5, |t| 3.0 * t * t + 2.0 * wave(t));
    let mut both = column(&t, wave).insert_column(1, 0.0);
    let same = column(&t, |t| -2.0 * wave(t) + 7.0);
    both.set_column(1, &same.column(0));
    let mixed = Mixed::new(&features, &both).unwrap();
    let ((one, _), (other, _), (pair, with)) =
        (reduction(&mixed, &[0]), reduction(&mixed, &[1]), reduction(&mixed, &[0, 1]));
    assert!((one - other).abs() < 0.5 && one > 30.0, "{one} {other}");
    assert_eq!(with.rank, 1);
    assert!((pair - one).abs() < 0.5, "{pair} {one}");
}

#[test]
fn the_evidence_at_the_ratios_of_a_fit_is_that_fit() {
    let (features, t) = smooth(11, |t| 4.0 * (4.0 * t).sin() + 1.5 * wave(t));
    let mixed = Mixed::new(&features, &column(&t, wave)).unwrap();
    let (nothing, with) = (mixed.fit(&[], None).unwrap(), mixed.fit(&[0], None).unwrap());
    let evidence = mixed.evidence_at(&with.ratios).unwrap();
    let (alone, rank) = evidence.deviance(&[0]);
    let none = evidence.deviance(&[]);
    assert_eq!((rank, none.1), (1, 0));
    // Both leave out what the ratios themselves cost, so that differences are those of the same ratios.
    let again = mixed.fit_within(1, &[0], Some(&with.ratios)).unwrap();
    let without = mixed.fit_within(1, &[], Some(&with.ratios)).unwrap();
    assert!((none.0 - alone - (without.deviance - again.deviance)).abs() < 1e-6);
    // Where a candidate explains next to nothing the deviance is the degrees of freedom times the logarithm of the squares.
    assert!((none.0 - evidence.freedom * evidence.squares.ln()).abs() < 1e-9);
    assert!(with.deviance < nothing.deviance);
}

#[test]
fn a_perfect_fit_of_made_up_data_has_a_finite_likelihood() {
    // A score of 2 at an information of 1 takes away 4 squares: all there are.
    let one = |value: f64| DMatrix::from_element(1, 1, value);
    let evidence = |squares: f64| EvidenceAtRatios {
        information: one(1.0),
        score: DVector::from_element(1, 2.0),
        own: one(1.0),
        squares,
        freedom: 10.0,
    };
    assert!((evidence(4.0).deviance(&[0]).0 - 10.0 * 4e-12_f64.ln()).abs() < 1e-9);
    assert!(
        (evidence(5.0).deviance(&[0]).0 - 0.0).abs() < 1e-9,
        "one square is left: its logarithm is nought"
    );
}

#[test]
fn rows_that_are_left_out_are_predicted_by_the_rest() {
    let (features, t) = smooth(7, |t| 2.0 * wave(t));
    let mixed = Mixed::new(&features, &column(&t, wave)).unwrap();
    let (_, with) = reduction(&mixed, &[0]);
    let blocks = vec![(0..150).collect(), (150..300).collect()];
    let mut squares = 0.0;
    for left_out in mixed.leave_out(blocks).unwrap() {
        let (left, values) = mixed.predict(&with, &left_out).unwrap();
        squares += left.iter().map(|(_, one)| one * one).sum::<f64>();
        assert!((values[0] - 2.0).abs() < 0.5, "{values:?}");
    }
    assert!((250.0..400.0).contains(&squares), "noise of one in 300 equations: {squares}");
    assert!((mixed.residuals(&with).norm_squared() - 300.0).abs() < 90.0);
}

/// The deviance as a function of the logarithm of the ratio, whose slope the rounds step along.
#[test]
fn what_a_round_promises_is_its_slope_times_its_step() {
    let (features, _) = smooth(11, |t| 4.0 * (3.0 * t).sin());
    let mixed = Mixed::new(&features, &DMatrix::zeros(EQUATIONS, 0)).unwrap();
    let at = |ratio: f64| {
        let inverse = mixed.inverse(&mixed.reduced, &[ratio]).unwrap();
        mixed.round(&mixed.reduced, &[], &[ratio], &inverse)
    };
    for ratio in [0.5, 20.0, 300.0] {
        let (round, step) = (at(ratio), 1e-4_f64);
        let slope = (at(ratio * step.exp()).deviance - at(ratio * (-step).exp()).deviance) / (2.0 * step);
        let promised = -slope * (round.better[0] / ratio).ln();
        assert!(
            round.promised > 0.0 && (round.promised / promised - 1.0).abs() < 1e-3,
            "{ratio}: {promised}"
        );
    }
}

/// Noise alone: the smooth part is given up, which is worth little more than what is said of it.
#[test]
fn giving_a_component_up_is_worth_about_what_is_promised() {
    let (features, _) = smooth(12, |_| 0.0);
    let mixed = Mixed::new(&features, &DMatrix::zeros(EQUATIONS, 0)).unwrap();
    let inverse = mixed.inverse(&mixed.reduced, &[2e5]).unwrap();
    let round = mixed.round(&mixed.reduced, &[], &[2e5], &inverse);
    assert!(round.better[0].is_infinite() && round.promised.abs() < EXPLAINABLE_FREEDOM);
    let without = mixed.inverse(&mixed.reduced, &[f64::INFINITY]).unwrap();
    let without = mixed.round(&mixed.reduced, &[], &[f64::INFINITY], &without);
    let reduction = round.deviance - without.deviance;
    assert!(
        (reduction - round.promised).abs() < 0.1 * round.promised.abs(),
        "{reduction} {}",
        round.promised
    );
}

/// From ratios at which the rows can hardly be likelier no further inverse is worked out.
#[test]
fn a_fit_that_begins_where_another_ended_ends_there() {
    let (features, t) = smooth(13, |t| 5.0 * (4.0 * t).sin());
    let mixed = Mixed::new(&features, &column(&t, wave)).unwrap();
    let nothing = mixed.fit(&[], None).unwrap();
    let again = mixed.fit(&[], Some(&nothing.ratios)).unwrap();
    assert_eq!(again.ratios, nothing.ratios);
    let all_rounds = mixed.fit_within(40, &[], Some(&nothing.ratios)).unwrap();
    assert!((again.deviance - all_rounds.deviance).abs() < SETTLED);
}

/// A fit from a start so far away that each round brings it a good way on.
#[test]
fn whether_a_fit_falls_below_a_bound_is_known_before_it_has_settled() {
    let (features, t) = smooth(14, |t| 5.0 * (4.0 * t).sin());
    let mixed = Mixed::new(&features, &column(&t, wave)).unwrap();
    let far = [1000.0];
    let [first, settled] =
        [1, ROUNDS].map(|rounds| mixed.fit_within(rounds, &[], Some(&far)).unwrap().deviance);
    assert!(first > settled + 20.0, "{first} {settled}");
    for offset in [-1e6, -10.0, -0.5, 0.5, 10.0, 1e6] {
        let bound = settled + offset;
        let found = mixed.fit_below(bound, &[], &far).unwrap().deviance;
        assert_eq!(found < bound, offset > 0.0, "{offset}: {found}");
        // Far off the first round says it, near by the last.
        let ended = if offset.abs() > 1e5 { first } else { found };
        assert!((found - ended).abs() < 1e-9 && found > settled - 1e-9, "{offset}: {found}");
    }
}

#[test]
fn models_are_predicted_together_as_each_alone_whether_they_share_ratios_or_not() {
    let (features, t) = smooth(15, |t| 2.0 * wave(t) + 3.0 * (4.0 * t).sin());
    let mixed = Mixed::new(&features, &column(&t, wave)).unwrap();
    let (_, with) = reduction(&mixed, &[0]);
    let without = mixed.fit(&[], None).unwrap();
    let stiff = without.at_ratios(vec![f64::INFINITY]);
    let beside = without.at_ratios(with.ratios.clone());
    for left_out in mixed.leave_out(vec![(0..150).collect(), (150..300).collect()]).unwrap() {
        let fits = [&with, &without, &beside, &stiff, &with];
        let together = mixed.predict_each(&fits, &left_out).unwrap();
        let alone: Vec<_> = fits.iter().map(|fit| mixed.predict(fit, &left_out).unwrap()).collect();
        assert_eq!(together, alone);
        assert!(together[1] != together[2] && together[2] != together[3] && together[0].1 != [] as [f64; 0]);
    }
}

/// From far and near starts, with smooth functions of several strengths: what is left to fall after each round, beside what that round promises.
#[test]
fn a_fit_falls_by_a_few_times_what_a_round_promises_and_by_far_less_than_the_limit() {
    let mut most = 0.0_f64;
    for (seed, strength) in [(16, 0.5), (17, 1.0), (18, 5.0), (19, 20.0)] {
        let (features, _) = smooth(seed, |t| strength * (4.0 * t).sin());
        let mixed = Mixed::new(&features, &DMatrix::zeros(EQUATIONS, 0)).unwrap();
        for start in [1e-5, 1e-2, 1.0, 50.0, 500.0] {
            let settled = mixed.fit_within(40, &[], Some(&[start])).unwrap().deviance;
            let mut ratio = start;
            for _ in 0..ROUNDS {
                let inverse = mixed.inverse(&mixed.reduced, &[ratio]).unwrap();
                let round = mixed.round(&mixed.reduced, &[], &[ratio], &inverse);
                if round.promised < SETTLED || round.better[0].is_infinite() {
                    break;
                }
                most = most.max((round.deviance - settled) / round.promised);
                ratio = round.better[0];
            }
        }
    }
    assert!(most > 1.0 && 3.0 * most < REACH, "{most}");
}
