//! `plumb-studies inject --halves`: whether what one half of the rows names is confirmed by the other. Each half is diagnosed for itself; what it names is added
//! to the model that is fitted to the other half alone. It is confirmed where its size there differs by at most three standard errors of the difference.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use plumb_calibration::arm_model::Model;
use plumb_calibration::table::Table;
use plumb_diagnosis::Verdict;
use plumb_diagnosis::laboratory::{Laboratory, LaboratoryError, Options};
use plumb_estimation::Progress;

use crate::benchmark::halves::{Cut, changes_with_time, halves};
use crate::interval::Proportion;

/// Standard errors of their difference by which two sizes of one thing differ at most: 99.7 % of normal errors do.
const SAME_SIZE: f64 = 3.0;

/// What became of what one half named.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Named {
    /// It is what was hidden.
    is_right: bool,
    /// By how many standard errors of their difference its size differs in the other half; infinite where that does not determine it.
    off: f64,
}

impl Named {
    /// The other half has it with the same size.
    fn is_confirmed(&self) -> bool {
        self.off <= SAME_SIZE
    }
}

/// What halves named, cut each way.
#[derive(Debug, Default)]
pub(super) struct Replication {
    named: BTreeMap<&'static str, Vec<Named>>,
    /// Halves that were asked, and those that cannot be fitted: they have too few rows, as a rule.
    asked: BTreeMap<&'static str, [usize; 2]>,
}

impl Replication {
    /// Cuts a table each way and asks both halves. What happens once, or goes by time, is not cut by the order of the rows: it may be in one half alone.
    ///
    /// # Errors
    /// A half that can be fitted cannot be diagnosed.
    pub(super) fn ask(
        &mut self,
        (model, options): (&Model, &Options),
        text: &str,
        hidden: (&str, &str),
        seed: u64,
    ) -> Result<(), LaboratoryError> {
        let happens_once = changes_with_time(hidden.0);
        for cut in Cut::ALL.into_iter().filter(|cut| *cut != Cut::Order || !happens_once) {
            let parts = halves(text, cut, seed).map(|part| opened(model, options, &part));
            for (own, other) in [(0, 1), (1, 0)] {
                let asked = self.asked.entry(cut.name()).or_default();
                asked[0] += 1;
                let (Some(own), Some(other)) = (&parts[own], &parts[other]) else {
                    asked[1] += 1;
                    continue;
                };
                if let Some(named) = named_by(own, other, hidden)? {
                    self.named.entry(cut.name()).or_default().push(named);
                }
            }
        }
        Ok(())
    }

    /// Takes in what was asked of another set.
    pub(super) fn take(&mut self, other: &Self) {
        for (cut, named) in &other.named {
            self.named.entry(cut).or_default().extend(named);
        }
        for (cut, [asked, small]) in &other.asked {
            let sum = self.asked.entry(cut).or_default();
            *sum = [sum[0] + asked, sum[1] + small];
        }
    }

    /// A line for each way of cutting.
    pub(super) fn lines(&self, title: &str) -> String {
        let mut text = String::new();
        for (cut, [asked, small]) in &self.asked {
            let named = self.named.get(cut).map_or(&[][..], Vec::as_slice);
            let right = named.iter().filter(|one| one.is_right).count();
            let [all, of_right] = [
                Proportion::of(named.iter().map(Named::is_confirmed)),
                Proportion::of(named.iter().filter(|one| one.is_right).map(Named::is_confirmed)),
            ]
            .map(|fraction| fraction.percent());
            let mut off: Vec<f64> = named.iter().map(|one| one.off).collect();
            off.sort_by(f64::total_cmp);
            let middle = off.get(off.len() / 2).map_or_else(|| "-".to_owned(), |off| format!("{off:.2}"));
            // Writing to a text cannot fail.
            let _ = writeln!(
                text,
                "| {title} | {cut} | {asked} | {small} | {} | {right} | {all} | {of_right} | {middle} |",
                named.len()
            );
        }
        text
    }
}

/// The head of the table.
pub(super) const HEAD: &str = "| set | cut | halves | cannot be fitted | a name | the one hidden | confirmed by the other half, % | of those hidden, % | median difference, standard errors |\n|---|---|---|---|---|---|---|---|---|\n";

/// A half as a laboratory; nothing where it cannot be fitted.
fn opened(model: &Model, options: &Options, text: &str) -> Option<Laboratory> {
    let table = Table::parse("half", text).ok()?;
    let laboratory = Laboratory::new(model.clone(), table, options.clone()).ok()?;
    laboratory.compare(&Progress::unwatched()).is_ok().then_some(laboratory)
}

/// What one half names, and whether the other has it with the same size; nothing where it names nothing.
fn named_by(
    own: &Laboratory,
    other: &Laboratory,
    hidden: (&str, &str),
) -> Result<Option<Named>, LaboratoryError> {
    let progress = Progress::unwatched();
    let diagnosis = own.diagnose(&progress)?;
    let named = diagnosis.named.as_ref().filter(|_| diagnosis.verdict == Verdict::Named);
    let Some(named) = named else { return Ok(None) };
    let label = diagnosis.candidates.iter().find(|candidate| candidate.effect == named.effect);
    let Some(label) = label.map(|candidate| candidate.label.as_str()) else { return Ok(None) };
    let is_right = (named.effect.effect.as_str(), named.effect.site.as_str()) == hidden;
    // What the other rows cannot show is not confirmed by them.
    let sizes = match own.add(label, &progress).and_then(|here| Ok((here, other.add(label, &progress)?))) {
        Ok((here, there)) => here.added.first().cloned().zip(there.added.first().cloned()),
        Err(error) if error.is_cancelled() => return Err(error),
        Err(_) => None,
    };
    let off = sizes.map(|(here, there)| difference((here.size, here.se), (there.size, there.se)));
    Ok(Some(Named { is_right, off: off.unwrap_or(f64::INFINITY) }))
}

/// By how many standard errors of their difference two sizes differ; infinite without an error, by which nothing can be confirmed.
fn difference(one: (f64, f64), other: (f64, f64)) -> f64 {
    let off = (one.0 - other.0).abs() / one.1.hypot(other.1);
    if off.is_finite() && one.1.is_finite() && other.1.is_finite() { off } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_the_same_within_three_errors_of_their_difference() {
        let same = |one, other| Named { is_right: true, off: difference(one, other) }.is_confirmed();
        assert!(same((1.0, 0.03), (1.149, 0.04)), "0.149 of 3 times 0.05");
        assert!(!same((1.0, 0.03), (1.151, 0.04)));
        assert!(!same((1.0, 0.03), (-1.0, 0.04)), "the other way");
        assert!(!same((1.0, f64::NAN), (1.0, 0.1)) && !same((1.0, f64::INFINITY), (9.0, 0.1)));
        assert!(!same((1.0, 0.0), (1.0, 0.0)), "without an error nothing is confirmed");
        assert!((difference((1.0, 0.03), (1.1, 0.04)) - 2.0).abs() < 1e-9);
    }

    #[test]
    fn names_are_counted_by_cut_and_sets_are_added_up() {
        let mut one = Replication::default();
        let named = |is_right, off| Named { is_right, off };
        one.named.insert("by order", vec![named(true, 0.5), named(false, 2.9), named(true, f64::INFINITY)]);
        one.asked.insert("by order", [8, 2]);
        let line = one.lines("a");
        assert_eq!(line, "| a | by order | 8 | 2 | 3 | 2 | 66.7 [20.8, 93.9] | 50.0 [9.5, 90.5] | 2.90 |\n");
        let mut all = Replication::default();
        all.take(&one);
        all.take(&one);
        assert!(
            all.lines("all").starts_with("| all | by order | 16 | 4 | 6 | 4 | 66.7 "),
            "{}",
            all.lines("all")
        );
        let mut silent = Replication::default();
        silent.asked.insert("at random", [4, 0]);
        assert_eq!(silent.lines("b"), "| b | at random | 4 | 0 | 0 | 0 | - | - | - |\n");
    }

    #[test]
    fn what_one_half_names_is_confirmed_by_the_other_and_a_half_too_small_is_counted() {
        // A flat arm whose elbow turns 1 % too far.
        let model = "arm: two\nconvention: distal\njoints:\n  - {name: shoulder, a_mm: 300}\n  - {name: elbow, a_mm: 250}\nbase: {xyz_mm: [0, 0, 0], free: true}\ntargets: {p1: {xyz_mm: [0, 0, 0], free: false}}\nfree: [joint_zero(*)]\nnoise: {p1_mm: 0.05}\n";
        let model = Model::parse("arm.yaml", model).unwrap();
        let table = |rows: usize| {
            let mut random = plumb_estimation::Random::seeded(5);
            let mut text = "q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm\n".to_owned();
            for _ in 0..rows {
                let q = [280.0 * random.uniform() - 140.0, 220.0 * random.uniform() - 110.0];
                let (first, second) = (q[0].to_radians(), (q[0] + 1.01 * q[1]).to_radians());
                let at = [
                    300.0 * first.cos() + 250.0 * second.cos(),
                    300.0 * first.sin() + 250.0 * second.sin(),
                    0.0,
                ]
                .map(|part| part + 0.05 * random.normal());
                let _ = writeln!(text, "{},{},{},{},{}", q[0], q[1], at[0], at[1], at[2]);
            }
            text
        };
        let mut asked = Replication::default();
        let options = Options::default();
        asked.ask((&model, &options), &table(160), ("joint_gain", "elbow"), 1).unwrap();
        for cut in Cut::ALL.map(Cut::name) {
            assert_eq!(asked.asked[cut], [2, 0]);
            let named = &asked.named[cut];
            assert!(
                named.len() == 2 && named.iter().all(|one| one.is_right && one.is_confirmed()),
                "{cut}: {named:?}"
            );
        }
        asked.ask((&model, &options), &table(3), ("joint_gain", "elbow"), 1).unwrap();
        assert!(Cut::ALL.iter().all(|cut| asked.asked[cut.name()] == [4, 2]), "{:?}", asked.asked);
        let mut event = Replication::default();
        event.ask((&model, &options), &table(160), ("joint_step", "elbow"), 1).unwrap();
        assert!(!event.asked.contains_key(Cut::Order.name()) && event.asked.len() == 2);
        assert!(event.named.values().flatten().all(|one| !one.is_right), "that was not hidden");
    }
}
