//! Which variant of a family represents it and what its search costs, and what the candidates of a small arm are.

use nalgebra::DMatrix;

use super::*;
use crate::testing::two_links;
use plumb_calibration::effect::{Site, Size};

/// A probe of a family of its own making, which searches so.
fn probe(lab: &Laboratory, family: usize, search: Search) -> Probe {
    let id = EffectId::at("joint_gain", Site::Joint(0));
    let effect = Arc::from(effect::build(&id, lab.model()).unwrap());
    Probe { id, effect, search, family, weight: 1.0, search_cost: 0.0 }
}

fn scored(gain: f64) -> Score {
    Score {
        gain,
        freedom: 1,
        left: (100.0 - gain, 50.0),
        p: 0.001,
        values: vec![0.0],
        covariance: DMatrix::zeros(1, 1),
        beside: Vec::new(),
        size: Size { value: 0.0, unit: "", error: 0.0 },
        has_unseen: false,
        plausible: true,
        absorbed: 0.0,
        strength: 1.0,
    }
}

#[test]
fn the_best_variant_represents_its_family_and_pays_for_the_search() {
    let lab = two_links(8, "", 0.1, 1, |_| [0.0; 2]);
    let kinds = [
        (1, Search::Nothing),
        (2, Search::Jumps),
        (2, Search::Jumps),
        (2, Search::Jumps),
        (3, Search::Smooth),
    ];
    let probes = kinds.map(|(family, search)| probe(&lab, family, search));
    let found = best_variants(&probes, [4.0, 5.0, 9.0, 7.0, 8.0].map(scored).to_vec());
    let indices: Vec<usize> = found.iter().map(|(index, _)| *index).collect();
    assert_eq!(indices, [0, 2, 4]);
    assert_eq!(found[0].1.p, 0.001, "nothing was searched for");
    assert!((found[1].1.p - 0.003).abs() < 1e-15, "three moments are three tests");
    let mut charged = scored(8.0);
    charged.charge_parameter();
    assert_eq!(found[2].1.p, charged.p, "a number on which it depends smoothly is one parameter more");
}

#[test]
fn of_variants_that_gain_the_same_the_first_represents_their_family() {
    let lab = two_links(8, "", 0.1, 1, |_| [0.0; 2]);
    let probes = [1, 1, 1].map(|family| probe(&lab, family, Search::Nothing));
    let of_gains = |gains: [f64; 3]| best_variants(&probes, gains.map(scored).to_vec())[0].0;
    assert_eq!([[5.0, 5.0, 4.0], [4.0, 5.0, 5.0], [5.0, 4.0, 5.0]].map(of_gains), [0, 1, 0]);
}

#[test]
fn a_probability_of_many_moments_is_at_most_one() {
    let lab = two_links(8, "", 0.1, 1, |_| [0.0; 2]);
    let probes = [probe(&lab, 1, Search::Jumps), probe(&lab, 1, Search::Jumps)];
    let likely = Score { p: 0.7, ..scored(1.0) };
    assert_eq!(best_variants(&probes, vec![likely.clone(), likely])[0].1.p, 1.0);
}

#[test]
fn what_is_fitted_is_no_candidate_and_high_orders_weigh_less() {
    let lab = two_links(60, "joint_zero(*)", 0.1, 2, |_| [0.0; 2]);
    let probes = probes(&lab);
    assert!(probes.iter().all(|probe| probe.id.name != "joint_zero"));
    assert!(probes.iter().any(|probe| probe.id.name == "joint_gain"));
    let of_order = |order: f64| {
        let mut waves = probes.iter().filter(|probe| probe.id.name == "joint_harmonic");
        waves.find(|probe| probe.id.order == Some(order)).unwrap()
    };
    let (low, high) = (of_order(HIGH_ORDER), of_order(HIGH_ORDER + 1.0));
    assert_eq!((low.weight, low.search_cost), (1.0, 0.0));
    assert_eq!((high.weight, high.search_cost), (HIGH_ORDER_WEIGHT, 2.0 * ORDERS_SEARCHED.ln()));
    assert_ne!(low.family, high.family);
}

#[test]
fn an_effect_that_the_table_cannot_show_is_refused() {
    let lab = two_links(30, "", 0.1, 3, |_| [0.0; 2]);
    let warms = EffectId::at("drift", Site::Joint(0));
    if effect::kind("drift").is_some_and(|kind| kind.search != Search::Nothing) {
        let refused = lab.searched(warms, &Progress::unwatched()).unwrap_err().to_string();
        assert!(refused.contains("this table cannot show it"), "{refused}");
    }
    let plain = EffectId::at("joint_gain", Site::Joint(0));
    assert_eq!(
        lab.searched(plain.clone(), &Progress::unwatched()).unwrap(),
        plain,
        "nothing is searched for"
    );
}

#[test]
fn of_equal_variants_the_first_remains_and_what_adds_nothing_is_not_charged() {
    let lab = two_links(8, "", 0.1, 1, |_| [0.0; 2]);
    let probes =
        [probe(&lab, 1, Search::Nothing), probe(&lab, 1, Search::Nothing), probe(&lab, 2, Search::Smooth)];
    let absorbed = Score { freedom: 0, p: 1.0, ..scored(0.0) };
    let found = best_variants(&probes, vec![scored(5.0), scored(5.0), absorbed.clone()]);
    assert_eq!((found[0].0, found[1].0), (0, 2));
    assert_eq!((found[1].1.p, found[1].1.freedom), (absorbed.p, 0));
}

#[test]
fn only_what_is_searched_for_and_not_known_yet_is_searched() {
    let jumps = |q: [f64; 2]| [0.0, if q[0] > 0.0 { 0.003 } else { 0.0 }];
    let lab = two_links(60, "joint_zero(*)", 0.05, 2, jumps);
    let searched =
        |id: &EffectId| lab.searched(id.clone(), &plumb_estimation::Progress::unwatched()).unwrap();
    let gain = EffectId::at("joint_gain", Site::Joint(1));
    assert_eq!(searched(&gain), gain, "nothing is searched for in it");
    let step = EffectId::at("joint_step", Site::Joint(1));
    assert!(searched(&step).inner.is_some());
    let known = EffectId { inner: Some(3.5), ..step };
    assert_eq!(searched(&known), known);
}

#[test]
fn a_smooth_search_for_an_effect_that_moves_nothing_here_costs_nothing() {
    let lab = two_links(8, "", 0.1, 1, |_| [0.0; 2]);
    let nothing = Score { freedom: 0, ..scored(0.0) };
    let found = best_variants(&[probe(&lab, 1, Search::Smooth)], vec![nothing.clone()]);
    assert_eq!((found[0].1.p, found[0].1.freedom), (nothing.p, 0));
}

#[test]
fn every_date_of_a_jump_costs_a_search_among_the_equations() {
    let lab = two_links(8, "joint_zero(*)", 0.1, 1, |_| [0.0; 2]);
    let cost = |epochs: Option<Epochs>| {
        let mut model = lab.model().clone();
        model.epochs = epochs;
        cost_of_dates(&lab.with_model(model))
    };
    // Eight rows of three coordinates; a jump costs twice the logarithm.
    let one = 2.0 * 24.0_f64.ln();
    assert!((cost(Some(Epochs::Rows(vec![3, 6]))) - 2.0 * one).abs() < 1e-12);
    assert!((cost(Some(Epochs::Times(vec![5.0, 7.0, 9.0]))) - 3.0 * one).abs() < 1e-12);
    assert_eq!(cost(None), 0.0);
}

#[test]
fn the_search_for_an_effect_costs_what_its_place_and_its_kind_of_search_cost() {
    let lab = two_links(8, "", 0.1, 1, |_| [0.0; 2]);
    let with = |name: &str, search: Search, search_cost: f64| Probe {
        id: EffectId::at(name, Site::Joint(0)),
        search_cost,
        ..probe(&lab, 1, search)
    };
    let listed = vec![with("joint_gain", Search::Smooth, 3.0), with("joint_step", Search::Jumps, 0.0)];
    let candidates = Candidates { listed, unlisted: vec![with("warm_up", Search::Jumps, 1.0)] };
    let cost = |name: &str| candidates.search_cost(&EffectId::at(name, Site::Joint(0)), 24.0);
    assert!((cost("joint_gain") - 3.0 - 24.0_f64.ln()).abs() < 1e-12);
    assert!((cost("joint_step") - 2.0 * 24.0_f64.ln()).abs() < 1e-12);
    assert_eq!((cost("warm_up"), cost("drift")), (0.0, 0.0), "of one without a name, and of no candidate");
    assert_eq!(candidates.search_cost(&EffectId::at("joint_gain", Site::Joint(1)), 24.0), 0.0, "elsewhere");
}

#[test]
fn each_definition_of_the_model_file_is_a_family_of_its_own() {
    let definition = |name: &str| {
        format!(
            "  - {{name: {name}, adds: {{joint: elbow, deg: \"a*sin(7*q1)\"}}, parameters: {{a: {{unit: deg, range: [-1, 1]}}}}}}\n"
        )
    };
    let lines = format!("free: []\ndefine:\n{}{}", definition("tooth"), definition("claw"));
    let lab = crate::testing::two_links_with(&lines, 20, 0.1, 1, |_| [0.0; 2]);
    let probes = probes(&lab);
    let own: Vec<usize> = probes.iter().rev().take(2).map(|probe| probe.family).collect();
    let library = probes.iter().rev().skip(2).map(|probe| probe.family).max().unwrap();
    assert_eq!(own, [library + 2, library + 1], "the definitions come last");
}
