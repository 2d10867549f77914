//! Every branch of the verdict on fitted candidates made by hand, and both sides of each threshold it rests on.

use nalgebra::DMatrix;

use super::evidence::{flexible_terms_at, significant_sites};
use super::*;
use crate::noise_floor::FloorSource;
use crate::predictive_gain::Gain;
use crate::testing::{fitted_candidate, gain};
use crate::thresholds::UNLISTED_LEVEL;

const FLOOR: Floor = Floor {
    sigma_mm: Some(1.0),
    source: FloorSource::Declared,
    dof: 0,
    scale: Some(1.0),
    allowed_for: Vec::new(),
};

/// Equations of the imagined fit.
const EQUATIONS: f64 = 200.0;

/// What is left in proportion to noise, with this probability.
fn lack(p: f64) -> Option<LackOfFit> {
    Some(LackOfFit { ratio: 1.0, p })
}

/// The verdict on fitted candidates where much is left without them.
fn verdict_of(fitted_candidates: &[FittedCandidate], evidence: Evidence) -> (Verdict, Option<Site>) {
    let close = close_fitted_candidates(fitted_candidates, EQUATIONS);
    let asked: Vec<&FittedCandidate> = close.iter().map(|index| &fitted_candidates[*index]).collect();
    judge(&asked, &evidence, &FLOOR)
}

/// More than noise is left without the effect, nothing with it.
fn found() -> Evidence {
    Evidence { lack_of_fit: lack(1e-9), left_over: lack(0.5), ..Evidence::default() }
}

const NAMED: (Verdict, Option<Site>) = (Verdict::Named, None);

fn located(joint: usize) -> (Verdict, Option<Site>) {
    (Verdict::Located, Some(Site::Joint(joint)))
}

#[test]
fn one_fitted_candidate_that_passes_everything_is_named() {
    assert_eq!(verdict_of(&[fitted_candidate("joint_zero", 1, 0.0)], found()), NAMED);
}

#[test]
fn fitted_candidates_within_the_tie_are_tied_or_located_and_beyond_it_the_best_is_named() {
    let two = |joint: usize, bic: f64| {
        [fitted_candidate("joint_zero", 1, 0.0), fitted_candidate("joint_gain", joint, bic)]
    };
    assert_eq!(verdict_of(&two(2, 0.9 * TIE_BIC), found()).0, Verdict::Tied);
    assert_eq!(verdict_of(&two(1, 0.9 * TIE_BIC), found()), located(1));
    assert_eq!(verdict_of(&two(2, 1.1 * TIE_BIC), found()), NAMED);
    assert_eq!(verdict_of(&two(1, 1.1 * TIE_BIC), found()), NAMED);
}

#[test]
fn a_fitted_candidate_of_many_parameters_is_charged_for_one_more_only() {
    let with = |freedom: usize, extra: f64| {
        let mut other = fitted_candidate("drift", 2, extra);
        other.score.freedom = freedom;
        verdict_of(&[fitted_candidate("joint_zero", 1, 0.0), other], found()).0
    };
    let price = EQUATIONS.ln();
    assert_eq!(with(4, 2.0 * price + 0.9 * TIE_BIC), Verdict::Tied, "two of its three more are not charged");
    assert_eq!(with(4, 2.0 * price + 1.1 * TIE_BIC), Verdict::Named);
    assert_eq!(with(2, 0.9 * TIE_BIC), Verdict::Tied, "one more is in the criterion already");
    assert_eq!(with(2, 1.1 * TIE_BIC), Verdict::Named);
}

#[test]
fn a_name_must_be_improbable_by_chance() {
    let at = |holm_p: f64| FittedCandidate { holm_p, ..fitted_candidate("joint_zero", 1, 0.0) };
    assert!(at(0.9 * NAMING_LEVEL).passes() && !at(1.1 * NAMING_LEVEL).passes());
    assert_eq!(verdict_of(&[at(0.9 * NAMING_LEVEL)], found()), NAMED);
    assert_eq!(verdict_of(&[at(1.1 * NAMING_LEVEL)], found()).0, Verdict::Unknown);
}

#[test]
fn an_implausible_an_outvoted_and_an_unproved_effect_are_not_named() {
    let plain = || fitted_candidate("joint_zero", 1, 0.0);
    let mut implausible = plain();
    implausible.score.plausible = false;
    assert_eq!(verdict_of(&[implausible], found()).0, Verdict::Unknown);
    let outvoted = FittedCandidate { outvoted: true, ..plain() };
    let unproved = FittedCandidate { gains: vec![gain(0.9)], ..plain() };
    let harmful = FittedCandidate { gains: vec![gain(5.0), gain(-0.5)], ..plain() };
    let untried = FittedCandidate { gains: Vec::new(), ..plain() };
    let expected = FittedCandidate { refitted: false, ..plain() };
    for one in [outvoted, unproved, harmful, untried, expected] {
        assert!(!one.passes());
        assert_eq!(verdict_of(&[one], found()), located(1), "its site is where the error sits");
    }
}

#[test]
fn what_does_not_predict_is_no_finding_unless_something_must_be_there() {
    let unproved = |holm_p: f64| FittedCandidate {
        holm_p,
        gains: vec![gain(-3.0)],
        ..fitted_candidate("joint_zero", 1, 0.0)
    };
    let quiet = || Evidence { lack_of_fit: lack(0.5), left_over: lack(0.5), ..Evidence::default() };
    assert_eq!(verdict_of(&[unproved(1.1 * PRESENT_LEVEL)], quiet()), (Verdict::AtFloor, None));
    assert_eq!(verdict_of(&[unproved(0.9 * PRESENT_LEVEL)], quiet()), located(1));
    let without_floor = Evidence::default();
    assert_eq!(verdict_of(&[unproved(1e-9)], without_floor), (Verdict::FloorUnknown, None));
}

#[test]
fn without_a_fitted_candidate_the_lack_of_fit_decides() {
    let at = |p: f64| verdict_of(&[], Evidence { lack_of_fit: lack(p), ..Evidence::default() });
    assert_eq!(at(1.1 * LACK_OF_FIT_LEVEL), (Verdict::AtFloor, None));
    assert_eq!(at(0.9 * LACK_OF_FIT_LEVEL), (Verdict::Unknown, None));
    let strange =
        Evidence { lack_of_fit: lack(1e-9), unlisted_sites: vec![Site::Joint(3)], ..Evidence::default() };
    assert_eq!(verdict_of(&[], strange), located(3));
    let directed = Evidence {
        lack_of_fit: lack(1e-9),
        unlisted_sites: vec![Site::Joint(3)],
        alone: vec![Site::Joint(2)],
        ..Evidence::default()
    };
    assert_eq!(verdict_of(&[], directed), located(2), "the direction overrules what sits elsewhere");
}

#[test]
fn a_doubted_name_is_located_unless_its_evidence_is_overwhelming() {
    let doubts: [fn(&mut Evidence); 4] = [
        |evidence| evidence.left_over = lack(0.9 * LACK_OF_FIT_LEVEL),
        |evidence| evidence.unlisted_sites = vec![Site::Joint(1)],
        |evidence| evidence.uneven = vec![Site::Joint(1)],
        |evidence| evidence.flexible_terms_at = Some(Site::Joint(1)),
    ];
    for doubt in doubts {
        let verdict = |errors: f64| {
            let mut evidence = found();
            doubt(&mut evidence);
            // The gain of each way is counted in standard errors of its own.
            let gains = vec![gain(errors), Gain { total: 3.0 * errors, error: 3.0 }];
            let one = FittedCandidate { gains, ..fitted_candidate("joint_zero", 1, 0.0) };
            verdict_of(&[one], evidence)
        };
        assert_eq!(verdict(0.9 * OVERWHELMING_GAIN), located(1));
        assert_eq!(verdict(1.1 * OVERWHELMING_GAIN), NAMED);
    }
    let elsewhere =
        Evidence { unlisted_sites: vec![Site::Joint(4)], uneven: vec![Site::Joint(4)], ..found() };
    assert_eq!(
        verdict_of(&[fitted_candidate("joint_zero", 1, 0.0)], elsewhere),
        NAMED,
        "doubts at another joint do not count"
    );
    let finished = Evidence { left_over: lack(1.1 * LACK_OF_FIT_LEVEL), ..found() };
    assert_eq!(verdict_of(&[fitted_candidate("joint_zero", 1, 0.0)], finished), NAMED);
}

#[test]
fn a_mechanism_without_a_name_that_explains_more_takes_the_site() {
    let evidence = Evidence { rivals: Some(Site::Joint(5)), ..found() };
    assert_eq!(verdict_of(&[fitted_candidate("joint_zero", 1, 0.0)], evidence), located(5));
}

#[test]
fn what_does_not_reach_the_floor_is_not_tied_where_the_direction_knows_one_site() {
    let unproved = |joint: usize, left: f64| FittedCandidate {
        gains: vec![gain(0.0)],
        left: (left, 190.0),
        ..fitted_candidate("joint_gain", joint, 0.0)
    };
    let at = |left: f64| {
        let evidence = Evidence { alone: vec![Site::Joint(2)], ..found() };
        verdict_of(&[unproved(1, left), unproved(3, left)], evidence)
    };
    assert_eq!(at(190.0).0, Verdict::Tied);
    assert_eq!(at(400.0), located(2));
}

#[test]
fn sites_without_a_name_count_below_their_level_after_holm() {
    let tests =
        |p: f64| [(p, Site::Joint(2)), (0.5, Site::Joint(0)), (0.9, Site::Base), (p / 10.0, Site::Joint(1))];
    // Of four tests the least is multiplied by four, the next by three.
    assert_eq!(significant_sites(&tests(0.9 * UNLISTED_LEVEL / 3.0)), [Site::Joint(1), Site::Joint(2)]);
    assert_eq!(significant_sites(&tests(1.1 * UNLISTED_LEVEL / 3.0)), [Site::Joint(1)]);
    assert_eq!(significant_sites(&[(1.1 * UNLISTED_LEVEL, Site::Base)]), []);
}

#[test]
fn two_flexible_terms_at_one_joint_imitate_anything() {
    let taken = |name: &str, joint: usize| AddedEffect {
        id: EffectId::at(name, Site::Joint(joint)),
        values: Vec::new(),
    };
    let wave_and_gain = [taken("joint_gain", 1), taken("joint_zero", 2), taken("joint_harmonic", 1)];
    assert_eq!(flexible_terms_at(&wave_and_gain), Some(Site::Joint(1)));
    assert_eq!(
        flexible_terms_at(&[taken("joint_gain", 1), taken("joint_harmonic", 2), taken("joint_zero", 1)]),
        None
    );
}

#[test]
fn canonical_correlation_of_collinear_and_of_orthogonal_columns() {
    let products = |columns: &DMatrix<f64>| columns.tr_mul(columns);
    let same = DMatrix::from_row_slice(3, 2, &[1.0, 2.0, 2.0, 4.0, -1.0, -2.0]);
    assert!((canonical(&products(&same), &(0..1), &(1..2)).unwrap() - 1.0).abs() < 1e-9);
    let square = DMatrix::from_row_slice(3, 2, &[1.0, 1.0, 1.0, -1.0, 0.0, 5.0]);
    assert!(canonical(&products(&square), &(0..1), &(1..2)).unwrap() < 1e-9);
    // Angle of 60 degrees: correlation one half.
    let half = DMatrix::from_row_slice(2, 2, &[1.0, 0.5, 0.0, 0.75_f64.sqrt()]);
    assert!((canonical(&products(&half), &(0..1), &(1..2)).unwrap() - 0.5).abs() < 1e-12);
}

#[test]
fn that_noise_alone_is_left_must_be_known() {
    let left =
        |squares: f64| FittedCandidate { left: (squares, 190.0), ..fitted_candidate("joint_gain", 1, 0.0) };
    assert!(leaves_noise_alone(&left(190.0), &FLOOR) && !leaves_noise_alone(&left(400.0), &FLOOR));
    let unknown = Floor { scale: None, sigma_mm: None, ..FLOOR };
    assert!(!leaves_noise_alone(&left(190.0), &unknown) && explains_all(&left(400.0), &unknown));
}

#[test]
fn the_smallest_size_is_five_errors_of_what_is_left_with_the_candidate_in_and_never_of_less_than_the_noise() {
    // 380 squares in 190 degrees of freedom: a scatter of the root of two. A strength of 4 a unit, of which three quarters are swallowed in squares: 2 are left.
    let left = |squares: f64| {
        let mut one = FittedCandidate { left: (squares, 190.0), ..fitted_candidate("joint_gain", 1, 0.0) };
        (one.score.strength, one.score.absorbed) = (4.0, 0.75);
        one
    };
    let quiet = Floor { scale: Some(1.0), ..FLOOR };
    assert!((smallest(&left(380.0), &quiet) - 2.5 * 2.0_f64.sqrt()).abs() < 1e-12);
    assert!((smallest(&left(95.0), &quiet) - 2.5).abs() < 1e-12, "the noise is known to be larger");
    let unknown = Floor { scale: None, ..FLOOR };
    assert!((smallest(&left(95.0), &unknown) - 2.5 * 0.5_f64.sqrt()).abs() < 1e-12);
    let mut unseen = left(380.0);
    unseen.score.strength = 0.0;
    assert_eq!(smallest(&unseen, &quiet), f64::MAX);
}

#[test]
fn gravity_points_the_other_way_where_a_compliance_is_below_zero_beyond_doubt() {
    let at = |errors: f64| is_below_zero(&Size { value: -0.02 * errors, unit: "deg", error: 0.02 });
    assert!(at(1.01 * SIGN_ERRORS) && !at(0.99 * SIGN_ERRORS) && !at(-1.01 * SIGN_ERRORS));
}

#[test]
fn effects_of_sensor_and_instrument_change_what_is_read_and_not_where_the_arm_is() {
    assert!(is_of_sensor(&EffectId::at("scale", Site::Axis(0))));
    assert!(!is_of_sensor(&EffectId::at("joint_gain", Site::Joint(0))));
}

#[test]
fn a_root_mean_square_falls_by_the_difference_of_the_roots() {
    // 4 points: from 5 to 4, and never below nothing.
    assert!((expected_reduction(100.0, 36.0, 4.0) - 1.0).abs() < 1e-12);
    assert!((expected_reduction(100.0, 200.0, 4.0) - 5.0).abs() < 1e-12);
    assert_eq!(expected_reduction(100.0, 0.0, 4.0), 0.0);
}

/// A finding on fitted candidates made by hand, and what is asked of it.
fn finding_of<T>(fitted_candidates: Vec<FittedCandidate>, ask: impl Fn(&mut Finding<'_>) -> T) -> T {
    let lab = crate::testing::two_links(20, "joint_zero(*)", 0.05, 31, |_| [0.0; 2]);
    let none = crate::candidates::Candidates { listed: Vec::new(), unlisted: Vec::new() };
    let mut stage = lab.stage(Vec::new(), None, &none, &plumb_estimation::Progress::unwatched()).unwrap();
    stage.fitted_candidates = fitted_candidates;
    ask(&mut finding_of_stage(stage))
}

/// All fitted candidates are close to the best, and nothing else is known.
fn finding_of_stage(stage: Stage<'_>) -> Finding<'_> {
    let close = (0..stage.fitted_candidates.len()).collect();
    let rows = stage.fitted.fit.rows.clone();
    Finding {
        stage,
        left_over: None,
        left_now: None,
        verdict: Verdict::Tied,
        site: None,
        close,
        besides: Vec::new(),
        sites: Vec::new(),
        left_unexplained_mm: None,
        free_first: None,
        mechanism: None,
        against: None,
        dirty: false,
        rows,
        together: Vec::new(),
    }
}

#[test]
fn a_joint_that_rises_under_load_is_warned_of_where_it_is_the_likeliest_and_no_chance() {
    let warned = |name: &str, value: f64, holm_p: f64| {
        let one = FittedCandidate { values: vec![value], holm_p, ..fitted_candidate(name, 1, 0.0) };
        finding_of(vec![one], |finding| finding.gravity_warning())
    };
    let name = "joint_compliance";
    assert_eq!(warned(name, -1.0, 1e-10), Some(Note::RisesUnderLoad(format!("{name}(elbow)"))));
    assert_eq!(warned(name, 1.0, 1e-10), None, "it yields");
    assert_eq!(warned(name, -1.0, NAMING_LEVEL), None, "chance does as much");
    assert!(warned(name, -1.0, 0.99 * NAMING_LEVEL).is_some());
    assert_eq!(warned("joint_gain", -1.0, 1e-10), None, "it does not feel gravity");
}

#[test]
fn effects_that_were_found_last_unless_one_of_them_is_an_event() {
    let lasting = |name: &str, besides: &str, verdict: Verdict| {
        finding_of(vec![fitted_candidate(name, 1, 0.0)], |finding| {
            finding.verdict = verdict;
            finding.besides = vec![fitted_candidate(besides, 0, 0.0).id];
            finding
                .lasting_effects()
                .map(|found| found.into_iter().map(|one| one.id.name).collect::<Vec<_>>())
        })
    };
    for verdict in [Verdict::Named, Verdict::Tied, Verdict::Located] {
        assert_eq!(
            lasting("joint_compliance", "joint_gain", verdict),
            Some(vec!["joint_compliance".to_owned()])
        );
    }
    assert_eq!(lasting("joint_compliance", "joint_gain", Verdict::AtFloor), None, "nothing was found");
    assert_eq!(lasting("joint_zero_reset", "joint_gain", Verdict::Named), None);
    assert_eq!(lasting("joint_compliance", "joint_zero_reset", Verdict::Named), None);
}

#[test]
fn what_cannot_be_distinguished_is_listed_where_that_is_the_verdict() {
    let two = || vec![fitted_candidate("joint_gain", 1, 0.0), fitted_candidate("joint_zero", 0, 0.5)];
    let tied =
        |fitted_candidates: Vec<FittedCandidate>, verdict: Verdict, free_first: Option<&'static str>| {
            let found = finding_of(fitted_candidates, |finding| {
                (finding.verdict, finding.free_first) = (verdict, free_first);
                finding.tied()
            });
            found.iter().map(|one| format!("{}({})", one.effect, one.site)).collect::<Vec<_>>()
        };
    let both = ["joint_gain(elbow)", "joint_zero(shoulder)"];
    assert_eq!(tied(two(), Verdict::Tied, None), both);
    assert_eq!(tied(two(), Verdict::Located, None), both);
    assert_eq!(tied(two(), Verdict::Named, None), [""; 0]);
    // One alone is tied with errors of the geometry that are to be freed first, and with nothing else.
    let one = || vec![fitted_candidate("joint_gain", 1, 0.0)];
    assert_eq!(tied(one(), Verdict::Tied, Some("link_length(*)")), [both[0]]);
    assert_eq!(tied(one(), Verdict::Tied, None), [""; 0]);
    assert_eq!(tied(one(), Verdict::Located, Some("link_length(*)")), [""; 0]);
}

#[test]
fn a_known_place_is_given_with_what_may_be_at_work_there_and_nowhere_else() {
    let fitted_candidates = || {
        let names = [("joint_gain", 1), ("joint_harmonic", 1), ("joint_zero", 0), ("joint_harmonic", 1)];
        names.map(|(name, joint)| fitted_candidate(name, joint, 0.0)).into_iter().collect()
    };
    let located = |verdict: Verdict, site: Option<Site>| {
        finding_of(fitted_candidates(), |finding| {
            (finding.verdict, finding.site) = (verdict, site);
            finding.besides = vec![
                EffectId::at("joint_backlash", Site::Joint(1)),
                EffectId::at("joint_gain", Site::Joint(0)),
            ];
            finding.located().map(|located| (located.site, located.family))
        })
    };
    let family = ["joint_gain", "joint_harmonic", "joint_backlash"].map(str::to_owned).to_vec();
    assert_eq!(located(Verdict::Located, Some(Site::Joint(1))), Some(("elbow".to_owned(), family)));
    assert_eq!(located(Verdict::Located, None), None);
    assert_eq!(located(Verdict::Tied, Some(Site::Joint(1))), None);
}

#[test]
fn what_acts_at_once_is_what_was_taken_in_and_what_passes_beside_it() {
    let taken = |name: &str| AddedEffect { id: EffectId::at(name, Site::Joint(0)), values: vec![0.5] };
    let together = |taken: Vec<AddedEffect>, passes: bool| {
        let best = FittedCandidate { refitted: passes, ..fitted_candidate("joint_gain", 1, 0.0) };
        finding_of(vec![best, fitted_candidate("joint_backlash", 1, 1.0)], |finding| {
            finding.stage.taken.clone_from(&taken);
            found_together(&finding.stage, &[0, 1])
        })
    };
    let found = together(vec![taken("joint_settling")], true);
    let labels: Vec<Vec<&str>> =
        found.iter().map(|one| one.may_be.iter().map(String::as_str).collect()).collect();
    // What is alike is alike to the one in question alone.
    assert_eq!(
        labels,
        [
            vec!["joint_settling(shoulder)", NOT_LISTED],
            vec!["joint_gain(elbow)", "joint_backlash(elbow)", NOT_LISTED]
        ]
    );
    assert_eq!((found[0].effect.values[0], found[1].effect.values[0]), (0.5, 1.0));
    assert!(together(Vec::new(), true).is_empty(), "one effect is no set");
    assert!(together(vec![taken("joint_settling")], false).is_empty(), "the one in question does not pass");
    assert!(together(vec![taken("joint_step")], true).is_empty(), "what was re-set is added by itself");
}

#[test]
fn a_correction_may_be_itself_what_is_close_or_what_no_library_lists() {
    let outvoted = FittedCandidate { outvoted: true, ..fitted_candidate("joint_zero", 1, 2.0) };
    let fitted_candidates =
        vec![fitted_candidate("joint_gain", 1, 0.0), fitted_candidate("joint_gain", 0, 1.0), outvoted];
    let found = finding_of(fitted_candidates, |finding| {
        finding.close = vec![0, 1];
        finding.corrections()
    });
    let listed: Vec<(&str, Vec<&str>)> = found
        .iter()
        .map(|one| (one.site.site.as_str(), one.may_be.iter().map(String::as_str).collect()))
        .collect();
    let (elbow, shoulder) = ("joint_gain(elbow)", "joint_gain(shoulder)");
    let expected =
        [("elbow", vec![elbow, shoulder, NOT_LISTED]), ("shoulder", vec![shoulder, elbow, NOT_LISTED])];
    assert_eq!(listed, expected);
}

/// Zeros of both joints and gains of the elbow, which moves by so much a row; the last one was not refitted.
fn alike_over<T>(step: f64, ask: impl Fn(&mut Finding<'_>) -> T) -> T {
    let lab = crate::testing::two_links(60, "", 0.05, 31, |_| [0.0; 2]);
    let lab = crate::testing::with_table(&lab, |table| {
        (0..60).for_each(|row| table.q[2 * row + 1] = 1.0 + step * row as f64);
    });
    let none = crate::candidates::Candidates { listed: Vec::new(), unlisted: Vec::new() };
    let mut stage = lab.stage(Vec::new(), None, &none, &plumb_estimation::Progress::unwatched()).unwrap();
    stage.fitted_candidates = vec![
        fitted_candidate("joint_zero", 1, 0.0),
        fitted_candidate("joint_zero", 0, 1.0),
        fitted_candidate("joint_gain", 1, 2.0),
        FittedCandidate { refitted: false, ..fitted_candidate("joint_gain", 1, 3.0) },
    ];
    ask(&mut finding_of_stage(stage))
}

#[test]
fn fitted_candidates_that_move_the_readings_alike_are_listed_by_how_much_and_the_same_are_set_apart() {
    // A zero and a gain move the elbow by 1 and by its angle: the correlation is the cosine of these two columns.
    let cosine = |step: f64| {
        let q: Vec<f64> = (0..60).map(|row| 1.0 + step * f64::from(row)).collect();
        q.iter().sum::<f64>() / (60.0 * q.iter().map(|q| q * q).sum::<f64>()).sqrt()
    };
    for (step, listed, same) in [(0.002, true, false), (1e-6, true, true), (0.1, false, false)] {
        let expected = cosine(step);
        assert_eq!((expected > ALIKE_CORRELATION, expected > SAME_CORRELATION), (listed, same), "{expected}");
        let (found, are_same, alike) =
            alike_over(step, |finding| (finding.correlated(), finding.same(), finding.alike()));
        assert_eq!(found.len(), usize::from(listed), "{step}: {found:?}");
        assert!(found.iter().all(|(one, id)| (one - expected).abs() < 1e-9 && id.name == "joint_gain"));
        assert_eq!(are_same.len(), usize::from(same), "{step}");
        let pairs: Vec<_> = alike.iter().map(|one| (one.one.as_str(), one.other.as_str())).collect();
        let pair = ("joint_zero(elbow)", "joint_gain(elbow)");
        assert_eq!(pairs, if listed && !same { vec![pair] } else { Vec::new() }, "{step}");
    }
    // The shoulder moves the point in other directions than the elbow.
    let of_shoulder = alike_over(0.002, |finding| {
        finding.stage.fitted_candidates.swap(0, 1);
        finding.correlated()
    });
    assert_eq!(of_shoulder, []);
}

/// Why the fitted candidate of this place is not the name.
fn rejection(
    fitted_candidates: Vec<FittedCandidate>,
    index: usize,
    verdict: Verdict,
    close: &[usize],
) -> Option<crate::outcome::Rejection> {
    finding_of_many(fitted_candidates, verdict, close, |finding| {
        finding.rejected(&finding.stage.fitted_candidates[index])
    })
}

fn finding_of_many<T>(
    fitted_candidates: Vec<FittedCandidate>,
    verdict: Verdict,
    close: &[usize],
    ask: impl Fn(&Finding<'_>) -> T,
) -> T {
    let fitted_candidates = std::cell::RefCell::new(fitted_candidates);
    finding_of(fitted_candidates.take(), |finding| {
        (finding.verdict, finding.close) = (verdict, close.to_vec());
        ask(finding)
    })
}

#[test]
fn what_is_not_named_is_rejected_for_the_first_thing_that_speaks_against_it() {
    use crate::outcome::Rejection;
    let with = |change: &dyn Fn(&mut FittedCandidate)| {
        let mut other = fitted_candidate("joint_zero", 0, 20.0);
        change(&mut other);
        rejection(vec![fitted_candidate("joint_gain", 1, 0.0), other], 1, Verdict::Named, &[0])
    };
    let worse = Some(Rejection::WorseThan("joint_gain(elbow)".to_owned()));
    assert_eq!(with(&|_| ()), worse);
    assert_eq!(with(&|one| one.holm_p = 0.003), Some(Rejection::NotSignificant(0.003)));
    assert_eq!(with(&|one| one.holm_p = 0.0029), worse);
    assert_eq!(with(&|one| one.score.plausible = false), Some(Rejection::Implausible));
    assert_eq!(with(&|one| one.outvoted = true), Some(Rejection::Outvoted));
    assert_eq!(with(&|one| one.gains.push(gain(0.5))), Some(Rejection::NotPredicted));
    let unasked = |one: &mut FittedCandidate| (one.refitted, one.gains) = (false, vec![gain(0.5)]);
    assert_eq!(with(&unasked), worse, "nobody asked whether it predicts");
}

#[test]
fn what_speaks_against_a_name_is_reported_as_what_it_is() {
    use crate::outcome::Rejection;
    let joint = Site::Joint(1);
    let all = || Evidence {
        left_over: lack(1e-9),
        unlisted_sites: vec![joint],
        uneven: vec![joint],
        flexible_terms_at: Some(joint),
        ..found()
    };
    let less = |change: fn(&mut Evidence)| {
        let mut evidence = all();
        change(&mut evidence);
        evidence.against_a_name_at(joint)
    };
    assert_eq!(less(|_| ()), Some(Against::Unlisted));
    assert_eq!(less(|one| one.unlisted_sites.clear()), Some(Against::LeftAlong));
    let flexible = |one: &mut Evidence| (one.unlisted_sites, one.uneven) = (Vec::new(), Vec::new());
    assert_eq!(less(flexible), Some(Against::FlexibleTerms));
    assert_eq!(all().against_a_name_at(Site::Joint(0)), Some(Against::LeftOver));
    assert_eq!(found().against_a_name_at(joint), None);
    let rejected = |against: Option<Against>| {
        finding_of(vec![fitted_candidate("joint_gain", 1, 0.0)], |finding| {
            (finding.verdict, finding.against) = (Verdict::Located, against);
            finding.rejected(&finding.stage.fitted_candidates[0]).unwrap()
        })
    };
    let elbow = || "elbow".to_owned();
    assert_eq!(rejected(Some(Against::Unlisted)), Rejection::UnlistedAt(elbow()));
    assert_eq!(rejected(Some(Against::LeftAlong)), Rejection::MoreLeftAt(elbow()));
    assert_eq!(rejected(Some(Against::FlexibleTerms)), Rejection::FlexibleTermsAt(elbow()));
    assert_eq!(rejected(Some(Against::LeftOver)), Rejection::MoreThanNoiseLeft);
    assert_eq!(rejected(None), Rejection::MoreThanNoiseLeft);
}

#[test]
fn the_best_is_rejected_only_where_it_is_not_named() {
    use crate::outcome::Rejection;
    let two = || vec![fitted_candidate("joint_gain", 1, 0.0), fitted_candidate("joint_zero", 0, 0.5)];
    assert_eq!(rejection(two(), 0, Verdict::Named, &[0]), None);
    assert_eq!(rejection(two(), 0, Verdict::Located, &[0]), Some(Rejection::MoreThanNoiseLeft));
    let other = |label: &str| Some(Rejection::IndistinguishableFrom(vec![label.to_owned()]));
    assert_eq!(rejection(two(), 0, Verdict::Tied, &[0, 1]), other("joint_zero(shoulder)"));
    assert_eq!(rejection(two(), 1, Verdict::Tied, &[0, 1]), other("joint_gain(elbow)"));
    // Of what is in question the best is not the likeliest of all.
    let worse = Some(Rejection::WorseThan("joint_gain(elbow)".to_owned()));
    assert_eq!(rejection(two(), 1, Verdict::Located, &[1]), worse);
    let held = finding_of(two(), |finding| {
        finding.free_first = Some("geometry(*)");
        [0, 1].map(|index| finding.rejected(&finding.stage.fitted_candidates[index]))
    });
    assert_eq!(held[0], Some(Rejection::HeldGeometry("geometry(*)")));
    assert_eq!(held[1], other("joint_gain(elbow)"));
}

#[test]
fn more_than_noise_is_left_where_the_rows_show_it_or_the_best_is_there_beyond_doubt() {
    let noisy = |lack_of_fit: Option<LackOfFit>, holm_p: f64| {
        let best = FittedCandidate { holm_p, ..fitted_candidate("joint_gain", 1, 0.0) };
        Evidence { lack_of_fit, ..Evidence::default() }.is_noisy(Some(&best))
    };
    assert!(noisy(lack(0.5), 0.99 * PRESENT_LEVEL) && !noisy(lack(0.5), PRESENT_LEVEL));
    assert!(noisy(lack(1e-9), 1.0) && !noisy(None, 0.0), "without a floor nobody knows");
    assert!(Evidence { lack_of_fit: lack(1e-9), ..Evidence::default() }.is_noisy(None));
    // Of readings that err alike the sum of all residuals decides alone.
    let best = FittedCandidate { holm_p: 0.0, ..fitted_candidate("joint_gain", 1, 0.0) };
    let alike = |p: f64| {
        Evidence { lack_of_fit: lack(p), errs_alike: true, ..Evidence::default() }.is_noisy(Some(&best))
    };
    assert!(!alike(0.5) && alike(1e-9));
    assert!(!Evidence { lack_of_fit: lack(0.5), ..Evidence::default() }.is_noisy(None));
}

#[test]
fn a_name_that_wrong_lengths_explain_as_well_is_taken_back_and_the_geometry_is_to_be_freed_first() {
    let asked = |longer: f64, verdict: Verdict, holm_p: f64| {
        let lab =
            crate::testing::two_links(80, "joint_zero(*)", 0.05, 21, |q| [0.0, (0.5 - longer) * 0.02 * q[1]]);
        let mut model = lab.model().clone();
        model.chain.joints.iter_mut().for_each(|joint| joint.a += longer);
        let lab = lab.with_model(model);
        let listed = crate::candidates::probes(&lab);
        let none = crate::candidates::Candidates { listed: Vec::new(), unlisted: Vec::new() };
        let mut stage = lab.stage(Vec::new(), None, &none, &plumb_estimation::Progress::unwatched()).unwrap();
        stage.fitted_candidates = vec![FittedCandidate { holm_p, ..fitted_candidate("joint_gain", 1, 0.0) }];
        let mut finding = finding_of_stage(stage);
        finding.verdict = verdict;
        let candidates = crate::candidates::Candidates { listed, unlisted: Vec::new() };
        let finding = finding
            .weighed(&lab, None, &candidates, &FLOOR, &plumb_estimation::Progress::unwatched())
            .unwrap();
        (finding.verdict, finding.free_first.is_some())
    };
    assert_eq!(asked(0.5, Verdict::Named, 1e-9), (Verdict::Tied, true));
    assert_eq!(asked(0.5, Verdict::Located, 1e-9), (Verdict::Located, true));
    assert_eq!(asked(0.5, Verdict::Named, NAMING_LEVEL), (Verdict::Named, false), "it is no find");
    assert_eq!(
        asked(0.0, Verdict::Named, 1e-9),
        (Verdict::Named, false),
        "the lengths are right, the gain is wrong"
    );
}

#[test]
fn directions_speak_of_what_turns_a_joint_and_not_of_links_or_of_what_is_no_effect() {
    let at = |name: &str| is_of_a_joint(&EffectId::at(name, Site::Joint(1)));
    assert!(at("joint_gain") && at("joint_backlash") && !at("link_length") && !at("no_effect"));
}

#[test]
fn each_candidate_has_its_own_probability() {
    let (first, second) = (fitted_candidate("joint_gain", 1, 0.0), fitted_candidate("joint_zero", 0, 2.0));
    let (known, listed) = finding_of(vec![first, second], |finding| {
        let known = finding.probabilities();
        let listed = finding.candidates(2, &FLOOR);
        (known, listed.iter().map(|candidate| candidate.probability).collect::<Vec<_>>())
    });
    let of = |index: usize| known.iter().find(|(one, _)| *one == index).map(|(_, likely)| *likely);
    assert_eq!(listed, [of(0), of(1)]);
    // A difference of 2 in the criterion is a factor of e between them.
    let ratio = listed[0].unwrap() / listed[1].unwrap();
    assert!((ratio - 1.0_f64.exp()).abs() < 1e-9, "{ratio}");
}

#[test]
fn something_without_a_name_is_a_rival_where_it_does_clearly_better_and_is_no_chance_find() {
    // The shoulder jumps five times a turn, as no effect of the library does.
    let rival = |size: f64, best: f64| {
        let teeth = |q: [f64; 2]| [size * (5.0 * q[0] / std::f64::consts::TAU).fract(), 0.0];
        let lab = crate::testing::two_links(150, "joint_zero(*)", 0.05, 17, teeth);
        let unlisted = crate::unlisted::probes(&lab);
        let none = crate::candidates::Candidates { listed: Vec::new(), unlisted: Vec::new() };
        let watch = plumb_estimation::Progress::unwatched();
        let mut stage = lab.stage(Vec::new(), None, &none, &watch).unwrap();
        stage.fitted_candidates =
            vec![FittedCandidate { bic: best, ..fitted_candidate("joint_gain", 0, 0.0) }];
        unlisted_against(&stage, &unlisted)
    };
    assert_eq!(rival(0.004, f64::INFINITY), Some(Site::Joint(0)));
    assert_eq!(rival(0.004, f64::NEG_INFINITY), None, "a candidate does better");
    assert_eq!(rival(0.0, f64::INFINITY), None, "there is nothing but noise");
}

#[test]
fn a_size_is_as_sure_as_blocks_of_rows_say_where_more_than_noise_is_left() {
    let of = |dirty: bool, block_errors: Vec<f64>, has_unseen: bool| {
        let mut one = FittedCandidate { block_errors, ..fitted_candidate("joint_gain", 1, 0.0) };
        one.score.has_unseen = has_unseen;
        finding_of(vec![one], |finding| {
            finding.dirty = dirty;
            finding.best().map(|best| finding.size(best).error).unwrap()
        })
    };
    let error = |dirty: bool, block_errors: Vec<f64>| of(dirty, block_errors, false);
    assert!((error(false, vec![0.02]) - 0.01).abs() < 1e-12, "noise is independent");
    assert!((error(true, vec![0.02]) - 0.02).abs() < 1e-12);
    assert!((error(true, vec![0.002]) - 0.01).abs() < 1e-12, "never surer than the fit");
    assert!((error(true, Vec::new()) - 0.01).abs() < 1e-12, "it was not refitted");
    // The size of what is seen alone has its own error, which grows by the same factor.
    assert!((of(true, vec![0.015], true) - 0.015).abs() < 1e-12);
    assert!((of(false, vec![0.015], true) - 0.01).abs() < 1e-12);
}
