//! The peer everyone tries first: plain correlation of the residuals with each effect's signature, free parameters not projected out of it.

use plumb_simulated::physics::campaign::Verdict;

use super::evidence::{Evidence, chi_square_tail, dot};
use plumb::commands::trial::score::{Candidate, Diagnosis};
use plumb_simulated::physics::campaign::audit::Basis;

/// Level at which the best correlation is believed, over all effects (Bonferroni).
const LEVEL: f64 = 0.01;

/// Ranks by correlation; names the first when it is beyond chance.
pub(super) fn diagnose(evidence: &Evidence) -> Diagnosis {
    let everything = vec![true; evidence.rows()];
    let residual = evidence.projected(&everything).residual;
    let total = dot(&residual, &residual);
    let mut ranked: Vec<(f64, usize, &super::evidence::Regressor)> = evidence
        .regressors
        .iter()
        .map(|regressor| {
            let span = Basis::of(regressor.columns.iter().cloned());
            let fraction = if total > 0.0 { span.length_within(&residual).powi(2) / total } else { 0.0 };
            (fraction, span.rank(), regressor)
        })
        .collect();
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
    let candidates: Vec<Candidate> =
        ranked.iter().map(|(_, _, regressor)| Candidate::at(regressor.effect, &regressor.site)).collect();
    let chance = ranked
        .first()
        .map_or(1.0, |(fraction, rank, _)| chi_square_tail(fraction * residual.len() as f64, *rank));
    let named = if chance * (ranked.len() as f64) < LEVEL { candidates.first().cloned() } else { None };
    Diagnosis {
        verdict: if named.is_some() { Verdict::Named } else { Verdict::AtFloor },
        named,
        candidates,
        ..Diagnosis::empty()
    }
}
