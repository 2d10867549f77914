//! An epoch that begins where an event of one joint was found.
//!
//! A search for change points asks more than one that tries a joint's jump at some moments: that no drift explains the rows as well, and that neighbours
//! which err alike do not make it look surer than it is. Where only the latter finds a jump, what else may have been re-set at that row
//! must be asked as well: the instrument, the base, a target.

use super::columns::mask;
use super::rivals::is_event;
use super::{Dated, Laboratory, LaboratoryError};
use crate::forward_selection::Jumps;
use crate::thresholds::JUMP_ROWS;
use plumb_calibration::arm_model::{AddedEffect, Epochs};
use plumb_calibration::effect::EffectId;
use plumb_calibration::table::Table;
use plumb_estimation::Progress;

/// Measured rows in the order of time.
struct RowsByClock<'a> {
    table: &'a Table,
    rows: Vec<usize>,
}

impl<'a> RowsByClock<'a> {
    fn of(lab: &'a Laboratory) -> Self {
        let table = lab.table();
        let is_measured = mask(&lab.measured_rows(), table.len());
        let mut rows = table.order();
        rows.retain(|row| is_measured.get(*row).copied().unwrap_or(false));
        Self { table, rows }
    }

    /// Time of a row, s; its index in the table where no time is logged, which is what an event's moment counts then.
    fn clock(&self, row: usize) -> f64 {
        match &self.table.time {
            Some(times) => times.get(row).copied().unwrap_or(f64::NAN),
            None => row as f64,
        }
    }

    /// How many rows are before a moment.
    fn begins(&self, moment: f64) -> usize {
        self.rows.partition_point(|row| self.clock(*row) < moment)
    }

    /// How many rows are before each epoch but the first, or before each change of session.
    fn starts(&self, epochs: &Epochs) -> Vec<usize> {
        match epochs {
            Epochs::Times(times) => times.iter().map(|time| self.begins(*time)).collect(),
            Epochs::Rows(first) => first.iter().map(|first| self.begins(*first as f64 - 1.0)).collect(),
            Epochs::Sessions(_) => {
                let of_row: Vec<usize> =
                    self.rows.iter().map(|row| epochs.of_row(self.table, *row)).collect();
                let changes = of_row.windows(2).enumerate().filter(|(_, pair)| pair[0] != pair[1]);
                changes.map(|(before, _)| before + 1).collect()
            }
        }
    }

    /// How many rows are before each moment at which an effect changes something at once; none for one that does not.
    fn moments(&self, id: &EffectId, epochs: Option<&Epochs>) -> Vec<usize> {
        match (id.inner, epochs) {
            _ if !is_event(id) => Vec::new(),
            (Some(moment), _) => vec![self.begins(moment)],
            (None, Some(epochs)) => self.starts(epochs),
            (None, None) => Vec::new(),
        }
    }
}

/// Whether an effect happens at one moment, which is searched for.
fn has_moment(id: &EffectId) -> bool {
    is_event(id) && id.inner.is_some()
}

/// Whether two positions in the order of the rows are too near to each other to be two jumps.
fn is_one_jump(one: usize, other: usize) -> bool {
    one.abs_diff(other) < JUMP_ROWS
}

impl Laboratory {
    /// Whether two effects change something at the same moment: one jump, of which they are two explanations, however many of them a fit would take.
    pub(crate) fn explain_one_jump(&self, one: &EffectId, other: &EffectId) -> bool {
        let (rows, epochs) = (RowsByClock::of(self), self.model().epochs.as_ref());
        let others = rows.moments(other, epochs);
        rows.moments(one, epochs).iter().any(|one| others.iter().any(|other| is_one_jump(*one, *other)))
    }

    /// Which of these are in already.
    pub(crate) fn which_are_in<'i>(
        &self,
        taken: &[AddedEffect],
        jumps: Jumps,
        asked: impl Iterator<Item = &'i EffectId>,
    ) -> Vec<bool> {
        let is_jump = |known: &AddedEffect| jumps == Jumps::AtOtherMoments && has_moment(&known.id);
        let rows = taken.iter().any(is_jump).then(|| RowsByClock::of(self));
        let is_in = |id: &EffectId| {
            let mut same = taken.iter().filter(|known| known.id.same_as(id));
            same.any(|known| match (rows.as_ref().filter(|_| is_event(id)), known.id.inner, id.inner) {
                (Some(rows), Some(one), Some(other)) => is_one_jump(rows.begins(one), rows.begins(other)),
                _ => true,
            })
        };
        asked.map(is_in).collect()
    }

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
        let rows = RowsByClock::of(self);
        let index = rows.begins(moment);
        let epochs = known.and_then(|dated| dated.laboratory.model().epochs.as_ref());
        let mut starts = epochs.map_or_else(Vec::new, |epochs| rows.starts(epochs));
        let ends = [0, rows.rows.len()];
        if ends.iter().chain(&starts).any(|start| is_one_jump(index, *start)) {
            return Ok(None);
        }
        starts.push(index);
        starts.sort_unstable();
        let (epochs, jumps) = self.named_epochs(&rows.rows, &starts);
        Ok(Some(Dated { laboratory: self.with_epochs(epochs), jumps }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{two_links, with_table};
    use plumb_calibration::effect::Site;

    /// Sixty rows, and the same ten seconds apart.
    fn plain_and_timed() -> [Laboratory; 2] {
        let plain = two_links(60, "joint_zero(*)", 0.05, 9, |_| [0.0; 2]);
        let timed = with_table(&plain, |table| {
            table.time = Some((0..60).map(|row| 10.0 * f64::from(row)).collect());
        });
        [plain, timed]
    }

    fn step(joint: usize, moment: f64) -> EffectId {
        EffectId { inner: Some(moment), ..EffectId::at("joint_step", Site::Joint(joint)) }
    }

    fn reset() -> EffectId {
        EffectId::at("base_reset", Site::Base)
    }

    #[test]
    fn events_less_than_eight_rows_apart_explain_one_jump() {
        let [plain, timed] = plain_and_timed();
        assert!(plain.explain_one_jump(&step(0, 30.0), &step(1, 30.0)));
        assert!(plain.explain_one_jump(&step(0, 30.0), &step(1, 37.0)));
        assert!(!plain.explain_one_jump(&step(0, 30.0), &step(1, 38.0)));
        // Of time, too, rows count.
        assert!(timed.explain_one_jump(&step(0, 300.0), &step(1, 370.0)));
        assert!(!timed.explain_one_jump(&step(0, 300.0), &step(1, 380.0)));
    }

    #[test]
    fn what_is_re_set_explains_the_jumps_at_which_epochs_begin() {
        let [plain, timed] = plain_and_timed();
        let by_rows = plain.with_epochs(Epochs::Rows(vec![21, 41]));
        assert!(by_rows.explain_one_jump(&reset(), &step(0, 20.0)));
        assert!(by_rows.explain_one_jump(&step(0, 40.0), &reset()));
        assert!(!by_rows.explain_one_jump(&step(0, 30.0), &reset()));
        assert!(by_rows.explain_one_jump(&reset(), &EffectId::at("joint_zero_reset", Site::Joint(0))));
        let by_time = timed.with_epochs(Epochs::Times(vec![200.0]));
        assert!(by_time.explain_one_jump(&reset(), &step(0, 200.0)));
        assert!(!by_time.explain_one_jump(&reset(), &step(0, 400.0)));
        assert!(!plain.explain_one_jump(&reset(), &step(0, 20.0)), "no epochs, no jump");
        let mut sessions = with_table(&plain, |table| {
            table.session.names = vec!["am".to_owned(), "pm".to_owned()];
            table.session.of_row = (0..60).map(|row| Some(u32::from(row >= 25))).collect();
        });
        sessions = sessions.with_epochs(Epochs::Sessions(vec!["am".to_owned(), "pm".to_owned()]));
        assert!(sessions.explain_one_jump(&reset(), &step(0, 25.0)));
        assert!(!sessions.explain_one_jump(&reset(), &step(0, 45.0)));
    }

    #[test]
    fn what_lasts_explains_no_jump() {
        let [plain, _] = plain_and_timed();
        let lasting = EffectId { inner: Some(30.0), ..EffectId::at("warm_up", Site::Joint(0)) };
        assert!(!plain.explain_one_jump(&lasting, &lasting));
    }

    #[test]
    fn a_joint_that_jumped_may_be_asked_at_other_moments() {
        let [plain, _] = plain_and_timed();
        let known = |id: EffectId| AddedEffect { id, values: vec![0.1] };
        let taken = [known(step(0, 30.0)), known(reset()), known(EffectId::at("joint_gain", Site::Joint(0)))];
        let asked = [
            step(0, 30.0),
            step(0, 37.0),
            step(0, 38.0),
            step(1, 30.0),
            reset(),
            EffectId::at("joint_gain", Site::Joint(0)),
        ];
        let are_in = |jumps| plain.which_are_in(&taken, jumps, asked.iter());
        assert_eq!(are_in(Jumps::Once), [true, true, true, false, true, true]);
        assert_eq!(are_in(Jumps::AtOtherMoments), [true, true, false, false, true, true]);
    }
}
