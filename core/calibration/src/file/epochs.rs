//! What a model file says of epochs: `epochs: {rows: [141, 507]}`, `base: {per: session}`.

use plumb_document::Spanned;

use super::raw::{RawEpochs, RawModel, RawPer};
use super::validate::{Checked, Checker};
use crate::arm_model::{Base, Epochs};

impl Checker<'_> {
    /// Where something was re-set, if the file says so.
    pub(super) fn epochs_of(&self, raw: &RawModel) -> Option<Epochs> {
        raw.epochs.as_ref().and_then(|epochs| self.epochs(epochs).ok())
    }

    /// Where something was re-set: one of rows, times or sessions, in order.
    fn epochs(&self, typed: &Spanned<RawEpochs>) -> Checked<Epochs> {
        let RawEpochs { rows, times_s, sessions } = &typed.value;
        let epochs = match (rows, times_s, sessions) {
            (Some(rows), None, None) => Epochs::Rows(rows.clone()),
            (None, Some(times), None) => Epochs::Times(times.clone()),
            (None, None, Some(names)) => Epochs::Sessions(names.clone()),
            _ => {
                return self.fail(
                    &typed.span,
                    "`epochs` needs one of rows, times_s and sessions; write the first row of each new epoch, such as {rows: [141, 507]}",
                );
            }
        };
        let rises = match &epochs {
            Epochs::Rows(rows) => {
                rows.first().is_some_and(|first| *first > 1)
                    && rows.windows(2).all(|two| matches!(two, [one, next] if one < next))
            }
            Epochs::Times(times) => {
                times.first().is_some_and(|first| first.is_finite())
                    && times.windows(2).all(|two| matches!(two, [one, next] if one < next))
            }
            Epochs::Sessions(names) => {
                names.len() > 1 && names.iter().enumerate().all(|(at, name)| !names[..at].contains(name))
            }
        };
        match rises {
            true => Ok(epochs),
            false => self.fail(
                &typed.span,
                "these are no epochs; write where each but the first begins, in order (rows count from 1, the first epoch begins with row 1), or the names of two sessions or more",
            ),
        }
    }

    /// Where the base is, and whether every session has one of its own.
    pub(super) fn base(&self, raw: &RawModel) -> Base {
        let base = Base::new(raw.base.xyz_mm, raw.base.rpy_deg.map(f64::to_radians), raw.base.free);
        Base { per_session: self.base_per_session(raw), ..base }
    }

    /// Whether every session has a base of its own, which makes sense only where the base is free.
    fn base_per_session(&self, raw: &RawModel) -> bool {
        let Some(per) = &raw.base.per else { return false };
        // A base that is held cannot have one place in each session.
        if !raw.base.free {
            let message = "a base that is not free is the same in every session";
            self.problems.add(per.span, message, "leave out `free: false`, or `per: session`");
        }
        per.value == RawPer::Session
    }
}

#[cfg(test)]
mod tests {
    use crate::arm_model::{Epochs, Model};
    use crate::file::model_text;

    const ARM: &str = "arm: one\nconvention: distal\njoints: [{name: turn, a_mm: 100}]\ntargets: {p1: {}}\n";

    fn parse(more: &str) -> Result<Model, String> {
        Model::parse("model.yaml", &format!("{ARM}{more}\n")).map_err(|error| error.to_string())
    }

    #[test]
    fn epochs_and_a_base_for_each_session_are_read_and_written() {
        let cases = [
            ("epochs: {rows: [141, 507]}", Epochs::Rows(vec![141, 507])),
            ("epochs: {times_s: [1000.5]}", Epochs::Times(vec![1000.5])),
            ("epochs: {sessions: [a, b]}", Epochs::Sessions(vec!["a".to_owned(), "b".to_owned()])),
        ];
        for (text, epochs) in cases {
            let model = parse(&format!("base: {{per: session}}\n{text}\neffects: [base_reset]")).unwrap();
            assert_eq!(model.epochs, Some(epochs));
            assert!(model.base.per_session);
            let again = Model::parse("again.yaml", &model_text(&model)).unwrap();
            assert_eq!((again.epochs, again.base), (model.epochs, model.base));
            assert_eq!(again.effects, model.effects);
        }
    }

    #[test]
    fn what_are_no_epochs_is_refused_with_what_would_be() {
        for wrong in
            ["{rows: [1]}", "{rows: [30, 20]}", "{rows: []}", "{sessions: [a]}", "{sessions: [a, a]}"]
        {
            let reported = parse(&format!("epochs: {wrong}")).unwrap_err();
            assert!(
                reported.contains("these are no epochs") && reported.contains("rows count from 1"),
                "{reported}"
            );
        }
        let reported = parse("epochs: {rows: [5], times_s: [5]}").unwrap_err();
        assert!(reported.contains("needs one of rows, times_s and sessions"), "{reported}");
        let reported = parse("base: {per: session, free: false}").unwrap_err();
        assert!(reported.contains("the same in every session"), "{reported}");
        let reported = parse("effects: [joint_zero_reset(turn)]").unwrap_err();
        assert!(reported.contains("say so under `epochs:`"), "{reported}");
    }
}
