//! Adding an effect, and taking one out.

use serde::Serialize;

use super::comparison::{Comparison, EffectValue, Rms};
use super::{Laboratory, LaboratoryError, drop_map};
use crate::fitted::Fitted;
use plumb_calibration::arm_model::{AddedEffect, Model, Target};
use plumb_calibration::effect;
use plumb_estimation::Progress;

/// What adding or removing an effect did.
#[derive(Debug, Clone, Serialize)]
pub struct Addition {
    /// The model as it is now: all fitted values in.
    #[serde(skip)]
    pub model: Model,
    /// What was added, with sizes; nothing when something was removed.
    pub added: Vec<EffectValue>,
    /// RMS before.
    pub before: Rms,
    /// RMS now.
    pub rms_mm: Rms,
    /// Parameters fitted before that moved by more than two standard errors, in words.
    pub moved: Vec<String>,
    /// Everything else about the model as it is now.
    #[serde(skip)]
    pub comparison: Comparison,
}

/// Standard errors by which a parameter must move to be worth a word.
const MOVED: f64 = 2.0;

impl Laboratory {
    /// Adds an effect, a wildcard or a group, refitting everything jointly.
    ///
    /// # Errors
    /// The effect is not known or in the model already, nothing can be fitted, or cancellation.
    pub fn add(&self, text: &str, progress: &Progress) -> Result<Addition, LaboratoryError> {
        let more = self.requested(text, progress)?;
        self.take_in(more, progress)
    }

    /// The model with everything that is free as the table says, and nothing added.
    ///
    /// # Errors
    /// Nothing can be fitted, or cancellation.
    pub fn accept(&self, progress: &Progress) -> Result<Addition, LaboratoryError> {
        if let Some(plain) = self.without_map() {
            return plain.accept(progress);
        }
        let before = self.compare(progress)?;
        let fitted = self.fit_with(&[], None, progress)?;
        let values = self.effect_values(&self.standard_errors(&fitted));
        let comparison = self.comparison(&fitted.problem, &fitted.fit, progress)?;
        Ok(Addition {
            model: self.adopted(&fitted),
            added: values,
            before: before.rms_mm,
            rms_mm: comparison.rms_mm,
            moved: Vec::new(),
            comparison,
        })
    }

    pub(crate) fn take_in(
        &self,
        more: Vec<AddedEffect>,
        progress: &Progress,
    ) -> Result<Addition, LaboratoryError> {
        if let Some(plain) = self.without_map() {
            return plain.take_in(more, progress);
        }
        if let Some(dated) = self.dated_for(more.iter().map(|added| &added.id), progress)? {
            return dated.take_in(more, progress);
        }
        progress.report(0.0, "fitting without it")?;
        let before = self.fit_with(&[], None, progress)?;
        progress.report(0.3, "fitting with it")?;
        let after = self.fit_with(&more, Some(&before), progress)?;
        let known = self.effect_values(&self.standard_errors(&before));
        let mut values = self.effect_values(&self.standard_errors(&after));
        let added = values.split_off(known.len());
        let model = self.adopted(&after);
        let comparison = self.comparison(&after.problem, &after.fit, progress)?;
        Ok(Addition {
            model,
            added,
            before: self.rms(&before.problem, &before.fit, progress)?,
            rms_mm: comparison.rms_mm,
            moved: moved(&known, &values),
            comparison,
        })
    }

    /// Takes an effect (a wildcard, a group) out of `effects:` and `free:`, and refits the rest.
    ///
    /// # Errors
    /// It is not in the model, nothing can be fitted, or cancellation.
    pub fn remove(&self, text: &str, progress: &Progress) -> Result<Addition, LaboratoryError> {
        let before = self.compare(progress)?;
        let smaller =
            Laboratory::new(without(self.model(), text)?, self.table().clone(), self.options().clone())?;
        // From the start, not from where the larger fit was: what was taken out has bent the rest.
        let fitted = smaller.fit_with(&[], None, progress)?;
        let comparison = smaller.comparison(&fitted.problem, &fitted.fit, progress)?;
        let now: Vec<EffectValue> = comparison.effects.clone();
        let stayed: Vec<EffectValue> = before
            .effects
            .iter()
            .filter(|old| now.iter().any(|new| new.label == old.label))
            .cloned()
            .collect();
        Ok(Addition {
            model: smaller.adopted(&fitted),
            added: Vec::new(),
            before: before.rms_mm,
            rms_mm: comparison.rms_mm,
            moved: moved(&stayed, &now),
            comparison,
        })
    }

    /// The model with everything a fit found written into it.
    pub(crate) fn adopted(&self, fitted: &Fitted<'_>) -> Model {
        let state = &fitted.fit.state;
        let mut model = self.model().clone();
        model.base.pose = state.base;
        for (target, (xyz, rotation)) in
            model.targets.iter_mut().zip(state.targets.iter().zip(&state.rotations))
        {
            *target = Target { xyz: *xyz, rotation: *rotation, ..target.clone() };
        }
        for (board, pose) in model.boards.iter_mut().zip(&state.boards) {
            board.pose = *pose;
        }
        for (surface, shape) in model.surfaces.iter_mut().zip(&state.surfaces) {
            surface.shape.clone_from(shape);
        }
        let parts = fitted.problem.effects().cloned().zip(&state.effects);
        let mut all: Vec<AddedEffect> =
            parts.map(|(id, values)| AddedEffect { id, values: values.clone() }).collect();
        // The parts of a fit are what is free, then what was added.
        let free = self.free_effects().map_or(0, |free| free.len()).min(all.len());
        model.effects = all.split_off(free);
        model.fitted = all;
        model
    }
}

/// Parameters that moved by more than two standard errors, in words.
pub(crate) fn moved(old: &[EffectValue], new: &[EffectValue]) -> Vec<String> {
    let pairs =
        old.iter().filter_map(|old| new.iter().find(|new| new.label == old.label).map(|new| (old, new)));
    pairs
        .filter(|(old, new)| {
            !old.held && !new.held && (old.size - new.size).abs() > MOVED * old.se.max(new.se)
        })
        .map(|(old, new)| format!("{}: {:.5} -> {:.5} {}", old.label, old.size, new.size, new.unit))
        .collect()
}

/// What the residual map is called where an effect's name could be.
pub(crate) const RESIDUAL_MAP: &str = "residual_map";

/// A model without an effect, or without its residual map, which any change of the effects takes out as well: it was fitted to what they left.
///
/// # Errors
/// It is not in there.
pub fn without(model: &Model, text: &str) -> Result<Model, LaboratoryError> {
    let mut smaller = model.clone();
    drop_map(&mut smaller);
    if text.trim() == RESIDUAL_MAP {
        return match model.residual_map {
            Some(_) => Ok(smaller),
            None => Err(LaboratoryError::Refused("the model has no residual map to take out".to_owned())),
        };
    }
    let unwanted = effect::expand(text, model)?;
    smaller.effects.retain(|added| !unwanted.iter().any(|id| id.same_as(&added.id)));
    smaller.corrections.retain(|correction| !unwanted.iter().any(|id| id.same_as(&correction.id)));
    drop_map(&mut smaller);
    let mut free = Vec::new();
    for pattern in &model.free {
        let ids = effect::expand(pattern, model)?;
        // A wildcard of which one is unwanted is written out, so that the others stay free.
        if ids.iter().all(|id| !unwanted.iter().any(|other| other.same_as(id))) {
            free.push(pattern.clone());
        } else {
            let kept = ids.iter().filter(|id| !unwanted.iter().any(|other| other.same_as(id)));
            free.extend(kept.map(|id| model.label(id)));
        }
    }
    smaller.fitted.retain(|added| !unwanted.iter().any(|id| id.same_as(&added.id)));
    if smaller.effects.len() == model.effects.len() && free == model.free {
        let mut there: Vec<String> = model.effects.iter().map(|added| model.label(&added.id)).collect();
        there.extend(model.free.iter().cloned());
        let there = if there.is_empty() { "nothing has been added".to_owned() } else { there.join(", ") };
        return Err(LaboratoryError::Refused(format!("{text} is not in the model; there is: {there}")));
    }
    smaller.free = free;
    Ok(smaller)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::claim::Claim;
    use crate::testing::two_links;

    /// A value so large, with its standard error.
    fn value(label: &str, size: f64, se: f64) -> EffectValue {
        EffectValue {
            effect: label.to_owned(),
            site: String::new(),
            label: label.to_owned(),
            size,
            unit: "deg".to_owned(),
            se,
            plausible: true,
            held: false,
            held_because: None,
            added: false,
            claim: Claim::Mechanism,
            may_be: Vec::new(),
        }
    }

    #[test]
    fn a_value_has_moved_beyond_two_of_the_larger_standard_error() {
        let by = |errors: f64| moved(&[value("a", 1.0, 0.1)], &[value("a", 1.0 - 0.2 * errors, 0.2)]);
        assert_eq!(by(0.99 * MOVED), Vec::<String>::new());
        assert_eq!(by(1.01 * MOVED), ["a: 1.00000 -> 0.59600 deg"]);
        let held = EffectValue { held: true, ..value("a", 9.0, 0.1) };
        assert!(moved(&[held], &[value("a", 0.0, 0.1)]).is_empty(), "what was held was not known");
        assert!(moved(&[value("a", 9.0, 0.1)], &[value("b", 0.0, 0.1)]).is_empty());
    }

    #[test]
    fn what_is_added_takes_the_error_away_and_what_is_taken_out_brings_it_back() {
        let lab = two_links(40, "joint_zero(*)", 0.05, 31, |q| [0.0, 0.01 * q[1]]);
        let progress = Progress::unwatched();
        let added = lab.add("joint_gain(elbow)", &progress).unwrap();
        assert_eq!((added.added.len(), added.added[0].label.as_str()), (1, "joint_gain(elbow)"));
        assert!((added.added[0].size - 0.01).abs() < 4.0 * added.added[0].se);
        assert!(added.before.fit > 0.5 && added.rms_mm.fit < 0.12, "{:?} {:?}", added.before, added.rms_mm);
        let labels: Vec<String> = added.model.effects.iter().map(|one| lab.model().label(&one.id)).collect();
        assert_eq!(labels, ["joint_gain(elbow)"]);
        assert_eq!(added.model.fitted.len(), 2, "the zeros are kept apart");
        let grown = Laboratory::new(added.model, lab.table().clone(), lab.options().clone()).unwrap();
        assert!(
            grown
                .add("joint_gain(elbow)", &progress)
                .unwrap_err()
                .to_string()
                .contains("in the model already")
        );
        let removed = grown.remove("joint_gain(elbow)", &progress).unwrap();
        assert!(removed.model.effects.is_empty() && removed.added.is_empty());
        assert!((removed.rms_mm.fit - added.before.fit).abs() < 1e-6 && removed.before.fit < 0.12);
        let accepted = lab.accept(&progress).unwrap();
        assert_eq!(accepted.before.fit, accepted.rms_mm.fit);
        assert_eq!(accepted.model.fitted.len(), 2);
    }

    #[test]
    fn what_stays_in_the_model_is_said_to_move_where_an_effect_comes_in_and_where_it_goes() {
        // The mean of a cosine over the elbow's range is no zero, and the elbow's zero takes it up.
        let lab = two_links(80, "joint_zero(*)", 0.05, 31, |q| [0.0, 0.01 * q[1].cos()]);
        let progress = Progress::unwatched();
        let added = lab.add("joint_harmonic(elbow, 1)", &progress).unwrap();
        let grown = Laboratory::new(added.model, lab.table().clone(), lab.options().clone()).unwrap();
        let removed = grown.remove("joint_harmonic(elbow, 1)", &progress).unwrap();
        for moved in [&added.moved, &removed.moved] {
            assert!(moved.iter().any(|one| one.starts_with("joint_zero(elbow): ")), "{moved:?}");
        }
    }

    #[test]
    fn a_candidate_is_previewed_as_it_would_be_added_and_the_model_stays() {
        let lab = two_links(40, "joint_zero(*)", 0.05, 31, |q| [0.0, 0.01 * q[1]]);
        let progress = Progress::unwatched();
        let seen = lab.preview("joint_gain(elbow)", &progress).unwrap();
        let added = lab.add("joint_gain(elbow)", &progress).unwrap();
        assert_eq!((seen.effects, seen.before, seen.after), (added.added, added.before, added.rms_mm));
        assert_eq!((seen.rows.len(), seen.moved), (40, added.moved));
        assert!(lab.model().effects.is_empty());
    }

    #[test]
    fn one_of_a_wildcard_is_taken_out_and_the_others_stay_free() {
        let lab = two_links(8, "joint_zero(*)", 0.05, 32, |_| [0.0; 2]);
        let smaller = without(lab.model(), "joint_zero(elbow)").unwrap();
        assert_eq!(smaller.free, ["joint_zero(shoulder)"]);
        assert!(without(lab.model(), "joint_zero(*)").unwrap().free.is_empty());
        let refused = without(lab.model(), "joint_gain(elbow)").unwrap_err().to_string();
        assert_eq!(refused, "joint_gain(elbow) is not in the model; there is: joint_zero(*)");
        assert!(without(lab.model(), "residual_map").unwrap_err().to_string().contains("no residual map"));
    }
}
