//! Epochs: something was re-set between two rows. Which rows, found from what a fit leaves.

mod at_event;
mod columns;
mod rivals;
mod search;
#[cfg(test)]
mod tests;

use crate::fitted::Fitted;
use crate::jump::Jump;
use crate::laboratory::{Dated, Laboratory, LaboratoryError};
use crate::thresholds::{JUMP_ROWS, SEARCH_ROWS};
use columns::Columns;
use plumb_calibration::arm_model::{AddedEffect, Epochs, Model};
use plumb_calibration::effect::{EffectId, acts_by_epoch, expand, kind};
use plumb_calibration::table::MOST_LEVELS;
use plumb_estimation::{Progress, for_each};
pub(crate) use rivals::with_rivals;
use search::Search;

/// What was found of epochs.
#[derive(Debug, Clone, PartialEq)]
struct Found {
    epochs: Epochs,
    /// The same with changes that a smooth drift explains as well: some may be jumps that a fit without the others has bent.
    with_unsure: Epochs,
    jumps: Vec<Jump>,
    /// What explains the jumps best; nothing where the epochs are sessions without a jump.
    effect: Option<EffectId>,
}

/// Rounds of looking for jumps and fitting with those that were found: jumps that are not in the fit bend the arm's geometry, and a
/// bent arm hides other jumps.
const ROUNDS: usize = 4;

impl Laboratory {
    /// The same laboratory with the epochs that its rows show, and the jumps between them; nothing where the model has epochs
    /// already, or the rows show none. Searched for once, however many questions begin with it.
    ///
    /// # Errors
    /// Nothing can be fitted, or cancellation.
    pub(crate) fn dated(&self, progress: &Progress) -> Result<Option<&Dated>, LaboratoryError> {
        if let Some(Some(known)) = self.known_epochs_at_event().get() {
            return Ok(Some(known));
        }
        if let Some(known) = self.known_epochs().get() {
            return Ok(known.as_deref());
        }
        let found = self.search_epochs(progress)?.map(Box::new);
        // Another thread may have been first: it found the same.
        Ok(self.known_epochs().get_or_init(|| found).as_deref())
    }

    fn search_epochs(&self, progress: &Progress) -> Result<Option<Dated>, LaboratoryError> {
        // Pictures of one scan lie beside each other in pose as in time: from scan to scan whatever depends on the pose jumps.
        if self.model().epochs.is_some() || self.table().is_of_stripes() {
            return Ok(None);
        }
        let thin = self.thinned(SEARCH_ROWS);
        let looked_at = thin.as_ref().unwrap_or(self);
        let fitted = looked_at.fit_with(&[], None, progress)?;
        let seen = looked_at.find_epochs(&fitted, progress)?;
        let of_a_stiffer = looked_at.epochs_of_a_stiffer_arm(&fitted, progress)?;
        let Some(first) = of_a_stiffer.as_ref().or(seen.as_ref()).cloned() else { return Ok(None) };
        let (mut found, left) = looked_at.dated_again(first, &fitted, progress)?;
        // Jumps that free geometry partly hides may be put to a number of the wrong kind: of two ways to explain them, the one that leaves less.
        if let Some(seen) = seen.filter(|seen| {
            seen.effect.is_some() && of_a_stiffer.as_ref().is_some_and(|stiffer| stiffer != seen)
        }) {
            let (other, other_left) = looked_at.dated_again(seen, &fitted, progress)?;
            if other_left < left {
                found = other;
            }
        }
        Ok(Some(Dated { laboratory: self.with_epochs(found.epochs), jumps: found.jumps }))
    }

    /// Epochs looked for again beside what explains them, until they stay; and the loss that is left then, at the scatter of the fit `without` them.
    fn dated_again(
        &self,
        mut found: Found,
        without: &Fitted<'_>,
        progress: &Progress,
    ) -> Result<(Found, f64), LaboratoryError> {
        let mut left = f64::INFINITY;
        for round in 1..ROUNDS {
            let Some(effect) = found.effect.clone() else { break };
            let epochs = if round == 1 { &found.with_unsure } else { &found.epochs };
            let with_epochs = self.with_epochs(epochs.clone());
            let better = with_epochs.fit_beside_jumps(effect, without, progress)?;
            left = better.loss(without.fit.scale);
            let Some(next) = self.find_epochs(&better, progress)? else { break };
            let is_settled = next.jumps == found.jumps;
            found = next;
            if is_settled {
                break;
            }
        }
        Ok((found, left))
    }

    /// Epochs that a fit with all its freedom hides: free geometry bends so far after a jump that no number seems to have changed. They are looked for with
    /// the geometry held as the model has it, and count where the fit with everything free, and with what explains them in, shows them too.
    fn epochs_of_a_stiffer_arm(
        &self,
        free: &Fitted<'_>,
        progress: &Progress,
    ) -> Result<Option<Found>, LaboratoryError> {
        let Some(model) = with_geometry_held(self.model()) else { return Ok(None) };
        let stiffer = self.with_model(model);
        let held = stiffer.fit_with(&[], None, progress)?;
        let Some(seen) = stiffer.find_epochs(&held, progress)? else { return Ok(None) };
        let Some(effect) = seen.effect else { return Ok(None) };
        let with_epochs = self.with_epochs(seen.epochs);
        let beside = with_epochs.fit_beside_jumps(effect, free, progress)?;
        Ok(self.find_epochs(&beside, progress)?.filter(|found| found.effect.is_some()))
    }

    fn with_epochs(&self, epochs: Epochs) -> Self {
        let mut model = self.model().clone();
        model.epochs = Some(epochs);
        self.with_model(model)
    }

    /// A fit with what explains the jumps best, from where the fit without it arrived or from the model's own start, whichever leaves less.
    fn fit_beside_jumps(
        &self,
        effect: EffectId,
        without: &Fitted<'_>,
        progress: &Progress,
    ) -> Result<Fitted<'_>, LaboratoryError> {
        let more = [AddedEffect { id: effect, values: Vec::new() }];
        // A large jump bends the arm's geometry so far that a fit from there may stop in a valley of its own.
        let near = self.fit_with(&more, Some(without), progress)?;
        let anew = self.fit_with(&more, None, progress)?;
        // The same scale for both: a fit that calls half the rows outliers has a small loss by its own.
        let scale = near.fit.scale.min(anew.fit.scale);
        Ok(if anew.loss(scale) < near.loss(scale) { anew } else { near })
    }

    /// The laboratory with the epochs its rows show, where some of these effects need epochs that the model does not have. Where no jump is seen
    /// an event that the diagnosis finds begins one.
    ///
    /// # Errors
    /// Nothing can be fitted, or cancellation.
    pub(crate) fn dated_for<'i>(
        &self,
        mut ids: impl Iterator<Item = &'i EffectId>,
        progress: &Progress,
    ) -> Result<Option<Self>, LaboratoryError> {
        match ids.any(|id| acts_by_epoch(&id.name)) {
            true => {
                if self.dated(progress)?.is_none() {
                    self.diagnose(progress)?;
                }
                Ok(self.dated(progress)?.map(|dated| dated.laboratory.clone()))
            }
            false => Ok(None),
        }
    }

    /// Those of some jumps that the rows show beside effects that were found, too. Jumps are dated before anything is known of these: what an effect of the pose does to rows
    /// that follow each other can look like one.
    ///
    /// # Errors
    /// Nothing can be fitted, or cancellation.
    pub(crate) fn jumps_beside(
        &self,
        mut jumps: Vec<Jump>,
        found: &[AddedEffect],
        near: &Fitted<'_>,
        progress: &Progress,
    ) -> Result<Vec<Jump>, LaboratoryError> {
        if jumps.is_empty() {
            return Ok(jumps);
        }
        let fitted = self.fit_with(found, Some(near), progress)?;
        let again = self.find_epochs(&fitted, progress)?.map_or_else(Vec::new, |found| found.jumps);
        let order = self.table().order();
        let index_of = |jump: &Jump| order.iter().position(|row| row + 1 == jump.between_rows[1]);
        let seen: Vec<usize> = again.iter().filter_map(index_of).collect();
        jumps.retain(|jump| {
            index_of(jump).is_some_and(|index| seen.iter().any(|other| index.abs_diff(*other) < JUMP_ROWS))
        });
        Ok(jumps)
    }

    /// The epochs that the rows of a fit show.
    fn find_epochs(
        &self,
        fitted: &Fitted<'_>,
        progress: &Progress,
    ) -> Result<Option<Found>, LaboratoryError> {
        let columns = Columns::of(self, fitted, progress)?;
        if may_show_a_jump(columns.rows.len(), fitted.fit.rank())
            && let Some(changes) = starts(&columns)
        {
            let (epochs, jumps) = self.named_epochs(&columns.rows, &changes.abrupt);
            let (with_unsure, _) = self.named_epochs(&columns.rows, &changes.all);
            let effect = columns.ids.get(changes.number).cloned();
            return Ok(Some(Found { epochs, with_unsure, jumps, effect }));
        }
        let sessions = self.sessions_as_epochs();
        Ok(sessions.map(|epochs| Found {
            with_unsure: epochs.clone(),
            epochs,
            jumps: Vec::new(),
            effect: None,
        }))
    }

    /// Found epochs as sessions where each jump lies between two of them, else by time where it is logged, else by row.
    fn named_epochs(&self, rows: &[usize], starts: &[usize]) -> (Epochs, Vec<Jump>) {
        let table = self.table();
        let around = |start: &usize| Some((*rows.get(start.checked_sub(1)?)?, *rows.get(*start)?));
        let pairs: Vec<(usize, usize)> = starts.iter().filter_map(around).collect();
        let session = |row: usize| table.session.of_row.get(row).copied().flatten();
        let between_sessions = |(before, after): &(usize, usize)| session(*before) != session(*after);
        let time = |row: usize| table.time.as_ref().and_then(|times| times.get(row)).copied();
        let line = |row: usize| table.lines.get(row).copied().unwrap_or(0);
        let jumps: Vec<Jump> = pairs
            .iter()
            .map(|(before, after)| Jump {
                between_rows: [before + 1, after + 1],
                between_lines: [line(*before), line(*after)],
                at_s: time(*after),
            })
            .collect();
        let epochs = match self.sessions_as_epochs() {
            Some(sessions) if pairs.iter().all(between_sessions) => sessions,
            // By time an epoch still holds when rows are added to the table or put in another order.
            _ if table.time.is_some() => Epochs::Times(jumps.iter().filter_map(|jump| jump.at_s).collect()),
            _ => Epochs::Rows(pairs.iter().map(|(_, after)| after + 1).collect()),
        };
        (epochs, jumps)
    }

    /// The table's sessions, where there are several and not too many.
    fn sessions_as_epochs(&self) -> Option<Epochs> {
        let names = &self.table().session.names;
        (2..=MOST_LEVELS).contains(&names.len()).then(|| Epochs::Sessions(names.clone()))
    }
}

/// Whether so many rows are enough for an epoch on either side, beside so many numbers that are fitted.
fn may_show_a_jump(rows: usize, rank: usize) -> bool {
    rows >= 2 * JUMP_ROWS + rank
}

/// The same model with no number of its geometry free; nothing where none is.
fn with_geometry_held(model: &Model) -> Option<Model> {
    let is_of_geometry = |written: &str| {
        let of_group = |id: &EffectId| kind(&id.name).is_some_and(|kind| kind.geometry_group);
        expand(written, model).is_ok_and(|ids| ids.iter().all(of_group))
    };
    let free: Vec<String> = model.free.iter().filter(|written| !is_of_geometry(written)).cloned().collect();
    (free.len() < model.free.len()).then(|| Model { free, ..model.clone() })
}

/// Change points of the number that explains the rows best by its jumps.
#[derive(Debug, PartialEq)]
struct Starts {
    number: usize,
    /// The first row of each new epoch, as indices among the rows looked at, where the number jumps.
    abrupt: Vec<usize>,
    /// The same with those where a smooth drift would explain the rows as well.
    all: Vec<usize>,
}

/// The number that explains the rows best when it changes at some of them, and these change points; nothing where no number does. Each number is
/// judged by its jumps alone: a number that many small steps let follow a slow drift explains much, and none of it by something that was re-set.
fn starts(columns: &Columns) -> Option<Starts> {
    let numbers: Vec<usize> = (0..columns.steps.nrows()).collect();
    let found = for_each(&numbers, |number| {
        let search = Search::new(columns, *number);
        let changes = search.changes();
        let mut all = changes.starts.clone();
        all.sort_unstable();
        let abrupt = search.abrupt(changes)?;
        Some((abrupt.bic, Starts { number: *number, abrupt: abrupt.starts, all }))
    });
    let best = found.into_iter().flatten().min_by(|one, other| one.0.total_cmp(&other.0));
    best.map(|(_, starts)| starts)
}
