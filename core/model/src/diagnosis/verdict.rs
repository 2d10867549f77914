//! From stages to one verdict.

use super::misfit::Misfit;
use super::outcome::{Candidate, EffectPlace, Located, Named, Verdict};
use super::search::{CLOSE, Contender, LEVEL, Stage};
use crate::effect::EffectId;
use crate::fit::Machine;
use crate::floor::Floor;
use crate::laboratory::{Laboratory, LaboratoryError};
use crate::progress::Progress;

use super::score::Probe;

/// What the search came to.
pub(crate) struct Finding<'a> {
    /// The stage without the effect in question (others that belong may be in it).
    pub(crate) stage: Stage<'a>,
    /// What is left when everything that passed is in; nothing if the floor is unknown.
    pub(crate) left_over: Option<Misfit>,
    /// The verdict.
    pub(crate) verdict: Verdict,
    /// Contenders no worse than the best by more than the information criterion can tell.
    pub(crate) close: Vec<usize>,
    /// Effects that belong besides the one in question.
    pub(crate) besides: Vec<EffectId>,
}

impl Laboratory {
    /// Searches, then looks at the one effect that matters most with all others in.
    pub(crate) fn find<'a>(
        &'a self,
        floor: &Floor,
        probes: &[Probe],
        progress: &Progress,
    ) -> Result<Finding<'a>, LaboratoryError> {
        let mut stages = self.forward(probes, progress)?;
        let last = stages.len() - 1;
        let left_over = stages.get(last).and_then(|stage| Misfit::of(&stage.fitted, floor));
        let taken: Vec<_> = stages.get(last).map(|stage| stage.taken.clone()).unwrap_or_default();
        let mut stage = match taken.len() {
            0 | 1 => stages.swap_remove(0),
            _ => {
                progress.report(0.7, "weighing what was found")?;
                let full = stages.swap_remove(last);
                let mut best: Option<(f64, Stage<'a>)> = None;
                for index in 0..taken.len() {
                    let mut others = taken.clone();
                    others.remove(index);
                    let without = self.stage(others, Some(&full.fitted), probes, progress)?;
                    let needed = without.bic - full.bic;
                    if best.as_ref().is_none_or(|(least, _)| needed > *least) {
                        best = Some((needed, without));
                    }
                }
                match best {
                    Some((_, stage)) => stage,
                    None => full,
                }
            }
        };
        let besides = stage.taken.iter().map(|taken| taken.id.clone()).collect();
        let close = close_contenders(&mut stage);
        let misfit = Misfit::of(&stage.fitted, floor);
        let verdict = judge(&stage, &close, misfit, floor);
        Ok(Finding { stage, left_over, verdict, close, besides })
    }
}

/// The best plausible contender and all that come close to it, by their places in the list.
fn close_contenders(stage: &mut Stage<'_>) -> Vec<usize> {
    let plausible = |contender: &Contender| contender.score.plausible && contender.holm_p < LEVEL;
    let Some(best) =
        stage.contenders.iter().find(|contender| plausible(contender)).map(|contender| contender.bic)
    else {
        return Vec::new();
    };
    let near = |contender: &Contender| plausible(contender) && contender.bic - best < CLOSE;
    stage
        .contenders
        .iter()
        .enumerate()
        .filter(|(_, contender)| near(contender))
        .map(|(index, _)| index)
        .collect()
}

fn judge(stage: &Stage<'_>, close: &[usize], misfit: Option<Misfit>, floor: &Floor) -> Verdict {
    let contenders: Vec<&Contender> = close.iter().filter_map(|index| stage.contenders.get(*index)).collect();
    let Some(best) = contenders.first() else {
        return match (misfit, floor.scale) {
            (Some(misfit), _) if misfit.fires() => Verdict::Unknown,
            (_, Some(_)) => Verdict::AtFloor,
            (_, None) => Verdict::FloorUnknown,
        };
    };
    let one_place = contenders.iter().all(|contender| contender.id.spot == best.id.spot);
    match (contenders.len(), best.passes()) {
        (1, true) => Verdict::Named,
        _ if one_place => Verdict::Located,
        _ => Verdict::Tied,
    }
}

/// Which and where, in the contract's words.
pub(crate) fn effect_place(machine: &Machine<'_>, id: &EffectId) -> EffectPlace {
    let joint = |index: usize| machine.model.chain.joints.get(index).map(|joint| joint.name.clone());
    EffectPlace {
        effect: id.name.clone(),
        place: id.place(machine.model),
        with: id.with.and_then(joint),
        n: id.order,
        of: id.of.map(|of| of.name().to_owned()),
    }
}

impl Finding<'_> {
    fn at(&self, index: usize) -> Option<&Contender> {
        self.stage.contenders.get(index)
    }

    /// The contender in question.
    pub(crate) fn best(&self) -> Option<&Contender> {
        self.close.first().and_then(|index| self.at(*index))
    }

    /// The named effect, if that is the verdict.
    pub(crate) fn named(&self) -> Option<Named> {
        let best = self.best().filter(|_| self.verdict == Verdict::Named)?;
        let size = self.size(best);
        let effect = effect_place(&self.stage.fitted.machine, &best.id);
        Some(Named { effect, size: size.value, unit: size.unit.to_owned(), se: size.error })
    }

    fn size(&self, contender: &Contender) -> crate::effect::Size {
        let built = crate::effect::build(&contender.id, self.stage.fitted.machine.model);
        built.map_or(contender.score.size, |effect| effect.size(&contender.values, &contender.covariance))
    }

    /// The known place, if that is the verdict.
    pub(crate) fn located(&self) -> Option<Located> {
        let best = self.best().filter(|_| self.verdict == Verdict::Located)?;
        let mut family: Vec<String> = Vec::new();
        for contender in self.close.iter().filter_map(|index| self.at(*index)) {
            if !family.contains(&contender.id.name) {
                family.push(contender.id.name.clone());
            }
        }
        Some(Located { place: best.id.place(self.stage.fitted.machine.model), family })
    }

    /// What cannot be told apart, if there is more than one.
    pub(crate) fn tied(&self) -> Vec<EffectPlace> {
        if self.close.len() < 2 {
            return Vec::new();
        }
        let places = self.close.iter().filter_map(|index| self.at(*index));
        places.map(|contender| effect_place(&self.stage.fitted.machine, &contender.id)).collect()
    }

    /// The likeliest candidates, with why each is not the name.
    pub(crate) fn candidates(&self, count: usize) -> Vec<Candidate> {
        let machine = &self.stage.fitted.machine;
        let best = self.stage.contenders.first().map_or(0.0, |contender| contender.bic);
        let rows = self.stage.fitted.fit.rows.len().max(1) as f64;
        let unit = crate::floor::typical_sigma(machine);
        let candidate = |contender: &Contender| {
            let size = self.size(contender);
            let noise = self.stage.scale;
            let visible = contender.score.strength * (1.0 - contender.score.absorbed).max(1e-12).sqrt();
            Candidate {
                effect: effect_place(machine, &contender.id),
                label: contender.id.label(machine.model),
                holm_p: contender.holm_p,
                delta_bic: contender.bic - best,
                cv_gain: contender.gains.first().map(|gain| signed_root(gain.total / rows) * unit),
                size: size.value,
                unit: size.unit.to_owned(),
                se: size.error,
                plausible: contender.score.plausible,
                absorbed: contender.score.absorbed,
                explains_mm: (contender.score.gain / rows).sqrt() * unit,
                smallest: if visible > 0.0 { POWER * noise / visible } else { f64::MAX },
                rejected: self.rejected(contender),
            }
        };
        self.stage.contenders.iter().take(count).map(candidate).collect()
    }

    fn rejected(&self, contender: &Contender) -> Option<String> {
        let is_best = self.best().is_some_and(|best| best.id == contender.id);
        let close =
            self.close.iter().filter_map(|index| self.at(*index)).any(|other| other.id == contender.id);
        if is_best && self.verdict == Verdict::Named {
            return None;
        }
        Some(if contender.holm_p >= LEVEL {
            format!("chance alone would do as much (p {:.2} after Holm)", contender.holm_p)
        } else if !contender.score.plausible {
            "no real machine has such a size or sign".to_owned()
        } else if close && self.close.len() > 1 {
            "others explain it as well".to_owned()
        } else if contender.refitted && !contender.gains.iter().all(super::trial::Gain::counts) {
            "it does not predict rows it has not seen".to_owned()
        } else {
            "another explains it better".to_owned()
        })
    }
}

/// Standard errors an effect must have to be seen four times in five at Holm's level among a hundred candidates.
const POWER: f64 = 4.6;

fn signed_root(value: f64) -> f64 {
    value.signum() * value.abs().sqrt()
}
