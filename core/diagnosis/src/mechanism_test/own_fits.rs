//! Each effect asked about the fit in which it is, where its rivals are asked about theirs.

use super::asked::gain_of;
use super::linearization::may_be_in;
use super::{Mechanism, rules};
use crate::forward_selection::{FittedCandidate, Stage};
use crate::laboratory::{Laboratory, LaboratoryError};
use crate::score_test::Probe;
use crate::thresholds::{EVIDENCE_CANDIDATES, TIE_BIC};
use plumb_estimation::Progress;

/// Other effects at the site of what was found that are asked about their own fit at most: those behind explain much less.
const RIVALS_ASKED: usize = 3;

/// The likeliest other effects at the site of what was found, where they take nearly as much from what is left.
fn rivals_at_its_site(stage: &Stage<'_>, found: &Mechanism) -> Vec<usize> {
    let Some(foremost) = found.close.first().copied() else { return Vec::new() };
    let own = stage.fitted_candidates.get(foremost).filter(|own| may_be_in(own));
    let Some(own) = own else { return Vec::new() };
    let others = stage.fitted_candidates.iter().enumerate().take(EVIDENCE_CANDIDATES);
    let rivals = others.filter(|(index, one)| {
        // What is tied with it already is no less a rival at its own fit.
        !found.close.contains(index)
            && may_be_in(one)
            && one.id.site == own.id.site
            && rules::is_close_to(gain_of(stage, one), gain_of(stage, own))
    });
    rivals.map(|(index, _)| index).take(RIVALS_ASKED).collect()
}

impl Mechanism {
    /// What is found of two, each of the fit with its own foremost in: that which makes the rows likelier, or both where neither makes them much likelier.
    fn or(self, other: Self) -> Self {
        if self.close.first() == other.close.first() {
            return self;
        }
        let (mut better, worse) =
            if other.criterion < self.criterion { (other, self) } else { (self, other) };
        if worse.criterion - better.criterion < TIE_BIC {
            better.close.extend(worse.close.first().filter(|first| !better.close.contains(first)));
        }
        better
    }
}

impl Laboratory {
    /// Asks the fitted candidates of a stage beside a flexible part, about the fit with the likeliest in. Where others at the same place do nearly as much they are asked about
    /// the fits with them in, too: each is weighed where it fits best (Laplace's approximation, Kass & Raftery 1995, section 4.1).
    ///
    /// # Errors
    /// Nothing can be fitted, or cancellation.
    pub(crate) fn mechanism_of(
        &self,
        stage: &Stage<'_>,
        unlisted: &[Probe],
        progress: &Progress,
    ) -> Result<Option<Mechanism>, LaboratoryError> {
        let Some(best) = stage.fitted_candidates.iter().position(FittedCandidate::is_plausible) else {
            return Ok(None);
        };
        let about = self.linearized(stage, best, progress)?;
        let Some(mut found) = Mechanism::of(stage, &about, unlisted) else { return Ok(None) };
        let rivals = if found.is_reported() { rivals_at_its_site(stage, &found) } else { Vec::new() };
        for rival in rivals {
            let about = self.linearized(stage, rival, progress)?;
            if let Some(other) = Mechanism::of(stage, &about, unlisted) {
                found = found.or(other);
            }
        }
        Ok(Some(found))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mechanism_test::Doubt;
    use crate::testing::{TWO_LINKS, fitted_candidate, two_links};
    use plumb_calibration::arm_model::Model;
    use plumb_calibration::table::Table;
    use plumb_estimation::Random;

    /// What was found, with this foremost and criterion.
    fn found(foremost: usize, criterion: f64) -> Mechanism {
        Mechanism { criterion, ..Mechanism::made(vec![foremost], None) }
    }

    #[test]
    fn of_two_that_were_found_the_much_likelier_one_stays_and_of_two_about_as_likely_both() {
        let close =
            |one: (usize, f64), other: (usize, f64)| found(one.0, one.1).or(found(other.0, other.1)).close;
        let (near, far) = (0.9 * TIE_BIC, 1.1 * TIE_BIC);
        assert_eq!(close((0, 100.0), (1, 100.0 + far)), [0]);
        assert_eq!(close((0, 100.0 + far), (1, 100.0)), [1]);
        assert_eq!(close((0, 100.0), (1, 100.0 + near)), [0, 1]);
        assert_eq!(close((0, 100.0 + near), (1, 100.0)), [1, 0]);
        assert_eq!(close((0, 100.0), (0, 100.0 - far)), [0], "both found the same");
        // What is said against the likelier one stays said.
        let doubted = Mechanism { doubt: Some(Doubt::Smooth), ..found(1, 100.0) };
        assert_eq!(found(0, 100.0 + far).or(doubted).doubt, Some(Doubt::Smooth));
    }

    #[test]
    fn rivals_are_at_the_same_place_take_nearly_as_much_and_are_no_events() {
        let lab = two_links(20, "joint_zero(*)", 0.05, 31, |_| [0.0; 2]);
        let none = crate::candidates::Candidates { listed: Vec::new(), unlisted: Vec::new() };
        let mut stage = lab.stage(Vec::new(), None, &none, &Progress::unwatched()).unwrap();
        stage.fitted.fit.normal.squares = 1000.0;
        let with = |name: &str, joint: usize, left: f64| FittedCandidate {
            left: (left, 50.0),
            refitted: true,
            ..fitted_candidate(name, joint, 0.0)
        };
        let mut not_refitted = with("joint_coupling", 1, 100.0);
        not_refitted.refitted = false;
        stage.fitted_candidates = vec![
            with("joint_gain", 1, 100.0),
            with("joint_harmonic", 0, 100.0),
            with("joint_step", 1, 100.0),
            not_refitted,
            with("joint_harmonic", 1, 200.0),
            with("joint_settling", 1, 980.0),
        ];
        assert_eq!(rivals_at_its_site(&stage, &found(0, 0.0)), [4]);
        assert_eq!(
            rivals_at_its_site(&stage, &found(2, 0.0)),
            [0_usize; 0],
            "an event takes other numbers with it"
        );
        stage.fitted_candidates.extend((0..4).map(|_| with("joint_harmonic", 1, 200.0)));
        assert_eq!(rivals_at_its_site(&stage, &found(0, 0.0)), [4, 6, 7]);
        let tied = Mechanism::made(vec![0, 4], None);
        assert_eq!(rivals_at_its_site(&stage, &tied), [6, 7, 8]);
    }

    /// An arm in a narrow window, both of whose lengths and whose base are free, with so much of a gain at the elbow, among a little of what nobody lists.
    fn narrow(gain: f64) -> Laboratory {
        let mut random = Random::seeded(77);
        let mut text = "q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm\n".to_owned();
        for _ in 0..200 {
            let q = [80.0 * random.uniform() - 40.0, 40.0 + 60.0 * random.uniform()];
            let [one, two] = q.map(f64::to_radians);
            let dirt = 0.0005 * (5.0 * one + 4.0 * two).sin();
            let second = one + two * (1.0 + gain) + dirt;
            let x = 200.0 * one.cos() + 150.0 * second.cos() + 0.02 * random.normal();
            let y = 200.0 * one.sin() + 150.0 * second.sin() + 0.02 * random.normal();
            text.push_str(&format!(
                "{:.17},{:.17},{x:.9},{y:.9},{:.9}\n",
                q[0],
                q[1],
                0.02 * random.normal()
            ));
        }
        let lines = "free: [joint_zero(*), link_length(*)]\n";
        let arm = TWO_LINKS.replace("base: {xyz_mm: [0, 0, 0], free: false}", "base: {free: true}");
        let model = Model::parse("model.yaml", &format!("{arm}{lines}")).unwrap();
        Laboratory::new(
            model,
            Table::parse("table.csv", &text).unwrap(),
            crate::laboratory::Options::default(),
        )
        .unwrap()
    }

    #[test]
    fn a_large_gain_that_geometry_takes_up_for_the_most_part_is_named() {
        for gain in [0.01, 0.04] {
            let diagnosis = narrow(gain).diagnose(&Progress::unwatched()).unwrap();
            let named = diagnosis.named.as_ref().unwrap_or_else(|| panic!("{gain}: {diagnosis:#?}"));
            assert_eq!((named.effect.effect.as_str(), named.effect.site.as_str()), ("joint_gain", "elbow"));
            assert!((named.size - gain).abs() < 4.0 * named.se, "{named:?}");
        }
    }
}
