//! What a candidate would do, before it is added.

use serde::Serialize;

use super::addition::moved;
use super::comparison::{EffectValue, Rms};
use super::rows::{RowResidual, Series, row_residuals, series};
use super::{Laboratory, LaboratoryError};
use plumb_calibration::arm_model::AddedEffect;
use plumb_calibration::effect;
use plumb_estimation::Progress;

/// The residuals as they would be with a candidate in.
#[derive(Debug, Clone, Serialize)]
pub struct Preview {
    /// The candidate (several if a wildcard or group was asked for).
    pub effects: Vec<EffectValue>,
    /// RMS without it.
    pub before: Rms,
    /// RMS with it.
    pub after: Rms,
    /// Residuals with it.
    #[serde(skip)]
    pub rows: Vec<RowResidual>,
    /// Residuals with it, against everything they may be drawn against.
    #[serde(skip)]
    pub series: Vec<Series>,
    /// Parameters fitted before that it would move by more than two standard errors, in words.
    pub moved: Vec<String>,
}

impl Laboratory {
    /// Fits the model with a candidate (or a wildcard or group of them) in, without adding it.
    ///
    /// # Errors
    /// The effect is not known or is in the model already, nothing can be fitted, or cancellation.
    pub fn preview(&self, text: &str, progress: &Progress) -> Result<Preview, LaboratoryError> {
        let more = self.requested(text, progress)?;
        if let Some(dated) = self.dated_for(more.iter().map(|added| &added.id), progress)? {
            return dated.preview(text, progress);
        }
        progress.report(0.0, "fitting without it")?;
        let before = self.fit_with(&[], None, progress)?;
        progress.report(0.5, "fitting with it")?;
        let after = self.fit_with(&more, Some(&before), progress)?;
        let known = self.effect_values(&self.standard_errors(&before));
        let mut values = self.effect_values(&self.standard_errors(&after));
        // What was fitted before comes first in both.
        let effects = values.split_off(known.len());
        let rows = row_residuals(&after.problem, &after.fit, &self.split().check);
        Ok(Preview {
            before: self.rms(&before.problem, &before.fit, progress)?,
            after: self.rms(&after.problem, &after.fit, progress)?,
            series: series(&after.problem, &after.fit, &rows),
            rows,
            moved: moved(&known, &values),
            effects,
        })
    }

    /// The effects a text means, at zero, without those that are fitted already. What is searched for inside an
    /// effect is set to what the data like best.
    pub(crate) fn requested(
        &self,
        text: &str,
        progress: &Progress,
    ) -> Result<Vec<AddedEffect>, LaboratoryError> {
        if let Some(dated) = self.dated_for(effect::expand(text, self.model())?.iter(), progress)? {
            return dated.requested(text, progress);
        }
        let fitted = self.fitted_effects()?;
        let mut more = Vec::new();
        for id in effect::expand(text, self.model())? {
            if fitted.iter().any(|known| known.id.same_as(&id)) {
                continue;
            }
            if let Some(reason) = effect::not_at_these_positions(&self.context(), &id) {
                return Err(LaboratoryError::Refused(reason));
            }
            let id = self.searched(id, progress)?;
            let parameters = effect::build(&id, self.model())?.parameters().len();
            more.push(AddedEffect { id, values: vec![0.0; parameters] });
        }
        if more.is_empty() {
            return Err(LaboratoryError::Refused(format!("{text} is in the model already")));
        }
        Ok(more)
    }
}
