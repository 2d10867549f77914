//! An effect that no library lists: where something is left that nothing named explains, a formula is searched for over the angles, moments, sides, moves, time, temperature and
//! load that the table logs: products of two, steps, slopes and waves, at every joint and at the base. It is offered as a ready `define:` block and marked a hypothesis;
//! nothing is named by it and nothing added.

mod forms;
mod grammar;
mod twins;

#[cfg(test)]
mod tests;

use std::sync::Arc;

use serde::Serialize;

use crate::candidates::{self, Candidates, best_variants};
use crate::fitted::Fitted;
use crate::forward_selection::FittedCandidate;
use crate::laboratory::{ErrorSummary, Laboratory, LaboratoryError, point_squares};
use crate::noise_floor::Floor;
use crate::score_test::{Probe, Score, score};
use crate::thresholds::{HYPOTHESES_REFITTED, HYPOTHESIS_ROWS, HYPOTHESIS_SHARE, NAMING_LEVEL, TIE_BIC};
use forms::{Candidate, Form, FormSite};
use plumb_calibration::arm_model::Model;
use plumb_calibration::effect::{self, Addend, Definition, Effect, EffectId, FormulaTarget};
use plumb_calibration::file::FilePosition;
use plumb_calibration::fit::{Fit, FitOptions};
use plumb_calibration::measurement::ReadingUnit;
use plumb_estimation::{Progress, bic, holm};

/// A formula for an effect that the library does not list.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Hypothesis {
    /// Where it acts: a joint, or `base`.
    #[serde(rename = "place")]
    pub site: String,
    /// What is added there.
    pub formula: String,
    /// Values of its parameters, with their standard errors.
    pub values: Vec<HypothesisValue>,
    /// Fraction of the squares beyond the noise that it takes away; of all squares where nobody knows the noise.
    pub explains: f64,
    /// The unit of the two errors: that of the table's readings.
    pub unit: ReadingUnit,
    /// Root mean square error of a point of the rows that were searched, without it and with it.
    pub before_mm: f64,
    /// See `before_mm`.
    pub after_mm: f64,
    /// Other formulas that do as well, as they are written.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub or: Vec<String>,
    /// The block for the model file; the effect it defines is called [`HYPOTHESIS`].
    pub define: String,
}

/// One number of a formula.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HypothesisValue {
    /// Its name in the formula.
    pub name: String,
    /// Value, in `unit`.
    pub value: f64,
    /// Its standard error.
    pub se: f64,
    /// Unit.
    pub unit: &'static str,
}

/// A form with its score.
struct Scored {
    form: Form,
    score: Score,
    bic: f64,
    holm_p: f64,
}

impl Laboratory {
    /// A formula that explains what the model as it is leaves, if one does better than every effect of the library.
    pub(crate) fn hypothesis(
        &self,
        floor: &Floor,
        progress: &Progress,
    ) -> Result<Option<Hypothesis>, LaboratoryError> {
        if let Some(plain) = self.without_map() {
            return plain.hypothesis(floor, progress);
        }
        progress.report(0.9, "looking for a formula")?;
        let thin = self.thinned(HYPOTHESIS_ROWS);
        let searched = thin.as_ref().unwrap_or(self);
        let robust = searched.fit_with(&[], None, progress)?;
        let ones = vec![1.0; searched.table().len()];
        let plain = FitOptions { robust: false, ..searched.options().fit };
        let fitted = searched.fit_near(&[], &robust, (&robust.inliers(), &ones), plain, progress)?;
        let scored = searched.scored_forms(&fitted);
        let Some(best) = searched.borne_out(&scored, &fitted, floor, progress)? else { return Ok(None) };
        let candidates = grammar::probes(searched);
        // Of its own site: the direction of what is left names the site well, and forms of others would only dilute the test.
        let at_site = candidates.iter().filter(|(form, _)| form.site == best.form.site);
        let effects: Vec<&dyn Effect> = at_site.map(|(_, probe)| probe.effect.as_ref()).collect();
        if !twins::beaten(&fitted, &Candidate::new(best.form), &effects) {
            return Ok(None);
        }
        Ok(Some(best.hypothesis))
    }

    /// The best of every family of forms that chance would hardly have made, the likeliest first; nothing where an effect of the library does as well.
    fn scored_forms(&self, fitted: &Fitted<'_>) -> Vec<Scored> {
        let forms = grammar::probes(self);
        let (forms, probes): (Vec<Form>, Vec<Probe>) = forms.into_iter().unzip();
        // Extended BIC (Chen & Chen 2008): choosing one form among so many costs 2 ln of their number.
        let families = probes.last().map_or(1, |last| last.family).max(1) as f64;
        let fit = &fitted.fit;
        let (squares, equations, rank) = (fit.normal.squares, fit.normal.equations as f64, fit.rank() as f64);
        let listed = candidates::probes(self);
        let scores = best_variants(&listed, score(&fitted.problem, fit, &listed));
        let library = scores
            .iter()
            .filter(|(_, score)| score.freedom > 0 && score.plausible)
            .filter_map(|(index, score)| {
                let probe = listed.get(*index)?;
                Some(criterion(fit, score, probe.search_cost + probe.search.cost(equations)))
            })
            .fold(bic(squares, equations, rank, 0.0), f64::min);
        let scores = best_variants(&probes, score(&fitted.problem, fit, &probes));
        let adjusted =
            holm(&scores.iter().map(|(_, score)| score.p).collect::<Vec<_>>(), &vec![1.0; scores.len()]);
        let mut found: Vec<Scored> = scores
            .into_iter()
            .zip(adjusted)
            .filter_map(|((index, score), holm_p)| {
                let cost = probes.get(index)?.search.cost(equations) + 2.0 * families.ln();
                Some(Scored { form: *forms.get(index)?, bic: criterion(fit, &score, cost), score, holm_p })
            })
            .filter(|one| one.score.freedom == one.form.parameters().len() && one.score.plausible)
            .filter(|one| one.holm_p < NAMING_LEVEL && one.bic < library - TIE_BIC)
            .collect();
        found.sort_by(|left, right| left.bic.total_cmp(&right.bic));
        found.truncate(HYPOTHESES_REFITTED);
        found.into_iter().map(|one| self.refined(one, fitted)).collect()
    }

    /// A form with its searched number where it explains most.
    fn refined(&self, scored: Scored, fitted: &Fitted<'_>) -> Scored {
        let (forms, probes): (Vec<Form>, Vec<Probe>) = grammar::finer(self, &scored.form).into_iter().unzip();
        let scores = score(&fitted.problem, &fitted.fit, &probes);
        let tried = forms.into_iter().zip(scores);
        let best = tried.max_by(|left, right| plausible_gain(&left.1).total_cmp(&plausible_gain(&right.1)));
        match best.filter(|(_, score)| plausible_gain(score) > plausible_gain(&scored.score)) {
            Some((form, score)) => Scored { form, score, ..scored },
            None => scored,
        }
    }

    /// The best of the scored forms that, written as a `define:` block and fitted like any effect, predicts rows left out and explains enough.
    fn borne_out(
        &self,
        scored: &[Scored],
        fitted: &Fitted<'_>,
        floor: &Floor,
        progress: &Progress,
    ) -> Result<Option<BorneOut>, LaboratoryError> {
        if scored.is_empty() {
            return Ok(None);
        }
        let mut model = self.model().clone();
        let mut listed = Vec::new();
        for (index, one) in scored.iter().enumerate() {
            let Some(definition) = definition(&format!("hypothesis_{index}"), &one.form, &model) else {
                continue;
            };
            let id = EffectId::at(&definition.name, definition.site);
            model.definitions.push(Arc::new(definition));
            listed.push((index, id));
        }
        let lab = self.with_model(model);
        let probes = listed.iter().filter_map(|(index, id)| {
            let effect = effect::build(id, lab.model()).ok()?;
            let search = plumb_calibration::effect::Search::Nothing;
            Some(Probe {
                id: id.clone(),
                effect: Arc::from(effect),
                search,
                family: *index,
                weight: 1.0,
                search_cost: 0.0,
            })
        });
        let candidates = Candidates { listed: probes.collect(), unlisted: Vec::new() };
        let stage = lab.stage(Vec::new(), Some(fitted), &candidates, progress)?;
        let passing = stage.fitted_candidates.iter().filter(|one| one.passes()).filter_map(|one| {
            let (index, _) = listed.iter().find(|(_, id)| id.same_as(&one.id))?;
            Some((one, scored.get(*index)?))
        });
        let passing: Vec<(&FittedCandidate, &Scored)> = passing.collect();
        let Some((best, own)) = passing.first() else { return Ok(None) };
        let explains = explained(&stage.fitted, best, floor);
        // A formula is a claim about the whole of what is left; one that takes a part of it is more likely the shadow of something else.
        if explains < HYPOTHESIS_SHARE {
            return Ok(None);
        }
        // A formula is one way of writing what the rows show: others that show it as well are reported beside it.
        let as_well = passing.iter().skip(1).filter(|(one, _)| one.bic - best.bic < TIE_BIC);
        let or = as_well.map(|(_, scored)| self.written(&scored.form)).collect();
        let errors = lab.errors_with(best, &stage.fitted, progress)?;
        Ok(Some(BorneOut {
            form: own.form,
            hypothesis: self.to_hypothesis(&own.form, best, explains, errors, or),
        }))
    }

    /// Root mean square error of the fitted points without and with a fitted candidate, mm.
    fn errors_with(
        &self,
        fitted_candidate: &FittedCandidate,
        fitted: &Fitted<'_>,
        progress: &Progress,
    ) -> Result<(f64, f64), LaboratoryError> {
        let added = plumb_calibration::arm_model::AddedEffect {
            id: fitted_candidate.id.clone(),
            values: fitted_candidate.values.clone(),
        };
        let plain = FitOptions { robust: false, ..self.options().fit };
        let with = self.fit_to_compare(&[added], fitted, &fitted_candidate.score.beside, plain, progress)?;
        Ok((rms(fitted), rms(&with)))
    }

    /// What is added where, as one line.
    fn written(&self, form: &Form) -> String {
        let formulas: Vec<String> =
            form.formulas().iter().map(|(key, formula)| format!("{key}: {formula}")).collect();
        format!("{} {}", self.model().site_name(grammar::site_of(form.site)), formulas.join(", "))
    }

    fn to_hypothesis(
        &self,
        form: &Form,
        best: &FittedCandidate,
        explains: f64,
        (before_mm, after_mm): (f64, f64),
        or: Vec<String>,
    ) -> Hypothesis {
        let site = self.model().site_name(grammar::site_of(form.site));
        let values = form.parameters().into_iter().enumerate().map(|(index, parameter)| HypothesisValue {
            name: parameter.name,
            value: best.values.get(index).copied().unwrap_or(f64::NAN),
            se: best.covariance.get((index, index)).map_or(f64::NAN, |variance| variance.max(0.0).sqrt()),
            unit: parameter.unit.name,
        });
        let formula = form.formulas().into_iter().map(|(key, formula)| format!("{key}: {formula}"));
        let formula = formula.collect::<Vec<_>>().join(", ");
        let define = block(form, &site);
        Hypothesis {
            site,
            formula,
            values: values.collect(),
            explains,
            unit: self.observations().unit(),
            before_mm,
            after_mm,
            or,
            define,
        }
    }
}

/// Schwarz's criterion of a fit with what a score promises in, and a cost besides.
fn criterion(fit: &Fit, score: &Score, cost: f64) -> f64 {
    let squares = fit.normal.squares;
    let left = (squares - score.gain).max(squares * 1e-9);
    bic(left, fit.normal.equations as f64, fit.rank() as f64 + score.freedom as f64, cost)
}

/// What a score explains, where its size could be that of a real machine.
fn plausible_gain(score: &Score) -> f64 {
    if score.plausible { score.gain } else { 0.0 }
}

/// A form that passed every test but that of its twins.
struct BorneOut {
    form: Form,
    hypothesis: Hypothesis,
}

/// The name of the effect in the block that is offered.
pub const HYPOTHESIS: &str = "hypothesis";

/// Root mean square error of the fitted points, in the unit of the table's readings.
fn rms(fitted: &Fitted<'_>) -> f64 {
    let squares =
        fitted.fit.rows.iter().flat_map(|row| point_squares(&fitted.problem, &fitted.fit.residuals, *row));
    ErrorSummary::or_zero(ErrorSummary::of(squares)).rms
}

/// Fraction of the squares beyond the noise that a fitted candidate takes away; of all of them where nobody knows the noise.
fn explained(fitted: &Fitted<'_>, fitted_candidate: &FittedCandidate, floor: &Floor) -> f64 {
    let before = fitted.fit.normal.squares;
    let freedom = (fitted.fit.normal.equations as f64 - fitted.fit.rank() as f64).max(1.0);
    // The noise's own share of the squares is not to be explained.
    let noise = floor.scale.map_or(0.0, |scale| scale * scale * freedom);
    let beyond = (before - noise).max(f64::MIN_POSITIVE);
    ((before - fitted_candidate.left.0) / beyond).clamp(0.0, 1.0)
}

/// The definition that a model file with the block would hold.
fn definition(name: &str, form: &Form, model: &Model) -> Option<Definition> {
    let parameters = form.parameters();
    let names: Vec<String> = parameters.iter().map(|parameter| parameter.name.clone()).collect();
    let addends = form.formulas().into_iter().enumerate().map(|(index, (key, formula))| {
        let target = match form.site {
            FormSite::Joint { joint, .. } => FormulaTarget::Coordinate(joint),
            FormSite::Base => FormulaTarget::BaseRotation(index),
        };
        Addend::new(target, key, &formula, &names, model.chain.len(), FilePosition::default()).ok()
    });
    let addends = addends.collect::<Option<Vec<_>>>()?;
    Some(Definition::new(name, grammar::site_of(form.site), addends, parameters, None))
}

/// The `define:` block of a form, as it is pasted into a model file.
fn block(form: &Form, site: &str) -> String {
    let at = match form.site {
        FormSite::Joint { .. } => format!("joint: {site}, "),
        FormSite::Base => String::new(),
    };
    let formulas: Vec<String> =
        form.formulas().into_iter().map(|(key, formula)| format!("{key}: \"{formula}\"")).collect();
    let parameters: Vec<String> = form
        .parameters()
        .into_iter()
        .map(|one| {
            format!("{}: {{unit: {}, range: [{}, {}]}}", one.name, one.unit.name, one.range.0, one.range.1)
        })
        .collect();
    format!(
        "define:\n  - name: {HYPOTHESIS}\n    where: {site}\n    adds: {{{at}{}}}\n    parameters: {{{}}}\n",
        formulas.join(", "),
        parameters.join(", ")
    )
}
