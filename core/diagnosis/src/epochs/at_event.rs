//! An epoch that begins where an event of one joint was found.
//!
//! A search for change points asks more than one that tries a joint's jump at some moments: that no drift explains the rows as well, and that neighbours
//! which err alike do not make it look surer than it is. Where only the latter finds a jump, what else may have been re-set at that row
//! must be asked as well: the instrument, the base, a target.

use super::columns::mask;
use super::{Dated, Laboratory, LaboratoryError};
use crate::thresholds::JUMP_ROWS;
use plumb_calibration::arm_model::Epochs;
use plumb_calibration::effect::EffectId;
use plumb_estimation::Progress;

impl Laboratory {
    /// The same laboratory with an epoch that begins at this event, beside those that its rows show. Nothing where the model has epochs of its own, the
    /// epochs are sessions, one begins at about that row already, or too few rows are before it or after it.
    ///
    /// # Errors
    /// Nothing can be fitted, or cancellation.
    pub(crate) fn dated_at(
        &self,
        event: &EffectId,
        progress: &Progress,
    ) -> Result<Option<&Dated>, LaboratoryError> {
        if let Some(known) = self.known_epochs_at_event().get() {
            return Ok(known.as_deref());
        }
        let found = self.with_epoch_at(event, progress)?.map(Box::new);
        // Another thread may have been first: it found the same.
        Ok(self.known_epochs_at_event().get_or_init(|| found).as_deref())
    }

    fn with_epoch_at(&self, event: &EffectId, progress: &Progress) -> Result<Option<Dated>, LaboratoryError> {
        let Some(moment) = event.inner.filter(|_| self.model().epochs.is_none()) else { return Ok(None) };
        let known = self.dated(progress)?;
        if known.is_some_and(|dated| matches!(dated.laboratory.model().epochs, Some(Epochs::Sessions(_)))) {
            return Ok(None);
        }
        let table = self.table();
        let is_measured = mask(&self.measured_rows(), table.len());
        let mut rows = table.order();
        rows.retain(|row| is_measured.get(*row).copied().unwrap_or(false));
        // The clock counts rows where no time is logged.
        let clock = |row: &usize| match &table.time {
            Some(times) => times.get(*row).copied().unwrap_or(f64::NAN),
            None => *row as f64,
        };
        let begins = |at: &f64| rows.partition_point(|row| clock(row) < *at);
        let place = begins(&moment);
        let mut starts: Vec<usize> = match known.and_then(|dated| dated.laboratory.model().epochs.as_ref()) {
            Some(Epochs::Times(times)) => times.iter().map(begins).collect(),
            Some(Epochs::Rows(first)) => first.iter().map(|first| begins(&(*first as f64 - 1.0))).collect(),
            Some(Epochs::Sessions(_)) | None => Vec::new(),
        };
        let ends = [0, rows.len()];
        if ends.iter().chain(&starts).any(|start| place.abs_diff(*start) < JUMP_ROWS) {
            return Ok(None);
        }
        starts.push(place);
        starts.sort_unstable();
        let (epochs, jumps) = self.named_epochs(&rows, &starts);
        Ok(Some(Dated { laboratory: self.with_epochs(epochs), jumps }))
    }
}
