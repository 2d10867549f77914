//! What the world says can be seen of an effect, against what is known of it.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use plumb_simulated::physics::arms;
use plumb_simulated::physics::campaign::audit::Audit;
use plumb_simulated::physics::campaign::specification::{Free, Specification, Spread};
use plumb_simulated::physics::campaign::{self, poses};
use plumb_simulated::physics::imperfection::{Imperfection, Mechanism};

fn usual(arm: &str) -> Specification {
    Specification::usual(arms::by_name(arm).unwrap().unwrap())
}

/// Share of what a mechanism does that the free parameters cannot imitate.
fn visible_fraction(specification: &Specification, mechanism: Mechanism) -> f64 {
    let visits = poses::plan(specification, 1);
    let audit = Audit::new(specification, &visits, &[]).unwrap();
    let imperfection = Imperfection { size: mechanism.small_size(), mechanism };
    audit.visible_rms(&imperfection).unwrap() / audit.moved_rms(&imperfection).unwrap()
}

#[test]
fn what_is_free_already_is_swallowed_whole() {
    let zeros = usual("puma560");
    let geometry = Specification { free: Free::Geometry, ..usual("puma560") };
    assert!(visible_fraction(&zeros, Mechanism::JointZero { joint: 2 }) < 1e-3);
    assert!(visible_fraction(&zeros, Mechanism::BaseTilt { axis: [0.6, 0.8, 0.0] }) < 1e-3);
    assert!(visible_fraction(&zeros, Mechanism::LinkLength { joint: 1 }) > 0.3);
    assert!(visible_fraction(&geometry, Mechanism::LinkLength { joint: 1 }) < 1e-3);
}

#[test]
fn effects_that_the_base_or_the_target_imitate_cannot_be_seen() {
    let zeros = usual("puma560");
    // The first offset lifts the whole arm, as the base does; the last one moves the target along the flange's axis.
    assert!(visible_fraction(&zeros, Mechanism::LinkOffset { joint: 0 }) < 1e-3);
    assert!(visible_fraction(&zeros, Mechanism::LinkOffset { joint: 5 }) < 1e-3);
    // Two offsets along parallel axes are one.
    let visits = poses::plan(&zeros, 1);
    let audit = Audit::new(&zeros, &visits, &[]).unwrap();
    let alike = audit.look_alikes(&Mechanism::LinkOffset { joint: 1 }, 0.99).unwrap();
    assert!(alike.iter().any(|one| one.effect == "link_offset" && one.site == "elbow"), "{alike:?}");
}

#[test]
fn narrow_poses_hide_more_than_wide_ones() {
    let wide = usual("puma560");
    let narrow = Specification { spread: Spread::Narrow, ..usual("puma560") };
    let gain = Mechanism::JointGain { joint: 1 };
    assert!(visible_fraction(&narrow, gain.clone()) < 0.5 * visible_fraction(&wide, gain));
}

#[test]
fn what_is_hidden_at_random_can_be_seen() {
    use plumb_simulated::physics::campaign::catalogue::Choice;
    use plumb_simulated::physics::campaign::specification::{Requested, Size};
    for (name, _) in arms::ARMS {
        let expected = Requested { choice: Choice::named("any"), size: Size::OverNoise(3.0) };
        let specification = Specification { hidden: vec![expected], ..usual(name) };
        for seed in 0..20 {
            let made = campaign::generate(&specification, seed).unwrap();
            let hidden = &made.truth.hidden[0];
            assert!(hidden.visible_over_noise > 0.4, "{name}, seed {seed}: {hidden:?}");
            let greatest = made.imperfections[0].mechanism.greatest_plausible(&specification.arm);
            assert!(made.imperfections[0].size.abs() <= greatest);
        }
    }
}
