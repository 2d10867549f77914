//! Whether an effect predicts rows it has not seen: the gain of blocked cross-validation, with its standard error.

use crate::cross_validation::{
    Derivatives, LeftOut, holdout_blocks, joint_blocks, pose_groups, region_blocks, session_blocks,
};
use crate::fitted::Fitted;
use crate::split::Holdout;
use crate::thresholds::GAIN_ERRORS;
use plumb_calibration::arm_model::Epochs;
use plumb_calibration::effect::EffectId;
use plumb_calibration::fit::Fit;
use plumb_estimation::for_each;

/// Gain of cross-validation over one way of leaving blocks out.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gain {
    /// Fall of the loss, in squared sigmas.
    pub(crate) total: f64,
    /// One standard error of it.
    pub(crate) error: f64,
}

/// Root mean square errors of the points of rows that are left out in turn, in the way in which rows are held out, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Promise {
    /// Predicted without the effect.
    pub(crate) before_mm: f64,
    /// With the effect added and everything fitted anew.
    pub(crate) after_mm: f64,
}

impl Promise {
    /// From how the same rows are predicted both ways; nothing where no point was measured.
    fn of(before: &[Option<LeftOut>], after: &[Option<LeftOut>]) -> Option<Self> {
        let both = before.iter().zip(after);
        let both = both.filter_map(|(before, after)| Some((before.as_ref()?, after.as_ref()?)));
        let (before, after): (Vec<&LeftOut>, Vec<&LeftOut>) = both.unzip();
        Some(Self { before_mm: root_mean_square(&before)?, after_mm: root_mean_square(&after)? })
    }
}

/// Of the points of some rows, mm; nothing of none.
fn root_mean_square(rows: &[&LeftOut]) -> Option<f64> {
    let squares: Vec<f64> = rows.iter().flat_map(|row| row.squares.iter().copied()).collect();
    (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
}

impl Gain {
    /// From the fall of the loss at every pose; nothing of fewer than three.
    pub(crate) fn over(reductions: &[f64]) -> Option<Self> {
        let count = reductions.len() as f64;
        if count < 3.0 {
            return None;
        }
        let total: f64 = reductions.iter().sum();
        let mean = total / count;
        let variance =
            reductions.iter().map(|reduction| (reduction - mean).powi(2)).sum::<f64>() / (count - 1.0);
        // Variance of a sum of n falls: n times that of one.
        Some(Self { total, error: (variance * count).sqrt() })
    }

    /// Above one standard error.
    pub(crate) fn counts(&self) -> bool {
        self.total > GAIN_ERRORS * self.error
    }
}

/// How one fit predicts rows that are left out, for every way of leaving blocks out that applies to effects: regions, ranges of
/// joints, sessions. Each way is worked out once. What is promised goes by the way in which rows are held out.
pub(crate) struct Judge {
    regions: Way,
    /// The way in which rows are held out; nothing where that is regions.
    promised: Option<Way>,
    joints: Vec<Way>,
    sessions: Option<Way>,
    poses: Vec<Vec<usize>>,
}

/// A way of leaving blocks out, and how rows are predicted so; nothing if too little is left to fit.
struct Way {
    blocks: Vec<Vec<usize>>,
    rows: Option<Vec<Option<LeftOut>>>,
}

impl Way {
    fn promise(&self, derivatives: &Derivatives<'_>, after: &Fit) -> Option<Promise> {
        Promise::of(self.rows.as_ref()?, &derivatives.left_out(after, &self.blocks)?)
    }
}

impl Judge {
    /// Looks at what is fitted before any of the effects in `ids` is in.
    pub(crate) fn of<'i>(
        before: &Fitted<'_>,
        holdout: Holdout,
        ids: impl Iterator<Item = &'i EffectId>,
    ) -> Self {
        let (problem, fit) = (&before.problem, &before.fit);
        let (table, rows) = (problem.table, &fit.rows);
        let derivatives = Derivatives::of(problem, fit);
        let mut asked: Vec<usize> = ids.filter_map(EffectId::joint).collect();
        asked.sort_unstable();
        asked.dedup();
        let by_regions = region_blocks(table, rows);
        let promised = holdout_blocks(table, rows, holdout);
        let has_own_way = promised != by_regions;
        let mut ways = vec![by_regions];
        ways.extend(has_own_way.then_some(promised));
        ways.extend((0..problem.model.chain.len()).map(|joint| match asked.contains(&joint) {
            true => joint_blocks(table, rows, joint),
            false => Vec::new(),
        }));
        // A session that is left out says nothing of what it has of its own.
        if !matches!(problem.model.epochs, Some(Epochs::Sessions(_))) {
            ways.extend(session_blocks(table, rows));
        }
        let left_out = for_each(&ways, |blocks| derivatives.left_out(fit, blocks));
        let mut ways = ways.into_iter().zip(left_out).map(|(blocks, rows)| Way { blocks, rows });
        let regions = ways.next().unwrap_or_else(|| Way { blocks: Vec::new(), rows: None });
        let promised = if has_own_way { ways.next() } else { None };
        let joints = ways.by_ref().take(problem.model.chain.len()).collect();
        let (sessions, poses) = (ways.next(), pose_groups(table, rows));
        Self { regions, promised, joints, sessions, poses }
    }

    /// How much better `after`, whose derivatives these are, predicts left-out blocks, for every way that applies to the effect, and what adding it promises.
    pub(crate) fn gains(
        &self,
        after: &Fit,
        derivatives: &Derivatives<'_>,
        id: &EffectId,
    ) -> (Vec<Gain>, Option<Promise>) {
        let joint = id.joint().and_then(|joint| self.joints.get(joint));
        let regions = derivatives.left_out(after, &self.regions.blocks);
        let promise = match &self.promised {
            Some(way) => way.promise(derivatives, after),
            None => {
                self.regions.rows.as_ref().zip(regions.as_ref()).and_then(|(old, new)| Promise::of(old, new))
            }
        };
        let by_regions = regions.and_then(|new| self.gain(&self.regions, &new));
        let others = [joint, self.sessions.as_ref()].into_iter().flatten();
        let by_others = others.filter_map(|way| self.gain(way, &derivatives.left_out(after, &way.blocks)?));
        (by_regions.into_iter().chain(by_others).collect(), promise)
    }

    /// What adding an effect promises, without the other ways of leaving rows out.
    pub(crate) fn promise(&self, after: &Fitted<'_>) -> Option<Promise> {
        let derivatives = Derivatives::of(&after.problem, &after.fit);
        self.promised.as_ref().unwrap_or(&self.regions).promise(&derivatives, &after.fit)
    }

    fn gain(&self, way: &Way, new: &[Option<LeftOut>]) -> Option<Gain> {
        let old = way.rows.as_ref()?;
        // A row that one of the two fits does not predict is compared in neither.
        let reductions = old.iter().zip(new).map(|(old, new)| {
            let [old, new] = [old.as_ref()?, new.as_ref()?].map(|row| row.distance.0.powi(2));
            Some(old - new)
        });
        let reductions: Vec<Option<f64>> = reductions.collect();
        // Replicates to one pose share what the model does wrong there: they count as one.
        let of_poses =
            self.poses.iter().map(|rows| rows.iter().filter_map(|row| *reductions.get(*row)?).sum());
        Gain::over(&of_poses.collect::<Vec<f64>>())
    }
}

#[cfg(test)]
mod tests;
