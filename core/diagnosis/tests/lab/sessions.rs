//! A tracker that was set up anew for every session, and effects that are held because nothing moves them.

use plumb_diagnosis::laboratory::Options;
use plumb_diagnosis::split::Holdout;
use plumb_estimation::Progress;
use plumb_report::why_held_in_words;

use super::made_up::{COLUMN_ARM, Xorshift, column_poses, column_tip, laboratory, try_laboratory};

/// Positions of the column arm, read in three sessions from three places, metres apart; in session `b` after a half turn.
fn table(seed: u64) -> String {
    let mut rng = Xorshift::seeded(seed);
    let mut text = "q1_deg,q2_deg,q3_deg,p1_x_mm,p1_y_mm,p1_z_mm,session\n".to_owned();
    for (row, q) in column_poses(120, seed).into_iter().enumerate() {
        let [x, y, z] = column_tip(q).map(|part| part + rng.noise(0.02));
        let ([x, y, z], session) = match row / 40 {
            0 => ([x, y, z], "a"),
            1 => ([1500.0 - x, -y - 300.0, z + 40.0], "b"),
            _ => ([x + 20.0, y - 2500.0, z], "c"),
        };
        text.push_str(&format!("{},{},{},{x},{y},{z},{session}\n", q[0], q[1], q[2]));
    }
    text
}

fn model(base: &str) -> String {
    format!(
        "{COLUMN_ARM}base: {base}\ntargets: {{p1: {{}}}}\nfree: [joint_zero(*)]\nnoise: {{p1_mm: 0.02}}\n"
    )
}

#[test]
fn every_session_has_a_base_of_its_own() {
    for holdout in [Holdout::None, Holdout::Regions] {
        let options = Options { holdout, ..Options::default() };
        let lab = laboratory(&model("{per: session}"), &table(81), options);
        let comparison = lab.compare(&Progress::unwatched()).unwrap();
        assert!(comparison.rms_mm.fit < 0.05, "{:?}", comparison.rms_mm);
        assert!(comparison.rms_mm.check.is_none_or(|check| check < 0.06), "{:?}", comparison.rms_mm);
        let reset = comparison.effects.iter().find(|effect| effect.effect == "base_reset").unwrap();
        assert!(reset.size > 1000.0 && !reset.held, "{reset:?}");
    }
}

#[test]
fn a_base_for_each_session_needs_sessions_and_no_locked_session() {
    let unnamed: String =
        table(82).lines().map(|line| format!("{}\n", line.rsplit_once(',').unwrap().0)).collect();
    let message = try_laboratory(&model("{per: session}"), &unnamed, Options::default()).unwrap_err();
    assert!(message.contains("needs the column `session`"), "{message}");
    let options = Options { holdout: Holdout::Session, ..Options::default() };
    let message = try_laboratory(&model("{per: session}"), &table(82), options).unwrap_err();
    assert!(message.contains("choose another `--holdout`"), "{message}");
}

#[test]
fn an_effect_of_gravity_without_masses_is_held_and_says_why() {
    let model = model("{free: true}").replace("joint_zero(*)", "joint_compliance(*)");
    let one_session: String = table(83)
        .lines()
        .enumerate()
        .filter(|(row, _)| *row <= 40)
        .map(|(_, line)| format!("{line}\n"))
        .collect();
    let lab = laboratory(&model, &one_session, Options { holdout: Holdout::None, ..Options::default() });
    let comparison = lab.compare(&Progress::unwatched()).unwrap();
    for effect in &comparison.effects {
        let why = effect.held_because.as_ref().map_or_else(String::new, why_held_in_words);
        assert!(effect.held && why.contains("no masses are declared"), "{effect:?}");
        assert!(why.contains("declare `links:`"), "{why}");
    }
}
